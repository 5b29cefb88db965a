//! Pictures and films of a volume that turns.

use crate::data::Data;
use crate::gradients::scene_of;
use crate::looks::options;
use crate::support::{Ended, Folder, files_in_out, json, run, written};
use std::io::Cursor;
use tyndall_live::LiveSession;

const SCENE: &str = "volume.procedural = { kind = 'cloud', size = [16, 16, 16] }\nfilm.size = [21, 13]\nrender.samples = 2\n\
                     render.photon.photons = 5000\nlights = [{ type = 'directional', direction = [1, -1, 0], irradiance = 9 }]\n";

fn folder(scene: &str) -> Folder {
    let folder = Folder::new();
    folder.put("a.toml", scene);
    folder
}

/// The first frame is the picture without the option, and each is what its own metadata give, whatever was kept from the one before, on any
/// number of threads and far from the origin.
#[test]
fn every_frame_is_a_picture_of_its_own() {
    const CLOUD: &str = "volume.procedural = { kind = 'cloud', size = [16, 16, 16] }";
    let orthographic =
        "camera = { type = 'orthographic', position = [40, 9, 2], up = [0, 1, 0.3], height = 30 }\n";
    let far = SCENE.replace(CLOUD, "volume.path = 'far.nrrd'");
    let ball = Data::new(16, |[x, y, z]| (1.0 - x * x - y * y - z * z).max(0.0));
    let far_away = Data { origin: [2e6, -7e5, 3e5], ..ball }.nrrd("float");
    for method in tyndall::integrator::METHODS {
        for scene in [SCENE, &format!("{orthographic}{SCENE}"), &far] {
            let folder = folder(scene);
            folder.put("far.nrrd", &far_away);
            let render = ["render", "../a.toml", "--integrator", method.name];
            run(
                &folder,
                &[&render[..], &["--turntable", "3", "--threads", "2", "-o", "f{:02}.png", "-q"]].concat(),
            );
            run(&folder, &[&render[..], &["-o", "plain.png", "-q"]].concat());
            assert_eq!(written(&folder, "f00.png"), written(&folder, "plain.png"), "{}", method.name);
            for frame in ["f00.png", "f01.png", "f02.png"] {
                run(&folder, &["render", frame, "--threads", "1", "-o", "again.png", "-q"]);
                assert!(
                    written(&folder, frame) == written(&folder, "again.png"),
                    "{frame} by {}",
                    method.name
                );
            }
            assert!(written(&folder, "f00.png") != written(&folder, "f01.png"), "{}", method.name);
        }
    }
}

/// An automatic camera is zoomed by its field of view, which must not change after the first frame.
#[test]
fn zoom_stays() {
    let folder = folder(&format!("camera.auto.zoom = 2.5\n{SCENE}"));
    run(&folder, &["render", "../a.toml", "--turntable", "2", "--stats", "s.json", "-o", "f{}.exr"]);
    let lens = |file: &str| {
        LiveSession::open(&folder.at("out").join(file), options()).expect(file).scene().camera.lens()
    };
    assert_eq!(lens("f0.exr"), lens("f1.exr"));
}

#[test]
fn frames_are_equally_far_away_and_equally_turned() {
    let folder = folder(&SCENE.replace("render.samples = 2", "render.samples = 1"));
    run(&folder, &["render", "../a.toml", "--turntable", "8", "-o", "f{}.png"]);
    let number = |v: &serde_json::Value| v.as_f64().expect("a number");
    let position = |frame: u32| -> Vec<f64> {
        let camera = &scene_of(&folder, &format!("f{frame}.png"))["camera"];
        let [at, to] = ["position", "target"].map(|key| camera[key].as_array().expect(key).clone());
        at.iter().zip(&to).map(|(at, to)| number(at) - number(to)).collect()
    };
    let positions: Vec<Vec<f64>> = (1..8).map(position).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for pair in positions.windows(2) {
        // Up is +y.
        assert!((pair[0][1] - pair[1][1]).abs() < 1e-6 * dot(&pair[0], &pair[0]).sqrt());
        let flat = |v: &[f64]| vec![v[0], v[2]];
        let [a, b] = [flat(&pair[0]), flat(&pair[1])];
        let cos = dot(&a, &b) / dot(&a, &a);
        assert!((cos - 0.5_f64.sqrt()).abs() < 1e-6, "{cos}");
        // Counter-clockwise as seen from above.
        assert!(a[1] * b[0] - a[0] * b[1] > 0.0, "{a:?} to {b:?}");
    }
}

/// Frames, the delay of the first in seconds, and all pixels.
fn animation(bytes: &[u8]) -> (u32, f64, Vec<Vec<u8>>) {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().expect("a PNG");
    let frames = reader.info().animation_control().expect("an animation").num_frames;
    let control = *reader.info().frame_control().expect("a frame");
    let delay = f64::from(control.delay_num) / f64::from(control.delay_den);
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let each = (0..frames).map(|_| {
        reader.next_frame(&mut pixels).expect("a frame");
        pixels.clone()
    });
    let all = each.collect();
    (frames, delay, all)
}

