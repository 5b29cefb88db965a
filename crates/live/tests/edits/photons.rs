//! Edits under `photon` that affect little, each in a case where a change could be overlooked.

use super::{THREADS, base, refined, scene};
use serde_json::{Value, json};
use tyndall::session::Session;
use tyndall_testing::SplitMix;

/// Edits a session to another document. Some segments must change and others not, and the picture must be that of a
/// new session.
#[track_caller]
fn assert_some_segments_change(live: &mut Session, value: &Value, name: &str) {
    live.set_scene(scene(value));
    let found = refined(live, 1);
    let segments = live.recomputed()[1].share;
    assert!(segments > 0.0 && segments < 0.9, "{name}: {segments} of the segments");
    assert!(found == refined(&mut Session::new(scene(value), THREADS.clone()), 1), "{name}");
}

/// Edits a session through several numbers, each of which gives the points of a transfer function, and checks each edit
/// as above.
#[track_caller]
fn assert_each_changes_some(
    value: &mut Value,
    points: impl Fn(f64) -> Value,
    [first, others @ ..]: [f64; 4],
) {
    value["transfer_function"]["points"] = points(first);
    let mut live = Session::new(scene(value), THREADS.clone());
    refined(&mut live, 1);
    for number in others {
        value["transfer_function"]["points"] = points(number);
        assert_some_segments_change(&mut live, value, &format!("{number} instead of {first}"));
    }
}

/// A few of many photons come and go, which changes only some sums, and those only slightly.
#[test]
fn few_of_many_photons_change_the_sums_beside_them() {
    let mut random = SplitMix::new(7);
    for round in 0..12 {
        let mut value = base("photon");
        value["transfer_function"]["points"][0]["value"] = 0.3.into();
        value["film"]["size"] = json!([48, 40]);
        value["render"]["max_scatter"] = 2.into();
        value["medium"]["majorant_cell"] = 1.into();
        // Emissive matter would have all its photons traced again.
        value["transfer_function"]["points"][2]["emission"] = 0.into();
        let estimate = ["point", "beam", "nearest"][round % 3];
        let spatial = ["cells", "axes"][round / 3 % 2];
        value["render"]["photon"] = json!({
            "photons": 60_000, "radius": 1.0, "segments": 20, "nearest": 20, "estimate": estimate, "spatial": spatial,
        });
        let mut live = Session::new(scene(&value), THREADS.clone());
        refined(&mut live, 1);
        for _ in 0..3 {
            // With a slightly lower probability of survival, a few photons disappear.
            value["transfer_function"]["points"][2]["albedo"] = (0.9 - 0.01 * random.uniform()).into();
            assert_some_segments_change(&mut live, &value, &format!("round {round}: {estimate}, {spatial}"));
        }
    }
}

/// In thin fog, the slices of beams extend far along the ray.
#[test]
fn wide_slices_ask_for_all_that_they_gather() {
    let mut value = base("photon");
    let point = |value: f64, opacity: f64, albedo: f64| json!({ "value": value, "opacity": opacity, "albedo": albedo });
    let points = |albedo: f64| {
        json!([
            point(0.0, 0.01, 1.0),
            point(0.59, 0.01, 1.0),
            point(0.6, 1.0, albedo),
            point(1.0, 1.0, albedo)
        ])
    };
    value["film"]["size"] = json!([48, 40]);
    value["camera"] = json!({ "auto": { "azimuth": 0, "elevation": 0 } });
    value["render"]["photon"] = json!({
        "photons": 20_000, "radius": 1.0, "segments": 20, "estimate": "beam", "gather_spacing": 4.0,
    });
    assert_each_changes_some(&mut value, points, [0.5, 0.49, 0.5, 0.48]);
}

/// A slight change of opacity moves hardly any photon, but changes the weight of each that is next to thinner matter.
#[test]
fn photons_that_stay_in_matter_that_changes() {
    let mut value = base("photon");
    let point = |value: f64, opacity: f64| json!({ "value": value, "opacity": opacity });
    let points = |opacity: f64| {
        json!([point(0.399, 0.1), point(0.4, opacity), point(0.45, opacity), point(0.451, 1.0)])
    };
    value["volume"]["interpolation"] = "nearest".into();
    value["film"]["size"] = json!([48, 40]);
    value["render"]["photon"] = json!({ "photons": 20_000, "radius": 2.0, "segments": 20 });
    assert_each_changes_some(&mut value, points, [0.5, 0.5001, 0.4999, 0.5003]);
}

