//! Searches against brute force, on point sets that are known to break trees; and their memory.

use super::*;
use crate::Rgb;
use crate::memory::Line;
use halflight_test_support::Random;
use std::vec;
use std::vec::Vec;

pub(crate) fn lines(footprint: Footprint) -> Vec<Line> {
    vec![Line([0; 64]); footprint.bytes() / size_of::<Line>()]
}

/// Builds over photons at `places` and checks the map.
pub(super) fn with_map(places: &[Vec3], check: impl FnOnce(&PhotonMap)) {
    let photons: Vec<_> =
        places.iter().map(|&place| Photon::new(place, Vec3::Z, Vec3::Z, Rgb::ONE)).collect();
    with_map_of(&photons, check);
}

/// Builds over `photons` and checks the map.
pub(crate) fn with_map_of(photons: &[Photon], check: impl FnOnce(&PhotonMap)) {
    let mut memory = lines(Photons::footprint(photons.len()));
    let mut arena = Arena::over(&mut memory);
    let mut room = Photons::new(photons.len(), &mut arena).unwrap();
    room.as_mut_slice().copy_from_slice(photons);
    check(&room.build(photons.len()));
}

/// The expected nearest photons: bits of squared distances in units of the map, and indices, sorted.
fn expected(map: &PhotonMap, place: Vec3, radius: f32, k: usize) -> Vec<(u32, u32)> {
    let mut all: Vec<_> = brute::within(map, place, radius).map(|(i, d)| (d.to_bits(), i)).collect();
    all.sort_unstable();
    all.truncate(k);
    all
}

fn check_searches(map: &PhotonMap, place: Vec3, radius: f32) {
    for level in Level::detect().and_below() {
        for k in [0, 1, 8, 50, 200] {
            let mut memory = lines(Neighbours::footprint(k));
            let mut arena = Arena::over(&mut memory);
            let mut neighbours = Neighbours::new(k, &mut arena).unwrap();
            map.nearest(level, place, radius, &mut neighbours);
            let expected = expected(map, place, radius, k);
            let mut found: Vec<_> = neighbours.iter().map(|(i, _)| i).collect();
            found.sort_unstable();
            let mut indices: Vec<_> = expected.iter().map(|&(_, i)| i).collect();
            indices.sort_unstable();
            assert_eq!(found, indices, "{level:?} k {k} of {} at {place} within {radius}", map.len());
            let last =
                if k > 0 && expected.len() == k { f32::from_bits(expected[k - 1].0) } else { f32::INFINITY };
            assert_eq!(neighbours.squared_radius(), map.space.squared_to_scene(last));
        }
        let all: Vec<_> = brute::within(map, place, radius).map(|(i, _)| i).collect();
        for room in [all.len(), 0, all.len() / 2, all.len() + 40] {
            let mut found = vec![u32::MAX; room];
            assert_eq!(map.within(level, place, radius, &mut found), all.len(), "{level:?}");
            let known = room.min(all.len());
            assert_eq!(found[..known], all[..known], "{level:?}");
        }
    }
}

/// Point sets of `n` points.
fn sets(n: usize) -> Vec<(&'static str, Vec<Vec3>)> {
    let mut random = Random(n as u64);
    let mut set = |make: &mut dyn FnMut(usize, &mut Random) -> Vec3| -> Vec<Vec3> {
        (0..n).map(|i| make(i, &mut random)).collect()
    };
    let wide = |random: &mut Random| libm::exp10f(-20.0 + 40.0 * random.unit_f32());
    vec![
        ("volume", set(&mut |_, random| random.point())),
        ("wall", set(&mut |_, random| random.point().with_y(0.5))),
        ("line", set(&mut |_, random| Vec3::new(0.25, random.unit_f32(), -1.0))),
        ("one place", set(&mut |_, _| Vec3::new(0.1, 0.2, 0.3))),
        ("grid", set(&mut |_, random| (random.point() * 4.0).floor() * 0.25)),
        ("focus", set(&mut |i, random| random.point() * if i % 3 == 0 { 1.0 } else { 1e-3 })),
        ("spans", set(&mut |_, random| (random.point() - 0.5) * wide(random))),
        ("far", set(&mut |_, random| random.point() + 1e5)),
        ("large", set(&mut |_, random| random.point() * 1e38)),
        ("small", set(&mut |_, random| random.point() * 1e-36)),
    ]
}

