//! Emission of matter as one line per bin, for marching, which reads it at every sample.

use super::{Optics, Point};
use crate::math::{Rgb, cast};
use crate::volume::ValueBins;

/// Per bin the emission at its lower end and its rise over the bin, `(1 - albedo) Le` by channel.
///
/// The product of two lines is not a line: for a bin in which it bends by more than a ten-thousandth, and for one that
/// a point divides, the function itself is evaluated.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct GlowTable {
    bins: ValueBins,
    /// NaN where the function itself must be evaluated.
    rows: Vec<[f32; 6]>,
}

/// Largest deviation from the line, relative to the brightest emission, that is not visible.
const BEND: f32 = 1e-4;

impl GlowTable {
    /// The table of points in ascending order; `optics` is the function itself.
    pub(super) fn new(points: &[Point], bins: ValueBins, optics: impl Fn(f32) -> Optics) -> Self {
        let emitted = |value: f32| optics(value).emitted();
        let brightest = points.iter().map(|p| p.optics.emission.max_component()).fold(0.0, f32::max);
        let mut divided = vec![!bins.are_distinct(); ValueBins::COUNT];
        points.iter().for_each(|p| divided[bins.bin(p.value)] = true);
        let mut rows = vec![[f32::NAN; 6]; ValueBins::COUNT];
        for (bin, row) in rows.iter_mut().enumerate() {
            let outer = bin == 0 || bin + 1 == ValueBins::COUNT;
            if outer || divided[bin] {
                continue;
            }
            let [start, middle, end] = [0.0, 0.5, 1.0].map(|within| bins.value(bin as f32 + within));
            let ends = [emitted(start), emitted(end)].map(Rgb::to_array);
            let between = emitted(middle).to_array();
            let bent =
                (0..3).any(|c| (0.5 * (ends[0][c] + ends[1][c]) - between[c]).abs() > BEND * brightest);
            if !bent {
                *row =
                    std::array::from_fn(|i| if i < 3 { ends[0][i] } else { ends[1][i - 3] - ends[0][i - 3] });
            }
        }
        Self { bins, rows }
    }

    /// Whether look-ups in a bin differ in any bit between two tables over the same bins. A missing table counts as
    /// black. A row that defers to the function counts as equal to a black one: a change of the function shows in its
    /// points.
    pub(super) fn differs(old: Option<&Self>, new: Option<&Self>, bin: usize) -> bool {
        let row = |table: Option<&Self>| table.map_or([0.0; 6], |table| table.rows[bin]);
        let (old, new) = (row(old), row(new));
        let black_or_asked = |row: &[f32; 6]| row[0].is_nan() || row.iter().all(|&x| x == 0.0);
        old.map(f32::to_bits) != new.map(f32::to_bits) && !(black_or_asked(&old) && black_or_asked(&new))
    }

    /// What matter of a value emits; `None` where the function must be evaluated.
    #[inline]
    pub(super) fn emitted(&self, value: f32) -> Option<Rgb> {
        let position = self.bins.position(value);
        let bin = cast::index(position);
        let [r, g, b, dr, dg, db] = self.rows[bin];
        let along = position - bin as f32;
        (!r.is_nan()).then(|| Rgb::new(r + dr * along, g + dg * along, b + db * along))
    }
}

#[cfg(test)]
mod tests {
    use super::super::TransferFunction;
    use super::*;

    #[test]
    fn the_table_is_the_function_but_for_rounding() {
        let point = |value: f32, albedo: f32, emission: f32| Point {
            value,
            optics: Optics {
                albedo: Rgb::splat(albedo),
                emission: Rgb::splat(emission),
                ..Optics::default()
            },
        };
        let smooth = vec![point(0.0, 0.0, 0.0), point(1024.0, 1.0, 5.0)];
        // Jumps in the middle and at the border of a bin, a bend too strong for a line, and a spike between the values
        // at which a line is tested.
        let rough = vec![
            point(0.0, 0.9, 0.1),
            point(99.5, 0.9, 0.1),
            point(99.5, 0.1, 3.0),
            point(200.0, 0.0, 5.0),
            point(200.0, 0.5, 1.0),
            point(300.0, 0.0, 0.0),
            point(303.0, 1.0, 5.0),
            point(500.1, 1.0, 5.0),
            point(500.1, 0.0, 5.0),
            point(500.3, 0.0, 5.0),
            point(500.3, 1.0, 5.0),
        ];
        for points in [smooth, rough] {
            let function = TransferFunction::over(ValueBins::new([0.0, 1024.0]), points).unwrap();
            let mut from_table = 0;
            for i in 0..21_000_u16 {
                let value = f32::from(i) * 0.05 - 10.0;
                let (found, exact) = (function.emitted(value).r, function.optics(value).emitted().r);
                // A bend, and the rounding of a position by 2^-14 of a bin, across which emission may rise by a third.
                assert!((found - exact).abs() < 1.5e-4 * 5.0, "{found}, exactly {exact} at {value}");
                from_table += usize::from(function.glow.as_ref().unwrap().emitted(value).is_some());
            }
            assert!(from_table > 15_000, "{from_table}");
        }
    }
}
