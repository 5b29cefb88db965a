//! Matter whose values lie between those of neighbouring samples is seen, by every method.

use crate::data::{Data, Way, mean, picture, ways};
use crate::support::Folder;
use serde_json::{Value, json};
use tyndall::film::Image;

/// Voxels along an edge of the volume.
const EDGE: u16 = 24;

/// A ball whose values fall from 40 to -1000 over two voxels, as HU; then scaled and moved.
fn ball(scale: f64, offset: f64) -> Data {
    Data::new(EDGE, move |[x, y, z]| {
        let radius = 0.5 * f64::from(EDGE) * (x * x + y * y + z * z).sqrt();
        offset + scale * (40.0 - 1040.0 * (0.5 * (radius - 7.0)).clamp(0.0, 1.0))
    })
}

/// A view along an axis, and one along which the field bends three times a voxel.
const VIEWS: [[f64; 3]; 2] = [[0.0, 0.0, 60.0], [36.0, 31.0, 35.0]];

/// A peak of opacity that glows red, in matter that would glow blue; emission only.
struct Peak {
    width: f64,
    middle: f64,
    density: f64,
    view: [f64; 3],
}

impl Peak {
    const HALFWAY: Self = Self { width: 40.0, middle: -500.0, density: 6.0, view: VIEWS[0] };

    /// The document, with values as those of [`ball`].
    fn look(&self, scale: f64, offset: f64) -> Value {
        let point = |value: f64, opacity: f64, emission: [f64; 3]| json!({ "value": offset + scale * value, "opacity": opacity, "albedo": 0, "emission": emission });
        let (blue, red) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let (from, to) = (self.middle - 0.5 * self.width, self.middle + 0.5 * self.width);
        let mut points = vec![
            point(from - 1.0, 0.0, blue),
            point(from, 0.0, red),
            point(self.middle, 1.0, red),
            point(to, 0.0, red),
            point(to + 1.0, 0.0, blue),
        ];
        if scale < 0.0 {
            points.reverse();
        }
        let middle = 0.5 * (f64::from(EDGE) - 1.0);
        json!({
            "transfer_function": { "points": points },
            "medium": { "density": self.density },
            "lights": [],
            "camera": { "type": "orthographic", "position": self.view.map(|x| middle + x), "target": [middle, middle, middle], "up": [0.1, 1, 0.2], "height": 20 },
            "film": { "size": [24, 24], "background": "transparent" },
            "render": { "max_scatter": 0 },
        })
    }
}

/// The means of red, blue and alpha.
fn seen(image: &Image) -> [f64; 3] {
    let [red, _, blue] = mean(image);
    let alpha = image.rgba.iter().map(|pixel| f64::from(pixel[3])).sum::<f64>();
    [red, blue, alpha / image.rgba.len() as f64]
}

fn with_samples(look: &Value, way: Way) -> Value {
    let samples = match way.method {
        "path" => 600,
        "photon" => 8,
        _ => 32,
    };
    tyndall_live::document::apply(look, &json!({ "render": { "samples": samples } }))
}

/// The best path tracing, and all ways of the methods that march.
fn truth_and_marches() -> (Way, Vec<Way>) {
    let (paths, marches) = ways().into_iter().partition::<Vec<_>, _>(|way| way.method == "path");
    (*paths.last().expect("path"), marches)
}

