//! The live session: a document, its assets, its scene and the light computed so far, kept up to date with edits.

use crate::admission;
use crate::assets::{self, Assets, Source};
use crate::build::Built;
use crate::document::{self, Document, Exposure};
use crate::error::LiveError;
use crate::identity::SceneIdentity;
use crate::input::{Input, LoadedScene};
use crate::options::Options;
use crate::undo::UndoList;
use serde_json::Value;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tyndall::film::{Film, Image, Viewer};
use tyndall::integrator::{MethodReport, Resources, method_of};
use tyndall::scene::{Difference, Scene};
use tyndall::session::{Budget, Progress, Session};
use tyndall::volume::Volume;

/// A scene that can be edited and is rendered progressively.
///
/// An edit is a JSON Merge Patch on the scene document. Only the light that it affects is recomputed, and the picture
/// ends up the same, bit for bit, as in a session opened with the edited document. An edit that fails changes nothing.
pub struct LiveSession {
    /// Folder that the document's paths are relative to.
    folder: PathBuf,
    /// The document as written and edited; null if no edits were expected.
    value: Value,
    built: Built,
    session: Session,
    undo: UndoList,
    options: Options,
    source: Source,
    /// Notes for the user on the scene as it was opened, a sentence each.
    notes: Vec<String>,
}

/// What an edit did.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct EditReport {
    /// Which parts of the scene changed.
    pub difference: Difference,
    /// Notes for the user that did not apply before the edit, a sentence each.
    pub notes: Vec<String>,
    /// Time from the patch to the edited scene.
    pub to_scene: Duration,
}

/// Where an edit comes from.
#[derive(Clone, Copy, Debug)]
pub struct EditSource<'a> {
    /// What error messages begin with.
    pub name: &'a str,
    /// Consecutive edits of one gesture, such as the drag of a slider, are one undo step; `None` for a single edit.
    pub gesture: Option<u64>,
}

impl Default for EditSource<'_> {
    /// A single edit.
    fn default() -> Self {
        Self { name: "edit", gesture: None }
    }
}

impl LiveSession {
    /// Opens a file: a scene, a picture with a scene in its metadata, or a volume, for which a look is then chosen.
    ///
    /// # Errors
    /// [`LiveError`] if the file or something that it refers to is invalid, or if there is too little memory.
    pub fn open(path: &Path, options: Options) -> Result<Self, LiveError> {
        Self::start(Input::open(path)?, options)
    }

