//! Everything that a scene document refers to: its volume and its environment maps.

use crate::chosen;
use crate::document::{self, Document};
use rayon::ThreadPool;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tyndall::light::{self, Map, MapError};
use tyndall::message::path_name;
use tyndall::volume::procedural::{Field, Kind};
use tyndall::volume::{Bricks, GridError, Interpolation, Volume};
use tyndall_formats::image::{ImageError, read_map};
use tyndall_formats::volume::{Endian, RawLayout, ReadError, SampleType, read, read_raw};

/// The data that a document refers to but does not contain.
#[derive(Clone, Debug)]
pub struct Assets {
    /// The volume, read as the document specifies.
    pub volume: Arc<Volume>,
    /// Environment maps, by path as given in the document.
    pub maps: BTreeMap<String, Arc<Map>>,
    /// The maps of studios, one for each that differs from the others.
    pub studios: Vec<StudioMap>,
}

/// A studio's map.
#[derive(Clone, Debug)]
pub struct StudioMap {
    /// The studio, as in the document.
    pub studio: document::Studio,
    /// Its radiance.
    pub map: Arc<Map>,
}

impl Assets {
    /// Whether both share the same maps of files in memory.
    pub(crate) fn shares_maps(&self, other: &Self) -> bool {
        let same = |(path, map)| other.maps.get(path).is_some_and(|other| Arc::ptr_eq(map, other));
        self.maps.len() == other.maps.len() && self.maps.iter().all(same)
    }

    /// The map of a studio.
    #[must_use]
    pub fn studio(&self, studio: &document::Studio) -> Option<&Arc<Map>> {
        self.studios.iter().find(|known| known.studio == *studio).map(|known| &known.map)
    }
}