#[test]
fn a_peak_between_two_samples_is_seen_by_every_method() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(1.0, 0.0).nrrd("short"));
    let (truth, marches) = truth_and_marches();
    let widths = [10.0, 40.0, 200.0].map(|width| Peak { width, ..Peak::HALFWAY });
    let near_ends =
        [-980.0, 20.0].map(|middle| Peak { width: 10.0, middle, view: VIEWS[1], ..Peak::HALFWAY });
    let askew = Peak { width: 10.0, view: VIEWS[1], ..Peak::HALFWAY };
    let dense = Peak { density: 120.0, view: VIEWS[1], ..Peak::HALFWAY };
    for peak in widths.into_iter().chain(near_ends).chain([askew, dense]) {
        let Peak { width, middle, density, view } = peak;
        let look = peak.look(1.0, 0.0);
        let [expected, _, alpha] = seen(&picture(&folder, "a.nrrd", &with_samples(&look, truth), truth));
        assert!(alpha > 0.02, "{alpha} at a width of {width}");
        for &way in &marches {
            let [red, blue, found] = seen(&picture(&folder, "a.nrrd", &with_samples(&look, way), way));
            let of = format!("{width} HU about {middle}, density {density}, from {view:?}, {way:?}");
            assert!((found / alpha - 1.0).abs() < 0.02, "alpha {found} for {alpha}, {of}");
            assert!((red / expected - 1.0).abs() < 0.02, "red {red} for {expected}, {of}");
            assert!(blue < 1e-3 * red, "blue {blue} beside {red}, {of}");
        }
    }
}

/// Lets a look scatter once instead of glowing; lit from beside the camera, so that walls of the shell shade each other.
fn lit(mut look: Value) -> Value {
    for point in look["transfer_function"]["points"].as_array_mut().expect("points") {
        point["albedo"] = 0.9.into();
        point.as_object_mut().expect("a point").remove("emission");
    }
    look["lights"] = json!([{ "type": "directional", "direction": [-1, -0.6, -1.3], "irradiance": 1 }]);
    look["render"]["max_scatter"] = 1.into();
    look
}

#[test]
fn a_peak_between_two_samples_is_lit_as_by_path() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(1.0, 0.0).nrrd("short"));
    let (truth, marches) = truth_and_marches();
    let seen_from_aslant = |width, middle, density| Peak { width, middle, density, view: VIEWS[1] };
    for (peak, shadows, within) in [
        (seen_from_aslant(10.0, -500.0, 6.0), "exact", 0.02),
        (seen_from_aslant(200.0, -500.0, 6.0), "exact", 0.02),
        // Dense: steps are lit at several sites.
        (seen_from_aslant(40.0, -500.0, 120.0), "exact", 0.013),
        (seen_from_aslant(10.0, -980.0, 6.0), "exact", 0.02),
        // Thin enough that shadows are cached, in texels wider than the shell: light that grazes it meets less of it.
        (seen_from_aslant(10.0, -500.0, 3.0), "cached", 0.05),
        (seen_from_aslant(40.0, -500.0, 3.0), "cached", 0.05),
        (seen_from_aslant(200.0, -500.0, 3.0), "cached", 0.02),
    ] {
        let Peak { width, middle, density, .. } = peak;
        let look = lit(peak.look(1.0, 0.0));
        let [expected, ..] = seen(&picture(&folder, "a.nrrd", &with_samples(&look, truth), truth));
        for &way in marches.iter().filter(|way| way.method == "raymarch") {
            let shadows = json!({ "render": { "raymarch": { "shadows": shadows } } });
            let look = tyndall_live::document::apply(&with_samples(&look, way), &shadows);
            let [found, ..] = seen(&picture(&folder, "a.nrrd", &look, way));
            let off = found / expected - 1.0;
            assert!(
                off.abs() < within,
                "{off} for {width} HU about {middle}, density {density}, {shadows}, {way:?}"
            );
        }
    }
}

/// Most of the light of a sky comes aslant, and is spent within a thick step before the view is.
#[test]
fn thick_steps_are_lit_by_the_sky_as_by_path() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(1.0, 0.0).nrrd("short"));
    let (truth, marches) = truth_and_marches();
    for (width, density) in [(200.0, 10.0), (40.0, 10.0), (200.0, 4.0)] {
        let mut look = lit(Peak { width, density, view: VIEWS[1], ..Peak::HALFWAY }.look(1.0, 0.0));
        look["lights"] = json!([{ "type": "environment", "radiance": 1, "visible": false }]);
        look["render"]["raymarch"] = json!({ "shadows": "exact", "light_samples": 64 });
        let [expected, ..] = seen(&picture(&folder, "a.nrrd", &with_samples(&look, truth), truth));
        for &way in marches.iter().filter(|way| way.method == "raymarch") {
            let [found, ..] = seen(&picture(&folder, "a.nrrd", &with_samples(&look, way), way));
            let off = found / expected - 1.0;
            assert!(off.abs() < 0.02, "{off} for {width} HU, density {density}, {way:?}");
        }
    }
}