#[test]
fn searches_find_what_brute_force_finds() {
    for n in [0, 1, 2, 31, 32, 33, 512, 513, 3000] {
        for (name, places) in sets(n) {
            std::println!("{name} {n}");
            with_map(&places, |map| {
                assert_eq!((map.len(), map.refused()), (n, 0));
                let mut random = Random(99);
                let extent = places.iter().fold(0.0, |most: f32, place| most.max(place.abs().max_element()));
                for i in 0..6 {
                    let near = places.get(random.below(n)).copied().unwrap_or(Vec3::ONE);
                    let place =
                        [near, near + random.point() * (0.1 * extent), random.point() * extent][i % 3];
                    for radius in [f32::INFINITY, 0.0, 0.1 * extent, random.unit_f32() * extent] {
                        check_searches(map, place, radius);
                    }
                }
            });
        }
    }
}

#[test]
fn what_is_not_a_number_is_refused_or_finds_nothing() {
    let mut random = Random(3);
    let mut places: Vec<_> = (0..200).map(|_| random.point()).collect();
    for (i, odd) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].into_iter().enumerate() {
        places[7 + 60 * i][i] = odd;
    }
    with_map(&places, |map| {
        assert_eq!((map.len(), map.refused()), (197, 3));
        check_searches(map, Vec3::splat(0.5), f32::INFINITY);
        for place in [Vec3::NAN, Vec3::new(0.0, f32::NAN, 0.0), Vec3::INFINITY, Vec3::NEG_INFINITY] {
            check_searches(map, place, f32::INFINITY);
        }
        for radius in [f32::NAN, -1.0, f32::NEG_INFINITY, -0.0, f32::MAX] {
            check_searches(map, Vec3::splat(0.5), radius);
        }
        let mut found = [0; 256];
        assert_eq!(map.within(Level::detect(), Vec3::NAN, f32::INFINITY, &mut found), 0);
        assert_eq!(map.within(Level::detect(), Vec3::ONE, f32::INFINITY, &mut found), 197);
    });
    with_map(&[Vec3::NAN; 70], |map| {
        assert!(map.is_empty() && map.refused() == 70 && map.get(0).is_none());
        check_searches(map, Vec3::ZERO, f32::INFINITY);
    });
}

#[test]
fn photons_come_back_as_they_were_put() {
    let mut random = Random(11);
    let places: Vec<_> = (0..1000).map(|_| random.point() * 1e-3 - 5e-4).collect();
    let mut memory = lines(Photons::footprint(1000));
    let mut photons = Photons::new(1000, &mut Arena::over(&mut memory)).unwrap();
    let put: Vec<_> = places
        .iter()
        .map(|&place| Photon::new(place, random.point() - 0.5, random.point() - 0.5, random.point()))
        .collect();
    photons.as_mut_slice().copy_from_slice(&put);
    let map = photons.build(1000);
    let bytes = |photon: &Photon| bytemuck::bytes_of(photon).to_vec();
    let mut got: Vec<_> = (0..1000).map(|i| bytes(&map.get(i).unwrap())).collect();
    let mut put: Vec<_> = put.iter().map(bytes).collect();
    got.sort_unstable();
    put.sort_unstable();
    assert_eq!(got, put);
    assert!(map.get(1000).is_none());
}

#[test]
fn exact_bytes_suffice_and_one_less_is_an_error() {
    for capacity in [0, 1, 32, 33, 600, 10_000] {
        let bytes = Photons::footprint(capacity).bytes();
        let mut memory = lines(Photons::footprint(capacity));
        let memory: &mut [u8] = bytemuck::cast_slice_mut(&mut memory);
        let mut arena = Arena::new(memory);
        let mut photons = Photons::new(capacity, &mut arena).unwrap();
        assert_eq!((photons.as_mut_slice().len(), arena.available()), (capacity, 0));
        if bytes > 0 {
            assert!(Photons::new(capacity, &mut Arena::new(&mut memory[..bytes - 1])).is_err());
        }
    }
    for k in [0, 1, 50] {
        let bytes = Neighbours::footprint(k).bytes();
        let mut memory = lines(Neighbours::footprint(k));
        let memory: &mut [u8] = bytemuck::cast_slice_mut(&mut memory);
        let mut arena = Arena::new(memory);
        assert!(Neighbours::new(k, &mut arena).is_ok());
        assert_eq!(arena.available(), 0);
        assert!(Neighbours::new(k, &mut Arena::new(&mut memory[..bytes - 1])).is_err());
    }
    assert!(Photons::new(usize::MAX, &mut Arena::new(&mut [])).is_err());
    assert!(Neighbours::new(usize::MAX, &mut Arena::new(&mut [])).is_err());
}

