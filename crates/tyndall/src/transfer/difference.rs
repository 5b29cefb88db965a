//! What an edit of the transfer function changed: the values that now mean other optics.
//!
//! What is compared is what rendering reads, not the list of points: the pairs of points that enclose a value, both
//! clamped ends included, and the rows of the tables. A table may round differently even where a value's own pair is
//! unchanged: beside a point added to the bin, or where the bend of emission relative to the brightest has changed. A
//! point that changes only the rounding near it counts as a change there, since pictures are compared bit for bit.

use super::glow::GlowTable;
use super::{Optics, Point, TransferFunction};
use crate::volume::ValueBins;

/// A set of [`ValueBins`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BinSet {
    words: [u64; ValueBins::COUNT.div_ceil(64)],
}

impl BinSet {
    /// No bin.
    pub const EMPTY: Self = Self { words: [0; ValueBins::COUNT.div_ceil(64)] };

    /// Every bin.
    #[must_use]
    pub fn all() -> Self {
        let mut set = Self::EMPTY;
        (0..ValueBins::COUNT).for_each(|bin| set.insert(bin));
        set
    }

    /// Adds a bin.
    ///
    /// # Panics
    /// If there is no such bin.
    pub fn insert(&mut self, bin: usize) {
        assert!(bin < ValueBins::COUNT, "bin {bin} of {}", ValueBins::COUNT);
        self.words[bin / 64] |= 1 << (bin % 64);
    }

    /// Whether a bin is in the set.
    #[must_use]
    pub fn contains(&self, bin: usize) -> bool {
        self.words.get(bin / 64).is_some_and(|word| word >> (bin % 64) & 1 == 1)
    }

    /// Whether no bin is in the set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|&word| word == 0)
    }

    /// The bins, ascending.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        (0..ValueBins::COUNT).filter(|&bin| self.contains(bin))
    }
}

/// Per group of optics the bins in which they changed; whatever reads none of these bins is unchanged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TransferDifference {
    /// Opacity: how light is attenuated.
    pub opacity: BinSet,
    /// Albedo, and the share and optics of surfaces: how light scatters.
    pub scattering: BinSet,
    /// Of these, the share and optics of surfaces: where else only the colour of scattered light changed.
    pub surfaces: BinSet,
    /// Emission, or the albedo of what glows: which matter is a light.
    pub emission: BinSet,
    /// Refractive index.
    pub ior: BinSet,
}

impl TransferDifference {
    /// Between two functions over the same bins; if the bins differ, everything is changed.
    #[must_use]
    pub fn between(old: &TransferFunction, new: &TransferFunction) -> Self {
        if old.bins() != new.bins() {
            let all = BinSet::all();
            let [opacity, scattering, surfaces, emission] = [(); 4].map(|()| all.clone());
            return Self { opacity, scattering, surfaces, emission, ior: all };
        }
        let mut opacity = interpolated(old, new, |o| [o.opacity]);
        let mut emission = emission(old, new);
        for bin in 0..ValueBins::COUNT {
            if old.opacities.differs(&new.opacities, bin) {
                opacity.insert(bin);
            }
            if GlowTable::differs(old.glow.as_ref(), new.glow.as_ref(), bin) {
                emission.insert(bin);
            }
        }
        Self {
            opacity,
            scattering: interpolated(old, new, |o| {
                let (a, s) = (o.albedo, o.specular);
                [a.r, a.g, a.b, s.r, s.g, s.b, o.surface, o.roughness]
            }),
            surfaces: interpolated(old, new, |o| {
                let s = o.specular;
                [s.r, s.g, s.b, o.surface, o.roughness]
            }),
            emission,
            ior: interpolated(old, new, |o| [o.ior]),
        }
    }

    /// Whether both functions are the same to a renderer.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        [&self.opacity, &self.scattering, &self.emission, &self.ior].iter().all(|set| set.is_empty())
    }
}

/// Emission is `(1 - albedo) Le`: where nothing glows before and after, the albedo does not count.
fn emission(old: &TransferFunction, new: &TransferFunction) -> BinSet {
    let glow = |o: &Optics| [o.emission.r, o.emission.g, o.emission.b];
    let shines = |(a, b): (&Point, &Point)| [a, b].iter().any(|p| !p.optics.emission.is_black());
    changed(old, new, |old, new| {
        !agree(old, new, glow)
            || ((shines(old) || shines(new)) && !agree(old, new, |o| [o.albedo.r, o.albedo.g, o.albedo.b]))
    })
}

/// Bins in which quantities interpolated between points may differ by a bit.
fn interpolated<const N: usize>(
    old: &TransferFunction,
    new: &TransferFunction,
    quantities: impl Fn(&Optics) -> [f32; N],
) -> BinSet {
    changed(old, new, |old, new| !agree(old, new, &quantities))
}

