//! Choice of a method where none is given. The snapshot `tests/tests/choices.txt` shows every change of a
//! choice in its diff:
//!
//!     SNAPSHOT=write cargo test --profile quick -p halflight-tests --test main choice::

use crate::table::scenes::SCENES;
use core::sync::atomic::{AtomicBool, Ordering};
use glam::Vec3;
use halflight::render::{
    self, Checkpoint, Ending, Method, Progress, Reconstruct, RenderResult, Settings, Stop,
};
use halflight_core::Rgb;
use halflight_core::findings::Value;
use halflight_core::scene::{Camera, Material, Scene};
use halflight_simd::Level;
use halflight_tests::render::{number, raw, render};
use halflight_tests::scenes::{SceneBuffers, box_from_above, emitter, metal};
use halflight_tests::snapshot;

const SIZE: u32 = 96;
const SPP: u32 = 16;

/// A closed room whose lamp shines at the ceiling alone.
fn room_with_up_light() -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.1, 0.5, 0.9), Vec3::new(0.6, 0.4, 0.2), Vec3::Y, 70.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.7)));
    let lamp = buffers.material(emitter(0.0, 100.0));
    buffers.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    buffers.square(Vec3::new(0.5, 0.6, 0.5), Vec3::Y, 0.1, lamp);
    buffers.cuboid(Vec3::new(0.4, 0.5, 0.4), Vec3::new(0.6, 0.59, 0.6), false, wall);
    buffers
}

/// A closed room with a small mirror ball, whose lamp is 3 cm wide.
fn room_with_mirror_ball() -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.2, 0.0), Vec3::Y, 80.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.7)));
    let mirror = buffers.material(Material { surface: metal(0.0), ..Material::GREY });
    let lamp = buffers.material(emitter(0.0, 5000.0));
    buffers.cuboid(Vec3::NEG_ONE, Vec3::ONE, true, wall);
    buffers.square(Vec3::new(0.0, 0.99, 0.0), Vec3::NEG_Y, 0.03, lamp);
    buffers.normals = vec![[0.0; 3]; buffers.positions.len()];
    buffers.sphere(Vec3::new(0.3, -0.8, 0.2), 0.2, 24, mirror);
    buffers
}

/// A floor under a lamp.
fn floor() -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.0, 1.0, 2.0), Vec3::ZERO, Vec3::Y, 50.0);
    let mut buffers = SceneBuffers::new(camera);
    let grey = buffers.material(Material::GREY);
    let lamp = buffers.material(emitter(0.0, 10.0));
    buffers.square(Vec3::ZERO, Vec3::Y, 4.0, grey);
    buffers.square(Vec3::new(0.0, 1.5, 0.0), Vec3::NEG_Y, 0.5, lamp);
    buffers
}

/// A picture whose method is left open; `change` edits the settings last.
fn chosen(buffers: &SceneBuffers, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(&buffers.scene(), Method::Path, SIZE, SPP, |settings| {
        (settings.method, settings.audit) = (None, None);
        change(settings);
    })
}

#[test]
fn a_cache_is_chosen_where_indirect_light_is_most_of_the_noise() {
    let room = room_with_up_light();
    let result = chosen(&room, |_| ());
    assert_eq!(result.method, Method::IrradianceCache);
    let [path, cache] = ["path", "irradiance-cache"].map(|method| number(&result, "method", method));
    assert!(path > 2.0 * cache && cache > 0.0, "{path} {cache}");
    assert!(result.audit.is_some(), "its bias is measured");
    let audited_by_nobody = chosen(&room, |settings| settings.audit = Some(0.0));
    assert_eq!(audited_by_nobody.method, Method::Path);
}

#[test]
fn records_of_lobes_are_chosen_where_rough_reflections_are_most_of_the_noise() {
    // Wide lobes, and narrow ones that the camera sees.
    for roughness in [0.55, 0.4] {
        let surface = metal(roughness);
        let result = chosen(&box_from_above(surface, surface), |settings| settings.stop.spp = Some(64));
        assert_eq!(result.method, Method::RadianceCache, "roughness {roughness}");
        let [irradiance, radiance] =
            ["irradiance-cache", "radiance-cache"].map(|method| number(&result, "method", method));
        assert!(irradiance > 2.0 * radiance && radiance > 0.0, "{irradiance} {radiance}");
    }
}

#[test]
fn photons_are_a_choice_where_a_small_lamp_has_a_caustic() {
    let room = room_with_mirror_ball();
    let predicted = |audit| {
        let result = choice_alone(&room.scene(), |settings| {
            (settings.stop.spp, settings.audit) = (Some(256), audit);
        });
        ["path", "sppm"].map(|method| number(&result, "method", method))
    };
    let [path, photons] = predicted(None);
    assert!(path > 10.0 * photons && photons > 0.0, "{path} {photons}");
    assert_eq!(predicted(Some(0.0))[1], 0.0, "nothing measures its blur");
}

#[test]
fn paths_are_chosen_where_light_comes_directly_and_have_their_bits() {
    let floor = floor();
    let result = chosen(&floor, |_| ());
    assert_eq!(result.method, Method::Path);
    let paths = render(&floor.scene(), Method::Path, SIZE, SPP, |_| ());
    assert!(result.image.pixels == paths.image.pixels);
}

