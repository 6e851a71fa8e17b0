//! The path tracer as a whole: the wavefront against the textbook, bits against threads and scale.

use core::sync::atomic::AtomicBool;
use halflight::drive::{self, RenderResult, Settings, Stop};
use halflight_tests::scenes::{SceneBuffers, cornell_box};

/// Mean radiance of the box, from 4 million paths that sampled the lamp uniformly by area.
const CORNELL_MEAN: [f64; 3] = [0.2123, 0.1509, 0.0652];

fn render(buffers: &SceneBuffers, size: u32, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let mut settings = Settings { width: size, height: size, stop, ..Settings::default() };
    change(&mut settings);
    drive::render(&buffers.scene(), &settings, &mut |_| (), &AtomicBool::new(false)).unwrap()
}

#[test]
fn the_cornell_box_has_the_light_it_had() {
    let result = render(&cornell_box(), 64, 64, |_| ());
    let mean = result.image.mean();
    for (mean, known) in mean.into_iter().zip(CORNELL_MEAN) {
        assert!((mean / known - 1.0).abs() < 0.02, "{mean} {known}");
    }
    assert_eq!((result.spp, result.counters.paths), (64, 64 * 64 * 64));
    assert_eq!(result.counters.dropped.total(), 0);
}

#[test]
fn bits_do_not_depend_on_threads_or_rounds() {
    let scene = cornell_box();
    let image = render(&scene, 40, 8, |s| s.threads = Some(1)).image;
    assert!(image.pixels.iter().any(|p| p[0] > 0.0));
    for threads in [2, 7] {
        assert_eq!(render(&scene, 40, 8, |s| s.threads = Some(threads)).image, image);
    }
}
