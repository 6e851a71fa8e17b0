//! Limits of view-bound records on a floor on which thin legs stand in the sun: boundaries at walls,
//! comparison with neighbours, neighbour clamping. Pictures of this floor have too much noise to show that
//! one is missing; the records' light beside the legs has not.

use core::f32::consts::PI;
use glam::{Vec2, Vec3};
use halflight_core::Level;
use halflight_core::bsdf::All;
use halflight_core::bvh::Bvh;
use halflight_core::cache::irradiance::{GREATEST_DEVIATION, Metric, QueryPoint, Record, metric};
use halflight_core::cache::radiance::LobeSettings;
use halflight_core::light::{LightSampler, luminance};
use halflight_core::memory::{Arena, Buffer, Line};
use halflight_core::method::irradiance_cache::{CacheSettings, FILLED, IrradianceCaching};
use halflight_core::method::{Loop, PilotSize, RenderContext, RenderState, Round, Shard};
use halflight_core::transport::cached::placement::ProgressiveOrder;
use halflight_core::transport::cached::view::{ViewGathering, ViewPoint};
use halflight_core::transport::{Counters, PathIntegrator, PathSettings, UNLIMITED};
use halflight_tests::scenes::{TABLE_FLOOR, TABLE_LEG, TABLE_LEGS, metal, table_in_the_sun};

/// Picture along a side and allowed error of caches. Wide records, by ten times the usual error, need limits
/// most.
#[derive(Clone, Copy)]
struct Caches {
    size: u32,
    error: f32,
}

const WIDE: Caches = Caches { size: 48, error: 1e-3 };
const USUAL: Caches = Caches { size: 96, error: 1e-4 };

/// Seeds of the caches.
const SEEDS: core::ops::Range<u32> = 0..4;

/// Violations that remain among 600 records: lines beside a corner within a sector, and neighbours that no
/// comparison met. Measured: 15 and 0; without boundaries 741, without comparison 578.
const MOST_BEHIND: usize = 40;
const MOST_CONTRADICTED: usize = 18;

/// Points near a leg, at most so far in m, at which the light of records is half of the gathered light or
/// less, or twice of it or more. Measured at 649 points: 36 and 2; without boundaries 68 dark ones, without
/// comparison 26 bright ones.
const BESIDE: f32 = 0.005;
const MOST_DARK: usize = 50;
const MOST_BRIGHT: usize = 10;

/// Pixels along the side of the picture that has these points, and samples of each half.
const FINE: u32 = 192;
const SAMPLES: usize = 2;

/// First number of gathers that have other rays than those of records.
const OTHER_RAYS: u32 = 1 << 24;

/// Fraction of a leg's width that a line between a record and a valid point has to keep out of: a boundary
/// has sectors, and the ray of a sector passes a corner beside it.
const CORE: f32 = 0.8;

/// Standard deviations of noise that excuse a contradiction, and variance of a gradient over that of the
/// value and the mean of 1/t²: as in the cache.
const NOISE_DEVIATIONS: f32 = 3.0;
const GRADIENT_VARIANCE: f32 = 16.0;

/// Rounding of radii.
const ROUNDING: f32 = 1.001;

