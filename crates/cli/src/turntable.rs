//! `tyndall render --turntable`: pictures and films of a volume that turns.

use crate::machine::Interrupt;
use crate::video::Video;
use crate::{Failure, output};
use std::path::{Path, PathBuf};
use tyndall::message::path_name;
use tyndall_formats::image::{Animation, AnimationHeader};
use tyndall_live::document::Exposure;
use tyndall_live::{LiveSession, Orbit};

/// Where the frames go.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Output {
    /// A picture for each frame.
    Sequence(Pattern),
    /// One animated PNG.
    Animation(PathBuf),
    /// One video, made by ffmpeg.
    Video(PathBuf),
}

/// A path with a place for the number of the frame: `{}`, or `{:04}` for at least four digits.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

/// Most digits of a frame's number.
const MOST_DIGITS: usize = 9;

impl Pattern {
    fn parse(text: &str) -> Option<Self> {
        let (before, rest) = text.split_once('{')?;
        let (inside, after) = rest.split_once('}').filter(|(_, after)| !after.contains(['{', '}']))?;
        let digits = match inside.strip_prefix(':') {
            None if inside.is_empty() => 1,
            None => return None,
            Some(width) => width.parse().ok().filter(|digits| (1..=MOST_DIGITS).contains(digits))?,
        };
        Some(Self { before: before.to_owned(), digits, after: after.to_owned() })
    }

    fn at(&self, frame: u32) -> PathBuf {
        let Self { before, digits, after } = self;
        PathBuf::from(format!("{before}{frame:0digits$}{after}"))
    }
}

impl Output {
    fn parse(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        if extension == "apng" {
            return Ok(Self::Animation(path.to_owned()));
        }
        if Video::is_video(path) {
            return Ok(Self::Video(path.to_owned()));
        }
        path.to_str().and_then(Pattern::parse).map(Self::Sequence).ok_or_else(|| {
            Failure::usage(format!(
                "-o {}: --turntable makes many pictures; expected a name with a place for their number, such as turn_{{:04}}.png, or a film: .apng, {}",
                path_name(path),
                Video::extensions()
            ))
        })
    }
}

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Turntable {
    /// Number of frames of a full turn, at least 1.
    frames: u32,
    /// Frames of films per second.
    fps: u16,
    outputs: Vec<Output>,
}

/// Films that are being written.
#[derive(Default)]
struct Films {
    animations: Vec<Animation>,
    videos: Vec<Video>,
}

impl Turntable {
    /// Checks the paths asked for; without any the film is the input's stem with .apng in the current folder.
    ///
    /// # Errors
    /// [`Failure`] for names that have no place for a number, and if there is no ffmpeg for a video.
    pub fn new(frames: u32, fps: u16, asked: &[PathBuf], input: &Path) -> Result<Self, Failure> {
        let paths = output::paths(asked, input, "apng")?;
        let outputs = paths.iter().map(|path| Output::parse(path)).collect::<Result<Vec<_>, _>>()?;
        outputs.iter().filter_map(Output::film).try_for_each(Video::check)?;
        Ok(Self { frames, fps, outputs })
    }

    /// Which frame it is, for progress.
    pub fn about(&self, frame: u32) -> String {
        format!("frame {} of {}", frame + 1, self.frames)
    }

    /// The pictures that will be written.
    pub fn pictures(&self) -> Vec<PathBuf> {
        let frames = 0..self.frames;
        self.outputs
            .iter()
            .flat_map(|output| frames.clone().filter_map(move |frame| output.picture(frame)))
            .collect()
    }

    /// The pictures of the first frame.
    pub fn first_pictures(&self) -> Vec<PathBuf> {
        self.outputs.iter().filter_map(|output| output.picture(0)).collect()
    }

    /// The films that will be written.
    pub fn films(&self) -> Vec<PathBuf> {
        self.outputs.iter().filter_map(Output::film).map(Path::to_owned).collect()
    }

