//! Whether data are labels: a number for each part, as segmentations have, which says nothing about its neighbours.

use super::Volume;
use rayon::prelude::*;

/// Most labels that are looked for; data of 8 bits have up to 255 values, and segmentations of the whole body some 100.
const MOST: usize = 200;

/// The values other than 0 of data of whole numbers from 0, ascending; `None` if there are other numbers, or more than 200 of them.
pub(super) fn whole_values(volume: &Volume) -> Option<Vec<f64>> {
    let [least, most] = volume.value_range();
    if least < 0.0 || most <= 0.0 {
        return None;
    }
    let found = volume.fold_data(Found::default, Found::take, Found::merge);
    let Found { values, other, .. } = found;
    let labels: Vec<f64> = values.into_iter().filter(|&value| value != 0.0).collect();
    (!other && labels.len() <= MOST).then_some(labels)
}

/// Distinct values, ascending, until there are too many, or one that is not whole.
#[derive(Default)]
struct Found {
    values: Vec<f64>,
    last: Option<f64>,
    other: bool,
}

impl Found {
    fn take(&mut self, value: f64) {
        if self.other || self.last == Some(value) {
            return;
        }
        self.last = Some(value);
        if let Err(place) = self.values.binary_search_by(|v| v.total_cmp(&value)) {
            self.other = value.fract() != 0.0 || self.values.len() > MOST;
            self.values.insert(place, value);
        }
    }

    fn merge(mut self, other: Self) -> Self {
        self.other |= other.other;
        other.values.into_iter().for_each(|value| self.take(value));
        self
    }
}

/// Whether whole values other than 0, ascending, are labels: there are at least two, most voxels have six equal neighbours, and they are
/// neither a scan nor a mask with soft edges, most of whose values occur without such neighbours, nor smooth data in steps.
pub(super) fn are_labels(volume: &Volume, values: &[f64]) -> bool {
    /// Share of a part's voxels that lie inside it, at least; thin parts have fewer.
    const INSIDE: f64 = 0.05;
    /// Share of neighbours of other values that differ by one step, above which many values are steps of something smooth.
    const SMOOTH: f64 = 0.9;
    /// Fewer values than this may well be shells, each inside the next.
    const MANY: usize = 12;

    if values.len() < 2 {
        return false;
    }
    let Survey { parts, one_step, any_step } = survey(volume, values);
    let [all, inside] = [0, 1].map(|i| parts.iter().map(|part| part[i]).sum::<u64>());
    let seen = parts[1..].iter().filter(|part| part[0] > 0);
    let solid = seen.clone().filter(|part| part[1] as f64 >= INSIDE * part[0] as f64);
    let is_smooth = values.len() >= MANY && one_step as f64 > SMOOTH * any_step as f64;
    2 * inside > all && 2 * solid.count() > seen.count() && !is_smooth
}

/// What voxels and their neighbours have in common.
struct Survey {
    /// For 0 and for each value after it: voxels, and those of them with six equal neighbours.
    parts: Vec<[u64; 2]>,
    /// Neighbours of successive values.
    one_step: u64,
    /// Neighbours of other values.
    any_step: u64,
}

impl Survey {
    fn new(values: usize) -> Self {
        Self { parts: vec![[0; 2]; values + 1], one_step: 0, any_step: 0 }
    }

    fn merge(mut self, other: &Self) -> Self {
        for (part, [voxels, inside]) in self.parts.iter_mut().zip(&other.parts) {
            part[0] += voxels;
            part[1] += inside;
        }
        Self { one_step: self.one_step + other.one_step, any_step: self.any_step + other.any_step, ..self }
    }
}

/// Compares voxels, at most about twice this many and evenly strided, with their neighbours.
const SURVEYED: usize = 1 << 19;

fn survey(volume: &Volume, values: &[f64]) -> Survey {
    let dims = volume.grid().dims();
    let [nx, ny, _] = dims;
    // An odd stride does not stay in step with rows of even length.
    let stride = (volume.grid().len() / SURVEYED).max(1) | 1;
    let part_of = |position: [usize; 3]| {
        let value = volume.voxel(position);
        // A value that is not listed is 0 or no data.
        values.binary_search_by(|v| v.total_cmp(&value)).map_or(0, |i| i + 1)
    };
    let look = |mut survey: Survey, number: usize| {
        let i = number * stride;
        let here = [i % nx, i / nx % ny, i / (nx * ny)];
        let part = part_of(here);
        let mut equal = true;
        for axis in 0..3 {
            let mut beside = |coordinate: usize| {
                let mut there = here;
                there[axis] = coordinate;
                let other = part_of(there);
                equal &= other == part;
                survey.any_step += u64::from(other != part);
                survey.one_step += u64::from(other.abs_diff(part) == 1);
            };
            // Beyond its border the volume goes on.
            beside(here[axis].saturating_sub(1));
            beside((here[axis] + 1).min(dims[axis] - 1));
        }
        survey.parts[part][0] += 1;
        survey.parts[part][1] += u64::from(equal);
        survey
    };
    let new = || Survey::new(values.len());
    let surveyed = volume.grid().len().div_ceil(stride);
    (0..surveyed).into_par_iter().with_min_len(4096).fold(new, look).reduce(new, |a, b| a.merge(&b))
}

