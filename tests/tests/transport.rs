//! The path tracer as a whole: wavefront against textbook, and bits against threads, waves and scale.

use core::f64::consts::PI;
use core::sync::atomic::AtomicBool;
use glam::Vec3;
use halflight::render::{self, Method, RenderResult, Settings, Stop};
use halflight_core::bsdf::All;
use halflight_core::bvh::Bvh;
use halflight_core::cache::irradiance::{CellFlux, Metric, metric};
use halflight_core::film::{Dropped, Film, Pixel};
use halflight_core::geometry::Ray;
use halflight_core::memory::Arena;
use halflight_core::sampling::Sampler;
use halflight_core::scene::{Camera, Material, PointLight, Scene, Surface, SurfacePoint};
use halflight_core::transport::cached::gather::{GatherPoint, Gathering};
use halflight_core::transport::cached::placement::{PIXELS, ProgressiveOrder, Via};
use halflight_core::transport::path::reference;
use halflight_core::transport::{
    Counters, IrradiancePoint, LightPart, PathIntegrator, PathSettings, UNLIMITED,
};
use halflight_core::{Level, Rgb};
use halflight_tests::memory::{TestArena, with_structures};
use halflight_tests::render::raw;
use halflight_tests::scenes::{
    SceneBuffers, constant_environment, cornell_box, emitter, everything, room_with_lamp,
};

/// Mean radiance of the box, from 4 million paths that sampled the lamp uniformly by area.
const CORNELL_MEAN: [f64; 3] = [0.2123, 0.1509, 0.0652];

fn render(scene: &Scene, size: u32, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let method = Some(Method::Path);
    let mut settings = Settings { method, width: size, height: size, stop, ..raw() };
    change(&mut settings);
    render::render(scene, &settings, &mut |_| (), &AtomicBool::new(false)).unwrap()
}

#[test]
fn the_cornell_box_has_the_light_it_had() {
    let result = render(&cornell_box().scene(), 64, 64, |_| ());
    let mean = result.image.mean();
    for (mean, known) in mean.into_iter().zip(CORNELL_MEAN) {
        assert!((mean / known - 1.0).abs() < 0.01, "{mean} {known}");
    }
    assert_eq!((result.spp, result.counters.paths), (64, 64 * 64 * 64));
    assert_eq!(result.counters.dropped.total(), 0);
}

#[test]
fn the_wavefront_is_the_textbook_to_the_bit_for_any_wave() {
    let mut window = room_with_lamp(0.3, 5.0);
    let surface = Surface::Pane { ior: 1.5, tint: [0.9, 0.5, 0.2].into() };
    let pane = window.material(Material { surface, ..Material::GREY });
    window.square(Vec3::splat(0.4), Vec3::new(0.2, 0.5, 1.0), 0.5, pane);
    for buffers in [cornell_box(), everything(), room_with_lamp(0.3, 5.0), window] {
        let scene = buffers.scene();
        let settings = PathSettings { width: 24, height: 20, seed: 3, max_depth: UNLIMITED };
        let samples = 0..3;
        with_structures(&scene, |bvh, lights| {
            let tracer = PathIntegrator::<All>::new(&scene, bvh, lights, settings, Level::detect());
            for wave in [1, 100, 5000] {
                let mut scratch_memory = TestArena::new(PathIntegrator::<All>::scratch(wave));
                let mut scratch = scratch_memory.arena();
                let mut film_memory = TestArena::new(Film::footprint(24, 20));
                let mut film = Film::new(24, 20, &mut film_memory.arena()).unwrap();
                for (task, pixels) in film.pixels_mut().chunks_mut(256).enumerate() {
                    tracer.run(task, samples.clone(), wave, &mut scratch, pixels).unwrap();
                }
                for (x, y) in (0..20).flat_map(|y| (0..24).map(move |x| (x, y))) {
                    let [a, b, c] =
                        [0, 1, 2].map(|s| reference::radiance(&scene, bvh, lights, &settings, [x, y], s));
                    let pixel = film.pixel(x, y);
                    assert_eq!(
                        (pixel.even.sum(), pixel.odd.sum()),
                        (a + c, b),
                        "({x}, {y}) in waves of {wave}"
                    );
                }
            }
        });
    }
}

