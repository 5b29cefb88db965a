//! Free flight by inverting a march. The pdf of the sampled distance is known, as needed by methods that reweight a
//! collision after the matter has changed.

use super::march::Steps;
use super::step_ends::STEADY;
use super::{Medium, Track};
use crate::math::{Vec3, cast};

/// A collision, with the pdf of its sampled distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarchedCollision {
    /// World distance inside the medium, along the track.
    pub t: f32,
    /// Where, in index space.
    pub position: Vec3,
    /// Extinction in the march step that contains the collision, per world unit.
    pub sigma_t: f32,
    /// Optical depth up to the collision, by the march.
    pub optical_depth: f32,
}

impl MarchedCollision {
    /// Pdf of the distance, per world unit: exactly that of [`Medium::marched_flight`], whatever its step.
    #[must_use]
    pub fn pdf(&self) -> f32 {
        self.sigma_t * (-self.optical_depth).exp()
    }
}

impl Medium {
    /// Flies through an optical depth of `depth`, or out of the medium (`None`), by a march with steps of `step` world
    /// units, each with the mean extinction of the values between its ends. For an exponentially distributed depth,
    /// distances have the pdf that the collision reports. The march makes it biased, unlike [`Self::free_flight`], whose
    /// pdf is unknown.
    #[must_use]
    pub fn marched_flight(&self, track: &Track, depth: f32, step: f32) -> Option<MarchedCollision> {
        let steps = Steps::new(track, step);
        let (mut k, mut met) = (0, 0.0);
        for cell in self.majorants.walk(track) {
            if cell.most <= 0.0 {
                continue;
            }
            k = k.max(cast::truncate(cell.start / step)).min(steps.count);
            while k < steps.count && k as f32 * step < cell.end {
                let [start, width] = steps.at(k, step);
                let sigma_t = self.mean_sigma_t([track.at(start), track.at(start + width)]);
                let behind = met + sigma_t * width;
                if behind > depth {
                    let t = start + (depth - met) / sigma_t;
                    return Some(MarchedCollision {
                        t,
                        position: track.at(t),
                        sigma_t,
                        optical_depth: depth,
                    });
                }
                met = behind;
                k += 1;
            }
        }
        None
    }

    /// Mean extinction between two index-space positions as near to each other as steps of a march are: over all values
    /// between, or of both values where voxels are not interpolated.
    #[must_use]
    pub fn mean_sigma_t(&self, ends: [Vec3; 2]) -> f32 {
        self.density * self.mean_opacity(ends)
    }

    /// Mean opacity between two positions in index space, by the rule of [`StepEnds`](super::step_ends::StepEnds); the plain mean of the two where voxels
    /// are not interpolated.
    fn mean_opacity(&self, [from, to]: [Vec3; 2]) -> f32 {
        let values = [from, to].map(|p| self.volume.value(p));
        let opacities = values.map(|value| self.transfer.opacity(value));
        if !self.interpolates {
            return 0.5 * (opacities[0] + opacities[1]);
        }
        let mean = self.transfer.mean_opacity(values);
        let most = mean.max(opacities[0]).max(opacities[1]);
        let least = mean.min(opacities[0]).min(opacities[1]);
        if most <= least * STEADY || self.transfer.is_edge(values) {
            return mean;
        }
        let way = to - from;
        let border = |x: f32, way: f32| if way >= 0.0 { x.floor() + 1.0 } else { x.ceil() - 1.0 };
        let crossing =
            |x: f32, way: f32| Some((border(x, way) - x) / way).filter(|&s| s < 1.0).unwrap_or(1.0);
        let mut shares = [crossing(from.x, way.x), crossing(from.y, way.y), crossing(from.z, way.z)];
        shares.sort_by(f32::total_cmp);
        let (mut before, mut share, mut mean) = (values[0], 0.0, 0.0);
        for here in shares.into_iter().chain([1.0]) {
            let value = self.volume.value(from + way * here);
            mean += (here - share) * self.transfer.mean_opacity([before, value]);
            (before, share) = (value, here);
        }
        mean
    }
}