    /// Renders each frame and writes it; if an end is requested, the pictures so far stay, and films have their frames. `refine` renders the
    /// session's picture until it is to be shown.
    ///
    /// # Errors
    /// [`Failure`] if a file cannot be written.
    pub fn render(
        &self,
        live: &mut LiveSession,
        interrupt: &Interrupt,
        mut refine: impl FnMut(&mut LiveSession, u32),
    ) -> Result<(), Failure> {
        let orbit = Orbit::of(live);
        let mut films = Films::default();
        for frame in 0..self.frames {
            if frame > 0 {
                let share = f64::from(frame) / f64::from(self.frames);
                live.edit(&orbit.patch(share)).map_err(Failure::input)?;
            }
            refine(live, frame);
            if interrupt.is_requested() {
                break;
            }
            self.write(frame, live, &mut films)?;
            // The exposure of the first frame holds for all, so that the film does not flicker.
            if live.document().film.exposure == Exposure::Auto {
                let stops = live.document().film.stops(&live.film().image());
                live.edit(&serde_json::json!({ "film": { "exposure": stops } })).map_err(Failure::input)?;
            }
        }
        // All of them, even if one fails.
        let videos: Vec<_> = films.videos.into_iter().map(Video::finish).collect();
        let animations: Vec<_> = films.animations.into_iter().map(Animation::finish).collect();
        videos.into_iter().collect::<Result<(), _>>()?;
        animations.into_iter().collect::<Result<(), _>>().map_err(Failure::input)
    }

    /// Writes a frame to all outputs, which begin with the first.
    fn write(&self, frame: u32, live: &LiveSession, films: &mut Films) -> Result<(), Failure> {
        let (film, document, folder) = (live.film(), live.document(), live.folder());
        let pictures: Vec<PathBuf> = self.outputs.iter().filter_map(|output| output.picture(frame)).collect();
        output::pictures(&pictures, film, document, folder, None)?;
        if self.outputs.iter().all(|output| output.film().is_none()) {
            return Ok(());
        }
        let shown = output::shown(film, document);
        let (size, transparent) = (film.size(), shown.picture.transparent);
        if frame == 0 {
            let header = AnimationHeader { size, frames: self.frames, fps: self.fps, transparent };
            for output in &self.outputs {
                match output {
                    Output::Animation(path) => {
                        let metadata = output::metadata_for(path, film, &shown.document, folder);
                        films
                            .animations
                            .push(Animation::begin(path, header, &metadata).map_err(Failure::input)?);
                    }
                    Output::Video(path) => films.videos.push(Video::begin(path, size, self.fps)?),
                    Output::Sequence(_) => {}
                }
            }
        }
        for animation in &mut films.animations {
            animation.add(&shown.picture, &shown.tone).map_err(Failure::input)?;
        }
        if !films.videos.is_empty() {
            let codes = tyndall_formats::image::codes(&shown.picture, &shown.tone);
            films.videos.iter_mut().try_for_each(|video| video.add(&codes))?;
        }
        Ok(())
    }
}

impl Output {
    /// The file of a frame that has one of its own.
    fn picture(&self, frame: u32) -> Option<PathBuf> {
        match self {
            Self::Sequence(pattern) => Some(pattern.at(frame)),
            Self::Animation(_) | Self::Video(_) => None,
        }
    }

    /// The file of all frames.
    fn film(&self) -> Option<&Path> {
        match self {
            Self::Sequence(_) => None,
            Self::Animation(path) | Self::Video(path) => Some(path),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_numbers_of_the_digits_asked_for() {
        let at = |text: &str, frame| Pattern::parse(text).map(|pattern| pattern.at(frame));
        assert_eq!(at("a/turn_{:04}.png", 7), Some("a/turn_0007.png".into()));
        assert_eq!(at("{}.exr", 12345), Some("12345.exr".into()));
        assert_eq!(at("t{:2}.png", 123), Some("t123.png".into()));
        for bad in ["a.png", "{x}.png", "{:x}.png", "{:0}.png", "{:99}.png", "}{.png", "{", "{}{}.png"] {
            assert_eq!(Pattern::parse(bad), None, "{bad}");
        }
    }
}