#[test]
fn a_photon_takes_less_than_24_bytes_with_the_tree() {
    for count in [100_000, 1_000_000, 10_000_000] {
        assert!(Photons::footprint(count).bytes() < 23 * count);
    }
}

#[test]
fn a_million_photons_on_a_wall_or_in_one_place_are_searched_like_any_others() {
    let mut random = Random(5);
    let wall: Vec<_> = (0..1_000_000).map(|_| random.point().with_y(-3.0)).collect();
    for places in [wall, vec![Vec3::new(1.0, -2.0, 3.0); 1_000_000]] {
        with_map(&places, |map| check_searches(map, places[77_777], 1e-3));
    }
}

/// A map of photons of all directions, normals and powers, at `places`.
fn with_light(places: &[Vec3], check: impl FnOnce(&PhotonMap)) {
    let mut random = Random(21);
    let mut memory = lines(Photons::footprint(places.len()));
    let mut photons = Photons::new(places.len(), &mut Arena::over(&mut memory)).unwrap();
    for (photon, &place) in photons.as_mut_slice().iter_mut().zip(places) {
        let normal = Vec3::new(0.2, 0.2, 1.0) + random.point() - 0.5;
        *photon = Photon::new(place, random.point() - Vec3::new(0.5, 0.5, 0.2), normal, random.point());
    }
    check(&photons.build(places.len()));
}

/// Relative error; thousands of photons are added in another order.
const ROUNDING: f32 = 2e-5;

#[test]
fn what_is_gathered_is_what_brute_force_gathers() {
    let mut random = Random(77);
    let places: Vec<_> = (0..20_000).map(|_| random.point() * Vec3::new(1.0, 1.0, 0.1)).collect();
    let glossy = |direction: Vec3| Rgb::new(direction.z, direction.x * direction.x, 1.0);
    with_light(&places, |map| {
        let mut most = 0;
        for i in 0..40 {
            let disc = QueryDisc {
                place: places[i * 100] + random.point() * 0.01,
                normal: (Vec3::Z + 0.5 * random.point()).normalize(),
                radius: 0.3 * random.unit_f32(),
                kernel: [Kernel::Constant, Kernel::Cone, Kernel::Epanechnikov][i % 3],
            };
            let expected = brute::gather(map, &disc, &Uniform(Rgb::new(0.5, 1.0, 2.0)));
            let expected_glossy = brute::gather(map, &disc, &glossy);
            most = most.max(expected.photons);
            let uniform = Uniform(Rgb::new(0.5, 1.0, 2.0));
            let baseline = map.gather(Level::BASELINE, &disc, &uniform);
            for level in Level::detect().and_below() {
                let found = map.gather(level, &disc, &uniform);
                assert_eq!(found, baseline, "{level:?}");
                assert_eq!(found.photons, expected.photons, "{disc:?}");
                for (found, expected) in radiances(found).into_iter().zip(radiances(expected)) {
                    let error = (found - expected).abs();
                    assert!(error.cmple(expected * ROUNDING).all(), "{found:?} {expected:?}");
                }
                let found = map.gather(level, &disc, &glossy);
                assert_eq!(found.photons, expected_glossy.photons);
                for (found, expected) in radiances(found).into_iter().zip(radiances(expected_glossy)) {
                    let error = (found - expected).abs().max_element();
                    assert!(error <= expected.max_element() * ROUNDING, "{found:?} {expected:?}");
                }
            }
        }
        assert!(most > 500, "the discs hold something: at most {most}");
        let disc = QueryDisc { place: Vec3::ONE, normal: Vec3::Z, radius: 1.0, kernel: Kernel::Cone };
        for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let found = map.gather(Level::detect(), &QueryDisc { radius, ..disc }, &Uniform(Rgb::ONE));
            assert_eq!(found, DensityEstimate::default());
        }
        let odd = QueryDisc { normal: Vec3::NAN, ..disc };
        assert_eq!(map.gather(Level::detect(), &odd, &Uniform(Rgb::ONE)), DensityEstimate::default());
    });
}

/// Radiance of a disc and of its finer discs.
fn radiances(density: DensityEstimate) -> [Rgb; 1 + FINER_DISCS] {
    let [half, quarter, eighth] = density.finer;
    [density.radiance, half, quarter, eighth]
}

