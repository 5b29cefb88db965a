//! Runs that cannot finish: Ctrl-C, a full disk, an unwritable folder, a closed pipe. The message says so, and nothing
//! half-written is left behind.

mod support;

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::time::{Duration, Instant};
use support::{Ended, Folder, decode, files_in_out, written};
use tyndall_formats::image::{Metadata, read_metadata};

const SCENE: &str = "\
    volume.procedural = { kind = 'cloud', size = [12, 12, 12] }\n\
    film.size = [16, 16]\n\
    render.samples = 2\n";

fn with_scene() -> Folder {
    let folder = Folder::new();
    folder.put("scene.toml", SCENE);
    folder
}

/// Runs a command that must fail with status 1 and one message; returns the message.
fn fails(mut command: Command) -> String {
    let ended = command.stderr(Stdio::piped()).output().expect("the program runs");
    let stderr = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(1), "{stderr}");
    assert!(stderr.starts_with("tyndall: ") && stderr.lines().count() == 1, "{stderr}");
    stderr
}

/// Commands that write to standard output.
const TALKERS: [&[&str]; 7] = [
    &["schema"],
    &["presets"],
    &["completions", "bash"],
    &["info", "../scene.toml"],
    &["info", "../scene.toml", "--json"],
    &["render", "../scene.toml", "-o", "-"],
    &["render", "../scene.toml", "-o", "a.png", "--stats", "-"],
];

