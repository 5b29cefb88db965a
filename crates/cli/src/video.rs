//! Videos, made by the system's ffmpeg: codecs are large, and every system has its own.

use crate::Failure;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use tyndall::message::{excerpt, path_name};

/// Even edges, and the colours of BT.709, of which the video says that they are: players take it for granted in large videos and ffmpeg in none.
const FILTER: &str = "pad=ceil(iw/2)*2:ceil(ih/2)*2,\
                      scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int,format=yuv420p,\
                      setparams=range=tv:colorspace=bt709:color_primaries=bt709:color_trc=bt709";

/// A video that is being made; it appears at its path when it is finished.
pub struct Video {
    path: PathBuf,
    /// Where ffmpeg writes, beside the path.
    unfinished: PathBuf,
    ffmpeg: Child,
}

impl Video {
    /// Extensions of the kinds that are made.
    pub const EXTENSIONS: [&str; 4] = ["mp4", "mov", "mkv", "webm"];

    /// Refuses a video where there is no ffmpeg.
    ///
    /// # Errors
    /// [`Failure::Usage`] with the mend.
    pub fn check(path: &Path) -> Result<(), Failure> {
        let mut version = Command::new("ffmpeg");
        version.arg("-version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        match version.status() {
            Ok(status) if status.success() => Ok(()),
            found => {
                let why = found.map_or_else(|error| error.to_string(), |status| status.to_string());
                Err(Failure::usage(format!(
                    "-o {}: a video needs the program ffmpeg, which does not run: {why}; install it, or expect .apng or a sequence such as turn_{{:04}}.png",
                    path_name(path)
                )))
            }
        }
    }

    /// Starts ffmpeg. Odd sizes get a black row or column more, since codecs need even ones.
    ///
    /// # Errors
    /// [`Failure::Input`] if it does not start.
    pub fn begin(path: &Path, [width, height]: [u32; 2], fps: u16) -> Result<Self, Failure> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        // The extension stays last: it tells ffmpeg the kind.
        let unfinished = path.with_file_name(format!(".tyndall-{}-{name}", std::process::id()));
        let mut command = Command::new("ffmpeg");
        command.args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
        command.args(["-s", &format!("{width}x{height}"), "-framerate", &fps.to_string(), "-i", "-"]);
        command.args(["-vf", FILTER]);
        command.args(if name.to_lowercase().ends_with("webm") {
            ["-c:v", "libvpx-vp9", "-crf", "20", "-b:v", "0"]
        } else {
            ["-c:v", "libx264", "-crf", "16", "-preset", "slow"]
        });
        // Otherwise a name that begins with a dash would be an option.
        command.arg(std::path::absolute(&unfinished).unwrap_or_else(|_| unfinished.clone()));
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        // Ctrl-C is for this program, which then ends the video in good order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let ffmpeg = command.spawn().map_err(|error| {
            Failure::input(format!("{}: ffmpeg does not start: {error}", path_name(path)))
        })?;
        Ok(Self { path: path.to_owned(), unfinished, ffmpeg })
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
        std::fs::rename(&self.unfinished, &self.path).map_err(|error| self.failure(&error.to_string()))
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
        drop(self.ffmpeg.wait());
        // Gone if the video was finished.
        drop(std::fs::remove_file(&self.unfinished));
    }
}
