//! Irradiance caches in files: the same view has the same bits, another view gathers fewer records, and
//! another scene or other settings are refused.

use core::sync::atomic::AtomicBool;
use glam::Vec3;
use halflight::render::{self, Method, RenderResult, Settings, Stop};
use halflight_core::scene::Camera;
use halflight_tests::render::{number, raw};
use halflight_tests::scenes::{SceneBuffers, cornell_box};
use std::path::{Path, PathBuf};

fn render(
    buffers: &SceneBuffers,
    load: Option<&Path>,
    save: Option<&Path>,
    change: impl FnOnce(&mut Settings),
) -> Result<RenderResult, String> {
    let stop = Stop { spp: Some(4), ..Stop::default() };
    let method = Some(Method::IrradianceCache);
    let mut settings = Settings { method, width: 64, height: 64, stop, ..raw() };
    settings.cache.strata = Some(16);
    settings.load_cache = load.map(Path::to_owned);
    settings.save_cache = save.map(Path::to_owned);
    change(&mut settings);
    let done = render::render(&buffers.scene(), &settings, &mut |_| (), &AtomicBool::new(false));
    done.map_err(|error| error.to_string())
}

fn path(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("halflight-tests-{}-{name}", std::process::id()))
}

fn cache(result: &RenderResult, name: &str) -> f64 {
    number(result, "irradiance_cache", name)
}

#[test]
fn a_loaded_cache_gives_the_same_picture_and_gathers_nothing() {
    let (buffers, file) = (cornell_box(), path("same"));
    let plain = render(&buffers, None, None, |_| ()).unwrap();
    let saved = render(&buffers, None, Some(&file), |s| s.threads = Some(3)).unwrap();
    let loaded = render(&buffers, Some(&file), None, |s| s.threads = Some(1)).unwrap();
    assert_eq!(plain.image.pixels, saved.image.pixels);
    assert_eq!(saved.image.pixels, loaded.image.pixels);
    let [records, gathered] = ["records", "gathered"].map(|name| cache(&saved, name));
    assert!(records > 100.0 && gathered >= records, "{records} {gathered}");
    let again = ["loaded", "gathered", "records"].map(|name| cache(&loaded, name));
    assert_eq!(again, [records, 0.0, records]);
    // Another seed uses the records of the file, with other noise of samples.
    let other = render(&buffers, Some(&file), None, |s| s.seed = 1).unwrap();
    assert!(cache(&other, "gathered") == 0.0 && other.image.pixels != loaded.image.pixels);
    std::fs::remove_file(file).unwrap();
}

#[test]
fn another_view_uses_the_records_and_adds_to_them() {
    let (first, second) = (path("first"), path("second"));
    let mut buffers = cornell_box();
    render(&buffers, None, Some(&first), |_| ()).unwrap();
    let Camera { eye, forward, .. } = buffers.camera;
    let aside = eye + Vec3::new(0.1, 0.05, 0.0);
    buffers.camera = Camera::look_at(aside, eye + 3.0 * forward, Vec3::Y, 40.0);
    let alone = render(&buffers, None, None, |_| ()).unwrap();
    let helped = render(&buffers, Some(&first), Some(&second), |_| ()).unwrap();
    let (most, fewer) = (cache(&alone, "gathered"), cache(&helped, "gathered"));
    assert!(fewer > 0.0 && 3.0 * fewer < most, "{fewer} of {most}");
    // Records have few gather rays here: one percent of noise in each cache.
    for (a, b) in helped.image.mean().into_iter().zip(alone.image.mean()) {
        assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
    }
    let again = render(&buffers, Some(&second), None, |_| ()).unwrap();
    assert_eq!((cache(&again, "gathered"), again.image.pixels), (0.0, helped.image.pixels));
    [first, second].into_iter().for_each(|file| std::fs::remove_file(file).unwrap());
}

#[test]
fn a_cache_of_something_else_is_refused_and_told_why() {
    let (mut buffers, file) = (cornell_box(), path("refused"));
    render(&buffers, None, Some(&file), |_| ()).unwrap();
    let refused = |buffers: &SceneBuffers, change: fn(&mut Settings)| {
        let why = render(buffers, Some(&file), None, change).unwrap_err();
        assert!(why.contains(&file.display().to_string()), "{why}");
        why
    };
    assert!(refused(&buffers, |s| s.max_depth = Some(4)).ends_with("a cache of max-depth unlimited, not 4"));
    assert!(
        refused(&buffers, |s| s.cache.strata = Some(32)).ends_with("a cache of cache-rays 256, not 1024")
    );
    assert!(refused(&buffers, |s| s.cache.error = Some(1e-3)).ends_with("of cache-error 1e-4, not 1e-3"));
    buffers.positions[0][0] += 0.01;
    let why = refused(&buffers, |_| ());
    assert!(why.ends_with("a cache of another scene, or its geometry changed since"), "{why}");
    std::fs::write(&file, b"no cache").unwrap();
    assert!(refused(&buffers, |_| ()).contains("is no cache file"));
    std::fs::remove_file(&file).unwrap();
    assert!(refused(&buffers, |_| ()).contains("no such file"));
    let why = render(&buffers, None, Some(&file), |s| s.method = Some(Method::Path)).unwrap_err();
    assert!(why.contains("irradiance-cache"), "{why}");
}

#[test]
fn memory_for_fewer_records_than_a_file_has_is_an_answer() {
    let (buffers, file) = (cornell_box(), path("memory"));
    let whole = render(&buffers, None, Some(&file), |_| ()).unwrap();
    let least = whole.memory.iter().filter(|m| m.structure != "cache").map(|m| m.bytes).sum::<usize>();
    let why = render(&buffers, Some(&file), None, |s| s.memory = Some(least + 4096)).unwrap_err();
    assert!(why.contains("not enough memory"), "{why}");
    std::fs::remove_file(file).unwrap();
}
