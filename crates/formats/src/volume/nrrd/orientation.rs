//! What the axes of an NRRD array stand for, and how they are placed in the world.

use super::super::error::ReadError;
use super::super::fields::{Fields, finite};
use super::super::layout::Axis;
use super::super::placement;
use std::path::Path;
use tyndall::volume::{Grid, Space};

type Vector = [f64; 3];

/// Most axes that NRRD allows.
const MOST_AXES: usize = 16;

/// The array's axes, fastest first.
pub(super) struct Shape {
    pub axes: Vec<(usize, Axis)>,
    pub notes: Vec<String>,
    directions: Option<Vec<Option<Vector>>>,
    space: World,
}

/// The world space that a header declares.
#[derive(Clone, Copy)]
struct World {
    space: Space,
    /// Signs that convert its axes to ours.
    signs: Vector,
    /// Numbers per vector.
    dimension: usize,
}

impl Shape {
    pub fn new(fields: &Fields) -> Result<Self, ReadError> {
        let path = fields.path;
        let expected = "a number from 1 to 16";
        let dimension: usize = fields
            .one(&["dimension"], expected)?
            .ok_or_else(|| ReadError::missing(path, "dimension", expected))?;
        if dimension == 0 || dimension > MOST_AXES {
            return Err(ReadError::header(path, "dimension", &dimension.to_string(), expected));
        }
        let sizes = fields
            .list(&["sizes"], dimension, "whole numbers of at least 1", |word| {
                word.parse().ok().filter(|&n| n > 0)
            })?
            .ok_or_else(|| ReadError::missing(path, "sizes", &format!("{dimension} whole numbers")))?;
        let mut notes = Vec::new();
        let space = world(fields, &mut notes)?;
        let directions = directions(fields, dimension, space)?;
        let kinds = fields.list(&["kinds"], dimension, "axis kinds", |word| Some(word.to_lowercase()))?;
        let axes = meanings(&sizes, kinds.as_deref(), directions.as_deref());
        Ok(Self { axes, notes, directions, space })
    }

    /// The grid of the spatial axes.
    pub fn grid(&self, fields: &Fields) -> Result<Grid, ReadError> {
        let spatial: Vec<usize> =
            (0..self.axes.len()).filter(|&axis| self.axes[axis].1 == Axis::Space).collect();
        let dims = std::array::from_fn(|i| spatial.get(i).map_or(1, |&axis| self.axes[axis].0));
        let per_axis = |key| fields.list(&[key], self.axes.len(), "numbers", optional);
        let mut steps = [None; 3];
        let mut origin = [0.0; 3];
        if let Some(directions) = &self.directions {
            for (step, &axis) in steps.iter_mut().zip(&spatial) {
                *step = directions[axis];
            }
        } else {
            let spacings = per_axis("spacings")?;
            let (mins, maxs) = (per_axis("axis mins")?, per_axis("axis maxs")?);
            let centred_on_nodes = fields
                .list(&["centerings", "centers"], self.axes.len(), "centerings", |word| {
                    Some(word.eq_ignore_ascii_case("node"))
                })?
                .unwrap_or_else(|| vec![false; self.axes.len()]);
            for (i, &axis) in spatial.iter().enumerate().take(3) {
                let node = centred_on_nodes[axis];
                let of = |list: &Option<Vec<Option<f64>>>| list.as_ref().and_then(|list| list[axis]);
                let intervals = self.axes[axis].0 as f64 - if node { 1.0 } else { 0.0 };
                let extent = of(&maxs).zip(of(&mins)).map(|(max, min)| (max - min) / intervals);
                let spacing = of(&spacings).or(extent.filter(|s| s.is_finite() && *s != 0.0)).unwrap_or(1.0);
                let mut step = [0.0; 3];
                step[i] = spacing;
                steps[i] = Some(step);
                // The axis minimum is the outer edge of the first cell, unless samples are centred on nodes.
                origin[i] = of(&mins).map_or(0.0, |min| if node { min } else { min + 0.5 * spacing });
            }
        }
        if let Some(text) = fields.get(&["space origin"]) {
            let expected = format!("a vector ({} numbers)", self.space.dimension);
            let wrong = || ReadError::header(fields.path, "space origin", text, &expected);
            let vectors = vectors(text).ok_or_else(wrong)?;
            let [Some(vector)] = &vectors[..] else { return Err(wrong()) };
            origin = self.space.to_world(vector).ok_or_else(wrong)?;
        }
        placement::grid(fields.path, dims, steps, origin, self.space.space)
    }
}

impl World {
    /// Converts a vector of the file to our world; missing components are zero.
    fn to_world(self, vector: &[f64]) -> Option<Vector> {
        (vector.len() == self.dimension)
            .then(|| std::array::from_fn(|i| self.signs[i] * vector.get(i).copied().unwrap_or(0.0)))
    }
}