/// A free flight depends on the majorant of a cell even if it meets none of the values that raise or lower it.
#[test]
fn majorants_that_few_values_raise_and_lower() {
    let mut value = base("photon");
    let point = |value: f64, opacity: f64| json!({ "value": value, "opacity": opacity });
    // A peak that determines most cells' majorants, and a band of values that few cells contain.
    let band = |opacity: f64| {
        let peak = [point(0.3, 0.2), point(0.4, 0.6), point(0.41, 0.6), point(0.45, 0.2)];
        let band = [point(0.65, 0.2), point(0.66, opacity), point(0.68, opacity), point(0.69, 0.2)];
        json!([peak, band].concat())
    };
    value["render"]["photon"] = json!({ "photons": 3000 });
    value["medium"]["majorant_cell"] = 4.into();
    value["transfer_function"]["points"] = band(0.3);
    let mut live = Session::new(scene(&value), THREADS.clone());
    refined(&mut live, 1);
    for opacity in [0.9, 0.7, 0.95, 0.3] {
        value["transfer_function"]["points"] = band(opacity);
        live.set_scene(scene(&value));
        let found = refined(&mut live, 1);
        let paths = live.recomputed()[0].share;
        assert!(paths > 0.0 && paths < 1.0, "opacity {opacity}: {paths} of the paths");
        assert!(found == refined(&mut Session::new(scene(&value), THREADS.clone()), 1), "opacity {opacity}");
    }
}

/// What an edit changed is not forgotten at the next one if no picture was made between them.
#[test]
fn edits_that_follow_each_other_without_a_picture() {
    let mut value = base("photon");
    let point = |value: f64, albedo: f64| json!({ "value": value, "opacity": 0.3, "albedo": albedo });
    let points = |[low, high]: [f64; 2]| json!([point(0.0, low), point(0.4, low), point(0.4, high)]);
    value["volume"] =
        json!({ "procedural": { "kind": "shells", "size": [20, 20, 20] }, "interpolation": "nearest" });
    // No photon comes or goes, so that segments learn of edits only from the values.
    value["render"]["max_scatter"] = 1.into();
    value["render"]["photon"] = json!({ "photons": 3000, "segments": 20, "radius": 0.5 });
    value["transfer_function"]["points"] = points([0.9, 0.9]);
    let mut live = Session::new(scene(&value), THREADS.clone());
    refined(&mut live, 1);
    for [first, second] in [[[0.5, 0.9], [0.5, 0.4]], [[0.5, 0.8], [0.6, 0.8]]] {
        value["transfer_function"]["points"] = points(first);
        live.set_scene(scene(&value));
        value["transfer_function"]["points"] = points(second);
        live.set_scene(scene(&value));
        let found = refined(&mut live, 1);
        assert!(found == refined(&mut Session::new(scene(&value), THREADS.clone()), 1), "{second:?}");
    }
}

/// When a light is removed, the others get more paths, each of which carries less flux.
#[test]
fn paths_that_stay_among_more_weigh_less() {
    let mut value = base("photon");
    value["film"]["size"] = json!([48, 40]);
    value["render"]["max_scatter"] = 1.into();
    // Paths of the three lights and of the emission are kept in blocks of 65,536 each. With a small radius, few cells
    // hold photons of two lights.
    value["render"]["photon"] = json!({ "photons": 280_000, "segments": 20, "radius": 0.1 });
    let mut live = Session::new(scene(&value), THREADS.clone());
    refined(&mut live, 1);
    value["lights"].as_array_mut().unwrap().pop();
    live.set_scene(scene(&value));
    let found = refined(&mut live, 1);
    let paths = live.recomputed()[0].share;
    assert!(paths > 0.0 && paths < 0.9, "{paths} of the paths");
    assert!(found == refined(&mut Session::new(scene(&value), THREADS.clone()), 1));
}

/// A light's random numbers, and its place in the sum of photons, follow from its name, not from the document's order.
#[test]
fn the_order_of_named_lights_moves_no_photon() {
    let mut value = base("photon");
    value["lights"][1]["name"] = "sky".into();
    value["render"]["photon"] = json!({ "photons": 3000 });
    let mut live = Session::new(scene(&value), THREADS.clone());
    let before = refined(&mut live, 1);
    value["lights"].as_array_mut().unwrap().reverse();
    live.set_scene(scene(&value));
    assert!(refined(&mut live, 1) == before);
    assert!(live.recomputed().iter().all(|work| work.share == 0.0), "{:?}", live.recomputed());
    assert!(refined(&mut Session::new(scene(&value), THREADS.clone()), 1) == before);
}

