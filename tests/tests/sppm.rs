//! Progressive photon mapping: the energy of photons, its light against that of the path tracer, its bits against
//! threads and rounds, and what must stay dark.

use glam::Vec3;
use halflight::drive::{Method, RenderResult, Settings};
use halflight::load::{self, LoadOptions};
use halflight::save::Image;
use halflight_core::bsdf::All;
use halflight_core::bvh::Bvh;
use halflight_core::light::{EmissionSampler, LightSampler};
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::photon::{Photon, Photons};
use halflight_core::scene::{Camera, Material, Scene, Surface};
use halflight_core::transport::UNLIMITED;
use halflight_core::transport::photon_mapping::deposit::{
    PATHS, PhotonFilter, PhotonTracer, PhotonTracerSettings, ROOM,
};
use halflight_core::{Level, Rgb};
use halflight_tests::render::{difference, render};
use halflight_tests::scenes::{
    IN_THE_BRIGHT_ROOM, SceneBuffers, bright_and_dark, cornell_box, emitter, everything, lamp_before, metal,
    varnish, varnished,
};
use std::path::Path;

fn sppm(scene: &Scene, size: u32, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(scene, Method::ProgressivePhotons, size, spp, change)
}

fn lines(footprint: Footprint) -> Vec<Line> {
    vec![Line([0; 64]); footprint.bytes() / 64]
}

/// All photons of a map of `scene`, and the power of its lights in the same units.
fn photons(scene: &Scene, tasks: usize) -> Vec<Photon> {
    let mut bvh_lines = lines(Bvh::footprint(scene.mesh.triangles.len()));
    let bvh = Bvh::build(&scene.mesh, &mut Arena::new(bytemuck::cast_slice_mut(&mut bvh_lines))).unwrap();
    let mut light_lines = lines(LightSampler::footprint(scene).and(LightSampler::scratch(scene)));
    let lights =
        LightSampler::build(scene, &mut Arena::new(bytemuck::cast_slice_mut(&mut light_lines))).unwrap();
    let mut emission_lines = lines(EmissionSampler::footprint(&lights));
    let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut emission_lines));
    let emission = EmissionSampler::build(scene, &lights, &bvh.bounds(), &mut arena).unwrap();
    let settings = PhotonTracerSettings {
        keep: PhotonFilter::Reflected,
        seed: 1,
        paths: (tasks * PATHS) as u32,
        max_depth: UNLIMITED,
    };
    let shooter = PhotonTracer::<All>::new(scene, &bvh, &lights, &emission, settings, Level::detect());
    let mut scratch = lines(PhotonTracer::<All>::scratch());
    let mut scratch = Arena::new(bytemuck::cast_slice_mut(&mut scratch));
    let mut all = vec![Photon::NONE; tasks * ROOM];
    for (task, out) in all.chunks_mut(ROOM).enumerate() {
        let counters = shooter.run(task, 0, &mut scratch, out).unwrap();
        assert_eq!(counters.dropped.total(), 0);
    }
    all.retain(|photon| photon.position().is_finite());
    all
}

/// The Cornell box with varnish on all of its surfaces, a ball of rough metal and one of varnish, seen along its floor.
fn varnished_box(roughness: f32) -> SceneBuffers {
    let mut buffers = varnished(cornell_box(), roughness);
    buffers.normals = vec![[0.0; 3]; buffers.positions.len()];
    for (x, surface) in [(0.3, metal(roughness)), (0.62, varnish(roughness))] {
        let material = buffers.material(Material { surface, ..Material::GREY });
        buffers.sphere(Vec3::new(x, 0.12, -0.05), 0.12, 12, material);
    }
    buffers.camera = Camera::look_at(Vec3::new(0.5, 0.06, -0.8), Vec3::new(0.5, 0.12, 0.5), Vec3::Y, 60.0);
    buffers
}

/// The inside of a unit cube, all of it of `reflectance`, with a lamp of one square tenth under its ceiling that shines
/// down.
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
fn photons_carry_the_power_that_surfaces_reflect() {
    for reflectance in [0.5, 0.9] {
        let buffers = lit_room(reflectance);
        let photons = photons(&buffers.scene(), 64);
        let power: f64 = photons.iter().map(|photon| f64::from(photon.power().x)).sum();
        // The lamp is black and small: the room keeps what it reflects, ρ + ρ² + ..., but for what the lamp takes.
        let emitted = core::f64::consts::PI * 0.01;
        let kept = f64::from(reflectance) / (1.0 - f64::from(reflectance));
        let expected = emitted * kept;
        // Both sides of the lamp are 0.02 of 6 square metres: a share 0.0033 of what is on its way at each turn.
        let lost = (1.0 + kept) * 0.0033;
        let ratio = power / expected;
        assert!(ratio < 1.01 && ratio > 0.99 - lost, "{reflectance}: {ratio}");
        assert!(photons.len() < 64 * ROOM * 4 / 5, "there is room left: {}", photons.len());
    }
}

fn assert_means(a: &Image, b: &Image, tolerance: f64) {
    for (a, b) in a.mean().into_iter().zip(b.mean()) {
        assert!((a / b - 1.0).abs() < tolerance, "{a} {b}");
    }
}

