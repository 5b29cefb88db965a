//! Memory, asked for before it is needed: no scene may end the program.

use crate::document::Document;
use crate::error::LiveError;
use tyndall::film::Film;
use tyndall::integrator::{MemoryNeed, method_of};
use tyndall::scene::Scene;
use tyndall_formats::memory::available;

/// Refuses a film for which there is no memory; `at` says what asks for it.
pub(crate) fn film(document: &Document, at: &str) -> Result<(), LiveError> {
    let size = document.film.size;
    // The film, the picture with its layers, and the encoder's copy of it.
    admit(Film::bytes(size, document.render.samples) + 2 * Film::bytes(size, 1), |needed, available| {
        LiveError::Memory {
            at: at.to_owned(),
            key: "film.size".to_owned(),
            what: format!("{} x {} pixels need", size[0], size[1]),
            needed,
            available,
            mend: "a smaller picture",
        }
    })
}

/// Refuses a scene whose method may need more memory than there is; `at` says what asks for it.
pub(crate) fn method(scene: &Scene, at: &str) -> Result<(), LiveError> {
    let method = method_of(&scene.render.method);
    let Some(MemoryNeed { bytes, key, what, mend }) = method.memory(scene) else { return Ok(()) };
    admit(bytes, |needed, available| LiveError::Memory {
        at: at.to_owned(),
        key: format!("render.{}.{key}", method.table()),
        what: format!("{what} may need"),
        needed,
        available,
        mend,
    })
}

fn admit(needed: u64, refusal: impl Fn(u64, u64) -> LiveError) -> Result<(), LiveError> {
    match available() {
        Some(available) if needed > available => Err(refusal(needed, available)),
        _ => Ok(()),
    }
}

/// Bytes that may be filled with what serves edits to come alone: as many as leave room for much else.
pub(crate) fn for_edits() -> usize {
    available().map_or(usize::MAX, |available| usize::try_from(available / 8).unwrap_or(usize::MAX))
}
