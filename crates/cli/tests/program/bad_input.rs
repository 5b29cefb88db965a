//! Bad input ends with the right exit status and one message that names the fault: 1 where the input is at fault, 2
//! where the command line is. Nothing panics, nothing hangs, nothing is left behind, and no run takes a gibibyte.

use crate::fault::{Fault, SCENE, file, options, toml};

#[test]
fn a_key_at_fault_is_named_with_its_file() {
    for (key, line) in [
        ("medium.densty", "medium.densty = 1"),
        ("camra", "camra = {}"),
        ("objects", "objects = [{ path = 'a.ply' }]"),
        ("surfaces", "surfaces = [{ type = 'plane' }]"),
        ("version", "version = 2"),
        ("version", "version = '1'"),
        ("medium", "medium = 3"),
        ("medium.density", "medium.density = -1"),
        ("medium.density", "medium.density = inf"),
        ("medium.density", "medium.density = nan"),
        ("medium.phase.type", "medium.phase.type = 'mie'"),
        ("medium.phase.g", "medium.phase = { type = 'henyey-greenstein', g = 1 }"),
        ("medium.phase.k", "medium.phase = { type = 'schlick', k = -1.0 }"),
        ("medium.brdf", "medium.brdf = { type = 'abc', b = 0 }"),
        ("transfer_function.points", "transfer_function.points = []"),
        (
            "transfer_function.points.1.value",
            "transfer_function.points = [{ value = 1, opacity = 0 }, { value = 0, opacity = 1 }]",
        ),
        ("transfer_function.points.0.value", "transfer_function.points = [{ value = 1e300, opacity = 0 }]"),
        ("transfer_function.points.0.opacity", "transfer_function.points = [{ value = 0, opacity = 1.5 }]"),
        ("transfer_function.points.0.opacity", "transfer_function.points = [{ value = 0 }]"),
        (
            "transfer_function.points.0.albedo.2",
            "transfer_function.points = [{ value = 0, opacity = 1, albedo = [0, 1, 2] }]",
        ),
        (
            "transfer_function.points.0.ior",
            "transfer_function.points = [{ value = 0, opacity = 1, ior = 0 }]",
        ),
        (
            "transfer_function",
            "transfer_function = { preset = 'mri', points = [{ value = 0, opacity = 1 }] }",
        ),
        ("transfer_function.preset", "transfer_function.preset = 'no-such'"),
        ("lights", "lights = 3"),
        ("lights.0.type", "lights = [{ radiance = 1 }]"),
        ("lights.0.type", "lights = [{ type = 'spot' }]"),
        ("lights.0.position.1", "lights = [{ type = 'point', position = [0, -inf, 0], intensity = 1 }]"),
        ("lights.0.intensity", "lights = [{ type = 'point', position = [0, 0, 0] }]"),
        ("lights.0.radiance", "lights = [{ type = 'environment', radiance = 3e38 }]"),
        ("lights.0.radiance.2", "lights = [{ type = 'environment', radiance = [1, 1, 1.1e18] }]"),
        ("lights.0.intensity", "lights = [{ type = 'point', position = [0, 0, 0], intensity = 2e18 }]"),
        (
            "lights.0.irradiance",
            "lights = [{ type = 'directional', direction = [0, 0, 1], irradiance = 1e30 }]",
        ),
        (
            "transfer_function.points.0.emission",
            "transfer_function.points = [{ value = 0, opacity = 1, emission = 2e18 }]",
        ),
        ("film.background", "film.background = 1e19"),
        ("lights.0.direction", "lights = [{ type = 'directional', direction = [0, 0, 0], irradiance = 1 }]"),
        (
            "lights.0.target",
            "lights = [{ type = 'disk', position = [1, 1, 1], target = [1, 1, 1], radius = 1, radiance = 1 }]",
        ),
        (
            "lights.0.size.0",
            "lights = [{ type = 'rect', position = [0, 0, 9], target = [0, 0, 0], size = [0, 1], radiance = 1 }]",
        ),
        ("lights.0", "lights = [{ type = 'environment' }]"),
        ("lights.0", "lights = [{ type = 'environment', radiance = 1, map = 'a.exr' }]"),
        ("lights.0.map", "lights = [{ type = 'environment', map = 'no-such.exr' }]"),
        ("lights.0.map", "lights = [{ type = 'environment', map = 'eight.raw' }]"),
        ("clip.0.normal", "clip = [{ type = 'plane', point = [0, 0, 0], normal = [0, 0, 0] }]"),
        ("clip.0.min", "clip = [{ type = 'box', min = [0, 0, 0], max = [1, 0, 1] }]"),
        ("camera", "camera = { auto = {}, position = [0, 0, 9] }"),
        ("camera.target", "camera = { position = [1, 1, 1], target = [1, 1, 1] }"),
        ("camera.position", "camera.position = [0, 0, 0]"),
        ("camera.up", "camera = { position = [0, 0, 9], target = [0, 0, 0], up = [0, 0, 1] }"),
        ("camera.up", "camera = { position = [0, 0, 9], up = [0, 0, 1] }"),
        ("camera.fov", "camera.fov = 180"),
        ("camera.fov", "camera.fov = 1e-30"),
        ("camera.fov", "camera = { type = 'orthographic', fov = 30 }"),
        ("film.size.0", "film.size = [0, 4]"),
        ("film.size", "film.size = [1000000, 1000000]"),
        ("film.size", "film.size = [4294967295, 4294967295]"),
        ("film.size.1", "film.size = [1, 4294967296]"),
        ("film.size.0", "film.size = [-1, 4]"),
        ("film.size.0", "film.size = [nan, 4]"),
        ("film.exposure", "film.exposure = inf"),
        ("film.background", "film.background = 'black'"),
        ("render.integrator", "render.integrator = 'many-light'"),
        ("render.integrator", "render.integrator = 'bidirectional'"),
        ("render.many_light", "render.many_light.lights = 1000"),
        ("render.photon.photons", "render.photon.photons = 0"),
        ("render.photon.photons", "render.integrator = 'photon'\nrender.photon.photons = 268435456"),
        ("render.photon.radius", "render.photon.radius = 0"),
        ("render.photon.segments", "render.photon.segments = 257"),
        ("render.photon.history_bits", "render.photon.history_bits = 65"),
        ("render.photon.nearest", "render.photon.nearest = 1"),
        ("render.photon.estimate", "render.photon.estimate = 'cone'"),
        ("render.photon.spatial", "render.photon.spatial = 'axis'"),
        ("render.max_scatter", "render.max_scatter = 1000001"),
        ("render.seed", "render.seed = -1"),
    ] {
        toml(format!("{SCENE}{line}\n"), &["scene.toml", key]);
    }
}