#[test]
fn an_animation_has_the_pixels_of_the_sequence() {
    for background in ["'transparent'", "[1, 1, 1]"] {
        let folder = folder(&format!("film.background = {background}\nfilm.exposure = 'auto'\n{SCENE}"));
        let films = ["--turntable", "4", "--fps", "10", "-o", "f{}.png", "-o", "turn.apng"];
        run(&folder, &[&["render", "../a.toml", "--stats", "s.json"], &films[..]].concat());
        let (frames, delay, pixels) = animation(&written(&folder, "turn.apng"));
        assert_eq!((frames, delay), (4, 0.1));
        for (i, pixels) in pixels.iter().enumerate() {
            let (_, _, expected) = crate::support::decode(&written(&folder, &format!("f{i}.png")));
            assert!(*pixels == expected, "frame {i} before {background}");
        }
        // The exposure of the first frame holds for all.
        let exposures: Vec<_> =
            (0..4).map(|i| scene_of(&folder, &format!("f{i}.png"))["film"]["exposure"].clone()).collect();
        assert!(
            exposures.iter().all(|exposure| *exposure == exposures[0] && exposure.is_f64()),
            "{exposures:?}"
        );
        assert_eq!(json(&written(&folder, "s.json"))["frames"].as_array().map(Vec::len), Some(4));
        // It can be rendered again.
        run(&folder, &["render", "turn.apng", "-o", "again.png"]);
        assert!(written(&folder, "again.png") == written(&folder, "f0.png"));
    }
    let folder = folder(SCENE);
    run(&folder, &["render", "../a.toml", "--turntable", "1"]);
    assert_eq!(files_in_out(&folder), ["a.apng"]);
}

#[test]
fn names_that_cannot_be_are_refused_before_the_work() {
    let folder = folder(SCENE);
    for (outputs, told) in [
        (&["-o", "a.png"][..], "turn_{:04}.png"),
        (&["-o", "a{}.png", "-o", "a{:1}.png"], "a0.png"),
        (&["-o", "a{}.gif"], ".gif"),
        (&["-o", "a{x}.png"], "a{x}.png"),
        (&["-o", "none/a.apng"], "none/a.apng"),
        (&["-o", "a{}.png", "--part", "1/2"], "--part"),
        (&["-o", "a.mp4"], "ffmpeg"),
    ] {
        let mut command = folder.tyndall(&[&["render", "../a.toml", "--turntable", "2"], outputs].concat());
        // Where there is no ffmpeg.
        let ended = command.env("PATH", folder.at("out")).output().expect("the program runs");
        let stderr = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(2), "{outputs:?}: {stderr}");
        assert!(stderr.contains(told), "{outputs:?}: {stderr}");
        assert_eq!(files_in_out(&folder), Vec::<String>::new());
    }
    let Ended { status, stderr, .. } = folder.run(&["render", "../a.toml", "--fps", "10"]);
    assert_eq!(status, Some(2), "{stderr}");
}

/// A program in place of ffmpeg keeps what it is given, or fails.
#[cfg(unix)]
#[test]
fn a_video_is_made_by_ffmpeg() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder(SCENE);
    let stand_in = |text: &str| {
        let listed = "if [ \"$2\" = -encoders ]; then echo ' V libx264 H.264'; exit 0; fi";
        folder.put("bin/ffmpeg", format!("#!/bin/sh\n{listed}\n{text}\n"));
        let executable = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(folder.at("bin/ffmpeg"), executable).expect("permissions");
    };
    let film = |name: &str| {
        let turntable = ["render", "../a.toml", "--turntable", "3", "--fps", "30", "-o", name];
        let mut command = folder.tyndall(&turntable);
        let path = format!("{}:{}", folder.at("bin").display(), std::env::var("PATH").unwrap_or_default());
        command.env("PATH", path).output().expect("the program runs")
    };
    stand_in("for last; do :; done\necho \"$*\" > arguments\ncat > \"$last\"");
    let ended = film("t.mp4");
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    assert_eq!(written(&folder, "t.mp4").len(), 3 * 21 * 13 * 3);
    let arguments = String::from_utf8(written(&folder, "arguments")).expect("text");
    assert!(arguments.contains("-s 21x13 -framerate 30 -i -"), "{arguments}");
    assert_eq!(files_in_out(&folder), ["arguments", "t.mp4"]);
    std::fs::remove_file(folder.at("out/t.mp4")).expect("a file");
    stand_in("cat > /dev/null\necho 'no such codec' >&2\nexit 3");
    let ended = film("t.mp4");
    let stderr = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("t.mp4") && stderr.contains("no such codec"), "{stderr}");
    assert_eq!(files_in_out(&folder), ["arguments"]);
    let ended = film("t.webm");
    let stderr = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("libvpx-vp9, which it lacks"), "{stderr}");
}
