//! Builds the scene from a checked document. What the document leaves open is chosen here to suit the volume.

use crate::assets::Assets;
use crate::document::{self, Document};
use crate::lights::{default_lights, follow_camera, lights_of};
use crate::scene_error::{SceneError, fault};
use rayon::ThreadPool;
use std::ops::RangeInclusive;
use std::sync::Arc;
use tyndall::camera::{AutoFront, AutoView, Camera, FitLens, Lens, fit};
use tyndall::light::{Emission, LightSet};
use tyndall::math::{Bounds, DVec3, Frame, Vec3, cast};
use tyndall::medium::{ClipShape, Medium, MediumSettings};
use tyndall::message::excerpt;
use tyndall::scattering::{Abc, Brdf, HenyeyGreenstein, Phase, Schlick};
use tyndall::scene::{Background, RenderSettings, Scene};
use tyndall::transfer::{Optics, PRESETS, Point, Preset, TransferFunction};
use tyndall::volume::{Grid, Volume};

/// Optical thickness of a voxel beyond which single precision can no longer distinguish the positions of collisions.
const DENSEST: f32 = 1000.0;

/// Positions farther from the volume's centre than this leave no headroom in single precision.
const FARTHEST: f32 = 1e18;

/// Distances of a camera from its target whose squares single precision holds.
const DISTANCES: RangeInclusive<f64> = 1e-15..=1e15;

/// A scene with what it was built from. An edited scene shares everything that the edit did not change.
#[derive(Clone, Debug)]
pub struct Built {
    /// The document.
    pub document: Document,
    /// The assets that it refers to.
    pub assets: Assets,
    /// The scene.
    pub scene: Scene,
}

impl Built {
    /// Builds the scene of a document, in parallel on a thread pool.
    ///
    /// # Errors
    /// [`SceneError`] for problems that the document's check cannot find without the volume: an unknown preset, a view
    /// that defines no camera frame, a missing map.
    pub fn new(document: Document, assets: Assets, threads: &ThreadPool) -> Result<Self, SceneError> {
        let scene = build(&document, &assets, None, threads)?;
        Ok(Self { document, assets, scene })
    }

    /// Builds the scene of an edited document. What the edit did not change is shared, so that an edit costs only what
    /// it changes; the scene equals that of [`Self::new`] bit for bit.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn edited(
        &self,
        document: Document,
        assets: Assets,
        threads: &ThreadPool,
    ) -> Result<Self, SceneError> {
        let scene = build(&document, &assets, Some(self), threads)?;
        Ok(Self { document, assets, scene })
    }
}

fn build(
    document: &Document,
    assets: &Assets,
    before: Option<&Built>,
    threads: &ThreadPool,
) -> Result<Scene, SceneError> {
    let volume = &assets.volume;
    let same_volume = before.filter(|before| Arc::ptr_eq(&before.assets.volume, volume));
    let medium = medium(document, volume, same_volume, threads)?;
    let camera = camera(document, volume)?;
    Ok(Scene {
        light_names: light_names(document, volume),
        lights: lights(document, assets, &medium, &camera, same_volume, threads)?,
        medium,
        camera,
        size: document.film.size,
        background: background(document),
        render: RenderSettings {
            method: document.render.method().clone(),
            max_scatter: document.render.max_scatter,
            seed: document.render.seed,
        },
    })
}

/// The medium; the parts that an edit did not change are shared with the scene before it.
fn medium(
    document: &Document,
    volume: &Arc<Volume>,
    before: Option<&Built>,
    threads: &ThreadPool,
) -> Result<Arc<Medium>, SceneError> {
    let same_transfer = before.filter(|b| b.document.transfer_function == document.transfer_function);
    let same =
        same_transfer.filter(|b| b.document.medium == document.medium && b.document.clip == document.clip);
    if let Some(before) = same {
        return Ok(before.scene.medium.clone());
    }
    let thinnest = volume.grid().spacing().into_iter().fold(f64::INFINITY, f64::min);
    let per_voxel = document.medium.density * cast::single(thinnest);
    if per_voxel > DENSEST {
        let problem = format!(
            "{} gives an optical thickness of {per_voxel:e} per voxel; expected at most {DENSEST}, which \
             is opaque within a thousandth of a voxel: lower the density or give the true spacing",
            document.medium.density
        );
        return Err(fault("medium.density", problem));
    }
    let transfer = match same_transfer {
        Some(before) => before.scene.medium.shared_transfer().clone(),
        None => Arc::new(threads.install(|| transfer(document, volume))?),
    };
    let settings = medium_settings(document, volume.grid())?;
    let old = before.map(|before| &*before.scene.medium);
    let build = || Medium::after(old, volume.clone(), transfer, &settings);
    // If the majorants are shared, handing over to other threads would take longer than the edit.
    let cell = document.medium.majorant_cell;
    let shares_majorants = same_transfer.is_some_and(|b| b.document.medium.majorant_cell == cell);
    Ok(Arc::new(if shares_majorants { build() } else { threads.install(build) }))
}

