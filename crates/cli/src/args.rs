//! The command line.

use crate::option_values::{positive, seconds, share, size};
use crate::parts::Share;
use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Args as Group, Parser, Subcommand, ValueEnum, value_parser};
use std::path::PathBuf;
use std::time::Duration;
use tyndall::integrator::METHODS;
use tyndall::transfer::PRESETS;

/// The scene document's own limits, so that a number beyond them is reported as the option's fault.
const MOST_SAMPLES: i64 = 1 << 31;
const MOST_SCATTER: i64 = 1_000_000;

/// More frames than a film of an hour.
const MOST_FRAMES: i64 = 100_000;

/// Starting more threads than this takes longer than most pictures.
const MOST_THREADS: i64 = 1024;

/// Renders volumes (CT, MRI, microscopy, simulations) with physically based light transport.
#[derive(Debug, Parser)]
#[command(
    name = "tyndall",
    version,
    about,
    long_about = "\
Renders volumes (CT, MRI, microscopy, simulations) with physically based light transport.

A first picture:        tyndall render head.nrrd
With another look:      tyndall render head.nrrd --preset ct-bone --size 800x800 -o head.png
For the record:         tyndall render scene.toml --samples 256 -o figure.exr -o figure.png --stats figure.json
The same again:         tyndall render figure.png -o again.png"
)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What the program can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene or a bare volume to pictures
    #[command(allow_negative_numbers = true)]
    Render(Box<RenderOptions>),
    /// Play a list of edits against a live session: how fast each is, and how much was computed again
    #[command(allow_negative_numbers = true)]
    Replay(Box<ReplayOptions>),
    /// Merge the parts of a render, in any order, into exactly the picture of a single run
    Merge(MergeOptions),
    /// Show what the loader understood of a volume or of a scene's volume
    Info(InfoOptions),
    /// Measure this machine: speed as ratios, latency, growth
    Bench(BenchOptions),
    /// Render every look that suits a volume on one page
    Sheet(SheetOptions),
    /// List the transfer-function presets
    Presets,
    /// List the looks
    Looks,
    /// Print the JSON Schema of the scene document
    Schema,
    /// Print a completion script for a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Options of `render`.
#[derive(Debug, Group)]
pub struct RenderOptions {
    /// A scene (.toml, .json), a picture that Tyndall made, or a volume: NRRD, NIfTI, MetaImage, NumPy
    ///
    /// A bare volume gets a preset fit to its kind, a density of 200 / box diagonal, an automatic camera, and unless --look is given
    /// the look `night`. A picture is rendered again from the scene in its metadata.
    pub input: PathBuf,

    /// Write the picture to FILE: .png .jpg .tif (tone-mapped, 8 bit) or .exr (linear float); repeatable
    ///
    /// `-` writes a PNG to standard output. Without this option the picture goes to the current folder, as the
    /// input's name with .png, where it replaces an earlier picture of Tyndall's, but neither the input nor any other file.
    #[arg(short, long = "output", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,