    /// Opens an input, which may have been patched.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn start(input: Input, options: Options) -> Result<Self, LiveError> {
        Self::of(input.load(&options)?, options)
    }

    /// Starts from a scene that was loaded with the same options.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn of(loaded: LoadedScene, options: Options) -> Result<Self, LiveError> {
        let LoadedScene { document, assets, source, value, folder, name: at, notes: told } = loaded;
        let built = Self::build(document, assets, &options, &at)?;
        let session = session_of(&built.scene, &options);
        let of_source = source.notes.iter().cloned();
        let notes = told.into_iter().chain(of_source).chain(notes_of(&built.scene)).collect();
        Ok(Self { folder, value, built, session, undo: UndoList::default(), options, source, notes })
    }

    /// Builds a scene from scratch, if there is memory for it.
    fn build(document: Document, assets: Assets, options: &Options, at: &str) -> Result<Built, LiveError> {
        admission::film(&document, 0, at)?;
        let built = Built::new(document, assets, &options.threads)
            .map_err(|source| LiveError::Scene { at: at.to_owned(), source })?;
        admission::method(&built.scene, at)?;
        count_values(&built.assets.volume, options);
        Ok(built)
    }

    /// A new session of the same document, which shares the voxels but has no light computed yet. The document is
    /// parsed as if it were opened again.
    ///
    /// # Errors
    /// [`LiveError`] if there is too little memory for another one.
    pub fn fresh(&self) -> Result<Self, LiveError> {
        let at = "scene";
        let (document, assets) = self.parse(self.value().into_owned(), at)?;
        let built = Self::build(document, assets, &self.options, at)?;
        Ok(Self {
            folder: self.folder.clone(),
            value: self.value().into_owned(),
            session: session_of(&built.scene, &self.options),
            built,
            undo: UndoList::default(),
            options: self.options.clone(),
            source: self.source.clone(),
            notes: self.notes.clone(),
        })
    }

    /// Applies a merge patch to the document, and continues with the edited scene.
    ///
    /// # Errors
    /// [`LiveError`] with what is wrong with the patched document; the session is then unchanged.
    pub fn edit(&mut self, patch: &Value) -> Result<EditReport, LiveError> {
        self.edit_from(patch, EditSource::default())
    }

    /// As [`Self::edit`], for a patch from a given source.
    ///
    /// # Errors
    /// As [`Self::edit`].
    pub fn edit_from(&mut self, patch: &Value, source: EditSource<'_>) -> Result<EditReport, LiveError> {
        let EditSource { name: at, gesture } = source;
        let begun = Instant::now();
        let mut patch = patch.clone();
        let moved = document::move_old_keys(&mut patch)
            .map_err(|source| LiveError::Document { at: at.to_owned(), source })?;
        let before = self.value().into_owned();
        let after = document::apply(&before, &patch);
        let patching = begun.elapsed();
        let meant = self.built.document.clone();
        let mut report = self.go_to(after, at)?;
        if meant.equals_but_for_camera(&self.built.document) {
            self.undo.rewritten(&before, &self.value);
        } else {
            self.undo.remember(&before, &self.value, gesture);
        }
        report.to_scene += patching;
        report.notes.splice(0..0, moved);
        Ok(report)
    }

    /// Undoes the last edit that has not been undone, except for the camera, which stays where it is; `None` if there
    /// is none.
    ///
    /// # Errors
    /// [`LiveError`], for example if a file that the earlier document refers to is gone; the session is then unchanged.
    pub fn undo(&mut self) -> Result<Option<EditReport>, LiveError> {
        let Some(before) = self.undo.before(&self.value) else { return Ok(None) };
        let report = self.go_to(before, "undo")?;
        self.undo.undone();
        Ok(Some(report))
    }

    /// Redoes the edit that [`Self::undo`] undid last; `None` if there is none, or if there was another edit since.
    ///
    /// # Errors
    /// As [`Self::undo`].
    pub fn redo(&mut self) -> Result<Option<EditReport>, LiveError> {
        let Some(after) = self.undo.after(&self.value) else { return Ok(None) };
        let report = self.go_to(after, "redo")?;
        self.undo.redone();
        Ok(Some(report))
    }

    /// Continues with another document; nothing changes until all of it has been checked.
    fn go_to(&mut self, value: Value, at: &str) -> Result<EditReport, LiveError> {
        let begun = Instant::now();
        let (document, assets) = self.parse(value.clone(), at)?;
        let before = &self.built.document;
        if document.film.size != before.film.size || document.render.samples() != before.render.samples() {
            admission::film(&document, 0, at)?;
        }
        let more_memory = document.film.size != before.film.size || document.render != before.render;
        let built = self
            .built
            .edited(document, assets, &self.options.threads)
            .map_err(|source| LiveError::Scene { at: at.to_owned(), source })?;
        if more_memory {
            admission::method(&built.scene, at)?;
        }
        if !Arc::ptr_eq(&built.assets.volume, &self.built.assets.volume) {
            count_values(&built.assets.volume, &self.options);
        }
        let to_scene = begun.elapsed();
        let difference = self.session.set_scene(built.scene.clone());
        let known = notes_of(&self.built.scene);
        let notes = notes_of(&built.scene).into_iter().filter(|note| !known.contains(note)).collect();
        (self.value, self.built) = (value, built);
        Ok(EditReport { difference, notes, to_scene })
    }

    /// The document of a value, with its assets; those that the current document also has are shared.
    fn parse(&self, value: Value, at: &str) -> Result<(Document, Assets), LiveError> {
        let mut document = Document::from_value(value)
            .map_err(|source| LiveError::Document { at: at.to_owned(), source })?;
        let before = (&self.built.document, &self.built.assets);
        let assets = assets::reload(&mut document, &self.folder, before, &self.options.threads)
            .map_err(|source| LiveError::Asset { at: at.to_owned(), source: Box::new(source) })?;
        Ok((document, assets))
    }

    /// Renders until the budget is spent, see [`Session::refine`].
    pub fn refine(&mut self, budget: &Budget) -> Progress {
        self.session.refine(budget)
    }

    /// The picture so far.
    #[must_use]
    pub fn image(&self) -> Image {
        self.session.image()
    }

    /// Brings a viewer's picture up to date, toned as the document says; see [`Viewer::look`].
    pub fn look(&self, viewer: &mut Viewer, picture: &mut Vec<[u8; 3]>) {
        let film = &self.document().film;
        let tone = match film.exposure {
            Exposure::Auto => film.shown(&self.image()),
            Exposure::Stops(stops) => film.shown_at(stops),
        };
        self.session.look(viewer, tone, picture);
    }

    /// Continues with the samples of another film of the same scene, see [`Session::go_on_with`].
    ///
    /// # Errors
    /// [`LiveError::Memory`] if there is too little memory for the samples that are still to come.
    ///
    /// # Panics
    /// If its size is not that of the scene.
    pub fn go_on_with(&mut self, film: Film) -> Result<(), LiveError> {
        admission::film(self.document(), film.first(), "scene")?;
        self.session.go_on_with(film);
        Ok(())
    }

    /// What the samples depend on; hashes all voxels.
    #[must_use]
    pub fn identity(&self) -> SceneIdentity {
        let Built { document, assets, .. } = &self.built;
        self.options.threads.install(|| SceneIdentity::new(document, assets))
    }

    /// The film so far.
    #[must_use]
    pub fn film(&self) -> &Film {
        self.session.film()
    }

    /// The scene that is rendered.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        self.session.scene()
    }

    /// The document, with every default filled in.
    #[must_use]
    pub fn document(&self) -> &Document {
        &self.built.document
    }

    /// The document as it was written and edited; if no edits were expected, with every default filled in.
    #[must_use]
    pub fn value(&self) -> Cow<'_, Value> {
        if self.value.is_null() { Cow::Owned(self.document().to_value()) } else { Cow::Borrowed(&self.value) }
    }

    /// The folder that the document's paths are relative to.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What the volume's source contained besides the volume.
    #[must_use]
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// Notes for the user on the scene as it was opened, a sentence each.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The renderer's session, for its counters.
    #[must_use]
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// What was computed since the last edit, or since the start, and what is kept for later edits.
    #[must_use]
    pub fn report(&self) -> MethodReport {
        self.session.report()
    }
}

/// Counts the values of a new volume, as part of loading it: methods whose light is kept through edits need the counts, and would
/// take them in the middle of a time slice.
fn count_values(volume: &Volume, options: &Options) {
    if options.edits {
        options.threads.install(|| {
            let _counted = volume.value_bin_histogram();
        });
    }
}

fn session_of(scene: &Scene, options: &Options) -> Session {
    let edit_memory = if options.edits { admission::for_edits() } else { 0 };
    let resources = Resources { level: options.level, edit_memory };
    Session::with_resources(scene.clone(), options.threads.clone(), resources)
}

/// Notes for the user on a scene.
fn notes_of(scene: &Scene) -> Vec<String> {
    let of_method = method_of(&scene.render.method).notes(scene);
    scene.notes().into_iter().chain(of_method).map(str::to_owned).collect()
}
