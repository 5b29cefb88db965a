//! Which light paths, photons and segments remain valid after an edit.

use super::stored::Photon;
use super::{PhotonMapper, SegmentTile, marks_for, plan, step};
use crate::integrator::Edited;
use crate::integrator::history::Touched;
use crate::integrator::light_paths::{LightPaths, PathSource, sources};
use crate::light::Light;
use crate::scene::Scene;

impl PhotonMapper {
    /// Drops the paths, photons and segments that an edit touched, and nothing else; false if everything must be
    /// recomputed.
    pub(super) fn keep_valid(&mut self, edit: &Edited, tiles: &mut [Option<SegmentTile>]) -> bool {
        let Edited { old, new, difference } = *edit;
        if difference.volume || difference.majorants || difference.clip || difference.seed {
            return false;
        }
        let mut touched = Touched::new(&self.ground.reading.groups, old, new, difference);
        if !difference.transfer.opacity.is_empty() {
            // Light paths do not read a cell's smallest opacity.
            let [_, raised] = self.ground.reading.update(&old.medium, &new.medium);
            touched.paths.flight |= raised;
        }
        self.traced = 0;
        self.pass = None;
        // With a different step, segments end at other positions, and the widest slice of a beam changes.
        let steps = step(old, &self.settings) != step(new, &self.settings);
        if steps {
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
        if difference.camera || difference.size || steps {
            self.has_segments = false;
        }
        for tile in tiles {
            match tile {
                Some(tile) if self.has_segments => tile.add_change(touched.view),
                tile => *tile = None,
            }
        }
        true
    }

    /// Keeps the paths of lights whose paths are unchanged, even if their index changed.
    fn update_lights(&mut self, scene: &Scene, glow: bool) {
        let sources = sources(scene);
        let plan = plan(scene, &self.settings, sources.len());
        let mut old: Vec<Option<LightPaths<Photon>>> = self.lights.drain(..).map(Some).collect();
        for PathSource { light, stream } in sources {
            let kept = old.iter_mut().find(|old| old.as_ref().is_some_and(|old| old.stream == stream));
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
            gone.iter().for_each(|gone| self.mark(gone));
            let mut paths = match kept {
                Some(mut kept) => {
                    if kept.light.as_ref().map(Light::color) != light.as_ref().map(Light::color) {
                        self.mark(&kept);
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
            if paths.count != plan.count {
                // Every photon of this light now carries more or less flux.
                self.mark(&paths);
                self.map.discard();
                paths.set_count(&plan);
            }
            self.lights.push(paths);
        }
        for gone in old.into_iter().flatten() {
            self.mark(&gone);
            self.map.discard();
        }
    }

    /// Marks the positions of all photons of a light.
    fn mark(&self, light: &LightPaths<Photon>) {
        light.chunks.iter().for_each(|chunk| self.marks.mark_all(chunk.vertices()));
    }
}