#[test]
fn a_closed_pipe_is_reported() {
    for arguments in TALKERS {
        let folder = with_scene();
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let mut command = folder.tyndall(arguments);
        command.stdout(writer);
        let message = fails(command);
        assert!(message.starts_with("tyndall: standard output: "), "{message}");
        assert!(!files_in_out(&folder).iter().any(|name| name.contains(".part")), "{arguments:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported() {
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    for arguments in TALKERS {
        let folder = with_scene();
        let mut command = folder.tyndall(arguments);
        command.stdout(full());
        let message = fails(command);
        assert!(message.contains("standard output: No space left"), "{message}");
    }
    let folder = with_scene();
    let message = fails(folder.tyndall(&["render", "../scene.toml", "-o", "a.png", "--stats", "/dev/full"]));
    assert!(message.contains("/dev/full: statistics cannot be written: No space left"), "{message}");
}

/// A disk that fills up in the middle of a picture, simulated by a limit on the size of files.
#[cfg(target_os = "linux")]
#[test]
fn a_picture_that_does_not_fit_leaves_nothing() {
    for kind in ["png", "jpg", "tif", "exr"] {
        let folder = with_scene();
        folder.put(&format!("out/a.{kind}"), "what was there before");
        let mut command = Command::new("sh");
        // Without the trap the signal ends the program; with it the write fails.
        command.args(["-c", "trap '' XFSZ; ulimit -f 1; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_tyndall")]);
        command.args(["render", "../scene.toml", "--size", "64x64", "-o", &format!("a.{kind}")]);
        command.current_dir(folder.at("out"));
        let message = fails(command);
        assert!(message.contains(&format!("a.{kind}: cannot write the picture: ")), "{message}");
        assert_eq!(files_in_out(&folder), [format!("a.{kind}")]);
        let left = std::fs::read(folder.at(&format!("out/a.{kind}"))).expect("a file");
        assert_eq!(left, b"what was there before", "{kind}");
    }
}

#[cfg(unix)]
#[test]
fn an_unwritable_folder_is_refused_before_the_work() {
    use std::os::unix::fs::PermissionsExt;
    let folder = with_scene();
    folder.put("out/closed/keep", "");
    let closed = folder.at("out/closed");
    std::fs::set_permissions(&closed, PermissionsExt::from_mode(0o555)).expect("its owner may");
    // Root can write there too; `/proc` takes no files even from root.
    let place = if std::fs::write(closed.join("try"), "").is_ok() { "/proc" } else { "closed" };
    for (option, name) in [("-o", "a.png"), ("--stats", "a.json")] {
        let place = format!("{place}/{name}");
        let arguments = ["render", "../scene.toml", "--samples", "2000000000", option, &place];
        let Ended { status, stdout, stderr, took, memory } = folder.run(&arguments);
        assert_eq!((status, stdout.as_slice()), (Some(2), &b""[..]), "{stderr}");
        assert!(stderr.contains(&place) && stderr.lines().count() == 1, "{stderr}");
        assert!(took < Duration::from_secs(5) && memory < 1 << 30, "{took:?}, {} MiB", memory >> 20);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn statistics_go_to_devices_and_pipes() {
    let folder = with_scene();
    let run = |place: &str| {
        let command = ["render", "../scene.toml", "-q", "-o", "a.png", "--stats", place];
        let ended = folder.tyndall(&command).output().expect("the program runs");
        assert!(
            ended.status.success() && ended.stderr.is_empty(),
            "{}",
            String::from_utf8_lossy(&ended.stderr)
        );
        ended.stdout
    };
    assert!(run("/dev/null").is_empty());
    assert!(!std::fs::metadata("/dev/null").expect("a device").is_file(), "it was replaced by a file");
    let report: serde_json::Value = serde_json::from_slice(&run("/dev/stdout")).expect("JSON");
    assert_eq!(report["integrator"], "path");
    let made = Command::new("mkfifo").arg(folder.at("out/pipe")).status().expect("mkfifo runs");
    assert!(made.success());
    let pipe = folder.at("out/pipe");
    let reader = std::thread::spawn(move || std::fs::read(pipe).expect("what was written"));
    run("pipe");
    let report: serde_json::Value = serde_json::from_slice(&reader.join().expect("a reader")).expect("JSON");
    assert_eq!(report["integrator"], "path");
}

#[cfg(unix)]
fn interrupt(process: u32) {
    let sent = Command::new("kill").args(["-INT", &process.to_string()]).status().expect("kill runs");
    assert!(sent.success());
}

/// A running render that has just loaded its scene, and the rest of its standard error.
#[cfg(unix)]
fn started(folder: &Folder, options: &[&str]) -> (Child, BufReader<ChildStderr>) {
    let arguments = ["render", "../scene.toml", "--samples", "2000000000", "-v", "-o", "a.png"];
    let mut command = folder.tyndall(&[&arguments[..], options].concat());
    let mut child = command.stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut line = String::new();
    stderr.read_line(&mut line).expect("a line");
    assert!(line.starts_with("tyndall: loaded in "), "{line}");
    (child, stderr)
}

/// Ends it by Ctrl-C; returns what it printed.
#[cfg(unix)]
fn interrupted((mut child, mut stderr): (Child, BufReader<ChildStderr>)) -> String {
    interrupt(child.id());
    let status = child.wait().expect("a status");
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).expect("text");
    assert_eq!(status.code(), Some(130), "{rest}");
    assert!(!rest.contains("panicked"), "{rest}");
    rest
}

/// Ctrl-C in the middle of a render: what has been rendered is written, and the exit status is that of an interrupt.
#[cfg(unix)]
#[test]
fn an_interrupted_render_leaves_a_readable_picture() {
    let folder = with_scene();
    let render = started(&folder, &[]);
    // Long enough for a pass over all 256 pixels.
    std::thread::sleep(Duration::from_millis(500));
    interrupted(render);
    assert_eq!(files_in_out(&folder), ["a.png"]);
    let (size, _, pixels) = decode(&written(&folder, "a.png"));
    assert!(size == [16, 16] && pixels.iter().any(|&x| x > 100), "{size:?}");
    let metadata = read_metadata(&folder.at("out/a.png")).expect("a picture").expect("metadata");
    let samples: u32 = metadata.get(Metadata::SAMPLES).expect("samples").parse().expect("a number");
    assert!((1..2_000_000_000).contains(&samples), "{samples}");
}

/// Ctrl-C in the middle of a film: the animation has the frames that were whole, and says how many they are.
#[cfg(unix)]
#[test]
fn an_interrupted_film_has_the_frames_so_far() {
    let folder = with_scene();
    let arguments =
        ["render", "../scene.toml", "--turntable", "100000", "-v", "-o", "a.apng", "--stats", "s.json"];
    let mut child = folder.tyndall(&arguments).stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut line = String::new();
    stderr.read_line(&mut line).expect("a line");
    // Long enough for a frame, and far from enough for all.
    std::thread::sleep(Duration::from_millis(500));
    interrupted((child, stderr));
    assert_eq!(files_in_out(&folder), ["a.apng", "s.json"]);
    let bytes = written(&folder, "a.apng");
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a PNG");
    let stated = reader.info().animation_control().expect("an animation").num_frames;
    assert!((1..100_000).contains(&stated), "{stated}");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    for frame in 0..stated {
        reader.next_frame(&mut pixels).unwrap_or_else(|e| panic!("frame {frame} of {stated}: {e}"));
    }
    assert!(reader.next_frame(&mut pixels).is_err(), "more than {stated} frames");
    let statistics: serde_json::Value = serde_json::from_slice(&written(&folder, "s.json")).expect("JSON");
    assert_eq!(statistics["frames"].as_array().map(Vec::len), Some(stated as usize));
}

/// Light paths of up to a million scatterings in white, dense matter: minutes before there is a first picture.
#[cfg(unix)]
#[test]
fn a_render_interrupted_before_its_first_sample_says_so() {
    let folder = with_scene();
    let white = "transfer_function.points=[{\"value\":0,\"opacity\":1,\"albedo\":1}]";
    let photon =
        ["--integrator", "photon", "--max-scatter", "1000000", "--set", white, "--set", "medium.density=900"];
    let render = started(&folder, &photon);
    std::thread::sleep(Duration::from_millis(200));
    let report = interrupted(render);
    assert_eq!(report, "tyndall: interrupted before there was anything to write\n");
    assert!(files_in_out(&folder).is_empty());
}

/// Ctrl-C repeatedly from the moment a picture file begins to be written: it is there whole, or not at all. On a fast
/// disk the signals may come too late; the clean-up itself is tested beside `atomic::abandon`.
#[cfg(unix)]
#[test]
fn a_picture_interrupted_while_it_is_written_is_whole_or_gone() {
    for attempt in 0..8 {
        let folder = with_scene();
        folder.put("out/keep", "");
        let arguments =
            ["render", "../scene.toml", "--size", "1600x1600", "--samples", "1", "-q", "-o", "a.exr"];
        let mut child =
            folder.tyndall(&arguments).stderr(Stdio::piped()).spawn().expect("the program starts");
        let begun = Instant::now();
        // Not the empty file that only tests whether the folder is writable.
        let begins = |name: &String| {
            let about = std::fs::metadata(folder.at("out").join(name));
            name.ends_with(".part") && about.is_ok_and(|about| about.len() > 0)
        };
        while !files_in_out(&folder).iter().any(begins) {
            assert!(begun.elapsed() < Duration::from_secs(60), "no picture begins");
            if child.try_wait().expect("a status").is_some() {
                break;
            }
        }
        for _ in 0..2 + attempt % 2 {
            if child.try_wait().expect("a status").is_none() {
                interrupt(child.id());
            }
        }
        let status = child.wait().expect("a status").code();
        assert!(matches!(status, Some(0 | 130)), "{status:?}");
        let mut left = files_in_out(&folder);
        left.retain(|name| name != "keep");
        assert!(left.is_empty() || left == ["a.exr"], "{left:?} after {status:?}");
    }
}
