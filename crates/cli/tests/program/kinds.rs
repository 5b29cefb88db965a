//! The look that is chosen for a volume without a scene.

use crate::data::Data;
use crate::support::{Folder, json, run};

/// The preset that `info` tells, of samples stored as `short`.
fn preset(data: &Data) -> String {
    let folder = Folder::new();
    folder.put("a.nrrd", data.nrrd("short"));
    let report = json(&run(&folder, &["info", "../a.nrrd", "--json"]));
    report["preset"].as_str().expect("a name").to_owned()
}

/// Numbers from 0 to 1 without a pattern.
fn noise([x, y, z]: [f64; 3]) -> f64 {
    (x * 127.1 + y * 311.7 + z * 74.7).sin().rem_euclid(1e-4) * 1e4
}

#[test]
fn only_scans_with_air_in_anatomical_space_are_ct() {
    let wide = |p: [f64; 3]| noise(p) + noise([p[1], p[2], p[0]]) + noise([p[2], p[0], p[1]]) - 1.5;
    let radius = |[x, y, z]: [f64; 3]| (x * x + y * y + z * z).sqrt();
    let scan = move |padding: f64| {
        Data::new(24, move |p| match radius(p) {
            r if r > 1.2 => padding,
            r if r > 0.8 => -1000.0 + 30.0 * wide(p),
            r if r > 0.5 => 40.0 + 30.0 * wide(p),
            _ => 800.0 + 90.0 * wide(p),
        })
    };
    for padding in [-1000.0, -1024.0, -2000.0, -3024.0, -32_768.0] {
        assert_eq!(preset(&scan(padding).anatomical()), "ct-bone", "padded with {padding}");
    }
    assert_ne!(preset(&scan(-1000.0)), "ct-bone", "without a space");
    let others = [
        ("seismic", Data::new(24, move |p| (2333.0 * wide(p)).round())),
        ("phase", Data::new(24, |p| (noise(p) * 8192.0 - 4096.0).round())),
        ("terrain", Data::new(24, |p| (noise(p) * 4000.0 - 1000.0).round())),
    ];
    for (name, data) in others {
        assert_ne!(preset(&data), "ct-bone", "{name}");
        assert_ne!(preset(&data.anatomical()), "ct-bone", "{name} in anatomical space");
    }
}
