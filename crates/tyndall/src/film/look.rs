//! Views of an unfinished film: what changed since the last look, tone-mapped for a display.

use super::Film;
use super::tile::{TILE, Tile};
use super::tone::ToneCurve;
use crate::simd::Level;
use rayon::prelude::*;

/// How radiance is shown on a display.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// The curve.
    pub curve: ToneCurve,
    /// Brightens by `2^stops`.
    pub stops: f32,
}

/// A viewer of a film, with a picture of its own, of which each look updates the tiles that have changed.
///
/// The picture is opaque RGB with 8 bits per channel, row by row from the top; a transparent film is shown over black. A pixel
/// without a sample shows the first pixel of its block; a tile without samples keeps what the viewer showed before.
#[derive(Clone, Debug, Default)]
pub struct Viewer {
    size: [u32; 2],
    tone: Tone,
    pixels: Vec<[u8; 3]>,
    /// The revision of each tile, row by row.
    seen: Vec<Revision>,
    /// Origins of the tiles that the last look updated.
    changed: Vec<[u32; 2]>,
}

/// Identifies the contents of a tile: different contents have different revisions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Revision {
    film: u64,
    taken: usize,
}

impl Viewer {
    /// Width and height; zero before the first look.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The picture, three bytes a pixel.
    #[must_use]
    pub fn pixels(&self) -> &[u8] {
        self.pixels.as_flattened()
    }

    /// Origins of the tiles that the last look updated; their edge is [`TILE`] pixels, or less at the picture's border.
    #[must_use]
    pub fn changed(&self) -> &[[u32; 2]] {
        &self.changed
    }

    /// Updates the picture, in parallel on the current pool.
    pub fn look(&mut self, film: &Film, tone: Tone, level: Level) {
        if self.size != film.size {
            *self = Self { size: film.size, tone, ..Self::default() };
            self.pixels.resize(film.size.map(|n| n as usize).iter().product(), [0; 3]);
            self.seen.resize(film.tiles.len(), Revision::default());
        }
        if self.tone != tone {
            self.tone = tone;
            self.seen.fill(Revision::default());
        }
        let width = self.size[0] as usize;
        let columns = width.div_ceil(TILE as usize);
        let bands = self.pixels.par_chunks_mut(width * TILE as usize);
        let rows = film.tiles.par_chunks(columns).zip(self.seen.par_chunks_mut(columns)).zip(bands);
        let updated = rows.flat_map_iter(|((tiles, seen), band)| {
            let mut row = Row { width, level, tone, band };
            let mut changed = Vec::new();
            for (tile, seen) in tiles.iter().zip(seen) {
                let revision = Revision { film: film.generation, taken: tile.taken() };
                if *seen != revision && tile.taken() > 0 {
                    *seen = revision;
                    row.update(tile);
                    changed.push(tile.origin());
                }
            }
            changed
        });
        self.changed = updated.collect();
    }
}

/// A row of tiles in the viewer's picture.
struct Row<'a> {
    width: usize,
    level: Level,
    tone: Tone,
    band: &'a mut [[u8; 3]],
}

impl Row<'_> {
    fn update(&mut self, tile: &Tile) {
        let mut radiance = [[0.0; 3]; (TILE * TILE) as usize];
        let mut codes = [[0; 3]; (TILE * TILE) as usize];
        let [columns, rows] = tile.size().map(|n| n as usize);
        let count = columns * rows;
        tile.look(&mut radiance[..count]);
        self.tone.curve.encode(self.level, self.tone.stops, &radiance[..count], &mut codes[..count]);
        let left = tile.origin()[0] as usize;
        for (row, codes) in codes[..count].chunks_exact(columns).enumerate() {
            let first = row * self.width + left;
            self.band[first..first + columns].copy_from_slice(codes);
        }
    }
}