#[test]
fn a_volume_that_cannot_be_had_is_named() {
    for (says, volume) in [
        (["scene.toml", "volume"], ""),
        (["scene.toml", "neither `path` nor `procedural`"], "volume = {}"),
        (["scene.toml", "both `path` and `procedural`"], "volume = { path = 'eight.raw', procedural = {} }"),
        (["scene.toml", "volume.path"], "volume.path = ''"),
        (
            ["scene.toml", "volume.raw"],
            "volume = { procedural = {}, raw = { dims = [1, 1, 1], dtype = 'u8' } }",
        ),
        (
            ["scene.toml", "volume.raw.dtype"],
            "volume = { path = 'eight.raw', raw = { dims = [2, 2, 2], dtype = 'u7' } }",
        ),
        (["scene.toml", "volume.procedural.size"], "volume.procedural.size = [100000, 100000, 100000]"),
        (["scene.toml", "volume.procedural.size"], "volume.procedural.size = [4294967295, 1, 1]"),
        (["scene.toml", "volume.procedural.size"], "volume.procedural.size = [4096, 4096, 4096000]"),
        (["scene.toml", "volume.procedural.size.1"], "volume.procedural.size = [1, 0, 1]"),
        (["scene.toml", "volume.procedural.size.2"], "volume.procedural.size = [1, 1, -1]"),
        (["no-such.nrrd", "No such file"], "volume.path = 'no-such.nrrd'"),
        (["a\\u{0}b.nrrd", "NUL byte"], "volume.path = \"a\\u0000b.nrrd\""),
        (["a\\u{1b}[31m\\n.nrrd", "No such file"], "volume.path = \"a\\u001b[31m\\n.nrrd\""),
        (
            ["scene.toml", "volume.raw.spacing.0"],
            "volume = { path = 'eight.raw', raw = { dims = [2, 2, 2], dtype = 'u8', spacing = [0, 1, 1] } }",
        ),
        (
            ["scene.toml", "volume.raw.spacing.2"],
            "volume = { path = 'eight.raw', raw = { dims = [2, 2, 2], dtype = 'u8', spacing = [1, 1, -1] } }",
        ),
        (
            ["scene.toml", "volume.raw.spacing.1"],
            "volume = { path = 'eight.raw', raw = { dims = [2, 2, 2], dtype = 'u8', spacing = [1, nan, 1] } }",
        ),
        (
            ["scene.toml", "volume.raw.origin.1"],
            "volume = { path = 'eight.raw', raw = { dims = [2, 2, 2], dtype = 'u8', origin = [0, inf, 0] } }",
        ),
        (
            ["scene.toml", "volume.raw.dims.0"],
            "volume = { path = 'eight.raw', raw = { dims = [0, 2, 2], dtype = 'u8' } }",
        ),
        (
            ["eight.raw", "8 bytes"],
            "volume = { path = 'eight.raw', raw = { dims = [65536, 65536, 65536], dtype = 'f64' } }",
        ),
        (
            ["eight.raw", "16777216 voxels"],
            "volume = { path = 'eight.raw', raw = { dims = [4294967295, 4294967295, 4294967295], dtype = 'u8' } }",
        ),
        (
            ["eight.raw", "0 bytes"],
            "volume = { path = 'eight.raw', raw = { dims = [2, 2, 2], dtype = 'u8', offset = 99999999999 } }",
        ),
        (["a folder", "expected a regular file"], "volume.path = '.'"),
        (["eight.raw", "state their layout"], "volume.path = 'eight.raw'"),
        (
            ["eight.raw", "8 bytes"],
            "volume = { path = 'eight.raw', raw = { dims = [3, 3, 3], dtype = 'u8' } }",
        ),
        (
            ["medium.density", "1000"],
            "volume = { path = 'eight.raw', raw = { dims = [2, 2, 2], dtype = 'u8', spacing = [1e8, 1e8, 1e8] } }",
        ),
        (
            ["eight.raw", "spacing"],
            "volume = { path = 'eight.raw', raw = { dims = [2, 2, 2], dtype = 'u8', spacing = [1e99, 1, 1] } }",
        ),
    ] {
        toml(volume.to_owned(), &says);
    }
}

