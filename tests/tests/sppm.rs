//! Progressive photon mapping: power of photons, discs under overhangs, narrow coats, and memory.

use glam::Vec3;
use halflight::load::{self, LoadOptions};
use halflight::render::{Method, RenderResult, Settings};
use halflight::save::Image;
use halflight_core::bsdf::All;
use halflight_core::light::EmissionSampler;
use halflight_core::photon::{Photon, Photons};
use halflight_core::scene::{Camera, Material, PointLight, Scene};
use halflight_core::transport::UNLIMITED;
use halflight_core::transport::photon_mapping::deposit::{
    PATHS_PER_TASK, PhotonFilter, PhotonTracer, PhotonTracerSettings, VERTICES_PER_TASK,
};
use halflight_core::{Level, Rgb};
use halflight_tests::memory::{TestArena, with_structures};
use halflight_tests::references::reference;
use halflight_tests::render::{number, render};
use halflight_tests::scenes::{SceneBuffers, cornell_box, emitter, metal, varnished};
use halflight_tests::statistics::{Estimates, agree_within, blocks};
use std::path::Path;

fn sppm(scene: &Scene, size: u32, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(scene, Method::ProgressivePhotons, size, spp, change)
}

/// Photons of a map of `scene` with `tasks` tasks.
fn photons(scene: &Scene, tasks: usize) -> Vec<Photon> {
    with_structures(scene, |bvh, lights| {
        let mut emission_memory = TestArena::new(EmissionSampler::footprint(lights.count()));
        let mut arena = emission_memory.arena();
        let emission = EmissionSampler::build(scene, lights, &bvh.bounds(), &mut arena).unwrap();
        let settings = PhotonTracerSettings {
            keep: PhotonFilter::Reflected,
            seed: 1,
            paths: (tasks * PATHS_PER_TASK) as u32,
            max_depth: UNLIMITED,
        };
        let shooter = PhotonTracer::<All>::new(scene, bvh, lights, &emission, settings, Level::detect());
        let mut scratch_memory = TestArena::new(PhotonTracer::<All>::scratch());
        let mut scratch = scratch_memory.arena();
        let mut all = vec![Photon::NONE; tasks * VERTICES_PER_TASK];
        for (task, out) in all.chunks_mut(VERTICES_PER_TASK).enumerate() {
            let counters = shooter.run(task, 0, &mut scratch, out).unwrap();
            assert_eq!(counters.dropped.total(), 0);
        }
        all.retain(|photon| photon.position().is_finite());
        all
    })
}

/// A closed unit cube of `reflectance` with a lamp of side 0.1 under its ceiling, facing down.
fn lit_room(reflectance: f32) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::splat(0.1), Vec3::splat(0.9), Vec3::Y, 60.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(reflectance)));
    let lamp = buffers.material(emitter(0.0, 1.0));
    buffers.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    buffers.square(Vec3::new(0.5, 0.95, 0.5), Vec3::NEG_Y, 0.1, lamp);
    buffers
}

#[test]
fn stored_photons_carry_the_power_that_surfaces_reflect() {
    for reflectance in [0.5, 0.9] {
        let buffers = lit_room(reflectance);
        let photons = photons(&buffers.scene(), 64);
        let power: f64 = photons.iter().map(|photon| f64::from(photon.power().x)).sum();
        // The lamp is black and small: photons hold the power ρ + ρ² + ... less the part that the lamp
        // absorbs.
        let emitted = core::f64::consts::PI * 0.01;
        let kept = f64::from(reflectance) / (1.0 - f64::from(reflectance));
        let expected = emitted * kept;
        // Both sides of the lamp are 0.02 of 6 square metres: it absorbs a share 0.0033 of the power at each
        // bounce.
        let lost = (1.0 + kept) * 0.0033;
        let ratio = power / expected;
        assert!(ratio < 1.01 && ratio > 0.99 - lost, "{reflectance}: {ratio}");
        assert!(photons.len() < 64 * VERTICES_PER_TASK * 19 / 20, "there is room left: {}", photons.len());
    }
}

fn assert_means(a: &Image, b: &Image, tolerance: f64) {
    for (a, b) in a.mean().into_iter().zip(b.mean()) {
        assert!((a / b - 1.0).abs() < tolerance, "{a} {b}");
    }
}

#[test]
fn discs_take_no_light_from_beyond_an_overhang() {
    // The jamb is seen through a slit of 1 cm. Discs of 10 cm in front of it took light from beyond the door:
    // 5 % of the picture's light.
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/two-rooms/two-rooms.toml");
    let loaded = load::load(&file, &LoadOptions::default()).unwrap();
    let views = loaded.views();
    let scene = views.scene(loaded.camera.unwrap());
    let path = reference("two-rooms by 48, channels", || {
        let one = |seed| {
            let plain = |s: &mut Settings| (s.seed, s.caustics) = (seed, false);
            render(&scene, Method::Path, 48, 1024, plain).image.mean().to_vec()
        };
        (0..4).map(one).collect()
    });
    for (found, (mean, _)) in sppm(&scene, 48, 256, |_| ()).image.mean().iter().zip(&path.moments) {
        assert!((found / mean - 1.0).abs() < 0.03, "{found} {mean}");
    }
}

#[test]
fn a_limit_of_memory_makes_fewer_photons_with_the_same_light() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let bytes = |result: &RenderResult| {
        result.memory.iter().find(|one| one.structure == "photons").map_or(0, |one| one.bytes)
    };
    let (few, many) = (sppm(&scene, 64, 2, |_| ()), sppm(&scene, 64, 32, |_| ()));
    assert_eq!((bytes(&few), few.memory_peak), (bytes(&many), many.memory_peak));
    assert!(bytes(&few) >= Photons::footprint(16 * VERTICES_PER_TASK).bytes());
    let tight = few.memory_peak - bytes(&few) / 2;
    let less = sppm(&scene, 64, 32, |s| s.memory = Some(tight));
    assert!(less.memory_peak <= tight && bytes(&less) < bytes(&few));
    assert_means(&less.image, &many.image, 0.03);
}

