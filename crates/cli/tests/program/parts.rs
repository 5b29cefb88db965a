//! Renders in several runs: parts that are merged, and renders that are resumed, both exactly as a single run.

use crate::support::{Ended, Folder, run, written};
use std::process::Stdio;
use std::time::Duration;
use tyndall::integrator::METHODS;
use tyndall_formats::image::{Metadata, read_metadata};

const SCENE: &str = "\
    volume.procedural = { kind = 'cloud', size = [12, 12, 12] }\n\
    film.size = [20, 17]\n\
    render.photon.photons = 500\n\
    render.raymarch.light_samples = 2\n";

/// Six chunks of 16 samples, and one of 4.
const SAMPLES: &str = "100";

fn with_scene() -> Folder {
    let folder = Folder::new();
    folder.put("scene.toml", SCENE);
    folder
}

fn render(folder: &Folder, options: &[&str]) {
    run(folder, &[&["render", "../scene.toml", "--samples", SAMPLES], options].concat());
}

/// Renders part K of N to `partK.exr`.
fn render_part(folder: &Folder, part: &str, options: &[&str]) {
    let output = format!("part{}.exr", part.split('/').next().expect("a number"));
    render(folder, &[&["--part", part, "-o", &output], options].concat());
}

/// A run that must fail with a status and one message, which says each of `words`.
fn refused(folder: &Folder, status: i32, arguments: &[&str], words: &[&str]) {
    let Ended { status: found, stderr, .. } = folder.run(arguments);
    assert_eq!(found, Some(status), "{arguments:?}: {stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    for word in words {
        assert!(stderr.contains(word), "{arguments:?}: no `{word}` in: {stderr}");
    }
}

#[test]
fn parts_merged_in_any_order_are_the_file_of_a_single_run() {
    for method in METHODS.iter().map(|method| method.name) {
        let folder = with_scene();
        let with = ["--integrator", method];
        render(&folder, &[&with[..], &["-o", "whole.exr", "-o", "whole.png"]].concat());
        for part in ["3/4", "1/4", "4/4", "2/4"] {
            render_part(&folder, part, &with);
        }
        for order in [[1, 2, 3, 4], [4, 2, 1, 3]] {
            let parts = order.map(|number| format!("part{number}.exr"));
            let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
            run(&folder, &[&["merge"], &parts[..], &["-o", "merged.exr", "-o", "merged.png"]].concat());
            assert!(written(&folder, "merged.exr") == written(&folder, "whole.exr"), "{method}, {order:?}");
            assert!(written(&folder, "merged.png") == written(&folder, "whole.png"), "{method}, {order:?}");
        }
    }
}

#[test]
fn as_many_parts_as_chunks_and_no_more() {
    let folder = with_scene();
    render(&folder, &["-o", "whole.exr"]);
    let parts: Vec<String> = (1..=7).map(|number| format!("part{number}.exr")).collect();
    for number in 1..=7 {
        render_part(&folder, &format!("{number}/7"), &["--threads", if number % 2 > 0 { "1" } else { "3" }]);
    }
    let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
    run(&folder, &[&["merge"], &parts[..], &["-o", "merged.exr"]].concat());
    assert!(written(&folder, "merged.exr") == written(&folder, "whole.exr"));
    let eight = ["render", "../scene.toml", "--samples", SAMPLES, "--part", "8/8", "-o", "a.exr"];
    refused(&folder, 2, &eight, &["--part 8/8", "100 samples", "at most 7 parts"]);
}