#[test]
fn a_malformed_scene_is_named_with_the_place() {
    file("../a.toml", "medium = {\n", &["a.toml", "line"]);
    file("../a.toml", "medium.density = 1\nmedium.density = 2\n", &["a.toml", "line 2"]);
    file("../a.toml", (0..=255).collect::<Vec<u8>>(), &["a.toml", "byte 128", "UTF-8"]);
    file("../a.toml", format!("x = {}{}", "[".repeat(99_999), "]".repeat(99_999)), &["a.toml", "line 1"]);
    file("../a.json", "", &["a.json", "line 1"]);
    file("../a.json", "{\"volume\": ", &["a.json", "line 1"]);
    file("../a.json", "[".repeat(99_999), &["a.json", "line 1"]);
    file("../a.json", "{\"a\":".repeat(99_999), &["a.json", "line 1"]);
    file("../a.json", format!("{{\"version\": 1{}}}", "0".repeat(999_999)), &["a.json", "line 1"]);
    file("../a.json", "{\"version\": 1e999}", &["a.json", "line 1"]);
    file("../a.json", "{\"version\": 1e99}", &["a.json", "version"]);
    file("../a.toml", format!("version = 1{}", "0".repeat(99_999)), &["a.toml", "line 1"]);
    file("../a.toml", format!("{} = 1", "x".repeat(999_999)), &["a.toml", "xxx..."]);
    file("../a.toml", "\"\\u001b[2J\" = 1", &["a.toml", "\\u{1b}[2J"]);
    file("../a.toml", "\"\\n\\ntyndall: all is well\" = 1", &["a.toml", "\\n\\ntyndall"]);
    file("../a.json", "\u{feff}{\"volume\": 1}", &["a.json", "volume"]);
    file("../a.toml", "\u{feff}version = 1\r\nvolume = 1\r\n", &["a.toml", "volume"]);
    file("../a.toml", "version = 1\0\n", &["a.toml", "line 1"]);
    file("../a.toml", "version = 1\rvolume = {}\r", &["a.toml", "line 1"]);
    file("../a.json", "[]", &["a.json", "found a list"]);
    file("../a.json", "null", &["a.json", "found null"]);
    file("../a.json", "{}", &["a.json", "volume"]);
    file("../a.json", "{\"volume\": {\"procedural\": {}}, \"camera\": null}", &["a.json", "camera"]);
    for name in ["no-such.toml", "no-such.json", "no-such.png", "no-such.nrrd"] {
        let arguments = vec!["render", name];
        Fault { files: Vec::new(), arguments, status: 1, says: vec![name, "No such file"] }.check();
    }
    for folder in ["../scene.toml", "..", "."] {
        let files = vec![("scene.toml/file", Vec::new())];
        Fault { files, arguments: vec!["render", folder], status: 1, says: vec!["file", folder] }.check();
    }
}