/// What a volume's source contained besides the volume.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Source {
    /// Components per voxel in the file.
    pub channels: usize,
    /// Time steps in the file.
    pub times: usize,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Why an asset could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AssetError {
    /// The volume's file cannot be read.
    #[error(transparent)]
    Volume(#[from] ReadError),
    /// The procedural field cannot be generated.
    #[error("`volume.procedural.size`: {0}")]
    Field(#[from] GridError),
    /// The procedural field would take more memory than is free.
    #[error("`volume.procedural.size`: {dims:?} voxels need {} MiB, but {} MiB are free; expected a smaller field", .needed >> 20, .available >> 20)]
    Memory {
        /// Voxels along each axis.
        dims: [usize; 3],
        /// Bytes needed.
        needed: u64,
        /// Bytes free.
        available: u64,
    },
    /// An environment map's file cannot be read.
    #[error("`lights.{light}.map`: {source}")]
    MapFile {
        /// Index of the light.
        light: usize,
        /// Why.
        source: ImageError,
    },
    /// An environment map's content is invalid.
    #[error("`lights.{light}.map`: {}: {source}", path_name(.path))]
    Map {
        /// Index of the light.
        light: usize,
        /// The file.
        path: PathBuf,
        /// Why.
        source: MapError,
    },
    /// A studio's lamps are together too bright.
    #[error("`lights.{light}.studio`: {source}")]
    Studio {
        /// Index of the light.
        light: usize,
        /// Why.
        source: MapError,
    },
}

/// Loads what a document refers to, in parallel on the current thread pool, and states in the document what it leaves open and the
/// volume decides. Its paths are relative to `folder`.
///
/// # Errors
/// [`AssetError`] names the file or key.
pub fn load(document: &mut Document, folder: &Path) -> Result<(Assets, Source), AssetError> {
    let (volume, source) = volume(&document.volume, folder)?;
    chosen::state(document, &volume);
    let volume = Arc::new(volume.with_interpolation(interpolation(document)));
    let maps = maps(document, folder, &BTreeMap::new())?;
    let studios = studios(document, &[])?;
    Ok((Assets { volume, maps, studios }, source))
}

/// As [`load`], for an edited document, in parallel on a thread pool: only what the document before the edit did not refer to is read;
/// the rest is shared with that document's assets.
///
/// # Errors
/// [`AssetError`] names the file or key.
pub fn reload(
    document: &mut Document,
    folder: &Path,
    before: (&Document, &Assets),
    threads: &ThreadPool,
) -> Result<Assets, AssetError> {
    let (old, assets) = before;
    let same = document::Volume { interpolation: old.volume.interpolation, ..document.volume.clone() };
    let read = if same == old.volume {
        chosen::state(document, &assets.volume);
        None
    } else {
        let (volume, _) = threads.install(|| volume(&document.volume, folder))?;
        threads.install(|| chosen::state(document, &volume));
        Some(volume)
    };
    let interpolation = interpolation(document);
    let volume = if let Some(volume) = read {
        Arc::new(volume.with_interpolation(interpolation))
    } else if assets.volume.interpolation() == interpolation {
        assets.volume.clone()
    } else {
        Arc::new((*assets.volume).clone().with_interpolation(interpolation))
    };
    let known = |light: &document::Light| match light {
        document::Light::Environment { map: Some(name), .. } => assets.maps.contains_key(name),
        _ => true,
    };
    let maps = || maps(document, folder, &assets.maps);
    let all_known = document.lights.iter().flatten().all(known);
    // With nothing to read, handing over to other threads would take longer than the edit.
    let maps = if all_known { maps() } else { threads.install(maps) }?;
    Ok(Assets { volume, maps, studios: studios(document, &assets.studios)? })
}

fn interpolation(document: &Document) -> Interpolation {
    match document.volume.interpolation {
        Some(document::Interpolation::Nearest) => Interpolation::Nearest,
        Some(document::Interpolation::Linear) | None => Interpolation::Linear,
    }
}

/// The environment maps of a document, by path as given there; those in `known` are not read again.
fn maps(
    document: &Document,
    folder: &Path,
    known: &BTreeMap<String, Arc<Map>>,
) -> Result<BTreeMap<String, Arc<Map>>, AssetError> {
    let mut maps = BTreeMap::new();
    for (light, l) in document.lights.iter().flatten().enumerate() {
        let document::Light::Environment { map: Some(name), .. } = l else { continue };
        if let Some(map) = known.get(name) {
            maps.insert(name.clone(), map.clone());
        }
        if !maps.contains_key(name) {
            let path = folder.join(name);
            let picture = read_map(&path).map_err(|source| AssetError::MapFile { light, source })?;
            let map = Map::new(picture.width, picture.height, picture.pixels)
                .map_err(|source| AssetError::Map { light, path, source })?;
            maps.insert(name.clone(), Arc::new(map));
        }
    }
    Ok(maps)
}

/// The maps of a document's studios; those in `known` are not computed again.
///
/// # Errors
/// [`AssetError::Studio`] if lamps together are too bright.
pub fn studios(document: &Document, known: &[StudioMap]) -> Result<Vec<StudioMap>, AssetError> {
    let mut studios: Vec<StudioMap> = Vec::new();
    for (light, l) in document.lights.iter().flatten().enumerate() {
        let document::Light::Environment { studio: Some(studio), .. } = l else { continue };
        if studios.iter().any(|other| other.studio == *studio) {
            continue;
        }
        studios.push(match known.iter().find(|known| known.studio == *studio) {
            Some(known) => known.clone(),
            None => {
                let map = studio_of(studio).map().map_err(|source| AssetError::Studio { light, source })?;
                StudioMap { studio: studio.clone(), map: Arc::new(map) }
            }
        });
    }
    Ok(studios)
}

fn studio_of(studio: &document::Studio) -> light::Studio {
    let softbox = |lamp: &document::Softbox| {
        let document::Softbox { azimuth, elevation, size, softness, radiance } = *lamp;
        light::Softbox { azimuth, elevation, size, softness, radiance: radiance.into() }
    };
    light::Studio {
        zenith: studio.zenith.into(),
        horizon: studio.horizon.into(),
        ground: studio.ground.into(),
        softboxes: studio.softboxes.iter().map(softbox).collect(),
    }
}

fn volume(described: &document::Volume, folder: &Path) -> Result<(Volume, Source), AssetError> {
    if let Some(procedural) = &described.procedural {
        return field(procedural);
    }
    // The document's check requires one of the two.
    let path = folder.join(described.path.as_deref().unwrap_or_default());
    let loaded = match &described.raw {
        Some(raw) => read_raw(&path, &layout(raw)),
        None => read(&path),
    }?;
    let notes = loaded.notes.into_iter().chain(of_values(&loaded.volume)).collect();
    let source = Source { channels: loaded.channels, times: loaded.times, notes };
    Ok((loaded.volume, source))
}

/// What the user should know of a file's values, a sentence each.
fn of_values(volume: &Volume) -> Vec<String> {
    if volume.is_empty() {
        return vec!["every sample is NaN, which is no data: there is nothing to see".to_owned()];
    }
    let mut notes = Vec::new();
    if volume.no_data() > 0 {
        let count = volume.no_data();
        notes.push(format!(
            "{count} samples are NaN, which is no data: they are invisible, as is the space up to their neighbours"
        ));
    }
    if volume.exceeds_single() {
        let [lo, hi] = volume.value_range();
        let what = "they lose precision, and values that are equal in single precision count as one";
        notes.push(format!("the data are from {lo} to {hi}: {what}"));
    }
    if let Some(value) = volume.only_value() {
        let shown = if Volume::is_background(value) {
            "which presets take as background and show as nothing"
        } else {
            "which presets show as one solid block"
        };
        notes.push(format!("every sample is {value}, {shown}"));
    }
    notes
}

fn field(described: &document::Procedural) -> Result<(Volume, Source), AssetError> {
    let kind = match described.kind {
        document::FieldKind::Constant => Kind::Constant,
        document::FieldKind::Sphere => Kind::Sphere,
        document::FieldKind::Shells => Kind::Shells,
        document::FieldKind::MarschnerLobb => Kind::MarschnerLobb,
        document::FieldKind::Cloud => Kind::Cloud,
        document::FieldKind::CornellBox => Kind::CornellBox,
    };
    let dims = described.size.map(|n| n as usize);
    let linear = dims.iter().fold(4_u64, |bytes, &n| bytes.saturating_mul(n as u64));
    let needed = linear.saturating_add(Bricks::bytes(dims, 4).unwrap_or(u64::MAX));
    if let Some(available) = tyndall_formats::memory::available().filter(|&available| needed > available) {
        return Err(AssetError::Memory { dims, needed, available });
    }
    let volume = Field::new(kind, dims, described.seed).volume()?;
    Ok((volume, Source { channels: 1, times: 1, notes: Vec::new() }))
}

fn layout(raw: &document::Raw) -> RawLayout {
    RawLayout {
        dims: raw.dims.map(|n| n as usize),
        dtype: match raw.dtype {
            document::DataType::U8 => SampleType::U8,
            document::DataType::I8 => SampleType::I8,
            document::DataType::U16 => SampleType::U16,
            document::DataType::I16 => SampleType::I16,
            document::DataType::U32 => SampleType::U32,
            document::DataType::I32 => SampleType::I32,
            document::DataType::F32 => SampleType::F32,
            document::DataType::F64 => SampleType::F64,
        },
        endian: match raw.endian {
            document::Endian::Little => Endian::Little,
            document::Endian::Big => Endian::Big,
        },
        offset: raw.offset,
        spacing: raw.spacing,
        origin: raw.origin,
    }
}
