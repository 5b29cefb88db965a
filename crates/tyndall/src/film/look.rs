//! Views of an unfinished film: what changed since the last look, tone-mapped for a display, or as it is.

use super::encode::{BATCH, Encode, Tone};
use super::tile::{TILE, Tile};
use super::{Film, Image};
use crate::simd::{Kernel, Lanes, Level};
use rayon::prelude::*;

/// A viewer of a film, which remembers what it has seen of it. Each look updates, in a picture that the caller keeps, the tiles that
/// have changed; all of them if the film's size or the tone is another than at the last look. Use one viewer for each picture: it
/// does not notice that it is given another one of the same size.
///
/// A pixel without a sample shows the first pixel of the smallest square around it (2, 4 or 8 pixels wide) whose first pixel has one; a tile
/// without samples keeps what the picture showed before.
#[derive(Clone, Debug, Default)]
pub struct Viewer {
    size: [u32; 2],
    /// `None` for a linear picture.
    tone: Option<Tone>,
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
    /// Width and height of the film at the last look; zero before the first.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Origins of the tiles that the last look updated; their edge is [`TILE`] pixels, or less at the picture's border.
    #[must_use]
    pub fn changed(&self) -> &[[u32; 2]] {
        &self.changed
    }

    /// Updates a picture of opaque RGB with 8 bits per channel, row by row from the top, in parallel on the current pool; a
    /// transparent film is shown over black. A picture of the wrong size is made anew.
    pub fn look(&mut self, film: &Film, tone: Tone, level: Level, picture: &mut Vec<[u8; 3]>) {
        let pixels = film.pixel_count();
        if picture.len() != pixels {
            *picture = vec![[0; 3]; pixels];
            self.size = [0; 2];
        }
        self.forget_if_other(film, Some(tone));
        let width = self.size[0] as usize;
        let columns = width.div_ceil(TILE as usize);
        let bands = picture.par_chunks_mut(width * TILE as usize);
        let rows = film.tiles.par_chunks(columns).zip(self.seen.par_chunks_mut(columns)).zip(bands);
        let updated = rows.flat_map_iter(|((tiles, seen), band)| {
            let changed = changed(film.generation, tiles, seen);
            for tile in &changed {
                level.run(Show { tone, tile, width, band: &mut *band });
            }
            changed.into_iter().map(Tile::origin).collect::<Vec<_>>()
        });
        self.changed = updated.collect();
    }

    /// Updates a linear picture with the variance and depth of each pixel, as [`Film::image`] returns it, except that missing pixels
    /// are filled. A picture of the wrong size is made anew.
    pub fn look_linear(&mut self, film: &Film, picture: &mut Image) {
        if picture.size != film.size || picture.rgba.len() != film.pixel_count() {
            *picture = Image::empty(film.size);
            self.size = [0; 2];
        }
        self.forget_if_other(film, None);
        let changed = changed(film.generation, &film.tiles, &mut self.seen);
        for tile in &changed {
            picture.update(tile);
            for (pixel, source) in tile.shown().into_iter().flatten().enumerate() {
                let [to, from] = [pixel, source].map(|pixel| picture.index_of(tile.position(pixel)));
                picture.rgba[to] = picture.rgba[from];
                picture.variance[to] = picture.variance[from];
                picture.depth[to] = picture.depth[from];
            }
        }
        self.changed = changed.into_iter().map(Tile::origin).collect();
    }

    /// Forgets what it has seen if that was of another size or shown in another way.
    fn forget_if_other(&mut self, film: &Film, tone: Option<Tone>) {
        if self.size != film.size || self.tone != tone {
            let seen = vec![Revision::default(); film.tiles.len()];
            *self = Self { size: film.size, tone, seen, changed: Vec::new() };
        }
    }
}

/// The tiles that have samples and are not as they were `seen`, which is updated.
fn changed<'a>(film: u64, tiles: &'a [Tile], seen: &mut [Revision]) -> Vec<&'a Tile> {
    let mut changed = Vec::new();
    for (tile, seen) in tiles.iter().zip(seen) {
        let revision = Revision { film, taken: tile.taken() };
        if *seen != revision && tile.taken() > 0 {
            *seen = revision;
            changed.push(tile);
        }
    }
    changed
}

/// Shows a tile in the picture.
struct Show<'a> {
    tone: Tone,
    tile: &'a Tile,
    /// Of the picture.
    width: usize,
    /// The rows of the picture that the tile is in.
    band: &'a mut [[u8; 3]],
}

impl Kernel for Show<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { tone, tile, width, band } = self;
        let (mut planes, mut alpha) = ([[0.0; BATCH]; 3], [0.0; BATCH]);
        tile.radiance(&mut planes);
        if tone.backdrop.is_some() {
            tile.alpha(&mut alpha);
        }
        if let Some(shown) = tile.shown() {
            for plane in planes.iter_mut().chain([&mut alpha]) {
                let own = *plane;
                for (shown, &source) in plane.iter_mut().zip(&shown) {
                    *shown = own[source];
                }
            }
        }
        let mut codes = [[0; 3]; BATCH];
        let codes = &mut codes[..tile.pixel_count()];
        Encode { tone, planes: &planes, alpha: &alpha, codes: &mut *codes }.run(simd);
        let (left, columns) = (tile.origin()[0] as usize, tile.size()[0] as usize);
        for (row, codes) in codes.chunks_exact(columns).enumerate() {
            let first = row * width + left;
            band[first..first + columns].copy_from_slice(codes);
        }
    }
}
