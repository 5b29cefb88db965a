//! Memory checks before allocation, so that no scene can end the program by exhausting memory.

use crate::document::Document;
use crate::error::LiveError;
use tyndall::film::Film;
use tyndall::integrator::{MemoryNeed, method_of};
use tyndall::scene::Scene;
use tyndall_formats::memory::available;

/// Refuses a film that would not fit in memory with the samples from number `first` on; `at` begins the message.
pub(crate) fn film(document: &Document, first: u32, at: &str) -> Result<(), LiveError> {
    let (size, samples) = (document.film.size, document.render.samples().max(first));
    // The film, the picture with its layers, and the encoder's copy of it.
    admit(Film::bytes(size, first, samples) + 2 * Film::bytes(size, 0, 1), |needed, available| {
        LiveError::Memory {
            at: at.to_owned(),
            key: "film.size".to_owned(),
            what: format!("{} x {} pixels need", size[0], size[1]),
            needed,
            available,
            fix: "a smaller picture",
        }
    })
}

/// Refuses a scene whose method may need more memory than is available; `at` begins the message.
pub(crate) fn method(scene: &Scene, at: &str) -> Result<(), LiveError> {
    let method = method_of(&scene.render.method);
    let Some(MemoryNeed { bytes, key, what, fix }) = method.memory(scene) else { return Ok(()) };
    admit(bytes, |needed, available| LiveError::Memory {
        at: at.to_owned(),
        key: format!("render.{}.{key}", method.table()),
        what: format!("{what} may need"),
        needed,
        available,
        fix,
    })
}

fn admit(needed: u64, refusal: impl Fn(u64, u64) -> LiveError) -> Result<(), LiveError> {
    match available() {
        Some(available) if needed > available => Err(refusal(needed, available)),
        _ => Ok(()),
    }
}

/// Bytes that may hold data kept only to speed up later edits: an eighth of the available memory, where that is known.
pub(crate) fn for_edits() -> usize {
    available().map_or(usize::MAX, |available| usize::try_from(available / 8).unwrap_or(usize::MAX))
}