    /// Stop after N samples per pixel [default: the scene's, if no other stop is given]
    #[arg(long, value_name = "N", help_heading = "When to stop (whichever comes first)",
          value_parser = value_parser!(u32).range(1..=MOST_SAMPLES))]
    pub samples: Option<u32>,

    /// Stop after SECONDS of rendering, not counting loading
    #[arg(long, value_name = "SECONDS", help_heading = "When to stop (whichever comes first)", value_parser = seconds)]
    pub time: Option<Duration>,

    /// Stop when the picture's relative error (noise) is at most E, e.g. 0.02
    #[arg(long, value_name = "E", help_heading = "When to stop (whichever comes first)", value_parser = positive)]
    pub target_error: Option<f64>,

    /// Render only part K of N, into an OpenEXR file for `tyndall merge`
    ///
    /// A part is a multiple of 16 samples, except that the last takes what is left. Merged, the parts give exactly the picture of a single run.
    #[arg(long, value_name = "K/N", help_heading = "In several runs", value_parser = share,
          conflicts_with_all = ["time", "target_error", "resume"])]
    pub part: Option<Share>,

    /// Keep the samples in the OpenEXR file, so that --resume can go on from them
    #[arg(long, help_heading = "In several runs")]
    pub resumable: bool,

    /// Go on from the samples in FILE, which must be of the same scene; the picture is exactly that of a single run
    ///
    /// An OpenEXR file that is written can be resumed again.
    #[arg(long, value_name = "FILE", help_heading = "In several runs")]
    pub resume: Option<PathBuf>,

    /// Render N frames of a full turn: the camera goes round the volume, about the world's up
    ///
    /// Each -o is a sequence, such as turn_{:04}.png, or a film: .apng, or by the system's ffmpeg .mp4, .mov, .mkv or .webm
    /// [default: the input's name with .apng]. The options of when to stop hold for each frame.
    #[arg(long, value_name = "N", help_heading = "Films", value_parser = value_parser!(u32).range(1..=MOST_FRAMES),
          conflicts_with_all = ["part", "resume", "resumable"])]
    pub turntable: Option<u32>,

    /// Frames of a film per second
    #[arg(long, value_name = "N", help_heading = "Films", default_value = "24", requires = "turntable",
          value_parser = value_parser!(u16).range(1..=1000))]
    pub fps: u16,

    /// What is rendered.
    #[command(flatten)]
    pub scene: SceneOptions,

    /// How it runs.
    #[command(flatten)]
    pub run: RunOptions,

    /// Save the look of the scene, as all options make it, to FILE (.toml or .json), for --look
    #[arg(long, value_name = "FILE")]
    pub save_look: Option<PathBuf>,

    /// Show progress even when standard error is not a terminal
    #[arg(long)]
    pub progress: bool,

    /// Print what is done and how long it takes
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

/// Options of `merge`.
#[derive(Debug, Group)]
pub struct MergeOptions {
    /// The OpenEXR files of all parts, in any order
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<PathBuf>,

    /// Write the picture to FILE, as `render` does; repeatable
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    pub outputs: Vec<PathBuf>,

    /// Keep the samples in the OpenEXR file, so that `render --resume` can go on from it
    #[arg(long)]
    pub resumable: bool,
}

/// Options of `replay`.
#[derive(Debug, Group)]
pub struct ReplayOptions {
    /// A scene (.toml, .json), a picture that Tyndall made, or a volume, as for `render`
    #[arg(value_name = "SCENE")]
    pub input: PathBuf,

    /// A JSON list of edits, each { "name": ..., "patch": JSON Merge Patch on the scene document }
    pub edits: PathBuf,

    /// Render every edited scene from nothing as well, and compare times and pictures
    #[arg(long)]
    pub verify: bool,

    /// Write the picture after the last edit to FILE, as `render` does; repeatable
    #[arg(short, long = "output", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,

    /// Samples per pixel of the pictures that are compared or written [default: the scene's]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=MOST_SAMPLES))]
    pub samples: Option<u32>,

    /// What is rendered.
    #[command(flatten)]
    pub scene: SceneOptions,

    /// How it runs.
    #[command(flatten)]
    pub run: RunOptions,
}

/// Options that override the scene.
#[derive(Debug, Group)]
pub struct SceneOptions {
    /// Compute light by this method
    #[arg(long, value_name = "NAME", help_heading = "Scene", value_parser = methods())]
    pub integrator: Option<String>,

    /// Width and height in pixels
    #[arg(long, value_name = "WxH", value_parser = size, help_heading = "Scene")]
    pub size: Option<[u32; 2]>,

    /// Seed of all random numbers; the same seed gives the same bits on any number of threads
    #[arg(long, value_name = "N", help_heading = "Scene")]
    pub seed: Option<u64>,

