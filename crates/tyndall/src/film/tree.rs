//! The trees in which the samples of a tile's pixels are merged, see `estimate`.
//!
//! A tree may begin at a later sample than the first: it is then a part of the tree of a whole picture. Nodes that begin inside
//! the part are merged as usual. Of a node that begins before it, the complete children are kept apart, since children must be
//! merged from the first on.

use super::PixelSample;
use super::columns::Columns;
use super::encode::{BATCH, Planes};
use super::estimate::{
    ALPHA, CHUNK, Estimate, FAN_OUT, LUMINANCE_SPREAD, QUANTITIES, Sums, mean_of, merged_mean,
    samples_per_child,
};
use crate::math::{LUMINANCE, cast};

/// The samples of the pixels of a tile, from the same number on.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pixels: usize,
    /// Number of the first sample; a multiple of [`CHUNK`].
    first: u32,
    /// Sums over each pixel's incomplete chunk; empty before the first sample.
    open: Option<Columns<f64>>,
    /// For each level, the merged children of the node that is incomplete. Their number follows from the number of samples; where
    /// it is zero, the entry is out of date.
    nodes: Vec<Columns<f32>>,
    /// Complete children of nodes that begin before the first sample, in the order of their samples.
    edges: Vec<(Child, Columns<f32>)>,
}

/// A child of a node: a chunk, or a node of the level below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child {
    /// The level of the node that it is a child of.
    pub parent_level: usize,
    /// Its number among all children of such nodes.
    pub number: u32,
}

impl Child {
    fn begins(self) -> u64 {
        u64::from(self.number) * samples_per_child(self.parent_level)
    }

    fn ends(self) -> u64 {
        self.begins() + samples_per_child(self.parent_level)
    }

    /// Its number among the children of its parent.
    pub fn sibling(self) -> u32 {
        self.number % FAN_OUT
    }

    fn parent_begins(self) -> u64 {
        u64::from(self.number - self.sibling()) * samples_per_child(self.parent_level)
    }

    fn next(self) -> Self {
        Self { number: self.number + 1, ..self }
    }

    /// Its parent, as a child.
    fn parent(self) -> Self {
        Self { parent_level: self.parent_level + 1, number: self.number / FAN_OUT }
    }
}

/// Where samples are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A complete child of a node that begins before the first sample.
    Edge(Child),
    /// The merged children of the incomplete node of a level.
    Node(usize),
    /// The incomplete chunk.
    Open,
}

/// Consecutive samples that are stored together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub place: Place,
    /// Number of samples.
    pub samples: f64,
    /// The fraction that they make of all samples up to their last.
    share: f64,
}

/// Where the samples from `first` on and before `end` are stored, in their order.
pub(super) fn pieces(first: u32, end: u32) -> Vec<Piece> {
    let (first, end) = (u64::from(first), u64::from(end));
    let mut pieces = Vec::new();
    let mut all = 0.0;
    let mut add = |place: Place, samples: u64| {
        let samples = samples as f64;
        all += samples;
        pieces.push(Piece { place, samples, share: samples / all });
    };
    let mut child = Child { parent_level: 0, number: cast::low_u32(first / u64::from(CHUNK)) };
    while child.ends() <= end {
        if child.sibling() == 0 {
            child = child.parent();
        } else {
            add(Place::Edge(child), samples_per_child(child.parent_level));
            child = child.next();
        }
    }
    let levels = (0..).take_while(|&level| samples_per_child(level) <= end).count();
    for level in (0..levels).rev() {
        let size = samples_per_child(level);
        let merged = end / size % u64::from(FAN_OUT) * size;
        let begins = end / size * size - merged;
        if merged > 0 && begins >= first {
            add(Place::Node(level), merged);
        }
    }
    if !end.is_multiple_of(u64::from(CHUNK)) {
        add(Place::Open, end % u64::from(CHUNK));
    }
    pieces
}

/// Bytes per pixel from sample number `first` until there are `end`: 72 for the incomplete chunk, and 36 for each node and for each
/// complete child of a node that begins before the first.
pub(super) fn bytes_of_pixel(first: u32, end: u32) -> usize {
    let levels = (0..).take_while(|&level| samples_per_child(level) <= u64::from(end)).count();
    let edges = pieces(first, end).iter().filter(|piece| matches!(piece.place, Place::Edge(_))).count();
    size_of::<Sums>() + (levels + edges) * size_of::<Estimate>()
}

