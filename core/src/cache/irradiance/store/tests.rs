//! Tests of the irradiance cache: footprint, widening, restored records, neighbours.

use super::*;
use crate::cache::irradiance::SECTORS;
use crate::cache::irradiance::validity::radius;
use crate::memory::Line;
use crate::sampling::Random;
use std::vec;

const BOUNDS: Bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };

fn with_cache<T>(capacity: usize, then: impl FnOnce(&mut IrradianceCache) -> T) -> T {
    let mut lines = vec![Line([0xff; 64]); IrradianceCache::footprint(capacity).bytes() / 64];
    let mut arena = Arena::over(&mut lines);
    then(&mut IrradianceCache::new(&BOUNDS, capacity, &mut arena).unwrap())
}

/// Record on the plane z = 1/2, where E = 1 + x in red, 2 in the other channels.
fn record(x: f32, y: f32, radius: f32) -> Record {
    Record {
        position: [x, y, 0.5],
        normal: [0.0, 0.0, 1.0],
        axis: [1.0, 0.0, 0.0],
        irradiance: [1.0 + x, 2.0, 2.0],
        gradient: [[1.0, 0.0], [0.0; 2], [0.0; 2]],
        radii: [radius, 1.5 * radius],
        overlap: 1.0,
        reach: 1.5 * radius,
        boundary: [u8::MAX; SECTORS],
        free: [u8::MAX; SECTORS],
        ..Record::default()
    }
}

#[test]
fn the_footprint_is_exact_and_a_full_cache_says_so() {
    for capacity in [0, 1, 100] {
        let bytes = IrradianceCache::footprint(capacity).bytes();
        let mut lines = vec![Line([0; 64]); bytes / 64];
        let memory: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
        let short = bytes.saturating_sub(1);
        let cache = IrradianceCache::new(&BOUNDS, capacity, &mut Arena::new(&mut memory[..short]));
        assert_eq!(cache.is_err(), capacity > 0);
        assert!(IrradianceCache::new(&BOUNDS, capacity, &mut Arena::new(memory)).is_ok());
        assert!(IrradianceCache::footprint(IrradianceCache::capacity_of(bytes)).bytes() <= bytes);
        assert!(IrradianceCache::capacity_of(bytes) <= capacity);
    }
    with_cache(2, |cache| {
        let inserted = [0.1, 0.2, 0.3].map(|x| cache.insert(record(x, 0.5, 0.1)));
        assert_eq!((inserted, cache.is_full(), cache.refused()), ([true, true, false], true, 1));
        assert_eq!(cache.records().len(), 2);
    });
}

#[test]
fn a_plane_of_linear_irradiance_is_what_it_is_everywhere() {
    with_cache(300, |cache| {
        let random = Random::new(1, 1);
        for i in 0..300 {
            let radius = 0.1 + 0.1 * random.single(3 * i);
            assert!(cache.insert(record(random.single(3 * i + 1), random.single(3 * i + 2), radius)));
        }
        for i in 0..1000 {
            let (x, y) = (random.single(10_000 + 2 * i), random.single(10_001 + 2 * i));
            let e = cache.at(&QueryPoint::open(Vec3::new(x, y, 0.5), Vec3::Z)).unwrap().irradiance;
            assert!(e.distance(Vec3::new(1.0 + x, 2.0, 2.0)) < 1e-5, "{x} {y}: {e}");
            assert!(cache.covers(&QueryPoint::open(Vec3::new(x, y, 0.5), Vec3::Z)));
            assert_eq!(cache.at(&QueryPoint::open(Vec3::new(x, y, 0.5), Vec3::NEG_Z)), None);
            assert_eq!(cache.at(&QueryPoint::open(Vec3::new(x, y, 0.9), Vec3::Z)), None);
        }
    });
}

