//! Videos, made by the system's ffmpeg: codecs are large, and every system has its own.

use crate::Failure;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use tyndall::message::{excerpt, path_name};
use tyndall_formats::atomic::Replacement;

/// Even edges, and the colours of BT.709, of which the video says that they are: players take it for granted in large videos and ffmpeg in none.
const FILTER: &str = "pad=ceil(iw/2)*2:ceil(ih/2)*2,\
                      scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int,format=yuv420p,\
                      setparams=range=tv:colorspace=bt709:color_primaries=bt709:color_trc=bt709";

/// A video that is being made; it appears at its path when it is finished.
pub struct Video {
    path: PathBuf,
    /// What ffmpeg writes.
    file: Option<Replacement>,
    ffmpeg: Child,
}

/// What ffmpeg calls a kind of video, and how it encodes it.
struct Kind {
    extension: &'static str,
    format: &'static str,
    encoder: &'static str,
    quality: [&'static str; 4],
}

const H264: (&str, [&str; 4]) = ("libx264", ["-crf", "16", "-preset", "slow"]);
const VP9: (&str, [&str; 4]) = ("libvpx-vp9", ["-crf", "20", "-b:v", "0"]);

const KINDS: [Kind; 4] = [
    Kind::of("mp4", "mp4", H264),
    Kind::of("mov", "mov", H264),
    Kind::of("mkv", "matroska", H264),
    Kind::of("webm", "webm", VP9),
];

impl Kind {
    const fn of(
        extension: &'static str,
        format: &'static str,
        (encoder, quality): (&'static str, [&'static str; 4]),
    ) -> Self {
        Self { extension, format, encoder, quality }
    }

    fn of_path(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?.to_string_lossy().to_lowercase();
        KINDS.iter().find(|kind| kind.extension == extension)
    }
}

impl Video {
    /// Whether the path's extension is that of a video.
    pub fn is_video(path: &Path) -> bool {
        Kind::of_path(path).is_some()
    }

    /// Extensions of the kinds that are made, for messages.
    pub fn extensions() -> String {
        KINDS.map(|kind| format!(".{}", kind.extension)).join(", ")
    }

    /// Refuses a video where no ffmpeg can encode it.
    ///
    /// # Errors
    /// [`Failure::Usage`] with the mend.
    pub fn check(path: &Path) -> Result<(), Failure> {
        let Some(kind) = Kind::of_path(path) else { return Ok(()) };
        let listed = Command::new("ffmpeg").args(["-hide_banner", "-encoders"]).stdin(Stdio::null()).output();
        let why = match listed {
            Err(error) => format!("which does not run: {error}"),
            Ok(listed) if !String::from_utf8_lossy(&listed.stdout).contains(kind.encoder) => {
                format!("with the encoder {}, which it lacks", kind.encoder)
            }
            Ok(_) => return Ok(()),
        };
        Err(Failure::usage(format!(
            "-o {}: a video needs the program ffmpeg, {why}; install it, or expect .apng or a sequence such as turn_{{:04}}.png",
            path_name(path)
        )))
    }

    /// Starts ffmpeg. Odd sizes get a black row or column more, since codecs need even ones.
    ///
    /// # Errors
    /// [`Failure::Input`] if it does not start.
    pub fn begin(path: &Path, [width, height]: [u32; 2], fps: u16) -> Result<Self, Failure> {
        let unwritable = |error: std::io::Error| Failure::input(format!("{}: {error}", path_name(path)));
        let file = Replacement::begin(path).map_err(unwritable)?;
        let mut command = Command::new("ffmpeg");
        command.args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
        command.args(["-s", &format!("{width}x{height}"), "-framerate", &fps.to_string(), "-i", "-"]);
        command.args(["-vf", FILTER]);
        if let Some(kind) = Kind::of_path(path) {
            command.args(["-c:v", kind.encoder]).args(kind.quality).args(["-f", kind.format]);
        }
        // Otherwise a name that begins with a dash would be an option.
        let to = std::path::absolute(file.unfinished_path()).map_err(unwritable)?;
        command.arg(to);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        // Ctrl-C is for this program, which then ends the video in good order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let ffmpeg = command.spawn().map_err(|error| {
            Failure::input(format!("{}: ffmpeg does not start: {error}", path_name(path)))
        })?;
        Ok(Self { path: path.to_owned(), file: Some(file), ffmpeg })
    }

    /// Adds a frame of code values, three bytes a pixel.
    ///
    /// # Errors
    /// [`Failure::Input`] with what ffmpeg says if it has stopped.
    pub fn add(&mut self, codes: &[u8]) -> Result<(), Failure> {
        let written = self.ffmpeg.stdin.as_mut().map_or(Ok(()), |pipe| pipe.write_all(codes));
        written.map_err(|error| self.failure(&error.to_string()))
    }

    /// Ends the video and puts it at its path.
    ///
    /// # Errors
    /// [`Failure::Input`] with what ffmpeg says if it fails.
    pub fn finish(mut self) -> Result<(), Failure> {
        drop(self.ffmpeg.stdin.take());
        let said = self.said();
        match self.ffmpeg.wait() {
            Ok(status) if status.success() => {}
            found => {
                let why = found.map_or_else(|error| error.to_string(), |status| status.to_string());
                return Err(self.failure(&format!("{why}: {said}")));
            }
        }
        let finished = self.file.take().map_or(Ok(()), Replacement::finish);
        finished.map_err(|error| self.failure(&error.to_string()))
    }

    /// What ffmpeg prints until it ends.
    fn said(&mut self) -> String {
        let mut said = String::new();
        if let Some(mut pipe) = self.ffmpeg.stderr.take() {
            // Part of a message is better than none.
            drop(pipe.by_ref().take(1 << 16).read_to_string(&mut said));
        }
        excerpt(said.trim()).to_string()
    }

    fn failure(&mut self, why: &str) -> Failure {
        drop(self.ffmpeg.stdin.take());
        let said = self.said();
        Failure::input(
            format!("{}: ffmpeg cannot make the video: {why} {said}", path_name(&self.path))
                .trim_end()
                .to_owned(),
        )
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        drop(self.ffmpeg.stdin.take());
        // It must not write any more when the unfinished file is removed.
        drop(self.ffmpeg.wait());
    }
}
