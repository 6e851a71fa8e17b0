//! Rooms that are hard for an irradiance cache, against path tracing: a thin wall, black surfaces, one small
//! bright source, and a needle in front of the surface.

use glam::Vec3;
use halflight::render::Method;
use halflight::save::Image;
use halflight_core::scene::{Camera, Material, Scene};
use halflight_tests::references::reference;
use halflight_tests::render::{blocks_of, number, render};
use halflight_tests::rooms::{black, boxes_in_black, diffuse, lamp, needles, room, sheet, spot};
use halflight_tests::scenes::{SceneBuffers, constant_environment, cornell_box, metal};
use halflight_tests::statistics::agree_within;

const SIZE: u32 = 64;

fn picture(scene: &Scene, method: Method, spp: u32) -> Image {
    let result = render(scene, method, SIZE, spp, |settings| settings.cache.strata = Some(16));
    assert_eq!(result.counters.dropped.total(), 0);
    result.image
}

/// Independent pictures of each method.
const REPLICAS: u32 = 8;

/// Number of comparisons in this file, which share the significance level.
const COMPARISONS: usize = 5;

/// Largest bias of a block of 6 × 6 pixels, as a share of its light plus a tenth of the mean. Interpolation
/// errs near small objects.
const BIAS: f64 = 0.08;

/// Largest relative bias of the picture's mean.
const BIAS_OF_MEAN: f64 = 0.01;

/// Samples per pixel of a stored picture of path tracing, and of a picture of the cache.
const SPP: [u32; 2] = [512, 16];

/// Asserts that block means of the cache agree with path tracing within the noise of both, a bias of `bias`
/// per block and of `bias_of_mean` for the picture.
#[track_caller]
fn agrees(name: &str, scene: &Scene, bias: f64, bias_of_mean: f64) {
    let values = |method, spp| -> Vec<Vec<f64>> {
        let one = |seed| {
            let result = render(scene, method, 48, spp, |s| (s.seed, s.cache.strata) = (seed, Some(16)));
            assert_eq!(result.counters.dropped.total(), 0);
            let mut values = blocks_of(&result.image, 6);
            values.push(values.iter().sum::<f64>() / values.len() as f64);
            values
        };
        (0..REPLICAS).map(one).collect()
    };
    let path = reference(&format!("{name}, blocks of 6"), || values(Method::Path, SPP[0]));
    let cache = values(Method::IrradianceCache, SPP[1]);
    let last = path.moments.len() - 1;
    let light = path.moments[last].0;
    let allowed = |i: usize, b: f64| if i < last { bias * (b + 0.1 * light) } else { bias_of_mean * b };
    let least = (0..100).map(|i| f64::from(i) / 200.0).find(|b| {
        agree_within(&cache, &path, COMPARISONS, |i, l| if i < last { b * (l + 0.1 * light) } else { l })
            .is_ok()
    });
    println!("bias of blocks {least:?}");
    agree_within(&cache, &path, COMPARISONS, allowed).unwrap_or_else(|why| panic!("{why}"));
}

#[test]
fn a_sheet_between_light_and_dark_has_two_sides() {
    agrees("sheet", &sheet().scene(), BIAS, BIAS_OF_MEAN);
}

#[test]
fn a_black_room_has_no_indirect_light_except_on_white_boxes() {
    let image = picture(&black().scene(), Method::IrradianceCache, 16);
    assert!(image.pixels.iter().flatten().all(|&light| light == 0.0));
    agrees("boxes in black", &boxes_in_black().scene(), BIAS, BIAS_OF_MEAN);
}

#[test]
fn a_small_bright_spot_lights_a_room() {
    agrees("spot", &spot().scene(), BIAS, BIAS_OF_MEAN);
}

/// Gather rays of the first records continue as paths, whose light of many bounces is noisy. Such records are
/// gathered again as soon as others exist.
#[test]
fn the_first_records_are_gathered_again() {
    let result = render(&cornell_box().scene(), Method::IrradianceCache, SIZE, 1, |settings| {
        settings.cache.strata = Some(16);
    });
    let [gathered, records] = ["gathered", "records"].map(|name| number(&result, "irradiance_cache", name));
    let again = gathered / records - 1.0;
    assert!((0.05..0.5).contains(&again), "{again} of them");
}

