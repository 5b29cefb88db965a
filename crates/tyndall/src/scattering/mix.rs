//! The scattering function of a volume: a phase function where the data are homogeneous, blended into a
//! BRDF towards edges.
//!
//! Per unit extinction `sigma_s s / sigma_t = (1-q) albedo phase + q f_r(w_in, w_out) |n . w_in|`.
//! The cosine belongs to the side where the light comes from, whichever way the walk goes, so with
//! `q > 0` the whole is not symmetric: a light path weights by the same value with the same `w_in`.

use super::{Brdf, Phase, Surface, TransportMode};
use crate::math::{Rgb, Vec3};

/// Share of surface scattering at a point: `surface (1 - exp(-gradient_factor |grad v| h / range))`.
///
/// `surface` in [0, 1] from the transfer function; `gradient_length` in data values per world unit;
/// `voxel_size` the cube root of the voxel volume, in world units; `range`, which the gradient is measured against, in data
/// values. 0 where the gradient vanishes and where there is no range.
#[inline]
#[must_use]
pub fn surface_share(
    surface: f32,
    gradient_factor: f32,
    gradient_length: f32,
    voxel_size: f32,
    range: f32,
) -> f32 {
    if !(gradient_length > 0.0 && range > 0.0) {
        return 0.0;
    }
    -surface * (-gradient_factor * gradient_length * voxel_size / range).exp_m1()
}

/// Everything that determines how light scatters at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Phase function of the matter.
    pub phase: Phase,
    /// BRDF of its surfaces.
    pub brdf: Brdf,
    /// Local optics; `albedo` serves both.
    pub surface: Surface,
    /// Unit gradient of the data, of either sign; `None` where it vanishes, which makes `q` count as 0.
    pub normal: Option<Vec3>,
    /// Share of the surface, in [0, 1]; see [`surface_share`].
    pub q: f32,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Unit vector that leaves the point: `w_in` of a camera path, `w_out` of a light path. The walk's
    /// next direction of travel.
    pub direction: Vec3,
    /// `eval / pdf`.
    pub weight: Rgb,
    /// Density over solid angle, \[1/sr\].
    pub pdf: f32,
}

impl Event {
    /// `sigma_s s / sigma_t`, \[1/sr\]: light from `w_in` that goes on to `w_out`, per unit extinction.
    #[inline]
    #[must_use]
    pub fn eval(&self, w_out: Vec3, w_in: Vec3) -> Rgb {
        let (normal, q) = self.side();
        let matter = self.surface.albedo * ((1.0 - q) * self.phase.eval_between(-w_in, w_out));
        if q == 0.0 {
            return matter;
        }
        matter + self.brdf.eval(normal, w_in, w_out, &self.surface) * (q * normal.dot(w_in).abs())
    }

    /// In a camera path: samples where the light comes from. `None` is lost light, a weight of 0.
    ///
    /// `u` are uniform numbers in [0, 1); the last one chooses the lobe.
    #[inline]
    #[must_use]
    pub fn sample(&self, w_out: Vec3, u: [f32; 3]) -> Option<Sample> {
        let (direction, pdf) = self.draw(TransportMode::Camera, w_out, u)?;
        Some(Sample { direction, weight: self.eval(w_out, direction) / pdf, pdf })
    }

    /// Density with which [`Self::sample`] samples `w_in`, \[1/sr\]; integrates to 1 less the probability of `None`.
    #[inline]
    #[must_use]
    pub fn pdf(&self, w_out: Vec3, w_in: Vec3) -> f32 {
        self.density(TransportMode::Camera, w_out, w_in)
    }

    /// In a light path: samples where the light goes. The weight keeps `|n . w_in|`, though `w_out` is sampled.
    ///
    /// `u` are uniform numbers in [0, 1); the last one chooses the lobe.
    #[inline]
    #[must_use]
    pub fn sample_adjoint(&self, w_in: Vec3, u: [f32; 3]) -> Option<Sample> {
        let (direction, pdf) = self.draw(TransportMode::Light, w_in, u)?;
        Some(Sample { direction, weight: self.eval(direction, w_in) / pdf, pdf })
    }

    /// Density with which [`Self::sample_adjoint`] samples `w_out`, \[1/sr\].
    #[inline]
    #[must_use]
    pub fn pdf_adjoint(&self, w_in: Vec3, w_out: Vec3) -> f32 {
        self.density(TransportMode::Light, w_in, w_out)
    }

    fn draw(&self, walk: TransportMode, known: Vec3, u: [f32; 3]) -> Option<(Vec3, f32)> {
        let (normal, _) = self.side();
        let on_surface = self.surface_chance(walk, known)?;
        let direction = if u[2] < on_surface {
            self.brdf.sample(walk, normal, known, &self.surface, [u[0], u[1], u[2] / on_surface])?
        } else {
            // Phase functions are symmetric, so both walks scatter from their direction of travel, -known.
            self.phase.sample(-known, [u[0], u[1]])
        };
        let pdf = self.density(walk, known, direction);
        (pdf > 0.0).then_some((direction, pdf))
    }

