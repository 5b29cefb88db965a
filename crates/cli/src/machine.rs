//! What the machine gives a run: threads, vector instructions, memory, and the user's Ctrl-C.

use crate::Failure;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tyndall::film::Film;
use tyndall::integrator::PhotonMapping;
use tyndall::scene::document::Document;
use tyndall::scene::{IntegratorKind, RenderSettings};
use tyndall::simd::Level;

/// The widest vector instructions, or those that `TYNDALL_SIMD` names.
pub fn vector_instructions() -> Result<Level, Failure> {
    match std::env::var_os("TYNDALL_SIMD") {
        None => Ok(Level::best()),
        Some(name) => name.to_string_lossy().parse().map_err(|e| {
            Failure::usage(format!("TYNDALL_SIMD: {e}; name one of these, or unset it for the best"))
        }),
    }
}

/// Threads of the program's own.
pub fn pool(threads: Option<u16>) -> Result<Arc<rayon::ThreadPool>, Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.map_or(0, usize::from))
        .build()
        .map(Arc::new)
        .map_err(|e| Failure::usage(format!("--threads: {e}")))
}

/// Ctrl-C: ends the program at once while there is no picture to save, then asks for an early end, and
/// the second time ends at once again.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    asks: Arc<AtomicBool>,
    asked: Arc<AtomicBool>,
}

impl Interrupt {
    /// From now on.
    pub fn listen() -> Self {
        let interrupt = Self::default();
        let heard = interrupt.clone();
        // Without a handler Ctrl-C still ends the program, only without a picture.
        drop(ctrlc::set_handler(move || {
            if !heard.asks.load(Ordering::Relaxed) || heard.asked.swap(true, Ordering::Relaxed) {
                let _nothing_half_written = tyndall_formats::atomic::abandon();
                std::process::exit(130);
            }
        }));
        interrupt
    }

    /// There is something to save now.
    pub fn ask_from_now_on(&self) {
        self.asks.store(true, Ordering::Relaxed);
    }

    /// Whether to end.
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// The flag itself, for sessions to look at.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.asked.clone()
    }
}

/// Refuses a film for which there is no memory; `at` says what asks for it.
pub fn check_film(size: [u32; 2], at: &str) -> Result<(), Failure> {
    // The film, the picture with its layers, and the encoder's copy of it.
    let needed = 3 * Film::bytes(size);
    match tyndall_formats::memory::available() {
        Some(available) if needed > available => Err(Failure::input(format!(
            "{at}: film.size: {} x {} pixels need {} MiB, but {} MiB are free; expected a smaller picture",
            size[0],
            size[1],
            needed >> 20,
            available >> 20
        ))),
        _ => Ok(()),
    }
}

/// Bytes in which a session may keep samples: those asked for, as far as that leaves room for much else.
pub fn sample_memory(document: &Document) -> usize {
    let asked = u64::from(document.render.path.history_memory) << 20;
    let free = tyndall_formats::memory::available().map_or(asked, |available| available / 8);
    usize::try_from(asked.min(free)).unwrap_or(usize::MAX)
}

/// Refuses photons for which there is no memory; `at` says what asks for them.
pub fn check_photons(render: &RenderSettings, size: [u32; 2], at: &str) -> Result<(), Failure> {
    let IntegratorKind::Photon(settings) = render.integrator else { return Ok(()) };
    let needed = PhotonMapping::most_bytes(&settings, render.max_scatter, size);
    match tyndall_formats::memory::available() {
        Some(available) if needed > available => Err(Failure::input(format!(
            "{at}: render.photon.photons: {} light paths of up to {} scatterings and {} segments a pixel may need {} MiB, but {} MiB \
             are free; expected fewer of them",
            settings.photons,
            render.max_scatter,
            settings.segments,
            needed >> 20,
            available >> 20
        ))),
        _ => Ok(()),
    }
}
