//! Tests of every method in the list, including the one for tests.

use super::{Budget, Session};
use crate::camera::{AutoView, FitLens, fit};
use crate::film::Image;
use crate::integrator::{DEFAULT_METHOD, METHODS, Resources, method_named, method_of};
use crate::light::{Directional, Light, LightSet};
use crate::math::{Rgb, Vec3};
use crate::medium::{Medium, MediumSettings};
use crate::scene::{Background, MethodChoice, RenderSettings, Scene};
use crate::simd::Level;
use crate::transfer::{Optics, Point, TransferFunction};
use crate::volume::Volume;
use crate::volume::procedural::{Field, Kind};
use schemars::SchemaGenerator;
use serde_json::Value;
use std::sync::{Arc, LazyLock};

static THREADS: LazyLock<Arc<rayon::ThreadPool>> =
    LazyLock::new(|| Arc::new(rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads")));

/// The same voxels in every scene, so that an edit does not restart because they changed.
static VOLUME: LazyLock<Arc<Volume>> =
    LazyLock::new(|| Arc::new(Field::new(Kind::Cloud, [12, 11, 10], 1).volume().expect("a field")));

fn scene(method: MethodChoice, density: f32) -> Scene {
    let volume = VOLUME.clone();
    let point = |value, opacity| Point { value, optics: Optics { opacity, ..Optics::default() } };
    let points = vec![point(0.1, 0.0), point(0.9, 1.0)];
    let transfer = Arc::new(TransferFunction::over(volume.value_bins(), points).expect("a function"));
    let settings = MediumSettings::plain(density);
    let lens = FitLens::Perspective { fov: 35.0, aperture: 0.0, focus: None };
    let size = [18, 17];
    let camera = fit(volume.grid(), AutoView::default_for(volume.grid().space()), None, lens, size);
    let medium = Medium::new(volume, transfer, &settings);
    let sun = Light::Directional(Directional::new(Vec3::NEG_Y, Rgb::WHITE, 1.0));
    Scene {
        light_names: vec![None],
        lights: Arc::new(LightSet::new(vec![sun], &medium)),
        medium: Arc::new(medium),
        camera,
        size,
        background: Background::Environment,
        render: RenderSettings { method, max_scatter: 2, seed: 0 },
    }
}

fn refined(session: &mut Session) -> Image {
    session.refine(&Budget::samples(2));
    session.image()
}

fn started(scene: &Scene) -> Session {
    let resources = Resources { level: Level::best(), edit_memory: 1 << 20 };
    Session::with_resources(scene.clone(), THREADS.clone(), resources)
}

#[test]
fn every_method_is_found_by_its_name_and_explains_itself() {
    assert!(method_named(DEFAULT_METHOD.name).is_some());
    for method in METHODS {
        let choice = method.default_settings();
        assert_eq!(method_of(&choice).name, method.name);
        assert!(method.about.ends_with('.') && method.about.len() > 20, "{}", method.about);
        assert!(method.check(&choice).is_ok() && method.check(&method.draft(&choice)).is_ok());
        let written = method.write(&choice).expect("its own settings");
        assert_eq!(method.read(written.clone()).expect("what it wrote"), choice);
        let keys = written.as_object().expect("a table");
        let mut generator = SchemaGenerator::default();
        let schema = method.schema(&mut generator).to_value();
        let name = schema["$ref"].as_str().and_then(|way| way.rsplit('/').next()).expect("a definition");
        let properties = &generator.definitions()[name]["properties"];
        for key in keys.keys() {
            assert!(properties[key]["description"].is_string(), "{}: `{key}` is not explained", method.name);
        }
        assert!(method.read(serde_json::json!({ "no_such": 1 })).is_err());
        let others = METHODS.iter().filter(|other| other.name != method.name);
        assert!(others.map(|other| other.write(&choice)).all(|written: Option<Value>| written.is_none()));
    }
}

/// After a switch from any method to any other, and after an edit, the picture equals that of a new session.
#[test]
fn every_method_follows_every_other() {
    let drafts = || METHODS.iter().map(|method| method.draft(&method.default_settings()));
    for from in drafts() {
        for to in drafts() {
            let mut session = started(&scene(from.clone(), 1.0));
            refined(&mut session);
            for density in [1.0, 2.0] {
                let next = scene(to.clone(), density);
                session.set_scene(next.clone());
                let found = refined(&mut session);
                assert!(found == refined(&mut started(&next)), "{from:?}, then {to:?}");
                let shares = session.recomputed();
                assert!(shares.iter().all(|work| (0.0..=1.0).contains(&work.share)), "{shares:?}");
            }
        }
    }
}

/// Budgets count samples of pixels: where a slice stops does not depend on threads.
#[test]
fn a_slice_takes_no_more_samples_than_its_budget() {
    let one = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread"));
    for method in METHODS {
        let scene = scene(method.draft(&method.default_settings()), 1.0);
        let resources = Resources { level: Level::best(), edit_memory: 0 };
        let mut sessions =
            [&THREADS, &one].map(|pool| Session::with_resources(scene.clone(), pool.clone(), resources));
        let mut all = 0;
        for most in [0, 1, 100, 300, 5, 1000] {
            let budget = Budget { pixel_samples: Some(most), ..Budget::samples(3) };
            let [progress, alone] = sessions.each_mut().map(|session| session.refine(&budget));
            assert_eq!(progress, alone, "{}", method.name);
            let taken = progress.pixel_samples - all;
            all = progress.pixel_samples;
            // At least one turn of a tile, of which there are four: a stage of the first pass, or a whole pass.
            assert!(
                taken <= most.max(256) && (taken > 0 || most == 0 || progress.samples == 3),
                "{taken} of {most}"
            );
        }
        let [found, alone] = sessions.each_mut().map(refined);
        assert!(found == alone && sessions[0].progress().pixel_samples == sessions[0].film().pixel_samples());
    }
}
