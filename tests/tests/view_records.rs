//! View-bound records against path tracing: floors of narrow metal and of varnish, and a table in the sun,
//! whose legs are small bright things close to the surface.

use halflight::render::{Method, RenderResult, Settings};
use halflight_core::findings::Decision;
use halflight_tests::agreement::Agreement;
use halflight_tests::render::{finding, number, render};
use halflight_tests::scenes::{SceneBuffers, box_from_above, cornell_box, metal, table_in_the_sun, varnish};

const SIZE: u32 = 48;

fn cached(buffers: &SceneBuffers, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(&buffers.scene(), Method::RadianceCache, SIZE, 4, change)
}

/// Pictures with records agree with those of path tracing, which many comparisons are made of. The bias of a
/// block of 4 × 4 pixels is a sixth at most.
#[track_caller]
fn agrees(name: &str, buffers: &SceneBuffers, comparisons: usize) {
    let agreement = Agreement { size: SIZE, block: 4, bias: 1.0 / 6.0, comparisons };
    agreement.assert((name, buffers), Method::RadianceCache, |result| {
        assert!(number(result, "view_bound_records", "records") > 20.0);
    });
}

#[test]
fn floors_and_blocks_of_narrow_lobes_agree_with_path_tracing() {
    let roughness = |alpha: f32| alpha.sqrt();
    agrees("metal box with varnish", &box_from_above(metal(roughness(0.1)), varnish(roughness(0.2))), 2);
    agrees("varnished box with metal", &box_from_above(varnish(roughness(0.1)), metal(roughness(0.2))), 2);
}

/// The limits of the records and their light beside the legs have tests of their own, `view_record_limits`.
#[test]
fn a_table_in_the_sun_agrees_with_path_tracing() {
    agrees("metal table in the sun", &table_in_the_sun(metal(0.1f32.sqrt())), 2);
    agrees("varnished table in the sun", &table_in_the_sun(varnish(0.1f32.sqrt())), 2);
}

#[test]
fn a_scene_without_narrow_lobes_has_no_records_of_them() {
    let found = |buffers: &SceneBuffers| finding(&cached(buffers, |_| ()), "view_bound_records").decision;
    assert_eq!(found(&cornell_box()), Decision::LeftOut);
    // Coefficients serve these.
    assert_eq!(found(&box_from_above(metal(0.6), varnish(0.7))), Decision::LeftOut);
    assert_eq!(found(&box_from_above(metal(0.3), varnish(0.7))), Decision::Used);
}

/// The file has irradiance; what the camera sees is gathered anew.
#[test]
fn a_loaded_cache_gives_the_same_picture() {
    let buffers = box_from_above(metal(0.3), varnish(0.7));
    let file = std::env::temp_dir().join(format!("halflight-tests-{}-view", std::process::id()));
    let saved = cached(&buffers, |s| s.save_cache = Some(file.clone()));
    let loaded = cached(&buffers, |s| s.load_cache = Some(file.clone()));
    std::fs::remove_file(file).unwrap();
    assert_eq!(number(&loaded, "irradiance_cache", "gathered"), 0.0);
    assert!(saved.image == loaded.image);
}