#[test]
fn the_cornell_box_goes_to_that_of_the_path_tracer_at_any_depth() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    for depth in [Some(3), None] {
        let path = render(&scene, Method::Path, 64, 1024, |s| s.max_depth = depth).image;
        let few = sppm(&scene, 64, 8, |s| s.max_depth = depth).image;
        let many = sppm(&scene, 64, 256, |s| s.max_depth = depth).image;
        let (first, last) = (difference(&few, &path), difference(&many, &path));
        // The path tracer's own noise is below half a percent; discs still reach over edges.
        assert!(last < 0.5 * first && last < 0.02, "{depth:?}: {first} {last}");
        assert_means(&many, &path, 0.01);
    }
    let direct = sppm(&scene, 64, 64, |s| s.max_depth = Some(2)).image;
    assert_means(&direct, &render(&scene, Method::Path, 64, 64, |s| s.max_depth = Some(2)).image, 0.01);
}

#[test]
fn every_kind_of_surface_and_light_has_the_light_that_the_path_tracer_finds() {
    let buffers = everything();
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 64, 1024, |_| ()).image;
    let many = sppm(&scene, 64, 256, |_| ()).image;
    assert_means(&many, &path, 0.02);
    assert!(difference(&many, &path) < 0.06, "{}", difference(&many, &path));
}

#[test]
fn narrow_coats_have_the_light_that_the_path_tracer_finds_at_any_angle() {
    for roughness in [0.05f32, 0.1, 0.2] {
        let buffers = varnished_box(roughness);
        let scene = buffers.scene();
        let path = render(&scene, Method::Path, 64, 1024, |_| ()).image;
        let found = sppm(&scene, 64, 256, |_| ()).image;
        assert_means(&found, &path, 0.01);
        // RadiusSchedule reach over edges, and mirrored lamps are noise. Photons in the coats would make 0.13 to 0.46.
        assert!(difference(&found, &path) < 0.1, "{roughness}: {}", difference(&found, &path));
    }
}

#[test]
fn a_caustic_has_its_power() {
    let buffers = lamp_before(Surface::Mirror { reflectance: Rgb::splat(0.9).into() }, 0.6);
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 64, 2048, |_| ()).image;
    let found = sppm(&scene, 64, 256, |_| ()).image;
    assert_means(&found, &path, 0.01);
    assert!(difference(&found, &path) < 0.03, "{}", difference(&found, &path));
}

#[test]
fn what_hangs_over_a_disc_keeps_the_light_beside_it_out() {
    // The jamb is seen through a slit of a centimetre, in front of which discs of a decimetre had light of beyond the door:
    // 5 % of the picture's.
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/two-rooms/two-rooms.toml");
    let loaded = load::load(&file, &LoadOptions::default()).unwrap();
    let views = loaded.views();
    let scene = views.scene(loaded.camera.unwrap());
    let path = render(&scene, Method::Path, 48, 1024, |s| s.caustics = false).image;
    assert_means(&sppm(&scene, 48, 256, |_| ()).image, &path, 0.03);
}

#[test]
fn nothing_leaks_through_a_thin_wall() {
    let buffers = bright_and_dark();
    let image = sppm(&buffers.scene(), 64, 8, |_| ()).image;
    let lit = image.pixels.iter().filter(|pixel| **pixel != [0.0; 3]).count();
    assert_eq!((lit, image.mean()), (0, [0.0; 3]), "the camera is in the dark room");
    let camera = Camera { eye: IN_THE_BRIGHT_ROOM, ..buffers.camera };
    let bright = sppm(&Scene { camera, ..buffers.scene() }, 64, 8, |_| ()).image;
    assert!(bright.mean()[1] > 0.1);
}

#[test]
fn bits_do_not_depend_on_threads_rounds_or_level() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let one = sppm(&scene, 40, 6, |s| s.threads = Some(1)).image;
    for threads in [2, 5] {
        assert_eq!(sppm(&scene, 40, 6, |s| s.threads = Some(threads)).image, one);
    }
    for level in Level::detect().and_below() {
        assert_eq!(sppm(&scene, 40, 6, |s| s.level = level).image, one, "{level:?}");
    }
}

#[test]
fn memory_is_the_same_for_any_number_of_samples_and_less_where_less_is_given() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let bytes = |result: &RenderResult| {
        result.memory.iter().find(|one| one.structure == "photons").map_or(0, |one| one.bytes)
    };
    let (few, many) = (sppm(&scene, 64, 2, |_| ()), sppm(&scene, 64, 32, |_| ()));
    assert_eq!((bytes(&few), few.memory_peak), (bytes(&many), many.memory_peak));
    assert!(bytes(&few) >= Photons::footprint(16 * ROOM).bytes());
    let tight = few.memory_peak - bytes(&few) / 2;
    let less = sppm(&scene, 64, 32, |s| s.memory = Some(tight));
    assert!(less.memory_peak <= tight && bytes(&less) < bytes(&few));
    assert_means(&less.image, &many.image, 0.03);
}
