//! Writes pictures and statistics to their destinations.

use crate::parts::StateInfo;
use crate::{Failure, say, stdout_failure};
use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use tyndall::film::{Film, Image, Tone};
use tyndall_formats::image::{Metadata, Picture, encode_png, keeps_transparency, read_metadata, write};
use tyndall_live::document::{Background, Document, Exposure, Light};
use tyndall_live::look_text;

/// The name of standard output.
const STDOUT: &str = "-";

/// Where pictures go: the paths given, or the input's stem with an extension in the current folder. Without being asked, nothing is replaced but
/// an earlier picture.
pub fn paths(asked: &[PathBuf], input: &Path, extension: &str) -> Result<Vec<PathBuf>, Failure> {
    if !asked.is_empty() {
        return Ok(asked.to_vec());
    }
    let path = default_path(input, extension);
    check_replaceable(&path, input)?;
    Ok(vec![path])
}

/// The input's stem with an extension.
fn default_path(input: &Path, extension: &str) -> PathBuf {
    let name = input.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    // "head.nii.gz" has two extensions.
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let stem = Path::new(name).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    PathBuf::from(format!("{stem}.{extension}"))
}

/// Refuses to replace the input, and whatever is no picture of Tyndall's.
fn check_replaceable(path: &Path, input: &Path) -> Result<(), Failure> {
    // A link that leads nowhere is something too.
    if path.symlink_metadata().is_err() {
        return Ok(());
    }
    let name = tyndall::message::path_name(path);
    let found = if is_same_file(path, input) {
        "is the input"
    } else if matches!(read_metadata(path), Ok(Some(_))) {
        return Ok(());
    } else {
        "was not made by Tyndall"
    };
    Err(Failure::usage(format!(
        "`{name}` {found}, and is not replaced without -o; name the picture with -o FILE"
    )))
}

/// Refuses, before any work, paths that cannot be written and paths that are named twice.
pub fn check(
    pictures: &[PathBuf],
    films: &[PathBuf],
    statistics: Option<&Path>,
    look: Option<&Path>,
) -> Result<(), Failure> {
    let mut taken = BTreeSet::new();
    for path in pictures.iter().chain(films).map(PathBuf::as_path).chain(statistics).chain(look) {
        if !taken.insert(absolute(path)) {
            let path = tyndall::message::path_name(path);
            return Err(Failure::usage(format!(
                "`{path}` would be written twice; expected a different path for each output"
            )));
        }
    }
    for path in pictures.iter().filter(|p| p.as_os_str() != STDOUT) {
        tyndall_formats::image::check_destination(path).map_err(Failure::usage)?;
    }
    for path in films {
        tyndall_formats::atomic::check(path).map_err(|error| {
            let path = tyndall::message::path_name(path);
            Failure::usage(format!(
                "-o {path}: the film cannot be written: {error}; name a file in a writable folder"
            ))
        })?;
    }
    if let Some(path) = statistics.filter(|p| p.as_os_str() != STDOUT) {
        tyndall_formats::atomic::check(path)
            .map_err(|e| Failure::usage(format!("--stats {}", unwritable(path, &e))))?;
    }
    match look {
        Some(path) => tyndall_formats::atomic::check(path)
            .map_err(|e| Failure::usage(format!("--save-look {}", look_unwritable(path, &e)))),
        None => Ok(()),
    }
}

/// Whether a path names a file that can hold samples.
fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
}

/// Refuses paths without an OpenEXR file, which alone can hold the samples that an option is to keep.
pub fn check_exr(paths: &[PathBuf], option: &str) -> Result<(), Failure> {
    if paths.iter().any(|path| is_exr(path)) {
        return Ok(());
    }
    Err(Failure::usage(format!("{option} needs an OpenEXR file, which holds the samples; add -o FILE.exr")))
}

