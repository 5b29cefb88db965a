//! The program from its command line. These tests are one program, which is linked once; those that watch the clock, or what a run may
//! take of the machine, are programs of their own, beside which no other test runs.

mod automatic_looks;
mod backgrounds;
mod bad_input;
mod broken_files;
mod cached_shadows;
mod data;
mod environment_maps;
mod far_origin;
mod fault;
mod fixed_pictures;
mod flat_images;
mod gradients;
mod kinds;
mod labels;
mod looks;
mod narrow_peaks;
mod no_data;
mod parts;
mod pictures;
mod printed;
mod replay;
mod scales;
#[path = "../support/mod.rs"]
mod support;
mod turntable;
mod wide_values;
