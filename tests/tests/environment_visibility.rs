//! Environment visibility: sky sampled through windows that a prepass finds is unbiased, reduces noise in a
//! room, and changes nothing under an open sky.

use crate::table::scenes::{SKY, room_with_window, with_sky};
use core::sync::atomic::AtomicBool;
use glam::Vec3;
use halflight::render::{self, Method, RenderResult, Settings, Stop};
use halflight_core::findings::Decision;
use halflight_core::scene::{Camera, Material, Scene};
use halflight_tests::render::raw;
use halflight_tests::scenes::{SceneBuffers, constant_environment};
use halflight_tests::statistics::{agree, blocks};

/// Pixels across and down: four tiles.
const SIZE: u32 = 32;

/// Independent pictures of each kind.
const SEEDS: u32 = 32;

/// Normal quantile for one error in ten thousand over all tiles and channels of all scenes (Šidák; 4 scenes
/// of 48 values), widened for Student's t with 2 × 31 degrees of freedom.
const WIDEST: f64 = 5.6;

fn with_constant(mut scene: SceneBuffers) -> SceneBuffers {
    scene.environment = constant_environment(1.0);
    scene
}

fn render(scene: &Scene, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let mut settings =
        Settings { method: Some(Method::Path), width: SIZE, height: SIZE, stop, reuse: Some(false), ..raw() };
    change(&mut settings);
    render::render(scene, &settings, &mut |_| (), &AtomicBool::new(false)).unwrap()
}

/// Whether the environment was sampled by its visibility.
fn has_windows(result: &RenderResult) -> bool {
    let visibility = result.findings.get("environment_visibility");
    visibility.is_some_and(|finding| finding.decision == Decision::Used)
}

fn assert_unbiased(name: &str, scene: &Scene, max_depth: Option<u32>) {
    let pictures = |windows: bool, first: u32| -> Vec<Vec<f64>> {
        let one = |seed| {
            let result = render(scene, 16, |s| {
                (s.seed, s.environment_visibility, s.max_depth) = (first + seed, Some(windows), max_depth);
            });
            assert_eq!(has_windows(&result), windows);
            assert_eq!(result.counters.dropped.total(), 0);
            blocks(&result.image.pixels, SIZE, 8)
        };
        (0..SEEDS).map(one).collect()
    };
    let agreed = agree(&pictures(true, 0), &pictures(false, SEEDS), WIDEST);
    agreed.unwrap_or_else(|why| panic!("{name}, {why}"));
}

#[test]
fn windows_are_unbiased() {
    assert_unbiased("constant sky", &with_constant(room_with_window()).scene(), None);
    assert_unbiased("sky with a sun", &with_sky(room_with_window()).textured(&SKY), Some(2));
}

/// Relative variance summed over pixels.
fn noise(result: &RenderResult) -> f32 {
    let relative = |(variance, mean): (&[f32; 3], &[f32; 3])| -> f32 {
        variance.iter().zip(mean).map(|(variance, mean)| variance / (mean * mean + 1e-4)).sum()
    };
    result.variance.pixels.iter().zip(&result.image.pixels).map(relative).sum()
}

#[test]
fn a_room_has_less_noise_through_its_windows() {
    for (name, buffers) in
        [("constant", with_constant(room_with_window())), ("sun", with_sky(room_with_window()))]
    {
        let scene = buffers.textured(&SKY);
        let with_windows =
            |windows| render(&scene, 64, |s| (s.environment_visibility, s.max_depth) = (windows, Some(2)));
        let (with, without) = (noise(&with_windows(Some(true))), noise(&with_windows(Some(false))));
        assert!(with < 0.7 * without, "{name}: {with}, {without}");
        assert!(has_windows(&with_windows(None)), "{name}: windows pay");
    }
}

#[test]
fn under_an_open_sky_nothing_is_changed() {
    let camera = Camera::look_at(Vec3::new(0.0, 1.0, 3.0), Vec3::ZERO, Vec3::Y, 50.0);
    let mut buffers = SceneBuffers::new(camera);
    let grey = buffers.material(Material::GREY);
    buffers.square(Vec3::ZERO, Vec3::Y, 10.0, grey);
    let buffers = with_constant(buffers);
    let scene = buffers.scene();
    let (auto, off) =
        (render(&scene, 4, |_| ()), render(&scene, 4, |s| s.environment_visibility = Some(false)));
    let visibility = auto.findings.get("environment_visibility").unwrap();
    assert!(
        visibility.decision == Decision::LeftOut && visibility.number("gain").is_some(),
        "{visibility:?}"
    );
    assert_eq!(auto.image, off.image);
}
