//! The measured scenes, all generated.

use crate::Failure;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;
use tyndall::integrator::Resources;
use tyndall::scene::Scene;
use tyndall::session::{Budget, Session};
use tyndall::simd::Level;
use tyndall_live::document::{self, Document};
use tyndall_live::{Assets, Built, Input, LoadedScene, Options, assets};

/// A mostly empty volume with a thin dense shell, as CT is; 8-bit.
pub fn ct(voxels: u32) -> Value {
    let clear = |value: f64| json!({ "value": value, "opacity": 0.0 });
    let dense = |value: f64| json!({ "value": value, "opacity": 1.0, "albedo": [0.9, 0.85, 0.8] });
    json!({
        "version": 1,
        "volume": { "procedural": { "kind": "shells", "size": [voxels, voxels, voxels] } },
        "transfer_function": { "points": [clear(0.19), dense(0.25), clear(0.31)] },
        "medium": { "density": 60.0 / f64::from(voxels) },
        "lights": [{ "type": "directional", "direction": [1, -1, -1], "irradiance": [3, 3, 3] },
                   { "type": "environment", "radiance": [0.3, 0.3, 0.35] }],
    })
}

/// A soft cloud that fills much of its box.
pub fn cloud(voxels: u32) -> Value {
    json!({
        "version": 1,
        "volume": { "procedural": { "kind": "cloud", "size": [voxels, voxels, voxels] } },
        "transfer_function": { "points": [{ "value": 0.0, "opacity": 0.0, "albedo": [0.99, 0.99, 0.99] },
                                          { "value": 1.0, "opacity": 1.0, "albedo": [0.99, 0.99, 0.99] }] },
        "medium": { "density": 60.0 / f64::from(voxels) },
        "lights": [{ "type": "directional", "direction": [1, -1, -1], "irradiance": [3, 3, 3] },
                   { "type": "environment", "radiance": [0.3, 0.3, 0.35] }],
    })
}

/// A document with its volume, from which scenes are built that differ in other keys.
pub struct Bench {
    value: Value,
    assets: Assets,
    threads: Arc<rayon::ThreadPool>,
}

impl Bench {
    /// Generates the volume.
    pub fn new(value: Value, threads: usize) -> Result<Self, Failure> {
        let threads = pool(threads)?;
        let mut document = Document::from_value(value.clone()).map_err(Failure::input)?;
        let (assets, _) =
            threads.install(|| assets::load(&mut document, Path::new(""))).map_err(Failure::input)?;
        Ok(Self { value, assets, threads })
    }

    /// A bare file, with all that is then chosen for it, patched.
    pub fn of_file(file: &Path, patch: &Value, threads: usize, level: Level) -> Result<Self, Failure> {
        let threads = pool(threads)?;
        let mut input = Input::open(file).map_err(Failure::input)?;
        input.patch(patch).map_err(Failure::input)?;
        let options = Options { threads: threads.clone(), level, edits: false };
        let LoadedScene { document, assets, .. } = input.load(&options).map_err(Failure::input)?;
        Ok(Self { value: document.to_value(), assets, threads })
    }

    /// The scene of the patched document.
    pub fn scene(&self, patch: &Value) -> Result<Scene, Failure> {
        let document = Document::from_value(document::apply(&self.value, patch)).map_err(Failure::input)?;
        let built = Built::new(document, self.assets.clone(), &self.threads);
        Ok(built.map_err(Failure::input)?.scene)
    }

    /// The threads that it renders on.
    pub fn threads(&self) -> &Arc<rayon::ThreadPool> {
        &self.threads
    }

    /// Renders a scene from nothing.
    pub fn render(&self, scene: &Scene, level: Level, samples: u32) -> Session {
        self.render_for_edits(scene, level, samples, 0)
    }

    /// The same, and keeps as many bytes as this for edits.
    pub fn render_for_edits(&self, scene: &Scene, level: Level, samples: u32, bytes: usize) -> Session {
        let resources = Resources { level, edit_memory: bytes };
        let mut session = Session::with_resources(scene.clone(), self.threads.clone(), resources);
        session.refine(&Budget::samples(samples));
        session
    }
}

fn pool(threads: usize) -> Result<Arc<rayon::ThreadPool>, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map(Arc::new);
    pool.map_err(|e| Failure::input(format!("threads: {e}")))
}
