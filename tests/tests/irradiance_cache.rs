//! The irradiance cache as a method of the renderer: its light against that of the path tracer, its bits against
//! threads, its records against the unit of the scene, and what it does without memory.

use core::sync::atomic::AtomicBool;
use glam::Vec3;
use halflight::drive::{CacheUse, Checkpoint, Ending, Mark, Method, RenderResult, Settings};
use halflight_core::Rgb;
use halflight_core::scene::{Material, Scene};
use halflight_tests::render::{blocks, difference, render};
use halflight_tests::scenes::{SceneBuffers, cornell_box, emitter, everything};
use std::path::Path;

/// Rays of a record are 16² in these tests: one percent of noise in each record, at worst.
const STRATA: u32 = 16;

fn cached(scene: &Scene, size: u32, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(scene, Method::IrradianceCache, size, spp, |settings| {
        settings.cache.strata = Some(STRATA);
        change(settings);
    })
}

fn cache(result: &RenderResult) -> CacheUse {
    CacheUse { seconds: 0.0, ..result.cache.unwrap() }
}

#[test]
fn the_cornell_box_is_that_of_the_path_tracer_at_any_depth() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    for depth in [Some(3), None] {
        let path = render(&scene, Method::Path, 64, 512, |s| s.max_depth = depth);
        let cache = cached(&scene, 64, 128, |s| s.max_depth = depth);
        assert!(cache.cache.unwrap().records > 100 && cache.counters.dropped.total() == 0);
        // The noise of both leaves 0.3 %; the rest is for interpolation.
        for (a, b) in cache.image.mean().into_iter().zip(path.image.mean()) {
            assert!((a / b - 1.0).abs() < 0.01, "{depth:?}: {a} {b}");
        }
        let difference = difference(&cache.image, &path.image);
        assert!(difference < 0.03, "{depth:?}: {difference}");
        let seen = cached(&scene, 64, 1, |s| s.max_depth = Some(2));
        assert_eq!(seen.cache.unwrap().records, 0);
    }
}

#[test]
fn caches_are_left_when_their_time_is_over() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 64, 64, |_| ());
    // No time at all: the one sample that every picture has is path traced.
    let timed = |seconds: f64| cached(&scene, 64, 64, |s| s.stop.seconds = Some(seconds));
    let none = timed(0.0);
    assert_eq!((none.spp, cache(&none)), (1, CacheUse { records: 0, is_cut: true, ..cache(&none) }));
    assert!(difference(&none.image, &path.image) < 0.4);
    // With time enough they are as without a limit.
    let (long, unlimited) = (timed(1e6), cached(&scene, 64, 64, |_| ()));
    assert!(long.image == unlimited.image && cache(&long) == cache(&unlimited));
    assert!(!cache(&long).is_cut);
}

#[test]
fn records_have_256_rays_where_nothing_is_said() {
    let scene = cornell_box();
    let of = |strata| cached(&scene.scene(), 32, 4, |s| s.cache.strata = strata);
    let (usual, asked, more) = (of(None), of(Some(16)), of(Some(24)));
    assert!(usual.image == asked.image && cache(&usual) == cache(&asked));
    assert_eq!([&usual, &more].map(|result| cache(result).rays), [256, 576]);
}