/// A light's random numbers follow from its name: another name gives that light, and no other, different paths.
#[test]
fn a_light_by_another_name_sends_other_photons() {
    let mut value = base("photon");
    value["render"]["photon"] = json!({ "photons": 3000 });
    let mut live = Session::new(scene(&value), THREADS.clone());
    let before = refined(&mut live, 1);
    for name in [Some("lamp"), None, Some("spot")] {
        let light = value["lights"][2].as_object_mut().unwrap();
        light.remove("name");
        light.extend(name.map(|name| ("name".into(), name.into())));
        live.set_scene(scene(&value));
        let found = refined(&mut live, 1);
        assert!(found != before, "{name:?}");
        assert!(found == refined(&mut Session::new(scene(&value), THREADS.clone()), 1), "{name:?}");
        let paths = live.recomputed()[0].share;
        assert!(paths > 0.0 && paths < 1.0, "{paths} of the paths");
    }
}

/// The largest width of a beam's slices follows from the steps, and the steps follow from the density.
#[test]
fn slices_that_an_edit_of_density_widens_ask_for_all_that_they_gather() {
    let mut value = base("photon");
    let opacity = |value: f64, opacity: f64| json!({ "value": value, "opacity": opacity });
    let lamp = |name: &str, position: [f64; 3], intensity: f64| json!({ "type": "point", "name": name, "position": position, "intensity": [intensity, 1, 1] });
    value["transfer_function"]["points"] = json!([opacity(0.0, 0.3), opacity(1.0, 1.0)]);
    value["medium"]["density"] = 200.into();
    value["render"]["max_scatter"] = 1.into();
    value["render"]["photon"] = json!({
        "photons": 2000, "radius": 0.5, "estimate": "beam", "steps_per_voxel": 0.1, "gather_spacing": 0.1,
    });
    value["lights"] = json!([lamp("a", [20.0, 5.0, 0.0], 100.0), lamp("b", [0.0, 0.0, 8.0], 1.0)]);
    let mut live = Session::new(scene(&value), THREADS.clone());
    refined(&mut live, 1);
    value["medium"]["density"] = 0.01.into();
    live.set_scene(scene(&value));
    refined(&mut live, 1);
    value["lights"][1] = lamp("b", [0.0, 0.0, 8.0], 2.0);
    live.set_scene(scene(&value));
    assert_some_segments_change(&mut live, &value, "a brighter lamp");
}

/// A peak so narrow that no step of a view ray ends in it changes the steps whose ends lie on both sides of it.
#[test]
fn values_between_the_ends_of_steps() {
    let mut value = base("photon");
    let point = |value: f64, opacity: f64| json!({ "value": value, "opacity": opacity, "emission": 1 });
    let points = |opacity: f64| json!([point(0.4999, 0.0), point(0.5, opacity), point(0.5001, 0.0)]);
    value["volume"] = json!({ "procedural": { "kind": "sphere", "size": [20, 20, 20] } });
    value["film"]["size"] = json!([32, 32]);
    value["medium"]["density"] = 900.into();
    value["render"]["max_scatter"] = 0.into();
    assert_each_changes_some(&mut value, points, [0.5, 0.6, 0.5, 0.4]);
}

/// A ball that scatters in shells thinner than a gather.
fn shells(value: &mut Value) {
    *value = base("photon");
    value["volume"] = json!({ "procedural": { "kind": "sphere", "size": [20, 20, 20] } });
    value["film"]["size"] = json!([32, 32]);
    value["medium"]["density"] = 100.into();
    value["render"]["photon"] = json!({ "photons": 60_000, "segments": 20 });
}

/// A function with narrow peaks has gathers look for matter in another way, even far from the peak.
#[test]
fn peaks_that_come_and_go() {
    let mut value = Value::Null;
    shells(&mut value);
    let point = |value: f64, opacity: f64| json!({ "value": value, "opacity": opacity });
    let steps = [
        json!([point(0.2, 0.0), point(0.6, 0.3)]),
        json!([point(0.2, 0.0), point(0.6, 0.3), point(5.0, 0.3), point(5.001, 0.4), point(5.002, 0.3)]),
    ];
    value["transfer_function"]["points"] = steps[0].clone();
    let mut live = Session::new(scene(&value), THREADS.clone());
    refined(&mut live, 1);
    for round in 1..4 {
        value["transfer_function"]["points"] = steps[round % 2].clone();
        live.set_scene(scene(&value));
        let found = refined(&mut live, 1);
        assert!(found == refined(&mut Session::new(scene(&value), THREADS.clone()), 1), "round {round}");
    }
}
