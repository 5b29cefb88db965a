//! The methods of computing light.

mod history;
mod path;
mod photon;
mod raymarch;
mod stop;

pub use path::Path;
pub use photon::PhotonMapping;
pub use raymarch::RayMarch;
pub use stop::Stop;

use crate::film::Tile;
use crate::scene::{Difference, IntegratorKind, Scene};
use crate::simd::Level;
use path::{SampleTile, Walk};
use photon::{Paths, SegmentTile};
use raymarch::Packet;
use rayon::prelude::*;

/// A method. Everything about a sample follows from its pixel and number.
#[derive(Debug)]
pub enum Integrator {
    /// See [`RayMarch`].
    RayMarch(RayMarch),
    /// See [`Path`].
    Path(Path),
    /// See [`PhotonMapping`].
    Photon(Box<PhotonMapping>),
}

impl Integrator {
    /// The scene's method, prepared for the scene and the processor's vector instructions; `path` keeps samples for edits to
    /// come in so many bytes.
    #[must_use]
    pub fn new(scene: &Scene, level: Level, sample_memory: usize) -> Self {
        match scene.render.integrator {
            IntegratorKind::RayMarch { step, light_samples } => {
                Self::RayMarch(RayMarch::new(scene, step, light_samples, level))
            }
            IntegratorKind::Path => Self::Path(Path::keeping(scene, level, sample_memory)),
            IntegratorKind::Photon(settings) => {
                Self::Photon(Box::new(PhotonMapping::new(scene, settings, level)))
            }
        }
    }

    /// Whether samples taken before an edit may differ, by a bit or more, from those that would be taken now.
    #[must_use]
    pub fn is_touched_by(&self, difference: &Difference) -> bool {
        // Cells decide which numbers tracking draws, and in which order a march adds up what it meets.
        let touched = difference.view() || difference.light() || difference.majorants;
        match self {
            Self::RayMarch(_) => touched,
            Self::Path(_) => touched || difference.seed,
            Self::Photon(_) => touched || difference.seed || difference.lights.names,
        }
    }

    /// Goes on from one scene to another that touches it, and keeps what of its own and of the tiles' state is still valid;
    /// false where that is nothing, and all is to begin anew.
    pub fn update(
        &mut self,
        old: &Scene,
        new: &Scene,
        difference: &Difference,
        tiles: &mut [TileState],
    ) -> bool {
        let kept = match self {
            Self::Photon(photon) => {
                let mut segments: Vec<_> = tiles.iter_mut().map(|tile| &mut tile.segments).collect();
                photon.update(old, new, difference, &mut segments)
            }
            Self::Path(path) => {
                let query = path.update(old, new, difference);
                if let Some(query) = &query {
                    tiles.par_iter_mut().for_each(|tile| tile.samples.ask(query));
                }
                query.is_some()
            }
            Self::RayMarch(_) => false,
        };
        tiles.iter_mut().for_each(|tile| (tile.walk, tile.packet) = (None, None));
        kept
    }

    /// Begins to count what is computed.
    pub fn count_anew(&mut self, tiles: &mut [TileState]) {
        if let Self::Photon(photon) = self {
            photon.count_anew();
        }
        for tile in tiles {
            tile.samples.counts = [0; 2];
            if let Some(segments) = &mut tile.segments {
                segments.computed = [0; 2];
            }
        }
    }