/// Shells so thin that light passes them: where it does not, the radius of gathers blurs what reaches front and back.
#[test]
fn photons_light_a_peak_between_two_samples() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(1.0, 0.0).nrrd("short"));
    let (truth, marches) = truth_and_marches();
    let photons = json!({ "render": { "samples": 4, "photon": { "photons": 400_000 } } });
    for (width, within) in [(10.0, 0.06), (40.0, 0.06)] {
        let look = lit(Peak { width, view: VIEWS[1], ..Peak::HALFWAY }.look(1.0, 0.0));
        let [expected, ..] = seen(&picture(&folder, "a.nrrd", &with_samples(&look, truth), truth));
        for &way in marches.iter().filter(|way| way.method == "photon") {
            let look = tyndall_live::document::apply(&look, &photons);
            let off = seen(&picture(&folder, "a.nrrd", &look, way))[0] / expected - 1.0;
            assert!(off.abs() < within, "{off} for {width} HU, {way:?}");
        }
    }
}

#[test]
fn scale_and_offset_of_the_values_change_nothing() {
    let folder = Folder::new();
    for way in ways().into_iter().filter(|way| way.method == "raymarch") {
        let found = [(1.0, 0.0), (1e-3, 0.0), (37.0, 5000.0), (-1e6, 1e7)].map(|(scale, offset)| {
            folder.put("a.nrrd", ball(scale, offset).nrrd("double"));
            let look = Peak { width: 10.0, ..Peak::HALFWAY }.look(scale, offset);
            seen(&picture(&folder, "a.nrrd", &with_samples(&look, way), way))[2]
        });
        for alpha in found {
            assert!((alpha / found[0] - 1.0).abs() < 5e-3, "{found:?} with {way:?}");
        }
    }
}

/// Straight through both walls of the shell, where the view meets them at right angles, all pixels are equally opaque.
#[test]
fn a_thin_shell_has_no_rings() {
    let folder = Folder::new();
    folder.put("a.nrrd", ball(1.0, 0.0).nrrd("short"));
    let mut look = Peak::HALFWAY.look(1.0, 0.0);
    look["camera"]["height"] = 4.into();
    for way in ways().into_iter().filter(|way| way.method == "raymarch") {
        let image = picture(&folder, "a.nrrd", &with_samples(&look, way), way);
        // A triangle of 40 HU on a slope of 520 HU a voxel, twice; longer where the walls are oblique.
        let expected = 1.0 - (-2.0 * 6.0 * 0.5 * 40.0 / 520.0_f64).exp();
        let alphas = image.rgba.iter().map(|pixel| f64::from(pixel[3]));
        let (least, most) = alphas.fold((1.0, 0.0), |(lo, hi), alpha| (alpha.min(lo), alpha.max(hi)));
        assert!(
            least > 0.97 * expected && most < 1.1 * expected,
            "{least} to {most} for {expected}, {way:?}"
        );
    }
}

#[test]
fn nothing_lies_between_voxels_that_are_not_interpolated() {
    let folder = Folder::new();
    let halves = Data::new(EDGE, |[x, y, z]| if x * x + y * y + z * z < 0.4 { 40.0 } else { -1000.0 });
    folder.put("a.nrrd", halves.nrrd("short"));
    for way in ways() {
        let alpha = |interpolation: &str| {
            let look = tyndall_live::document::apply(
                &with_samples(&Peak { width: 200.0, ..Peak::HALFWAY }.look(1.0, 0.0), way),
                &json!({ "volume": { "interpolation": interpolation } }),
            );
            seen(&picture(&folder, "a.nrrd", &look, way))[2]
        };
        assert_eq!(alpha("nearest"), 0.0, "{way:?}");
        assert!(alpha("linear") > 0.02, "{way:?}");
    }
}
