//! Adaptive sampling: no bias, for the same number of samples.

use core::sync::atomic::AtomicBool;
use halflight::drive::{Settings, Stop, render};
use halflight_tests::scenes::cornell_box;

const SIZE: u32 = 64;
const TILES: usize = 16;

/// Standard deviations, of Student's t with 38 degrees, that none of 17 comparisons exceeds with a chance of 99 %
/// (Šidák).
const SIGMAS: f64 = 3.8;

/// The mean of each tile over its samples, and the number of paths.
fn tiles(spp: u32, seed: u32, adaptive: bool) -> (Vec<f64>, u64) {
    let scene = cornell_box();
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let settings =
        Settings { width: SIZE, height: SIZE, seed, stop, adaptive: Some(adaptive), ..Settings::default() };
    let result = render(&scene.scene(), &settings, &mut |_| (), &AtomicBool::new(false)).unwrap();
    let mut means = vec![0.0; TILES];
    for (i, pixel) in result.image.pixels.iter().enumerate() {
        let (x, y) = (i % SIZE as usize / 16, i / SIZE as usize / 16);
        means[y * (SIZE as usize / 16) + x] += pixel.iter().map(|v| f64::from(*v)).sum::<f64>() / 768.0;
    }
    if adaptive {
        let (least, most) = (result.samples.iter().min().unwrap(), result.samples.iter().max().unwrap());
        assert!(least < most, "all tiles have {least} samples");
    }
    (means, result.counters.paths)
}

#[test]
fn the_picture_has_no_bias() {
    let (seeds, spp) = (20, 32);
    let all: Vec<[Vec<f64>; 2]> = (0..seeds)
        .map(|seed| {
            let ((adaptive, paths), (uniform, all)) =
                (tiles(spp, seed, true), tiles(spp, 1000 + seed, false));
            let ratio = paths as f64 / all as f64;
            assert!((ratio - 1.0).abs() < 0.01, "{ratio} of the samples");
            [adaptive, uniform].map(|mut tiles| {
                tiles.push(tiles.iter().sum::<f64>());
                tiles
            })
        })
        .collect();
    let n = f64::from(seeds);
    for tile in 0..=TILES {
        let [a, b] = [0, 1].map(|kind| {
            let mean = all.iter().map(|pair| pair[kind][tile]).sum::<f64>() / n;
            let square = all.iter().map(|pair| (pair[kind][tile] - mean).powi(2)).sum::<f64>();
            (mean, square / (n - 1.0) / n)
        });
        let sigma = (a.1 + b.1).sqrt();
        assert!((a.0 - b.0).abs() < SIGMAS * sigma, "tile {tile}: {} and {} ± {sigma}", a.0, b.0);
    }
}