/// Several light samples per vertex beside a ray that may hit sky or lamp: MIS weights each technique.
#[test]
fn a_court_under_a_sky_has_its_light_once() {
    let camera = Camera::look_at(Vec3::new(0.8, 1.2, 2.2), Vec3::new(0.0, 0.3, 0.0), Vec3::Y, 50.0);
    let mut buffers = SceneBuffers::new(camera);
    let grey = buffers.material(diffuse(0.5));
    buffers.square(Vec3::ZERO, Vec3::Y, 4.0, grey);
    buffers.square(Vec3::new(0.0, 1.0, -1.5), Vec3::Z, 4.0, grey);
    buffers.cuboid(Vec3::new(-0.6, 0.001, -0.6), Vec3::new(0.0, 0.8, 0.0), false, grey);
    buffers.square(Vec3::new(0.2, 1.1, 0.2), Vec3::NEG_Y, 0.9, grey);
    lamp(&mut buffers, Vec3::new(0.9, 0.9, -0.4), Vec3::NEG_X, 0.5, 4.0);
    buffers.environment = constant_environment(0.7);
    let scene = buffers.scene();
    let asked = |spp| render(&scene, Method::IrradianceCache, 2 * SIZE, spp, |_| ()).counters;
    let [few, more] = [1, 3].map(asked);
    let each = (more.shadow_rays - few.shadow_rays) as f64 / (more.paths - few.paths) as f64;
    assert!(each > 2.0, "{each} shadow rays for each path");
    agrees("court", &scene, 0.03, 0.003);
}

/// Only a wall of brushed metal is visible: its light comes from surfaces that no pixel sees.
#[test]
fn a_room_is_seen_in_brushed_metal() {
    let camera = Camera::look_at(Vec3::new(0.5, 0.5, 0.5), Vec3::new(0.5, 0.5, 0.0), Vec3::Y, 60.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(diffuse(0.7));
    buffers.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    let brushed = buffers.material(Material { surface: metal(0.6), ..Material::GREY });
    buffers.square(Vec3::new(0.5, 0.5, 0.01), Vec3::Z, 0.98, brushed);
    lamp(&mut buffers, Vec3::new(0.5, 0.9, 0.8), Vec3::Y, 0.2, 100.0);
    let scene = buffers.scene();
    let [path, cache] = [Method::Path, Method::IrradianceCache].map(|method| {
        render(&scene, method, SIZE, 64, |settings| {
            (settings.cache.strata, settings.reuse, settings.audit) = (Some(16), Some(false), Some(0.0));
        })
    });
    let [few, many] = [&cache, &path].map(|result| result.error.unwrap().relmse);
    println!("{few:.2e} {many:.2e}, {:?}", cache.findings);
    assert!(few < 0.5 * many && number(&cache, "irradiance_cache", "records") > 50.0, "{few} {many}");
    agrees("brushed metal", &scene, BIAS, BIAS_OF_MEAN);
}

#[test]
fn thin_bars_cast_their_shadows() {
    agrees("needles", &needles().scene(), BIAS, BIAS_OF_MEAN);
}

/// Gather rays along the wall pass below the board; strata detect geometry that overhangs the wall.
#[test]
fn a_slot_behind_a_board_is_dark_to_the_last_pixel() {
    let mut buffers = room(0.73);
    buffers.camera = Camera::look_at(Vec3::new(0.5, 0.5, 0.95), Vec3::new(0.97, 0.5, 0.25), Vec3::Y, 30.0);
    let board = buffers.material(diffuse(0.73));
    buffers.cuboid(Vec3::new(0.96, 0.05, 0.0), Vec3::new(0.98, 0.95, 0.3), false, board);
    lamp(&mut buffers, Vec3::new(0.5, 0.99, 0.5), Vec3::NEG_Y, 0.1, 80.0);
    let scene = buffers.scene();
    let (path, cache) = (picture(&scene, Method::Path, 1024), picture(&scene, Method::IrradianceCache, 128));
    let mean = path.mean()[1];
    let pairs = blocks_of(&cache, 1).into_iter().zip(blocks_of(&path, 1));
    let worst = pairs.map(|(a, b)| (a - b).abs() / (b + 0.1 * mean)).fold(0.0, f64::max);
    // Measured: 0.19 to 0.27 with walls alone, 0.09 to 0.10 with overhangs as well.
    assert!(worst < 0.14, "worst pixel {worst}");
}
