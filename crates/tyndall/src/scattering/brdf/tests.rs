//! What all BRDFs share: energy, reciprocity, and samplers that follow their densities.

use super::*;
use crate::scattering::trial::{self, grey, mirrored, normal, tilted};
use tyndall_testing::{ChiSquare, SplitMix};

fn abc(b: f32, c: f32) -> Brdf {
    Brdf::Abc(Abc::new(b, c).unwrap())
}

/// Every kind; glossy ones with the parameters of their lobe, from nearly mirrors to nearly flat.
fn all_shapes() -> Vec<(Brdf, f32)> {
    let mut shapes = vec![(Brdf::Lambert, 0.5)];
    shapes.extend([0.0, 0.05, 0.1, 0.3, 0.6, 0.9, 1.0].map(|roughness| (Brdf::AshikhminShirley, roughness)));
    let fits = [(1e-3, 1.0), (3.0, 0.5), (1e2, 1.5), (1e4, 0.8), (1e5, 1.4), (3e6, 0.1), (50.0, 8.0)];
    shapes.extend(fits.map(|(b, c)| (abc(b, c), 0.5)));
    shapes
}

/// The integral of `f_r cos_in` over `w_in`.
fn reflected(brdf: &Brdf, w_out: Vec3, surface: &Surface) -> f64 {
    let [total] = trial::integrate(mirrored(w_out), |w_in| {
        let f = brdf.eval(normal(), w_in, w_out, surface);
        [f64::from(f.g) * f64::from(normal().dot(w_in).abs())]
    });
    total
}

#[test]
fn lambert_reflects_its_albedo() {
    for degrees in [0.0, 40.0, 85.0] {
        let total = reflected(&Brdf::Lambert, tilted(degrees), &grey(0.7, 0.5, 0.5));
        assert!((total - 0.7).abs() < 1e-4, "{degrees} degrees: {total}");
    }
}

#[test]
fn nothing_reflects_more_than_it_gets() {
    let mut most = 0.0_f64;
    for (brdf, roughness) in all_shapes() {
        for specular in [0.0, 0.04, 0.5, 1.0] {
            for degrees in [0.0, 20.0, 45.0, 60.0, 70.0, 80.0, 86.0, 89.0] {
                let total = reflected(&brdf, tilted(degrees), &grey(1.0, specular, roughness));
                most = most.max(total);
                assert!(
                    total < 1.0 + 2e-4,
                    "{brdf:?}, roughness {roughness}, specular {specular}, {degrees} degrees: {total}"
                );
            }
        }
    }
    assert!(most > 0.98, "a mirror along its normal should lose little: {most}");
}

#[test]
fn the_base_reflects_what_it_claims() {
    let surface = grey(0.8, 0.2, 0.5);
    for degrees in [0.0, 50.0, 80.0] {
        let w_out = tilted(degrees);
        let [total] = trial::integrate(normal(), |w_in| {
            let cos_in = normal().dot(w_in);
            let f = if cos_in > 0.0 { coat::base(&surface, cos_in, normal().dot(w_out)).g } else { 0.0 };
            [f64::from(f * cos_in)]
        });
        let claimed = f64::from(coat::base_reflectance(&surface, normal().dot(w_out)).g);
        assert!((total - claimed).abs() < 1e-4, "{degrees} degrees: {total} not {claimed}");
    }
}

/// Light reflected straight back shows the distribution of facets without Fresnel's rise. Both distributions integrate
/// to 1: `D cos` of microfacets, and the half-vector density of Ashikhmin and Shirley.
#[test]
fn light_sent_back_shows_all_facets() {
    for (brdf, roughness) in all_shapes().into_iter().skip(1) {
        let surface = grey(0.0, 0.6, roughness);
        let [facets] = trial::integrate(normal(), |w| {
            let cos = normal().dot(w);
            if cos <= 0.0 {
                return [0.0];
            }
            let facets = match brdf {
                Brdf::Abc(_) => 4.0 * cos * cos / (2.0 * cos * cos).min(1.0) * cos,
                _ => 4.0 * cos,
            };
            [f64::from(brdf.eval(normal(), w, w, &surface).g * facets)]
        });
        assert!((facets - 0.6).abs() < 2e-3, "{brdf:?}, roughness {roughness}: {facets}");
    }
}

