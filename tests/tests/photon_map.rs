//! Photon mapping in two passes: its light against that of the path tracer, within the bias that is stated here, its bits
//! against threads, rounds and levels, what must stay dark, and what less memory does to it.

use halflight::drive::{Method, PhotonUse, RenderResult, Settings};
use halflight::load::{self, LoadOptions};
use halflight::save::Image;
use halflight_core::Rgb;
use halflight_core::photon::Kernel;
use halflight_core::scene::{Camera, Scene, Surface};
use halflight_tests::render::render;
use halflight_tests::scenes::{
    IN_THE_BRIGHT_ROOM, bright_and_dark, cornell_box, everything, lamp_before, varnished,
};
use std::path::Path;

fn mapped(scene: &Scene, size: u32, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(scene, Method::PhotonMap, size, spp, change)
}

/// Largest relative deviation of the mean of a channel.
fn deviation(a: &Image, b: &Image) -> f64 {
    let ratios = a.mean().into_iter().zip(b.mean()).map(|(a, b)| a / b - 1.0);
    ratios.fold(0.0, |largest: f64, ratio| if ratio.abs() > largest.abs() { ratio } else { largest })
}

/// The bias of the mean that the map's blur may cause in a room whose indirect light is most of its light: photons are too
/// few in a strip along open edges.
const BIAS: f64 = 0.01;

/// The same where all light comes through the slit of a door, with the few photons of a picture this small: the blur is
/// as wide as the slit. 2 % were measured, and the noise of both is one.
const SLIT_BIAS: f64 = 0.05;

#[test]
fn the_cornell_box_has_the_light_of_the_path_tracer_at_any_depth() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    for depth in [Some(2), Some(3), None] {
        let path = render(&scene, Method::Path, 64, 512, |s| s.max_depth = depth).image;
        let found = mapped(&scene, 64, 128, |s| s.max_depth = depth).image;
        let deviation = deviation(&found, &path);
        assert!(deviation.abs() < BIAS, "{depth:?}: {deviation}");
    }
}

#[test]
fn every_kernel_estimates_the_same_light() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let with = |kernel| mapped(&scene, 64, 64, |s| s.photons.kernel = kernel).image;
    let usual = with(Kernel::Epanechnikov);
    for kernel in [Kernel::Constant, Kernel::Cone] {
        let deviation = deviation(&with(kernel), &usual);
        assert!(deviation.abs() < BIAS, "{kernel:?}: {deviation}");
    }
}

#[test]
fn two_rooms_have_the_light_of_the_path_tracer() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/two-rooms/two-rooms.toml");
    let loaded = load::load(&file, &LoadOptions::default()).unwrap();
    let views = loaded.views();
    let scene = views.scene(loaded.camera.unwrap());
    let path = render(&scene, Method::Path, 64, 512, |_| ()).image;
    let found = mapped(&scene, 64, 128, |_| ()).image;
    let deviation = deviation(&found, &path);
    assert!(deviation.abs() < SLIT_BIAS, "light comes through a slit: {deviation}");
}

#[test]
fn every_kind_of_surface_and_light_has_the_light_that_the_path_tracer_finds() {
    let buffers = everything();
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 64, 512, |_| ()).image;
    let found = mapped(&scene, 64, 256, |_| ()).image;
    let deviation = deviation(&found, &path);
    assert!(deviation.abs() < 2.0 * BIAS, "{deviation}");
}

#[test]
fn narrow_coats_have_the_light_that_the_path_tracer_finds() {
    for roughness in [0.1, 0.3] {
        let buffers = varnished(cornell_box(), roughness);
        let scene = buffers.scene();
        let path = render(&scene, Method::Path, 64, 512, |_| ()).image;
        let found = mapped(&scene, 64, 256, |_| ()).image;
        let deviation = deviation(&found, &path);
        assert!(deviation.abs() < 2.0 * BIAS, "{roughness}: {deviation}");
    }
}

#[test]
fn a_caustic_has_its_power_and_its_map() {
    let buffers = lamp_before(Surface::Mirror { reflectance: Rgb::splat(0.9).into() }, 0.6);
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 64, 2048, |_| ()).image;
    let found = mapped(&scene, 64, 256, |_| ());
    let deviation = deviation(&found.image, &path);
    assert!(deviation.abs() < BIAS, "{deviation}");
    let caustic = found.photons.unwrap().caustic.unwrap();
    assert!(caustic.stored > caustic.shot / 10, "{caustic:?}");
}

#[test]
fn nothing_leaks_through_a_thin_wall() {
    let buffers = bright_and_dark();
    let image = mapped(&buffers.scene(), 64, 8, |_| ()).image;
    let lit = image.pixels.iter().filter(|pixel| **pixel != [0.0; 3]).count();
    assert_eq!((lit, image.mean()), (0, [0.0; 3]), "the camera is in the dark room");
    let camera = Camera { eye: IN_THE_BRIGHT_ROOM, ..buffers.camera };
    let bright = mapped(&Scene { camera, ..buffers.scene() }, 64, 8, |_| ()).image;
    assert!(bright.mean()[1] > 0.1);
}

fn used(result: &RenderResult) -> PhotonUse {
    result.photons.unwrap()
}

#[test]
fn bits_do_not_depend_on_threads_rounds_or_level() {
    let buffers = everything();
    let scene = buffers.scene();
    let one = mapped(&scene, 40, 20, |s| s.threads = Some(1));
    // Two maps for each eight samples, made once, however many rounds there were.
    assert_eq!(used(&one).maps, 6);
    for threads in [2, 5] {
        let other = mapped(&scene, 40, 20, |s| s.threads = Some(threads));
        assert_eq!((&other.image, used(&other)), (&one.image, used(&one)));
    }
    for level in halflight_core::Level::detect().and_below() {
        assert_eq!(mapped(&scene, 40, 20, |s| s.level = level).image, one.image, "{level:?}");
    }
}

#[test]
fn a_tenth_of_the_memory_makes_noise_and_says_so() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 64, 512, |_| ()).image;
    let bytes = |result: &RenderResult| {
        result.memory.iter().find(|one| one.structure == "photons").map_or(0, |one| one.bytes)
    };
    let whole = mapped(&scene, 64, 64, |s| s.photons.global = Some(1 << 17));
    let limit = whole.memory_peak - bytes(&whole) * 9 / 10;
    let tenth = mapped(&scene, 64, 64, |s| {
        s.photons.global = Some(1 << 17);
        s.memory = Some(limit);
    });
    let (all, few) = (used(&whole).global.unwrap(), used(&tenth).global.unwrap());
    assert_eq!(all.wanted, all.given);
    assert!(few.wanted == all.wanted && few.given <= few.wanted / 10 && few.given > few.wanted / 20);
    assert!(tenth.memory_peak <= limit && bytes(&tenth) <= bytes(&whole) / 10);
    assert!(deviation(&tenth.image, &path).abs() < 2.0 * BIAS);
}
