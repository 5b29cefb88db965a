//! Sweeps through the lattice, away from light points.

use super::bricks::{Bricks, EDGE};
use super::course::{Axes, Course};
use super::fan::Fan;
use super::lattice::Lattice;
use super::slab::Slab;
use super::texels::PlaneOfBrick;
use super::{Aim, Surroundings};
use crate::integrator::Limits;
use crate::medium::Medium;
use crate::simd::{Kernel, Lanes, Level};
use rayon::prelude::*;

/// All sweeps, and how far they are.
#[derive(Debug)]
pub(super) struct Sweeps {
    /// The last one comes first.
    sweeps: Vec<Sweep>,
}

/// A sweep along an axis, for light points in whose direction rays cross its planes most steeply.
#[derive(Debug)]
struct Sweep {
    course: Course,
    points: Vec<usize>,
    /// `None` before it begins.
    under_way: Option<UnderWay>,
}

#[derive(Debug)]
struct UnderWay {
    fans: Vec<Fan>,
    slab: Slab,
    stage: Stage,
}

/// What comes next of a slab. Each takes milliseconds, so that a stop is not waited for.
#[derive(Clone, Copy, Debug)]
enum Stage {
    /// The slab itself.
    Advance,
    /// Its matter at the plane of this number.
    Fill(usize),
    /// The fan of this number passes it.
    Pass(usize),
    /// Texels from the brick of this number on.
    Write(usize),
}

/// By the axis from plane to plane. Lanes go along x where they can, since matter is stored so.
const AXES: [Axes; 3] = [Axes { u: 1, v: 2, w: 0 }, Axes { u: 0, v: 2, w: 1 }, Axes { u: 0, v: 1, w: 2 }];

/// Memory of the rays of a sweep, as long as there are more than one fan.
const MOST_BYTES: usize = 128 << 20;

/// About the most bytes that a sweep takes, for so many points.
pub(super) fn most_bytes(texels: [usize; 3], points: usize) -> u64 {
    let mut longest = texels;
    longest.sort_unstable();
    let plane = longest[1] as u64 * longest[2] as u64;
    let fans = plane.saturating_mul(Fan::BYTES_OF_RAY as u64).saturating_mul(points as u64);
    fans.min(MOST_BYTES as u64) + plane * (EDGE as u64 + 1) * size_of::<f32>() as u64
}

impl Aim {
    /// Whether a sweep passes texels whose rays to the point cross its planes most steeply.
    fn needs(&self, Axes { u, v, w }: Axes, ascending: bool, texels: [usize; 3]) -> bool {
        match *self {
            Self::Distant(d) => {
                let steepest = d[w].abs() >= d[u].abs() && d[w].abs() >= d[v].abs();
                // Of axes that are equally steep, the last.
                let first = (w + 1..3).all(|a| d[a].abs() < d[w].abs());
                steepest && first && (d[w] < 0.0) == ascending
            }
            Self::At(p) => {
                let last = texels.map(|n| (n - 1) as f32);
                let beside = |a: usize| (-p[a]).max(p[a] - last[a]).max(0.0);
                let ahead = if ascending { last[w] - p[w] } else { p[w] };
                ahead > 0.0 && ahead >= beside(u).max(beside(v))
            }
        }
    }
}

/// Where the results of sweeps go.
pub(super) struct Texels<'a> {
    pub lattice: &'a Lattice,
    pub bricks: &'a Bricks,
    /// Brick by brick; in each, x fastest.
    pub bytes: &'a mut [u8],
    /// Bytes of a texel.
    pub stride: usize,
}

impl Sweeps {
    pub fn new(aims: &[Aim], texels: [usize; 3]) -> Self {
        let mut sweeps: Vec<Sweep> = Vec::new();
        for (axes, ascending) in AXES.into_iter().flat_map(|axes| [(axes, false), (axes, true)]) {
            let course = Course { axes, ascending, texels: [axes.u, axes.v, axes.w].map(|a| texels[a]) };
            let new = || Sweep { course, points: Vec::new(), under_way: None };
            let (mut sweep, mut bytes) = (new(), 0);
            for (point, aim) in aims.iter().enumerate().filter(|(_, aim)| aim.needs(axes, ascending, texels))
            {
                let more = Fan::new(point, *aim, course).bytes();
                if !sweep.points.is_empty() && bytes + more > MOST_BYTES {
                    sweeps.push(std::mem::replace(&mut sweep, new()));
                    bytes = 0;
                }
                bytes += more;
                sweep.points.push(point);
            }
            if !sweep.points.is_empty() {
                sweeps.push(sweep);
            }
        }
        Self { sweeps }
    }

    /// Goes on, in parallel on the current pool; false if stopped first.
    pub fn complete(
        &mut self,
        aims: &[Aim],
        medium: &Medium,
        around: &Surroundings,
        texels: &mut Texels,
        level: Level,
        limits: &Limits,
    ) -> bool {
        let stop = limits.stop();
        while let Some(Sweep { course, points, under_way }) = self.sweeps.last_mut() {
            let UnderWay { fans, slab, stage } = under_way.get_or_insert_with(|| UnderWay {
                fans: points.iter().map(|&point| Fan::new(point, aims[point], *course)).collect(),
                slab: Slab::new(course),
                stage: Stage::Advance,
            });
            loop {
                if stop.reached_now() {
                    return false;
                }
                *stage = match *stage {
                    Stage::Advance if slab.advance(course, texels.bricks) => Stage::Fill(0),
                    Stage::Advance => break,
                    Stage::Fill(m) => {
                        slab.fill(m, course, texels.lattice, texels.bricks, medium, level);
                        if m + 1 < slab.count { Stage::Fill(m + 1) } else { Stage::Pass(0) }
                    }
                    Stage::Pass(fan) => {
                        fans[fan].pass(slab, around, level);
                        if fan + 1 < fans.len() { Stage::Pass(fan + 1) } else { Stage::Write(0) }
                    }
                    Stage::Write(first) => {
                        write(course, fans, slab, texels, first, level);
                        let next = first + WRITTEN_TOGETHER;
                        if next < texels.bricks.kept().len() { Stage::Write(next) } else { Stage::Advance }
                    }
                };
            }
            self.sweeps.pop();
        }
        true
    }
}

