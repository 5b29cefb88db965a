//! Whether data are computed tomography in Hounsfield units, told from their values.

use super::{Histogram, Space, Volume};

/// Values that air may have: its mean is -1000, noise and calibration spread it.
const AIR: [f64; 2] = [-1100.0, -900.0];

/// The histogram's ends: some bins below air, up to where bone is. Values beyond count in the end bins.
const ENDS: [f64; 2] = [-1300.0, 700.0];

/// Of 25 units each, fine enough to tell a peak of air from matter that has all values.
const BINS: usize = 80;

/// First bin of air and first bin past it.
const AIR_BINS: [usize; 2] = [8, 16];

/// The bins from -700 to -300, where there is least in a body: above lung and below fat.
const SPARSE_BINS: std::ops::Range<usize> = 24..40;

/// A value that only bone and contrast agent reach.
const DENSE: f64 = 200.0;

/// Whether a volume is a CT: it lies in anatomical space, has values denser than soft tissue, and its histogram has a peak of air at
/// -1000 below which there is nothing but padding. A range of values alone tells little: seismic amplitudes, heights and phases
/// cover the same.
pub(super) fn is_ct(volume: &Volume) -> bool {
    let [least, most] = volume.value_range();
    let may_be = volume.grid().space() == Space::Anatomical && least <= AIR[1] && most >= DENSE;
    may_be && has_air(&volume.histogram(ENDS, BINS))
}

/// Whether there is a peak of air in a histogram over [`ENDS`].
fn has_air(histogram: &Histogram) -> bool {
    /// Least share of air in the scan: a body that fills nearly all of the picture still has its airways.
    const LEAST_AIR: f64 = 0.005;
    /// Least ratio of the peak of air to the mean count of the sparse bins.
    const PEAK: f64 = 2.0;
    /// Values below air occur at most as often as this share of those of air.
    const BELOW: f64 = 0.25;

    let sum = |bins: std::ops::Range<usize>| histogram.counts[bins].iter().sum::<u64>() as f64;
    let [first, past] = AIR_BINS;
    let (air, scan) = (sum(first..past), sum(first..BINS));
    let peak = histogram.counts[first..past].iter().copied().max().unwrap_or(0) as f64;
    let sparse = sum(SPARSE_BINS) / SPARSE_BINS.len() as f64;
    // The first bin also holds the padding.
    let below = sum(1..first) * (past - first) as f64 / (first - 1) as f64;
    air >= LEAST_AIR * scan && peak >= PEAK * sparse && below <= BELOW * air
}

#[cfg(test)]
mod tests {
    use super::super::{Grid, ValueMap, Voxels};
    use super::*;
    use crate::math::cast;
    use tyndall_testing::SplitMix;

    const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn volume(space: Space, value: impl FnMut() -> f64) -> Volume {
        let grid = Grid::new([32; 3], [1.0; 3], IDENTITY, [0.0; 3], space).unwrap();
        let data = std::iter::repeat_with(value).take(grid.len()).map(cast::single).collect();
        Volume::new(grid, Voxels::F32(data), ValueMap::IDENTITY).unwrap()
    }

    /// Sum of twelve uniform numbers, nearly normal.
    fn normal(random: &mut SplitMix) -> f64 {
        (0..12).map(|_| random.uniform()).sum::<f64>() - 6.0
    }

    /// Air, fat, soft tissue and bone with noise, a share of each; `padding` in place of a third of them.
    fn scan(noise: f64, air: f64, padding: Option<f64>) -> impl FnMut() -> f64 {
        let mut random = SplitMix::new(7);
        move || {
            let (kind, spread) = (random.uniform(), noise * normal(&mut random));
            match padding {
                Some(padding) if random.uniform() < 0.33 => padding,
                _ if kind < air => (-1000.0 + spread).max(-1024.0),
                _ if kind < air + 0.2 => -90.0 + spread,
                _ if kind < 0.97 => 45.0 + spread,
                _ => 900.0 + 4.0 * spread,
            }
        }
    }

    #[test]
    fn scans_are_ct_whatever_their_noise_padding_and_metal() {
        for noise in [0.0, 15.0, 60.0] {
            for padding in [None, Some(-1024.0), Some(-2000.0), Some(-3024.0), Some(-32768.0), Some(30000.0)]
            {
                for air in [0.5, 0.02] {
                    let ct = volume(Space::Anatomical, scan(noise, air, padding));
                    assert!(is_ct(&ct), "noise {noise}, padding {padding:?}, air {air}");
                }
            }
        }
        assert!(!is_ct(&volume(Space::Plain, scan(15.0, 0.5, None))), "without an anatomical space");
    }

    /// Values drawn from random numbers.
    type Drawn = Box<dyn FnMut(&mut SplitMix) -> f64>;

    #[test]
    fn other_data_over_the_same_range_are_not() {
        let of = |mut value: Drawn| {
            let mut random = SplitMix::new(3);
            volume(Space::Anatomical, move || value(&mut random))
        };
        let kinds: [(&str, Drawn); 7] = [
            ("seismic", Box::new(|r| (700.0 * normal(r)).clamp(-3500.0, 3500.0))),
            ("weak seismic", Box::new(|r| 300.0 * normal(r))),
            ("strong seismic", Box::new(|r| (4000.0 * normal(r)).clamp(-3500.0, 3500.0))),
            ("phase", Box::new(|r| (r.uniform() * 8192.0 - 4096.0).round())),
            ("heights", Box::new(|r| r.uniform() * 4000.0 - 1000.0)),
            ("depths", Box::new(|r| -11_000.0 + 19_000.0 * r.uniform().sqrt())),
            ("a mirrored scan", Box::new(|r| if r.uniform() < 0.5 { 1000.0 } else { -600.0 * r.uniform() })),
        ];
        for (name, value) in kinds {
            assert!(!is_ct(&of(value)), "{name}");
        }
    }
}
