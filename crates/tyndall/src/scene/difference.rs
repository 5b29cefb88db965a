//! What an edit changed; nothing else decides this.

use super::Scene;
use crate::transfer::TransferDifference;
use std::collections::HashMap;

/// What changed from one scene to another, in terms of what light transport reads. Settings for display (exposure,
/// tone) and for stopping (samples) are not part of a scene.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent thing that changed or did not")]
pub struct Difference {
    /// Data values whose optical properties changed.
    pub transfer: TransferDifference,
    /// The new density divided by the old; `None` if it did not change, infinite if the old one was zero. Extinction
    /// changes due to the transfer function are not included.
    pub density: Option<f32>,
    /// The phase function.
    pub phase: bool,
    /// How surfaces reflect, or how strong a gradient makes a surface, if the matter has any.
    pub surfaces: bool,
    /// The clips.
    pub clip: bool,
    /// Voxel values, grid or interpolation.
    pub volume: bool,
    /// Edge of the majorant cells, which changes the random numbers that tracking uses but not the expected picture.
    pub majorants: bool,
    /// Changes to the lights.
    pub lights: LightsDifference,
    /// The camera.
    pub camera: bool,
    /// The picture's size.
    pub size: bool,
    /// The background.
    pub background: bool,
    /// The method, its settings, or the maximum number of scatterings.
    pub method: bool,
    /// The seed of the random numbers.
    pub seed: bool,
}

/// Changes to the lights of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightsDifference {
    /// For every light of the new scene, its counterpart in the old one.
    pub origins: Vec<LightOrigin>,
    /// Indices of the old lights that were removed.
    pub removed: Vec<usize>,
    /// Whether any light's name changed or moved to another light; random numbers keyed by name then change.
    pub names: bool,
}

/// The counterpart of a light in the old scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightOrigin {
    /// The old light of this index, unchanged.
    Same(usize),
    /// The old light of this index, changed.
    Changed(usize),
    /// None: the light is new.
    New,
}

impl Difference {
    /// Compares two scenes.
    #[must_use]
    pub fn between(old: &Scene, new: &Scene) -> Self {
        let (was, is) = (&*old.medium, &*new.medium);
        let reflects = was.transfer().reflects() || is.transfer().reflects();
        let surfaces = was.brdf() != is.brdf()
            || was.gradient_factor() != is.gradient_factor()
            || was.gradient_range() != is.gradient_range();
        Self {
            transfer: TransferDifference::between(was.transfer(), is.transfer()),
            density: (was.density().to_bits() != is.density().to_bits())
                .then(|| is.density() / was.density()),
            phase: was.phase() != is.phase(),
            surfaces: reflects && surfaces,
            clip: was.clip() != is.clip(),
            volume: !was.volume().is_same(is.volume()),
            majorants: was.majorants().edge() != is.majorants().edge(),
            lights: LightsDifference::between(old, new),
            camera: old.camera != new.camera,
            size: old.size != new.size,
            background: old.background != new.background,
            method: old.render.method != new.render.method
                || old.render.max_scatter != new.render.max_scatter,
            seed: old.render.seed != new.render.seed,
        }
    }

    /// Whether nothing that light transport reads has changed.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !(self.view()
            || self.light()
            || self.majorants
            || self.seed
            || self.lights.names
            || !self.transfer.ior.is_empty())
    }

    /// Whether view rays, or how they are processed, changed.
    #[must_use]
    pub fn view(&self) -> bool {
        self.camera || self.size || self.background || self.method
    }

    /// Whether light transport along straight rays changed: everything but the refractive index.
    #[must_use]
    pub fn light(&self) -> bool {
        let Self { transfer, .. } = self;
        let optics = [&transfer.opacity, &transfer.scattering, &transfer.emission];
        optics.iter().any(|set| !set.is_empty())
            || self.density.is_some()
            || self.phase
            || self.surfaces
            || self.clip
            || self.volume
            || !self.lights.is_empty()
    }
}

impl LightsDifference {
    /// Lights are matched by name, and those without a match by index.
    fn between(old: &Scene, new: &Scene) -> Self {
        let [was, is] = [old, new].map(|scene| scene.lights.lights());
        let [old_names, new_names] = [old, new].map(|scene| &scene.light_names);
        let [old_numbers, new_numbers] = [old_names, new_names].map(|names| numbers(names));
        let mut gone = vec![true; was.len()];
        let origins = (0..is.len())
            .map(|i| {
                let of_name = new_names[i].as_ref().and_then(|name| old_numbers.get(name).copied());
                // An old light whose name still exists is matched by that name.
                let borne =
                    |i: usize| old_names[i].as_ref().is_some_and(|name| new_numbers.contains_key(name));
                let of_number = || (i < was.len() && !borne(i)).then_some(i);
                let Some(k) = of_name.or_else(of_number) else { return LightOrigin::New };
                gone[k] = false;
                if was[k] == is[i] { LightOrigin::Same(k) } else { LightOrigin::Changed(k) }
            })
            .collect();
        let removed = (0..was.len()).filter(|&k| gone[k]).collect();
        Self { origins, removed, names: old_names != new_names }
    }

    /// Whether all lights are unchanged and in the same order, whatever their names, so that nothing changes for
    /// methods that choose lights by index.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        let in_place = |(i, origin): (usize, &LightOrigin)| *origin == LightOrigin::Same(i);
        self.removed.is_empty() && self.origins.iter().enumerate().all(in_place)
    }
}

/// The index of the first light of each name.
fn numbers(names: &[Option<String>]) -> HashMap<&String, usize> {
    names.iter().enumerate().rev().filter_map(|(i, name)| Some((name.as_ref()?, i))).collect()
}
