//! Light of a spot by a mirror beside bright light, which no camera path finds.

use glam::Vec3;
use halflight::render::{Method, RenderResult};
use halflight_core::Rgb;
use halflight_core::findings::Decision;
use halflight_core::scene::{Camera, Material, PointLight, Surface};
use halflight_tests::render::{finding, render};
use halflight_tests::scenes::{SceneBuffers, emitter};

/// Pixels across and down, and the part of the picture around its centre that is judged.
const SIZE: u32 = 32;
const MIDDLE: core::ops::Range<u32> = 12..20;

/// Distance from the camera to the floor, and the tangent of half of its field.
const HEIGHT: f32 = 3.0;
const TAN: f32 = 0.2;

/// Reflectance of the floor, which emits 1.
const ALBEDO: f32 = 0.5;

/// Samples of a picture.
const SAMPLES: u32 = 256;

/// Relative tolerance: four standard deviations of the mean of four pictures. The judged part of one has a
/// standard deviation of about 6 % by its few photons.
const TOLERANCE: f64 = 0.12;

/// A floor that a spot light of this `intensity` lights by way of a mirror, seen from above.
fn by_a_mirror(intensity: f32) -> SceneBuffers {
    let middle = Vec3::new(1.0, 0.0, 0.0);
    let mut camera = Camera::look_at(middle + HEIGHT * Vec3::Y, middle, Vec3::Z, 40.0);
    camera.tan_half_fov = TAN;
    let mut buffers = SceneBuffers::new(camera);
    let floor = buffers.material(emitter(ALBEDO, 1.0));
    let mirror = Surface::Mirror { reflectance: Rgb::ONE.into() };
    let mirror = buffers.material(Material { surface: mirror, ..Material::GREY });
    buffers.square(Vec3::ZERO, Vec3::Y, 8.0, floor);
    buffers.square(Vec3::new(2.0, 1.0, 0.0), Vec3::NEG_X, 1.0, mirror);
    buffers.lights.push(PointLight::Spot {
        position: Vec3::new(1.0, 2.0, 0.0),
        direction: Vec3::new(1.0, -1.0, 0.0).normalize(),
        intensity: Rgb::splat(intensity),
        cos_inner: 0.991,
        cos_outer: 0.990,
    });
    buffers
}

/// Mean over the judged part.
fn middle(result: &RenderResult) -> f64 {
    let places = MIDDLE.flat_map(|y| MIDDLE.map(move |x| y * SIZE + x));
    let light = places.map(|place| f64::from(result.image.pixels[place as usize][0]));
    light.sum::<f64>() / (MIDDLE.len() * MIDDLE.len()) as f64
}

/// The same of the caustic of a light of intensity 1: that of its image in the mirror.
fn expected() -> f64 {
    let at = |pixel: u32| HEIGHT * TAN * (2.0 * (pixel as f32 + 0.5) / SIZE as f32 - 1.0);
    let places = MIDDLE.flat_map(|y| MIDDLE.map(move |x| Vec3::new(1.0 + at(x), 0.0, at(y))));
    let light = places.map(|place| {
        let to_light = Vec3::new(3.0, 2.0, 0.0) - place;
        let squared = to_light.length_squared();
        f64::from(ALBEDO / core::f32::consts::PI * to_light.y / (squared * squared.sqrt()))
    });
    light.sum::<f64>() / (MIDDLE.len() * MIDDLE.len()) as f64
}

#[test]
fn the_caustic_of_a_spot_by_a_mirror_is_that_of_its_image() {
    for method in [Method::Path, Method::IrradianceCache] {
        let picture = |intensity, seed| {
            render(&by_a_mirror(intensity).scene(), method, SIZE, SAMPLES, |settings| settings.seed = seed)
        };
        let without = [0, 1, 2, 3].map(|seed| middle(&picture(1e-9, seed)));
        // A third and a thirtieth of the light of the floor.
        for intensity in [25.0, 2.5] {
            let caustic = |seed: usize| {
                let with = picture(intensity, seed as u32);
                assert_ne!(finding(&with, "caustic_photons").decision, Decision::LeftOut);
                (middle(&with) - without[seed]) / f64::from(intensity)
            };
            let found = (0..without.len()).map(caustic).sum::<f64>() / without.len() as f64;
            assert!((found / expected() - 1.0).abs() < TOLERANCE, "{method:?} {intensity}: {found}");
        }
    }
}