#[test]
fn ashikhmin_shirley_by_hand() {
    let brdf = Brdf::AshikhminShirley;
    let along_normal = brdf.eval(Vec3::Z, Vec3::Z, Vec3::Z, &grey(0.0, 0.4, 0.5)).g;
    let exponent = 30.0;
    assert!((along_normal - (exponent + 1.0) / 8.0 * FRAC_1_PI * 0.4).abs() < 1e-6, "{along_normal}");
    // At roughness 1 the exponent is 0. Half of 120 degrees: k . h = 1/2, F = 0.4 + 0.6 / 32.
    let w = |side: f32| Vec3::new(side * 0.75_f32.sqrt(), 0.0, 0.5);
    let across = brdf.eval(Vec3::Z, w(1.0), w(-1.0), &grey(0.0, 0.4, 1.0)).g;
    assert!((across - FRAC_1_PI / 8.0 * 0.41875 / (0.5 * 0.5)).abs() < 1e-6, "{across}");
    // At a specular of 0 only the diffuse term is left, and Fresnel's rise, which is 0 along the normal.
    let base = brdf.eval(Vec3::Z, Vec3::Z, Vec3::Z, &grey(0.5, 0.0, 0.5)).g;
    let expected = 28.0 * 0.5 / 23.0 * FRAC_1_PI * (31.0_f32 / 32.0).powi(2);
    assert!((base - expected).abs() < 1e-6, "{base}");
}

#[test]
fn exchanging_the_directions_changes_nothing() {
    let mut random = SplitMix::new(5);
    let surface =
        Surface { albedo: Rgb::new(0.9, 0.5, 0.1), specular: Rgb::new(0.1, 0.4, 0.9), roughness: 0.2 };
    for (brdf, roughness) in all_shapes() {
        let surface = Surface { roughness, ..surface };
        let mut seen = 0;
        for _ in 0..2000 {
            let [a, b] = std::array::from_fn(|_| warp::sphere(random.uniforms()));
            let (there, back) = (brdf.eval(normal(), a, b, &surface), brdf.eval(normal(), b, a, &surface));
            for (x, y) in there.to_array().into_iter().zip(back.to_array()) {
                assert!((x - y).abs() <= 1e-5 * x.max(y), "{brdf:?}: {x} there, {y} back");
            }
            assert_eq!(brdf.eval(-normal(), a, b, &surface), there, "{brdf:?} has two sides");
            seen += u32::from(!there.is_black());
        }
        assert!(seen > 800, "{brdf:?} reflected only {seen} of 2000 pairs");
    }
}

#[test]
fn nothing_passes_through_or_along_a_surface() {
    let along = Frame::around(Vec3::Z).u;
    for (brdf, roughness) in all_shapes() {
        let surface = grey(0.9, 0.9, roughness);
        for (w_in, w_out) in [(Vec3::Z, -Vec3::Z), (Vec3::Z, along), (along, Vec3::Z), (along, -along)] {
            assert!(brdf.eval(Vec3::Z, w_in, w_out, &surface).is_black(), "{brdf:?} {w_in} {w_out}");
            for walk in [TransportMode::Camera, TransportMode::Light] {
                assert_eq!(brdf.pdf(walk, Vec3::Z, w_out, w_in, &surface), 0.0, "{brdf:?} {w_in} {w_out}");
            }
        }
        assert_eq!(brdf.sample(TransportMode::Camera, Vec3::Z, along, &surface, [0.3, 0.3, 0.3]), None);
    }
}

/// Shape, surface and angle of incidence of each sampler test.
fn trials() -> Vec<(Brdf, Surface, f32)> {
    let mut trials =
        vec![(Brdf::Lambert, grey(0.6, 0.0, 0.5), 30.0), (Brdf::Lambert, grey(0.6, 0.0, 0.5), 87.0)];
    for degrees in [0.0, 60.0, 86.0] {
        for roughness in [0.15, 0.4, 1.0] {
            trials.push((Brdf::AshikhminShirley, grey(0.5, 0.3, roughness), degrees));
        }
        for brdf in [abc(2e3, 0.6), abc(300.0, 1.0), abc(5e3, 2.5)] {
            trials.push((brdf, grey(0.5, 0.3, 0.5), degrees));
        }
    }
    trials.push((Brdf::AshikhminShirley, grey(0.0, 1.0, 0.05), 10.0));
    trials.push((abc(1e5, 1.4), grey(0.0, 1.0, 0.5), 10.0));
    trials
}

#[test]
fn samplers_follow_their_densities() {
    let trials = trials();
    for walk in [TransportMode::Camera, TransportMode::Light] {
        for (brdf, surface, degrees) in &trials {
            // The mirror direction is the pole of the cells, which resolves lobes however narrow.
            let n = deflect(Vec3::Z, 1.0 - degrees.to_radians().cos(), 0.1);
            let known = n * (2.0 * n.z) - Vec3::Z;
            let test =
                ChiSquare { samples: 200_000, rows: 256, columns: 16, ..ChiSquare::among(2 * trials.len()) };
            let fit = test.directions(
                |u| brdf.sample(walk, n, known, surface, u).map(|w| w.to_array()),
                |w| f64::from(brdf.pdf(walk, n, known, Vec3::from_array(w), surface)),
            );
            assert!(fit.passes(), "{walk:?}, {brdf:?}, {surface:?}, {degrees} degrees: {fit}");
        }
    }
}