/// Filled caches of one seed, paths of a fine picture, and scratch memory for gathers.
fn with_filled<T>(
    Caches { size, error }: Caches,
    seed: u32,
    work: impl FnOnce(&IrradianceCaching<All>, &PathIntegrator<All>, &mut Arena) -> T,
) -> T {
    let buffers = table_in_the_sun(metal(0.1f32.sqrt()));
    let scene = buffers.scene();
    let mut lines = vec![Line([0; 64]); 1 << 19];
    let mut arena = Arena::over(&mut lines);
    let bvh = Bvh::build(&scene.mesh, &mut arena).unwrap();
    let lights = LightSampler::build(&scene, &mut arena).unwrap();
    let mut state = RenderState::new(size, size, Shard::WHOLE, &mut arena).unwrap();
    let settings = PathSettings { width: size, height: size, seed, max_depth: UNLIMITED };
    let context = RenderContext {
        scene: &scene,
        bvh,
        lights,
        settings,
        level: Level::BASELINE,
        pilots: PilotSize::USUAL,
    };
    let cache = CacheSettings {
        records: None,
        metric: Metric::Halflight,
        error,
        strata: 16,
        fewest: 1000,
        reserve: 0,
        widens: true,
        lobes: Some(LobeSettings::default()),
        picture: None,
    };
    let scratch = IrradianceCaching::<All>::scratch(&cache).bytes();
    let mut of_gathers = Arena::new(arena.slice(scratch).unwrap());
    let mut executor = Loop::new(arena.slice(scratch).unwrap());
    let mut buffer = Buffer::new(arena.slice(arena.available()).unwrap());
    let mut method = IrradianceCaching::<All>::new(&context, &cache, &mut buffer).unwrap();
    let mut round = Round { executor: &mut executor, state: &mut state, target: 1, step: 1 };
    for number in 0..FILLED {
        assert!(method.fill(number, None, &mut round).unwrap());
    }
    let fine = RenderContext { settings: PathSettings { width: FINE, height: FINE, ..settings }, ..context };
    work(&method, &fine.integrator(), &mut of_gathers)
}

/// Records of the even and of the odd samples.
fn records(seed: u32) -> [Vec<Record>; 2] {
    with_filled(WIDE, seed, |method, _, _| method.views().unwrap().map(|views| views.records().to_vec()))
}

/// Light of records at points beside the legs, over that of a gather there.
fn light_beside_legs(seed: u32) -> Vec<f32> {
    let order = ProgressiveOrder::new(FINE, FINE, 1);
    with_filled(USUAL, seed, |method, paths, scratch| {
        let (mut ratios, mut counters) = (Vec::new(), Counters::default());
        for (half, (views, irradiance)) in (0..).zip(method.views().unwrap().iter().zip(method.caches())) {
            let integrator = paths.with_caches([irradiance; 2]);
            for sample in (half..).step_by(2).take(SAMPLES) {
                let mut points = vec![ViewPoint::NONE; order.len() as usize];
                paths.view_points((&order, sample), 0, None, &mut points, &mut counters);
                let metric = metric::Settings::new(Metric::Halflight, 1.0);
                let gathering =
                    ViewGathering { order: (order, sample), metric, least_pixels: 0.5, irradiance };
                for (i, place) in (OTHER_RAYS..).zip(&points).filter(|(_, place)| is_beside_leg(place)) {
                    let query = QueryPoint::open(place.point.position(), place.point.normal());
                    if let Some(found) = views.at(&query, &place.kind) {
                        let exact = integrator.gather_view(place, i, &gathering, scratch, &mut counters);
                        let exact = luminance(exact.unwrap().unwrap().irradiance.into());
                        ratios.push(luminance(found) / exact);
                    }
                }
            }
        }
        ratios
    })
}

/// True if the point is on the floor near a leg.
fn is_beside_leg(place: &ViewPoint) -> bool {
    let at = place.point.position();
    let near = |&[x, z]: &[f32; 2]| (at.x - x).abs().max((at.z - z).abs()) < 0.5 * TABLE_LEG + BESIDE;
    place.point.is_some() && (at.y - TABLE_FLOOR).abs() < 1e-4 && TABLE_LEGS.iter().any(near)
}

/// True if the line from `a` to `b` meets the square of half side `half` around `centre`.
fn meets(a: Vec2, b: Vec2, centre: Vec2, half: f32) -> bool {
    let (from, along) = (a - centre, b - a);
    let (mut first, mut last) = (0.0f32, 1.0f32);
    for axis in 0..2 {
        let [s, t] = [-half, half].map(|side| (side - from[axis]) / along[axis]);
        (first, last) = (first.max(s.min(t)), last.min(s.max(t)));
    }
    first < last
}

