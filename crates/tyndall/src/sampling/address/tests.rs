//! No two purposes share random numbers.

use super::*;
use crate::math::cast;
use crate::sampling::{LightPathSampler, PathSampler};
use std::collections::BTreeSet;

/// All words that a row of the table may have.
struct Row {
    name: &'static str,
    words: Vec<RangeInclusive<u32>>,
}

impl Row {
    fn meets(&self, other: &Self) -> bool {
        self.words.iter().zip(&other.words).all(|(a, b)| a.start().max(b.start()) <= a.end().min(b.end()))
    }

    fn holds(&self, words: &[u32]) -> bool {
        self.words.iter().zip(words).all(|(range, word)| range.contains(word))
    }
}

fn words(Address { pass, counter: [a, b, c, d], .. }: Address) -> [u32; 5] {
    [pass, a, b, c, d]
}

fn purposes() -> Vec<Row> {
    let [least, most] = [Purpose::each(|range| *range.start()), Purpose::each(|range| *range.end())];
    let row = |(least, most): (Purpose, Purpose)| {
        let ends = words(least.address()).into_iter().zip(words(most.address()));
        let mut words: Vec<_> = ends.map(|(least, most)| least..=most).collect();
        if least.address().is_stream {
            words[1] = ANY;
        }
        Row { name: least.name(), words }
    };
    least.into_iter().zip(most).map(row).collect()
}

fn emitters() -> Vec<Row> {
    let [least, most] = [Emitter::each(|range| *range.start()), Emitter::each(|range| *range.end())];
    let row = |(least, most): (Emitter, Emitter)| Row {
        name: least.name(),
        words: vec![least.number()..=most.number()],
    };
    least.into_iter().zip(most).map(row).collect()
}

/// The names of every two rows that share words.
fn overlaps(rows: &[Row]) -> BTreeSet<[&'static str; 2]> {
    let pairs = rows.iter().enumerate().flat_map(|(i, a)| rows[i + 1..].iter().map(move |b| [a, b]));
    pairs.filter(|[a, b]| a.meets(b)).map(|pair| pair.map(|row| row.name)).collect()
}

#[test]
fn no_two_purposes_and_no_two_emitters_share_random_numbers() {
    assert_eq!(overlaps(&purposes()), BTreeSet::new());
    assert_eq!(overlaps(&emitters()), BTreeSet::new());
}

#[test]
fn rows_meet_if_all_their_words_do() {
    let row = |name, words: [RangeInclusive<u32>; 2]| Row { name, words: words.to_vec() };
    let rows = [row("a", [0..=5, 2..=2]), row("b", [5..=9, 2..=3]), row("c", [0..=9, 3..=3])];
    assert_eq!(overlaps(&rows), BTreeSet::from([["a", "b"], ["b", "c"]]));
}

/// The words of drawn numbers are within the ranges by which overlaps are found.
#[test]
fn words_are_those_of_the_row() {
    let mut numbers = Stream::new(1, [0; 3]);
    let mut pick = |range: RangeInclusive<u32>| {
        let span = u64::from(range.end() - range.start()) + 1;
        range.start() + cast::low_u32(u64::from(numbers.bits()) % span)
    };
    let (purposes, emitters) = (purposes(), emitters());
    for _ in 0..1000 {
        for (emitter, row) in Emitter::each(&mut pick).into_iter().zip(&emitters) {
            assert!(row.holds(&[emitter.number()]), "{emitter:?}");
        }
        for (purpose, row) in Purpose::each(&mut pick).into_iter().zip(&purposes) {
            let place = purpose.address();
            assert!(row.holds(&words(place)), "{purpose:?}");
            if place.is_stream {
                let mut stream = purpose.stream(9);
                (0..9).for_each(|_| _ = stream.bits());
                let [_, b, c, d] = place.counter;
                assert_eq!((stream.key, stream.counter), (key(9, place.pass), [3, b, c, d]), "{purpose:?}");
            } else {
                assert_eq!(purpose.bits(9), philox(place.counter, key(9, place.pass))[0], "{purpose:?}");
            }
        }
    }
}

#[test]
fn paths_draw_from_their_own_rows() {
    let rows = purposes();
    let row = |name: &str| rows.iter().find(|row| row.name == name).expect("in the table");
    let drawn = |mut stream: Stream, pass: u32, name: &str| {
        stream.bits();
        let [a, b, c, d] = stream.counter;
        assert!(row(name).holds(&[pass, a, b, c, d]) && stream.key == key(9, pass), "{name}: {stream:?}");
    };
    drawn(PathSampler::new(9, *PIXELS.end(), u32::MAX).stream, 0, "CameraTracking");
    let light = LightPathSampler::new(9, 7, u32::MAX, *PATHS.end());
    drawn(light.stream(*BOUNCES.end()), 7, "LightTracking");
    drawn(light.matter_emission(), 7, "MatterEmission");
}
