//! `tyndall sheet`: every look of a file on one page.

use crate::args::SheetOptions;
use crate::canvas::Canvas;
use crate::machine::{pool, vector_instructions};
use crate::progress::Display;
use crate::{Failure, output};
use serde_json::json;
use tyndall::message::path_name;
use tyndall::transfer::Preset;
use tyndall_live::{Budget, Input, LOOKS, LiveSession, Look, Options};

/// Height of the line under a picture that names its look.
const CAPTION: u32 = 30;

/// Between pictures, and around them.
const GAP: u32 = 12;

/// Paper and ink.
const PAPER: [u8; 3] = [24; 3];
const INK: [u8; 3] = [225; 3];

/// Renders every look that suits the volume and writes the page.
pub fn run(options: &SheetOptions) -> Result<(), Failure> {
    let threads = pool(options.threads)?;
    let level = vector_instructions()?;
    if !options.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        let name = path_name(&options.output);
        return Err(Failure::usage(format!("-o {name}: a sheet is a PNG file; expected a name with .png")));
    }
    output::check(std::slice::from_ref(&options.output), &[], None, None)?;
    let [width, height] = options.size;
    let too_large = || {
        Failure::usage(format!(
            "--size {width}x{height}: the page would be larger than {MOST_EDGE} pixels; expected smaller pictures"
        ))
    };
    if width.max(height) > MOST_EDGE {
        return Err(too_large());
    }
    let on = Options { threads: threads.clone(), level, edits: false };
    let input = Input::open(&options.input).map_err(Failure::input)?;
    let loaded = input.clone().load(&on).map_err(Failure::input)?;
    let preset = threads.install(|| Preset::for_volume(&loaded.assets.volume)).name;
    drop(loaded);
    let looks: Vec<&Look> = LOOKS.iter().filter(|look| look.suits(preset)).collect();

    let columns = (1..).find(|n| n * n >= looks.len()).unwrap_or(1).max(1);
    let rows = looks.len().div_ceil(columns);
    let [cell_width, cell_height] = [width + GAP, height + CAPTION + GAP];
    let most = u32::try_from(columns.max(rows)).ok().and_then(|n| n.checked_mul(cell_width.max(cell_height)));
    if most.is_none_or(|most| most > MOST_EDGE) {
        return Err(too_large());
    }
    let place = |i: usize| {
        let [column, row] = [i % columns, i / columns].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        [GAP + column * cell_width, GAP + row * cell_height]
    };
    let [right, bottom] = place(columns * rows - 1);
    let mut page = Canvas::new([right + cell_width, bottom + cell_height], PAPER);
    let mut display = Display::new(false, options.quiet);
    for (i, look) in looks.iter().enumerate() {
        display.say(i as f64 / looks.len() as f64, look.name.to_owned());
        let [x, y] = place(i);
        let codes = picture(&input, look, options, &on)?;
        page.put([x, y], options.size, &codes);
        page.write([x, y + height + CAPTION - 8], look.name, INK);
    }
    display.finish();
    tyndall_formats::image::write_codes(&options.output, page.size(), page.codes()).map_err(Failure::input)
}

/// Largest edge of a page.
const MOST_EDGE: u32 = 1 << 13;

/// One look of the input, as code values.
fn picture(
    input: &Input,
    look: &Look,
    options: &SheetOptions,
    on: &Options,
) -> Result<Vec<[u8; 3]>, Failure> {
    let mut input = input.clone();
    let within = |e: &dyn std::fmt::Display| Failure::input(format!("{}: {e}", look.name));
    input.give_look(&look.patch()).map_err(|e| within(&e))?;
    input.patch(&json!({ "film": { "size": options.size } })).map_err(|e| within(&e))?;
    if let Some(samples) = options.samples {
        input.patch(&json!({ "render": { "samples": samples } })).map_err(|e| within(&e))?;
    }
    let mut live = LiveSession::start(input, on.clone()).map_err(Failure::input)?;
    live.refine(&Budget::samples(live.document().render.samples()));
    let mut codes = vec![[0; 3]; options.size.map(|n| n as usize).iter().product()];
    let image = live.image();
    live.document().film.shown(&image).encode(on.level, &image.rgba, &mut codes);
    Ok(codes)
}