#[test]
fn a_picture_without_a_scene_is_named() {
    file("../a.png", "", &["a.png", "no picture"]);
    file("../a.png", "hello", &["a.png", "no picture"]);
    file("../a.png", b"\x89PNG\r\n\x1a\n\0\0", &["a.png", "PNG"]);
    file("../a.jpg", b"\xff\xd8\xff\xd9\0\0\0\0", &["a.jpg", "scene"]);
    file("../a.tif", b"II\x2a\0\xff\xff\xff\xff", &["a.tif", "TIFF"]);
    // For this length a library printed to standard error, and allocated the memory.
    let text = b"II\x2a\0\x08\0\0\0\x01\0\x0e\x01\x02\0\xff\xff\xff\x7f\x08\0\0\0";
    file("../a.tif", text, &["a.tif", "a description of 2147483647 bytes"]);
    file("../a.exr", b"\x76\x2f\x31\x01\x02\0\0\0", &["a.exr", "OpenEXR"]);
}

#[test]
fn an_option_at_fault_is_named() {
    for (option, value) in [
        ("--size", "0x0"),
        ("--size", "640"),
        ("--size", "64x64x64"),
        ("--size", "4294967296x1"),
        ("--samples", "0"),
        ("--samples", "1.5"),
        ("--samples", "4294967295"),
        ("--time", "0"),
        ("--time", "inf"),
        ("--target-error", "nan"),
        ("--target-error", "small"),
        ("--threads", "0"),
        ("--threads", "65535"),
        ("--seed", "18446744073709551616"),
        ("--max-scatter", "1000001"),
        ("--integrator", "many-light"),
        ("--preset", "no-such"),
        ("--set", "medium.density"),
        ("--set", "medium..density=1"),
        ("--set", "lights.5.radiance=1"),
        ("--set", "lights.first.radiance=1"),
    ] {
        options(&[option, value], 2, &[option, value]);
    }
    options(&["--quiet", "--verbose"], 2, &["--quiet", "--verbose"]);
    options(&["--sample", "3"], 2, &["--sample", "--samples"]);
    for (arguments, says) in [
        (vec!["render"], "<INPUT>"),
        (vec!["paint"], "'paint'"),
        (vec!["completions", "no-such"], "'no-such'"),
        (vec!["presets", "all"], "'all'"),
        (vec!["bench", "core", "a.nrrd"], "only `looks`"),
        (vec!["bench", "looks", "--data", ".."], "`scans` of `historygrams`"),
        (vec!["bench", "historygrams", "--data", ".."], "neither ct_chest_aorta_i16.nrrd nor ct_head"),
        (vec!["bench", "looks", "--table", "scans"], "expected one of edits, look"),
        (vec!["bench", "all", "--quiet", "--progress"], "'--quiet'"),
    ] {
        Fault { files: Vec::new(), arguments, status: 2, says: vec![says] }.check();
    }
}