/// What a user should know of the kinds of pictures asked for, before the work.
pub fn notes(paths: &[PathBuf], document: &Document) -> Vec<String> {
    let is_lost = |path: &&PathBuf| path.as_os_str() != STDOUT && !keeps_transparency(path);
    if document.film.background != Background::Transparent {
        return Vec::new();
    }
    let note = |path: &PathBuf| {
        let name = tyndall::message::path_name(path);
        format!(
            "{name}: JPEG has no transparent pixels: they will be white; write .png, .tif or .exr to keep them"
        )
    };
    paths.iter().filter(is_lost).map(note).collect()
}

/// Writes the film to every path; into OpenEXR files with its samples if they are described.
pub fn pictures(
    paths: &[PathBuf],
    film: &Film,
    document: &Document,
    source_folder: &Path,
    samples: Option<&StateInfo>,
) -> Result<(), Failure> {
    let Shown { mut picture, tone, document: stated } = shown(film, document);
    // A picture that can go on, and a part, keep what the whole is to have.
    let document = if samples.is_none() { &stated } else { document };
    for path in paths {
        let to_stdout = path.as_os_str() == STDOUT;
        let folder = if to_stdout { Path::new("") } else { path.parent().unwrap_or(Path::new("")) };
        let mut metadata = metadata(film, document, source_folder, folder, samples);
        let samples = samples.filter(|_| is_exr(path));
        picture.state = samples.map(|_| film.state().layers).unwrap_or_default();
        if let Some(samples) = samples {
            samples.describe(&mut metadata);
        }
        if to_stdout {
            let bytes = encode_png(&picture, &tone, &metadata).map_err(Failure::input)?;
            let mut out = std::io::stdout().lock();
            out.write_all(&bytes).and_then(|()| out.flush()).map_err(|e| stdout_failure(&e))?;
        } else {
            write(path, &picture, &tone, &metadata).map_err(Failure::input)?;
        }
    }
    Ok(())
}

/// A picture as it is written.
pub struct Shown {
    /// The picture.
    pub picture: Picture,
    /// How it is shown in 8 bits.
    pub tone: Tone,
    /// The document with the exposure as a number.
    pub document: Document,
}

/// The picture of a film.
pub fn shown(film: &Film, document: &Document) -> Shown {
    let image = film.image();
    let stops = document.film.stops(&image);
    let Image { size, rgba, variance, depth } = image;
    let picture = Picture {
        width: size[0],
        height: size[1],
        rgba,
        variance: Some(variance),
        depth: Some(depth),
        transparent: document.film.background == Background::Transparent,
        state: Vec::new(),
    };
    let mut stated = document.clone();
    stated.film.exposure = Exposure::Stops(stops);
    Shown { picture, tone: document.film.shown_at(stops), document: stated }
}

/// The metadata of a finished picture at a path.
pub fn metadata_for(path: &Path, film: &Film, document: &Document, source_folder: &Path) -> Metadata {
    metadata(film, document, source_folder, path.parent().unwrap_or(Path::new("")), None)
}

/// The scene with its paths relative to the picture's folder, so that both can move together.
fn metadata(
    film: &Film,
    document: &Document,
    from: &Path,
    to: &Path,
    samples: Option<&StateInfo>,
) -> Metadata {
    let mut document = document.clone();
    // A picture that can go on, and a part, keep what the whole is to have.
    if samples.is_none() {
        document.render.given_samples = Some(film.samples().max(1));
    }
    let moved = |path: &mut String| *path = relocate(path, from, to);
    document.volume.path.iter_mut().for_each(moved);
    for light in document.lights.iter_mut().flatten() {
        if let Light::Environment { map: Some(map), .. } = light {
            moved(map);
        }
    }
    let mut metadata = Metadata::default();
    metadata.insert(Metadata::SCENE, document.to_value().to_string());
    metadata.insert(Metadata::VERSION, env!("CARGO_PKG_VERSION"));
    metadata.insert(Metadata::SEED, document.render.seed.to_string());
    metadata.insert(Metadata::SAMPLES, (film.samples() - film.first()).to_string());
    metadata
}

