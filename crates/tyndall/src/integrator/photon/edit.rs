//! Which light paths, photons and segments remain valid after an edit.

use super::gather::{NARROW, between_points};
use super::segments::SeenChange;
use super::stored::Photon;
use super::{PhotonMapper, SegmentTile, cells_for, gather_memory, marks_for, plan, step};
use crate::integrator::cells::ChangeMarks;
use crate::integrator::history::{MovedBounds, Touched};
use crate::integrator::light_paths::{Chunk, LightPaths, PathSource, sources};
use crate::integrator::{Edited, Limits, Updated, drop_elsewhere};
use crate::light::Light;
use crate::scene::Scene;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};

impl PhotonMapper {
    /// Records what an edit changed, so that exactly the paths, photons and segments that it touched are computed again.
    pub(super) fn keep_valid(
        &mut self,
        edit: &Edited,
        tiles: &mut [Option<SegmentTile>],
        limits: &Limits,
    ) -> Updated {
        let Edited { old, new, difference } = *edit;
        if difference.volume || difference.majorants || difference.clip || difference.seed {
            return Updated::StartAnew;
        }
        // Light paths do not read a cell's smallest opacity.
        let (media, reading) = ([&*old.medium, &*new.medium], &mut self.ground.reading);
        let Some(MovedBounds { raised, .. }) = reading.update(media, &difference.transfer.opacity, limits)
        else {
            return Updated::Stopped;
        };
        let mut touched = Touched::new(&self.ground.reading.groups, old, new, difference);
        touched.paths.flight |= raised;
        if let Some(pass) = self.pass.take() {
            drop_elsewhere(pass);
        }
        // With a different step, segments end at other positions, and the widest slice of a beam changes.
        let step_changed = step(old, &self.settings) != step(new, &self.settings);
        if step_changed {
            self.marks = marks_for(new, &self.settings);
        } else if tiles.iter().all(|tile| tile.as_ref().is_none_or(SegmentTile::is_settled)) {
            self.marks.clear();
        }
        for light in &mut self.lights {
            light.chunks.iter_mut().for_each(|chunk| chunk.add_change(&touched.paths));
        }
        self.update_lights(new, touched.glow);
        if difference.density.is_some() {
            self.map.discard();
        }
        let peaks = |scene: &Scene| {
            let edges = between_points(&cells_for(scene, &self.settings, self.settings.radius));
            scene.medium.may_peak_within(NARROW * edges.max_element())
        };
        // Gathers then look for matter in another way.
        let peaks_changed = peaks(old) != peaks(new);
        if difference.camera || difference.size || step_changed || peaks_changed {
            self.has_segments = false;
        }
        if difference.size {
            // The tiles, of which there may be fewer, give back all memory.
            let gathers: Vec<_> = tiles.iter_mut().flatten().map(SegmentTile::take_gathers).collect();
            drop_elsewhere(gathers);
            self.gather_memory = gather_memory(new, self.edit_memory);
        }
        for tile in tiles.iter_mut().flatten() {
            if self.has_segments {
                tile.add_change(SeenChange { matter: touched.view, colors: touched.colors });
            } else {
                tile.forget();
            }
        }
        Updated::Done
    }

    /// Keeps the paths of lights whose paths are unchanged, even if their index changed.
    fn update_lights(&mut self, scene: &Scene, glow: bool) {
        let sources = sources(scene);
        let plan = plan(scene, &self.settings, sources.len());
        let mut old: Vec<Option<LightPaths<Photon>>> = self.lights.drain(..).map(Some).collect();
        // The indices of each stream's lights, the last one first.
        let mut by_stream: HashMap<u32, Vec<usize>> = HashMap::new();
        for (i, lit) in old.iter().enumerate().rev() {
            by_stream.entry(lit.as_ref().map_or(0, |lit| lit.stream)).or_default().push(i);
        }
        for PathSource { light, stream } in sources {
            let kept = by_stream.get_mut(&stream).and_then(Vec::pop).map(|i| &mut old[i]);
            let same = |old: &LightPaths<Photon>| match (&old.light, &light) {
                (Some(old), Some(light)) => old.same_paths(light),
                (None, None) => !glow,
                _ => false,
            };
            let kept = kept.and_then(Option::take);
            let (kept, gone) = match kept {
                Some(kept) if same(&kept) => (Some(kept), None),
                kept => (None, kept),
            };
            self.gone.extend(gone.into_iter().flat_map(gone_chunks));
            let mut paths = match kept {
                Some(mut kept) => {
                    if kept.light.as_ref().map(Light::color) != light.as_ref().map(Light::color) {
                        kept.chunks.iter_mut().for_each(Chunk::must_mark);
                        self.map.discard();
                    }
                    kept.light = light;
                    kept
                }
                None => {
                    self.map.discard();
                    LightPaths::new(PathSource { light, stream }, &plan)
                }
            };
            if paths.count() != plan.count {
                // Every photon of this light now carries more or less flux.
                paths.chunks.iter_mut().for_each(Chunk::must_mark);
                self.map.discard();
                self.gone.extend(paths.set_count(plan.count));
            }
            self.lights.push(paths);
        }
        for gone in old.into_iter().flatten() {
            self.gone.extend(gone_chunks(gone));
            self.map.discard();
        }
    }

    /// Marks the positions of photons whose flux an edit changed or that are gone, in parallel on the current pool; false if stopped
    /// first.
    pub(super) fn mark_changed(&mut self, limits: &Limits) -> bool {
        let Self { gone, lights, marks, has_segments, .. } = self;
        let kept = lights.iter_mut().flat_map(|light| &mut light.chunks);
        let to_mark: Vec<_> = gone.iter_mut().chain(kept).filter(|chunk| chunk.is_to_be_marked()).collect();
        let left = AtomicUsize::new(to_mark.len());
        let off = ChangeMarks::off();
        let marks = if *has_segments { &*marks } else { &off };
        to_mark.into_par_iter().with_max_len(1).for_each(|chunk| {
            if !limits.stop().reached() {
                chunk.mark_all(marks);
                left.fetch_sub(1, Ordering::Relaxed);
            }
        });
        let done = left.into_inner() == 0;
        if done && !gone.is_empty() {
            drop_elsewhere(std::mem::take(gone));
        }
        done
    }
}

/// The chunks of a light that is gone, to be marked.
fn gone_chunks(mut light: LightPaths<Photon>) -> Vec<Chunk<Photon>> {
    light.chunks.iter_mut().for_each(Chunk::must_mark);
    light.chunks
}