#[test]
fn pilots_are_left_out_where_time_suffices_for_a_few_samples() {
    let floor = floor();
    let result = |seconds: f64| {
        chosen(&floor, |settings| settings.stop = Stop { seconds: Some(seconds), ..Stop::default() })
    };
    let [short, long] = [1e-3, 0.5].map(result);
    assert!(short.findings.get("pilots").is_some() && short.findings.get("path_reuse").is_none());
    assert!(long.findings.get("pilots").is_none() && long.findings.get("path_reuse").is_some());
    assert!(short.image.pixels.iter().flatten().any(|&value| value > 0.0));
}

#[test]
fn path_tracing_renders_within_a_memory_limit_that_the_chosen_method_exceeds() {
    let room = room_with_up_light();
    let paths = render(&room.scene(), Method::Path, SIZE, SPP, |_| ());
    let limit = paths.memory_peak + paths.memory_peak / 64;
    let result = chosen(&room, |settings| settings.memory = Some(limit));
    assert!(result.spp == SPP && result.memory_peak <= limit, "{}", result.method.name());
}

#[test]
fn the_choice_follows_from_scene_and_settings_on_any_number_of_threads() {
    let room = room_with_up_light();
    let [one, three] = [1, 3].map(|threads| chosen(&room, |settings| settings.threads = Some(threads)));
    assert_eq!(one.method, three.method);
    assert!(one.image.pixels == three.image.pixels);
}

#[test]
fn a_resumed_film_goes_on_with_the_method_that_was_chosen() {
    let room = room_with_up_light();
    let path = std::env::temp_dir().join(format!("halflight-choice-{}", std::process::id()));
    let keep = Checkpoint { path: path.clone(), every: f64::INFINITY };
    let whole = chosen(&room, |settings| settings.stop.spp = Some(2 * SPP));
    let begun = chosen(&room, |settings| settings.checkpoint = Some(keep));
    let resumed = chosen(&room, |settings| {
        (settings.resume, settings.stop.spp) = (Some(path.clone()), Some(2 * SPP));
    });
    std::fs::remove_file(path).expect("a film");
    assert_eq!([begun.method, resumed.method], [whole.method; 2]);
    assert!(resumed.image.pixels == whole.image.pixels);
}

#[test]
fn path_tracing_takes_the_place_of_a_chosen_method_whose_bias_exceeds_the_requested_error() {
    let room = room_with_up_light();
    let path = std::env::temp_dir().join(format!("halflight-fallback-{}", std::process::id()));
    let to_error = |settings: &mut Settings| {
        settings.stop = Stop { error: Some(1e-3), ..Stop::default() };
        // The prediction assumes records of the usual density.
        settings.cache.error = Some(1.0);
    };
    let result = chosen(&room, |settings| {
        to_error(settings);
        settings.checkpoint = Some(Checkpoint { path: path.clone(), every: f64::INFINITY });
    });
    assert_eq!((result.method, result.ending), (Method::Path, Ending::Done));
    let given_up = result.findings.get("method").expect("a choice").values().last();
    assert_eq!(given_up, Some(("given_up", Value::Name("irradiance-cache"))));
    // The film is that of path tracing alone.
    let paths = chosen(&room, |settings| {
        to_error(settings);
        settings.method = Some(Method::Path);
    });
    assert!(result.image.pixels == paths.image.pixels && result.spp == paths.spp);
    let resumed = chosen(&room, |settings| {
        to_error(settings);
        settings.resume = Some(path.clone());
    });
    std::fs::remove_file(path).expect("a film");
    assert!(resumed.method == Method::Path && resumed.image.pixels == paths.image.pixels);
}

/// Choice for a picture of `scene`, which ends after its first round.
fn choice_alone(scene: &Scene, change: impl FnOnce(&mut Settings)) -> RenderResult {
    let stopped = AtomicBool::new(false);
    let mut stop_render = |_: &Progress| stopped.store(true, Ordering::Relaxed);
    let mut settings = Settings { width: SIZE, height: SIZE, level: Level::BASELINE, ..raw() };
    change(&mut settings);
    render::render(scene, &settings, &mut stop_render, &stopped).expect("a picture")
}

/// Samples per pixel of the pictures of the snapshot.
const BUDGETS: [u32; 3] = [16, 64, 1024];

/// Chosen method and predicted errors of each scene of the table.
fn choices(reconstruct: Reconstruct) -> String {
    let mut text = String::new();
    for scene in SCENES {
        for spp in BUDGETS {
            let max_depth = scene.max_depth;
            scene.with(|scene| {
                let result = choice_alone(scene, |settings| {
                    (settings.max_depth, settings.stop.spp) = (max_depth, Some(spp));
                    settings.reconstruct = reconstruct;
                });
                text += &format!("{:>5} spp {:<16}", spp, result.method.name());
                for method in ["path", "irradiance-cache", "radiance-cache", "bdpt", "sppm"] {
                    let predicted = result.findings.get("method").and_then(|finding| finding.number(method));
                    text += &predicted.map_or("  -      ".into(), |error| format!("  {error:.1e}"));
                }
            });
            text += &format!("  {}\n", scene.name);
        }
    }
    text
}

#[test]
fn choices_are_those_of_the_snapshot() {
    let [raw, reconstructed] = [Reconstruct::Off, Reconstruct::Auto].map(choices);
    let head = format!("# {SIZE} x {SIZE} pixels, seed 0; predicted relMSE, rounded\n");
    snapshot::check("choices.txt", &format!("{head}{raw}# reconstructed pictures\n{reconstructed}"));
}
