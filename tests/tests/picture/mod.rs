//! Small grey pictures, rendered with several seeds and judged against expected values.

use core::sync::atomic::AtomicBool;
use halflight::render::{self, Settings, Stop};
use halflight_tests::render::raw;
use halflight_tests::scenes::SceneBuffers;
use halflight_tests::statistics::judge;

/// Pixels along a side.
pub(crate) const SIZE: u32 = 12;

/// Independent pictures: enough for a variance and for an almost normal mean.
const REPLICAS: u32 = 32;

/// Samples per pixel of each.
const SPP: u32 = 64;

/// The first channel of a picture of `scene`.
pub(crate) fn render(scene: &SceneBuffers, seed: u32, change: impl FnOnce(&mut Settings)) -> Vec<f64> {
    let stop = Stop { spp: Some(SPP), ..Stop::default() };
    let mut settings = Settings { width: SIZE, height: SIZE, seed, stop, ..raw() };
    change(&mut settings);
    let result = render::render(&scene.scene(), &settings, &mut |_| (), &AtomicBool::new(false));
    let result = result.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(result.counters.dropped.total(), 0, "{:?}", result.counters);
    result.image.pixels.iter().map(|pixel| f64::from(pixel[0])).collect()
}

/// Renders `scene` with several seeds and judges whether pixel (x, y) is `expected(x, y)`.
pub(crate) fn assert_picture(
    scene: &SceneBuffers,
    change: impl Fn(&mut Settings),
    expected: impl Fn(u32, u32) -> f64,
) {
    let replicas: Vec<_> = (0..REPLICAS).map(|seed| render(scene, 1000 + seed, &change)).collect();
    let expected: Vec<_> = (0..SIZE * SIZE).map(|i| expected(i % SIZE, i / SIZE)).collect();
    if let Err(why) = judge(&replicas, &expected) {
        panic!("{why}");
    }
}