    /// Keep light that scattered at most K times
    #[arg(long, value_name = "K", help_heading = "Scene",
          value_parser = value_parser!(u32).range(..=MOST_SCATTER))]
    pub max_scatter: Option<u32>,

    /// Give it a look: one that `tyndall looks` lists, or a FILE with one
    ///
    /// A look is a merge patch on the scene, which is applied before all other options: lights, transfer function, background, tone, lens, method.
    #[arg(long, value_name = "NAME or FILE", help_heading = "Scene")]
    pub look: Option<String>,

    /// Use this transfer function; `tyndall presets` lists them
    #[arg(long, value_name = "NAME", help_heading = "Scene", hide_possible_values = true,
          value_parser = PossibleValuesParser::new(PRESETS.map(|preset| preset.name)))]
    pub preset: Option<String>,

    /// Override any key of the scene, e.g. medium.density=0.3 or lights.0.radiance=[1,2,3]; repeatable
    ///
    /// VALUE is parsed as JSON, else taken as a string. The other options take precedence.
    #[arg(long, value_name = "PATH=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
}

/// Options of `sheet`.
#[derive(Debug, Group)]
pub struct SheetOptions {
    /// A volume, a scene or a picture that Tyndall made
    pub input: PathBuf,

    /// Write the page to FILE (PNG)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// Width and height of each picture in pixels
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "320x320")]
    pub size: [u32; 2],

    /// Samples per pixel [default: the scene's]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=MOST_SAMPLES))]
    pub samples: Option<u32>,

    /// Threads [default: one per processor]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=MOST_THREADS))]
    pub threads: Option<u16>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}

/// Options that do not change the picture.
#[derive(Debug, Group)]
pub struct RunOptions {
    /// Threads [default: one per processor]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=MOST_THREADS))]
    pub threads: Option<u16>,

    /// Write statistics as JSON to FILE (`-` for standard output)
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Options of `info`.
#[derive(Debug, Group)]
pub struct InfoOptions {
    /// A volume, or a scene with one
    pub file: PathBuf,

    /// As JSON
    #[arg(long)]
    pub json: bool,
}

/// Options of `bench`.
#[derive(Debug, Group)]
pub struct BenchOptions {
    /// Which tables
    #[arg(value_enum, default_value = "all")]
    pub name: BenchName,

    /// Scenes or volumes whose edits `looks` measures; without one, a generated volume
    #[arg(value_name = "FILE")]
    pub files: Vec<PathBuf>,

    /// As JSON, all at the end
    #[arg(long)]
    pub json: bool,

    /// As Markdown tables, for the documentation
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,

    /// Smaller sizes, once each: shows that it works, measures nothing
    #[arg(long)]
    pub quick: bool,

    /// Measure only this table of the set; repeatable
    ///
    /// Their names: core: sampling, flight, paths, threads, latency, costs, growth, first-pictures; looks: edits, look; historygrams:
    /// cornell-box, ct, hard, figure-7, figure-8, figure-9, defaults, scans, gathering, path.
    #[arg(long = "table", value_name = "NAME")]
    pub tables: Vec<String>,

    /// Folder with scans for the tables `first-pictures` and `scans`: ct_chest_aorta_i16.nrrd, ct_head_promed_i16.nrrd, or one of them
    ///
    /// The MRI of examples/data is always measured.
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,

    /// Show progress even when standard error is not a terminal
    #[arg(long, conflicts_with = "quiet")]
    pub progress: bool,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}

/// Sets of tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BenchName {
    /// What the path tracer and the ray marcher are built on
    Core,
    /// Photon maps kept through edits, compared with the tables of the paper
    Historygrams,
    /// How soon edits of files show, and the time of a look
    Looks,
    /// All of them
    All,
}

/// The methods, as the library lists them.
fn methods() -> PossibleValuesParser {
    METHODS.iter().map(|method| PossibleValue::new(method.name).help(method.about)).collect::<Vec<_>>().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use tyndall_live::document;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn options_have_the_limits_of_the_document() {
        let schema = document::schema();
        for (key, most) in [("samples", MOST_SAMPLES), ("max_scatter", MOST_SCATTER)] {
            assert_eq!(schema["$defs"]["Render"]["properties"][key]["maximum"], most, "{key}");
        }
    }
}
