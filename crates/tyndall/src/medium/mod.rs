//! The medium: a volume seen through a transfer function, cut by clips, crossed by light.
//!
//! Extinction is scalar, `sigma_t(v) = density * opacity(v)` per world unit; colour enters as albedo.

mod clip;
mod emptiness;
mod free_flight;
mod majorants;
mod march;
mod march_notes;
mod marched_flight;
mod packet_sample;
mod site;
mod skip;
mod spread;
mod step_ends;
mod thickness;

pub(crate) use clip::HalfSpace;
pub use clip::{Clip, ClipShape};
pub use free_flight::Collision;
pub(crate) use free_flight::FlightNotes;
pub use majorants::{CellStretch, CellWalk, MajorantGrid};
pub(crate) use march::PacketMarch;
pub(crate) use march_notes::MarchNotes;
pub use marched_flight::MarchedCollision;
pub(crate) use packet_sample::{PacketSample, SeenLanes};
pub(crate) use thickness::TrackStart;

use crate::math::{Binade, Interval, Ray, Vec3};
use crate::scattering::{Brdf, Event, Phase, Surface, surface_share};
use crate::simd::{Lanes, one_minus_exp};
use crate::transfer::{Optics, TransferFunction};
use crate::volume::{Interpolation, Volume};
use fearless_simd::prelude::*;
use std::sync::Arc;

/// What a medium is made of; see [`Medium::new`].
#[derive(Clone, Debug)]
pub struct MediumSettings {
    /// Extinction per world unit at opacity 1; at least 0.
    pub density: f32,
    /// The phase function.
    pub phase: Phase,
    /// How light is reflected where the data have a surface.
    pub brdf: Brdf,
    /// How fast matter becomes a surface as the gradient grows.
    pub gradient_factor: f32,
    /// The range, in data values, that gradients are measured against; above 0. `None` is the robust range of the data.
    pub gradient_range: Option<f32>,
    /// What is cut away.
    pub clip: Vec<ClipShape>,
    /// Voxels along the edge of a majorant cell; 0 is one global majorant.
    pub majorant_cell: usize,
}

#[cfg(test)]
impl MediumSettings {
    /// Isotropic matter that reflects evenly, with nothing cut away.
    pub(crate) fn plain(density: f32) -> Self {
        Self {
            density,
            phase: Phase::Isotropic,
            brdf: Brdf::Lambert,
            gradient_factor: 3.0,
            gradient_range: None,
            clip: Vec::new(),
            majorant_cell: 8,
        }
    }
}

/// A volume seen through a transfer function. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Medium {
    volume: Arc<Volume>,
    transfer: Arc<TransferFunction>,
    majorants: Arc<MajorantGrid>,
    /// As in the settings.
    cell_size: usize,
    clip: Clip,
    /// No track is longer: the diagonal of the box, world units.
    longest: f32,
    density: f32,
    phase: Phase,
    brdf: Brdf,
    gradient_factor: f32,
    gradient_range: f32,
    /// Whether values lie between those of voxels.
    interpolates: bool,
}

/// A ray inside the medium: in index space, where `t` is still the world distance, from where it
/// enters to where it leaves or ends.
#[derive(Clone, Copy, Debug, Default)]
pub struct Track {
    /// Starts at the medium's border, which keeps distances small and so precise.
    ray: Ray,
    /// World distance through the medium.
    length: f32,
    /// World distance before it.
    before: f32,
    /// Offset of each sample of a march from the middle of what is seen of its step, as a share of it: -1/2 to 1/2.
    shift: f32,
}

impl Track {
    /// World distance through the medium; 0 when the ray misses it.
    #[must_use]
    pub fn length(&self) -> f32 {
        self.length
    }

    /// World distance from the ray's origin to a distance inside the medium.
    #[must_use]
    pub fn distance(&self, t: f32) -> f32 {
        self.before + t
    }

    /// Index-space position at a distance inside the medium.
    #[inline]
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.ray.at(t)
    }

    /// Index-space positions at distances inside the medium.
    #[inline(always)]
    fn lanes<S: Lanes>(&self, simd: S, t: S::f32s) -> [S::f32s; 3] {
        let (o, d) = (self.ray.origin.to_array(), self.ray.direction.to_array());
        let splat = [S::f32s::splat(simd, o[0]), S::f32s::splat(simd, o[1]), S::f32s::splat(simd, o[2])];
        [t.mul_add(d[0], splat[0]), t.mul_add(d[1], splat[1]), t.mul_add(d[2], splat[2])]
    }
}

impl Medium {
    /// `volume` seen through `transfer`; builds the majorants, in parallel on the current pool.
    #[must_use]
    pub fn new(volume: Arc<Volume>, transfer: Arc<TransferFunction>, settings: &MediumSettings) -> Self {
        Self::after(None, volume, transfer, settings)
    }

