//! Scene documents that together use every key, and changes to them that keep them well-formed.

use bolero::TypeGenerator;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::sync::LazyLock;
use tyndall_live::document::schema;

/// Valid documents that together have every key.
pub fn seeds() -> &'static [Value] {
    static SEEDS: LazyLock<Vec<Value>> = LazyLock::new(|| {
        vec![
            json!({ "volume": { "procedural": {} } }),
            json!({
                "version": 1,
                "volume": { "path": "a.raw", "interpolation": "nearest", "raw": {
                    "dims": [4, 3, 2], "dtype": "u8", "endian": "big", "offset": 0,
                    "spacing": [1.0, 2.0, 3.0], "origin": [0.0, 0.0, 0.0] } },
                "transfer_function": { "points": [
                    { "value": -2.0, "opacity": 0.0 },
                    { "value": 0.5, "opacity": 1.0, "albedo": [0.9, 0.5, 0.1], "emission": [1.0, 0.0, 0.0],
                      "surface": 0.5, "specular": [0.04, 0.04, 0.04], "roughness": 0.3, "ior": 1.3 },
                    { "value": 0.5, "opacity": 0.2, "albedo": 1.0, "emission": 2.0, "surface": 1.0,
                      "specular": 0.5, "roughness": 0.0, "ior": 1.0 } ] },
                "medium": { "density": 0.7, "phase": { "type": "henyey-greenstein", "g": 0.5 },
                    "brdf": { "type": "abc", "b": 0.5, "c": 1.5 }, "gradient_factor": 10.0,
                    "gradient_range": 1000.0 },
                "lights": [
                    { "name": "sun", "type": "directional", "direction": [0.0, -1.0, 0.0],
                      "irradiance": [3.0, 2.0, 1.0], "angle": 5.0 },
                    { "type": "point", "position": [9.0, 9.0, 9.0], "intensity": [100.0, 0.0, 0.0] },
                    { "type": "rect", "position": [0.0, 9.0, 0.0], "target": [0.0, 0.0, 0.0],
                      "up": [1.0, 0.0, 0.0], "size": [2.0, 3.0], "radiance": 10.0 },
                    { "type": "disk", "position": [9.0, 0.0, 0.0], "target": [0.0, 0.0, 0.0], "radius": 2.0,
                      "radiance": [1.0, 2.0, 3.0] },
                    { "type": "sphere", "position": [0.0, 0.0, 0.0], "radius": 1.0, "radiance": 1.0 },
                    { "type": "environment", "radiance": [1.0, 1.0, 1.0], "rotation": 30.0, "visible": true } ],
                "camera": { "type": "perspective", "position": [0.0, 0.0, 20.0], "target": [0.0, 0.0, 0.0],
                    "up": [0.0, 1.0, 0.0], "fov": 35.0, "aperture": 1.0, "focus": 20.0 },
                "film": { "size": [4, 4], "exposure": 1.0, "tone": "agx", "background": "environment" },
                "render": { "integrator": "path", "max_scatter": 8, "samples": 2, "seed": 3,
                    "path": { "majorant_cell": 4 } },
                "clip": [
                    { "name": "cut", "type": "plane", "point": [0.0, 0.0, 0.0], "normal": [1.0, 0.0, 0.0] },
                    { "type": "box", "min": [-3.0, -3.0, -3.0], "max": [3.0, 3.0, 3.0] } ]
            }),
            json!({
                "volume": { "procedural": { "kind": "cloud", "size": [6, 5, 4], "seed": 1 } },
                "transfer_function": { "preset": "mri" },
                "medium": { "phase": { "type": "schlick", "k": -0.5 }, "brdf": { "type": "ashikhmin-shirley" } },
                "lights": [
                    { "type": "environment", "map": "map.exr", "rotation": 30.0, "visible": false },
                    { "type": "directional", "axes": "camera", "direction": [1.0, 1.0, 1.0], "irradiance": 1.0 },
                    { "type": "environment", "axes": "camera", "studio": { "zenith": 1.0, "horizon": [0.1, 0.2, 0.3], "ground": 0.0,
                        "softboxes": [{ "azimuth": -30.0, "elevation": 40.0, "size": [30.0, 20.0], "softness": 0.5, "radiance": 9.0 }] } } ],
                "camera": { "type": "orthographic", "height": 5.0,
                    "auto": { "azimuth": 30.0, "elevation": 20.0, "zoom": 1.0 } },
                "film": { "size": [4, 4], "background": [1.0, 0.0, 0.0], "tone": "reinhard" },
                "render": { "integrator": "raymarch", "raymarch": { "step": 0.5, "light_samples": 4 } }
            }),
            json!({
                "volume": { "procedural": { "kind": "shells", "size": [4, 4, 4] } },
                "medium": { "density": 3.0, "brdf": { "type": "lambert" }, "phase": { "type": "isotropic" } },
                "camera": { "type": "perspective", "auto": { "zoom": 2.0 }, "aperture": 0.5, "fov": 60.0 },
                "film": { "background": "transparent" },
                "render": { "samples": 2 }
            }),
            json!({
                "volume": { "procedural": { "kind": "marschner-lobb", "size": [5, 4, 6] } },
                "transfer_function": { "points": [
                    { "value": 0.2, "opacity": 0.0, "albedo": 0.5 },
                    { "value": 0.7, "opacity": 0.9, "surface": 0.6, "emission": [0.0, 0.5, 0.0] } ] },
                "medium": { "density": 0.5, "brdf": { "type": "ashikhmin-shirley" } },
                "lights": [
                    { "name": "lamp", "type": "point", "position": [0.0, 9.0, 0.0], "intensity": 50.0 },
                    { "type": "environment", "radiance": 0.5 } ],
                "render": { "integrator": "photon", "max_scatter": 3, "samples": 2, "photon": {
                    "photons": 100, "radius": 1.5, "segments": 3, "steps_per_voxel": 2.0, "gather_spacing": 1.0, "estimate": "nearest",
                    "nearest": 4, "histories": "paths", "history_bits": 32, "bins": "uniform", "spatial": "axes" } }
            }),
        ]
    });
    &SEEDS
}