#[cfg(test)]
mod tests {
    use super::super::{Grid, ValueMap, Voxels};
    use super::*;
    use crate::math::cast;
    use tyndall_testing::SplitMix;

    const EDGE: u16 = 40;

    /// A volume of bytes; `value` of a position from -1 to 1 and of a random number.
    fn volume(mut value: impl FnMut([f64; 3], f64) -> f64) -> Volume {
        let mut random = SplitMix::new(5);
        let at = |i: u16| (f64::from(i) + 0.5) / f64::from(EDGE) * 2.0 - 1.0;
        let mut data = Vec::new();
        for z in 0..EDGE {
            for y in 0..EDGE {
                for x in 0..EDGE {
                    data.push(cast::round_u16(cast::single(value([at(x), at(y), at(z)], random.uniform()))));
                }
            }
        }
        let grid = Grid::centred([usize::from(EDGE); 3], [1.0; 3]).unwrap();
        Volume::new(grid, Voxels::U16(data), ValueMap::IDENTITY).unwrap()
    }

    fn radius([x, y, z]: [f64; 3]) -> f64 {
        (x * x + y * y + z * z).sqrt()
    }

    #[test]
    fn segmentations_are_labels() {
        let two = |a: f64, b: f64| {
            volume(move |[x, ..], _| {
                if x.abs() > 0.8 {
                    0.0
                } else if x < 0.0 {
                    a
                } else {
                    b
                }
            })
        };
        for (a, b) in [(1.0, 3.0), (1.0, 8.0), (5.0, 117.0), (1.0, 2.0), (7.0, 60_000.0)] {
            assert_eq!(two(a, b).labels(), Some(&[a, b][..]), "{a}, {b}");
        }
        let without_background = volume(|[x, ..], _| if x < 0.0 { 1.0 } else { 2.0 });
        assert_eq!(without_background.labels(), Some(&[1.0, 2.0][..]));
        let shells = volume(|p, _| (4.0 - 4.0 * radius(p)).max(0.0).ceil());
        assert_eq!(shells.labels(), Some(&[1.0, 2.0, 3.0, 4.0][..]));
        // Parts in blocks, some a sheet, some a single voxel.
        let parts = volume(|[x, y, z], u| {
            let block = |c: f64| ((c + 1.0) * 1.5).floor();
            let number = 1.0 + block(x) + 3.0 * block(y) + 9.0 * block(z);
            if u < 1e-3 {
                150.0 + (u * 1e4).floor()
            } else if z > 0.95 {
                199.0
            } else {
                number
            }
        });
        assert!(parts.labels().is_some_and(|labels| labels.len() > 30), "{:?}", parts.labels());
    }

    #[test]
    fn scans_masks_and_smooth_data_are_not() {
        let noisy = |spread: f64| {
            volume(move |p, u| if radius(p) > 0.7 { 0.0 } else { 100.0 + (spread * (u - 0.5)).round() })
        };
        let not_labels: [(&str, Volume); 8] = [
            ("one value", volume(|p, _| if radius(p) < 0.7 { 1.0 } else { 0.0 })),
            ("a scan with an empty background", noisy(60.0)),
            ("a scan of few grey values", noisy(7.0)),
            (
                "a mask with a soft edge",
                volume(|p, _| (255.0 * (4.0 - 5.0 * radius(p)).clamp(0.0, 1.0)).round()),
            ),
            (
                "a mask with a single grey",
                volume(|p, _| (2.0 * (11.0 - 15.0 * radius(p)).clamp(0.0, 1.0)).round()),
            ),
            ("a smooth field in steps", volume(|[x, y, _], _| (16.0 + 8.0 * x + 2.0 * y).round())),
            ("noise", volume(|_, u| (u * 150.0).floor())),
            (
                "too many",
                volume(|[x, y, z], _| {
                    let block = |c: f64| ((c + 1.0) * 3.5).floor();
                    1.0 + block(x) + 7.0 * block(y) + 49.0 * block(z)
                }),
            ),
        ];
        for (name, volume) in not_labels {
            assert_eq!(volume.labels(), None, "{name}");
        }
    }
}