/// The lights and the matter's emission; the parts that an edit did not change are shared with the scene before it.
fn lights(
    document: &Document,
    assets: &Assets,
    medium: &Medium,
    camera: &Camera,
    before: Option<&Built>,
    threads: &ThreadPool,
) -> Result<Arc<LightSet>, SceneError> {
    let same_lights = before.filter(|b| {
        let same_axes = || b.scene.camera.frame() == camera.frame() || !follow_camera(&document.lights);
        b.document.lights == document.lights && b.assets.shares_maps(assets) && same_axes()
    });
    let same_matter = before.filter(|b| b.scene.medium.shares_matter(medium));
    if let (Some(before), Some(_)) = (same_lights, same_matter)
        && before.scene.medium.density().to_bits() == medium.density().to_bits()
    {
        return Ok(before.scene.lights.clone());
    }
    let lights = match (same_lights, &document.lights) {
        (Some(before), _) => before.scene.lights.lights().to_vec(),
        (None, None) => default_lights(medium.volume().grid()),
        (None, Some(lights)) => lights_of(lights, medium.volume().grid(), camera, assets)?,
    };
    let emission = || Emission::after(same_matter.and_then(|b| b.scene.lights.emission()), medium);
    let emission = if medium.transfer().emits() { threads.install(emission) } else { None };
    Ok(Arc::new(LightSet::with_emission(lights, medium, emission)))
}

fn light_names(document: &Document, volume: &Volume) -> Vec<Option<String>> {
    match &document.lights {
        None => vec![None; default_lights(volume.grid()).len()],
        Some(lights) => lights.iter().map(|light| light.name().map(str::to_owned)).collect(),
    }
}

fn transfer(document: &Document, volume: &Volume) -> Result<TransferFunction, SceneError> {
    let given = document.transfer_function.as_ref();
    told_apart(document, volume)?;
    let points = if let Some(points) = given.and_then(|t| t.points.as_ref()) {
        points.iter().map(point).collect()
    } else if let Some(name) = given.and_then(|t| t.preset.as_ref()) {
        let preset = Preset::named(name).ok_or_else(|| {
            let known = PRESETS.map(|p| p.name).join(", ");
            fault("transfer_function.preset", format!("no preset `{}`; known are {known}", excerpt(name)))
        })?;
        preset.points(volume).map_err(|e| fault("transfer_function.preset", e))?
    } else {
        Preset::for_field(volume).points(volume).map_err(|e| fault("transfer_function", e))?
    };
    TransferFunction::for_volume(volume, points).map_err(|e| fault("transfer_function.points", e))
}

/// Refuses a function whose values become one in single precision although the data may tell them apart.
fn told_apart(document: &Document, volume: &Volume) -> Result<(), SceneError> {
    let refusal = |key: &str, values: &[f64]| {
        let values = values.iter().map(f64::to_string).collect::<Vec<_>>().join(" and ");
        let problem = format!(
            "{values} are the same number in single precision, in which volumes are rendered; expected values that differ there: \
             subtract an offset from the data, or number the labels anew"
        );
        fault(key, problem)
    };
    let is_one = |pair: &[f64]| cast::single(pair[0]) == cast::single(pair[1]);
    let given = document.transfer_function.as_ref();
    let values: Vec<f64> =
        given.and_then(|t| t.points.as_ref()).into_iter().flatten().map(|p| p.value).collect();
    // Two points that become one are a jump, which is what they were to be, unless there may be data between them.
    let mut pairs = values.windows(2).enumerate().filter(|_| volume.exceeds_single());
    if let Some((i, pair)) = pairs.find(|(_, pair)| pair[0] < pair[1] && is_one(pair)) {
        return Err(refusal(&format!("transfer_function.points.{}.value", i + 1), pair));
    }
    let preset = given.and_then(|t| t.preset.as_deref()).and_then(Preset::named);
    let labels = preset.filter(|preset| preset.shows_labels()).and_then(|_| volume.whole_values());
    match labels.and_then(|labels| labels.windows(2).find(|pair| is_one(pair))) {
        Some(pair) => Err(refusal("transfer_function.preset", pair)),
        None => Ok(()),
    }
}

fn point(p: &document::TransferPoint) -> Point {
    let optics = Optics {
        opacity: p.opacity,
        albedo: p.albedo.into(),
        emission: p.emission.into(),
        surface: p.surface,
        specular: p.specular.into(),
        roughness: p.roughness,
        ior: p.ior,
    };
    Point { value: cast::single(p.value), optics }
}

