//! Historygrams \[Jonsson12, sec. 4.2\]: which data values a computation has read, as a set of groups of values.
//!
//! An edit of the transfer function is a set of values too; what has read none of them need not be recomputed. Groups
//! consist of whole [`ValueBins`], the bins of the tables of optics, and depend on the data alone, so that no
//! edit changes them.

use super::BinSet;
use crate::math::cast;
use crate::volume::{ValueBins, Volume};
use bytemuck::Zeroable;
use std::ops::{BitAnd, BitOr, BitOrAssign};

/// A set of groups of data values; one bit each, at most 128.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Zeroable)]
pub struct Historygram(u128);

impl Historygram {
    /// Nothing.
    pub const EMPTY: Self = Self(0);

    /// Every possible group.
    pub const ALL: Self = Self(u128::MAX);

    /// Whether it holds no group.
    #[inline]
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether both have a group in common \[Jonsson12, eq. 10\].
    #[inline]
    #[must_use]
    pub fn meets(self, query: Self) -> bool {
        self.0 & query.0 != 0
    }

    /// The bits, group 0 the lowest.
    #[inline]
    #[must_use]
    pub fn bits(self) -> u128 {
        self.0
    }

    /// From bits, group 0 the lowest.
    #[inline]
    #[must_use]
    pub fn from_bits(bits: u128) -> Self {
        Self(bits)
    }
}

/// \[Jonsson12, eq. 9\]
impl BitOr for Historygram {
    type Output = Self;

    #[inline]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Historygram {
    #[inline]
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl BitAnd for Historygram {
    type Output = Self;

    #[inline]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

/// How data values are put into groups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grouping {
    /// Groups with equally many voxels, as far as whole bins allow.
    #[default]
    Quantile,
    /// Groups of equal width, as in \[Jonsson12, eq. 11\], except that the last is as wide as the others.
    Uniform,
}

/// The groups of a volume's values: the mapping `delta` of \[Jonsson12\].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HistoryGroups {
    /// The group of each value bin.
    groups: Vec<u8>,
    count: u8,
    /// What reading a value in each bin records, and last nothing.
    records: Vec<Historygram>,
}

impl HistoryGroups {
    /// `count` groups, 1 to 128, of a volume's value bins.
    ///
    /// # Panics
    /// If `count` is outside 1 to 128.
    #[must_use]
    pub fn new(volume: &Volume, count: u8, grouping: Grouping) -> Self {
        assert!((1..=128).contains(&count), "{count} groups: a Historygram has 1 to 128");
        let groups = match grouping {
            Grouping::Uniform => {
                let share = f32::from(count) / ValueBins::COUNT as f32;
                (0..ValueBins::COUNT).map(|bin| group(bin as f32 * share)).collect()
            }
            Grouping::Quantile => equal_counts(&volume.value_bin_histogram().counts, count),
        };
        let records =
            groups.iter().map(|&group| Historygram(1 << group)).chain([Historygram::EMPTY]).collect();
        Self { groups, count, records }
    }

    /// How many groups there are at most.
    #[must_use]
    pub fn count(&self) -> u8 {
        self.count
    }

    /// The group of each value bin.
    #[must_use]
    pub fn of_bins(&self) -> &[u8] {
        &self.groups
    }

    /// What reading a value in each bin records in a history; one more, for no bin, is empty.
    #[must_use]
    pub fn records(&self) -> &[Historygram] {
        &self.records
    }

    /// What reading a value in a bin records in a history.
    #[inline]
    #[must_use]
    pub fn of(&self, bin: usize) -> Historygram {
        Historygram(1 << self.groups[bin])
    }

    /// What reading values from bin `first` to bin `last` records in a history.
    #[inline]
    #[must_use]
    pub fn between(&self, first: usize, last: usize) -> Historygram {
        // Groups ascend with the bins, so all groups between the ends are included.
        let [first, last] = [first, last].map(|bin| usize::from(self.groups[bin]));
        Historygram(UP_TO[last] & FROM[first])
    }

    /// The Historygram of changed bins, against which histories are tested \[Jonsson12, sec. 4.2\].
    #[must_use]
    pub fn query(&self, changed: &BinSet) -> Historygram {
        changed.iter().fold(Historygram::EMPTY, |query, bin| query | self.of(bin))
    }
}

/// Per group the bits of all groups up to it, and from it on: marches read them at every step.
static UP_TO: [u128; 128] = groups_beside(true);
static FROM: [u128; 128] = groups_beside(false);

const fn groups_beside(below: bool) -> [u128; 128] {
    let mut sets = [0; 128];
    let mut group = 0;
    while group < 128 {
        sets[group] = if below { u128::MAX >> (127 - group) } else { u128::MAX << group };
        group += 1;
    }
    sets
}