/// Radius at which a relative curvature has the allowed error.
fn radius(allowed: f32, curvature: f32) -> f32 {
    (4.0 / PI * allowed / curvature).powf(0.25)
}

/// True if `other` contradicts what `record` extrapolates to it, and `record` is not limited for that.
fn is_contradicted(record: &Record, other: &Record, least_cos: f32) -> bool {
    let (position, normal) = (Vec3::from(other.position), Vec3::from(other.normal));
    let point = QueryPoint { position, normal, within: other.farthest() };
    let Some((extrapolated, _)) = record.at(&point, least_cos) else { return false };
    let [here, there] = [record, other].map(|record| luminance(record.irradiance.into()));
    let square = position.distance_squared(record.position.into());
    let gradient = GRADIENT_VARIANCE * record.mean_square_inverse_distance * square;
    let variance = there * there * other.noise + here * here * record.noise * (1.0 + gradient);
    let excess = (there - luminance(extrapolated)).abs() - NOISE_DEVIATIONS * variance.sqrt();
    let curvature = 2.0 * excess / (square * here.max(there));
    excess > 0.0 && record.radii[0] > ROUNDING * radius(record.allowed, curvature).max(record.least)
}

/// Numbers of violations: points that a record behind a leg serves, contradicted records, and records with
/// radii larger than those of a neighbour and the distance to it.
fn violations(records: &[Record]) -> [usize; 3] {
    let least_cos = GREATEST_DEVIATION.cos();
    let flat = |position: [f32; 3]| Vec2::new(position[0], position[2]);
    let behind = TABLE_LEGS.iter().map(|&[x, z]| {
        let leg = Vec2::new(x, z);
        let around = (0..64).map(|i| leg + Vec2::from_angle(i as f32 / 32.0 * PI) * TABLE_LEG);
        let served_from_behind = |at: Vec2| {
            let point = QueryPoint::open(Vec3::new(at.x, TABLE_FLOOR, at.y), Vec3::Y);
            let is_behind = |record: &&Record| {
                meets(flat(record.position), at, leg, 0.5 * CORE * TABLE_LEG)
                    && record.at(&point, least_cos).is_some()
            };
            records.iter().filter(is_behind).count()
        };
        around.map(served_from_behind).sum::<usize>()
    });
    let pairs = || records.iter().flat_map(|a| records.iter().map(move |b| (a, b)));
    let contradicted = pairs().filter(|(a, b)| a != b && is_contradicted(a, b, least_cos));
    let is_wide = |(a, b): &(&Record, &Record)| {
        let distance = Vec3::from(a.position).distance(b.position.into());
        a.radii[0] > ROUNDING * (b.radii[0] + distance)
    };
    [behind.sum(), contradicted.count(), pairs().filter(is_wide).count()]
}

#[test]
fn records_beside_the_legs_of_a_table_are_limited_by_walls_and_by_each_other() {
    let caches: Vec<_> = SEEDS.flat_map(records).collect();
    assert!(caches.iter().all(|records| records.len() > 40));
    let found = caches.iter().map(|records| violations(records));
    let [behind, contradicted, wide] = found.fold([0; 3], |sum, found| [0, 1, 2].map(|i| sum[i] + found[i]));
    assert!(
        behind <= MOST_BEHIND && contradicted <= MOST_CONTRADICTED && wide == 0,
        "{behind} behind legs, {contradicted} contradicted, {wide} too wide"
    );
}

#[test]
fn the_foot_of_a_leg_in_the_sun_has_the_light_that_is_gathered_there() {
    let ratios: Vec<f32> = SEEDS.flat_map(light_beside_legs).collect();
    assert!(ratios.len() > 500, "{} points", ratios.len());
    let dark = ratios.iter().filter(|ratio| **ratio <= 0.5).count();
    let bright = ratios.iter().filter(|ratio| **ratio >= 2.0).count();
    assert!(dark <= MOST_DARK && bright <= MOST_BRIGHT, "{dark} dark, {bright} bright");
}
