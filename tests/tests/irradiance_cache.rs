//! Irradiance caching as a method: records do not depend on the scene's unit of length, and pictures need
//! neither time nor memory for records.

use core::sync::atomic::AtomicBool;
use glam::Vec3;
use halflight::render::{Checkpoint, Ending, Mark, Method, RenderResult, Settings};
use halflight_core::Rgb;
use halflight_core::findings::{Decision, Value};
use halflight_core::scene::{Material, Scene};
use halflight_tests::render::{blocks, difference, finding, number, render};
use halflight_tests::scenes::{SceneBuffers, cornell_box, emitter};
use std::path::Path;

/// Gather rays are 16² per record in these tests: at worst one percent of noise in each record.
const STRATA: u32 = 16;

fn cached(scene: &Scene, size: u32, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(scene, Method::IrradianceCache, size, spp, |settings| {
        settings.cache.strata = Some(STRATA);
        change(settings);
    })
}

/// Decision and numbers of the caches, except seconds.
fn cache(result: &RenderResult) -> (Decision, Vec<(&'static str, Value)>) {
    let found = finding(result, "irradiance_cache");
    (found.decision, found.values().filter(|(name, _)| *name != "seconds").collect())
}

fn count(result: &RenderResult, name: &str) -> f64 {
    number(result, "irradiance_cache", name)
}

#[test]
fn direct_light_needs_no_records() {
    let buffers = cornell_box();
    let records = |depth| count(&cached(&buffers.scene(), 32, 1, |s| s.max_depth = Some(depth)), "records");
    assert_eq!(records(2), 0.0);
    assert!(records(3) > 50.0);
}

#[test]
fn filling_a_cache_ends_at_the_deadline() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 64, 64, |_| ());
    // Without time, the one sample that every picture has is path traced.
    let timed = |seconds: f64| cached(&scene, 64, 64, |s| s.stop.seconds = Some(seconds));
    let none = timed(0.0);
    assert_eq!((none.spp, count(&none, "records"), cache(&none).0), (1, 0.0, Decision::Limited));
    assert!(difference(&none.image, &path.image) < 0.4);
    // A generous time limit gives the bits of a render without limit.
    let (long, unlimited) = (timed(1e6), cached(&scene, 64, 64, |_| ()));
    assert!(long.image == unlimited.image && cache(&long) == cache(&unlimited));
    assert_eq!(cache(&long).0, Decision::Used);
}

#[test]
fn records_have_256_rays_by_default() {
    let scene = cornell_box();
    let of = |strata| cached(&scene.scene(), 32, 4, |s| s.cache.strata = strata);
    let (usual, asked, more) = (of(None), of(Some(16)), of(Some(24)));
    assert!(usual.image == asked.image && cache(&usual) == cache(&asked));
    assert_eq!([&usual, &more].map(|result| count(result, "rays_per_record")), [256.0, 576.0]);
}

#[test]
fn filling_a_cache_ends_at_an_interrupt() {
    let buffers = cornell_box();
    let settings =
        Settings { method: Some(Method::IrradianceCache), width: 64, height: 64, ..Settings::default() };
    let result =
        halflight::render::render(&buffers.scene(), &settings, &mut |_| (), &AtomicBool::new(true)).unwrap();
    assert_eq!((result.spp, result.ending, count(&result, "records")), (1, Ending::Interrupted, 0.0));
}

#[test]
fn cached_vertices_have_several_light_samples() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    // In coarser pictures many pixels are edges.
    let [few, more] = [1, 3].map(|spp| cached(&scene, 128, spp, |_| ()).counters);
    let each = (more.shadow_rays - few.shadow_rays) as f64 / (more.paths - few.paths) as f64;
    assert!(each > 2.0, "{each}");
}

