//! Pictures, written as PNG, JPEG, TIFF and OpenEXR; environment maps, read from OpenEXR and Radiance.
//!
//! The 8-bit kinds hold the picture after a tone curve. OpenEXR keeps the full data: linear float,
//! premultiplied, with the variance of each pixel's mean and the depth as further layers.
//! Every written picture carries its [`Metadata`], so that it can be rendered again.
//!
//! ```
//! use tyndall::film::Tone;
//! use tyndall_formats::image::{Metadata, Picture, read_metadata, write};
//!
//! let path = std::env::temp_dir().join("tyndall-doc.exr");
//! let picture = Picture { width: 1, height: 1, rgba: vec![[0.2, 0.3, 0.4, 1.0]], ..Picture::default() };
//! let mut metadata = Metadata::default();
//! metadata.insert(Metadata::SEED, "7");
//! write(&path, &picture, &Tone::default(), &metadata)?;
//! assert_eq!(read_metadata(&path)?, Some(metadata));
//! # std::fs::remove_file(&path).ok();
//! # Ok::<(), tyndall_formats::image::ImageError>(())
//! ```

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use crate::atomic;
use tyndall::film::{Backdrop, StateLayer, Tone};

mod animation;
mod display;
mod error;
mod exr;
mod jpeg;
mod map;
mod memory;
mod metadata;
mod png;
mod radiance;
mod texels;
mod tiff;

pub use animation::{Animation, AnimationHeader};
pub use error::ImageError;
pub use map::read_map;
pub use memory::bytes_to_write;
pub use metadata::Metadata;
pub use texels::Map;
use texels::MapFailure;

/// Extensions of the kinds that are written, for messages.
const EXTENSIONS: &str = ".png, .jpg, .jpeg, .tif, .tiff or .exr";

/// A finished picture: rows from the top, each from the left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear radiance in Rec. 709 primaries, premultiplied by opacity, and the opacity in [0, 1].
    pub rgba: Vec<[f32; 4]>,
    /// Variance of each pixel's mean, where it is known.
    pub variance: Option<Vec<[f32; 3]>>,
    /// Distance from the camera to the first matter, in world units.
    pub depth: Option<Vec<f32>>,
    /// The samples themselves, from which a later run can go on; only OpenEXR can hold them.
    pub state: Vec<StateLayer>,
    /// Whether the background shows through where the opacity is below 1.
    pub transparent: bool,
}

impl Picture {
    fn check(&self) {
        let pixels = self.width as usize * self.height as usize;
        assert!(pixels > 0, "a picture of {} x {} pixels", self.width, self.height);
        assert_eq!(self.rgba.len(), pixels, "pixels of the picture");
        assert_eq!(self.variance.as_ref().map_or(pixels, Vec::len), pixels, "pixels of the variance");
        assert_eq!(self.depth.as_ref().map_or(pixels, Vec::len), pixels, "pixels of the depth");
        for layer in &self.state {
            assert_eq!(layer.values.len(), pixels, "pixels of the state layer `{}`", layer.name);
        }
    }
}

/// Writes a picture in the kind given by the path's extension, in any case. The 8-bit kinds are shown as `tone` says, which OpenEXR
/// ignores.
///
/// The file appears whole or not at all: it is written beside its destination and then moved there.
/// JPEG has no opacity, so a transparent picture is written over white, see [`keeps_transparency`].
///
/// # Errors
/// [`ImageError::Extension`] for an unknown kind, [`ImageError::TooLarge`] where the kind has a limit,
/// [`ImageError::Unwritable`] if the file cannot be written.
///
/// # Panics
/// If the picture is empty or its layers differ in size.
pub fn write(path: &Path, picture: &Picture, tone: &Tone, metadata: &Metadata) -> Result<(), ImageError> {
    picture.check();
    let bytes = match Kind::of_extension(path) {
        Some(Kind::Png) => png::encode(picture, tone, metadata),
        Some(Kind::Jpeg) => jpeg::encode(picture, tone, metadata),
        Some(Kind::Tiff) => tiff::encode(picture, tone, metadata),
        Some(Kind::Exr) => exr::encode(picture, metadata),
        None => return Err(ImageError::extension(path, EXTENSIONS)),
    };
    let bytes = bytes.map_err(|failure| failure.at(path))?;
    atomic::replace(path, &bytes).map_err(|source| ImageError::unwritable(path, source))
}

/// The code values of a picture, three bytes a pixel, as a kind without opacity shows it: a transparent picture over white.
#[must_use]
pub fn codes(picture: &Picture, tone: &Tone) -> Vec<u8> {
    picture.check();
    display::rgb8(picture, tone)
}

/// Checks before a long render whether [`write()`] could write a picture there: the kind is known, the folder
/// exists and is writable, and the path is free, or names a writable file, a device or a pipe.
///
/// # Errors
/// As [`write()`].
pub fn check_destination(path: &Path) -> Result<(), ImageError> {
    if Kind::of_extension(path).is_none() {
        return Err(ImageError::extension(path, EXTENSIONS));
    }
    atomic::check(path).map_err(|source| ImageError::unwritable(path, source))
}

/// Whether the kind given by the path's extension can hold transparent pixels: all but JPEG.
#[must_use]
pub fn keeps_transparency(path: &Path) -> bool {
    !matches!(Kind::of_extension(path), Some(Kind::Jpeg))
}

