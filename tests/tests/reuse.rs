//! Path reuse among neighbouring pixels: unbiased, less noisy, and independent of threads, waves and rounds.

use core::sync::atomic::AtomicBool;
use glam::Vec3;
use halflight::render::{self, Method, RenderResult, Settings, Stop};
use halflight_core::bsdf::All;
use halflight_core::film::Film;
use halflight_core::findings::Decision;
use halflight_core::scene::{Material, Scene, Surface};
use halflight_core::transport::{PathIntegrator, PathReuse, PathSettings, UNLIMITED};
use halflight_core::{Level, Rgb};
use halflight_tests::memory::{TestArena, with_structures};
use halflight_tests::render::{finding, number, raw};
use halflight_tests::scenes::{SceneBuffers, cornell_box, emitter, everything};
use halflight_tests::statistics::{agree, blocks};

/// Pixels across and down: four tiles, the outer ones cut by the border.
const SIZE: u32 = 28;

/// Side in pixels of the blocks that are judged; groups share within 8 × 8.
const BLOCK: u32 = 7;

/// Independent pictures of each kind.
const SEEDS: u32 = 24;

/// Normal quantile for one error in ten thousand over all blocks and channels of all scenes (Šidák; at most 6
/// scenes of 48 values), widened for Student's t with 2 × 23 degrees of freedom.
const WIDEST: f64 = 6.2;

fn render(scene: &Scene, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let (method, size) = (Some(Method::Path), SIZE);
    let mut settings = Settings { method, width: size, height: size, stop, ..raw() };
    change(&mut settings);
    render::render(scene, &settings, &mut |_| (), &AtomicBool::new(false)).unwrap()
}

/// Black boxes among white ones: pixels that reflect nothing must not take part in reuse.
fn black_and_white() -> SceneBuffers {
    let mut scene = cornell_box();
    let black = scene
        .material(Material { surface: Surface::Diffuse { reflectance: Rgb::ZERO.into() }, ..Material::GREY });
    for i in 0..6 {
        let min = Vec3::new(0.1 + 0.14 * i as f32, 0.0, 0.3);
        scene.cuboid(min, min + Vec3::new(0.07, 0.3, 0.3), false, black);
    }
    scene
}

/// Coats of all kinds over colours, seen from diffuse walls: light of the base is shared, light of the coat
/// is not.
fn coated() -> SceneBuffers {
    let mut scene = cornell_box();
    let coat = |roughness: f32, metallic: f32, ior| Surface::Glossy {
        base: Rgb::new(0.7, 0.4, 0.1).into(),
        specular: Rgb::splat(if ior == Some(1.5) { 0.04 } else { 0.3 }).into(),
        roughness: roughness.into(),
        metallic: metallic.into(),
        ior,
    };
    let kinds = [(0.4, 0.0, Some(1.5)), (0.0, 0.0, Some(1.5)), (0.5, 0.3, None), (0.0, 0.0, None)];
    for (i, (roughness, metallic, ior)) in kinds.into_iter().enumerate() {
        let surface = coat(roughness, metallic, ior);
        let material = scene.material(Material { surface, ..Material::GREY });
        let min = Vec3::new(0.05 + 0.24 * i as f32, 0.0, 0.2);
        scene.cuboid(min, min + Vec3::new(0.2, 0.25, 0.3), false, material);
    }
    scene
}

fn assert_unbiased(name: &str, buffers: &SceneBuffers, max_depth: Option<u32>) {
    let scene = buffers.scene();
    let pictures = |reuse: bool, first: u32| -> Vec<Vec<f64>> {
        let one = |seed| {
            let result = render(&scene, 16, |s| {
                (s.seed, s.reuse, s.max_depth) = (first + seed, Some(reuse), max_depth);
            });
            assert_eq!(result.counters.dropped.total(), 0);
            blocks(&result.image.pixels, SIZE, BLOCK)
        };
        (0..SEEDS).map(one).collect()
    };
    let agreed = agree(&pictures(true, 0), &pictures(false, SEEDS), WIDEST);
    agreed.unwrap_or_else(|why| panic!("{name}, {why}"));
}

#[test]
fn reuse_is_unbiased_beside_black_surfaces_and_coats() {
    assert_unbiased("black and white", &black_and_white(), None);
    assert_unbiased("coated", &coated(), None);
    assert_unbiased("coated, three bounces", &coated(), Some(5));
}