#[test]
fn an_impatient_user_does_not_wait_for_caches() {
    let buffers = cornell_box();
    let settings =
        Settings { method: Some(Method::IrradianceCache), width: 64, height: 64, ..Settings::default() };
    let result =
        halflight::drive::render(&buffers.scene(), &settings, &mut |_| (), &AtomicBool::new(true)).unwrap();
    assert_eq!((result.spp, result.ending, cache(&result).records), (1, Ending::Interrupted, 0));
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
fn in_a_furnace_all_is_one_light() {
    // Reflectance a half, emission 1: radiance 2 everywhere.
    let camera =
        halflight_core::scene::Camera::look_at(Vec3::splat(0.3), Vec3::new(0.9, 0.5, 0.8), Vec3::Y, 60.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(emitter(0.5, 1.0));
    buffers.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    let image = cached(&buffers.scene(), 32, 64, |_| ()).image;
    assert!(image.mean().into_iter().all(|mean| (mean / 2.0 - 1.0).abs() < 0.005), "{:?}", image.mean());
    // Errors of a record are shared by many pixels: 16² rays whose last bounces come and go.
    assert!(blocks(&image).into_iter().all(|block| (block / 2.0 - 1.0).abs() < 0.05));
}

#[test]
fn bits_do_not_depend_on_threads_or_rounds() {
    for buffers in [cornell_box(), everything()] {
        let scene = buffers.scene();
        let one = cached(&scene, 40, 4, |s| s.threads = Some(1));
        assert!(one.cache.unwrap().records > 20);
        for threads in [2, 5] {
            let other = cached(&scene, 40, 4, |s| s.threads = Some(threads));
            assert!(other.image == one.image, "{threads} threads");
            assert_eq!(cache(&other), cache(&one));
        }
    }
}

#[test]
fn the_unit_of_the_scene_does_not_matter() {
    let records = |unit: f32| {
        let mut buffers = cornell_box();
        buffers.positions.iter_mut().for_each(|p| *p = p.map(|x| x * unit));
        buffers.camera.eye *= unit;
        cached(&buffers.scene(), 64, 1, |_| ()).cache.unwrap().records as f64
    };
    let metres = records(1.0);
    for unit in [1e-3, 1e3, 0.37] {
        let other = records(unit);
        assert!((other / metres - 1.0).abs() < 0.01, "{other} records, not {metres}");
    }
}

#[test]
fn a_wide_landscape_takes_no_records_from_a_room() {
    let records = |size: f32| {
        let mut buffers = cornell_box();
        let black = buffers.material(Material::diffuse(Rgb::ZERO));
        buffers.square(Vec3::new(0.0, -0.5 * size, 0.0), Vec3::Y, size, black);
        cached(&buffers.scene(), 64, 1, |_| ()).cache.unwrap().records as f64
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
        let (used, all) = (tiny.cache.unwrap(), whole.cache.unwrap());
        assert!(used.capacity < all.records && used.records <= used.capacity, "{used:?}");
        for (a, b) in tiny.image.mean().into_iter().zip(whole.image.mean()) {
            assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
        }
    }
}

#[test]
fn mirrors_and_glass_keep_their_light() {
    let buffers = everything();
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 64, 512, |_| ());
    let cache = cached(&scene, 64, 128, |_| ());
    assert_eq!(cache.counters.dropped.total(), 0);
    for (a, b) in cache.image.mean().into_iter().zip(path.image.mean()) {
        assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
    }
}

#[test]
fn a_survey_tells_where_records_are_and_how_wrong_they_are() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let plain = cached(&scene, 64, 2, |_| ());
    let done = cached(&scene, 64, 2, |s| s.survey = Some(60));
    assert_eq!((plain.image.pixels, plain.survey.is_none()), (done.image.pixels, true));
    let survey = done.survey.unwrap();
    assert_eq!((survey.step, survey.width, survey.looks.len()), (1, 64, 64 * 64));
    assert!(survey.points >= 40 && survey.checks.len() as u64 <= survey.points);
    let served = survey.looks.iter().filter(|look| look.radius > 0.0).count();
    assert!(served > 3000 && survey.looks.iter().filter(|look| look.mark == Mark::Record).count() > 50);
    // 256 rays a record: a few percent of noise, of which half is left where records overlap.
    assert!(survey.achieved > 1e-4 && survey.achieved < 0.1, "{}", survey.achieved);
    assert!(survey.predicted > 1e-4 && survey.predicted < 1.0, "{}", survey.predicted);
    assert!(cached(&scene, 64, 2, |s| s.max_depth = Some(2)).survey.is_none());
}

/// Sixteen rays a record: noise that no number of samples takes away ends the render, and so it does in a film that goes on.
#[test]
fn an_error_below_the_noise_of_records_is_out_of_reach() {
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
