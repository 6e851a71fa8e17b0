//! Emission guiding of photons if few lights reach visible surfaces. The table compares the radiance of
//! these scenes with path tracing.

use crate::table::scenes::{rooms, rooms_with_balls};
use glam::Vec3;
use halflight::render::{Method, RenderResult};
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Material, PointLight};
use halflight_tests::render::{finding, render};
use halflight_tests::scenes::{SceneBuffers, cornell_box, emitter};

const METHODS: [Method; 2] = [Method::PhotonMap, Method::ProgressivePhotons];

/// Fractions of light paths whose photons are useful: with guided emission, and without.
fn useful(result: &RenderResult, topic: &str) -> [Option<f64>; 2] {
    ["useful_light_paths", "useful_without_guiding"].map(|name| finding(result, topic).number(name))
}

const ALL: &str = "global_photons";

#[test]
fn unseen_lights_emit_few_photons() {
    for count in [12, 200] {
        let buffers = rooms(count);
        let scene = buffers.scene();
        for method in METHODS {
            let found = render(&scene, method, 48, 8, |_| ());
            let [seen, by_power] = useful(&found, ALL);
            // Guiding gives the one visible lamp of `count` three quarters of the photons and its share of
            // the rest.
            let (seen, by_power) = (seen.unwrap(), by_power.unwrap());
            assert!(by_power < 0.1 && seen > 6.0 * by_power, "{method:?}: {by_power} {seen}");
        }
    }
}

#[test]
fn caustic_photons_are_guided_to_visible_casters() {
    let buffers = rooms_with_balls();
    let found = render(&buffers.scene(), Method::PhotonMap, 48, 8, |_| ());
    let [seen, by_power] = useful(&found, "caustic_photons");
    let (seen, by_power) = (seen.unwrap(), by_power.unwrap());
    assert!(by_power < 0.01 && seen > 100.0 * by_power, "{by_power} {seen}");
}

#[test]
fn visible_lights_emit_by_their_power() {
    for (buffers, count) in [(cornell_box(), "one room"), (rooms(1), "one lamp")] {
        for method in METHODS {
            let [seen, by_power] = useful(&render(&buffers.scene(), method, 64, 2, |_| ()), ALL);
            assert!(by_power.is_none() && seen > Some(0.3), "{count}: {seen:?} {by_power:?}");
        }
    }
}

#[test]
fn without_memory_for_guiding_lights_emit_by_their_power() {
    let buffers = rooms(12);
    let scene = buffers.scene();
    for method in METHODS {
        let whole = render(&scene, method, 64, 8, |_| ());
        let bytes = whole.memory.iter().find(|one| one.structure == "photons").map_or(0, |one| one.bytes);
        let limit = whole.memory_peak - bytes * 9 / 10;
        let found = render(&scene, method, 64, 8, |s| s.memory = Some(limit));
        assert!(useful(&found, ALL)[1].is_none() && useful(&whole, ALL)[1].is_some());
        assert!(found.memory_peak <= limit);
        let deviation = found.image.mean()[1] / whole.image.mean()[1] - 1.0;
        assert!(deviation.abs() < 0.05, "{deviation}");
    }
}

/// A lamp in a closed box, and a point light of a hundred million times its power outside.
#[test]
fn light_paths_leave_lamps_that_light_what_the_camera_sees() {
    let camera = Camera::look_at(Vec3::new(0.0, 0.3, 0.8), Vec3::new(0.0, 0.8, -0.3), Vec3::Y, 90.0);
    let mut buffers = SceneBuffers::new(camera);
    let white = buffers.material(Material::diffuse(Rgb::splat(0.7)));
    let faint = buffers.material(emitter(0.0, 0.01));
    buffers.cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::ONE, true, white);
    buffers.square(Vec3::new(0.0, 0.02, 0.0), Vec3::Y, 0.4, faint);
    let mean = |buffers: &SceneBuffers, method| {
        let pixels = render(&buffers.scene(), method, 48, 32, |_| ()).image.pixels;
        pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / pixels.len() as f64
    };
    let alone = mean(&buffers, Method::InstantRadiosity);
    buffers.lights.push(PointLight::Point { position: Vec3::Y * 5.0, intensity: Rgb::splat(1e5) });
    for method in [Method::InstantRadiosity, Method::ProgressivePhotons] {
        let found = mean(&buffers, method);
        // Noise of 32 samples of 48 × 48 pixels, below one percent by four seeds.
        assert!((found / alone - 1.0).abs() < 0.03, "{method:?}: {found} {alone}");
    }
}
