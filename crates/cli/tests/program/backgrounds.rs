//! What is seen behind the matter in 8-bit pictures.

use crate::support::{Folder, decode, run, written};
use tyndall::integrator::METHODS;

/// A glowing ball in the middle of a picture whose corners it leaves free.
fn scene(film: &str) -> Folder {
    let folder = Folder::new();
    let text = format!(
        "volume.procedural = {{ kind = 'sphere', size = [8, 8, 8] }}\n\
         transfer_function.points = [{{ value = 0, opacity = 0 }}, {{ value = 1, opacity = 1, emission = 0.2 }}]\n\
         film.size = [16, 16]\nrender.samples = 2\n{film}\n"
    );
    folder.put("scene.toml", text);
    folder
}

fn pixels(folder: &Folder, options: &[&str]) -> Vec<u8> {
    let few = ["--set", "render.photon.photons=1000"];
    run(folder, &[&["render", "../scene.toml", "-q", "-o", "a.png"], &few[..], options].concat());
    decode(&written(folder, "a.png")).2
}

#[test]
fn a_white_background_is_white_and_leaves_the_matter_alone() {
    let folder = scene("");
    for method in METHODS {
        for tone in ["agx", "linear", "reinhard", "aces"] {
            for exposure in ["-2", "3"] {
                let tone = format!("film.tone={tone}");
                let exposure = format!("film.exposure={exposure}");
                let with = |background: &str| {
                    let background = format!("film.background={background}");
                    let sets = ["--set", &tone, "--set", &exposure, "--set", &background];
                    pixels(&folder, &[&["--integrator", method.name], &sets[..]].concat())
                };
                let (white, grey, black) = (with("[1,1,1]"), with("0.25"), with("0"));
                let at = |pixels: &[u8], x: usize, y: usize| pixels[3 * (16 * y + x)];
                let what = format!("{}, {tone}, {exposure}", method.name);
                assert_eq!((at(&white, 0, 0), at(&grey, 0, 0), at(&black, 0, 0)), (255, 137, 0), "{what}");
                // Marching ends where matter lets a ten-thousandth through.
                assert!(at(&white, 8, 8).abs_diff(at(&black, 8, 8)) <= 1, "{what}: the covered middle");
                assert!(at(&black, 8, 8) > 0, "{what}");
                // Light in front of paper never darkens it below its share.
                assert!(white.iter().zip(&grey).zip(&black).all(|((w, g), b)| w >= g && g >= b), "{what}");
            }
        }
    }
}

/// JPEG has no opacity: nothing is white, as on paper, and a note says so before the work.
#[test]
fn a_transparent_background_is_white_in_jpeg_with_a_note() {
    let folder = scene("film.background = 'transparent'");
    for method in METHODS {
        let outputs = ["-o", "a.jpg", "-o", "b.JPEG", "-o", "a.png", "-o", "a.exr"];
        let few = ["--integrator", method.name, "--set", "render.photon.photons=1000"];
        let ended = folder.run(&[&["render", "../scene.toml"], &few[..], &outputs].concat());
        assert_eq!(ended.status, Some(0), "{}", ended.stderr);
        let notes: Vec<&str> = ended.stderr.lines().filter(|line| line.contains("JPEG")).collect();
        assert_eq!(notes.len(), 2, "{}", ended.stderr);
        assert!(
            notes[0].contains("note: a.jpg: JPEG has no transparent pixels: they will be white"),
            "{}",
            notes[0]
        );
        let whites = || zune_jpeg::JpegDecoder::new(std::io::Cursor::new(written(&folder, "a.jpg"))).decode();
        let pixels = whites().expect("a JPEG");
        assert!(pixels[..3].iter().all(|&code| code >= 253), "{}: {:?}", method.name, &pixels[..3]);
        assert!(pixels[3 * (16 * 8 + 8)] < 240, "{}: the matter", method.name);
    }
    // Nothing is said where nothing is lost.
    run(&folder, &["render", "../scene.toml", "-o", "a.png"]);
    run(&folder, &["render", "../scene.toml", "--set", "film.background=0", "-o", "a.jpg"]);
}

#[test]
fn a_visible_environment_is_light_and_goes_through_the_curve() {
    let folder = scene("lights = [{ type = 'environment', radiance = [1, 1, 1] }]");
    let corner = |options: &[&str]| pixels(&folder, options)[0];
    assert!(corner(&[]) < 230, "the curve's white is far above 1");
    assert!(corner(&["--set", "film.exposure=-2"]) < corner(&[]));
}