#[test]
fn reuse_halves_the_variance() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    // Relative variance: the few pixels at the lamp's edge must not dominate.
    let variance = |reuse| {
        let result = render(&scene, 64, |s| s.reuse = Some(reuse));
        let relative = |(variance, mean): (&[f32; 3], &[f32; 3])| -> f32 {
            variance.iter().zip(mean).map(|(variance, mean)| variance / (mean * mean + 1e-4)).sum()
        };
        result.variance.pixels.iter().zip(&result.image.pixels).map(relative).sum::<f32>()
    };
    let (with, without) = (variance(true), variance(false));
    assert!(with < 0.5 * without, "{with} {without}");
}

/// Pixels of a block share errors, but blocks have no visible borders: differences across borders of blocks
/// hardly exceed differences across their middles.
#[test]
fn blocks_of_pixels_that_share_have_no_borders() {
    const ACROSS: u32 = 64;
    let buffers = cornell_box();
    let scene = buffers.scene();
    let pictures: Vec<Vec<f64>> = (0..12)
        .map(|seed| {
            let result = render(&scene, 4, |s| {
                (s.width, s.height, s.seed, s.reuse) = (ACROSS, ACROSS, seed, Some(true));
            });
            result.image.pixels.iter().map(|[r, g, b]| f64::from(r + g + b)).collect()
        })
        .collect();
    let mean = |x: u32, y: u32| {
        pictures.iter().map(|picture| picture[(y * ACROSS + x) as usize]).sum::<f64>() / pictures.len() as f64
    };
    // Squared difference of errors between 4 x 8 pixels on both sides of column and row lines.
    let step = |first: u32| {
        let lines =
            (first..ACROSS - 4).step_by(8).flat_map(|line| (0..ACROSS / 8).map(move |k| (line, 8 * k)));
        let one = |(line, from): (u32, u32)| {
            let of = |picture: &[f64], turned: bool| {
                let both = (line - 4..line + 4).flat_map(|a| (from..from + 8).map(move |b| (a, b)));
                both.map(|(a, b)| {
                    let (x, y) = if turned { (b, a) } else { (a, b) };
                    let error = picture[(y * ACROSS + x) as usize] - mean(x, y);
                    if a < line { error } else { -error }
                })
                .sum::<f64>()
            };
            // Clamped, so that a lamp at the edge of a pixel does not dominate.
            let square =
                |picture: &Vec<f64>| [false, true].map(|turned| of(picture, turned).powi(2).min(1e2));
            pictures.iter().flat_map(square).sum::<f64>()
        };
        lines.map(one).sum::<f64>()
    };
    // 56 and 64 lines, so the ratio is of means. Sharp borders give 5 and more.
    let (borders, middles) = (step(8), step(12));
    let ratio = borders / middles;
    println!("{borders} {middles} {ratio}");
    assert!(ratio < 3.0, "{borders} {middles}");
}

#[test]
fn bits_do_not_depend_on_waves_or_rounds() {
    for buffers in [cornell_box(), everything(), coated()] {
        let scene = buffers.scene();
        let settings = PathSettings { width: SIZE, height: SIZE, seed: 3, max_depth: UNLIMITED };
        with_structures(&scene, |bvh, lights| {
            let tracer =
                PathIntegrator::<All>::new(&scene, bvh, lights, settings, Level::detect()).with_reuse();
            let picture = |wave: usize, cuts: &[u32]| {
                let mut scratch_memory =
                    TestArena::new(PathIntegrator::<All>::scratch_with::<(), PathReuse>(wave));
                let mut scratch = scratch_memory.arena();
                let mut film_memory = TestArena::new(Film::footprint(SIZE, SIZE));
                let mut film = Film::new(SIZE, SIZE, &mut film_memory.arena()).unwrap();
                for (task, pixels) in film.pixels_mut().chunks_mut(256).enumerate() {
                    for cut in cuts.windows(2) {
                        tracer.run(task, cut[0]..cut[1], wave, &mut scratch, pixels).unwrap();
                    }
                }
                film.pixels().to_vec()
            };
            let all = picture(2048, &[0, 40]);
            for (wave, cuts) in [(1, [0, 40].as_slice()), (100, &[0, 1, 40]), (5000, &[0, 3, 33, 40])] {
                assert!(picture(wave, cuts) == all, "waves of {wave}, rounds {cuts:?}");
            }
        });
    }
}

#[test]
fn reuse_is_chosen_where_it_pays() {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let indirect = render(&scene, 4, |_| ());
    let decision = |result| finding(result, "path_reuse").decision;
    let gain = |result| number(result, "path_reuse", "gain");
    assert!(decision(&indirect) == Decision::Used && gain(&indirect) > 3.0);
    // Direct light alone cannot be shared.
    let direct = render(&scene, 4, |s| s.max_depth = Some(2));
    assert!(decision(&direct) == Decision::LeftOut && gain(&direct) == 1.0);
    // An explicit setting needs no pilot.
    let asked = render(&scene, 4, |s| s.reuse = Some(false));
    assert!(asked.findings.get("path_reuse").is_none());
}

