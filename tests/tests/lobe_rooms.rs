//! Records of lobes in rooms that are hard for caches: needles, a sheet between light and dark, black walls
//! and a small bright spot, with floors of rough metal, narrow metal and varnish.
//! `tests/examples/lobe_rooms.rs` prints a table of the same rooms in larger pictures.

use halflight::render::{Method, Settings};
use halflight_core::scene::Surface;
use halflight_tests::references::reference;
use halflight_tests::render::{blocks_of, number, render};
use halflight_tests::rooms::{boxes_in_black, needles, sheet, spot, with_floor};
use halflight_tests::scenes::{SceneBuffers, metal, varnish};

const SIZE: u32 = 32;
const BLOCK: u32 = 4;

/// Stored pictures of path tracing, and pictures of the cache.
const PICTURES: [u32; 2] = [8, 4];

/// Samples per pixel of each.
const SPP: [u32; 2] = [512, 16];

/// Largest bias of a block, as a share of its light plus a tenth of the picture's mean.
const BIAS: f64 = 1.0 / 6.0;

/// Largest relative bias of the picture's mean, beyond the noise of the reference: 0.1 % in the room with a
/// spot, whose means with metals are 0.7 % too dark.
const BIAS_OF_MEAN: f64 = 0.003;

/// Standard errors of a reference that its noise is allowed.
const DEVIATIONS: f64 = 4.0;

/// Floors by name; numbers are alpha.
fn floors() -> [(&'static str, Surface); 3] {
    [
        ("metal .3", metal(0.3f32.sqrt())),
        ("metal .1", metal(0.1f32.sqrt())),
        ("varnish .1", varnish(0.1f32.sqrt())),
    ]
}

/// Asserts that means of blocks and of the picture are those of path tracing, with each floor.
fn agrees(room: &str, build: fn() -> SceneBuffers) {
    let mut failed = Vec::new();
    for (floor, surface) in floors() {
        let name = format!("{room} with a floor of {floor}");
        let buffers = with_floor(build(), surface);
        let pictures = |of: usize, method, change: fn(&mut Settings)| -> Vec<Vec<f64>> {
            let one = |seed| {
                let result = render(&buffers.scene(), method, SIZE, SPP[of], |settings| {
                    settings.seed = seed;
                    change(settings);
                });
                let topics = ["radiance_records", "view_bound_records"];
                let records = || topics.map(|topic| number(&result, topic, "records")).iter().sum::<f64>();
                assert!(of == 0 || records() > 10.0, "{name}: {:?}", result.findings);
                let mut values = blocks_of(&result.image, BLOCK);
                values.push(values.iter().sum::<f64>() / values.len() as f64);
                values
            };
            (0..PICTURES[of]).map(one).collect()
        };
        let path = reference(&name, || pictures(0, Method::Path, |settings| settings.caustics = false));
        let found = pictures(1, Method::RadianceCache, |_| ());
        let (last, light) = (path.moments.len() - 1, path.moments[path.moments.len() - 1].0);
        let excess = |i: usize| {
            let (expected, variance) = path.moments[i];
            let value = found.iter().map(|picture| picture[i]).sum::<f64>() / found.len() as f64;
            let unit = if i < last { expected + 0.1 * light } else { light };
            let beyond_noise = (value - expected).abs() - DEVIATIONS * variance.sqrt();
            (beyond_noise / unit, (value - expected) / unit)
        };
        let worst = (0..last).map(excess).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
        let mean = excess(last);
        let noise = path.moments[last].1.sqrt() / light;
        println!("{name}: mean {:+.4} ± {noise:.4}, worst block {:+.3}", mean.1, worst.1);
        // Also false for NaN.
        if !(worst.0 <= BIAS && mean.0 <= BIAS_OF_MEAN) {
            failed.push(format!("{name}: mean {:+.4}, worst block {:+.3}", mean.1, worst.1));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn thin_bars_over_narrow_lobes_have_the_light_of_paths() {
    agrees("needles", needles);
}

#[test]
fn a_sheet_over_narrow_lobes_has_the_light_of_paths() {
    agrees("sheet", sheet);
}

#[test]
fn boxes_in_black_over_narrow_lobes_have_the_light_of_paths() {
    agrees("boxes in black", boxes_in_black);
}

#[test]
fn a_small_bright_spot_over_narrow_lobes_has_the_light_of_paths() {
    agrees("spot", spot);
}