#[test]
fn the_finest_disc_is_chosen_that_has_enough_photons() {
    let [whole, half, quarter, eighth] = [1.0, 2.0, 3.0, 4.0].map(Rgb::splat);
    for (photons, expected) in [
        (31, [whole, half]),
        (32, [half, quarter]),
        (127, [half, quarter]),
        (128, [quarter, eighth]),
        (512, [eighth, Rgb::splat(4.25)]),
    ] {
        let density = DensityEstimate { radiance: whole, finer: [half, quarter, eighth], photons };
        assert_eq!(density.of_finest_disc(8.0), expected, "{photons}");
        assert_eq!(density.of_finest_disc(f32::INFINITY), [whole, half]);
    }
}

#[test]
fn an_even_floor_has_the_irradiance_that_was_put_there_by_every_falloff() {
    let mut random = Random(31);
    let count = 400_000;
    let places: Vec<_> = (0..count).map(|_| random.point().with_z(0.0)).collect();
    with_map(&places, |map| {
        for kernel in [Kernel::Constant, Kernel::Cone, Kernel::Epanechnikov] {
            let disc = QueryDisc { place: Vec3::new(0.5, 0.5, 0.0), normal: Vec3::Z, radius: 0.2, kernel };
            let found = map.gather(Level::detect(), &disc, &Uniform(Rgb::ONE));
            // 1 W per photon on 1 m²; about 50 000 photons. Four standard deviations of the kernel of largest
            // variance (E[k²] = 3/2) are 2 %. Each finer disc has a quarter of the photons.
            let mut most = 0.022;
            for radiance in radiances(found) {
                let off = (radiance / count as f32 - 1.0).abs().max_element();
                assert!(off < most, "{kernel:?} {found:?}");
                most *= 2.0;
            }
        }
    });
}

#[test]
fn nothing_leaks_through_a_thin_wall_or_around_an_edge() {
    // Light on one side of a wall of thickness 1e-3, and on a floor that meets the wall.
    let mut random = Random(41);
    let mut memory = lines(Photons::footprint(40_000));
    let mut photons = Photons::new(40_000, &mut Arena::over(&mut memory)).unwrap();
    for (i, photon) in photons.as_mut_slice().iter_mut().enumerate() {
        let (a, b) = (random.unit_f32() - 0.5, random.unit_f32());
        *photon = match i % 2 {
            0 => Photon::new(Vec3::new(0.0, a, b), Vec3::new(1.0, 0.2, 0.3), Vec3::X, Rgb::ONE),
            _ => Photon::new(Vec3::new(b, a, 0.0), Vec3::new(0.4, 0.2, 1.0), Vec3::Z, Rgb::ONE),
        };
    }
    let map = photons.build(40_000);
    let at = |place: Vec3, normal: Vec3| {
        let disc = QueryDisc { place, normal, radius: 0.1, kernel: Kernel::Epanechnikov };
        map.gather(Level::detect(), &disc, &Uniform(Rgb::ONE)).photons
    };
    assert!(at(Vec3::new(0.0, 0.0, 0.5), Vec3::X) > 500, "the lit side");
    assert!(at(Vec3::new(0.5, 0.0, 0.0), Vec3::Z) > 500, "the lit floor");
    assert_eq!(at(Vec3::new(-1e-3, 0.0, 0.5), Vec3::NEG_X), 0, "the dark side");
    assert_eq!(at(Vec3::new(-0.05, 0.0, 0.0), Vec3::NEG_Z), 0, "the floor from below");
    // In the corner the estimate on the floor excludes photons of the wall, and vice versa.
    let corner = at(Vec3::ZERO, Vec3::Z);
    let mut expected = 0;
    for (index, _) in brute::within(&map, Vec3::ZERO, 0.1) {
        expected += u32::from(map.get(index).unwrap().normal() == Vec3::Z);
    }
    assert_eq!(corner, expected);
}

