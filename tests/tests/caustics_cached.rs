//! An irradiance cache beside caustic photons: no light is counted twice, records come first if memory is
//! short, and the audit merges the same photons.

use halflight::render::{Method, RenderResult, Settings};
use halflight_core::cache::irradiance::Metric;
use halflight_core::scene::Scene;
use halflight_tests::render::{caustics_lack_memory, difference, has_photons, number, render, try_render};
use halflight_tests::scenes::{SceneBuffers, glass, in_a_room, lamp_before, lamp_over_ball, metal};

/// Topic of the finding on caches.
const CACHE: &str = "irradiance_cache";

fn path(scene: &Scene, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(scene, Method::Path, 40, spp, change)
}

/// A picture of `scene` with an irradiance cache.
fn cached(scene: &Scene, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(scene, Method::IrradianceCache, 40, spp, |settings| {
        settings.cache.strata = Some(16);
        change(settings);
    })
}

/// Asserts that a picture of `spp` samples with records and photons agrees with path tracing; `change`
/// applies to both.
fn have_no_light_in_common(name: &str, buffers: &SceneBuffers, spp: u32, change: fn(&mut Settings)) {
    let scene = buffers.scene();
    let truth = path(&scene, 256, change);
    let joined = cached(&scene, spp, change);
    println!("{name}: {:?}", joined.findings);
    assert!(
        has_photons(&joined) && number(&joined, CACHE, "records") > 100.0,
        "{name}: {:?}",
        joined.findings
    );
    for (a, b) in joined.image.mean().into_iter().zip(truth.image.mean()) {
        assert!((a / b - 1.0).abs() < 0.005, "{name}: {a} {b}");
    }
    let difference = difference(&joined.image, &truth.image);
    assert!(difference < 0.03, "{name}: {difference}");
}

#[test]
fn records_and_photons_count_no_light_twice() {
    let glass = in_a_room(lamp_over_ball(glass(0.0), 0.7));
    have_no_light_in_common("glass", &glass, 64, |_| ());
    have_no_light_in_common("mirror", &in_a_room(lamp_before(metal(0.0), 0.6)), 64, |_| ());
    have_no_light_in_common("four segments", &glass, 64, |s| s.max_depth = Some(4));
}

#[test]
fn loaded_records_leave_the_bits_and_photons_can_be_turned_off() {
    let buffers = in_a_room(lamp_over_ball(glass(0.0), 0.3));
    let scene = buffers.scene();
    let records = std::env::temp_dir().join(format!("{}-cached-caustics.records", std::process::id()));
    let one = cached(&scene, 3, |s| s.save_cache = Some(records.clone()));
    assert!(has_photons(&one), "{:?}", one.findings);
    assert_eq!(cached(&scene, 3, |s| s.load_cache = Some(records.clone())).image, one.image);
    let off = cached(&scene, 3, |s| s.caustics = false);
    assert!(!has_photons(&off) && off.image != one.image);
    std::fs::remove_file(records).unwrap();
}

#[test]
fn photons_beside_records_fit_the_memory() {
    let buffers = in_a_room(lamp_over_ball(glass(0.0), 0.3));
    let scene = buffers.scene();
    let limited = |memory, caustics| {
        cached(&scene, 2, |s| (s.threads, s.memory, s.caustics) = (Some(1), memory, caustics))
    };
    let mut limit = limited(None, true).memory_peak;
    let lacking = loop {
        let joined = limited(Some(limit), true);
        assert!(joined.memory_peak <= limit);
        if caustics_lack_memory(&joined) {
            break joined;
        }
        assert!(has_photons(&joined) && number(&joined, CACHE, "records") > 0.0);
        limit = limit * 3 / 4;
    };
    assert!(lacking.image == limited(Some(limit), false).image);
}

#[test]
fn photons_leave_enough_memory_for_records() {
    let buffers = in_a_room(lamp_over_ball(glass(0.0), 0.3));
    let scene = buffers.scene();
    let limited = |memory, caustics| {
        try_render(&scene, Method::IrradianceCache, 24, 2, |s| {
            (s.cache.strata, s.cache.error) = (Some(32), Some(10.0));
            (s.threads, s.memory, s.caustics) = (Some(1), memory, caustics);
        })
    };
    let plain = limited(None, false).unwrap().memory_peak;
    let [mut too_little, mut enough] = [0, plain];
    while enough - too_little > 1000 {
        let middle = too_little.midpoint(enough);
        *(if limited(Some(middle), false).is_ok() { &mut enough } else { &mut too_little }) = middle;
    }
    let mut limit = enough;
    loop {
        let [off, joined] = [false, true].map(|caustics| limited(Some(limit), caustics).unwrap());
        let [without, beside] = [&off, &joined].map(|result| number(result, CACHE, "capacity"));
        if !caustics_lack_memory(&joined) {
            assert!(has_photons(&joined) && 4.0 * beside > without);
            break;
        }
        assert_eq!(joined.image, off.image);
        limit += 50_000;
    }
}

/// Audit paths hardly ever hit by chance the caustic that lights this room. Merged with photons they need
/// not.
#[test]
fn the_audit_merges_the_same_photons() {
    let buffers = in_a_room(lamp_over_ball(glass(0.0), 0.3));
    let scene = buffers.scene();
    for seed in [0, 3] {
        let fine = cached(&scene, 128, |s| (s.seed, s.audit, s.stop.error) = (seed, None, Some(1e-9)));
        let audit = fine.audit.as_ref().unwrap();
        println!("seed {seed}: {:?} {:?} {:?}", fine.error, audit.bias, audit.whole);
        assert!(audit.work.has_photons && audit.bias.lower == 0.0);
        // Fireflies of paths hide a small bias in the pictures of other seeds.
        if seed == 3 {
            assert!(!audit.is_biased() && audit.bias.detectable < 0.02);
        }
    }

    // Records ten times too wide, by a metric that allows it: the audit detects their bias.
    for seed in 0..2 {
        let coarse = cached(&scene, 128, |s| {
            (s.seed, s.audit) = (seed, Some(0.5));
            (s.cache.metric, s.cache.error) = (Metric::MinDistance, Some(3.0));
        });
        let audit = coarse.audit.as_ref().unwrap();
        println!("seed {seed}: {:?} {:?}", audit.bias, audit.whole);
        assert!(audit.work.has_photons && audit.is_biased());
    }
}
