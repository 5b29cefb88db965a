//! Volumes of a few values, and their pictures by every method on every level of vector instructions.

use crate::support::Folder;
use serde_json::{Value, json};
use std::sync::{Arc, LazyLock};
use tyndall::film::Image;
use tyndall::integrator::METHODS;
use tyndall::simd::Level;
use tyndall_live::{Budget, Input, LiveSession, Options};

/// Samples of a volume, x fastest, as `f64`, with what a header says about them.
#[derive(Clone)]
pub struct Data {
    pub dims: [usize; 3],
    pub spacing: f64,
    pub origin: [f64; 3],
    /// Whether it lies in the patient's space.
    pub anatomical: bool,
    pub samples: Vec<f64>,
}

impl Data {
    /// A cube of voxels with unit spacing, without a space; `value` of a voxel's position from -1 to 1 across the cube.
    pub fn new(edge: u16, value: impl Fn([f64; 3]) -> f64) -> Self {
        Self::of_dims([edge; 3], value)
    }

    /// As [`Self::new`], of any size.
    pub fn of_dims(dims: [u16; 3], value: impl Fn([f64; 3]) -> f64) -> Self {
        let at = |i: u16, n: u16| (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
        let [nx, ny, nz] = dims;
        let rows = (0..nz).flat_map(|z| (0..ny).map(move |y| [y, z]));
        let samples = rows
            .flat_map(|[y, z]| (0..nx).map(move |x| [at(x, nx), at(y, ny), at(z, nz)]))
            .map(value)
            .collect();
        Self { dims: dims.map(usize::from), spacing: 1.0, origin: [0.0; 3], anatomical: false, samples }
    }

    pub fn anatomical(self) -> Self {
        Self { anatomical: true, ..self }
    }

    /// An NRRD file of the samples in a type of that name there.
    pub fn nrrd(&self, kind: &str) -> Vec<u8> {
        let s = self.spacing;
        self.nrrd_along(kind, [[s, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, s]])
    }

    /// The same, with vectors from voxel to voxel along each axis.
    pub fn nrrd_along(&self, kind: &str, axes: [[f64; 3]; 3]) -> Vec<u8> {
        let Self { dims: [nx, ny, nz], origin: [ox, oy, oz], .. } = self;
        let [a, b, c] = axes.map(|[x, y, z]| format!("({x:e},{y:e},{z:e})"));
        let space = if self.anatomical { "space: LPS" } else { "space dimension: 3" };
        let head = format!(
            "NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {nx} {ny} {nz}\n{space}\n\
             space directions: {a} {b} {c}\nspace origin: ({ox:e},{oy:e},{oz:e})\n\
             encoding: raw\nendian: little\n\n"
        );
        [head.as_bytes(), &self.bytes(kind)].concat()
    }

    /// The samples in little-endian order.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "tests give samples that fit"
    )]
    pub fn bytes(&self, kind: &str) -> Vec<u8> {
        let each = |bytes: &dyn Fn(f64) -> Vec<u8>| self.samples.iter().flat_map(|&v| bytes(v)).collect();
        match kind {
            "uchar" => each(&|v| vec![v as u8]),
            "short" => each(&|v| (v as i16).to_le_bytes().to_vec()),
            "ushort" => each(&|v| (v as u16).to_le_bytes().to_vec()),
            "int" => each(&|v| (v as i32).to_le_bytes().to_vec()),
            "uint" => each(&|v| (v as u32).to_le_bytes().to_vec()),
            "float" => each(&|v| (v as f32).to_le_bytes().to_vec()),
            "double" => each(&|v| v.to_le_bytes().to_vec()),
            _ => panic!("no type {kind}"),
        }
    }
}

static THREADS: LazyLock<Arc<rayon::ThreadPool>> =
    LazyLock::new(|| Arc::new(rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads")));

/// A method and a level of vector instructions.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    pub method: &'static str,
    pub level: Level,
}

/// All methods, in scalar code and with the best vector instructions.
pub fn ways() -> Vec<Way> {
    let levels = [Level::available()[0], Level::best()];
    METHODS.iter().flat_map(|m| levels.map(|level| Way { method: m.name, level })).collect()
}

/// A session of the file `name` in a folder, with a patch; a volume without a scene is bare.
pub fn open(folder: &Folder, name: &str, patch: &Value, level: Level) -> LiveSession {
    let options = Options { threads: THREADS.clone(), level, edits: true };
    let mut input = Input::open(&folder.at(name)).expect(name);
    input.patch(patch).expect("a patch");
    LiveSession::start(input, options).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The picture of the file `name` with a patch, in few pixels and samples unless the patch says otherwise.
pub fn picture(folder: &Folder, name: &str, patch: &Value, way: Way) -> Image {
    let small = json!({
        "film": { "size": [24, 24], "background": 0 },
        "render": { "integrator": way.method, "max_scatter": 3, "samples": 16,
                    "photon": { "photons": 20_000 }, "raymarch": { "light_samples": 4 } },
    });
    let patch = tyndall_live::document::apply(&small, patch);
    let mut live = open(folder, name, &patch, way.level);
    live.refine(&Budget::samples(live.document().render.samples()));
    live.image()
}

/// The mean of red, green and blue.
pub fn mean(image: &Image) -> [f64; 3] {
    let n = image.rgba.len() as f64;
    std::array::from_fn(|c| image.rgba.iter().map(|pixel| f64::from(pixel[c])).sum::<f64>() / n)
}

/// The largest difference of two pictures' blocks of 8 x 8 pixels, relative to the brightest block.
pub fn apart(a: &Image, b: &Image) -> f64 {
    let [ours, theirs] = [a, b].map(blocks);
    let brightest = theirs.iter().copied().fold(1e-300, f64::max);
    ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs() / brightest).fold(0.0, f64::max)
}

/// The light of blocks of 8 x 8 pixels.
pub fn blocks(image: &Image) -> Vec<f64> {
    const EDGE: usize = 8;
    let [width, height] = image.size.map(|n| n as usize);
    let sum = |x0: usize, y0: usize| -> f64 {
        let pixels = (0..EDGE * EDGE).map(|i| (x0 + i % EDGE) + width * (y0 + i / EDGE));
        pixels.map(|i| image.rgba[i][..3].iter().map(|&c| f64::from(c)).sum::<f64>()).sum()
    };
    let corners = (0..height / EDGE).flat_map(|y| (0..width / EDGE).map(move |x| [x * EDGE, y * EDGE]));
    corners.map(|[x, y]| sum(x, y)).collect()
}