/// Every key and word of the schema, and some that it lacks.
pub fn words() -> &'static [&'static str] {
    static WORDS: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
        fn collect(value: &Value, into: &mut BTreeSet<String>) {
            match value {
                Value::Object(table) => {
                    if let Some(Value::Object(keys)) = table.get("properties") {
                        into.extend(keys.keys().cloned());
                    }
                    into.extend(table.get("const").and_then(Value::as_str).map(str::to_owned));
                    table.values().for_each(|below| collect(below, into));
                }
                Value::Array(items) => items.iter().for_each(|below| collect(below, into)),
                _ => {}
            }
        }
        let mut words = BTreeSet::new();
        collect(&schema(), &mut words);
        assert!(words.len() > 50, "{words:?}");
        words.extend(
            ["", "0", "1", "99", "a.b", "\n", "\u{1b}[31m", "\0", "é", "x = [", "{", "\"", "map.exr"]
                .map(str::to_owned),
        );
        words.insert("long".repeat(500));
        words.into_iter().map(|word| &*word.leak()).collect()
    });
    &WORDS
}

/// A change to a value; indices are taken modulo the number of candidates.
#[derive(Clone, Debug, TypeGenerator)]
pub enum Change {
    /// Another number, from the list below.
    Number { at: u16, number: u8 },
    /// Any number at all.
    Float { at: u16, bits: u64 },
    /// A number times a power of two.
    Scale { at: u16, exponent: i8 },
    /// Another word.
    Word { at: u16, word: u16 },
    /// Something of another type.
    Type { at: u16, which: u8 },
    /// A copy of a value from elsewhere.
    Copy { from: u16, to: u16 },
    /// A key or item left out.
    Remove { at: u16, which: u8 },
    /// A key renamed.
    Rename { at: u16, which: u8, word: u16 },
    /// A list with its items repeated.
    Repeat { at: u16, times: u8 },
}

/// Numbers at the limits of what the document accepts.
const NUMBERS: [f64; 30] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    2.0,
    3.0,
    1e-45,
    1e-38,
    1e-30,
    1e-20,
    1e-15,
    1e-6,
    1e3,
    1e6,
    1e15,
    1e17,
    1e18,
    1e19,
    3.4e38,
    1e39,
    1e308,
    5e-324,
    0.999_999_99,
    180.0,
    179.999,
    90.0,
    2_147_483_648.0,
    4_294_967_296.0,
    1.8e19,
];

