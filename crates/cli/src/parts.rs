//! Pictures that carry their samples: parts of a render, and renders that can go on.

use crate::Failure;
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::path::Path;
use tyndall::film::{Film, FilmState};
use tyndall::message::path_name;
use tyndall::simd::Level;
use tyndall_formats::image::{ImageError, Metadata, PictureState, read_metadata, read_state};
use tyndall_live::document::{Document, value_from_json};
use tyndall_live::{KeyDifference, LiveSession, first_difference};

/// A share of a render's samples: the `number`-th of `count`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    /// Which part.
    pub number: u32,
    /// Number of parts.
    pub count: u32,
}

impl Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

/// The numbers of a part's first sample and of the one after its last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleRange {
    pub first: u32,
    pub end: u32,
}

impl Share {
    /// Its samples out of all; parts begin with chunks, so that they merge exactly into the whole. `None` if there are more
    /// parts than chunks.
    pub fn of_samples(self, samples: u32) -> Option<SampleRange> {
        let chunks = samples.div_ceil(Film::CHUNK);
        // The rounded products fit, since no part has more chunks than there are.
        let border = |part: u32| {
            let chunk = u64::from(chunks) * u64::from(part) / u64::from(self.count);
            u32::try_from(chunk * u64::from(Film::CHUNK)).unwrap_or(u32::MAX).min(samples)
        };
        (self.count <= chunks)
            .then(|| SampleRange { first: border(self.number - 1), end: border(self.number) })
    }
}

/// What a picture with its samples says about them, besides seed and version.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateInfo {
    /// The hash of the scene.
    pub scene: String,
    /// The vector instructions, with which bits differ.
    pub simd: String,
    /// Number of the first sample.
    pub first: u32,
    /// Which part it is, and of how many; `None` for a whole render.
    pub part: Option<Share>,
    /// Number of samples that the scene asks for, of all parts together.
    pub samples: u32,
}

/// Key of the [`StateInfo`] in a picture's metadata, as JSON.
const STATE: &str = "tyndall:state";

impl StateInfo {
    /// Of the samples that a session takes.
    pub fn new(live: &LiveSession, level: Level, part: Option<Share>) -> Self {
        Self {
            scene: live.identity().hash(),
            simd: level.name().to_owned(),
            first: live.film().first(),
            part,
            samples: live.document().render.samples(),
        }
    }

    /// Writes it into a picture's metadata.
    pub fn describe(&self, metadata: &mut Metadata) {
        metadata.insert(STATE, serde_json::json!(self).to_string());
    }
}

/// A picture with its samples, of which only the metadata have been read.
#[derive(Debug)]
pub struct StoredRender<'a> {
    pub path: &'a Path,
    pub info: StateInfo,
    pub seed: String,
    pub version: String,
    pub document: Document,
}

impl<'a> StoredRender<'a> {
    /// Reads the metadata of a picture.
    pub fn open(path: &'a Path) -> Result<Self, Failure> {
        let metadata = match read_metadata(path) {
            Ok(metadata) => metadata.unwrap_or_default(),
            Err(ImageError::NotAPicture { .. }) => return Err(no_samples(path)),
            Err(error) => return Err(Failure::input(error)),
        };
        let get = |key: &str| metadata.get(key).map(str::to_owned).ok_or_else(|| no_samples(path));
        let text = get(STATE)?;
        let info: StateInfo = serde_json::from_str(&text).map_err(|error| malformed(path, &error))?;
        let is_one =
            |part: Share| (1..=part.count).contains(&part.number) && part.of_samples(info.samples).is_some();
        if !info.part.is_none_or(is_one) {
            return Err(malformed(
                path,
                &format!(
                    "found part {} of {} samples, which cannot be",
                    info.part.unwrap_or(Share { number: 1, count: 1 }),
                    info.samples
                ),
            ));
        }
        let document = value_from_json(&get(Metadata::SCENE)?).and_then(Document::from_value);
        let document = document.map_err(|error| malformed(path, &error))?;
        Ok(Self { path, info, seed: get(Metadata::SEED)?, version: get(Metadata::VERSION)?, document })
    }