#[test]
fn batches_find_what_single_searches_find() {
    for (name, places) in sets(2000) {
        with_light(&places, |map| {
            let level = Level::detect();
            let mut random = Random(13);
            let extent = places.iter().fold(0.0, |most: f32, place| most.max(place.abs().max_element()));
            let mut asked: Vec<_> =
                (0..300).map(|i| places[i * 5] + random.point() * (0.01 * extent)).collect();
            asked[7] = Vec3::NAN;
            asked[70] = Vec3::INFINITY;
            for (k, radius) in
                [(1, f32::INFINITY), (8, f32::INFINITY), (60, f32::INFINITY), (60, 0.05 * extent)]
            {
                let mut memory = [lines(Neighbours::footprint(k)), lines(Neighbours::footprint(k))];
                let [mut one, mut many] =
                    memory.each_mut().map(|memory| Neighbours::new(k, &mut Arena::over(memory)).unwrap());
                let mut seen = vec![false; asked.len()];
                let mut order = vec![QueryOrder::default(); asked.len()];
                map.nearest_batch(level, &asked, radius, &mut order, &mut many, |i, found| {
                    seen[i] = true;
                    map.nearest(level, asked[i], radius, &mut one);
                    let sorted = |neighbours: &Neighbours| {
                        let mut all: Vec<_> = neighbours.iter().map(|(i, d)| (i, d.to_bits())).collect();
                        all.sort_unstable();
                        all
                    };
                    assert_eq!(sorted(found), sorted(&one), "{name} {k} {radius} {}", asked[i]);
                });
                assert!(seen.into_iter().all(|seen| seen));
            }
            let disc = |&place: &Vec3| QueryDisc {
                place,
                normal: Vec3::Z,
                radius: 0.1 * extent,
                kernel: Kernel::Cone,
            };
            let discs: Vec<_> = asked.iter().map(disc).collect();
            let mut order = vec![QueryOrder::default(); discs.len()];
            let mut densities = vec![DensityEstimate::default(); discs.len()];
            map.gather_batch(level, &discs, &Uniform(Rgb::ONE), &mut order, &mut densities);
            for (disc, density) in discs.iter().zip(&densities) {
                let bits = |density: DensityEstimate| {
                    (density.radiance.to_array().map(f32::to_bits), density.photons)
                };
                assert_eq!(bits(*density), bits(map.gather(level, disc, &Uniform(Rgb::ONE))), "{name}");
            }
        });
    }
}

/// Runs both at once, on two threads.
struct Threads;

impl ForkJoin for Threads {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        std::thread::scope(|scope| {
            scope.spawn(a);
            b();
        });
    }
}

#[test]
fn the_map_is_the_same_on_any_number_of_threads() {
    let mut random = Random(51);
    let places: Vec<_> = (0..50_000).map(|_| random.point().with_x(0.0)).collect();
    let build = |join: bool| {
        let mut memory = lines(Photons::footprint(places.len()));
        let mut photons = Photons::new(places.len(), &mut Arena::over(&mut memory)).unwrap();
        for (photon, &place) in photons.as_mut_slice().iter_mut().zip(&places) {
            *photon = Photon::new(place, Vec3::Z, Vec3::Z, Rgb::ONE);
        }
        let count = places.len();
        let map = if join { photons.build_with(count, &Threads) } else { photons.build(count) };
        (0..count as u32).map(|i| map.get(i).unwrap().position().to_array()).collect::<Vec<_>>()
    };
    assert_eq!(build(false), build(true));
}

#[test]
fn a_boundary_leaves_out_what_is_behind_it_and_makes_up_for_it() {
    let mut random = Random(61);
    let count = 400_000;
    let places: Vec<_> = (0..count).map(|_| random.point().with_z(0.0)).collect();
    with_map(&places, |map| {
        for kernel in [Kernel::Constant, Kernel::Cone, Kernel::Epanechnikov] {
            let disc = QueryDisc { place: Vec3::new(0.5, 0.5, 0.0), normal: Vec3::Z, radius: 0.2, kernel };
            let level = Level::detect();
            let open = map.gather(level, &disc, &Uniform(Rgb::ONE));
            // A wall at x = 0.55 ends the probes that hit it.
            let frame = KernelBoundary::frame(Vec3::Z, 0.2);
            let boundary = KernelBoundary::new(
                &frame,
                KernelBoundary::PROBE_DIRECTIONS.map(|way| {
                    let x = frame.to_world(way.extend(0.0)).x;
                    if x > 0.0 { 0.05 / x / 0.2 } else { f32::INFINITY }
                }),
            );
            let bounded = map.gather_within(level, &disc, &boundary, &Uniform(Rgb::ONE));
            assert!(bounded.photons < open.photons * 9 / 10, "{bounded:?} {open:?}");
            // A third of the photons is missing: 2.5 % is four standard deviations.
            assert!((bounded.radiance / count as f32 - 1.0).abs().max_element() < 0.025, "{bounded:?}");
            // All photons that count lie before the wall: removing those behind it changes nothing.
            let before: Vec<_> = places.iter().copied().filter(|place| place.x <= 0.55).collect();
            with_map(&before, |map| {
                let alone = map.gather_within(level, &disc, &boundary, &Uniform(Rgb::ONE));
                assert_eq!(alone.photons, bounded.photons);
            });
            for level in Level::detect().and_below() {
                assert_eq!(
                    map.gather_within(level, &disc, &boundary, &Uniform(Rgb::ONE)),
                    bounded,
                    "{level:?}"
                );
            }
        }
    });
}
