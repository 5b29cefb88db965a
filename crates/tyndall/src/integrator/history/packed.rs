//! Historygrams packed into as many bytes as their groups need.

use crate::math::cast;
use crate::transfer::Historygram;

/// An array of Historygrams of 4, 8 or 16 bytes each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PackedHistories {
    /// Words of 32 bits, the lowest of each Historygram first.
    words: Vec<u32>,
    width: usize,
}

impl PackedHistories {
    /// An empty array for Historygrams of this many groups.
    pub fn new(groups: u8) -> Self {
        Self { words: Vec::new(), width: usize::from(groups).div_ceil(32) }
    }

    /// Changes their number; further ones are empty.
    pub fn resize(&mut self, count: usize) {
        self.words.resize(self.width * count, 0);
    }

    #[inline]
    pub fn push(&mut self, history: Historygram) {
        let bits = history.bits();
        self.words.extend((0..self.width).map(|word| part(bits, word)));
    }

    /// Reserves space for `more` Historygrams.
    pub fn reserve(&mut self, more: usize) {
        self.words.reserve_exact(self.width * more);
    }

    #[inline]
    pub fn set(&mut self, i: usize, history: Historygram) {
        let bits = history.bits();
        let words = &mut self.words[i * self.width..(i + 1) * self.width];
        words.iter_mut().enumerate().for_each(|(word, position)| *position = part(bits, word));
    }

    #[inline]
    pub fn get(&self, i: usize) -> Historygram {
        let words = &self.words[i * self.width..(i + 1) * self.width];
        Historygram::from_bits(words.iter().rev().fold(0, |bits, &word| bits << 32 | u128::from(word)))
    }

    /// Appends a range of another array.
    pub fn extend(&mut self, other: &Self, range: std::ops::Range<usize>) {
        self.words.extend_from_slice(&other.words[range.start * self.width..range.end * self.width]);
    }

    /// Releases memory that is not needed.
    pub fn shrink_to_fit(&mut self) {
        self.words.shrink_to_fit();
    }

    pub fn bytes(&self) -> usize {
        4 * self.words.len()
    }
}

fn part(bits: u128, word: usize) -> u32 {
    cast::low_u32(u64::try_from(bits >> (32 * word) & u128::from(u32::MAX)).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_in_comes_out() {
        for groups in [32, 64, 128] {
            let some = |i: u32| Historygram::from_bits(1 << (i % u32::from(groups)) | 1 << (i * 7 % 32));
            let mut histories = PackedHistories::new(groups);
            (0..200).for_each(|i| histories.push(some(i)));
            assert_eq!(histories.bytes(), 200 * usize::from(groups) / 8);
            let mut others = PackedHistories::new(groups);
            others.resize(3);
            others.extend(&histories, 50..150);
            others.set(1, some(5));
            assert!((0..200).all(|i| histories.get(i as usize) == some(i)));
            assert!((0..100).all(|i| others.get(3 + i as usize) == some(50 + i)));
            assert_eq!((others.get(0), others.get(1)), (Historygram::EMPTY, some(5)));
        }
    }
}
