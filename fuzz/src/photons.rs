//! Photon maps of any photons, searched from anywhere through every entry point at every level: results agree
//! with brute force, ties included, and densities with each other to the bit.

use crate::numbers::{coordinate, fraction, point};
use arbitrary::{Result, Unstructured};
use glam::Vec3;
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::photon::{
    DensityEstimate, Kernel, Neighbours, Photon, PhotonMap, Photons, QueryDisc, QueryOrder, Response,
    Uniform, brute,
};
use halflight_core::{Level, Rgb};

/// More photons than the leaves of one node hold.
const MAX_PHOTONS: usize = 1024;

/// Relative tolerance: up to a thousand terms are summed in another order.
const ROUNDING: f32 = 1e-4;

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let mut photons = Vec::new();
    let (count, copies) = (1 + input.arbitrary::<u8>()? % 64, 1 + usize::from(input.arbitrary::<u8>()? % 40));
    for _ in 0..count {
        photons.push(photon(input)?);
    }
    let places: Vec<Vec3> = photons.iter().map(Photon::position).collect();
    // Many copies: the index of photons then decides which are nearer.
    photons = photons.repeat(copies);
    photons.truncate(MAX_PHOTONS);

    let mut memory = lines(Photons::footprint(photons.len()));
    let mut place =
        Photons::new(photons.len(), &mut Arena::over(&mut memory)).expect("the footprint was granted");
    place.as_mut_slice().copy_from_slice(&photons);
    let map = place.build(photons.len());
    let finite = photons.iter().filter(|photon| photon.position().is_finite()).count();
    assert_eq!((map.len(), map.len() + map.refused()), (finite, photons.len()));

    let mut asked = Vec::new();
    while asked.len() < 6 && !input.is_empty() {
        let near = places[usize::from(input.arbitrary::<u8>()?) % places.len()];
        asked.push(if input.arbitrary::<u8>()? < 128 { near } else { Vec3::from(point(input)?) });
    }
    let radius = if input.arbitrary::<u8>()? < 100 { f32::INFINITY } else { coordinate(input)? };
    let k = usize::from(input.arbitrary::<u8>()?);
    let normal = Vec3::from(point(input)?).normalize_or(Vec3::Z);
    let kernel =
        [Kernel::Constant, Kernel::Cone, Kernel::Epanechnikov][usize::from(input.arbitrary::<u8>()? % 3)];
    // Brute force gives one answer for all levels.
    let orders: Vec<Vec<u32>> = asked.iter().map(|&place| expected(&map, place, radius)).collect();
    for level in Level::detect().and_below() {
        search(&map, level, &asked, &orders, radius, k);
        for &place in &asked {
            gather(&map, level, &QueryDisc { place, normal, radius, kernel });
        }
    }
    Ok(())
}

fn photon(input: &mut Unstructured) -> Result<Photon> {
    let place = Vec3::from(point(input)?);
    let (direction, normal) = (Vec3::from(point(input)?), Vec3::from(point(input)?));
    let power = Rgb::new(fraction(input)?, fraction(input)?, fraction(input)?);
    Ok(Photon::new(place, direction, normal, power))
}

fn lines(footprint: Footprint) -> Vec<Line> {
    vec![Line([0; 64]); footprint.bytes() / 64]
}

/// Indices of photons within `radius` by ascending distance, then index.
fn expected(map: &PhotonMap, place: Vec3, radius: f32) -> Vec<u32> {
    let mut all: Vec<_> = brute::within(map, place, radius).map(|(i, d)| (d.to_bits(), i)).collect();
    all.sort_unstable();
    all.into_iter().map(|(_, index)| index).collect()
}

fn search(map: &PhotonMap, level: Level, asked: &[Vec3], orders: &[Vec<u32>], radius: f32, k: usize) {
    let mut memory = lines(Neighbours::footprint(k));
    let mut neighbours =
        Neighbours::new(k, &mut Arena::over(&mut memory)).expect("the footprint was granted");
    let sorted = |mut indices: Vec<u32>| {
        indices.sort_unstable();
        indices
    };
    let check = |index: usize, neighbours: &Neighbours| {
        let expected = &orders[index][..k.min(orders[index].len())];
        let found = neighbours.iter().map(|(index, _)| index).collect();
        assert_eq!(
            sorted(found),
            sorted(expected.to_vec()),
            "{level:?} {k} of {} at {} within {radius}",
            map.len(),
            asked[index]
        );
    };
    for (index, &place) in asked.iter().enumerate() {
        map.nearest(level, place, radius, &mut neighbours);
        check(index, &neighbours);
        let expected = sorted(orders[index].clone());
        let mut found = vec![0; expected.len()];
        assert_eq!(map.within(level, place, radius, &mut found), expected.len());
        assert_eq!(found, expected, "{level:?} at {place} within {radius}");
    }
    let mut turns = vec![QueryOrder::default(); asked.len()];
    let mut seen = 0;
    map.nearest_batch(level, asked, radius, &mut turns, &mut neighbours, |index, neighbours| {
        seen += 1;
        check(index, neighbours);
    });
    assert_eq!(seen, asked.len());
}

fn gather(map: &PhotonMap, level: Level, disc: &QueryDisc) {
    let glossy = |direction: Vec3| Rgb::new(1.0 + direction.x, direction.y * direction.y, 0.5);
    same(map, level, disc, &Uniform(Rgb::new(1.0, 0.5, 0.25)));
    same(map, level, disc, &glossy);
}

fn same<R: Response>(map: &PhotonMap, level: Level, disc: &QueryDisc, response: &R) {
    let (found, expected) = (map.gather(level, disc, response), brute::gather(map, disc, response));
    assert_eq!(found.photons, expected.photons, "{level:?} {disc:?}");
    let baseline = map.gather(Level::BASELINE, disc, response);
    let radiances = |density: DensityEstimate| [density.radiance].into_iter().chain(density.finer);
    for ((found, expected), baseline) in radiances(found).zip(radiances(expected)).zip(radiances(baseline)) {
        if expected.is_finite() {
            let error = (found - expected).abs();
            let most = expected * ROUNDING + f32::MIN_POSITIVE;
            assert!(error.cmple(most).all(), "{level:?} {disc:?}: {found:?}, brute force {expected:?}");
        }
        if baseline.is_finite() {
            let bits = |colour: Rgb| colour.to_array().map(f32::to_bits);
            assert_eq!(bits(found), bits(baseline), "{level:?} {disc:?}");
        }
    }
}