    /// Makes ready what the next sample of all pixels needs; false where a stop came before.
    #[must_use]
    pub fn prepare<'s>(&mut self, scene: &Scene, sample: u32, stop: &(impl Fn() -> Stop<'s> + Sync)) -> bool {
        match self {
            Self::RayMarch(_) | Self::Path(_) => true,
            Self::Photon(photon) => photon.prepare(scene, sample, stop),
        }
    }

    /// Samples that may follow each other without being prepared one by one.
    #[must_use]
    pub fn samples_at_once(&self) -> u32 {
        match self {
            Self::RayMarch(_) | Self::Path(_) => u32::MAX,
            Self::Photon(_) => 1,
        }
    }

    /// Adds a sample to every pixel of a tile until the tile has `samples`, or is told to stop. What is then half done
    /// waits in `state` and is taken up by the next call, so that slices however thin get on and leave no trace.
    pub fn refine(&self, scene: &Scene, tile: &mut Tile, state: &mut TileState, samples: u32, stop: &Stop) {
        match self {
            Self::RayMarch(raymarch) => raymarch.refine(scene, tile, &mut state.packet, samples, stop),
            Self::Path(path) => {
                path.refine(scene, tile, (&mut state.walk, &mut state.samples), samples, stop);
            }
            Self::Photon(photon) => {
                if tile.samples() < samples {
                    photon.refine(scene, tile, &mut state.segments, stop);
                }
            }
        }
    }
}

/// What a session kept at one time beside pixels: for checks.
#[derive(Clone, Debug)]
pub struct Kept {
    paths: Paths,
    tiles: Vec<(Option<SegmentTile>, SampleTile)>,
}

impl Kept {
    /// Of an integrator and its tiles; `None` where nothing but pixels is kept.
    #[must_use]
    pub fn of(integrator: &Integrator, tiles: &[TileState]) -> Option<Self> {
        let paths = match integrator {
            Integrator::Photon(photon) => photon.light_paths(),
            Integrator::Path(path) if path.keeps() => Paths::default(),
            Integrator::Path(_) | Integrator::RayMarch(_) => return None,
        };
        let tiles = tiles.iter().map(|tile| (tile.segments.clone(), tile.samples.clone())).collect();
        Some(Self { paths, tiles })
    }

    /// Light paths and segments, or samples, that are there at both times, and are other ones.
    #[must_use]
    pub fn differing(&self, other: &Self) -> usize {
        self.paths.differing(&other.paths) + self.tiles_differing(other)[0]
    }

    /// Light paths and segments, or samples, that are other ones than before, or were not there.
    #[must_use]
    pub fn changed_since(&self, before: &Self) -> usize {
        self.paths.differing(&before.paths) + self.tiles_differing(before).iter().sum::<usize>()
    }

    fn tiles_differing(&self, other: &Self) -> [usize; 2] {
        let mut counts = [0; 2];
        let mut add = |[both, here]: [usize; 2]| counts = [counts[0] + both, counts[1] + here];
        for (i, (segments, samples)) in self.tiles.iter().enumerate() {
            let other = other.tiles.get(i);
            add(other.map_or([0, samples.len()], |(_, other)| samples.differing(other)));
            let Some(segments) = segments else { continue };
            add(match other {
                Some((Some(other), _)) if other.len() == segments.len() => segments.differing(other),
                _ => [0, segments.len()],
            });
        }
        counts
    }
}

/// What a method keeps of a tile beside its pixels.
#[derive(Clone, Debug, Default)]
pub struct TileState {
    /// What a stop left half done; empty where none was met.
    walk: Option<Walk>,
    packet: Option<Box<Packet>>,
    /// Of the view rays, for edits to come.
    segments: Option<SegmentTile>,
    /// Samples, for edits to come.
    samples: SampleTile,
}

impl TileState {
    /// Segments of its view rays, and of these the ones computed since the last edit.
    #[must_use]
    pub fn segments(&self) -> [usize; 2] {
        self.segments.as_ref().map_or([0; 2], |segments| [segments.len(), segments.computed[0]])
    }

    /// Places on its view rays where photons were gathered since the last edit.
    #[must_use]
    pub fn gathers(&self) -> usize {
        self.segments.as_ref().map_or(0, |segments| segments.computed[1])
    }

    /// Samples that are kept; of those since the last edit the ones that were taken, and that were found here.
    #[must_use]
    pub fn samples(&self) -> [usize; 3] {
        let [taken, found] = self.samples.counts;
        [self.samples.len(), taken, found]
    }

    /// Bytes that its view rays keep, or its samples.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.samples.bytes() + self.segments.as_ref().map_or(0, SegmentTile::bytes)
    }
}
