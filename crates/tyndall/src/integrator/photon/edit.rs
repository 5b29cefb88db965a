//! What of light paths, photons and segments an edit leaves valid.

use super::bounds::Bounds;
use super::lights::{Ground, LightPaths, Plan, sources};
use super::paths::Past;
use super::{PhotonMapping, SegmentTile, step};
use crate::light::Light;
use crate::scene::{Difference, Scene};
use crate::transfer::{BinSet, HistoryGroups, Historygram, TransferFunction};
use crate::volume::ValueBins;
use std::sync::atomic::Ordering;

/// What histories are asked for after an edit \[Jonsson12, sec. 4.2\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Query {
    /// Values whose change ends what paths have in common with new ones.
    paths: Past,
    /// Values whose change shows in a segment.
    view: Historygram,
    /// Whether glowing matter starts its paths elsewhere.
    glow: bool,
}

impl Query {
    fn new(groups: &HistoryGroups, old: &Scene, new: &Scene, difference: &Difference) -> Self {
        let transfers = [old.medium.transfer(), new.medium.transfer()];
        let bins_where = |is: &dyn Fn(&TransferFunction, usize) -> bool| {
            let mut set = BinSet::EMPTY;
            let bins = (0..ValueBins::COUNT).filter(|&bin| transfers.iter().any(|t| is(t, bin)));
            bins.for_each(|bin| set.insert(bin));
            groups.query(&set)
        };
        let matter = bins_where(&|transfer, bin| transfer.opacity_range(around(transfer, bin))[1] > 0.0);
        let transfer = &difference.transfer;
        let opacity = groups.query(&transfer.opacity);
        let flight = if difference.density.is_some() { matter | opacity } else { opacity };
        let mut scatter = groups.query(&transfer.scattering);
        if difference.phase || difference.surfaces {
            scatter = Historygram::ALL;
        }
        // Where there is no matter nothing scatters.
        let scatter = scatter & matter;
        let glowing = bins_where(&|transfer, bin| transfer.emission_bound(around(transfer, bin)) > 0.0);
        let emission = groups.query(&transfer.emission);
        // Cells are weighed by all that is in them, also by what does not glow.
        let places = [old, new].map(|scene| scene.lights.emission());
        let moved = matches!(places, [Some(old), Some(new)] if !old.same_places(new));
        Self {
            paths: Past { flight, scatter },
            view: flight | scatter | (emission & matter),
            glow: moved || !emission.is_empty() || flight.meets(glowing),
        }
    }
}

/// Values that surely hold those of a bin.
pub(super) fn around(transfer: &TransferFunction, bin: usize) -> [f32; 2] {
    let bins = transfer.bins();
    let lo = if bin == 0 { f32::MIN } else { bins.value(bin as f32 - 0.01) };
    let hi = if bin + 1 == ValueBins::COUNT { f32::MAX } else { bins.value(bin as f32 + 1.01) };
    [lo, hi]
}

impl PhotonMapping {
    /// Drops what an edit touched of paths, photons and segments, and nothing else; false where all is to begin anew.
    pub(crate) fn update(
        &mut self,
        old: &Scene,
        new: &Scene,
        difference: &Difference,
        tiles: &mut [&mut Option<SegmentTile>],
    ) -> bool {
        if difference.method
            || difference.volume
            || difference.majorants
            || difference.clip
            || difference.seed
        {
            return false;
        }
        let mut query = Query::new(&self.ground.groups, old, new, difference);
        if !difference.transfer.opacity.is_empty() {
            let Ground { groups, cells, bounds, .. } = &mut self.ground;
            query.paths.flight |= bounds.raised(old.medium.majorants(), new.medium.majorants());
            *bounds = Bounds::new(groups, cells, &new.medium);
        }
        self.traced.store(0, Ordering::Relaxed);
        self.pass = None;
        if tiles.iter().all(|tile| tile.as_ref().is_none_or(SegmentTile::is_settled)) {
            self.places.clear();
        }
        for light in &mut self.lights {
            light.chunks.iter_mut().for_each(|chunk| chunk.add_change(&query.paths));
        }
        self.update_lights(new, query.glow);
        if difference.density.is_some() {
            self.map = None;
        }
        // With other steps, segments end elsewhere.
        if difference.camera || difference.size || step(old, &self.settings) != step(new, &self.settings) {
            self.has_segments = false;
        }
        for tile in tiles {
            match tile {
                Some(tile) if self.has_segments => tile.add_change(query.view),
                tile => **tile = None,
            }
        }
        true
    }

    /// Keeps the paths of lights that send the same ones, wherever they are now among the lights.
    fn update_lights(&mut self, scene: &Scene, glow: bool) {
        let sources = sources(scene);
        let plan = Plan::new(scene, &self.settings, 0, sources.len());
        let mut old: Vec<Option<LightPaths>> = self.lights.drain(..).map(Some).collect();
        for (light, stream) in sources {
            let kept = old.iter_mut().find(|old| old.as_ref().is_some_and(|old| old.stream == stream));
            let same = |old: &LightPaths| match (&old.light, &light) {
                (Some(old), Some(light)) => old.same_paths(light),
                (None, None) => !glow,
                _ => false,
            };
            let kept = kept.and_then(Option::take);
            let (kept, gone) = match kept {
                Some(kept) if same(&kept) => (Some(kept), None),
                kept => (None, kept),
            };
            gone.iter().for_each(|gone| self.mark(gone));
            let mut paths = match kept {
                Some(mut kept) => {
                    if kept.light.as_ref().map(Light::color) != light.as_ref().map(Light::color) {
                        self.mark(&kept);
                        self.map = None;
                    }
                    kept.light = light;
                    kept
                }
                None => {
                    self.map = None;
                    LightPaths::new((light, stream), &plan)
                }
            };
            if paths.count != plan.count {
                // Every photon of it now stands for more light, or for less.
                self.mark(&paths);
                self.map = None;
                paths.set_count(&plan);
            }
            self.lights.push(paths);
        }
        for gone in old.into_iter().flatten() {
            self.mark(&gone);
            self.map = None;
        }
    }

    /// Marks where all photons of a light are.
    fn mark(&self, light: &LightPaths) {
        light.chunks.iter().for_each(|chunk| self.places.mark_all(chunk.photons()));
    }
}