    fn density(&self, walk: TransportMode, known: Vec3, drawn: Vec3) -> f32 {
        let (normal, _) = self.side();
        let Some(on_surface) = self.surface_chance(walk, known) else {
            return 0.0;
        };
        let matter = (1.0 - on_surface) * self.phase.eval_between(-known, drawn);
        if on_surface == 0.0 {
            return matter;
        }
        matter + on_surface * self.brdf.pdf(walk, normal, known, drawn, &self.surface)
    }

    /// Probability of sampling the BRDF: its share of what is scattered, so that weights stay bounded.
    /// `None` if nothing is scattered.
    #[inline]
    fn surface_chance(&self, walk: TransportMode, known: Vec3) -> Option<f32> {
        let (normal, q) = self.side();
        let matter = (1.0 - q) * self.surface.albedo.max_component();
        let surface = if q > 0.0 {
            q * self.brdf.reflectance_estimate(walk, normal.dot(known).abs(), &self.surface)
        } else {
            0.0
        };
        (matter + surface > 0.0).then(|| surface / (matter + surface))
    }

    /// Whether a surface contributes.
    #[inline]
    #[must_use]
    pub fn is_surface(&self) -> bool {
        self.side().1 > 0.0
    }

    /// The normal and the share of the surface, which is 0 without a normal.
    #[inline]
    fn side(&self) -> (Vec3, f32) {
        self.normal.map_or((Vec3::Z, 0.0), |normal| (normal, self.q))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::warp;
    use crate::scattering::trial::{self, grey, mirrored, normal, tilted};
    use crate::scattering::{Abc, HenyeyGreenstein, Schlick, deflect};
    use tyndall_testing::{ChiSquare, Mean, SplitMix, ZTest};

    /// Share by which the quadrature may be off where the horizon cuts through its cells.
    const QUADRATURE_ERROR: f64 = 1e-4;

    /// Mixes of every phase function and BRDF with random q and the given `normal`.
    fn mixes(normal: Vec3) -> Vec<Event> {
        let mut random = SplitMix::new(17);
        let phases = [
            Phase::Isotropic,
            Phase::HenyeyGreenstein(HenyeyGreenstein::new(0.6).unwrap()),
            Phase::Schlick(Schlick::new(-0.7).unwrap()),
        ];
        let brdfs = [
            (Brdf::Lambert, 0.5),
            (Brdf::AshikhminShirley, 0.25),
            (Brdf::AshikhminShirley, 0.9),
            (Brdf::Abc(Abc::new(800.0, 1.3).unwrap()), 0.5),
        ];
        let mut mixes = Vec::new();
        for phase in phases {
            for (brdf, roughness) in brdfs {
                let [q] = random.uniforms();
                let mut surface = grey(0.8, 0.3, roughness);
                surface.albedo.b = 0.2;
                surface.specular.r = 0.05;
                mixes.push(Event { phase, brdf, surface, normal: Some(normal), q });
            }
        }
        let only_surface = mixes.iter().take(4).map(|event| Event { q: 1.0, ..*event }).collect::<Vec<_>>();
        mixes.extend(only_surface);
        mixes
    }

    #[test]
    fn share_of_the_surface() {
        assert_eq!(surface_share(0.7, 10.0, 0.0, 1.0, 255.0), 0.0);
        assert_eq!(surface_share(0.7, 10.0, 3.0, 1.0, 0.0), 0.0);
        assert_eq!(surface_share(0.0, 10.0, 3.0, 1.0, 255.0), 0.0);
        let q = surface_share(0.7, 10.0, 20.0, 0.5, 400.0);
        assert!((q - 0.7 * (1.0 - (-0.25_f32).exp())).abs() < 1e-6, "{q}");
        assert_eq!(surface_share(1.0, 10.0, 1e6, 1.0, 1.0), 1.0);
    }

    #[test]
    fn a_lambert_surface_by_hand() {
        let event = Event {
            phase: Phase::Isotropic,
            brdf: Brdf::Lambert,
            surface: grey(0.5, 0.0, 0.5),
            normal: Some(-Vec3::Z),
            q: 0.25,
        };
        let (w_in, w_out) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.96, 0.28));
        let matter = 0.75 * 0.5 / (4.0 * std::f32::consts::PI);
        let expected = matter + 0.25 * 0.5 / std::f32::consts::PI * 0.8;
        assert!((event.eval(w_out, w_in).r - expected).abs() < 1e-7);
        assert!((event.eval(w_out, -w_in).r - matter).abs() < 1e-8, "light from behind");
        let no_normal = Event { normal: None, ..event };
        assert!(
            (no_normal.eval(w_out, w_in).r - matter / 0.75).abs() < 1e-8,
            "without a normal q counts as 0"
        );
    }

    #[test]
    fn reversing_the_light_exchanges_the_cosine() {
        let mut random = SplitMix::new(2);
        for event in mixes(normal()) {
            for _ in 0..500 {
                let [a, b] = std::array::from_fn(|_| warp::sphere(random.uniforms()));
                let matter = Event { q: 0.0, ..event };
                assert_eq!(matter.eval(a, b), matter.eval(b, a));
                let surface = Event { q: 1.0, ..event };
                let there = surface.eval(a, b).g * normal().dot(a).abs();
                let back = surface.eval(b, a).g * normal().dot(b).abs();
                assert!((there - back).abs() <= 1e-5 * there.max(back), "{event:?}: {there}, {back}");
            }
        }
    }

    #[test]
    fn samplers_follow_their_densities() {
        let test = ChiSquare {
            samples: 200_000,
            rows: 256,
            columns: 16,
            ..ChiSquare::among(2 * mixes(normal()).len())
        };
        for (i, event) in mixes(normal()).into_iter().enumerate() {
            let degrees = [0.0_f32, 50.0, 86.0][i % 3];
            // The mirror direction is the pole of the cells, which resolves lobes however narrow.
            let n = deflect(Vec3::Z, 1.0 - degrees.to_radians().cos(), 0.1);
            let known = n * (2.0 * n.z) - Vec3::Z;
            let event = Event { normal: Some(n), ..event };
            let camera = test.directions(
                |u| event.sample(known, u).map(|s| s.direction.to_array()),
                |w| f64::from(event.pdf(known, Vec3::from_array(w))),
            );
            assert!(camera.passes(), "camera path, {event:?}, {degrees} degrees: {camera}");
            let light = test.directions(
                |u| event.sample_adjoint(known, u).map(|s| s.direction.to_array()),
                |w| f64::from(event.pdf_adjoint(known, Vec3::from_array(w))),
            );
            assert!(light.passes(), "light path, {event:?}, {degrees} degrees: {light}");
        }
    }

    /// The mean weight is the integral of `eval` over the sampled direction, with the cosine of `w_in` in both walks.
    #[test]
    fn weights_average_to_the_integral() {
        let mut random = SplitMix::new(3);
        let angles = [10.0, 60.0, 85.0];
        let events = mixes(normal());
        let tests = 6 * angles.len() * events.len();
        for event in events {
            for degrees in angles {
                let known = tilted(degrees);
                let integrals = trial::integrate(mirrored(known), |w| {
                    let (camera, light) = (event.eval(known, w).to_array(), event.eval(w, known).to_array());
                    [camera[0], camera[1], camera[2], light[0], light[1], light[2]].map(f64::from)
                });
                let mut means = [Mean::default(); 6];
                for _ in 0..100_000 {
                    let weight = |s: Option<Sample>| s.map_or([0.0; 3], |s| s.weight.to_array());
                    let camera = weight(event.sample(known, random.uniforms()));
                    let light = weight(event.sample_adjoint(known, random.uniforms()));
                    for (mean, w) in means.iter_mut().zip(camera.into_iter().chain(light)) {
                        mean.push(f64::from(w));
                    }
                }
                for (i, (mean, integral)) in means.iter().zip(integrals).enumerate() {
                    let variance = mean.variance_of_mean() + (QUADRATURE_ERROR * integral).powi(2);
                    let test = ZTest::new(mean.mean(), variance, integral).among(tests);
                    assert!(test.passes(), "channel {i}, {event:?}, {degrees} degrees: {test}");
                }
            }
        }
    }

    #[test]
    fn weights_stay_bounded_at_every_angle() {
        let mut random = SplitMix::new(4);
        let mut largest = 0.0_f32;
        for event in mixes(normal()) {
            for _ in 0..200_000 {
                let known = warp::sphere(random.uniforms());
                for sample in
                    [event.sample(known, random.uniforms()), event.sample_adjoint(known, random.uniforms())]
                        .into_iter()
                        .flatten()
                {
                    assert!(sample.weight.is_finite() && sample.pdf > 0.0, "{event:?} {known}: {sample:?}");
                    assert!((sample.direction.length() - 1.0).abs() < 1e-5, "{sample:?}");
                    largest = largest.max(sample.weight.max_component());
                }
            }
        }
        assert!(largest < 4.0, "largest weight {largest}");
    }

    #[test]
    fn black_matter_ends_the_walk() {
        let event = Event {
            phase: Phase::Isotropic,
            brdf: Brdf::Lambert,
            surface: grey(0.0, 0.0, 0.5),
            normal: Some(Vec3::Z),
            q: 1.0,
        };
        assert_eq!(event.sample(Vec3::Z, [0.5; 3]), None);
        assert_eq!(event.pdf(Vec3::Z, Vec3::Z), 0.0);
        let surface = grey(0.9, 0.0, 0.5);
        assert_eq!(Event { surface, ..event }.sample(Vec3::X, [0.5; 3]), None, "along the surface");
    }
}
