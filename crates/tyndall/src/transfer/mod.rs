//! The transfer function: from data values to optics.
//!
//! Piecewise linear between points, clamped outside them; two points at one value are a jump, and
//! the later one holds from there on. All optics are evaluated by segment, which a small index finds in
//! constant time; opacity and emission, which are read most, also come from tables that agree up to rounding.

mod difference;
mod glow;
mod historygram;
mod optics;
mod pre_integrated;
mod presets;
mod table;

pub use difference::{BinSet, TransferDifference};
pub use historygram::{Grouping, HistoryGroups, Historygram};
pub use optics::Optics;
pub(crate) use pre_integrated::OpacityLanes;
use pre_integrated::narrowest_peak;
pub use presets::{PRESETS, Preset, PresetError};

use crate::math::{Rgb, cast};
use crate::simd::Lanes;
use crate::volume::{ValueBins, Volume};
use glow::GlowTable;
use table::OpacityTable;

/// A point of the function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Data value.
    pub value: f32,
    /// Optics there.
    pub optics: Optics,
}

/// Why points do not make a function.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TransferError {
    /// No point was given.
    #[error("a transfer function needs at least one point")]
    Empty,
    /// Values descend, are not finite, or more than two points share one.
    #[error("point {index}: values must be finite and ascend, with at most two points at one value")]
    Order {
        /// The offending point, counted from 0.
        index: usize,
    },
}

/// Data value to optics. See the module.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    points: Vec<Point>,
    /// Per bin over the points' span: the last point at or below the bin's lower end.
    segments: Vec<u32>,
    bins_per_value: f32,
    opacities: OpacityTable,
    narrowest_peak: f32,
    /// `None` where nothing glows.
    glow: Option<GlowTable>,
}

/// Bins of the segment index.
const BINS: usize = 256;

impl TransferFunction {
    /// With a table over the range of the points' values.
    ///
    /// # Errors
    /// [`TransferError`] if there is no point or the values do not ascend.
    pub fn new(points: Vec<Point>) -> Result<Self, TransferError> {
        let end = |point: Option<&Point>| point.map_or(0.0, |p| p.value);
        let bins = ValueBins::new([end(points.first()), end(points.last())]);
        Self::over(bins, points)
    }

    /// For the data of a volume: with a table over its bins, which no edit of the points changes, and without opacity where it has no
    /// data.
    ///
    /// # Errors
    /// [`TransferError`] if there is no point or the values do not ascend.
    pub fn for_volume(volume: &Volume, points: Vec<Point>) -> Result<Self, TransferError> {
        let function = Self::over(volume.value_bins(), points)?;
        match volume.no_data_below() {
            None => Ok(function),
            Some(border) => Self::over(function.bins(), function.above(cast::single(border))),
        }
    }

    /// The points of the same function from a value on, and without opacity below it.
    fn above(&self, border: f32) -> Vec<Point> {
        let optics = self.optics(border);
        let jump = [Optics { opacity: 0.0, ..optics }, optics].map(|optics| Point { value: border, optics });
        let rest = self.points.iter().filter(|point| point.value > border);
        jump.into_iter().chain(rest.copied()).collect()
    }

