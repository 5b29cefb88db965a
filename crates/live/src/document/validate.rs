//! Checks that a schema cannot express: how the values of a document must fit together.

use super::error::{DocumentError, Problem, Problems, join};
use super::{Camera, Clip, Document, Film, Light, TransferPoint};
use tyndall::math::{DVec3, cast};

/// Most pixels of a film; whether they fit in memory is checked later.
const MOST_PIXELS: u64 = 1 << 28;

/// # Errors
/// [`DocumentError::Content`] with every problem, up to a limit.
pub(super) fn validate(document: &Document) -> Result<(), DocumentError> {
    let mut problems = Problems::default();
    let points = document.transfer_function.as_ref().and_then(|function| function.points.as_deref());
    validate_points(points.unwrap_or_default(), &mut problems);
    for (i, light) in document.lights.iter().flatten().enumerate() {
        validate_light(light, &join("lights", i), &mut problems);
    }
    if let Some(camera) = &document.camera {
        validate_camera(camera, &mut problems);
    }
    validate_film(&document.film, &mut problems);
    for (method, settings) in document.render.tables() {
        if let Err(problem) = method.check(settings) {
            let path = format!("render.{}.{}", method.table(), problem.key);
            problems.push(Problem::new(path, problem.found, problem.expected));
        }
    }
    for (i, clip) in document.clip.iter().enumerate() {
        validate_clip(clip, &join("clip", i), &mut problems);
    }
    problems.into_result()
}

fn validate_points(points: &[TransferPoint], problems: &mut Problems) {
    let path = |i: usize| format!("transfer_function.points.{i}.value");
    for (i, pair) in points.windows(2).enumerate() {
        let [before, here] = [&pair[0], &pair[1]].map(|point| point.value);
        if here < before {
            let problem = Problem::new(path(i + 1), format!("{here} after {before}"), "ascending values");
            problems.push(problem.with_fix("order the points by value"));
        }
    }
    for (i, triple) in points.windows(3).enumerate() {
        let here = triple[2].value;
        // As the renderer holds values: in single precision.
        if triple.iter().all(|point| cast::single(point.value) == cast::single(here)) {
            let [a, b] = [triple[0].value, triple[1].value];
            let found = if a == here {
                format!("a third point at {here}")
            } else {
                format!("{a}, {b} and {here}, which are one number in single precision")
            };
            let problem = Problem::new(path(i + 2), found, "at most two points at one value (a jump)");
            problems.push(problem.with_fix("keep only the first and the last point at that value"));
        }
    }
}

fn validate_light(light: &Light, path: &str, problems: &mut Problems) {
    match light {
        Light::Directional { direction, .. } => {
            require_direction(*direction, &join(path, "direction"), problems);
        }
        Light::Rect { position, target, up, .. } => {
            require_view(*position, *target, *up, path, problems);
        }
        Light::Disk { position, target, .. } => require_view(*position, *target, None, path, problems),
        Light::Point { .. } | Light::Sphere { .. } | Light::Environment { .. } => {}
    }
}

fn validate_camera(camera: &Camera, problems: &mut Problems) {
    match (camera.position(), camera.target(), camera.up()) {
        (Some(position), Some(target), up) => require_view(position, target, up, "camera", problems),
        (_, _, Some(up)) => require_direction(up, "camera.up", problems),
        _ => {}
    }
}

fn validate_film(film: &Film, problems: &mut Problems) {
    let [width, height] = film.size;
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        let expected = format!("at most {MOST_PIXELS} pixels in all");
        problems.push(Problem::new("film.size", format!("{width} x {height}"), expected));
    }
}

fn validate_clip(clip: &Clip, path: &str, problems: &mut Problems) {
    match clip {
        Clip::Plane { normal, .. } => require_direction(*normal, &join(path, "normal"), problems),
        Clip::Box { min, max, .. } => {
            if let Some(axis) = (0..3).find(|&axis| min[axis] >= max[axis]) {
                let found =
                    format!("{} on axis {}, where max is {}", min[axis], ["x", "y", "z"][axis], max[axis]);
                let problem = Problem::new(join(path, "min"), found, "a corner below max on every axis");
                problems.push(problem.with_fix("give the lowest corner as min and the highest as max"));
            }
        }
    }
}

/// Requires something at `position` to look at a different point, with an `up` that is not along the view.
fn require_view(
    position: [f64; 3],
    target: [f64; 3],
    up: Option<[f32; 3]>,
    path: &str,
    problems: &mut Problems,
) {
    /// Sine of the smallest angle between up and view at which single precision can still distinguish left from right.
    const SMALLEST_SINE: f64 = 1e-4;

    let view = DVec3::from_array(target) - DVec3::from_array(position);
    if !LENGTHS.contains(&view.length()) {
        let found = format!("a distance of {:e} from `position`", view.length());
        let problem =
            Problem::new(join(path, "target"), found, "a point other than `position`, and not too far away");
        return problems.push(problem.with_fix("move one of the two"));
    }
    let Some(up) = up else { return };
    let up_path = join(path, "up");
    if !LENGTHS.contains(&vector(up).length()) {
        return require_direction(up, &up_path, problems);
    }
    if vector(up).normalize().cross(view.normalize()).length() < SMALLEST_SINE {
        let problem = Problem::new(up_path, format!("{up:?}, which is along the view"), "another direction");
        problems.push(problem.with_fix("point `up` along another axis"));
    }
}

/// Lengths of vectors for which single precision can hold the squares of the length and of the components.
const LENGTHS: std::ops::RangeInclusive<f64> = 1e-15..=1e15;

fn require_direction(direction: [f32; 3], path: &str, problems: &mut Problems) {
    let length = vector(direction).length();
    if !LENGTHS.contains(&length) {
        problems.push(Problem::new(
            path,
            format!("a vector of length {length:e}"),
            "a direction, of length about 1",
        ));
    }
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}