/// Luminance of pictures of `seeds` seeds, and their mean.
fn seen(scene: &Scene, size: u32, spp: u32, seeds: u32) -> (Vec<Vec<f64>>, Vec<f64>) {
    let one = |seed| {
        let result = render(scene, spp, |s| {
            (s.width, s.height, s.seed, s.reuse) = (size, size, seed, Some(true));
            s.caustics = false;
        });
        let pixels = result.image.pixels.iter();
        pixels.map(|pixel| pixel.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0).collect()
    };
    let pictures: Vec<Vec<f64>> = (0..seeds).map(one).collect();
    let mean = |i: usize| pictures.iter().map(|picture| picture[i]).sum::<f64>() / f64::from(seeds);
    let mean = (0..pictures[0].len()).map(mean).collect();
    (pictures, mean)
}

/// Pixel indices of each block of 8 × 8.
fn blocks_of(size: u32) -> impl Iterator<Item = [usize; 64]> {
    let (across, width) = (size as usize / 8, size as usize);
    (0..across * across).map(move |block| {
        let corner = block / across * 8 * width + block % across * 8;
        core::array::from_fn(|i| corner + i / 8 * width + i % 8)
    })
}

#[test]
fn reuse_leaves_no_lattice() {
    let buffers = cornell_box();
    let (size, seeds) = (64, 8);
    // The first circle of groups alone, and two rounds of circles.
    for spp in [8, 64] {
        let (pictures, mean) = seen(&buffers.scene(), size, spp, seeds);
        for side in [2, 4] {
            // Variance between the means of a block's sublattices, relative to independent pixels.
            let (mut ratios, mut count, parts) = (0.0, 0, side * side);
            for block in blocks_of(size) {
                let level = block.iter().map(|i| mean[*i]).sum::<f64>() / 64.0;
                let spread = block.iter().map(|i| (mean[*i] - level).powi(2)).sum::<f64>() / 64.0;
                if spread.sqrt() > 0.3 * level {
                    continue;
                }
                let (mut between, mut alone) = (0.0, 0.0);
                for picture in &pictures {
                    let mut sums = vec![0.0; parts];
                    for (k, i) in block.iter().enumerate() {
                        let error = picture[*i] - mean[*i];
                        sums[k / 8 % side * side + k % side] += error;
                        alone += error * error / 64.0;
                    }
                    let all = sums.iter().sum::<f64>() / parts as f64;
                    let scatter = sums.iter().map(|sum| (sum - all).powi(2)).sum::<f64>();
                    // Variance of sums of 64 / parts pixels.
                    between += scatter / (parts - 1) as f64 / (64 / parts) as f64;
                }
                ratios += between / alone;
                count += 1;
            }
            let ratio = ratios / f64::from(count);
            // Sharing by every other pixel of a block gives 12 for 2 x 2 and 2.7 for 4 x 4. 400 degrees of
            // freedom or more: ± 0.07.
            assert!(count >= 16 && ratio < 1.3, "{spp} samples, {side} x {side}: {ratio}, {count} blocks");
        }
    }
}

#[test]
fn fireflies_are_not_shared() {
    // A mirror shows a small bright lamp to few paths.
    let mut buffers = cornell_box();
    let surface = Surface::Mirror { reflectance: Rgb::splat(0.9).into() };
    let mirror = buffers.material(Material { surface, ..Material::GREY });
    buffers.cuboid(Vec3::new(0.35, 0.32, 0.35), Vec3::new(0.65, 0.35, 0.65), false, mirror);
    let lamp = buffers.material(emitter(0.0, 500.0));
    buffers.square(Vec3::new(0.5, 0.9, 0.5), Vec3::NEG_Y, 0.02, lamp);
    let (size, spp) = (64, 16);
    let (pictures, mean) = seen(&buffers.scene(), size, spp, 8);
    let level = mean.iter().sum::<f64>() / mean.len() as f64;
    let (mut ratios, mut flashes) = (Vec::new(), 0);
    for picture in &pictures {
        for block in blocks_of(size) {
            let excess = block.map(|i| picture[i] - mean[i]);
            let most = excess.iter().copied().fold(0.0, f64::max);
            // Only samples far brighter than the light that others take from them.
            if most > 16.0 * level {
                let all: f64 = excess.iter().filter(|e| **e > 0.02 * most).sum();
                ratios.push(all / most);
                flashes += 1;
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    assert!(flashes >= 4, "{flashes}");
    // 16 in a circle of sixteen pixels.
    assert!(ratios[flashes / 2] < 3.0, "{ratios:?}");
}