impl Tree {
    /// For this many pixels; without samples, of which the first will have the given number.
    pub fn new(pixels: usize, first: u32) -> Self {
        debug_assert!(first.is_multiple_of(CHUNK), "a tree begins with a chunk");
        Self { pixels, first, open: None, nodes: Vec::new(), edges: Vec::new() }
    }

    /// Number of the first sample.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Forgets all samples but keeps the memory; the next will be the first of all.
    pub fn clear(&mut self) {
        self.first = 0;
        self.edges.clear();
    }

    /// Adds the sample of a pixel with this number, the one after the pixel's last.
    #[inline]
    pub fn add(&mut self, pixel: usize, number: u32, sample: &PixelSample) {
        let open = self.open.get_or_insert_with(|| Columns::new(self.pixels));
        let begins = number.is_multiple_of(CHUNK);
        let mut sums = if begins { Sums::default() } else { bytemuck::cast(open.get(pixel)) };
        sums.add(sample);
        if (number + 1).is_multiple_of(CHUNK) {
            let chunk = Child { parent_level: 0, number: number / CHUNK };
            self.add_child(pixel, chunk, sums.estimate(f64::from(CHUNK)));
        } else {
            open.set(pixel, bytemuck::cast(sums));
        }
    }

    /// Merges a pixel's complete child into its parent, and each node that this completes into its own.
    fn add_child(&mut self, pixel: usize, mut child: Child, mut estimate: Estimate) {
        while child.parent_begins() >= u64::from(self.first) {
            let node = self.node_mut(child.parent_level);
            let (before, size) = (child.sibling(), samples_per_child(child.parent_level) as f64);
            if before > 0 {
                let merged: Estimate = bytemuck::cast(node.get(pixel));
                estimate = merged.merged(f64::from(before) * size, &estimate, size);
            }
            if before + 1 < FAN_OUT {
                node.set(pixel, bytemuck::cast(estimate));
                return;
            }
            child = child.parent();
        }
        self.edge_mut(child).set(pixel, bytemuck::cast(estimate));
    }

    fn node_mut(&mut self, level: usize) -> &mut Columns<f32> {
        while self.nodes.len() <= level {
            self.nodes.push(Columns::new(self.pixels));
        }
        &mut self.nodes[level]
    }

    fn edge_mut(&mut self, child: Child) -> &mut Columns<f32> {
        let known = self.edges.iter().position(|(known, _)| *known == child);
        let index = known.unwrap_or_else(|| {
            self.edges.push((child, Columns::new(self.pixels)));
            self.edges.len() - 1
        });
        &mut self.edges[index].1
    }

    /// The estimates of a piece; `None` for the incomplete chunk.
    fn estimates_at(&self, place: Place) -> Option<&Columns<f32>> {
        match place {
            Place::Edge(child) => self.edges.iter().find(|(known, _)| *known == child).map(|edge| &edge.1),
            Place::Node(level) => self.nodes.get(level),
            Place::Open => None,
        }
    }

    /// A pixel's estimate from its samples in the given pieces.
    pub fn estimate(&self, pixel: usize, pieces: &[Piece]) -> Estimate {
        let mut whole = Estimate::default();
        let mut n = 0.0;
        for piece in pieces {
            let part = match (self.estimates_at(piece.place), &self.open) {
                (Some(estimates), _) => bytemuck::cast(estimates.get(pixel)),
                (None, Some(open)) => bytemuck::cast::<_, Sums>(open.get(pixel)).estimate(piece.samples),
                (None, None) => Estimate::default(),
            };
            whole = if n > 0.0 { whole.merged(n, &part, piece.samples) } else { part };
            n += piece.samples;
        }
        whole
    }

    /// The mean radiance of all pixels from their samples in the given pieces: the bits of [`Self::estimate`].
    #[inline(always)]
    pub fn radiance(&self, pieces: &[Piece], planes: &mut Planes) {
        for (channel, plane) in planes.iter_mut().enumerate() {
            self.means(channel, pieces, plane);
        }
    }

