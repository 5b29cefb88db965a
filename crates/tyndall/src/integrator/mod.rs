//! The methods of computing light.

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
use path::Walk;
use photon::{Paths, SegmentTile};
use raymarch::Packet;

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
    /// The scene's method, prepared for the scene and the processor's vector instructions.
    #[must_use]
    pub fn new(scene: &Scene, level: Level) -> Self {
        match scene.render.integrator {
            IntegratorKind::RayMarch { step, light_samples } => {
                Self::RayMarch(RayMarch::new(scene, step, light_samples, level))
            }
            IntegratorKind::Path => Self::Path(Path::new(level)),
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
            Self::Path(_) | Self::Photon(_) => touched || difference.seed,
        }
    }

    /// Goes on from one scene to another that touches it, and keeps what of its own and of the tiles' state is still valid.
    pub fn update(
        &mut self,
        old: &Scene,
        new: &Scene,
        difference: &Difference,
        tiles: &mut [TileState],
        level: Level,
    ) {
        let kept = match self {
            Self::Photon(photon) => {
                let mut segments: Vec<_> = tiles.iter_mut().map(|tile| &mut tile.segments).collect();
                photon.update(old, new, difference, &mut segments)
            }
            Self::RayMarch(_) | Self::Path(_) => false,
        };
        if kept {
            tiles.iter_mut().for_each(|tile| (tile.walk, tile.packet) = (None, None));
        } else {
            tiles.fill(TileState::default());
            *self = Self::new(new, level);
        }
    }

    /// Begins to count what is computed.
    pub fn count_anew(&mut self, tiles: &mut [TileState]) {
        if let Self::Photon(photon) = self {
            photon.count_anew();
        }
        tiles
            .iter_mut()
            .filter_map(|tile| tile.segments.as_mut())
            .for_each(|segments| segments.computed = [0; 2]);
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
            Self::Path(path) => path.refine(scene, tile, &mut state.walk, samples, stop),
            Self::Photon(photon) => {
                if tile.samples() < samples {
                    photon.refine(scene, tile, &mut state.segments, stop);
                }
            }
        }
    }
}

/// What a photon mapper kept at one time: for checks.
#[derive(Clone, Debug)]
pub struct Kept {
    paths: Paths,
    segments: Vec<Option<SegmentTile>>,
}

impl Kept {
    /// Of an integrator and its tiles; `None` for a method that keeps nothing but pixels.
    #[must_use]
    pub fn of(integrator: &Integrator, tiles: &[TileState]) -> Option<Self> {
        let Integrator::Photon(photon) = integrator else { return None };
        let segments = tiles.iter().map(|tile| tile.segments.clone()).collect();
        Some(Self { paths: photon.light_paths(), segments })
    }

    /// Light paths and segments that are there at both times, and are other ones.
    #[must_use]
    pub fn differing(&self, other: &Self) -> usize {
        self.paths.differing(&other.paths) + self.segments_differing(other)[0]
    }

    /// Light paths and segments that are other ones than before, or were not there.
    #[must_use]
    pub fn changed_since(&self, before: &Self) -> usize {
        self.paths.differing(&before.paths) + self.segments_differing(before).iter().sum::<usize>()
    }

    fn segments_differing(&self, other: &Self) -> [usize; 2] {
        let mut counts = [0; 2];
        for (i, tile) in self.segments.iter().enumerate() {
            let Some(tile) = tile else { continue };
            let [both, here] = match other.segments.get(i) {
                Some(Some(other)) if other.len() == tile.len() => tile.differing(other),
                _ => [0, tile.len()],
            };
            counts = [counts[0] + both, counts[1] + here];
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

    /// Bytes that its view rays keep.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.segments.as_ref().map_or(0, SegmentTile::bytes)
    }
}