#[test]
fn radiance_in_a_furnace_is_constant() {
    // Reflectance a half, emission 1: radiance 2 everywhere.
    let camera =
        halflight_core::scene::Camera::look_at(Vec3::splat(0.3), Vec3::new(0.9, 0.5, 0.8), Vec3::Y, 60.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(emitter(0.5, 1.0));
    buffers.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    let image = cached(&buffers.scene(), 32, 64, |_| ()).image;
    assert!(image.mean().into_iter().all(|mean| (mean / 2.0 - 1.0).abs() < 0.005), "{:?}", image.mean());
    // Many pixels share the error of a record of 16² rays with Russian roulette.
    assert!(blocks(&image).into_iter().all(|block| (block / 2.0 - 1.0).abs() < 0.05));
}

#[test]
fn records_do_not_depend_on_the_unit_of_length() {
    let records = |unit: f32| {
        let mut buffers = cornell_box();
        buffers.positions.iter_mut().for_each(|p| *p = p.map(|x| x * unit));
        buffers.camera.eye *= unit;
        count(&cached(&buffers.scene(), 64, 1, |_| ()), "records")
    };
    let metres = records(1.0);
    for unit in [1e-3, 1e3, 0.37] {
        let other = records(unit);
        assert!((other / metres - 1.0).abs() < 0.01, "{other} records, not {metres}");
    }
}

#[test]
fn a_large_ground_leaves_a_room_its_records() {
    let records = |size: f32| {
        let mut buffers = cornell_box();
        let black = buffers.material(Material::diffuse(Rgb::ZERO));
        buffers.square(Vec3::new(0.0, -0.5 * size, 0.0), Vec3::Y, size, black);
        count(&cached(&buffers.scene(), 64, 1, |_| ()), "records")
    };
    let alone = records(0.1);
    for size in [30.0, 3000.0] {
        let wide = records(size);
        assert!(wide > 0.7 * alone, "{wide} records, not {alone}");
    }
}

#[test]
fn without_memory_for_records_the_rest_is_path_traced() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let whole = cached(&scene, 32, 64, |_| ());
    let total: usize = whole.memory.iter().map(|part| part.bytes).sum();
    let caches = whole.memory.iter().find(|part| part.structure == "cache").unwrap().bytes;
    for left in [0, 1000, 20_000] {
        let tiny = cached(&scene, 32, 64, |s| {
            s.memory = Some((total - caches + left).max(whole.memory_peak - caches));
            s.threads = Some(whole.threads);
        });
        let (records, capacity) = (count(&tiny, "records"), count(&tiny, "capacity"));
        assert!(capacity < count(&whole, "records") && records <= capacity, "{records} of {capacity}");
        for (a, b) in tiny.image.mean().into_iter().zip(whole.image.mean()) {
            assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
        }
    }
}

#[test]
fn a_survey_reports_places_and_errors_of_records() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let plain = cached(&scene, 64, 2, |_| ());
    let done = cached(&scene, 64, 2, |s| s.survey = Some(60));
    assert_eq!((plain.image.pixels, plain.survey.is_none()), (done.image.pixels, true));
    let survey = done.survey.unwrap();
    assert_eq!((survey.step, survey.width, survey.pixels.len()), (1, 64, 64 * 64));
    assert!(survey.points >= 40 && survey.checks.len() as u64 <= survey.points);
    let served = survey.pixels.iter().filter(|pixel| pixel.radius > 0.0).count();
    assert!(served > 3000 && survey.pixels.iter().filter(|pixel| pixel.mark == Mark::Record).count() > 50);
    // 256 gather rays: a few percent of noise per record. Overlapping records halve it.
    assert!(survey.achieved > 1e-4 && survey.achieved < 0.1, "{}", survey.achieved);
    assert!(survey.predicted > 1e-4 && survey.predicted < 1.0, "{}", survey.predicted);
    assert!(cached(&scene, 64, 2, |s| s.max_depth = Some(2)).survey.is_none());
}

/// With sixteen gather rays per record, noise that no number of samples removes ends the render, also in a
/// resumed film.
#[test]
fn noise_of_records_ends_the_render_with_the_same_bits_after_a_resumption() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let film = std::env::temp_dir().join(format!("halflight-noise-{}", std::process::id()));
    let of = |spp, resume: Option<&Path>| {
        render(&scene, Method::IrradianceCache, 64, spp, |settings| {
            settings.cache.strata = Some(4);
            settings.stop.error = Some(2e-3);
            settings.audit = Some(0.0);
            settings.checkpoint = Some(Checkpoint { path: film.clone(), every: f64::INFINITY });
            settings.resume = resume.map(Path::to_path_buf);
        })
    };
    let whole = of(1 << 14, None);
    println!("{:?} after {} samples", whole.error, whole.spp);
    assert!(whole.ending == Ending::NoiseFloor && whole.spp < 1 << 10, "{:?} {}", whole.ending, whole.spp);
    assert_eq!(of(20, None).ending, Ending::Done);
    let resumed = of(1 << 14, Some(&film));
    std::fs::remove_file(&film).unwrap();
    assert!(resumed.spp == whole.spp && resumed.image == whole.image);
}
