//! Options that override keys of the scene.

use crate::Failure;
use crate::args::SceneOptions;
use serde_json::{Value, json};
use std::path::Path;
use tyndall::message::excerpt;
use tyndall_live::{Input, LOOKS, Look, read_look};

/// Applies the options to the document: the look, `--set` in the given order, then the others.
pub fn lay_over(input: &mut Input, options: &SceneOptions, samples: Option<u32>) -> Result<(), Failure> {
    if let Some(look) = &options.look {
        input.give_look(&look_named(look)?).map_err(Failure::input)?;
    }
    for assignment in &options.set {
        input.set(assignment).map_err(|e| Failure::usage(format!("--set {}: {e}", excerpt(assignment))))?;
    }
    let mut patch = json!({});
    if let Some(integrator) = &options.integrator {
        patch["render"]["integrator"] = integrator.as_str().into();
    }
    if let Some(samples) = samples {
        patch["render"]["samples"] = samples.into();
    }
    if let Some(seed) = options.seed {
        patch["render"]["seed"] = seed.into();
    }
    if let Some(order) = options.max_scatter {
        patch["render"]["max_scatter"] = order.into();
    }
    if let Some(size) = options.size {
        patch["film"]["size"] = json!(size);
    }
    if let Some(preset) = &options.preset {
        patch["transfer_function"]["preset"] = preset.as_str().into();
    }
    input.patch(&patch).map_err(Failure::input)
}

/// The look of that name, or else in that file.
fn look_named(name: &str) -> Result<Value, Failure> {
    if let Some(look) = Look::named(name) {
        return Ok(look.patch());
    }
    let path = Path::new(name);
    if path.exists() || path.extension().is_some() {
        return read_look(path).map_err(Failure::input);
    }
    let known = LOOKS.iter().map(|look| look.name).collect::<Vec<_>>().join(", ");
    Err(Failure::usage(format!(
        "--look {}: no look and no file of that name; known looks are {known}",
        excerpt(name)
    )))
}