/// The bytes of a PNG file, to be written to a pipe.
///
/// # Errors
/// [`ImageError::TooLarge`] beyond what the kind can hold.
///
/// # Panics
/// If the picture is empty or its layers differ in size.
pub fn encode_png(picture: &Picture, tone: &Tone, metadata: &Metadata) -> Result<Vec<u8>, ImageError> {
    picture.check();
    png::encode(picture, tone, metadata).map_err(|failure| failure.at(Path::new("standard output")))
}

/// Writes code values, rows from the top, as a PNG file without metadata.
///
/// # Errors
/// [`ImageError::TooLarge`] beyond what the kind can hold, [`ImageError::Unwritable`] if the file cannot be written.
///
/// # Panics
/// If there are not as many codes as pixels.
pub fn write_codes(path: &Path, [width, height]: [u32; 2], codes: &[[u8; 3]]) -> Result<(), ImageError> {
    assert_eq!(codes.len(), width as usize * height as usize, "pixels and their codes");
    let bytes = png::encode_codes([width, height], codes).map_err(|failure| failure.at(path))?;
    atomic::replace(path, &bytes).map_err(|source| ImageError::unwritable(path, source))
}

/// The metadata in a picture of any of the four kinds, recognised by content; `None` if it has none of ours.
///
/// Pixels are not read, so that a picture with damaged pixels still yields its scene.
///
/// # Errors
/// [`ImageError::Unreadable`] if the file cannot be read, [`ImageError::NotAPicture`] for another kind of file,
/// [`ImageError::Malformed`] for a damaged one.
pub fn read_metadata(path: &Path) -> Result<Option<Metadata>, ImageError> {
    let (mut file, length) = open(path)?;
    let kind = Kind::of_content(&mut file).map_err(|source| ImageError::unreadable(path, source))?;
    let kind = kind.ok_or_else(|| ImageError::NotAPicture { path: path.to_owned() })?;
    let (name, read) = match kind {
        Kind::Png => ("PNG", png::read_metadata(file)),
        Kind::Jpeg => ("JPEG", jpeg::read_metadata(file)),
        Kind::Tiff => ("TIFF", tiff::read_metadata(file, length)),
        Kind::Exr => ("OpenEXR", exr::read_metadata(file)),
    };
    let metadata = read.map_err(|reason| ImageError::malformed(path, name, reason))?;
    Ok(Some(metadata).filter(|metadata| !metadata.is_empty()))
}

/// The samples in a picture of the kind OpenEXR.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureState {
    /// Width and height.
    pub size: [u32; 2],
    /// [`Picture::state`].
    pub layers: Vec<StateLayer>,
}

/// Reads [`Picture::state`] of an OpenEXR file; there are no layers if it was written without.
///
/// # Errors
/// [`ImageError::Unreadable`] if the file cannot be read, [`ImageError::Malformed`] for a damaged one or another kind,
/// [`ImageError::TooLarge`] if it does not fit the memory.
pub fn read_state(path: &Path) -> Result<PictureState, ImageError> {
    let (file, length) = open(path)?;
    exr::read_state(file, length).map_err(|failure| match failure {
        MapFailure::Malformed(reason) => ImageError::malformed(path, "OpenEXR", reason),
        MapFailure::TooLarge { width, height } => ImageError::TooLarge {
            path: path.to_owned(),
            width,
            height,
            limit: "as many as fit the free memory with all their layers".to_owned(),
            fix: "free some memory, or use a larger machine",
        },
    })
}

/// Opens a regular file; reading a pipe or device could block for ever.
fn open(path: &Path) -> Result<(BufReader<File>, u64), ImageError> {
    let unreadable = |source| ImageError::unreadable(path, source);
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        let kind =
            if about.is_dir() { std::io::ErrorKind::IsADirectory } else { std::io::ErrorKind::InvalidInput };
        return Err(unreadable(std::io::Error::new(kind, "it is not a file")));
    }
    let file = File::open(path).map_err(unreadable)?;
    Ok((BufReader::new(file), about.len()))
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Png,
    Jpeg,
    Tiff,
    Exr,
}

impl Kind {
    fn of_extension(path: &Path) -> Option<Self> {
        match lower_extension(path).as_str() {
            "png" => Some(Self::Png),
            "jpg" | "jpeg" => Some(Self::Jpeg),
            "tif" | "tiff" => Some(Self::Tiff),
            "exr" => Some(Self::Exr),
            _ => None,
        }
    }

    /// The kind by the first bytes; leaves the reader at the start.
    fn of_content(file: &mut (impl Read + Seek)) -> std::io::Result<Option<Self>> {
        let mut start = Vec::new();
        file.by_ref().take(4).read_to_end(&mut start)?;
        file.rewind()?;
        Ok(match start.as_slice() {
            b"\x89PNG" => Some(Self::Png),
            [0xFF, 0xD8, 0xFF, _] => Some(Self::Jpeg),
            b"II\x2A\0" | b"MM\0\x2A" | b"II\x2B\0" | b"MM\0\x2B" => Some(Self::Tiff),
            b"\x76\x2F\x31\x01" => Some(Self::Exr),
            _ => None,
        })
    }
}

fn lower_extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}