    /// Reads the samples.
    pub fn film(&self) -> Result<Film, Failure> {
        let PictureState { size, layers } = read_state(self.path).map_err(Failure::input)?;
        let state = FilmState { size, first: self.info.first, layers };
        let film = Film::from_state(&state).map_err(|error| malformed(self.path, &error))?;
        if film.size() == self.document.film.size {
            Ok(film)
        } else {
            Err(malformed(self.path, &"the picture's size is not that of its scene"))
        }
    }

    /// Refuses to mix its samples with those of `other`.
    pub fn check_mix(&self, other: &Self) -> Result<(), Failure> {
        let here = path_name(self.path);
        self.check(
            &format!("{} has", path_name(other.path)),
            &other.info,
            &other.seed,
            &other.version,
            &other.document,
        )
        .map_err(|problem| Failure::input(format!("{here}: {problem}")))
    }

    /// Refuses to continue its samples in a session.
    pub fn check_session(&self, info: &StateInfo, document: &Document) -> Result<(), Failure> {
        let (seed, version) = (document.render.seed.to_string(), env!("CARGO_PKG_VERSION"));
        self.check("this run has", info, &seed, version, document)
            .map_err(|problem| Failure::input(format!("{}: {problem}", path_name(self.path))))
    }

    fn check(
        &self,
        other: &str,
        info: &StateInfo,
        seed: &str,
        version: &str,
        document: &Document,
    ) -> Result<(), String> {
        if self.version != version {
            let found = format!(
                "its samples are from version {} of Tyndall, but {other} version {version}",
                self.version
            );
            return Err(format!("{found}; expected the same version; render one of them again"));
        }
        if self.seed != seed {
            let found = format!("its samples have seed {}, but {other} seed {seed}", self.seed);
            return Err(format!("{found}; expected the same seed"));
        }
        if self.info.simd != info.simd {
            let found = format!(
                "its samples were taken with {} instructions, but {other} {}",
                self.info.simd, info.simd
            );
            return Err(format!(
                "{found}, which give other bits; set TYNDALL_SIMD to the same value for all runs"
            ));
        }
        if self.info.scene != info.scene {
            let found = match first_difference(&self.document, document) {
                Some(KeyDifference { path, values: [here, there] }) => {
                    format!("in its scene `{path}` is {here}, but {other} {there}")
                }
                None => format!("its scene has other voxels or maps than {other}"),
            };
            return Err(format!("{found}; expected the same scene"));
        }
        Ok(())
    }
}

fn no_samples(path: &Path) -> Failure {
    Failure::input(format!(
        "{}: found no stored samples; expected an OpenEXR file written with --part (for `merge`) or --resumable (for --resume)",
        path_name(path)
    ))
}

fn malformed(path: &Path, reason: &dyn Display) -> Failure {
    Failure::input(format!("{}: its samples cannot be read: {reason}; render it again", path_name(path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_whole_chunks_that_cover_all_samples() {
        for samples in [1_u32, 16, 17, 64, 100, 1000, 1 << 31] {
            let chunks = samples.div_ceil(Film::CHUNK);
            for count in [1, 2, 3, 4, 7, 62, 63].into_iter().filter(|&count| count <= chunks) {
                let mut next = 0;
                for number in 1..=count {
                    let SampleRange { first, end } = Share { number, count }.of_samples(samples).unwrap();
                    assert!(first == next && end > first, "{number}/{count} of {samples}");
                    assert!(first.is_multiple_of(Film::CHUNK));
                    next = end;
                }
                assert_eq!(next, samples);
            }
            assert_eq!(Share { number: 1, count: chunks + 1 }.of_samples(samples), None);
        }
    }
}
