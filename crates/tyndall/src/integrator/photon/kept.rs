//! Light paths and segments as they were, for comparisons.

use super::segments::SegmentTile;
use super::stored::Photon;
use crate::integrator::light_paths::LightPaths;
use crate::integrator::{ItemChanges, KeptItems};
use std::any::Any;

/// Light paths and view-ray segments at one point in time.
pub(super) struct KeptLight {
    pub lights: Vec<LightPaths<Photon>>,
    pub tiles: Vec<Option<SegmentTile>>,
}

impl KeptLight {
    /// Number of paths that differ in `lights`, or do not exist there.
    fn paths_differing(&self, lights: &[LightPaths<Photon>]) -> usize {
        let of_light = |light: &LightPaths<Photon>| {
            let same = lights.iter().find(|other| other.stream == light.stream);
            let chunks = light.chunks.iter().enumerate();
            let differing = chunks.map(|(i, chunk)| {
                same.and_then(|same| same.chunks.get(i)).map_or(chunk.len(), |other| chunk.differing(other))
            });
            differing.sum::<usize>()
        };
        self.lights.iter().map(of_light).sum()
    }
}

impl KeptItems for KeptLight {
    fn compare(&self, other: &dyn KeptItems) -> ItemChanges {
        let other: &dyn Any = other;
        let (lights, tiles) =
            other.downcast_ref::<Self>().map_or((&[][..], &[][..]), |other| (&other.lights, &other.tiles));
        let mut changes = ItemChanges { differing: self.paths_differing(lights), new: 0 };
        for (i, segments) in self.tiles.iter().enumerate() {
            let Some(segments) = segments else { continue };
            changes += match tiles.get(i) {
                Some(Some(other)) => segments.compare(other),
                _ => ItemChanges { differing: 0, new: segments.len() },
            };
        }
        changes
    }
}