    /// With a table over given bins.
    ///
    /// # Errors
    /// [`TransferError`] if there is no point or the values do not ascend.
    pub fn over(bins: ValueBins, points: Vec<Point>) -> Result<Self, TransferError> {
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return Err(TransferError::Empty);
        };
        for (index, point) in points.iter().enumerate() {
            let falls = index > 0 && point.value < points[index - 1].value;
            let third = index > 1 && point.value <= points[index - 2].value;
            if !point.value.is_finite() || falls || third {
                return Err(TransferError::Order { index });
            }
        }
        let span = last.value - first.value;
        let bins_per_value = if span > 0.0 { BINS as f32 / span } else { 0.0 };
        let lower_end = |bin: usize| first.value + span * (bin as f32 / BINS as f32);
        let segments = (0..=BINS)
            // One bin back, so that rounding of the bin number never skips a point.
            .map(|bin| points.partition_point(|p| p.value <= lower_end(bin.saturating_sub(1))))
            .map(|after| cast::fit_u32(after.saturating_sub(1)))
            .collect();
        let opacities = OpacityTable::new(&points, bins);
        let narrowest_peak = narrowest_peak(&points);
        let mut function = Self { points, segments, bins_per_value, opacities, narrowest_peak, glow: None };
        if function.points.iter().any(|p| !p.optics.emission.is_black()) {
            function.glow = Some(GlowTable::new(&function.points, bins, |value| function.optics(value)));
        }
        Ok(function)
    }

    /// The points, ascending.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The bins of the table.
    #[must_use]
    pub fn bins(&self) -> ValueBins {
        self.opacities.bins()
    }

    /// The segment that holds `value`: its two points and the position between them.
    #[inline]
    fn locate(&self, value: f32) -> (&Point, &Point, f32) {
        if value < self.points[0].value {
            return (&self.points[0], &self.points[0], 0.0);
        }
        let bin = cast::index((value - self.points[0].value) * self.bins_per_value).min(BINS);
        let mut i = self.segments[bin] as usize;
        while i + 1 < self.points.len() && self.points[i + 1].value <= value {
            i += 1;
        }
        let a = &self.points[i];
        let b = self.points.get(i + 1).unwrap_or(a);
        let width = b.value - a.value;
        let t = if width > 0.0 { ((value - a.value) / width).clamp(0.0, 1.0) } else { 0.0 };
        (a, b, t)
    }

    /// All optics at a data value.
    #[inline]
    #[must_use]
    pub fn optics(&self, value: f32) -> Optics {
        let (a, b, t) = self.locate(value);
        a.optics.lerp(&b.optics, t)
    }

    /// Albedo only: equal to the last bit to that of [`Self::optics`].
    #[inline]
    #[must_use]
    pub fn albedo(&self, value: f32) -> Rgb {
        let (a, b, t) = self.locate(value);
        a.optics.albedo.lerp(b.optics.albedo, t)
    }

    /// Opacity only, for the many look-ups that need nothing else.
    #[inline]
    #[must_use]
    pub fn opacity(&self, value: f32) -> f32 {
        self.opacities.opacity(value).unwrap_or_else(|| self.exact_opacity(value))
    }

    /// Opacity from the points, not the table.
    fn exact_opacity(&self, value: f32) -> f32 {
        let (a, b, t) = self.locate(value);
        a.optics.opacity + (b.optics.opacity - a.optics.opacity) * t
    }

    /// [`Self::opacity`] of a value per lane.
    #[inline(always)]
    pub(crate) fn opacity_lanes<S: Lanes>(&self, simd: S, values: S::f32s) -> S::f32s {
        self.opacities.opacities(simd, values, |value| self.exact_opacity(value))
    }

    /// Smallest and largest opacity over data values `[lo, hi]`.
    #[must_use]
    pub fn opacity_range(&self, values: [f32; 2]) -> [f32; 2] {
        let [lo, hi] = values;
        // Points that share an end's position in the table count as beyond it, as they do in a look-up.
        let table = &self.opacities;
        let first = self.points.partition_point(|p| p.value <= lo || table.confuses(lo, p.value));
        let last = self.points.partition_point(|p| p.value <= hi || table.confuses(hi, p.value));
        extremes(&self.points[first..last.max(first)], values.map(|v| self.opacity(v)), |o| o.opacity)
    }

    /// An upper bound on the luminance that matter with values in `[lo, hi]` emits per unit length at
    /// density 1, `opacity (1 - albedo) Le`: zero exactly where nothing can glow.
    #[must_use]
    pub fn emission_bound(&self, values: [f32; 2]) -> f32 {
        let [_, opacity] = self.opacity_range(values);
        let [first, last] = values.map(|v| self.points.partition_point(|p| p.value <= v));
        let ends = values.map(|v| self.optics(v));
        let most =
            |f: fn(&Optics) -> f32| extremes(&self.points[first..last], [f(&ends[0]), f(&ends[1])], f)[1];
        let channel = [
            most(|o| 1.0 - o.albedo.r) * most(|o| o.emission.r),
            most(|o| 1.0 - o.albedo.g) * most(|o| o.emission.g),
            most(|o| 1.0 - o.albedo.b) * most(|o| o.emission.b),
        ];
        opacity * Rgb::from(channel).luminance()
    }

    /// Luminance that matter of a value emits per unit length at density 1, `opacity (1 - albedo) Le`: equal to the
    /// last bit to that of [`Self::optics`], without computing the other optics.
    #[inline]
    #[must_use]
    pub fn emitted_luminance(&self, value: f32) -> f32 {
        let (a, b, t) = self.locate(value);
        let (a, b) = (&a.optics, &b.optics);
        if a.emission.is_black() && b.emission.is_black() {
            return 0.0;
        }
        let opacity = a.opacity + (b.opacity - a.opacity) * t;
        opacity * ((Rgb::WHITE - a.albedo.lerp(b.albedo, t)) * a.emission.lerp(b.emission, t)).luminance()
    }

    /// Whether any matter glows.
    #[must_use]
    pub fn emits(&self) -> bool {
        self.glow.is_some()
    }

    /// Whether any matter has surfaces.
    #[must_use]
    pub fn reflects(&self) -> bool {
        self.points.iter().any(|p| p.optics.surface > 0.0)
    }

    /// [`Optics::emitted`] at a data value, for the many look-ups that need nothing else.
    #[inline]
    #[must_use]
    pub fn emitted(&self, value: f32) -> Rgb {
        let Some(glow) = &self.glow else { return Rgb::BLACK };
        glow.emitted(value).unwrap_or_else(|| self.optics(value).emitted())
    }
}

