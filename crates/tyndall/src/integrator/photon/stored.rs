//! Photons: what a light path stores where it interacts with matter.

use crate::integrator::cells::Positioned;
use crate::integrator::light_paths::{Arrival, Vertex};
use crate::math::{PackedDirection, Rgb, Vec3};
use bytemuck::{Pod, Zeroable};

/// Light that arrives at an interaction with matter.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Photon {
    /// Index space.
    position: [f32; 3],
    /// The direction in which the light travels.
    pub(super) direction: PackedDirection,
    /// As [`Vertex::flux`].
    pub(super) flux: [f32; 3],
}

impl Positioned for Photon {
    #[inline(always)]
    fn position(&self) -> Vec3 {
        Vec3::from_array(self.position)
    }
}

impl Vertex for Photon {
    #[inline(always)]
    fn new(arrival: &Arrival) -> Self {
        Self {
            position: arrival.position.to_array(),
            direction: PackedDirection::new(arrival.direction),
            flux: arrival.flux.to_array(),
        }
    }

    #[inline(always)]
    fn direction(&self) -> Vec3 {
        self.direction.unpack()
    }

    #[inline(always)]
    fn flux(&self) -> Rgb {
        Rgb::from(self.flux)
    }
}
