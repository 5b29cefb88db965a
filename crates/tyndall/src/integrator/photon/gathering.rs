//! Where photons are gathered, and for whom.

use crate::math::Vec3;
use crate::scattering::Event;

/// A gather: its position and viewing direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gathering {
    /// Index space.
    pub position: Vec3,
    /// Opacity there, the largest within the spread of values; positive up to rounding.
    pub opacity: f32,
    /// The mean within the spread of values.
    pub mean: f32,
    /// Half of the width over which values spread between the points that look for matter, 0 where those stand for what is between them.
    pub half_spread: f32,
    pub event: Event,
    /// Towards the viewer.
    pub w_out: Vec3,
    /// Length of the view ray that the position represents, world units.
    pub width: f32,
    /// Share of its light that the viewer sees.
    pub weight: f32,
    /// The ray's lane in its packet.
    pub lane: usize,
}
