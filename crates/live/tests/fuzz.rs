//! Random damage to scene documents, patches and assignments: a result or an error, never a panic, a hang, excessive
//! memory, or a picture with non-finite numbers.
//!
//! By default each test runs for two seconds; `BOLERO_RANDOM_TEST_TIME_MS` makes it longer. A failure prints the
//! smallest damage that causes it and a seed, with which `BOLERO_RANDOM_SEED` reproduces it.

mod scene_damage;

use bolero::{TypeGenerator, check};
use scene_damage::{Change, seeds, words};
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};
use std::time::Duration;
use tyndall::light::Map;
use tyndall::math::Rgb;
use tyndall::session::{Budget, Session};
use tyndall::volume::procedural::{Field, Kind};
use tyndall::volume::{Grid, Space, ValueMap, Volume, Voxels};
use tyndall_live::document::{Document, apply, set, value_from_json, value_from_toml};
use tyndall_live::{Assets, Built, assets};
use tyndall_testing::damage::{Edit, NUMBERS};
use tyndall_testing::within_limits;

/// How long each test runs unless the environment says otherwise.
const USUALLY: Duration = Duration::from_secs(2);

static THREADS: LazyLock<Arc<rayon::ThreadPool>> =
    LazyLock::new(|| Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread")));

/// Small volumes of several kinds: fields, anatomical and flat, a single voxel, a vast and a tiny one, signed numbers.
static VOLUMES: LazyLock<Vec<Arc<Volume>>> = LazyLock::new(|| {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let turned = [[0.0, 0.0, -1.0], [0.8, 0.6, 0.0], [0.6, -0.8, 0.0]];
    let make = |dims, spacing, direction, space, voxels| {
        let grid = Grid::new(dims, spacing, direction, [1.0, -2.0, 3.0], space).expect("a grid");
        Volume::new(grid, voxels, ValueMap { slope: 2.0, intercept: -1.0 }).expect("a volume")
    };
    let ramp = || Voxels::U8((0..24).collect());
    let signed = Voxels::F32((0..24_i16).map(|v| f32::from(v - 9) * 100.0).collect());
    [
        Field::new(Kind::Cloud, [6, 5, 4], 0).volume().expect("a field"),
        Field::new(Kind::Sphere, [4, 4, 4], 0).volume().expect("a field"),
        make([4, 3, 2], [0.5, 1.0, 3.0], turned, Space::Anatomical, ramp()),
        make([1, 1, 1], [1.0; 3], identity, Space::Plain, Voxels::I16(vec![7])),
        make([4, 3, 2], [1e6; 3], identity, Space::Plain, ramp()),
        make([4, 3, 2], [1e-6; 3], identity, Space::Plain, ramp()),
        make([2, 3, 4], [1.0, 2.0, 0.01], turned, Space::Anatomical, signed),
    ]
    .map(Arc::new)
    .into()
});

static MAP: LazyLock<Arc<Map>> = LazyLock::new(|| {
    let texels = (0..8_u8).map(|i| Rgb::new(f32::from(i), 1.0, 0.0)).collect();
    Arc::new(Map::new(4, 2, texels).expect("a map"))
});

/// A scene document as a user might type it, errors included.
#[derive(TypeGenerator)]
struct Scribble {
    seed: u8,
    #[generator(bolero::generator::produce_with::<Vec<Change>>().len(0..5_usize))]
    changes: Vec<Change>,
    json: bool,
    #[generator(bolero::generator::produce_with::<Vec<Edit>>().len(0..3_usize))]
    edits: Vec<Edit>,
    volume: u8,
}

impl Scribble {
    /// The text after all changes.
    fn text(&self) -> Option<String> {
        let value = changed(self.seed, &self.changes);
        let text = if self.json { value.to_string() } else { toml::to_string(&value).ok()? };
        let mut bytes = text.into_bytes();
        self.edits.iter().for_each(|edit| edit.apply(&mut bytes, words()));
        Some(String::from_utf8_lossy(&bytes).into_owned())
    }

    fn volume(&self) -> Arc<Volume> {
        VOLUMES[usize::from(self.volume) % VOLUMES.len()].clone()
    }
}

/// Shows the scene itself, which is more use than how it was generated.
impl std::fmt::Debug for Scribble {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let volume = usize::from(self.volume) % VOLUMES.len();
        write!(f, "over volume {volume}:\n{}", self.text().unwrap_or_default())
    }
}

