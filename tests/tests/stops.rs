//! Renders that end early: before their first sample, and with light that stays in glass. The table tests
//! deadlines and interrupts for each method.

use crate::table::scenes::glass_cube;
use core::sync::atomic::AtomicBool;
use core::time::Duration;
use glam::Vec3;
use halflight::render::{self, Ending, Method, RenderResult, Settings, Stop};
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Material};
use halflight_tests::render::raw;
use halflight_tests::scenes::{SceneBuffers, emitter};
use halflight_tests::statistics::judge;
use std::time::Instant;

/// Upper bound on the time of a render, on a busy machine.
const DEADLINE: Duration = Duration::from_secs(120);

#[test]
fn light_leaves_glass_before_the_limit_of_bounces_and_cut_paths_are_counted() {
    // The floor beside the cube, out of reach of light that total reflection traps.
    let render = |method: Method, depth: Option<u32>, seed: u32| {
        halflight_tests::render::render(&glass_cube(false).scene(), method, 48, 32, |settings| {
            (settings.max_depth, settings.seed) = (depth, seed);
        })
    };
    // Columns and rows that show the floor alone.
    let floor = |result: &RenderResult| {
        let rows = result.image.pixels.chunks(48).skip(33);
        rows.map(|row| row[10..38].iter().map(|pixel| f64::from(pixel[1])).sum::<f64>()).sum::<f64>()
    };
    let known = floor(&render(Method::ProgressivePhotons, Some(64), 0));
    for method in Method::ALL {
        let result = render(method, None, 0);
        let found = floor(&result);
        if method == Method::Metropolis {
            // Only splats find this light, and few points of primary sample space are splats.
            let replicas: Vec<_> = (0..24).map(|seed| vec![floor(&render(method, None, seed))]).collect();
            judge(&replicas, &[known]).unwrap();
        } else {
            assert!((found / known - 1.0).abs() < 0.03, "{}: {found}, not {known}", method.name());
        }
        // Russian roulette ends light subpaths of virtual lights long before the limit, and subpaths of
        // chains are short.
        let has_roulette =
            matches!(method, Method::Metropolis | Method::InstantRadiosity | Method::ClampedInstantRadiosity);
        assert_eq!(result.counters.dropped.unfinished > 0, !has_roulette, "{}", method.name());
    }
}

#[test]
fn a_picture_that_ends_before_its_first_sample_is_whole() {
    // An interrupt from the start on one thread, with more pixels than there is time for: a lit floor.
    let mut buffers = SceneBuffers::new(Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::Z, 40.0));
    let floor = buffers.material(Material::diffuse(Rgb::splat(0.5)));
    let lamp = buffers.material(emitter(0.5, 1.0));
    buffers.square(Vec3::ZERO, Vec3::Y, 9.0, floor);
    buffers.square(Vec3::new(0.0, 4.0, 0.0), Vec3::NEG_Y, 9.0, lamp);
    for method in [Method::Path, Method::IrradianceCache] {
        let stop = Stop { spp: Some(64), ..Stop::default() };
        let (width, height, threads, method) = (2560, 2560, Some(1), Some(method));
        let settings = Settings { width, height, threads, method, stop, ..raw() };
        let start = Instant::now();
        let result =
            render::render(&buffers.scene(), &settings, &mut |_| (), &AtomicBool::new(true)).unwrap();
        assert!(start.elapsed() < DEADLINE);
        assert_eq!((result.ending, result.spp), (Ending::Interrupted, u32::from(result.filled_pixels == 0)));
        let dark = result.image.pixels.iter().filter(|pixel| pixel[1] == 0.0).count();
        assert!(dark < result.image.pixels.len() / 100, "{dark}");
    }
}

#[test]
fn an_audit_that_finds_no_light_reports_no_bias() {
    for method in [Method::ProgressivePhotons, Method::PhotonMap] {
        let stop = Stop { spp: Some(512), error: Some(0.02), ..Stop::default() };
        let settings = Settings { method: Some(method), width: 32, height: 32, stop, ..raw() };
        let flag = AtomicBool::new(false);
        let result = render::render(&glass_cube(false).scene(), &settings, &mut |_| (), &flag).unwrap();
        let (audit, error) = (result.audit.unwrap(), result.error.unwrap());
        assert!(audit.is_blind && audit.work.unseen > 0.9 && !audit.is_biased(), "{audit:?}");
        assert!(result.ending == Ending::Done && result.spp < 512 && error.upper <= 0.02, "{error:?}");
    }
}