fn medium_settings(document: &Document, grid: &Grid) -> Result<MediumSettings, SceneError> {
    let phase = match document.medium.phase {
        document::Phase::Isotropic => Phase::Isotropic,
        document::Phase::HenyeyGreenstein { g } => {
            Phase::HenyeyGreenstein(HenyeyGreenstein::new(g).map_err(|e| fault("medium.phase.g", e))?)
        }
        document::Phase::Schlick { k } => {
            Phase::Schlick(Schlick::new(k).map_err(|e| fault("medium.phase.k", e))?)
        }
    };
    let brdf = match document.medium.brdf {
        document::Brdf::Lambert => Brdf::Lambert,
        document::Brdf::AshikhminShirley => Brdf::AshikhminShirley,
        document::Brdf::Abc { b, c } => Brdf::Abc(Abc::new(b, c).map_err(|e| fault("medium.brdf", e))?),
    };
    let clip = document.clip.iter().map(|clip| match *clip {
        document::Clip::Plane { point, normal, .. } => {
            ClipShape::Plane { point: grid.to_world(point), normal: normal.into() }
        }
        document::Clip::Box { min, max, .. } => {
            ClipShape::Box(Bounds::new(grid.to_world(min), grid.to_world(max)))
        }
    });
    Ok(MediumSettings {
        density: document.medium.density,
        phase,
        brdf,
        gradient_factor: document.medium.gradient_factor,
        gradient_range: document.medium.gradient_range,
        clip: clip.collect(),
        majorant_cell: document.medium.majorant_cell as usize,
    })
}

fn camera(document: &Document, volume: &Volume) -> Result<Camera, SceneError> {
    let grid = volume.grid();
    let given = document.camera.clone().unwrap_or_default();
    let up = given.up().map(Vec3::from_array);
    let Some(given_position) = given.position() else {
        let auto = given.auto();
        // Whoever gives an angle gives it from the front of the space.
        let is_open = auto.azimuth.is_none() && auto.elevation.is_none();
        let usual = if is_open { AutoFront::of(grid).view } else { AutoView::default_for(grid.space()) };
        let view = AutoView {
            azimuth: auto.azimuth.unwrap_or(usual.azimuth),
            elevation: auto.elevation.unwrap_or(usual.elevation),
            zoom: auto.zoom,
        };
        let lens = match given {
            document::Camera::Perspective { fov, aperture, focus, .. } => {
                FitLens::Perspective { fov, aperture, focus }
            }
            document::Camera::Orthographic { height, .. } => FitLens::Orthographic { height },
        };
        let camera = fit(grid, view, up, lens, document.film.size);
        let position = camera.position();
        if !position.is_finite() || position.length() > FARTHEST {
            let distance = position.length();
            let problem =
                format!("the volume fits only from {distance:e} away; expected a wider field of view");
            return Err(fault("camera.fov", problem));
        }
        return Ok(camera);
    };
    let (position, given_target) = (grid.to_world(given_position), given.target().unwrap_or(grid.center()));
    let target = grid.to_world(given_target);
    let view = target - position;
    let distance = DVec3::from_array(given_position).distance(DVec3::from_array(given_target));
    let problem = if distance == 0.0 {
        Some("is also the target; expected two positions: move one of them".to_owned())
    } else if !DISTANCES.contains(&distance) {
        let [least, most] = [DISTANCES.start(), DISTANCES.end()];
        Some(format!("is {distance:e} from the target; expected {least:e} to {most:e}: move one of them"))
    } else if view.length() <= 1e-6 * position.length() {
        Some(format!(
            "is {distance:e} from the target, too little to be seen in single precision so far from the volume; \
             expected them farther apart or nearer to the volume"
        ))
    } else {
        None
    };
    if let Some(problem) = problem {
        return Err(fault("camera.position", format!("{given_position:?} {problem}")));
    }
    let up = up.unwrap_or_else(|| {
        let up = grid.space().up();
        // In a view straight along the world's up, any direction across the view can be up.
        if up.cross(view).length() > 1e-3 * view.length() { up } else { Frame::around(up).v }
    });
    if up.cross(view).length() <= 1e-6 * up.length() * view.length() {
        let problem = format!("{up} is along the view {view}; expected another direction");
        return Err(fault("camera.up", problem));
    }
    let lens = match given {
        document::Camera::Perspective { fov, aperture, focus, .. } => {
            Lens::Perspective { fov, aperture, focus: focus.unwrap_or_else(|| view.length()) }
        }
        document::Camera::Orthographic { height, .. } => {
            Lens::Orthographic { height: height.unwrap_or_else(|| grid.diagonal()) }
        }
    };
    Ok(Camera::new(position, target, up, lens))
}

fn background(document: &Document) -> Background {
    match document.film.background {
        document::Background::Environment => Background::Environment,
        document::Background::Transparent => Background::Transparent,
        document::Background::Color(color) => Background::Color(color.into()),
    }
}
