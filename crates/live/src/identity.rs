//! What the samples of a picture depend on, so that samples of different scenes are never mixed.

use crate::assets::Assets;
use crate::document::{Document, Light};
use rayon::prelude::*;
use serde_json::{Map, Value};
use siphasher::sip128::{Hasher128, SipHasher13};
use std::hash::Hasher;
use tyndall::message::excerpt;
use tyndall::volume::Volume;

/// Everything in a scene that its samples depend on: not paths, the number of samples, tone, exposure and the settings of other methods. The
/// seed is apart, since mixing seeds deserves a message of its own.
#[derive(Clone, Debug)]
pub struct SceneIdentity {
    document: Value,
    /// Voxels and maps.
    data: u128,
}

impl SceneIdentity {
    /// Of a document with its assets; hashes all voxels, in parallel on the current pool.
    #[must_use]
    pub fn new(document: &Document, assets: &Assets) -> Self {
        let mut data = Fingerprint::default();
        data.add_volume(&assets.volume);
        for light in document.lights.iter().flatten() {
            if let Light::Environment { map: Some(path), .. } = light
                && let Some(map) = assets.maps.get(path)
            {
                data.add(bytemuck::cast_slice(&[map.width() as u64, map.height() as u64]));
                data.add(bytemuck::cast_slice(map.texels()));
            }
        }
        Self { document: essence(document), data: data.finish() }
    }

    /// Its hash, in hexadecimal. Scenes with equal hashes have the same samples, apart from the seed.
    #[must_use]
    pub fn hash(&self) -> String {
        let mut hash = Fingerprint::default();
        hash.add(self.document.to_string().as_bytes());
        hash.add(&self.data.to_le_bytes());
        format!("{:032x}", hash.finish())
    }
}

/// The first key on which samples depend and in which two documents differ, with both values; `None` if there is none.
#[must_use]
pub fn first_difference(one: &Document, other: &Document) -> Option<KeyDifference> {
    differing("", &essence(one), &essence(other))
}

/// A key in which two documents differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyDifference {
    /// The key, as a dotted path.
    pub path: String,
    /// The values in both, shortened for a message.
    pub values: [String; 2],
}

fn differing(path: &str, one: &Value, other: &Value) -> Option<KeyDifference> {
    if one == other {
        return None;
    }
    let inside = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    let null = &Value::Null;
    let deeper = match (one, other) {
        (Value::Object(one_table), Value::Object(other_table)) => {
            let keys = one_table.keys().chain(other_table.keys());
            keys.map(|key| (inside(key), one.get(key).unwrap_or(null), other.get(key).unwrap_or(null)))
                .find_map(|(path, one, other)| differing(&path, one, other))
        }
        (Value::Array(items), Value::Array(others)) if items.len() == others.len() => {
            let pairs = items.iter().zip(others).enumerate();
            pairs
                .map(|(i, (one, other))| differing(&inside(&i.to_string()), one, other))
                .find_map(|found| found)
        }
        _ => None,
    };
    let shown = |value: &Value| {
        if value.is_null() { "nothing".to_owned() } else { excerpt(&value.to_string()) }
    };
    deeper.or_else(|| Some(KeyDifference { path: path.to_owned(), values: [shown(one), shown(other)] }))
}

/// The parts of a document that samples depend on.
fn essence(document: &Document) -> Value {
    let mut value = document.to_value();
    let table =
        |value: &mut Value, key: &str| value.get_mut(key).and_then(Value::as_object_mut).map(std::mem::take);
    let mut keep = |key: &str, keeps: &dyn Fn(&str) -> bool| {
        if let Some(entries) = table(&mut value, key) {
            value[key] =
                Value::Object(entries.into_iter().filter(|(key, _)| keeps(key)).collect::<Map<_, _>>());
        }
    };
    // Where the voxels come from does not matter.
    keep("volume", &|key| key == "interpolation");
    keep("film", &|key| key != "tone" && key != "exposure");
    let method = document.render.entry().table();
    keep("render", &|key| ["integrator", "max_scatter", &method].contains(&key));
    for light in value.get_mut("lights").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(map) = light.get_mut("map") {
            *map = "a map".into();
        }
    }
    value
}

/// Collects data for a hash of 128 bits that no compiler or version changes.
#[derive(Default)]
struct Fingerprint(SipHasher13);

/// Bytes that are hashed at a time, in parallel.
const PIECE: usize = 1 << 20;

impl Fingerprint {
    fn add(&mut self, bytes: &[u8]) {
        let hash_of = |piece: &[u8]| {
            let mut hasher = SipHasher13::new();
            hasher.write(piece);
            hasher.finish128().as_u128()
        };
        let pieces: Vec<u128> = bytes.par_chunks(PIECE).map(hash_of).collect();
        // The length keeps what is added apart from what is added next.
        self.0.write(&(bytes.len() as u64).to_le_bytes());
        pieces.iter().for_each(|piece| self.0.write(&piece.to_le_bytes()));
    }