#[test]
fn a_render_goes_on_to_the_file_of_a_single_run() {
    for method in METHODS.iter().map(|method| method.name) {
        let folder = with_scene();
        let with = ["--integrator", method, "--resumable"];
        render(&folder, &[&with[..], &["-o", "whole.exr"]].concat());
        run(&folder, &[&["render", "../scene.toml", "--samples", "37", "-o", "a.exr"], &with[..]].concat());
        // From the scene and from the picture itself, with another tone, and over the old file.
        render(&folder, &["--integrator", method, "--resume", "a.exr", "-o", "b.exr", "-o", "b.png"]);
        assert!(written(&folder, "b.exr") == written(&folder, "whole.exr"), "{method}");
        run(&folder, &["render", "a.exr", "--samples", "70", "--resume", "a.exr", "-o", "a.exr"]);
        run(&folder, &["render", "a.exr", "--samples", SAMPLES, "--resume", "a.exr", "-o", "a.exr"]);
        assert!(written(&folder, "a.exr") == written(&folder, "whole.exr"), "{method}");
        let toned = ["--resume", "a.exr", "--set", "film.tone=linear", "-o", "c.png"];
        render(&folder, &[&["--integrator", method], &toned[..]].concat());
        assert!(written(&folder, "c.png") != written(&folder, "b.png"), "{method}");
        // Nothing to do is worth a word: the picture's own scene asks for what it has now.
        let Ended { status, stderr, .. } =
            folder.run(&["render", "a.exr", "--resume", "a.exr", "-o", "d.exr"]);
        assert!(status == Some(0) && stderr.contains("already has the 100 samples asked for"), "{stderr}");
        assert!(written(&folder, "d.exr") == written(&folder, "a.exr"), "{method}");
        let less = ["render", "a.exr", "--samples", "50", "--resume", "a.exr", "-o", "a.png"];
        refused(&folder, 2, &less, &["a.exr", "some pixels already have 100 samples", "--samples"]);
    }
}

#[test]
fn a_merged_render_goes_on_too() {
    let folder = with_scene();
    run(&folder, &["render", "../scene.toml", "--samples", "130", "--resumable", "-o", "whole.exr"]);
    render_part(&folder, "1/2", &[]);
    render_part(&folder, "2/2", &[]);
    run(&folder, &["merge", "part2.exr", "part1.exr", "--resumable", "-o", "merged.exr"]);
    run(&folder, &["render", "merged.exr", "--samples", "130", "--resume", "merged.exr", "-o", "all.exr"]);
    assert!(written(&folder, "all.exr") == written(&folder, "whole.exr"));
}

/// As in an array job whose machine fails.
#[test]
fn a_part_that_was_killed_is_made_again() {
    let folder = with_scene();
    render(&folder, &["-o", "whole.exr"]);
    render_part(&folder, "2/2", &[]);
    let endless = ["--size", "400x400", "--max-scatter", "1000"];
    let first = ["render", "../scene.toml", "--samples", SAMPLES, "--part", "1/2", "-o", "part1.exr"];
    let mut killed =
        folder.tyndall(&[&first[..], &endless].concat()).stderr(Stdio::null()).spawn().expect("a start");
    std::thread::sleep(Duration::from_millis(300));
    killed.kill().expect("it runs");
    killed.wait().expect("a status");
    let merge = ["merge", "part1.exr", "part2.exr", "-o", "merged.exr"];
    refused(&folder, 1, &merge, &["part1.exr"]);
    render_part(&folder, "1/2", &[]);
    run(&folder, &merge);
    assert!(written(&folder, "merged.exr") == written(&folder, "whole.exr"));
}