/// The Cornell box with varnish of `roughness` on all surfaces, and a bar of narrow-lobed metal in front of
/// its back wall.
fn varnished_room(roughness: f32) -> SceneBuffers {
    let mut room = varnished(cornell_box(), roughness);
    let bar = room.material(Material { surface: metal(0.1), ..Material::GREY });
    room.cuboid(Vec3::new(0.1, 0.75, 0.85), Vec3::new(0.9, 0.8, 0.9), false, bar);
    room
}

/// The room lit by a point light instead of its lamp.
fn by_a_point_light(mut room: SceneBuffers) -> SceneBuffers {
    for material in &mut room.materials {
        material.emission = Rgb::ZERO.into();
    }
    let (position, intensity) = (Vec3::new(0.5, 0.8, 0.4), Rgb::new(0.4, 0.35, 0.3));
    room.lights.push(PointLight::Point { position, intensity });
    room
}

/// The room seen along its floor.
fn at_a_grazing_angle(mut room: SceneBuffers) -> SceneBuffers {
    room.camera = Camera::look_at(Vec3::new(0.5, 0.06, -0.4), Vec3::new(0.5, 0.0, 0.6), Vec3::Y, 45.0);
    room
}

#[test]
fn narrow_coats_have_the_light_of_path_tracing_without_fireflies() {
    const SIZE: u32 = 32;
    let rooms = [
        ("lamp, 0.05", varnished_room(0.05)),
        ("lamp, 0.1, grazing", at_a_grazing_angle(varnished_room(0.1))),
        ("point, 0.1", by_a_point_light(varnished_room(0.1))),
        ("point, 0.05, grazing", at_a_grazing_angle(by_a_point_light(varnished_room(0.05)))),
    ];
    for (name, buffers) in &rooms {
        let scene = buffers.scene();
        let pictures = |method, count: u32| -> Vec<Vec<[f32; 3]>> {
            let one = |seed| render(&scene, method, SIZE, 64, |s| (s.seed, s.caustics) = (seed, false));
            (0..count).map(|seed| one(seed).image.pixels).collect()
        };
        let (photons, paths) = (pictures(Method::ProgressivePhotons, 4), pictures(Method::Path, 8));
        let sums = |pictures: &[Vec<[f32; 3]>]| -> Vec<Vec<f64>> {
            pictures.iter().map(|pixels| blocks(pixels, SIZE, 8)).collect()
        };
        // Discs blur by a few percent.
        agree_within(&sums(&photons), &Estimates::of(&sums(&paths)), rooms.len(), |_, light| 0.04 * light)
            .unwrap_or_else(|worst| panic!("{name}: {worst}"));
        // A photon in the narrow lobe of a coat would be a firefly.
        let [by_photons, by_paths] = [&photons, &paths].map(|pictures| scatter(pictures));
        println!("{name}: {by_photons} {by_paths}");
        assert!(by_photons < by_paths, "{name}: {by_photons} {by_paths}");
    }
}

/// Variance of green over independent pictures, relative to the squared radiance.
fn scatter(pictures: &[Vec<[f32; 3]>]) -> f64 {
    let (count, pixels) = (pictures.len() as f64, pictures[0].len());
    let values = |i: usize| pictures.iter().map(move |picture| f64::from(picture[i][1]));
    let means: Vec<f64> = (0..pixels).map(|i| values(i).sum::<f64>() / count).collect();
    let of_picture = means.iter().sum::<f64>() / pixels as f64;
    let of_pixel = |(i, mean): (usize, &f64)| {
        let squares = values(i).map(|value| (value - mean).powi(2)).sum::<f64>();
        squares / (count - 1.0) / (mean * mean + 0.01 * of_picture * of_picture)
    };
    means.iter().enumerate().map(of_pixel).sum::<f64>() / pixels as f64
}

/// A table with two walls below it on a ground of 20 km in the sun, seen from 2.6 m.
fn table_on_a_vast_ground() -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(1.6, 0.5, 2.0), Vec3::new(0.0, 0.3, 0.0), Vec3::Y, 40.0);
    let mut buffers = SceneBuffers::new(camera);
    let white = buffers.material(Material::diffuse(Rgb::splat(0.6)));
    let red = buffers.material(Material::diffuse(Rgb::new(0.7, 0.1, 0.1)));
    buffers.square(Vec3::ZERO, Vec3::Y, 4e4, white);
    let parts = [
        ([-1.0, 0.7, -1.0], [1.0, 0.75, 1.0], red),
        ([-1.0, 0.0, -1.0], [1.0, 0.7, -0.95], white),
        ([-1.0, 0.0, -0.95], [-0.95, 0.7, 1.0], white),
    ];
    for (low, high, material) in parts {
        buffers.cuboid(low.into(), high.into(), false, material);
    }
    let direction = Vec3::new(-0.4, -1.0, -0.2).normalize();
    buffers.lights.push(PointLight::Directional { direction, irradiance: Rgb::splat(5.0) });
    buffers
}

#[test]
fn photons_of_the_sun_are_found_on_a_vast_ground() {
    // With lines that are even over the ground no photon comes near the table: a quarter of the light lacks.
    let buffers = table_on_a_vast_ground();
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 48, 256, |_| ());
    let found = sppm(&scene, 48, 64, |_| ());
    assert_means(&found.image, &path.image, 0.05);
    assert!(number(&found, "global_photons", "useful_light_paths") > 0.02);
}
