//! The same bits for any number of threads, however the work is split in time.

use crate::photon::PHOTONS;
use crate::scenes::{Setup, volume};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tyndall::film::Image;
use tyndall::integrator::photon::{PhotonMapper, Settings as PhotonSettings};
use tyndall::integrator::raymarch::{RayMarch, Settings, Shadows};
use tyndall::integrator::{METHODS, Method, method_of};
use tyndall::light::{Directional, Environment, Light};
use tyndall::math::{Rgb, Vec3};
use tyndall::scene::{MethodChoice, Scene};
use tyndall::session::{Budget, Session};
use tyndall::transfer::{Optics, Point};

fn scene(method: MethodChoice) -> Scene {
    let value = |p: [usize; 3]| ((p[0] * 5 + p[1] * 3 + p[2] * 7) % 11) as f32 / 10.0;
    let glow = Optics { emission: Rgb::new(0.3, 0.1, 0.0), surface: 0.5, ..Optics::default() };
    let points = vec![
        Point { value: 0.3, optics: Optics { opacity: 0.0, ..glow } },
        Point { value: 1.0, optics: glow },
    ];
    let mut setup = Setup::new(volume([20; 3], [0.9; 3], value), points, 9.0);
    setup.lights = vec![
        Light::Directional(Directional::new(Vec3::new(1.0, -1.0, -1.0), Rgb::WHITE, 20.0)),
        Light::Environment(Environment::constant(Rgb::splat(0.4), true)),
    ];
    setup.max_scatter = 8;
    let mut scene = setup.scene();
    scene.size = [50, 37];
    scene.render.method = method;
    scene
}

fn picture(scene: &Scene, threads: usize, slice: Option<Duration>) -> Image {
    let pool = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap());
    let mut session = Session::new(scene.clone(), pool);
    let mut budget = Budget::samples(5);
    while session.film().samples() < 5 {
        budget.deadline = slice.map(|slice| Instant::now() + slice);
        let done = session.refine(&budget);
        assert!(done.mean_samples <= 5.0, "{} samples: a tile exceeds the budget", done.mean_samples);
    }
    session.image()
}

#[test]
fn threads_and_slices_leave_no_trace() {
    let march = |step| RayMarch::choose(Settings { step, light_samples: 4, shadows: Shadows::Exact });
    // Without scattering a march is interrupted only between its steps, of which the small step gives many.
    let photons = PhotonMapper::choose(PhotonSettings { photons: 20_000, segments: 5, ..PHOTONS });
    let all = METHODS.iter().map(|method| (method.draft(&method.default_settings()), 8));
    for (choice, max_scatter) in all.chain([(march(0.5), 8), (march(0.01), 0), (photons, 8)]) {
        let has_noise = method_of(&choice).has_noise;
        let mut scene = scene(choice);
        scene.render.max_scatter = max_scatter;
        let one = picture(&scene, 1, None);
        assert!(one.rgba.iter().any(|p| p[3] > 0.0) && one.rgba.iter().any(|p| p[3] < 1.0));
        assert_eq!(one, picture(&scene, 2, None));
        assert_eq!(one, picture(&scene, 5, None));
        assert_eq!(one, picture(&scene, 2, Some(Duration::from_micros(300))));
        let mut other = scene.clone();
        other.render.seed += 1;
        assert_eq!(has_noise, one != picture(&other, 2, None), "only methods with noise depend on the seed");
    }
}