/// Rewrites a path relative to one folder as relative to another. An absolute path stays; one that has no relative form
/// becomes absolute.
fn relocate(path: &str, from: &Path, to: &Path) -> String {
    if Path::new(path).is_absolute() {
        return path.to_owned();
    }
    let target = from.join(path);
    // If the file itself is a link, the link's own name is kept.
    let target = match (target.parent(), target.file_name()) {
        (Some(folder), Some(name)) => real(folder).join(name),
        _ => real(&target),
    };
    let way = pathdiff::diff_paths(&target, real(to)).unwrap_or(target);
    way.to_string_lossy().replace('\\', "/")
}

/// The absolute path of a folder, with links resolved if it exists: `..` after a link leads elsewhere than it seems.
fn real(folder: &Path) -> PathBuf {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    folder.canonicalize().unwrap_or_else(|_| absolute(folder))
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Writes statistics as JSON.
pub fn statistics(path: &Path, value: &serde_json::Value) -> Result<(), Failure> {
    let text = format!("{value:#}\n");
    if path.as_os_str() == STDOUT {
        return say(&text);
    }
    tyndall_formats::atomic::replace(path, text.as_bytes()).map_err(|e| Failure::input(unwritable(path, &e)))
}

/// Refuses to replace the input by its look.
pub fn check_look(look: Option<&Path>, input: &Path) -> Result<(), Failure> {
    match look {
        Some(path) if is_same_file(path, input) => {
            let name = tyndall::message::path_name(path);
            Err(Failure::usage(format!(
                "--save-look {name}: is the input, of which a look is only a part; name another file"
            )))
        }
        _ => Ok(()),
    }
}

/// Whether two paths lead to the same file.
fn is_same_file(a: &Path, b: &Path) -> bool {
    a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

/// Writes a look, as JSON if the extension says so, else as TOML.
pub fn look(path: &Path, look: &serde_json::Value) -> Result<(), Failure> {
    tyndall_formats::atomic::replace(path, look_text(path, look).as_bytes())
        .map_err(|e| Failure::input(look_unwritable(path, &e)))
}

fn look_unwritable(path: &Path, error: &std::io::Error) -> String {
    let path = tyndall::message::path_name(path);
    format!("{path}: the look cannot be written: {error}; name a file in a writable folder")
}

fn unwritable(path: &Path, error: &std::io::Error) -> String {
    let path = tyndall::message::path_name(path);
    format!("{path}: statistics cannot be written: {error}; name a file in a writable folder, or `-`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_path_is_the_stem_in_the_current_folder() {
        let path = |input: &str| default_path(Path::new(input), "png").to_string_lossy().into_owned();
        assert_eq!(path("a/head.nrrd"), "head.png");
        assert_eq!(path("a/b.c/head.nii.gz"), "head.png");
        assert_eq!(path("scene.toml"), "scene.png");
    }

    #[test]
    fn paths_become_relative_to_the_picture() {
        let root = tempfile::tempdir().unwrap();
        for folder in ["data/a", "data/x", "out/deep"] {
            std::fs::create_dir_all(root.path().join(folder)).unwrap();
        }
        let moved =
            |path: &str, from: &str, to: &str| relocate(path, &root.path().join(from), &root.path().join(to));
        assert_eq!(moved("head.nrrd", "data", "out"), "../data/head.nrrd");
        assert_eq!(moved("head.nrrd", "data", "data"), "head.nrrd");
        assert_eq!(moved("../x/head.nrrd", "data/a", "data"), "x/head.nrrd");
        assert_eq!(relocate("head.nrrd", Path::new(""), Path::new("")), "head.nrrd");
        let absolute = root.path().join("head.nrrd").to_string_lossy().into_owned();
        assert_eq!(moved(&absolute, "data", "out"), absolute);
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(root.path().join("out/deep"), root.path().join("data/link")).unwrap();
            assert_eq!(moved("head.nrrd", "data", "data/link"), "../../data/head.nrrd");
        }
    }
}