#[test]
fn a_gap_is_covered_once_the_nearest_record_in_radii_is_wide_enough() {
    with_cache(2, |cache| {
        cache.insert(record(0.2, 0.5, 0.05));
        cache.insert(record(0.8, 0.5, 0.1));
        let (gap, turned) = (Vec3::new(0.5, 0.5, 0.5), Vec3::X);
        // 0.3 is 6 radii of the first record and 3 of the second.
        let factor = cache.widening(&QueryPoint::open(gap, Vec3::Z), 6.0).unwrap();
        assert!((3.0..3.01).contains(&factor), "{factor}");
        assert_eq!(cache.widening(&QueryPoint::open(gap, Vec3::Z), 2.9), None);
        assert_eq!(cache.widening(&QueryPoint::open(gap, turned), 6.0), None);
        let covered = QueryPoint::open(Vec3::new(0.75, 0.5, 0.5), Vec3::Z);
        assert_eq!(cache.widening(&covered, 6.0), Some(1.0));
        let wide = |cache: &mut IrradianceCache, factor| {
            cache.records_mut().iter_mut().for_each(|record| *record = record.widened(factor));
            cache.rebuild();
            // From there somebody has looked up.
            cache.covers(&QueryPoint { within: f32::MAX, ..QueryPoint::open(gap, Vec3::Z) })
        };
        assert!(!wide(cache, 0.99 * factor) && wide(cache, 1.02));
    });
}

#[test]
fn records_that_are_restored_say_the_same_to_the_bit() {
    let random = Random::new(3, 3);
    let point = |i: u32| Vec3::new(random.single(7_000 + 2 * i), random.single(7_001 + 2 * i), 0.5);
    with_cache(300, |cache| {
        for i in 0..300 {
            let radius = 0.3 * libm::powf(random.single(3 * i), 4.0);
            let bent = Record { bend: [radius; 2], ..record(random.single(3 * i + 1), 0.5, radius) };
            cache.insert(Record { position: point(9_000 + i).to_array(), ..bent });
        }
        let said = |cache: &IrradianceCache, i| cache.at(&QueryPoint::open(point(i), Vec3::Z));
        let covered = |cache: &IrradianceCache, i| cache.covers(&QueryPoint::open(point(i), Vec3::Z));
        let before: vec::Vec<_> = (0..500).map(|i| covered(cache, i)).collect();
        cache.rebuild();
        assert!((0..500).all(|i| covered(cache, i) == before[i as usize]));
        with_cache(300, |other| {
            other.insert(record(0.5, 0.5, 0.5));
            other.restore(cache.records());
            assert_eq!((other.records(), other.refused()), (cache.records(), 0));
            assert!((0..500).all(|i| said(other, i) == said(cache, i)));
        });
        with_cache(200, |other| {
            other.restore(cache.records());
            assert_eq!((other.records().len(), other.refused()), (200, 100));
        });
    });
}

/// E = 1 and 1.5 at a distance of 0.1: a curvature of 2 · 0.5 / 0.1² over 1.5. With a relative noise of a
/// quarter each, the difference is within three standard deviations.
#[test]
fn records_that_disagree_shrink_unless_noise_is_an_excuse() {
    let pair = |noise| {
        with_cache(2, |cache| {
            for (x, e) in [(0.4, 1.0), (0.5, 1.5)] {
                let flat = Record { gradient: [[0.0; 2]; 3], noise, allowed: 1e-4, ..record(x, 0.5, 0.2) };
                cache.insert(Record { irradiance: [e; 3], ..flat });
            }
            [0, 1].map(|i: usize| cache.records()[i].radii[0])
        })
    };
    let wanted = radius(1e-4, 2.0 * 0.5 / 0.01 / 1.5);
    assert!(pair(0.0).iter().all(|found| (found / wanted - 1.0).abs() < 1e-5), "{:?} {wanted}", pair(0.0));
    assert_eq!(pair(0.0625), [0.2; 2]);
}

#[test]
fn no_radius_is_larger_than_a_neighbours_and_the_distance_to_it() {
    with_cache(400, |cache| {
        let random = Random::new(2, 2);
        for i in 0..400 {
            let radius = 0.3 * libm::powf(random.single(3 * i), 4.0);
            let bent = Record {
                error: radius * radius,
                ..record(random.single(3 * i + 1), random.single(3 * i + 2), radius)
            };
            cache.insert(bent);
        }
        for a in cache.records() {
            for b in cache.records() {
                let distance = Vec3::from(a.position).distance(b.position.into());
                assert!(a.radii[0] <= b.radii[0] + distance + 1e-6);
            }
            assert!((a.radii[1] / a.radii[0] - 1.5).abs() < 1e-5);
            assert!((a.error / (a.radii[0] * a.radii[0]) - 1.0).abs() < 1e-5);
        }
    });
}
