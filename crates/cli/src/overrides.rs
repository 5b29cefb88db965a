//! Options that override keys of the scene.

use crate::Failure;
use crate::args::SceneOptions;
use serde_json::json;
use tyndall::message::excerpt;
use tyndall_live::Input;

/// Applies the options to the document: `--set` in the given order, then the others.
pub fn lay_over(input: &mut Input, options: &SceneOptions, samples: Option<u32>) -> Result<(), Failure> {
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
