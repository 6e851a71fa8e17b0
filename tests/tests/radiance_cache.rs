//! Radiance caching against path tracing in a box with rough reflections, and its difference from irradiance
//! caching.

use halflight::render::{Method, RenderResult, Settings};
use halflight_core::findings::Decision;
use halflight_core::scene::Material;
use halflight_tests::render::{blocks_of, finding, number, render, try_render};
use halflight_tests::scenes::{SceneBuffers, cornell_box, metal, rough_box};
use halflight_tests::statistics::agree_within;
use std::path::{Path, PathBuf};

const SIZE: u32 = 48;

/// Independent pictures of each method.
const REPLICAS: u32 = 8;

/// Largest bias of a block of 6 × 6 pixels, as a share of its light plus a tenth of the mean.
const BIAS: f64 = 0.08;

/// Largest relative bias of the picture's mean.
const BIAS_OF_MEAN: f64 = 0.003;

fn cached(buffers: &SceneBuffers, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(&buffers.scene(), Method::RadianceCache, SIZE, 4, change)
}

#[test]
fn the_box_agrees_with_path_tracing() {
    let buffers = rough_box();
    let values = |method, spp| -> Vec<Vec<f64>> {
        let one = |seed| {
            let result = render(&buffers.scene(), method, SIZE, spp, |s| s.seed = seed);
            assert_eq!(result.counters.dropped.total(), 0);
            let mut values = blocks_of(&result.image, 6);
            values.push(values.iter().sum::<f64>() / values.len() as f64);
            values
        };
        (0..REPLICAS).map(one).collect()
    };
    let (path, cache) = (values(Method::Path, 128), values(Method::RadianceCache, 32));
    let (last, light) = (path[0].len() - 1, path[0][path[0].len() - 1]);
    let allowed = |i: usize, b: f64| if i < last { BIAS * (b + 0.1 * light) } else { BIAS_OF_MEAN * b };
    agree_within(&cache, &path, 2, allowed).unwrap_or_else(|why| panic!("{why}"));
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
    std::fs::remove_file(file).unwrap();
}
