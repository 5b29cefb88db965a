//! How the picture is computed.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use tyndall::integrator::{DEFAULT_METHOD, METHODS, MethodEntry, method_named};
use tyndall::scene::MethodChoice;

use super::number;
use super::shape::{Samples, ScatteringOrder};

/// How the picture is computed: the method, its effort, and the settings of every method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Map<String, Value>", into = "Map<String, Value>")]
pub struct Render {
    /// Keeps light that scattered at most this many times.
    pub max_scatter: u32,
    /// Samples per pixel at which rendering stops; `None` for the method's default, see [`Self::samples`].
    pub given_samples: Option<u32>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Index in [`METHODS`] of the method that is used.
    method: usize,
    /// Every method's settings, in the order of [`METHODS`].
    settings: Vec<MethodChoice>,
}

impl Default for Render {
    fn default() -> Self {
        let Common { integrator, max_scatter, samples: given_samples, seed } = Common::default();
        let settings = METHODS.iter().map(MethodEntry::default_settings).collect();
        Self { max_scatter, given_samples, seed, method: number_of(&integrator.0).unwrap_or(0), settings }
    }
}

impl Render {
    /// The method that is used, with its settings.
    #[must_use]
    pub fn method(&self) -> &MethodChoice {
        &self.settings[self.method]
    }

    /// Samples per pixel at which rendering stops.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.given_samples.unwrap_or(self.entry().default_samples)
    }

    /// The entry of the method that is used in the list of methods.
    #[must_use]
    pub fn entry(&self) -> &'static MethodEntry {
        &METHODS[self.method]
    }

    /// Every method with its settings, used or not.
    pub(super) fn tables(&self) -> impl Iterator<Item = (&'static MethodEntry, &MethodChoice)> {
        METHODS.iter().zip(&self.settings)
    }

    /// Reduces the settings of every method to those of a draft, see [`tyndall::integrator::Method::draft`].
    pub fn draft(&mut self) {
        for (entry, settings) in METHODS.iter().zip(&mut self.settings) {
            *settings = entry.draft(settings);
        }
    }
}

fn number_of(name: &str) -> Option<usize> {
    METHODS.iter().position(|entry| entry.name == name)
}

impl TryFrom<Map<String, Value>> for Render {
    type Error = serde_json::Error;

    fn try_from(mut table: Map<String, Value>) -> Result<Self, serde_json::Error> {
        let read = |entry: &MethodEntry| match table.shift_remove(&entry.table()) {
            Some(settings) => entry.read(settings),
            None => Ok(entry.default_settings()),
        };
        let settings = METHODS.iter().map(read).collect::<Result<_, _>>()?;
        let Common { integrator, max_scatter, samples: given_samples, seed } =
            serde_json::from_value(Value::Object(table))?;
        Ok(Self { max_scatter, given_samples, seed, method: number_of(&integrator.0).unwrap_or(0), settings })
    }
}

impl From<Render> for Map<String, Value> {
    fn from(render: Render) -> Self {
        let Render { max_scatter, given_samples: samples, seed, .. } = render;
        let integrator = MethodName(render.entry().name.to_owned());
        let common = Common { integrator, max_scatter, samples, seed };
        let mut table = match serde_json::to_value(common) {
            Ok(Value::Object(table)) => table,
            other => unreachable!("plain keys are a table, not {other:?}"),
        };
        for (entry, settings) in render.tables() {
            let written = entry.write(settings).map(|mut settings| {
                number::shorten(&mut settings);
                (entry.table(), settings)
            });
            table.extend(written);
        }
        table
    }
}

/// How the picture is computed: the method, its effort, and the settings of every method.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Common {
    /// The method.
    integrator: MethodName,

    /// Keeps light that scattered at most this many times; 1 is single scattering, 0 leaves emission, background and
    /// visible surfaces.
    #[schemars(with = "ScatteringOrder")]
    max_scatter: u32,

    /// Samples per pixel at which rendering stops.
    #[schemars(with = "Samples")]
    #[serde(skip_serializing_if = "Option::is_none")]
    samples: Option<u32>,

    /// Seed of the random numbers: the same seed gives the same picture, bit for bit.
    seed: u64,
}

impl Default for Common {
    fn default() -> Self {
        Self { integrator: MethodName::default(), max_scatter: 64, samples: None, seed: 0 }
    }
}

impl JsonSchema for Render {
    fn schema_name() -> Cow<'static, str> {
        "Render".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = Common::json_schema(generator);
        if let Some(samples) = schema.pointer_mut("/properties/samples/description") {
            *samples =
                format!("Samples per pixel at which rendering stops; when omitted, {}.", default_samples())
                    .into();
        }
        for entry in METHODS {
            let mut settings = entry.schema(generator);
            settings
                .insert("description".into(), format!("Settings of the integrator `{}`.", entry.name).into());
            settings.insert("default".into(), entry.write(&entry.default_settings()).into());
            if let Some(Value::Object(keys)) = schema.get_mut("properties") {
                keys.insert(entry.table(), settings.into());
            }
        }
        schema
    }
}

/// The default number of samples, and the methods that have another.
fn default_samples() -> String {
    let usual = DEFAULT_METHOD.default_samples;
    let others = METHODS.iter().filter(|entry| entry.default_samples != usual);
    let others = others.map(|entry| format!(", {} for `{}`", entry.default_samples, entry.name));
    others.fold(usual.to_string(), |text, other| text + &other)
}

/// The name of a method.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "String")]
struct MethodName(String);

impl Default for MethodName {
    fn default() -> Self {
        Self(DEFAULT_METHOD.name.to_owned())
    }
}

impl TryFrom<String> for MethodName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        method_named(&name).map(|_| Self(name)).ok_or_else(|| "no integrator of this name".to_owned())
    }
}

impl JsonSchema for MethodName {
    fn schema_name() -> Cow<'static, str> {
        "Integrator".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let word = |entry: &MethodEntry| json_schema!({ "type": "string", "const": entry.name, "description": entry.about });
        let words: Vec<Schema> = METHODS.iter().map(word).collect();
        json_schema!({ "oneOf": words, "description": "The method that computes the light." })
    }
}
