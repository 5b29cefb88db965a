//! The planes of a lattice in the order in which a sweep passes them.

/// Axes of a sweep through planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axes {
    /// In rows, along the lanes.
    pub u: usize,
    /// From row to row of a plane.
    pub v: usize,
    /// From plane to plane.
    pub w: usize,
}

impl Axes {
    /// By x, y and z, from those along these axes.
    #[inline(always)]
    pub fn coordinates(self, u: usize, v: usize, w: usize) -> [usize; 3] {
        let mut coordinates = [0; 3];
        (coordinates[self.u], coordinates[self.v], coordinates[self.w]) = (u, v, w);
        coordinates
    }
}

/// The planes that a fan passes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    pub axes: Axes,
    /// Whether planes ascend: away from a light at lower coordinates.
    pub ascending: bool,
    /// Texels along the axes u, v and w.
    pub texels: [usize; 3],
}

impl Course {
    /// The `n`-th plane away from the light.
    pub fn plane(&self, n: usize) -> usize {
        if self.ascending { n } else { self.texels[2] - 1 - n }
    }

    /// Distance of the `n`-th plane from a coordinate, in planes; negative before it.
    pub fn beyond(&self, n: usize, w: f32) -> f32 {
        let away = self.plane(n) as f32 - w;
        if self.ascending { away } else { -away }
    }
}