#[test]
fn irradiance_under_a_square_lamp_is_that_of_its_form_factor() {
    // A lamp of side 1 and radiance 5, 1 above a black floor, under a sky of 0.2.
    let camera = Camera::look_at(Vec3::splat(3.0), Vec3::ZERO, Vec3::Y, 40.0);
    let mut buffers = SceneBuffers::new(camera);
    let [floor, lamp] = [emitter(0.0, 0.0), emitter(0.0, 5.0)].map(|material| buffers.material(material));
    buffers.square(Vec3::ZERO, Vec3::Y, 8.0, floor);
    buffers.square(Vec3::Y, Vec3::NEG_Y, 1.0, lamp);
    buffers.environment = constant_environment(0.2);
    let scene = buffers.scene();
    let slant = 1.25_f64.sqrt();
    let form_factor = 4.0 / PI * (0.5 / slant) * (0.5 / slant).atan();
    let expected = PI * (5.0 * form_factor + 0.2 * (1.0 - form_factor));

    with_structures(&scene, |bvh, lights| {
        let down = Ray::new(Vec3::Y * 0.5, Vec3::NEG_Y);
        let hit = bvh.nearest(Level::detect(), &down);
        let point = SurfacePoint::at::<All>(&scene, &down, &hit).expect("the floor");
        let paths = 1 << 14;
        let sample = |path| {
            let sampler = Sampler::new(7, 0, path);
            f64::from(reference::irradiance(&scene, bvh, lights, UNLIMITED, &sampler, &point).y)
        };
        let mean = (0..paths).map(sample).sum::<f64>() / f64::from(paths);
        assert!((mean / expected - 1.0).abs() < 3e-3, "{mean}, not {expected}");
    });
}

/// Calls `work` with a path tracer of the box, 16 x 16 pixels.
fn in_the_box(work: impl FnOnce(&PathIntegrator<All>)) {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let settings = PathSettings { width: 16, height: 16, seed: 0, max_depth: UNLIMITED };
    with_structures(&scene, |bvh, lights| {
        work(&PathIntegrator::new(&scene, bvh, lights, settings, Level::detect()));
    });
}

#[test]
fn scratch_is_exactly_what_it_says() {
    in_the_box(|tracer| {
        let mut scratch = TestArena::new(PathIntegrator::<All>::scratch(100));
        let mut pixels = vec![Default::default(); 256];
        let bytes = scratch.bytes();
        assert!(tracer.run(0, 0..1, 100, &mut Arena::new(bytes), &mut pixels).is_ok());
        let short = bytes.len() - 1;
        assert!(tracer.run(0, 0..1, 100, &mut Arena::new(&mut bytes[..short]), &mut pixels).is_err());
    });
}

/// Russian roulette of gather rays must not depend on left-over memory of the wavefront.
#[test]
fn a_gathering_does_not_know_what_its_memory_was() {
    in_the_box(|tracer| {
        let mut places = [GatherPoint::NONE; PIXELS];
        tracer.places(
            &ProgressiveOrder::new(16, 16, 1),
            0,
            (0, Via::Specular),
            &mut places,
            &mut Counters::default(),
        );
        let place = places.iter().find(|place| place.is_some()).unwrap();
        for n in [8, 16, 64] {
            let mut tables = TestArena::new(CellFlux::footprint(n));
            let flux = CellFlux::build(n, &mut tables.arena()).unwrap();
            let metric = metric::Settings::new(Metric::Halflight, 1.0);
            let gathering = Gathering { flux: &flux, metric, least_pixels: 1.0 };
            let gather = |left_over: u8| {
                let mut scratch = TestArena::filled(PathIntegrator::<All>::gather_scratch(n), left_over);
                let scratch = &mut scratch.arena();
                let record = tracer.gather(place, 0, &gathering, scratch, &mut Counters::default());
                record.unwrap().unwrap()
            };
            assert_eq!(gather(0), gather(1), "{n}");
        }
    });
}

#[test]
fn powers_of_two_leave_the_bits_alone() {
    let picture = |exponent: i32| {
        let mut scene = cornell_box();
        let scale = 2f32.powi(exponent);
        scene.positions.iter_mut().flatten().for_each(|x| *x *= scale);
        scene.camera.eye *= scale;
        render(&scene.scene(), 24, 8, |_| ()).image
    };
    let image = picture(0);
    for exponent in [-20, -7, 1, 13, 20] {
        assert_eq!(picture(exponent), image, "2^{exponent}");
    }
}

#[test]
fn a_scene_far_from_its_origin_keeps_its_light() {
    let mut scene = cornell_box();
    let far = Vec3::new(1e3, -2e3, 1.5e3);
    for position in &mut scene.positions {
        *position = (Vec3::from(*position) + far).to_array();
    }
    scene.camera.eye += far;
    let mean = render(&scene.scene(), 32, 64, |_| ()).image.mean();
    for (mean, known) in mean.into_iter().zip(CORNELL_MEAN) {
        assert!((mean / known - 1.0).abs() < 0.02, "{mean} {known}");
    }
}

