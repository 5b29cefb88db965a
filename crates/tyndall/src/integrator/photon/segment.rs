//! What is kept of a view ray's segment.

use super::view::Stretch;
use crate::math::cast;
use bytemuck::{Pod, Zeroable};

/// The result of a segment. 16 bits suffice for transmittance and depth; radiance needs 32.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Segment {
    pub radiance: [f32; 3],
    /// Transmittance, in units of 1 / [`WHOLE`].
    transmittance: u16,
    /// Mean position of the visible matter along the segment, in units of 1 / [`WHOLE`] of its length.
    depth: u16,
}

/// Bytes of a segment without its Historygram.
pub(super) const BYTES: u64 = size_of::<Segment>() as u64;

/// The code for 1; the code after it means unknown.
const WHOLE: u16 = u16::MAX - 1;

impl Segment {
    /// Not yet computed, or invalidated.
    pub const UNKNOWN: Self = Self { radiance: [0.0; 3], transmittance: u16::MAX, depth: 0 };
    /// Of a ray that misses the volume.
    pub const CLEAR: Self = Self { radiance: [0.0; 3], transmittance: WHOLE, depth: 0 };

    /// From the results of a stretch between two distances.
    pub fn new(found: &Stretch, [from, to]: [f32; 2]) -> Self {
        let covered = 1.0 - found.transmittance;
        let along = if covered > 0.0 { (found.depth / covered - from) / (to - from) } else { 0.0 };
        let rounded = |share: f32| cast::round_u16(share.clamp(0.0, 1.0) * f32::from(WHOLE));
        Self {
            radiance: found.radiance.to_array(),
            transmittance: rounded(found.transmittance),
            depth: rounded(along),
        }
    }

    pub fn is_known(&self) -> bool {
        self.transmittance != u16::MAX
    }

    pub fn transmittance(&self) -> f32 {
        f32::from(self.transmittance) / f32::from(WHOLE)
    }

    /// The mean depth as a distance, given those where the segment begins and ends.
    pub fn distance(&self, [from, to]: [f32; 2]) -> f32 {
        from + (to - from) * (f32::from(self.depth) / f32::from(WHOLE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    #[test]
    fn segments_keep_what_they_show() {
        for transmittance in [0.0, 1e-5, 0.3, 0.999, 1.0] {
            for middle in [20.0, 21.7, 30.0] {
                let covered = 1.0 - transmittance;
                // Brighter than half precision can represent.
                let radiance = Rgb::new(1e6, 0.0, 70_000.0);
                let found = Stretch { radiance, transmittance, depth: covered * middle, gathers: 1 };
                let segment = Segment::new(&found, [20.0, 30.0]);
                assert!(segment.is_known() && Rgb::from(segment.radiance) == radiance);
                assert!((segment.transmittance() - transmittance).abs() < 1e-5, "{transmittance}");
                if covered > 0.0 {
                    assert!((segment.distance([20.0, 30.0]) - middle).abs() < 1e-3, "{middle}");
                }
            }
        }
        assert!(!Segment::UNKNOWN.is_known() && Segment::CLEAR.transmittance() == 1.0);
    }
}