/// After Ctrl-C some pixels have a sample more than others; a render goes on from there, a part is not merged.
#[cfg(unix)]
#[test]
fn an_interrupted_render_goes_on_and_an_interrupted_part_is_refused() {
    let folder = with_scene();
    let big = ["--size", "200x150"];
    let interrupted = |options: &[&str]| {
        let all = [&["render", "../scene.toml"], options, &big].concat();
        let mut child = folder.tyndall(&all).stderr(Stdio::null()).spawn().expect("a start");
        std::thread::sleep(Duration::from_millis(700));
        let sent = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
        assert_eq!(child.wait().expect("a status").code(), Some(130));
    };
    interrupted(&["--samples", "1000000", "--resumable", "-o", "a.exr"]);
    let metadata = read_metadata(&folder.at("out/a.exr")).expect("a picture").expect("metadata");
    let few = metadata.get(Metadata::SAMPLES).expect("samples");
    let samples: u32 = few.parse().expect("a number");
    let single = |samples: &str, output: &str| {
        let all = ["render", "../scene.toml", "--samples", samples, "--resumable", "-o", output];
        run(&folder, &[&all[..], &big].concat());
        written(&folder, output)
    };
    // Tiles may be some passes ahead of others; then the picture of the least of them cannot be had any more.
    let resumed = ["render", "../scene.toml", "--samples", few, "--resume", "a.exr", "-o", "b.exr"];
    let Ended { status, stderr, .. } = folder.run(&[&resumed[..], &big].concat());
    match status {
        Some(0) => assert!(written(&folder, "b.exr") == single(few, "c.exr"), "{few} samples"),
        _ => assert!(status == Some(2) && stderr.contains("a.exr: some pixels already have "), "{stderr}"),
    }
    let all = format!("{}", samples + 20);
    run(
        &folder,
        &[&["render", "../scene.toml", "--samples", &all, "--resume", "a.exr", "-o", "b.exr"], &big[..]]
            .concat(),
    );
    assert!(written(&folder, "b.exr") == single(&all, "c.exr"), "from {samples} to {all} samples");
    interrupted(&["--samples", "1000000", "--part", "1/1", "-o", "p.exr"]);
    refused(&folder, 1, &["merge", "p.exr", "-o", "m.exr"], &["p.exr", "interrupted", "render it again"]);
    let resume = ["render", "p.exr", "--resume", "p.exr", "-o", "m.exr"];
    refused(&folder, 1, &resume, &["p.exr", "part 1/1", "merge all parts first"]);
}