impl Change {
    /// Makes the change.
    pub fn apply(&self, value: &mut Value) {
        match *self {
            Self::Number { at, number } => {
                let number = NUMBERS[usize::from(number) % NUMBERS.len()];
                // A whole number becomes an integer, as users type it; the format `.0` keeps all digits.
                let whole = format!("{number:.0}").parse::<i64>().ok().filter(|_| number.fract() == 0.0);
                let number = whole.map_or(json!(number), |whole| json!(whole));
                replace(value, at, number, Value::is_number);
            }
            Self::Float { at, bits } => replace(value, at, json!(f64::from_bits(bits)), Value::is_number),
            Self::Scale { at, exponent } => {
                if let Some(place) = nth(value, at, Value::is_number) {
                    *place = json!(place.as_f64().unwrap_or(1.0) * f64::from(exponent).exp2());
                }
            }
            Self::Word { at, word } => replace(value, at, a_word(word).into(), Value::is_string),
            Self::Type { at, which } => {
                let new =
                    [json!(null), json!(true), json!([]), json!({}), json!(1), json!("x"), json!([1, 2])];
                replace(value, at, new[usize::from(which) % new.len()].clone(), |_| true);
            }
            Self::Copy { from, to } => {
                if let Some(copy) = nth(value, from, |_| true).cloned() {
                    replace(value, to, copy, |_| true);
                }
            }
            Self::Remove { at, which } => match nth(value, at, is_filled) {
                Some(Value::Array(items)) => drop(items.remove(usize::from(which) % items.len())),
                Some(Value::Object(table)) => {
                    let key = table.keys().nth(usize::from(which) % table.len()).cloned().unwrap_or_default();
                    table.remove(&key);
                }
                _ => {}
            },
            Self::Rename { at, which, word } => {
                if let Some(Value::Object(table)) = nth(value, at, |v| is_filled(v) && v.is_object()) {
                    let key = table.keys().nth(usize::from(which) % table.len()).cloned().unwrap_or_default();
                    if let Some(value) = table.remove(&key) {
                        table.insert(a_word(word).to_owned(), value);
                    }
                }
            }
            Self::Repeat { at, times } => {
                if let Some(Value::Array(items)) = nth(value, at, Value::is_array)
                    && items.len() < 1000
                {
                    *items = vec![items.clone(); 1 + usize::from(times) % 4].concat();
                }
            }
        }
    }
}

fn a_word(word: u16) -> &'static str {
    words()[usize::from(word) % words().len()]
}

fn is_filled(value: &Value) -> bool {
    value.as_array().is_some_and(|items| !items.is_empty())
        || value.as_object().is_some_and(|table| !table.is_empty())
}

fn replace(value: &mut Value, at: u16, new: Value, wanted: impl Fn(&Value) -> bool + Copy) {
    // Repeatedly copying the whole into itself would only make it grow.
    let small = |value: &Value| count(value, |_| true) < 5000;
    if small(value)
        && let Some(place) = nth(value, at, wanted)
    {
        *place = new;
    }
}

fn count(value: &Value, wanted: impl Fn(&Value) -> bool + Copy) -> usize {
    let below = match value {
        Value::Array(items) => items.iter().map(|item| count(item, wanted)).sum(),
        Value::Object(table) => table.values().map(|item| count(item, wanted)).sum(),
        _ => 0,
    };
    below + usize::from(wanted(value))
}

/// The place with index `at`, modulo how many there are, among those wanted.
fn nth(value: &mut Value, at: u16, wanted: impl Fn(&Value) -> bool + Copy) -> Option<&mut Value> {
    fn find<'a>(
        value: &'a mut Value,
        left: &mut usize,
        wanted: impl Fn(&Value) -> bool + Copy,
    ) -> Option<&'a mut Value> {
        if wanted(value) {
            if *left == 0 {
                return Some(value);
            }
            *left -= 1;
        }
        match value {
            Value::Array(items) => items.iter_mut().find_map(|item| find(item, left, wanted)),
            Value::Object(table) => table.values_mut().find_map(|item| find(item, left, wanted)),
            _ => None,
        }
    }
    let all = count(value, wanted);
    if all == 0 {
        return None;
    }
    find(value, &mut (usize::from(at) % all), wanted)
}
