//! Sample streams: nets in every power-of-two prefix, dimensions and pixels without correlation, errors that
//! fall faster than with independent samples; warps and distributions against their densities.

use halflight_core::memory::Arena;
use halflight_core::sampling::{AliasTable, Distribution2d, Random, Sampler, sin_cos_turns, warp};
use halflight_tests::memory::TestArena;

/// Normal quantile of a one-sided chance of 3e-5, for each chi-squared test here.
const CHI_SQUARED_SIGMAS: f64 = 4.0;

/// Asserts that `counts` are multinomial with equal probabilities.
fn assert_uniform(name: &str, counts: &[u32]) {
    let expected = counts.iter().map(|&c| f64::from(c)).sum::<f64>() / counts.len() as f64;
    assert_expected(name, counts, &vec![expected; counts.len()]);
}

/// Pearson's test, pooling cells that expect fewer than 5. Quantile by Wilson and Hilferty 1931.
fn assert_expected(name: &str, counts: &[u32], expected: &[f64]) {
    let (mut pooled, mut cells, mut chi2) = ([0.0; 2], 0, 0.0);
    let mut add = |observed: f64, expected: f64| {
        chi2 += (observed - expected).powi(2) / expected;
        cells += 1;
    };
    for (&count, &expected) in counts.iter().zip(expected) {
        if expected < 5.0 {
            pooled = [pooled[0] + f64::from(count), pooled[1] + expected];
        } else {
            add(f64::from(count), expected);
        }
    }
    if pooled[1] > 0.0 {
        add(pooled[0], pooled[1]);
    }
    let k = f64::from(cells) - 1.0;
    let z = ((chi2 / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt();
    assert!(z < CHI_SQUARED_SIGMAS, "{name}: chi-squared {chi2} with {k} degrees of freedom, {z} sigma");
}

#[test]
fn every_power_of_two_prefix_is_a_net() {
    for key in 0..64u32 {
        let samplers = |i| Sampler::replicate(key / 8, key * 977, key & 1, i);
        let dimension = key % 5;
        let points: Vec<[f32; 2]> = (0..1024).map(|i| samplers(i).pair(dimension)).collect();
        let singles: Vec<f32> = (0..1024).map(|i| samplers(i).single(dimension + 9)).collect();
        for log in 0..=10u32 {
            let n = 1usize << log;
            for log_x in 0..=log {
                let (across, down) = ((1 << log_x) as f32, (1 << (log - log_x)) as f32);
                let mut seen = vec![false; n];
                for [x, y] in &points[..n] {
                    let cell = (x * across) as usize + ((y * down) as usize) * across as usize;
                    assert!(
                        !core::mem::replace(&mut seen[cell], true),
                        "key {key}: {n} points, {log_x} splits of x"
                    );
                }
            }
            let mut seen = vec![false; n];
            for x in &singles[..n] {
                assert!(
                    !core::mem::replace(&mut seen[(x * n as f32) as usize], true),
                    "key {key}: {n} singles"
                );
            }
        }
    }
}

#[test]
fn later_blocks_and_the_last_samples_are_nets_as_well() {
    for start in [1024u32, 3 << 20, u32::MAX - 255] {
        let mut seen = [false; 256];
        for i in 0..256 {
            let [x, y] = Sampler::replicate(1, 2, 0, start + i).pair(3);
            let cell = (x * 16.0) as usize + 16 * (y * 16.0) as usize;
            assert!(!core::mem::replace(&mut seen[cell], true), "block at {start}");
        }
    }
}

#[test]
fn quads_are_nets_in_every_coordinate_and_in_both_pairs() {
    for key in 0..32 {
        let points: Vec<[f32; 4]> = (0..256).map(|i| Sampler::replicate(5, key, 0, i).quad(2)).collect();
        for axis in 0..4 {
            let mut seen = [false; 256];
            for p in &points {
                assert!(!core::mem::replace(&mut seen[(p[axis] * 256.0) as usize], true), "axis {axis}");
            }
        }
        for pair in [0, 2] {
            let mut seen = [false; 256];
            for p in &points {
                let cell = (p[pair] * 16.0) as usize + 16 * (p[pair + 1] * 16.0) as usize;
                assert!(!core::mem::replace(&mut seen[cell], true), "pair {pair}");
            }
        }
    }
}

#[test]
fn mixed_projections_of_quads_are_nets_but_for_a_factor_of_two() {
    // t = 1: every elementary interval of twice the volume of a point holds two points.
    for (log, [a, b]) in
        [4, 6, 8].into_iter().flat_map(|l| [[0, 2], [0, 3], [1, 2], [1, 3]].map(|axes| (l, axes)))
    {
        let points: Vec<[f32; 4]> = (0..1 << log).map(|i| Sampler::replicate(5, 6, 0, i).quad(2)).collect();
        for log_x in 0..log {
            let (across, down) = ((1 << log_x) as f32, (1 << (log - 1 - log_x)) as f32);
            let mut seen = vec![0; 1 << (log - 1)];
            for p in &points {
                seen[(p[a] * across) as usize + ((p[b] * down) as usize) * across as usize] += 1;
            }
            assert!(seen.iter().all(|&count| count == 2), "axes {a} and {b} of {} points", 1 << log);
        }
    }
}

#[test]
fn each_point_is_uniform_over_keys() {
    // Every single Owen-scrambled point is uniform: sample 3 of 200,000 pixels, in 2 and in 4 dimensions.
    let (mut squares, mut tesseracts) = (vec![0; 1024], vec![0; 4096]);
    for pixel in 0..200_000 {
        let sampler = Sampler::new(9, pixel, 6);
        let [x, y] = sampler.pair(1);
        squares[(x * 32.0) as usize + 32 * (y * 32.0) as usize] += 1;
        let cell = sampler.quad(7).iter().fold(0, |cell, u| cell * 8 + (u * 8.0) as usize);
        tesseracts[cell] += 1;
    }
    assert_uniform("pairs", &squares);
    assert_uniform("quads", &tesseracts);
}

#[test]
fn dimensions_pixels_and_seeds_are_independent() {
    type Stream = (&'static str, fn(u32) -> [f32; 2]);
    let streams: [Stream; 6] = [
        ("dimensions", |i| {
            [Sampler::new(0, i / 16, i % 16).pair(0)[0], Sampler::new(0, i / 16, i % 16).pair(1)[0]]
        }),
        ("single and pair", |i| {
            [Sampler::new(0, i / 16, i % 16).single(4), Sampler::new(0, i / 16, i % 16).pair(5)[1]]
        }),
        ("pixels", |i| {
            [Sampler::new(0, i / 16, i % 16).pair(0)[0], Sampler::new(0, i / 16 + 1, i % 16).pair(0)[0]]
        }),
        ("seeds", |i| {
            [Sampler::new(0, i / 16, i % 16).pair(0)[1], Sampler::new(1, i / 16, i % 16).pair(0)[1]]
        }),
        ("replicates", |i| {
            [
                Sampler::new(0, i / 16, 2 * (i % 16)).pair(0)[0],
                Sampler::new(0, i / 16, 2 * (i % 16) + 1).pair(0)[0],
            ]
        }),
        ("hash", |i| [Random::new(0, i).single(0), Random::new(0, i).single(1)]),
    ];
    for (name, stream) in streams {
        let n = 1 << 17;
        let mut counts = vec![0; 256];
        let mut correlation = 0.0;
        for i in 0..n {
            let [x, y] = stream(i);
            counts[(x * 16.0) as usize + 16 * (y * 16.0) as usize] += 1;
            correlation += (f64::from(x) - 0.5) * (f64::from(y) - 0.5) * 12.0;
        }
        assert_uniform(name, &counts);
        let sigma = (f64::from(n)).sqrt();
        assert!((correlation / sigma).abs() < 4.0, "{name}: correlation of {} sigma", correlation / sigma);
    }
}

/// Mean squared error over many pixels of the mean of `f` over `n` samples.
fn mean_squared_error(n: u32, exact: f64, sample: impl Fn(u32, u32) -> f64) -> f64 {
    let pixels = 256;
    let error = |pixel| ((0..n).map(|i| sample(pixel, i)).sum::<f64>() / f64::from(n) - exact).powi(2);
    (0..pixels).map(error).sum::<f64>() / f64::from(pixels)
}

#[test]
fn errors_fall_faster_than_those_of_independent_samples() {
    let smooth = |[x, y]: [f32; 2]| f64::from(x) * f64::from(y) * 4.0;
    let disk = |[x, y]: [f32; 2]| f64::from(u8::from(x * x + y * y < 1.0));
    type Integrand<'a> = (&'a str, &'a dyn Fn([f32; 2]) -> f64, f64, f64);
    let integrands: [Integrand; 2] =
        [("smooth", &smooth, 1.0, 2_000.0), ("disk", &disk, core::f64::consts::FRAC_PI_4, 10.0)];
    for (name, f, exact, gain) in integrands {
        let n = 256;
        let sobol = mean_squared_error(n, exact, |pixel, i| f(Sampler::replicate(4, pixel, 0, i).pair(0)));
        let independent = mean_squared_error(n, exact, |pixel, i| {
            let random = Random::new(4, pixel * n + i);
            f([random.single(0), random.single(1)])
        });
        println!(
            "{name}: independent {independent:.3e}, Sobol' {sobol:.3e}, gain {:.0}",
            independent / sobol
        );
        assert!(independent / sobol > gain, "{name}: gain of {}", independent / sobol);
    }
}

#[test]
fn four_dimensions_at_once_are_better_than_two_pairs() {
    let coupled = |p: [f32; 4]| f64::from((p[0] + p[1]) * (p[2] + p[3]));
    for n in [16, 64, 256] {
        let pairs = mean_squared_error(n, 1.0, |pixel, i| {
            let sampler = Sampler::replicate(6, pixel, 0, i);
            let ([a, b], [c, d]) = (sampler.pair(0), sampler.pair(1));
            coupled([a, b, c, d])
        });
        let quads =
            mean_squared_error(n, 1.0, |pixel, i| coupled(Sampler::replicate(6, pixel, 0, i).quad(0)));
        println!("{n} samples: pairs {pairs:.3e}, quads {quads:.3e}, gain {:.2}", pairs / quads);
        assert!(quads < pairs);
    }
}

#[test]
fn warps_have_their_densities() {
    let n = 1 << 18;
    let (mut disk, mut hemisphere, mut sphere, mut cone, mut triangle) =
        (vec![0; 64], vec![0; 64], vec![0; 64], vec![0; 64], vec![0; 64]);
    let eighth = |x: f32| ((x * 8.0) as usize).min(7);
    let azimuth = |x: f32, y: f32| eighth(y.atan2(x) / core::f32::consts::TAU + 0.5);
    for i in 0..n {
        let random = Random::new(1, i);
        let u = [random.single(0), random.single(1)];
        let d = warp::concentric_disk(u);
        disk[eighth(d.length_squared()) * 8 + azimuth(d.x, d.y)] += 1;
        let h = warp::cosine_hemisphere(u);
        assert!((h.length() - 1.0).abs() < 1e-6 && h.z >= 0.0);
        hemisphere[eighth(h.z * h.z) * 8 + azimuth(h.x, h.y)] += 1;
        let s = warp::uniform_sphere(u);
        assert!((s.length() - 1.0).abs() < 1e-6);
        sphere[eighth(0.5 * s.z + 0.5) * 8 + azimuth(s.x, s.y)] += 1;
        let c = warp::uniform_cone(u, 0.25);
        cone[eighth((1.0 - c.z) * 4.0) * 8 + azimuth(c.x, c.y)] += 1;
        // Both are uniform: the square of the distance from the first corner, and the ratio along the
        // opposite edge.
        let (b1, b2) = warp::uniform_triangle(u);
        assert!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0);
        triangle[eighth((b1 + b2).powi(2)) * 8 + eighth(b2 / (b1 + b2))] += 1;
    }
    assert_uniform("disk", &disk);
    assert_uniform("hemisphere", &hemisphere);
    assert_uniform("sphere", &sphere);
    assert_uniform("cone", &cone);
    assert_uniform("triangle", &triangle);
    assert_eq!(sin_cos_turns(0.25), (1.0, 0.0));
}

#[test]
fn points_of_the_disk_find_where_they_came_from() {
    let random = Random::new(7, 8);
    for i in 0..1000 {
        let u = [random.single(2 * i), random.single(2 * i + 1)];
        let found = warp::concentric_square(warp::concentric_disk(u));
        assert!((0..2).all(|k| (found[k] - u[k]).abs() < 1e-5), "{u:?} {found:?}");
    }
    assert_eq!(warp::concentric_square(glam::Vec2::ZERO), [0.5; 2]);
}

#[test]
fn alias_tables_pick_by_weight() {
    let heavy_tail = |i: usize| 1.0 / (1.0 + i as f32).powi(2);
    let holes = |i: usize| if i.is_multiple_of(3) { 0.0 } else { i as f32 };
    let one = |i: usize| if i == 37 { 5.0 } else { 0.0 };
    let broken = |i: usize| [f32::NAN, -1.0, f32::INFINITY, 2.0][i % 4];
    let weights: [(&str, &dyn Fn(usize) -> f32); 4] =
        [("heavy tail", &heavy_tail), ("holes", &holes), ("one", &one), ("broken", &broken)];
    for (name, weight) in weights {
        let count = 100;
        let mut memory = TestArena::new(AliasTable::footprint(count));
        let mut arena = memory.arena();
        let table = AliasTable::build(count, weight, &mut arena).expect("it fits");
        assert_eq!(arena.available(), 0);
        let n = 1 << 18;
        let mut counts = vec![0; count];
        for i in 0..n {
            let (item, pdf, rest) = table.sample(Random::new(2, i).single(0)).expect("not empty");
            assert!(pdf == table.pdf(item) && pdf > 0.0 && (0.0..1.0).contains(&rest), "{name}");
            counts[item] += 1;
        }
        let expected: Vec<f64> = (0..count).map(|i| f64::from(table.pdf(i)) * f64::from(n)).collect();
        assert!((expected.iter().sum::<f64>() / f64::from(n) - 1.0).abs() < 1e-5, "{name}");
        let possible: Vec<usize> = (0..count).filter(|&i| expected[i] > 0.0).collect();
        assert!(counts.iter().zip(&expected).all(|(&c, &e)| c == 0 || e > 0.0), "{name}");
        if possible.len() > 1 {
            let pick = |i: &usize| (counts[*i], expected[*i]);
            let (counts, expected): (Vec<u32>, Vec<f64>) = possible.iter().map(pick).unzip();
            assert_expected(name, &counts, &expected);
        }
    }
    let mut none = TestArena::new(AliasTable::footprint(0));
    let table = AliasTable::build(0, |_| 1.0, &mut none.arena());
    assert!(table.is_ok_and(|t| t.sample(0.5).is_none()));
}

#[test]
fn grids_are_sampled_by_weight_and_know_their_density() {
    let weight = |x: usize, y: usize| if y == 2 { 0.0 } else { ((x * 7 + y * 3) % 11) as f32 };
    let (width, height) = (24, 10);
    let footprint = Distribution2d::footprint(width, height);
    let mut memory = TestArena::new(footprint);
    let (bytes, footprint) = (memory.bytes(), footprint.bytes());
    assert!(
        Distribution2d::build(width, height, weight, &mut Arena::new(&mut bytes[..footprint - 1])).is_err()
    );
    let mut arena = Arena::new(bytes);
    let grid = Distribution2d::build(width, height, weight, &mut arena).expect("it fits");
    assert_eq!(arena.available(), 0);

    let n = 1 << 18;
    let mut counts = vec![0; width * height];
    for i in 0..n {
        let random = Random::new(3, i);
        let cell = grid.sample([random.single(0), random.single(1)]).expect("not empty");
        let (x, y) = (cell.x as usize, cell.y as usize);
        assert_eq!(cell.pdf, grid.pdf(x, y));
        assert!(cell.offset.iter().all(|o| (0.0..1.0).contains(o)));
        counts[y * width + x] += 1;
    }
    let cells = |i: usize| grid.pdf(i % width, i / width) as f64 / (width * height) as f64;
    let sum: f64 = (0..width * height).map(cells).sum();
    assert!((sum - 1.0).abs() < 1e-6, "densities sum to {sum}");
    let expected: Vec<f64> = (0..width * height).map(|i| cells(i) * f64::from(n)).collect();
    assert_expected("grid", &counts, &expected);
}

#[test]
fn the_largest_number_is_below_one_and_the_smallest_is_zero_or_more() {
    for bits in [0u32, 1, 255, 256, u32::MAX] {
        assert!((0.0..1.0).contains(&halflight_core::sampling::unit_float(bits)));
    }
    let extreme = [0.0, halflight_core::sampling::ONE_MINUS_EPSILON];
    for u in [[extreme[0]; 2], [extreme[1]; 2], extreme] {
        assert!(warp::uniform_sphere(u).is_finite() && warp::cosine_hemisphere(u).z >= 0.0);
        assert!(warp::concentric_disk(u).length() <= 1.0 + 1e-6);
    }
}