/// A patch to a document, and an assignment to the result.
#[derive(Debug, TypeGenerator)]
struct Correction {
    document: u8,
    #[generator(bolero::generator::produce_with::<Vec<Change>>().len(0..5_usize))]
    changes: Vec<Change>,
    patch: u8,
    #[generator(bolero::generator::produce_with::<Vec<Change>>().len(0..5_usize))]
    more: Vec<Change>,
    #[generator(bolero::generator::produce_with::<Vec<u32>>().len(0..5_usize))]
    path: Vec<u32>,
    number: u8,
}

/// A seed document after changes.
fn changed(seed: u8, changes: &[Change]) -> Value {
    let mut value = seeds()[usize::from(seed) % seeds().len()].clone();
    changes.iter().for_each(|change| change.apply(&mut value));
    value
}

/// Reads, builds and renders a scene; on a refusal returns its message.
fn try_scene(text: &str, json: bool, volume: Arc<Volume>) -> Result<(), String> {
    let value = if json { value_from_json(text) } else { value_from_toml(text) };
    let value = value.map_err(|e| helpful(&e))?;
    let document = Document::from_value(value).map_err(|e| helpful(&e))?;
    let again = Document::from_value(document.to_value()).expect("a document of a document");
    assert_eq!(document, again, "written and read again");

    let mut document = document;
    // Slow is not broken: settings that a user may choose large are kept small here.
    document.film.size = [4, 4];
    document.render.max_scatter = document.render.max_scatter.min(50);
    document.render.draft();
    let names = ["map.exr", "a.hdr"].map(|name| (name.to_owned(), MAP.clone()));
    let studios = assets::studios(&document, &[]).map_err(|e| helpful(&e))?;
    let assets = Assets { volume, maps: BTreeMap::from(names), studios };
    let scene = Built::new(document, assets, &THREADS).map_err(|e| helpful(&e))?.scene;
    let mut session = Session::new(scene, THREADS.clone());
    session.refine(&Budget::samples(2));
    let image = session.film().image();
    let finite = image.rgba.iter().flatten().chain(image.variance.iter().flatten()).all(|x| x.is_finite());
    assert!(finite, "{:?} {:?}", image.rgba, image.variance);
    assert!(session.film().mean_radiance().iter().all(|x| x.is_finite()));
    Ok(())
}

/// The error's message, checked to be readable.
fn helpful(error: &dyn std::fmt::Display) -> String {
    let message = error.to_string();
    assert!(!message.is_empty() && message.len() < 8000, "{message}");
    assert!(!message.chars().any(|c| c.is_control() && c != '\n'), "{message:?}");
    message
}

#[test]
fn seeds_are_scenes() {
    for (i, seed) in seeds().iter().enumerate() {
        for volume in VOLUMES.iter() {
            let json = try_scene(&seed.to_string(), true, volume.clone());
            assert!(json.as_ref().err().is_none_or(|e| e.contains("density")), "seed {i}: {json:?}");
            let text = toml::to_string(seed).expect("TOML");
            assert_eq!(try_scene(&text, false, volume.clone()), json, "seed {i}");
        }
    }
}

#[test]
fn a_damaged_scene_is_refused_or_rendered() {
    check!().with_type::<Scribble>().with_test_time(USUALLY).with_iterations(usize::MAX).for_each(
        |scribble| {
            let Some(text) = scribble.text() else { return };
            // A refusal is as good as a picture.
            let _ = within_limits(|| try_scene(&text, scribble.json, scribble.volume()));
        },
    );
}

#[test]
fn any_patch_and_any_assignment_leave_a_value() {
    check!().with_type::<Correction>().with_test_time(USUALLY).with_iterations(usize::MAX).for_each(
        |correction| {
            let Correction { document, changes, patch, more, path, number } = correction;
            let (value, patch) = (changed(*document, changes), changed(*patch, more));
            let parts: Vec<_> = path.iter().map(|&word| words()[word as usize % words().len()]).collect();
            let assignment = format!("{}={}", parts.join("."), NUMBERS[usize::from(*number) % NUMBERS.len()]);
            within_limits(|| {
                let mut value = apply(&value, &patch);
                let _ = Document::from_value(value.clone()).map_err(|e| helpful(&e));
                let _ = set(&mut value, &assignment).map_err(|e| helpful(&e));
                let _ = Document::from_value(value).map_err(|e| helpful(&e));
            });
        },
    );
}