    /// The same of the mean alpha.
    #[inline(always)]
    pub fn alpha(&self, pieces: &[Piece], plane: &mut [f32; BATCH]) {
        self.means(ALPHA, pieces, plane);
    }

    #[inline(always)]
    fn means(&self, quantity: usize, pieces: &[Piece], plane: &mut [f32; BATCH]) {
        for piece in pieces {
            if let Some(estimates) = self.estimates_at(piece.place) {
                for (mean, &part) in plane.iter_mut().zip(estimates.column(quantity)) {
                    merge(mean, part, piece.share);
                }
            } else if let Some(open) = &self.open {
                for (mean, &sum) in plane.iter_mut().zip(open.column(quantity)) {
                    merge(mean, mean_of(sum, piece.samples), piece.share);
                }
            }
        }
    }

    /// Mean luminance of all pixels, and the sum of squared deviations from it, from their samples in the given pieces.
    #[inline(always)]
    pub fn luminance(&self, pieces: &[Piece], mean: &mut [f64; BATCH], spread: &mut [f64; BATCH]) {
        let [red, green, blue] = LUMINANCE.map(f64::from);
        for &Piece { place, samples: m, share } in pieces {
            // Samples before these.
            let n = m / share - m;
            if let Some(estimates) = self.estimates_at(place) {
                let [r, g, b, s] = [0, 1, 2, LUMINANCE_SPREAD].map(|quantity| estimates.column(quantity));
                for i in 0..self.pixels {
                    let here = f64::from(r[i]) * red + f64::from(g[i]) * green + f64::from(b[i]) * blue;
                    let apart = here - mean[i];
                    mean[i] += apart * share;
                    spread[i] += f64::from(s[i]) + apart * apart * n * share;
                }
            } else if let Some(open) = &self.open {
                let [r, g, b, s] = [0, 1, 2, LUMINANCE_SPREAD].map(|quantity| open.column(quantity));
                for i in 0..self.pixels {
                    let sum = r[i] * red + g[i] * green + b[i] * blue;
                    let apart = sum / m - mean[i];
                    mean[i] += apart * share;
                    spread[i] += (s[i] - sum * sum / m).max(0.0) + apart * apart * n * share;
                }
            }
        }
    }

    /// Adds the samples of another tree, of which all pixels have those before `end`; they begin where the samples here end.
    pub fn append(&mut self, other: &Self, end: u32) {
        for piece in pieces(other.first, end) {
            match (piece.place, other.estimates_at(piece.place)) {
                (Place::Edge(child), Some(estimates)) => {
                    for pixel in 0..self.pixels {
                        self.add_child(pixel, child, bytemuck::cast(estimates.get(pixel)));
                    }
                }
                // The node begins where the samples here end, so that there is nothing to merge it with.
                (Place::Node(level), Some(estimates)) => *self.node_mut(level) = estimates.clone(),
                _ => self.open = other.open.clone(),
            }
        }
    }

    /// A pixel's values in a piece, as stored: sums over an incomplete chunk, or an estimate.
    pub fn stored(&self, pixel: usize, place: Place) -> [f64; QUANTITIES] {
        match (self.estimates_at(place), &self.open) {
            (Some(estimates), _) => estimates.get(pixel).map(f64::from),
            (None, Some(open)) => open.get(pixel),
            (None, None) => [0.0; QUANTITIES],
        }
    }

    /// Puts back what [`Self::stored`] returned.
    pub fn restore(&mut self, pixel: usize, place: Place, values: [f64; QUANTITIES]) {
        let single = || values.map(cast::single);
        match place {
            Place::Edge(child) => self.edge_mut(child).set(pixel, single()),
            Place::Node(level) => self.node_mut(level).set(pixel, single()),
            Place::Open => self.open.get_or_insert_with(|| Columns::new(self.pixels)).set(pixel, values),
        }
    }
}

/// Merges a mean with the next part's, which represents `share` of the samples; the first part is exact.
#[inline(always)]
fn merge(mean: &mut f32, part: f32, share: f64) {
    *mean = if share == 1.0 { part } else { merged_mean(*mean, part, share) };
}
