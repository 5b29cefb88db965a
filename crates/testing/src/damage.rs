//! Damage to files for fuzz tests: a few random edits that leave most of a valid file as it was.
//!
//! Random bytes are rejected at the start of a file. An edited valid file gets further, and the edits here are
//! those that expose bugs in readers: a number replaced, a piece removed, repeated or moved, a truncated file.

use bolero::TypeGenerator;

/// One edit; positions are taken modulo the file's length, so that every edit applies to every file.
#[derive(Clone, Debug, TypeGenerator)]
pub enum Edit {
    /// A byte is replaced.
    Byte {
        /// Where.
        at: u32,
        /// The new byte.
        value: u8,
    },
    /// A byte near the beginning, where headers are, is replaced.
    HeadByte {
        /// Where, within the first 512 bytes.
        at: u32,
        /// The new byte.
        value: u8,
    },
    /// One bit is flipped.
    Bit {
        /// Where, counted in bits.
        at: u32,
    },
    /// The file is truncated.
    Cut {
        /// Where.
        at: u32,
    },
    /// A piece is removed.
    Remove {
        /// Where.
        at: u32,
        /// Length in bytes.
        length: u8,
    },
    /// Copies of a piece are inserted after it.
    Repeat {
        /// Where.
        at: u32,
        /// Length in bytes.
        length: u8,
        /// Number of copies.
        times: u8,
    },
    /// A piece overwrites another part of the file.
    Copy {
        /// Where the piece is.
        from: u32,
        /// Where it is written.
        to: u32,
        /// Length in bytes.
        length: u8,
    },
    /// A binary number of 1, 2, 4 or 8 bytes is written within the first 1024 bytes.
    Binary {
        /// Where.
        at: u32,
        /// Which number.
        number: u8,
        /// Its width and byte order.
        width: u8,
    },
    /// A decimal number is replaced.
    Digits {
        /// Which one, counted from the beginning.
        which: u32,
        /// Index of the replacement in [`NUMBERS`].
        number: u8,
    },
    /// A piece of text that means something to the reader is inserted.
    Word {
        /// Where.
        at: u32,
        /// Which word.
        word: u32,
    },
}

/// Numbers, as text, that are likely to expose bugs in readers.
pub const NUMBERS: [&str; 32] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "255",
    "256",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "-9223372036854775808",
    "0.5",
    "1e-30",
    "1e-45",
    "5e-324",
    "1e15",
    "1e18",
    "3.4e38",
    "1e39",
    "1e308",
    "1e999",
    "nan",
    "-inf",
];

impl Edit {
    /// Applies the edit; `words` are what [`Edit::Word`] inserts.
    pub fn apply(&self, bytes: &mut Vec<u8>, words: &[&str]) {
        /// A longer file finds no more bugs; it only takes longer to read.
        const LONGEST: usize = 1 << 20;

        let length = bytes.len();
        if length == 0 || length > LONGEST {
            return;
        }
        let place = |at: u32| at as usize % length;
        match *self {
            Self::Byte { at, value } => bytes[place(at)] = value,
            Self::HeadByte { at, value } => bytes[at as usize % length.min(512)] = value,
            Self::Bit { at } => bytes[place(at / 8)] ^= 1 << (at % 8),
            Self::Cut { at } => bytes.truncate(place(at)),
            Self::Remove { at, length: piece } => {
                let start = place(at);
                bytes.drain(start..length.min(start + usize::from(piece)));
            }
            Self::Repeat { at, length: piece, times } => {
                let start = place(at);
                let end = length.min(start + usize::from(piece));
                let again = bytes[start..end].repeat(usize::from(times));
                bytes.splice(end..end, again);
            }
            Self::Copy { from, to, length: piece } => {
                let (from, to) = (place(from), place(to));
                let piece = usize::from(piece).min(length - from).min(length - to);
                bytes.copy_within(from..from + piece, to);
            }
            Self::Binary { at, number, width } => {
                let number = binary(number, width);
                let start = at as usize % length.min(1024);
                for (old, new) in bytes[start..].iter_mut().zip(number) {
                    *old = new;
                }
            }
            Self::Digits { which, number } => replace_digits(bytes, which as usize, number),
            Self::Word { at, word } => {
                if !words.is_empty() {
                    let word = words[word as usize % words.len()].bytes();
                    bytes.splice(place(at)..place(at), word);
                }
            }
        }
    }
}

/// A number at the limit of a type, in 1 to 8 bytes of either byte order.
fn binary(number: u8, width: u8) -> Vec<u8> {
    let edges = [0, 1, -1, i64::from(i16::MAX), i64::from(i32::MAX), i64::MAX, i64::MIN, 1 << 40, 1 << 20, 3];
    let floats = [f64::NAN, f64::INFINITY, -1.0, 1e308, 5e-324, 1e30];
    let which = usize::from(number) % (edges.len() + 2 * floats.len());
    let bytes = if which < edges.len() {
        edges[which].to_le_bytes()[..[1, 2, 4, 8][usize::from(width) / 2 % 4]].to_vec()
    } else if which < edges.len() + floats.len() {
        floats[which - edges.len()].to_le_bytes().to_vec()
    } else {
        let wide = floats[which - edges.len() - floats.len()];
        // Out of range becomes infinite, which is one more number to test.
        #[expect(clippy::cast_possible_truncation, reason = "any number will do")]
        let single = wide as f32;
        single.to_le_bytes().to_vec()
    };
    if width.is_multiple_of(2) { bytes } else { bytes.into_iter().rev().collect() }
}

fn replace_digits(bytes: &mut Vec<u8>, which: usize, number: u8) {
    let is_digit = |i: usize| bytes[i].is_ascii_digit();
    let starts: Vec<_> = (0..bytes.len()).filter(|&i| is_digit(i) && (i == 0 || !is_digit(i - 1))).collect();
    if starts.is_empty() {
        return;
    }
    let start = starts[which % starts.len()];
    let end = (start..bytes.len()).find(|&i| !is_digit(i)).unwrap_or(bytes.len());
    bytes.splice(start..end, NUMBERS[usize::from(number) % NUMBERS.len()].bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_edit_applies_to_every_file() {
        bolero::check!().with_type::<(Vec<u8>, Vec<Edit>)>().for_each(|(bytes, edits)| {
            let mut bytes = bytes.clone();
            for edit in edits {
                edit.apply(&mut bytes, &["word", ""]);
            }
        });
    }

    #[test]
    fn a_decimal_number_is_replaced() {
        let mut bytes = b"sizes: 12 34 5".to_vec();
        Edit::Digits { which: 1, number: 13 }.apply(&mut bytes, &[]);
        assert_eq!(bytes, b"sizes: 12 4294967296 5");
    }
}