    /// Adds voxels, how their values are read, and where they lie.
    fn add_volume(&mut self, volume: &Volume) {
        let (grid, map) = (volume.grid(), volume.value_map());
        self.add(format!("{} {:?} {:?}", volume.type_name(), grid.space(), grid.dims()).as_bytes());
        let numbers = [map.slope, map.intercept].into_iter().chain(grid.spacing()).chain(grid.origin());
        let numbers: Vec<f64> = numbers.chain(grid.direction().into_iter().flatten()).collect();
        self.add(bytemuck::cast_slice(&numbers));
        self.add(volume.bricks().as_bytes());
    }

    fn finish(&self) -> u128 {
        self.0.finish128().as_u128()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Input, Options};
    use serde_json::json;
    use std::collections::BTreeSet;
    use std::path::Path;

    fn of(parts: &[&[u8]]) -> u128 {
        let mut fingerprint = Fingerprint::default();
        parts.iter().for_each(|part| fingerprint.add(part));
        fingerprint.finish()
    }

    #[test]
    fn every_byte_and_every_border_matters() {
        let long: Vec<u8> = (0..=250_u8).cycle().take(3 * PIECE + 5).collect();
        let parts: [&[&[u8]]; 6] = [&[], &[b""], &[b"ab", b"c"], &[b"a", b"bc"], &[b"abc"], &[&long]];
        let mut all: Vec<u128> = parts.into_iter().map(of).collect();
        for changed in [0, PIECE - 1, PIECE, 3 * PIECE + 4] {
            let mut other = long.clone();
            other[changed] ^= 1;
            all.push(of(&[&other]));
        }
        assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len());
    }

    fn scene(patch: &Value) -> (Document, SceneIdentity) {
        let mut input = Input::of_document(
            json!({
                "volume": { "procedural": { "kind": "cloud", "size": [8, 8, 8] } },
                "lights": [{ "type": "point", "position": [1, 2, 3], "intensity": [1, 1, 1] }],
            }),
            Path::new(""),
        );
        input.patch(patch).expect("a patch");
        let options = Options::new().expect("threads");
        let loaded = input.load(&options).expect("a scene");
        let identity = options.threads.install(|| SceneIdentity::new(&loaded.document, &loaded.assets));
        (loaded.document, identity)
    }

    #[test]
    fn what_changes_samples_changes_the_identity_and_nothing_else_does() {
        let (document, identity) = scene(&json!({}));
        for same in [
            json!({ "render": { "samples": 7 } }),
            json!({ "render": { "seed": 7 } }),
            json!({ "film": { "tone": "linear", "exposure": 1.5 } }),
            json!({ "render": { "photon": { "radius": 2.0 } } }),
            json!({ "volume": { "procedural": { "size": [8, 8, 8] } }, "medium": { "density": 1.0 } }),
        ] {
            let (changed, other) = scene(&same);
            assert_eq!(other.hash(), identity.hash(), "{same}");
            assert_eq!(first_difference(&document, &changed), None, "{same}");
        }
        for (patch, path, values) in [
            (json!({ "medium": { "density": 0.5 } }), "medium.density", ["1.0", "0.5"]),
            (json!({ "film": { "size": [9, 512] } }), "film.size.0", ["512", "9"]),
            (
                json!({ "render": { "integrator": "photon" } }),
                "render.integrator",
                ["\"path\"", "\"photon\""],
            ),
            (json!({ "render": { "max_scatter": 3 } }), "render.max_scatter", ["64", "3"]),
            (json!({ "camera": { "auto": { "zoom": 2 } } }), "camera", ["nothing", ""]),
            (
                json!({ "lights": [{ "type": "point", "position": [1, 2, 4], "intensity": [1, 1, 1] }] }),
                "lights.0.position.2",
                ["3.0", "4.0"],
            ),
            (
                json!({ "volume": { "interpolation": "nearest" } }),
                "volume.interpolation",
                ["\"linear\"", "\"nearest\""],
            ),
        ] {
            let (changed, other) = scene(&patch);
            assert_ne!(other.hash(), identity.hash(), "{patch}");
            let found = first_difference(&document, &changed).expect("a difference");
            assert_eq!(found.path, path);
            assert!(
                found.values.iter().zip(values).all(|(found, value)| found == value || value.is_empty()),
                "{found:?}"
            );
        }
        // Other voxels from the same keys, and the same voxels elsewhere.
        let (changed, other) = scene(&json!({ "volume": { "procedural": { "seed": 1 } } }));
        assert_ne!(other.hash(), identity.hash());
        assert_eq!(first_difference(&document, &changed), None);
    }
}
