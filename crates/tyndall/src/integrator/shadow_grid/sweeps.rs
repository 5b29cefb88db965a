//! Sweeps through the lattice, away from light points.

use super::fan::{Axes, Course, Fan};
use super::matter::Matter;
use super::{Aim, FULL, Surroundings};
use crate::integrator::Limits;
use crate::math::cast;
use crate::simd::{Kernel, Lanes, Level};
use rayon::prelude::*;

/// All sweeps, and how far they are.
#[derive(Debug)]
pub(super) struct Sweeps {
    /// The last one comes first.
    sweeps: Vec<Sweep>,
    /// Planes of that one that its rays have reached.
    planes: usize,
}

/// A sweep along an axis, for light points in whose direction rays cross its planes most steeply.
#[derive(Debug)]
struct Sweep {
    course: Course,
    fans: Vec<Fan>,
}

/// By the axis from plane to plane. Lanes go along x where they can, since matter is stored so.
const AXES: [Axes; 3] = [Axes { u: 1, v: 2, w: 0 }, Axes { u: 0, v: 2, w: 1 }, Axes { u: 0, v: 1, w: 2 }];

/// Memory of the rays of a sweep, as long as there are more than one fan.
const MOST_BYTES: usize = 64 << 20;

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

impl Sweeps {
    pub fn new(aims: &[Aim], texels: [usize; 3]) -> Self {
        let mut sweeps: Vec<Sweep> = Vec::new();
        for (axes, ascending) in AXES.into_iter().flat_map(|axes| [(axes, false), (axes, true)]) {
            let course = Course { axes, ascending, texels: [axes.u, axes.v, axes.w].map(|a| texels[a]) };
            let (mut fans, mut bytes) = (Vec::new(), 0);
            for (point, aim) in aims.iter().enumerate().filter(|(_, aim)| aim.needs(axes, ascending, texels)) {
                let fan = Fan::new(point, *aim, course);
                if !fans.is_empty() && bytes + fan.bytes() > MOST_BYTES {
                    sweeps.push(Sweep { course, fans: std::mem::take(&mut fans) });
                    bytes = 0;
                }
                bytes += fan.bytes();
                fans.push(fan);
            }
            if !fans.is_empty() {
                sweeps.push(Sweep { course, fans });
            }
        }
        Self { sweeps, planes: 0 }
    }

    /// Goes on, in parallel on the current pool; false if stopped first. A texel has `stride` bytes.
    pub fn complete(
        &mut self,
        matter: &Matter,
        around: &Surroundings,
        texels: &mut [u8],
        stride: usize,
        level: Level,
        limits: &Limits,
    ) -> bool {
        let stop = limits.stop();
        while let Some(Sweep { course, fans }) = self.sweeps.last_mut() {
            let [_, _, nw] = course.texels;
            while self.planes < nw {
                if stop.reached_now() {
                    return false;
                }
                fans.par_iter_mut().for_each(|fan| fan.step(self.planes, matter, around, level));
                write(course, fans, self.planes, matter, texels, stride, level);
                self.planes += 1;
            }
            self.sweeps.pop();
            self.planes = 0;
        }
        true
    }
}

/// Writes the texels of the `n`-th plane of a sweep.
fn write(
    course: &Course,
    fans: &[Fan],
    n: usize,
    matter: &Matter,
    texels: &mut [u8],
    stride: usize,
    level: Level,
) {
    let (k, [nx, ny, _]) = (course.plane(n), matter.texels);
    // Layers of texels, or rows of one; from a slab's first texel to the row's, and from texel to texel.
    let (slabs, slab, first, apart) = match course.axes.w {
        0 => (texels, nx * ny * stride, k * stride, nx * stride),
        1 => (texels, nx * ny * stride, k * nx * stride, stride),
        _ => (&mut texels[k * nx * ny * stride..][..nx * ny * stride], nx * stride, 0, stride),
    };
    slabs.par_chunks_exact_mut(slab).with_min_len(4).enumerate().for_each(|(row, slab)| {
        level.run(WriteRow { course, matter, fans, n, row, out: &mut slab[first..], apart });
    });
}

struct WriteRow<'a> {
    course: &'a Course,
    matter: &'a Matter,
    fans: &'a [Fan],
    n: usize,
    /// Its number.
    row: usize,
    /// From the row's first texel on.
    out: &'a mut [u8],
    /// Bytes from texel to texel.
    apart: usize,
}

impl Kernel for WriteRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { course, matter, fans, n, row, out, apart } = self;
        let mut kept = vec![0.0; course.texels[0]];
        let integrals = matter.integrals(simd, matter.row(course.axes, course.plane(n), row));
        for fan in fans {
            let reached = fan.reached(n, row);
            if reached.is_empty() {
                continue;
            }
            fan.transmittances(simd, n, row, integrals.as_deref(), &mut kept);
            let mut at = fan.point + reached.start * apart;
            for &kept in &kept[reached] {
                out[at] = cast::low_u8(cast::truncate(kept * FULL + 0.5));
                at += apart;
            }
        }
    }
}
