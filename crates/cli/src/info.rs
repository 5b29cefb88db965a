//! `tyndall info`: what the loader understood.

use crate::args::InfoOptions;
use crate::machine::{pool, vector_instructions};
use crate::{Failure, say};
use serde_json::json;
use std::fmt::Write;
use tyndall::message::sentence;
use tyndall::volume::procedural::MATERIALS;
use tyndall::volume::{Space, Volume};
use tyndall_live::document::FieldKind;
use tyndall_live::{Input, LoadedScene, Options};

/// Bins of the histogram.
const BINS: usize = 256;

/// Prints what is known about a volume.
pub fn run(options: &InfoOptions) -> Result<(), Failure> {
    let on = Options { threads: pool(None)?, level: vector_instructions()?, edits: false };
    let loaded = Input::open(&options.file).and_then(|input| input.load(&on)).map_err(Failure::input)?;
    on.threads.install(|| tell(&loaded, options.json))
}

fn tell(loaded: &LoadedScene, as_json: bool) -> Result<(), Failure> {
    if as_json {
        return say(&format!("{:#}\n", to_json(loaded)));
    }
    let mut text = as_text(loaded);
    if loaded.document.volume.procedural.as_ref().is_some_and(|p| p.kind == FieldKind::CornellBox) {
        text.push_str("materials\n");
        for material in MATERIALS {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "  {:<8} {}", material.value, material.name);
        }
    }
    say(&text)
}

fn to_json(loaded: &LoadedScene) -> serde_json::Value {
    let (volume, source) = (&*loaded.assets.volume, &loaded.source);
    let grid = volume.grid();
    let histogram = volume.histogram(volume.value_range(), BINS);
    let data = |range: [f64; 2]| (!volume.is_empty()).then_some(range);
    json!({
        "dims": grid.dims(),
        "type": volume.type_name(),
        "spacing": grid.spacing(),
        "direction": grid.direction(),
        "origin": grid.origin(),
        "bounds": grid.file_bounds(),
        "space": space(volume),
        "value_range": data(volume.value_range()),
        "robust_range": data(volume.robust_range()),
        "gradient_range": loaded.document.medium.gradient_range,
        "histogram": { "range": histogram.range, "counts": histogram.counts },
        "channels": source.channels,
        "times": source.times,
        "non_finite": volume.non_finite(),
        "no_data": volume.no_data(),
        "preset": preset(loaded),
        "notes": source.notes,
    })
}

/// The preset that the scene names, or that was chosen for its data.
fn preset(loaded: &LoadedScene) -> Option<&str> {
    loaded.document.transfer_function.as_ref()?.preset.as_deref()
}

fn corner([x, y, z]: [f64; 3]) -> String {
    format!("({x}, {y}, {z})")
}

fn space(volume: &Volume) -> &'static str {
    match volume.grid().space() {
        Space::Anatomical => "anatomical (LPS millimetres)",
        Space::Plain => "plain",
    }
}

fn as_text(loaded: &LoadedScene) -> String {
    let (volume, source) = (&*loaded.assets.volume, &loaded.source);
    let grid = volume.grid();
    let [nx, ny, nz] = grid.dims();
    let [sx, sy, sz] = grid.spacing();
    let [ox, oy, oz] = grid.origin();
    let [lo, hi] = volume.value_range();
    let [robust_lo, robust_hi] = volume.robust_range();
    let corners = grid.file_bounds();
    let size = grid.file_extent();
    let values = if volume.is_empty() {
        "none, all are NaN".to_owned()
    } else {
        format!("{lo} to {hi}; without outliers {robust_lo} to {robust_hi}")
    };
    let mut text = format!(
        "voxels     {nx} x {ny} x {nz} of {}\n\
         spacing    {sx} x {sy} x {sz}\n\
         size       {} x {} x {}\n\
         bounds     {} to {}\n\
         origin     {ox}, {oy}, {oz}\n\
         direction  {:?}\n\
         space      {}\n\
         values     {values}\n\
         channels   {}, time steps {}\n\
         preset     {}\n",
        volume.type_name(),
        size[0],
        size[1],
        size[2],
        corner(corners[0]),
        corner(corners[1]),
        grid.direction(),
        space(volume),
        source.channels,
        source.times,
        preset(loaded).unwrap_or("none: the scene gives points"),
    );
    if let Some(range) = loaded.document.medium.gradient_range {
        let _ = writeln!(text, "gradients  divided by a range of {range}");
    }
    if volume.non_finite() > 0 {
        let how = "NaN is no data, infinities are read as the nearest end of the range";
        let _ = writeln!(text, "not finite {} samples; {how}", volume.non_finite());
    }
    for note in &source.notes {
        let _ = writeln!(text, "note       {}", sentence(note));
    }
    text
}