/// Smallest and largest value of a quantity, from the points inside a range and its values at the range's ends; exact,
/// since a piecewise linear quantity has its extremes at the ends or at points between them.
fn extremes(inside: &[Point], ends: [f32; 2], quantity: impl Fn(&Optics) -> f32) -> [f32; 2] {
    inside
        .iter()
        .map(|point| quantity(&point.optics))
        .chain(ends)
        .fold([f32::INFINITY, f32::NEG_INFINITY], |[least, most], x| [least.min(x), most.max(x)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(value: f32, opacity: f32, red: f32) -> Point {
        Point { value, optics: Optics { opacity, albedo: Rgb::new(red, 0.5, 0.5), ..Optics::default() } }
    }

    /// The plain definition: linear scan, no index.
    fn by_definition(points: &[Point], v: f32) -> f32 {
        match points.iter().rposition(|p| p.value <= v) {
            None => points[0].optics.opacity,
            Some(i) if i + 1 == points.len() => points[i].optics.opacity,
            Some(i) => {
                let (a, b) = (&points[i], &points[i + 1]);
                let t = (v - a.value) / (b.value - a.value);
                a.optics.opacity + (b.optics.opacity - a.optics.opacity) * t
            }
        }
    }

    #[test]
    fn the_index_agrees_with_the_definition_everywhere() {
        let mut points = vec![point(-1000.0, 0.0, 0.1), point(-999.5, 0.4, 0.1), point(-999.5, 0.9, 0.2)];
        points.extend((0..40).map(|i| point(10.0 + 0.37 * i as f32, (i % 7) as f32 / 7.0, 0.3)));
        points.extend([point(3000.0, 0.2, 0.5), point(3000.0, 1.0, 0.5)]);
        let function = TransferFunction::new(points.clone()).unwrap();
        let exactly_at_points = points.iter().map(|p| p.value);
        let between = (0..20_000).map(|i| -1100.0 + i as f32 * 0.21);
        for v in exactly_at_points.chain(between) {
            let (found, expected) = (function.optics(v).opacity, by_definition(&points, v));
            assert!((found - expected).abs() < 1e-5, "{found}, expected {expected} at {v}");
        }
    }

    #[test]
    fn a_jump_belongs_to_the_later_point_and_a_single_point_is_constant() {
        let jump = TransferFunction::new(vec![
            point(0.0, 0.0, 0.0),
            point(1.0, 0.0, 0.0),
            point(1.0, 1.0, 1.0),
            point(2.0, 1.0, 1.0),
        ])
        .unwrap();
        assert_eq!(jump.opacity(1.0), 1.0);
        assert_eq!(jump.optics(1.0_f32.next_down()).opacity, 0.0);
        assert_eq!(jump.opacity(1.0 - 1e-6), 0.0);
        assert_eq!(jump.opacity_range([0.2, 0.9]), [0.0, 0.0]);
        assert_eq!(jump.opacity_range([0.2, 1.0]), [0.0, 1.0]);
        // The value before a jump at the upper end still occurs just below it.
        let falls = vec![point(0.0, 0.1, 0.0), point(1.0, 0.7, 0.0), point(1.0, 0.2, 0.0)];
        assert_eq!(TransferFunction::new(falls).unwrap().opacity_range([0.0, 1.0]), [0.1, 0.7]);
        let one = TransferFunction::new(vec![point(5.0, 0.3, 0.0)]).unwrap();
        assert_eq!((one.opacity(-1e30), one.opacity(5.0), one.opacity(f32::MAX)), (0.3, 0.3, 0.3));
    }

    #[test]
    fn ranges_hold_every_value_inside() {
        let points = [(0.0, 0.1), (2.0, 0.9), (3.0, 0.2), (7.0, 0.6)].map(|(v, o)| point(v, o, 0.2));
        let function = TransferFunction::new(points.to_vec()).unwrap();
        for i in 0..40 {
            for j in i..40 {
                let values = [i as f32 * 0.25 - 1.0, j as f32 * 0.25 - 1.0];
                let [lo, hi] = function.opacity_range(values);
                for k in 0..=20 {
                    let v = values[0] + (values[1] - values[0]) * k as f32 / 20.0;
                    let o = function.opacity(v);
                    assert!(lo - 1e-6 <= o && o <= hi + 1e-6, "{o} outside [{lo}, {hi}] over {values:?}");
                }
            }
        }
    }

    #[test]
    fn points_that_do_not_ascend_are_refused() {
        let new =
            |values: &[f32]| TransferFunction::new(values.iter().map(|&v| point(v, 0.5, 0.5)).collect());
        assert_eq!(new(&[]), Err(TransferError::Empty));
        assert_eq!(new(&[0.0, 2.0, 1.0]), Err(TransferError::Order { index: 2 }));
        assert_eq!(new(&[1.0, 1.0, 1.0]), Err(TransferError::Order { index: 2 }));
        assert_eq!(new(&[f32::NAN]), Err(TransferError::Order { index: 0 }));
        assert!(new(&[1.0, 1.0, 2.0, 2.0]).is_ok());
    }

    #[test]
    fn emitted_luminance_is_that_of_the_optics() {
        let mut points =
            vec![point(0.0, 0.3, 0.2), point(1.0, 0.9, 0.7), point(2.5, 0.5, 0.1), point(3.0, 0.7, 0.4)];
        points[1].optics.emission = Rgb::new(3.0, 0.1, 0.7);
        let function = TransferFunction::new(points).unwrap();
        for i in 0..4000 {
            let value = i as f32 * 1e-3 - 0.3;
            let optics = function.optics(value);
            let expected = optics.opacity * optics.emitted().luminance();
            assert_eq!(function.emitted_luminance(value).to_bits(), expected.to_bits(), "at {value}");
        }
    }

    #[test]
    fn what_cannot_glow_has_no_emission_bound() {
        let mut points = vec![point(0.0, 1.0, 1.0), point(1.0, 1.0, 0.0), point(2.0, 0.0, 0.0)];
        points[1].optics.emission = Rgb::new(3.0, 0.0, 0.0);
        let function = TransferFunction::new(points).unwrap();
        assert!(function.emits());
        assert_eq!(function.emission_bound([2.0, 5.0]), 0.0);
        assert!(function.emission_bound([0.9, 1.1]) >= 0.2126 * 3.0 * 0.9);
    }
}
