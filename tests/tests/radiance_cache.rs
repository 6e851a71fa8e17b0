//! Radiance caching against path tracing in a box with rough reflections, and its difference from irradiance
//! caching.

use halflight::render::{Basis, Checkpoint, LobeSettings, Method, RenderResult, Settings};
use halflight_core::cache::irradiance::Metric;
use halflight_core::findings::Decision;
use halflight_core::scene::Material;
use halflight_simd::Level;
use halflight_tests::agreement::Agreement;
use halflight_tests::render::{finding, number, render, try_render};
use halflight_tests::scenes::{SceneBuffers, cornell_box, metal, rough_box};
use std::path::{Path, PathBuf};

const SIZE: u32 = 48;

fn cached(buffers: &SceneBuffers, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(&buffers.scene(), Method::RadianceCache, SIZE, 4, change)
}

#[test]
fn the_box_agrees_with_path_tracing() {
    let agreement = Agreement { size: SIZE, block: 6, bias: 0.08, comparisons: 2 };
    agreement.assert(("rough box", &rough_box()), Method::RadianceCache, |_| ());
}

/// The method of Křivánek et al. (2005), with our radii and with those by distances.
#[test]
fn the_box_by_spherical_harmonics_agrees_with_path_tracing() {
    let agreement = Agreement { size: SIZE, block: 6, bias: 0.08, comparisons: 2 };
    let check = |result: &RenderResult| {
        assert_eq!(finding(result, "radiance_records").decision, Decision::Used);
    };
    agreement.assert_with(("rough box", &rough_box()), Method::RadianceCache, harmonics, check);
    let by_distances = |settings: &mut Settings| {
        harmonics(settings);
        settings.cache.metric = Metric::SplitSphere;
        settings.cache.error = Some(0.15);
    };
    agreement.assert_with(("rough box", &rough_box()), Method::RadianceCache, by_distances, check);
}

fn harmonics(settings: &mut Settings) {
    settings.lobes = LobeSettings::of(Basis::SphericalHarmonics);
}

#[test]
fn findings_name_the_materials_that_records_serve() {
    let result = cached(&rough_box(), |_| ());
    let number = |name| number(&result, "radiance_records", name);
    assert_eq!(finding(&result, "radiance_records").decision, Decision::Used);
    assert_eq!((number("degree"), number("rays_per_record"), number("served_materials")), (6.0, 1024.0, 2.0));
    assert!(number("records") > 10.0);
}

#[test]
fn without_wide_lobes_the_picture_is_that_of_the_irradiance_cache() {
    let mut narrow = cornell_box();
    // Narrower than the lobes of view-bound records.
    let mirror = narrow.material(Material { surface: metal(0.2), ..Material::GREY });
    narrow.triangles.iter_mut().take(2).for_each(|triangle| triangle.material = mirror);
    for buffers in [cornell_box(), narrow] {
        let irradiance = render(&buffers.scene(), Method::IrradianceCache, SIZE, 4, |_| ());
        let radiance = cached(&buffers, |_| ());
        assert!(irradiance.image == radiance.image);
        assert_eq!(finding(&radiance, "radiance_records").decision, Decision::LeftOut);
    }
}

fn path(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("halflight-tests-{}-radiance-{name}", std::process::id()))
}

#[test]
fn a_loaded_cache_gives_the_same_picture_and_others_are_refused() {
    let (buffers, file) = (rough_box(), path("same"));
    let with = |method, load: Option<&Path>, save: Option<&Path>, change: fn(&mut Settings)| {
        try_render(&buffers.scene(), method, SIZE, 4, |settings| {
            settings.load_cache = load.map(Path::to_owned);
            settings.save_cache = save.map(Path::to_owned);
            change(settings);
        })
        .map_err(|error| error.to_string())
    };
    let radiance = Method::RadianceCache;
    let saved = with(radiance, None, Some(&file), |_| ()).unwrap();
    let loaded = with(radiance, Some(&file), None, |_| ()).unwrap();
    assert!(saved.image == loaded.image);
    let records = |result| number(result, "radiance_records", "records");
    assert_eq!((records(&saved), number(&loaded, "irradiance_cache", "gathered")), (records(&loaded), 0.0));
    let why = with(radiance, Some(&file), None, |s| s.lobes.degree = 4).unwrap_err();
    assert!(why.contains("lobe-degree 6") && why.ends_with("lobe-degree 4, lobe-error 2e-2"), "{why}");
    let why = with(Method::IrradianceCache, Some(&file), None, |_| ()).unwrap_err();
    assert!(why.ends_with("not none"), "{why}");
    let why = with(radiance, Some(&file), None, harmonics).unwrap_err();
    assert!(why.contains("zernike, lobe-degree 6") && why.contains("not sh, lobe-degree 9"), "{why}");
    let saved = with(radiance, None, Some(&file), harmonics).unwrap();
    let loaded = with(radiance, Some(&file), None, harmonics).unwrap();
    assert!(saved.image == loaded.image && records(&saved) == records(&loaded));
    std::fs::remove_file(file).unwrap();
}

#[test]
fn bits_of_harmonics_do_not_depend_on_threads_or_level() {
    let buffers = rough_box();
    let with = |threads, level| {
        let result = cached(&buffers, |settings| {
            harmonics(settings);
            (settings.threads, settings.level) = (Some(threads), level);
        });
        result.image
    };
    let one = with(1, Level::BASELINE);
    for level in Level::detect().and_below() {
        assert!(with(2, level) == one, "{}", level.name());
    }
}

#[test]
fn a_film_of_one_basis_is_not_resumed_with_another() {
    let (buffers, film) = (rough_box(), path("film"));
    let keep = Checkpoint { path: film.clone(), every: f64::INFINITY };
    cached(&buffers, |settings| settings.checkpoint = Some(keep));
    let resumed = try_render(&buffers.scene(), Method::RadianceCache, SIZE, 8, |settings| {
        harmonics(settings);
        settings.resume = Some(film.clone());
    });
    let why = resumed.map(|_| ()).unwrap_err().to_string();
    assert!(why.contains("SphericalHarmonics"), "{why}");
    std::fs::remove_file(film).unwrap();
}
