//! Animated PNG: frames of one size that repeat for ever, written one by one.

use super::error::EncodeFailure;
use super::{ImageError, Metadata, Picture, Tone, display, png};
use crate::atomic::Replacement;
use ::png::{Encoder, EncodingError, Writer};
use flate2::Crc;
use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// An animated PNG that is being written; only the current frame is in memory. It appears at its path when it is finished.
pub struct Animation {
    path: PathBuf,
    file: Replacement,
    writer: Writer<BufWriter<File>>,
    header: AnimationHeader,
    added: u32,
}

/// What is said of an animation before its first frame.
#[derive(Clone, Copy, Debug)]
pub struct AnimationHeader {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Number of frames, at least 1.
    pub frames: u32,
    /// Frames per second, at least 1.
    pub fps: u16,
    /// Whether the frames have transparent pixels.
    pub transparent: bool,
}

impl Animation {
    /// Begins an animation with the metadata of its first frame.
    ///
    /// # Errors
    /// [`ImageError`] if the file cannot be written.
    pub fn begin(path: &Path, header: AnimationHeader, metadata: &Metadata) -> Result<Self, ImageError> {
        let unwritable = |source| ImageError::unwritable(path, source);
        let file = Replacement::begin(path).map_err(unwritable)?;
        let handle = file.handle().map_err(unwritable)?;
        let AnimationHeader { size: [width, height], frames, fps, transparent } = header;
        let begin = || {
            let mut encoder = Encoder::new(BufWriter::new(handle), width, height);
            encoder.set_animated(frames, 0)?;
            encoder.set_frame_delay(1, fps)?;
            png::begin(encoder, transparent, metadata)
        };
        let writer = begin().map_err(|error| failure(path, &error))?;
        Ok(Self { path: path.to_owned(), file, writer, header, added: 0 })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// [`ImageError`] if the file cannot be written, or has all its frames.
    pub fn add(&mut self, picture: &Picture, tone: &Tone) -> Result<(), ImageError> {
        let pixels = if self.header.transparent {
            display::straight_rgba8(picture, tone)
        } else {
            display::rgb8(picture, tone)
        };
        self.writer.write_image_data(&pixels).map_err(|error| failure(&self.path, &error))?;
        self.added += 1;
        Ok(())
    }

    /// Puts the file at its path, with as many frames as were added; without any nothing is written.
    ///
    /// # Errors
    /// [`ImageError`] if the file cannot be written.
    pub fn finish(self) -> Result<(), ImageError> {
        let Self { path, file, writer, header, added } = self;
        writer.finish().map_err(|error| failure(&path, &error))?;
        let finish = || match added {
            0 => Ok(()),
            _ if added == header.frames => file.finish(),
            _ => state_frames(&file, added).and_then(|()| file.finish()),
        };
        finish().map_err(|source| ImageError::unwritable(&path, source))
    }
}

/// Corrects the number of frames that a finished animation states in its chunk `acTL`, which is before the first frame.
fn state_frames(file: &Replacement, frames: u32) -> std::io::Result<()> {
    const SIGNATURE: u64 = 8;
    let mut chunks = File::options().read(true).write(true).open(file.unfinished_path())?;
    let mut at = SIGNATURE;
    loop {
        chunks.seek(SeekFrom::Start(at))?;
        let mut head = [0; 8];
        chunks.read_exact(&mut head)?;
        let [a, b, c, d, name @ ..] = head;
        if name == *b"acTL" {
            break;
        }
        // The data follow, and a checksum.
        at += u64::from(u32::from_be_bytes([a, b, c, d])) + 12;
    }
    // Endless repetitions are 0.
    let [frames, repetitions] = [frames, 0_u32].map(u32::to_be_bytes);
    let data = [frames, repetitions].concat();
    let mut checksum = Crc::new();
    checksum.update(b"acTL");
    checksum.update(&data);
    chunks.write_all(&data)?;
    chunks.write_all(&checksum.sum().to_be_bytes())
}

fn failure(path: &Path, error: &EncodingError) -> ImageError {
    EncodeFailure::library(error).at(path)
}