    /// [`Self::new`] that shares the majorants of the medium before an edit if they still hold: if volume and function
    /// are the very same and the cells have the same size.
    #[must_use]
    pub fn after(
        before: Option<&Self>,
        volume: Arc<Volume>,
        transfer: Arc<TransferFunction>,
        settings: &MediumSettings,
    ) -> Self {
        let edge = settings.majorant_cell;
        let kept = before.filter(|before| {
            let same_matter =
                Arc::ptr_eq(&before.volume, &volume) && Arc::ptr_eq(&before.transfer, &transfer);
            same_matter && before.cell_size == edge
        });
        let majorants = || Arc::new(MajorantGrid::new(&volume, &transfer, edge));
        Self {
            clip: Clip::new(volume.grid(), &settings.clip),
            longest: volume.grid().diagonal(),
            majorants: kept.map_or_else(majorants, |before| before.majorants.clone()),
            cell_size: edge,
            density: settings.density,
            phase: settings.phase,
            brdf: settings.brdf,
            gradient_factor: settings.gradient_factor,
            gradient_range: settings.gradient_range.unwrap_or_else(|| volume.robust_width()),
            interpolates: volume.interpolation() == Interpolation::Linear,
            volume,
            transfer,
        }
    }

    /// The data.
    #[must_use]
    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// The data, to be shared.
    #[must_use]
    pub fn shared_volume(&self) -> &Arc<Volume> {
        &self.volume
    }

    /// The function from values to optics, to be shared.
    #[must_use]
    pub fn shared_transfer(&self) -> &Arc<TransferFunction> {
        &self.transfer
    }

    /// Whether both see the very same data through the very same function.
    #[must_use]
    pub fn shares_matter(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.volume, &other.volume) && Arc::ptr_eq(&self.transfer, &other.transfer)
    }

    /// The function from values to optics.
    #[must_use]
    pub fn transfer(&self) -> &TransferFunction {
        &self.transfer
    }

    /// Opacity bounds per cell.
    #[must_use]
    pub fn majorants(&self) -> &MajorantGrid {
        &self.majorants
    }

    /// Extinction per world unit at opacity 1.
    #[must_use]
    pub fn density(&self) -> f32 {
        self.density
    }

    /// How surfaces reflect.
    #[must_use]
    pub fn brdf(&self) -> Brdf {
        self.brdf
    }

    /// How fast matter becomes a surface as the gradient grows.
    #[must_use]
    pub fn gradient_factor(&self) -> f32 {
        self.gradient_factor
    }

    /// The range, in data values, that gradients are measured against; 0 where the data have a single value.
    #[must_use]
    pub fn gradient_range(&self) -> f32 {
        self.gradient_range
    }

    /// What is cut away.
    #[must_use]
    pub fn clip(&self) -> &Clip {
        &self.clip
    }

    /// The phase function.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The part of a world ray, up to world distance `end`, that lies in the medium and is not cut away.
    #[inline]
    #[must_use]
    pub fn track(&self, ray: &Ray, end: f32) -> Track {
        let grid = self.volume.grid();
        let inside = grid.ray_to_index(ray);
        let stretch = grid.index_bounds().intersect(&inside).intersect(Interval::up_to(end));
        let stretch = self.clip.cut(&inside, stretch);
        if stretch.is_empty() {
            return Track { ray: inside, length: 0.0, before: 0.0, shift: 0.0 };
        }
        let ray = Ray::new(inside.at(stretch.start), inside.direction);
        // From very far away the difference of the two distances is all rounding error.
        let length = (stretch.end - stretch.start).min(self.longest);
        Track { ray, length, before: stretch.start, shift: 0.0 }
    }

    /// Whether matter may be at an index-space position: inside the box and not cut away.
    #[must_use]
    pub fn contains(&self, p: Vec3) -> bool {
        self.volume.grid().index_bounds().contains(p) && self.clip.keeps(p)
    }

    /// [`Self::contains`] of a position per lane.
    #[inline(always)]
    pub(crate) fn contains_lanes<S: Lanes>(&self, simd: S, [x, y, z]: [S::f32s; 3]) -> S::mask32s {
        let box_ = self.volume.grid().index_bounds();
        let (lo, hi) = (box_.min, box_.max);
        let mut inside = x.simd_ge(S::f32s::splat(simd, lo.x)) & x.simd_le(S::f32s::splat(simd, hi.x));
        inside &= y.simd_ge(S::f32s::splat(simd, lo.y)) & y.simd_le(S::f32s::splat(simd, hi.y));
        inside &= z.simd_ge(S::f32s::splat(simd, lo.z)) & z.simd_le(S::f32s::splat(simd, hi.z));
        self.clip.keeps_lanes(simd, [x, y, z], inside)
    }

    /// Extinction per world unit at an index-space position.
    #[inline]
    #[must_use]
    pub fn sigma_t(&self, p: Vec3) -> f32 {
        self.density * self.transfer.opacity(self.volume.value(p))
    }

    /// All optics at an index-space position.
    #[inline]
    #[must_use]
    pub fn optics(&self, p: Vec3) -> Optics {
        self.transfer.optics(self.volume.value(p))
    }

    /// The scattering function where a surface with this normal has the share `q`.
    #[inline]
    pub(crate) fn event_at_surface(&self, optics: &Optics, normal: Option<Vec3>, q: f32) -> Event {
        let surface =
            Surface { albedo: optics.albedo, specular: optics.specular, roughness: optics.roughness };
        Event { phase: self.phase, brdf: self.brdf, surface, normal, q }
    }

    /// The scattering function at an index-space position; the gradient is read only where it matters.
    #[inline]
    #[must_use]
    pub fn event(&self, p: Vec3, optics: &Optics) -> Event {
        let mut event = self.event_at_surface(optics, None, 0.0);
        if optics.surface > 0.0 {
            let Some(gradient) = self.volume.gradient(p) else { return event };
            let range = Binade::of(self.gradient_range);
            let length = gradient.length * gradient.scale.over(range);
            let range = self.gradient_range * range.inverse();
            let h = self.volume.grid().scaled_voxel_size();
            event.q = surface_share(optics.surface, self.gradient_factor, length, h, range);
            event.normal = (event.q > 0.0).then_some(gradient.normal);
        }
        event
    }

    /// Where the data have edges, at an index-space position per lane: the same as [`Self::event`] but for rounding.
    #[inline(always)]
    pub(crate) fn edges_lanes<S: Lanes>(&self, simd: S, p: [S::f32s; 3]) -> EdgeLanes<S> {
        let zero = S::f32s::splat(simd, 0.0);
        if !self.transfer.reflects() || self.gradient_range <= 0.0 {
            return EdgeLanes { normal: [zero; 3], share: zero };
        }
        let scale = Binade::of(self.gradient_range);
        let [x, y, z] = self.volume.gradient_lanes(simd, p, scale);
        let length = x.mul_add(x, y.mul_add(y, z * z)).sqrt();
        let inverse = length.simd_gt(zero).select(S::f32s::splat(simd, 1.0) / length, zero);
        // As in `surface_share`.
        let range = self.gradient_range * scale.inverse();
        let steepness = self.gradient_factor * self.volume.grid().scaled_voxel_size() / range;
        let share = one_minus_exp(simd, length * steepness);
        EdgeLanes { normal: [x * inverse, y * inverse, z * inverse], share }
    }
}