/// The two points that enclose a value; the same one twice beyond the ends.
type Segment<'a> = (&'a Point, &'a Point);

/// Whether quantities are the same throughout two segments: the same ends at the same values, or constant.
fn agree<const N: usize>(old: Segment, new: Segment, quantities: impl Fn(&Optics) -> [f32; N]) -> bool {
    let ends = |(a, b): Segment| [quantities(&a.optics), quantities(&b.optics)].map(|q| q.map(f32::to_bits));
    let values = |(a, b): Segment| [a.value, b.value];
    let [start, end] = ends(old);
    ends(new) == [start, end] && (start == end || values(old) == values(new))
}

/// The bins of all values whose segments differ.
fn changed(
    old: &TransferFunction,
    new: &TransferFunction,
    differ: impl Fn(Segment, Segment) -> bool,
) -> BinSet {
    let mut ends: Vec<f32> = [old, new].iter().flat_map(|f| f.points.iter().map(|p| p.value)).collect();
    ends.sort_by(f32::total_cmp);
    ends.dedup();
    let mut set = BinSet::EMPTY;
    // Values from one end to just below the next share their segments.
    let starts = std::iter::once(f32::MIN).chain(ends.iter().copied());
    let lasts = ends.iter().map(|end| end.next_down()).chain([f32::MAX]);
    for (start, last) in starts.zip(lasts).filter(|(start, last)| start <= last) {
        let (a, b, _) = old.locate(start);
        let (c, d, _) = new.locate(start);
        if differ((a, b), (c, d)) {
            (old.bins().bin(start)..=old.bins().bin(last)).for_each(|bin| set.insert(bin));
        }
    }
    set
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rgb, cast};
    use tyndall_testing::SplitMix;

    fn function(points: &[Point]) -> TransferFunction {
        TransferFunction::over(ValueBins::new([0.0, 1024.0]), points.to_vec()).unwrap()
    }

    fn point(value: f32, opacity: f32) -> Point {
        Point { value, optics: Optics { opacity, ..Optics::default() } }
    }

    fn ends(set: &BinSet) -> Option<[usize; 2]> {
        Some([set.iter().next()?, set.iter().last()?])
    }

    #[test]
    fn an_edit_touches_the_segments_beside_it() {
        let points: Vec<Point> = (0..5_u8).map(|i| point(200.0 * f32::from(i), 0.1 * f32::from(i))).collect();
        let before = function(&points);
        assert!(TransferDifference::between(&before, &before.clone()).is_empty());
        let mut moved = points.clone();
        moved[2].optics.opacity = 0.7;
        let difference = TransferDifference::between(&before, &function(&moved));
        // Values 200 to 600 exclusive, in bins that begin with 1.
        assert_eq!(ends(&difference.opacity), Some([201, 600]));
        assert!(difference.scattering.is_empty() && difference.emission.is_empty());
        let mut last = points.clone();
        last[4].optics.albedo = Rgb::new(1.0, 0.0, 0.0);
        let difference = TransferDifference::between(&before, &function(&last));
        assert_eq!(
            ends(&difference.scattering),
            Some([601, ValueBins::COUNT - 1]),
            "the clamped end as well"
        );
        assert!(difference.opacity.is_empty() && difference.emission.is_empty());
    }

    #[test]
    fn a_jump_moves_alone() {
        let before = [point(0.0, 0.0), point(500.0, 0.0), point(500.0, 0.5), point(1024.0, 0.5)];
        let after = [point(0.0, 0.0), point(510.0, 0.0), point(510.0, 0.5), point(1024.0, 0.5)];
        let difference = TransferDifference::between(&function(&before), &function(&after));
        assert_eq!(ends(&difference.opacity), Some([501, 510]));
    }

    #[test]
    fn redundant_points_change_nothing() {
        let before = function(&[point(0.0, 0.0), point(100.0, 0.5), point(900.0, 0.5)]);
        let more = function(&[point(0.0, 0.0), point(100.0, 0.5), point(300.0, 0.5), point(900.0, 0.5)]);
        let longer = function(&[point(0.0, 0.0), point(100.0, 0.5), point(1e6, 0.5)]);
        for after in [more, longer] {
            assert!(TransferDifference::between(&before, &after).is_empty());
            for value in (0..12_000_u16).map(|i| f32::from(i) * 0.1) {
                assert_eq!(before.optics(value), after.optics(value), "at {value}");
            }
        }
    }

    #[test]
    fn what_glows_depends_on_its_albedo() {
        let mut points = [point(0.0, 0.2), point(400.0, 0.2), point(401.0, 0.2), point(1000.0, 0.2)];
        let before = function(&points);
        points[1].optics.albedo = Rgb::BLACK;
        assert!(TransferDifference::between(&before, &function(&points)).emission.is_empty());
        points[3].optics.emission = Rgb::WHITE;
        let glowing = function(&points);
        assert_eq!(
            ends(&TransferDifference::between(&before, &glowing).emission),
            Some([402, ValueBins::COUNT - 1])
        );
        points[2].optics.albedo = Rgb::WHITE;
        let difference = TransferDifference::between(&glowing, &function(&points));
        assert_eq!(ends(&difference.emission), Some([402, 1000]));
    }

    #[test]
    fn other_bins_change_everything() {
        let points = vec![point(0.0, 0.0), point(100.0, 0.5)];
        let other = TransferFunction::new(points.clone()).unwrap();
        let difference = TransferDifference::between(&function(&points), &other);
        assert_eq!(difference.opacity.iter().count(), ValueBins::COUNT);
    }

    /// What the sets promise: in a bin that is not in them, no bit changes at any value.
    #[test]
    fn outside_the_sets_all_bits_are_the_same() {
        let mut random = SplitMix::new(41);
        let mut uniform = move || cast::single(random.uniform());
        let mut kept = 0;
        for round in 0..480 {
            let count = 2 + round / 8 % 7;
            let mut points: Vec<Point> = (0..count)
                .map(|_| Point {
                    value: (uniform() * 1100.0 - 40.0).round()
                        + if uniform() < 0.5 { 0.0 } else { uniform() },
                    optics: Optics {
                        opacity: uniform(),
                        albedo: Rgb::new(uniform(), 0.5, 0.5),
                        surface: uniform(),
                        emission: Rgb::splat((uniform() - 0.7).max(0.0)),
                        ..Optics::default()
                    },
                })
                .collect();
            points.sort_by(|a, b| a.value.total_cmp(&b.value));
            let which = cast::index(uniform() * count as f32).min(count - 1);
            // A level stretch, and a jump at the border of two bins.
            if which + 1 < count && uniform() < 0.5 {
                points[which + 1].optics = points[which].optics;
            }
            if uniform() < 0.5 {
                points.insert(which + 1, Point { optics: points[0].optics, ..points[which] });
            }
            let (at, mut edited) = (points[which].value, points.clone());
            match round % 8 {
                7 => edited[which].optics.surface = uniform(),
                0 => edited[which].optics.opacity = uniform(),
                1 => edited[which].optics.albedo.r = uniform(),
                2 => edited[which].value += if which + 1 == count { 50.0 } else { 0.0 },
                // Much brighter, so that all else may bend more.
                3 => edited[count - 1].optics.emission = Rgb::splat(1e4 * uniform()),
                // Just above a jump, or not.
                4 => edited[(which + 1).min(count - 1)].optics.emission.r += 1e-5,
                // Two close points, the second of which may be redundant.
                5 => {
                    let next = edited.get(which + 1).map_or(2000.0, |p| p.value);
                    let value = (edited[which].value + 0.3 * uniform()).min(next);
                    edited.insert(which + 1, Point { value, ..edited[which] });
                }
                _ => drop(edited.remove(which)),
            }
            let [before, after] =
                [points, edited].map(|points| TransferFunction::over(ValueBins::new([0.0, 1024.0]), points));
            // A point may have been inserted between the two of a jump.
            let (Ok(before), Ok(after)) = (before, after) else { continue };
            let difference = TransferDifference::between(&before, &after);
            assert!(round % 8 != 1 || difference.surfaces.is_empty(), "only an albedo, round {round}");
            let across = (0..11_000_u16).map(|i| f32::from(i) * 0.1 - 30.0);
            let beside = (0..2000_u16).map(|i| at + f32::from(i) * 1e-3 - 1.0);
            for value in across.chain(beside) {
                let (a, b) = (before.optics(value), after.optics(value));
                let bin = before.bins().bin(value);
                let same = |set: &BinSet, a: f32, b: f32, of: &str| {
                    assert!(
                        set.contains(bin) || a.to_bits() == b.to_bits(),
                        "{of} {a} and {b} at {value}, round {round}"
                    );
                };
                same(&difference.opacity, before.opacity(value), after.opacity(value), "opacity");
                same(&difference.opacity, a.opacity, b.opacity, "exact opacity");
                same(&difference.scattering, a.albedo.r, b.albedo.r, "albedo");
                same(&difference.surfaces, a.surface, b.surface, "surface");
                let [albedo, again] = [before.albedo(value), before.optics(value).albedo];
                assert_eq!(albedo.r.to_bits(), again.r.to_bits(), "at {value}");
                same(&difference.emission, a.emission.r, b.emission.r, "emission");
                let [a, b] = [&before, &after].map(|function| function.emitted(value).r);
                same(&difference.emission, a, b, "emission by the table");
                kept += usize::from(!difference.opacity.contains(bin));
            }
        }
        assert!(kept > 2_000_000, "only {kept} values were kept");
    }
}