/// Bricks that are looked at between two questions for a stop.
const WRITTEN_TOGETHER: usize = 1 << 12;

/// Writes the texels of a slab, in some bricks from number `first` on.
fn write(course: &Course, fans: &[Fan], slab: &Slab, texels: &mut Texels, first: usize, level: Level) {
    let Texels { bricks, ref mut bytes, stride, .. } = *texels;
    let Axes { u, v, w } = course.axes;
    let brick = stride * EDGE * EDGE * EDGE;
    let kept = &bricks.kept()[first..(first + WRITTEN_TOGETHER).min(bricks.kept().len())];
    let bytes = &mut bytes[first * brick..];
    let kept = bytes.par_chunks_exact_mut(brick).zip(kept.par_iter());
    kept.filter(|(_, at)| at[w] == slab.layer).for_each(|(bytes, at)| {
        level.run(WriteBrick { course, fans, slab, at: [at[u], at[v]], bytes, stride });
    });
}

struct WriteBrick<'a> {
    course: &'a Course,
    fans: &'a [Fan],
    slab: &'a Slab,
    /// Its coordinates along u and v.
    at: [usize; 2],
    bytes: &'a mut [u8],
    stride: usize,
}

impl Kernel for WriteBrick<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        let Self { course, fans, slab, at: [brick_u, brick_v], bytes, stride } = self;
        let Course { axes, texels: [_, nv, _], .. } = *course;
        let apart = [axes.u, axes.v, axes.w].map(|a| stride * [1, EDGE, EDGE * EDGE][a]);
        for fans in fans.chunk_by(|a, b| a.point / WORD == b.point / WORD) {
            let first = fans[0].point / WORD * WORD;
            for m in 0..slab.count {
                let mut planes = [PlaneOfBrick::default(); WORD];
                for fan in fans {
                    planes[fan.point - first] = fan.texels(slab, m, [brick_u, brick_v]);
                }
                let layer = course.plane(slab.first + m) % EDGE;
                for v in 0..EDGE.min(nv - brick_v * EDGE) {
                    let out = &mut bytes[v * apart[1] + layer * apart[2]..];
                    if fans.len() > FEW {
                        let (mut kept, mut masks) = ([0; WORD], [0; WORD]);
                        for i in 0..WORD {
                            (kept[i], masks[i]) = (planes[i].kept[v], planes[i].reached[v]);
                        }
                        write_words(out, first, apart[0], kept, masks);
                    } else {
                        for fan in fans {
                            let PlaneOfBrick { kept, reached } = &planes[fan.point - first];
                            write_bytes(out, fan.point, apart[0], kept[v], reached[v]);
                        }
                    }
                }
            }
        }
    }
}

/// Fans whose bytes are written one by one.
const FEW: usize = 3;

/// Writes the bytes of a point to eight texels, as far as the mask tells.
#[inline(always)]
fn write_bytes(out: &mut [u8], point: usize, apart: usize, kept: u64, mask: u64) {
    let Some(out) = out.get_mut(point..point + (WORD - 1) * apart + 1) else { return };
    if mask == u64::MAX {
        for i in 0..WORD {
            out[i * apart] = kept.to_le_bytes()[i];
        }
    } else {
        for i in (0..WORD).filter(|i| mask.to_le_bytes()[*i] > 0) {
            out[i * apart] = kept.to_le_bytes()[i];
        }
    }
}

/// Writes the bytes of points to eight texels, as far as the masks tell.
#[inline(always)]
fn write_words(out: &mut [u8], first: usize, apart: usize, kept: [u64; WORD], masks: [u64; WORD]) {
    let Some(out) = out.get_mut(first..first + (WORD - 1) * apart + WORD) else { return };
    let kept = transposed(kept);
    let words = (0..WORD).map(|i| i * apart..i * apart + WORD);
    if masks == [u64::MAX; WORD] {
        for (word, kept) in words.zip(kept) {
            out[word].copy_from_slice(&kept.to_le_bytes());
        }
    } else {
        for ((word, kept), mask) in words.zip(kept).zip(transposed(masks)) {
            let out = &mut out[word];
            let before = out.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
            out.copy_from_slice(&(before & !mask | kept).to_le_bytes());
        }
    }
}

/// Bytes that are written together: of as many points as a row of a brick has texels.
const WORD: usize = 8;
const _: () = assert!(WORD == EDGE);

/// Eight rows of eight bytes, as eight columns.
#[inline(always)]
fn transposed(mut rows: [u64; WORD]) -> [u64; WORD] {
    // Swaps blocks of 4 x 4 bytes, then of 2 x 2, then bytes, on either side of the diagonal.
    for (apart, mask) in
        [(4, 0x0000_0000_FFFF_FFFF), (2, 0x0000_FFFF_0000_FFFF), (1, 0x00FF_00FF_00FF_00FF_u64)]
    {
        for i in 0..WORD {
            if i & apart == 0 {
                let swapped = (rows[i] >> (8 * apart) ^ rows[i + apart]) & mask;
                rows[i + apart] ^= swapped;
                rows[i] ^= swapped << (8 * apart);
            }
        }
    }
    rows
}