#[test]
fn a_value_set_to_something_invalid_is_the_inputs_fault() {
    for (assignment, key) in [
        ("medium.densty=1", "medium.densty"),
        ("medium.density=-1", "medium.density"),
        ("medium.density=dense", "medium.density"),
        ("medium.density.x=1", "medium.density"),
        ("lights=[1]", "lights.0"),
        ("lights.0.radiance=1", "lights.0.type"),
        ("lights.0.type=point", "lights.0.position"),
        ("transfer_function.preset=no-such", "transfer_function.preset"),
        ("transfer_function.points=[]", "transfer_function.points"),
        ("film.size=[1000000,1000000]", "film.size"),
        ("render.integrator=many-light", "render.integrator"),
        ("camera.position=[0,0,0]", "camera.position"),
        ("volume=null", "volume"),
        ("volume.path=no-such.nrrd", "no-such.nrrd"),
    ] {
        options(&["--set", assignment], 1, &[key]);
    }
    for (assignment, says) in [
        (r#"camera={"position":[0,0,0]}"#, "is also the target"),
        (r#"camera={"position":[0,0,1e30]}"#, "1e30 from the target; expected 1e-15 to 1e15"),
        (r#"camera={"position":[1e12,0,0],"target":[1e12,0,1]}"#, "1e0 from the target, too little"),
    ] {
        options(&["--set", assignment], 1, &["camera.position", says]);
    }
    options(&["--size", "1000000x1000000"], 1, &["film.size", "pixels"]);
}

#[test]
fn an_unwritable_output_is_refused_before_the_work() {
    for (place, says) in [
        ("no/such/a.png", "create the folder"),
        ("a.bmp", ".png"),
        ("a", ".png"),
        ("..", ".png"),
        ("../scene.toml/a.png", "is not a folder"),
        ("../folder.png", "it is a folder"),
    ] {
        let files = vec![("scene.toml", SCENE.into()), ("folder.png/file", Vec::new())];
        let arguments = vec!["render", "../scene.toml", "-o", "good.png", "-o", place];
        Fault { files, arguments, status: 2, says: vec![place, says] }.check();
    }
    // Longer than any file system allows; also refused before the work.
    let name: &str = Box::leak(format!("{}.png", "a".repeat(300)).into_boxed_str());
    options(&["-o", name], 2, &["aaa...aaa", "aaa.png", "shorter"]);
    for place in ["no/such/a.json", "..", "../scene.toml/a.json"] {
        options(&["--stats", place], 2, &["--stats", place, "statistics"]);
    }
    options(&["-o", "-", "-o", "-"], 2, &["`-`", "twice"]);
    options(&["-o", "-", "--stats", "-"], 2, &["`-`", "twice"]);
    options(&["-o", "a.png", "--stats", "./a.png"], 2, &["a.png", "twice"]);
}

#[test]
fn arguments_are_quoted_short_and_without_control_characters() {
    options(&["--size", "\u{1b}[2J\n4x"], 2, &["--size", "\\u{1b}[2J\\n4x"]);
    options(&["--size=\u{1b}[2J"], 2, &["--size", "\\u{1b}[2J"]);
    options(&["--set", "\u{1b}[2J"], 2, &["--set", "\\u{1b}[2J"]);
    options(&["--\u{7}bell"], 2, &["\\u{7}bell"]);
    options(&["-o", "a\u{7}.bmp"], 2, &["a\\u{7}.bmp"]);
    let long: &str = Box::leak("x".repeat(100_000).into_boxed_str());
    options(&["--size", long], 2, &["--size", "xxx..."]);
    options(&["--set", long], 2, &["--set", "xxx..."]);
    let arguments = vec!["render", "no\nsuch.nrrd"];
    Fault { files: Vec::new(), arguments, status: 1, says: vec!["no\\nsuch.nrrd"] }.check();
    let arguments = vec!["render", long, "-o", "a.png"];
    Fault { files: Vec::new(), arguments, status: 1, says: vec!["xxx...xxx", "too long"] }.check();
}

#[test]
fn info_reports_faults_as_render_does() {
    let files = vec![("scene.toml", format!("{SCENE}medium.densty = 1\n").into_bytes())];
    let arguments = vec!["info", "../scene.toml", "--json"];
    Fault { files, arguments, status: 1, says: vec!["scene.toml", "medium.densty", "`density`"] }.check();
    let arguments = vec!["info", "no-such.nrrd"];
    Fault { files: Vec::new(), arguments, status: 1, says: vec!["no-such.nrrd"] }.check();
}
