//! Colours, rays, frames and boxes; the vector types are from `glam`.

pub mod binade;
pub mod bounds;
pub mod cast;
pub mod color;
pub mod direction;
pub mod frame;
pub mod ray;

pub use binade::Binade;
pub use bounds::Bounds;
pub use color::{LUMINANCE, Rgb};
pub use direction::PackedDirection;
pub use frame::Frame;
pub use glam::{Affine3A, DMat3, DVec3, Mat3, Vec2, Vec3};
pub use ray::{Interval, Ray};