fn world(fields: &Fields, notes: &mut Vec<String>) -> Result<World, ReadError> {
    let path: &Path = fields.path;
    let anatomical = |signs, dimension| World { space: Space::Anatomical, signs, dimension };
    let plain = |dimension| World { space: Space::Plain, signs: [1.0; 3], dimension };
    let Some(name) = fields.get(&["space"]) else {
        let dimension = fields.one(&["space dimension"], "a number from 1 to 4")?.unwrap_or(3);
        if !(1..=4).contains(&dimension) {
            return Err(ReadError::header(path, "space dimension", &dimension.to_string(), "1 to 4"));
        }
        return Ok(plain(dimension));
    };
    let world = match name.to_lowercase().as_str() {
        "left-posterior-superior" | "lps" => anatomical([1.0, 1.0, 1.0], 3),
        "left-posterior-superior-time" | "lpst" => anatomical([1.0, 1.0, 1.0], 4),
        "left-anterior-superior" | "las" => anatomical([1.0, -1.0, 1.0], 3),
        "left-anterior-superior-time" | "last" => anatomical([1.0, -1.0, 1.0], 4),
        "right-anterior-superior" | "ras" => anatomical([-1.0, -1.0, 1.0], 3),
        "right-anterior-superior-time" | "rast" => anatomical([-1.0, -1.0, 1.0], 4),
        "scanner-xyz" | "3d-right-handed" => plain(3),
        "scanner-xyz-time" | "3d-right-handed-time" => plain(4),
        "3d-left-handed" | "3d-left-handed-time" => {
            notes.push("left-handed space: shown as is, so left and right are swapped".into());
            plain(if name.len() > "3d-left-handed".len() { 4 } else { 3 })
        }
        _ => {
            let expected =
                "LPS, LAS, RAS (or their long names), scanner-xyz, 3D-right-handed or 3D-left-handed";
            return Err(ReadError::header(path, "space", name, expected));
        }
    };
    if let Some(units) = fields.get(&["space units"])
        && world.space == Space::Anatomical
        && units.split('"').any(|unit| !matches!(unit.trim(), "" | "mm" | "s" | "ms" | "???"))
    {
        notes.push(format!("space units {units}: read as millimetres, as ITK does"));
    }
    Ok(world)
}

/// The world step of each axis, `None` where the file says `none`.
fn directions(
    fields: &Fields,
    dimension: usize,
    space: World,
) -> Result<Option<Vec<Option<Vector>>>, ReadError> {
    let Some(text) = fields.get(&["space directions"]) else { return Ok(None) };
    let expected = format!("{dimension} vectors of {} finite numbers, or `none`", space.dimension);
    let wrong = || ReadError::header(fields.path, "space directions", text, &expected);
    let found = vectors(text).filter(|vectors| vectors.len() == dimension).ok_or_else(wrong)?;
    let to_world = |v: Option<Vec<f64>>| v.map(|v| space.to_world(&v).ok_or_else(wrong)).transpose();
    found.into_iter().map(to_world).collect::<Result<_, _>>().map(Some)
}

/// Vectors such as `(1,0,0) none (0, 2, 0)`; `(nan,nan,nan)` is none too.
fn vectors(text: &str) -> Option<Vec<Option<Vec<f64>>>> {
    let mut found = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        if let Some(inside) = rest.strip_prefix('(') {
            let (numbers, after) = inside.split_once(')')?;
            let numbers: Vec<&str> = numbers.split(',').map(str::trim).collect();
            // Some writers know no other word for an axis that is none of space.
            let is_none = numbers.iter().all(|number| number.parse().is_ok_and(f64::is_nan));
            let vector = || numbers.iter().map(|number| finite(number)).collect::<Option<_>>();
            found.push(if is_none { None } else { Some(vector()?) });
            rest = after;
        } else {
            rest = rest.strip_prefix("none")?;
            found.push(None);
        }
        rest = rest.trim_start();
    }
    Some(found)
}

/// A number, or `nan` if it is unknown.
fn optional(word: &str) -> Option<Option<f64>> {
    let value: f64 = word.parse().ok()?;
    if value.is_nan() { Some(None) } else { value.is_finite().then_some(Some(value)) }
}

/// What each axis stands for, as its kind says; if the kind leaves that open, it is spatial if it has a step
/// in space. Spatial axes after the third count as time.
fn meanings(
    sizes: &[usize],
    kinds: Option<&[String]>,
    directions: Option<&[Option<Vector>]>,
) -> Vec<(usize, Axis)> {
    let mut spatial = 0;
    let meaning = |(axis, &size): (usize, &usize)| {
        let direction: Option<Option<Vector>> = directions.map(|d| d[axis]);
        let still = matches!(direction, Some(None | Some([0.0, 0.0, 0.0])));
        let mut meaning = match kinds.map_or("???", |k: &[String]| k[axis].as_str()) {
            "time" => Axis::Time,
            "domain" | "space" | "???" | "none" => match direction {
                Some(None) => Axis::Channel,
                // A step in time only, in a space that includes time.
                Some(Some(_)) if still && size > 1 => Axis::Time,
                _ => Axis::Space,
            },
            _ => Axis::Channel,
        };
        if meaning == Axis::Space {
            spatial += 1;
            if spatial > 3 {
                meaning = Axis::Time;
            }
        }
        (size, meaning)
    };
    sizes.iter().enumerate().map(meaning).collect()
}
