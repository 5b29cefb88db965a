//! Memory for writing pictures, set aside before the work, so that hours of it are not lost for want of it.

use crate::Failure;
use std::path::PathBuf;
use tyndall::film::Film;
use tyndall::integrator::method_of;
use tyndall_formats::image::bytes_to_write;
use tyndall_formats::memory::available;
use tyndall_live::LiveSession;

/// Memory that is free again when this is dropped. Where the address space is limited nothing else can take it; it is never touched, and
/// so costs nothing else.
#[derive(Debug)]
pub struct Reserve(#[expect(dead_code, reason = "held, never read")] Vec<u8>);

/// Address space that an allocator may take for each thread, and as much for what all share.
const SPACE_PER_THREAD: u64 = 64 << 20;

/// What is going to be computed and written.
#[derive(Clone, Copy, Debug)]
pub struct Plan<'a> {
    /// Where the pictures go.
    pub paths: &'a [PathBuf],
    /// Width and height.
    pub size: [u32; 2],
    /// Bytes of samples for each pixel that an OpenEXR file is to hold.
    pub state: u64,
    /// Bytes that the work takes beforehand.
    pub work: u64,
    /// Threads that work.
    pub threads: usize,
}

impl<'a> Plan<'a> {
    /// To take as many samples in a session as `samples`, and write them with the picture if they are kept.
    pub fn of_session(paths: &'a [PathBuf], live: &LiveSession, samples: u32, keeps_samples: bool) -> Self {
        let (film, size) = (live.film(), live.film().size());
        let first = film.first();
        let (all, taken) = (Film::bytes(size, first, samples), Film::bytes(size, first, film.samples()));
        let has = if film.most_samples() > first { taken } else { 0 };
        let scene = live.scene();
        let method = method_of(&scene.render.method).memory(scene).map_or(0, |need| need.bytes);
        let state = if keeps_samples { Film::bytes([1, 1], first, samples) } else { 0 };
        Self {
            paths,
            size,
            state,
            work: all.saturating_sub(has).saturating_add(method),
            threads: live.session().threads(),
        }
    }
}

impl Reserve {
    /// Sets aside what writing the pictures will take, the one that takes most, since they are written one after another.
    ///
    /// # Errors
    /// [`Failure::Input`] if there is too little memory for that and the work.
    pub fn new(plan: &Plan) -> Result<Self, Failure> {
        let Plan { paths, size, state, work, threads } = *plan;
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let writing = paths.iter().map(|path| bytes_to_write(path, pixels, state)).max().unwrap_or(0);
        let too_little = |available: Option<u64>| {
            let [width, height] = size;
            let (need, writing) = (work.saturating_add(writing) >> 20, writing >> 20);
            let free = available.map_or(", more than is free".to_owned(), |bytes| {
                format!(", but {} MiB are free", bytes >> 20)
            });
            Failure::input(format!(
                "film.size: a picture of {width} x {height} needs {need} MiB, {writing} of them to write it{free}; expected a smaller picture or \
                 fewer samples, or a higher limit of memory"
            ))
        };
        if let Some(available) = available().filter(|&available| work.saturating_add(writing) > available) {
            return Err(too_little(Some(available)));
        }
        let memory = space(writing).ok_or_else(|| too_little(None))?;
        // Whether there is also room for the work.
        let beside = SPACE_PER_THREAD.saturating_mul(threads as u64 + 1);
        if space(work.saturating_add(beside)).is_some() {
            return Ok(Self(memory));
        }
        drop(memory);
        Err(too_little(available().map(|available| available.saturating_sub(beside))))
    }
}

/// Memory of this size that nobody has touched, if there is any.
fn space(bytes: u64) -> Option<Vec<u8>> {
    let mut memory = Vec::new();
    memory.try_reserve_exact(usize::try_from(bytes).ok()?).ok()?;
    Some(memory)
}