#[test]
fn mixtures_are_refused_by_name() {
    let folder = with_scene();
    for part in ["1/3", "2/3", "3/3"] {
        render_part(&folder, part, &[]);
    }
    let refuses = |other: &[&str], words: &[&str]| {
        let samples = if other[0] == "--samples" { &[][..] } else { &["--samples", SAMPLES] };
        let second = ["render", "../scene.toml", "--part", "2/3", "-o", "other.exr"];
        run(&folder, &[&second[..], samples, other].concat());
        let merge = ["merge", "part1.exr", "other.exr", "part3.exr", "-o", "m.exr"];
        refused(&folder, 1, &merge, &[&["other.exr", "part1.exr"], words].concat());
    };
    refuses(&["--seed", "3"], &["seed 3", "seed 0"]);
    refuses(&["--set", "medium.density=0.5"], &["`medium.density`", "0.5", "1.0"]);
    refuses(&["--size", "20x18"], &["`film.size.1`", "18", "17"]);
    refuses(&["--integrator", "raymarch"], &["`render.integrator`", "raymarch", "path"]);
    refuses(&["--set", "volume.procedural.seed=4"], &["other voxels or maps"]);
    refuses(&["--samples", "60"], &["60 samples", "100"]);
    // The tone does not matter: it is that of the first part.
    let toned = ["--part", "2/3", "-o", "other.exr", "--set", "film.exposure=1.5"];
    render(&folder, &toned);
    run(&folder, &["merge", "part1.exr", "other.exr", "part3.exr", "-o", "m.exr"]);

    let merge = |files: &[&'static str]| [&["merge", "-o", "m.exr"], files].concat();
    refused(
        &folder,
        1,
        &merge(&["part1.exr", "part2.exr", "part2.exr", "part3.exr"]),
        &["is part 2/3, and so is"],
    );
    refused(&folder, 1, &merge(&["part1.exr", "part3.exr"]), &["2 of 3 parts", "2/3"]);
    render(&folder, &["--part", "1/2", "-o", "half.exr"]);
    refused(&folder, 1, &merge(&["part1.exr", "half.exr"]), &["1/2", "1/3", "shared in the same number"]);
    render(&folder, &["--resumable", "-o", "whole.exr", "-o", "plain.png"]);
    refused(&folder, 1, &merge(&["part1.exr", "whole.exr"]), &["whole.exr", "not a part"]);
    render(&folder, &["-o", "plain.exr"]);
    for plain in ["plain.exr", "plain.png", "../scene.toml"] {
        refused(&folder, 1, &merge(&["part1.exr", plain]), &[plain, "no stored samples"]);
        let resume = ["render", "../scene.toml", "--resume", plain, "-o", "m.exr"];
        refused(&folder, 1, &resume, &[plain, "no stored samples"]);
    }
    refused(&folder, 1, &merge(&["gone.exr"]), &["gone.exr", "cannot read"]);
    let seed = ["render", "../scene.toml", "--seed", "1", "--resume", "whole.exr", "-o", "m.exr"];
    refused(&folder, 1, &[&seed[..], &["--samples", "200"]].concat(), &["whole.exr", "seed 0", "seed 1"]);
}

/// Metadata is not compressed, so that a file can be made one of another version or of other instructions.
#[test]
fn other_versions_and_instructions_are_refused() {
    let folder = with_scene();
    render_part(&folder, "1/2", &[]);
    render_part(&folder, "2/2", &[]);
    let part = written(&folder, "part2.exr");
    let changed = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let at = part.windows(from.len()).position(|bytes| bytes == from.as_bytes()).expect("it is there");
        let mut changed = part.clone();
        changed[at..at + to.len()].copy_from_slice(to.as_bytes());
        folder.put("out/changed.exr", changed);
        ["merge", "part1.exr", "changed.exr", "-o", "m.exr"]
    };
    let version = env!("CARGO_PKG_VERSION");
    let other = "9".repeat(version.len());
    refused(&folder, 1, &changed(version, &other), &["changed.exr", &format!("version {other}"), version]);
    let level = tyndall::simd::Level::best().name();
    let unknown = "x".repeat(level.len());
    refused(&folder, 1, &changed(level, &unknown), &["changed.exr", &unknown, level, "TYNDALL_SIMD"]);
    refused(&folder, 1, &changed("\"number\":2", "\"number\":7"), &["changed.exr", "cannot be read"]);
    refused(&folder, 1, &changed("\"first\":48", "\"first\":47"), &["changed.exr", "multiple of 16"]);
    refused(&folder, 1, &changed("\"first\":48", "\"first\":96"), &["changed.exr", "samples"]);
    refused(&folder, 1, &changed("state.next", "state.nixt"), &["changed.exr", "`state.next`"]);
    let cut = &part[..part.len() * 2 / 3];
    folder.put("out/changed.exr", cut);
    refused(&folder, 1, &["merge", "part1.exr", "changed.exr", "-o", "m.exr"], &["changed.exr"]);
}

#[test]
fn what_cannot_be_a_part_is_refused_on_the_command_line() {
    let folder = with_scene();
    let render = |options: &[&'static str]| [&["render", "../scene.toml"], options].concat();
    for (options, words) in [
        (&["--part", "1/2", "--time", "3", "-o", "a.exr"][..], ["--part", "--time"]),
        (&["--part", "1/2", "--target-error", "0.1", "-o", "a.exr"], ["--part", "--target-error"]),
        (&["--part", "1/2", "--resume", "a.exr", "-o", "a.exr"], ["--part", "--resume"]),
        (&["--part", "1/2"], ["--part", "-o FILE.exr"]),
        (&["--part", "1/2", "-o", "a.png"], ["--part", "-o FILE.exr"]),
        (&["--resumable", "-o", "a.png"], ["--resumable", "-o FILE.exr"]),
        (&["--part", "3/2", "-o", "a.exr"], ["3/2", "K/N"]),
        (&["--part", "0/2", "-o", "a.exr"], ["0/2", "K/N"]),
    ] {
        refused(&folder, 2, &render(options), &words);
    }
    refused(&folder, 2, &["merge", "-o", "a.exr"], &["PART"]);
    refused(&folder, 2, &["merge", "a.exr"], &["--output"]);
}