/// Edges of the data at a position per lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeLanes<S: Lanes> {
    /// Unit gradients, along the world's axes; 0 where the data are even.
    pub normal: [S::f32s; 3],
    /// [`surface_share`] of matter that is all surface.
    pub share: S::f32s,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::Point;
    use crate::volume::{Grid, ValueMap, Voxels};

    #[test]
    fn from_far_away_no_track_is_longer_than_the_box() {
        let grid = Grid::centred([4, 3, 2], [1e-6; 3]).unwrap();
        let volume = Arc::new(Volume::new(grid, Voxels::U8((0..24).collect()), ValueMap::IDENTITY).unwrap());
        let transfer = TransferFunction::new(vec![Point { value: 0.0, optics: Optics::default() }]).unwrap();
        let settings = MediumSettings::plain(1.0);
        let medium = Medium::new(volume, Arc::new(transfer), &settings);
        for i in 0..1000_u16 {
            let aim = Vec3::new(f32::from(i % 10), f32::from(i / 10 % 10), f32::from(i / 100)) * 4e-7 - 2e-6;
            let from = Vec3::new(-3e9, 7e9, 1e10);
            let track = medium.track(&Ray::new(from, (aim - from).normalize()), f32::INFINITY);
            assert!(track.length() <= 6e-6, "{}", track.length());
        }
    }

    #[test]
    fn an_edge_of_the_data_is_a_surface_as_far_as_its_gradient_says() {
        let grid = Grid::centred([10, 2, 2], [0.5, 1.0, 0.25]).unwrap();
        let voxels = Voxels::U8((0..40).map(|i| i % 10).collect());
        let volume = Arc::new(Volume::new(grid, voxels, ValueMap::IDENTITY).unwrap());
        let optics = Optics { surface: 0.7, ..Optics::default() };
        let transfer = Arc::new(TransferFunction::new(vec![Point { value: 0.0, optics }]).unwrap());
        let settings = MediumSettings::plain(1.0);
        let medium = Medium::new(volume, transfer, &settings);
        let here = Vec3::new(4.25, 0.5, 0.5);
        // A slope of 2 per world unit, a voxel of 1/2, values from 0 to 9.
        let event = medium.event(here, &optics);
        assert!((event.q - 0.7 * (1.0 - (-3.0_f32 * 2.0 * 0.5 / 9.0).exp())).abs() < 1e-6, "{}", event.q);
        assert_eq!(event.normal, Some(Vec3::X));
        let even = medium.event(here, &Optics { surface: 0.0, ..optics });
        assert_eq!((even.q, even.normal), (0.0, None));
    }
}
