//! Tables with a row for each pixel of a tile.

use super::estimate::QUANTITIES;

/// A table with a row for each pixel and a column for each quantity. It is stored by columns, so that vector instructions can
/// work on many pixels at once.
#[derive(Clone, Debug)]
pub(super) struct Columns<T> {
    rows: usize,
    values: Vec<T>,
}

impl<T: Copy + Default> Columns<T> {
    pub fn new(rows: usize) -> Self {
        Self { rows, values: vec![T::default(); rows * QUANTITIES] }
    }

    pub fn get(&self, row: usize) -> [T; QUANTITIES] {
        std::array::from_fn(|quantity| self.values[quantity * self.rows + row])
    }

    pub fn set(&mut self, row: usize, values: [T; QUANTITIES]) {
        for (quantity, value) in values.into_iter().enumerate() {
            self.values[quantity * self.rows + row] = value;
        }
    }

    /// The values of a quantity for all pixels.
    pub fn column(&self, quantity: usize) -> &[T] {
        &self.values[quantity * self.rows..(quantity + 1) * self.rows]
    }
}