#[test]
fn memory_that_does_not_suffice_is_named() {
    let scene = cornell_box();
    let mut settings = Settings { width: 64, height: 64, memory: Some(10_000), ..raw() };
    let flag = AtomicBool::new(false);
    let error = render::render(&scene.scene(), &settings, &mut |_| (), &flag).unwrap_err();
    let render::RenderError::Memory { needed, available } = error else { panic!("{error}") };
    assert!(needed > 10_000 && available == 10_000);
    settings.width = 0;
    let error = render::render(&scene.scene(), &settings, &mut |_| (), &flag).unwrap_err();
    assert_eq!(error, render::RenderError::Size);
}

#[test]
fn memory_of_the_build_is_given_back() {
    let mut scene = cornell_box();
    scene.normals = vec![[0.0; 3]; scene.positions.len()];
    scene.sphere(Vec3::splat(0.5), 0.3, 64, 0);
    let result = render(&scene.scene(), 16, 1, |_| ());
    let bytes = |name| result.memory.iter().find(|part| part.structure == name).map(|part| part.bytes);
    let sum = result.memory.iter().map(|part| part.bytes).sum::<usize>();
    let build = Bvh::footprint(scene.triangles.len()).bytes();
    assert!(bytes("bvh").is_some_and(|bytes| bytes < build / 2), "{:?}", result.memory);
    assert!(result.memory_peak >= sum && result.memory_peak > build);
}

#[test]
fn an_interrupted_picture_is_valid() {
    let flag = AtomicBool::new(false);
    let settings = Settings { width: 32, height: 32, ..raw() };
    let scene = cornell_box();
    let mut raise = |_: &render::Progress| flag.store(true, core::sync::atomic::Ordering::Relaxed);
    let result = render::render(&scene.scene(), &settings, &mut raise, &flag).unwrap();
    assert_eq!((result.ending, result.spp), (render::Ending::Interrupted, 1));
    assert!(result.image.mean()[0] > 0.05);
}

#[test]
fn irradiance_at_points_is_the_textbook_to_the_bit_for_any_wave() {
    let mut lit = [1, 3, 40].map(|count| {
        let mut buffers = everything();
        buffers.lights.extend((0..count).map(|i| match i % 3 {
            0 => PointLight::Point { position: Vec3::new(0.4, 0.6, 0.3), intensity: Rgb::splat(0.2) },
            1 => PointLight::Directional { direction: Vec3::NEG_Y, irradiance: Rgb::splat(0.5) },
            _ => PointLight::Point { position: Vec3::new(0.7, 0.9, 0.6), intensity: Rgb::splat(0.1) },
        }));
        buffers
    });
    lit[0].environment = None;
    for buffers in [cornell_box(), everything(), room_with_lamp(0.3, 5.0)].into_iter().chain(lit) {
        let scene = buffers.scene();
        let settings = PathSettings { width: 1, height: 1, seed: 3, max_depth: UNLIMITED };
        with_structures(&scene, |bvh, lights| {
            let of_level = |level| PathIntegrator::<All>::new(&scene, bvh, lights, settings, level);
            let on = |triangle| IrradiancePoint::on_triangle(&scene, triangle, [0.3, 0.4], triangle % 2 == 0);
            let points: Vec<IrradiancePoint> =
                (0..12).filter_map(on).zip(5..).map(|(point, number)| point.numbered(number)).collect();
            let waves = [1, 100, 5000].into_iter();
            for (wave, level) in waves.flat_map(|wave| [Level::BASELINE, Level::detect()].map(|l| (wave, l)))
            {
                let footprint = PathIntegrator::<All>::scratch(wave);
                let beside = PathIntegrator::<All>::scratch_of_points(points.len());
                let (tracer, mut scratch_memory) = (of_level(level), TestArena::new(footprint.and(beside)));
                let mut film = vec![Pixel::default(); points.len()];
                tracer
                    .sample_irradiance(
                        (&points, LightPart::All),
                        0..3,
                        wave,
                        &mut scratch_memory.arena(),
                        &mut film,
                    )
                    .unwrap();
                for (point, pixel) in points.iter().zip(&film) {
                    let mut expected = Pixel::default();
                    for sample in 0..3 {
                        let sampler = Sampler::new(3, point.number, sample);
                        let surface = point.surface();
                        let value = reference::irradiance(&scene, bvh, lights, UNLIMITED, &sampler, &surface);
                        expected.add(sample, value, &mut Dropped::default());
                    }
                    assert_eq!(*pixel, expected, "{point:?}");
                }
            }
        });
    }
}