fn group(x: f32) -> u8 {
    u8::try_from(cast::index(x)).expect("a group's number")
}

/// Cuts bins into groups of equal counts, given the counts of all bins but the two outer ones. A bin that fills a group
/// by itself is removed from the total, and the rest is divided again. If there are few values, each has its own group.
fn equal_counts(inside: &[u64], count: u8) -> Vec<u8> {
    let values = inside.iter().filter(|&&n| n > 0).count();
    if 2 * values < usize::from(count) {
        return each_value(inside);
    }
    let mut left: u64 = inside.iter().sum();
    let (mut group, mut held) = (0_u8, 0_u64);
    let mut groups = Vec::with_capacity(inside.len() + 2);
    groups.push(0);
    for &n in inside {
        let groups_left = u64::from(count - group);
        let wanted = left.div_ceil(groups_left);
        // A new group where this one is full, or would overshoot by more than it now falls short.
        let full = held > 0 && n > 0 && held + n / 2 >= wanted;
        if full && groups_left > 1 {
            group += 1;
            left -= held;
            held = 0;
        }
        held += n;
        groups.push(group);
    }
    groups.push(group);
    groups
}

/// A group for each bin that is not empty, and for the bins between two of them: materials are often separated halfway
/// between their values, so an edit of one extends that far.
fn each_value(inside: &[u64]) -> Vec<u8> {
    let (mut group, mut held) = (0, 0);
    let mut groups = vec![0];
    for &n in inside {
        group += u8::from(n > 0 || held > 0);
        held = n;
        groups.push(group);
    }
    groups.push(group + u8::from(held > 0));
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Grid, ValueMap, Voxels};

    fn volume(values: Vec<u8>) -> Volume {
        let grid = Grid::centred([values.len(), 1, 1], [1.0; 3]).unwrap();
        Volume::new(grid, Voxels::U8(values), ValueMap::IDENTITY).unwrap()
    }

    fn sizes(groups: &[u8], counts: &[u64]) -> Vec<u64> {
        let mut sizes = vec![0; 256];
        groups[1..].iter().zip(counts).for_each(|(&g, n)| sizes[usize::from(g)] += n);
        sizes
    }

    #[test]
    fn groups_hold_equally_many() {
        let counts: Vec<u64> = (0..1024).map(|i| 10 + i % 7).collect();
        let groups = equal_counts(&counts, 64);
        assert!(groups.is_sorted() && groups.len() == ValueBins::COUNT && groups[1025] == 63);
        for size in &sizes(&groups, &counts)[..64] {
            assert!((150..270).contains(size), "{size}");
        }
    }

    #[test]
    fn a_value_that_most_voxels_have_does_not_ruin_the_others() {
        let mut counts = vec![1; 1024];
        counts[3] = 1_000_000;
        let groups = equal_counts(&counts, 32);
        assert!(groups[1025] >= 30, "{}", groups[1025]);
    }

    #[test]
    fn few_values_and_what_lies_between_them_have_a_group_each() {
        let mut few = vec![0; 1024];
        for bin in [5, 300, 301, 1023] {
            few[bin] = 77;
        }
        let groups = equal_counts(&few, 9);
        let of = [0, 5, 6, 7, 300, 301, 302, 303, 1023, 1024, 1025].map(|bin| groups[bin]);
        assert_eq!(of, [0, 0, 1, 2, 2, 3, 4, 5, 5, 6, 7]);
        assert!(groups.is_sorted());
        // One group fewer than these need: cut as if they were many.
        assert_eq!(equal_counts(&few, 8)[1025], 3);
    }

    #[test]
    fn ranges_and_queries_name_the_groups_that_they_touch() {
        let volume = volume((0..=255).collect());
        for (count, grouping) in
            [(32, Grouping::Uniform), (64, Grouping::Quantile), (128, Grouping::Quantile)]
        {
            let groups = HistoryGroups::new(&volume, count, grouping);
            let used = groups.of_bins().iter().max().copied();
            assert_eq!(used, Some(count - 1), "{grouping:?}");
            let mut changed = BinSet::EMPTY;
            (300..=500).for_each(|bin| changed.insert(bin));
            assert_eq!(groups.query(&changed), groups.between(300, 500));
            for bin in 0..ValueBins::COUNT {
                let one = groups.of(bin);
                assert_eq!(one.bits().count_ones(), 1);
                assert!(!changed.contains(bin) || one.meets(groups.query(&changed)));
            }
            assert!(!groups.between(0, 200).meets(groups.between(900, 1025)));
        }
    }
}
