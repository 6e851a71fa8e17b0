//! Kernels on every level against the same kernels by single f32 lanes, to the bit in the lanes that exist.

use super::bsdf::BsdfBlock;
use super::camera::CameraRays;
use super::coat::{CoatBlock, CoatLight, CoatSamples, CoatSets};
use super::coat_apart::{ApartBlock, ApartLight};
use super::coat_tables::CoatTables;
use super::direct::{Direct, LightBlock, ShadowBlock};
use super::emitter::{EmitterBlock, EmitterSamples};
use super::numbers::{mix, unit_float};
use super::rough::{Rough, RoughBlock};
use super::scatter::{NextBlock, Scatter, ScatterBlock};
use super::sky::{SkyBlock, SkySamples};
use super::specular::{SpecularBlock, SpecularSamples};
use super::surface::{SurfaceBlock, Surfaces};
use super::texture::{MAX_SIZE, TextureBlock};
use super::{Row, Row3, at, put};
use crate::Level;
use crate::lanes::dot;

/// Random numbers in [0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 += 1;
        unit_float((mix(self.0) >> 32) as u32)
    }

    fn row(&mut self, from: f32, to: f32) -> Row {
        core::array::from_fn(|_| from + (to - from) * self.next())
    }

    fn vectors(&mut self) -> Row3 {
        [self.row(-1.0, 1.0), self.row(-1.0, 1.0), self.row(-1.0, 1.0)]
    }

    fn directions(&mut self) -> Row3 {
        let mut rows = self.vectors();
        for i in 0..16 {
            let v = at(&rows, i);
            let length = libm::sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).max(1e-3);
            put(&mut rows, i, v.map(|x| x / length));
        }
        // Axis-aligned in some lanes, with zeros of both signs.
        put(&mut rows, 3, [0.0, -0.0, -1.0]);
        put(&mut rows, 4, [-0.0, 1.0, -0.0]);
        rows
    }

    fn bits(&mut self) -> u32 {
        (self.next() * 65536.0) as u32
    }
}

/// Result of a kernel at `level`, written to `out`.
fn by<T>(level: Level, mut out: T, compute: impl Fn(Level, &mut T)) -> T {
    compute(level, &mut out);
    out
}

fn bits3(rows: &Row3, i: usize) -> [u32; 3] {
    at(rows, i).map(f32::to_bits)
}

/// Indices of the bits of `set`.
fn lanes(set: u32) -> impl Iterator<Item = usize> {
    (0..16).filter(move |i| set >> i & 1 == 1)
}

/// Emitters of all shapes, near and far.
fn emitters(random: &mut Random) -> EmitterBlock {
    let mut lights = EmitterBlock::EMPTY;
    lights.origin = random.vectors();
    lights.edges = [random.vectors(), random.vectors()];
    lights.triangles = random.bits();
    lights.rectangles = random.bits() & !lights.triangles;
    lights.two_sided = random.bits();
    for i in 0..16 {
        let e0 = at(&lights.edges[0], i);
        let mut e1 = at(&lights.edges[1], i);
        if lights.rectangles >> i & 1 == 1 {
            // Perpendicular to the first edge.
            let along = (e0[0] * e1[0] + e0[1] * e1[1] + e0[2] * e1[2])
                / (e0[0] * e0[0] + e0[1] * e0[1] + e0[2] * e0[2]).max(1e-6);
            (0..3).for_each(|k| e1[k] -= along * e0[k]);
            put(&mut lights.edges[1], i, e1);
        }
        let across =
            [e0[1] * e1[2] - e0[2] * e1[1], e0[2] * e1[0] - e0[0] * e1[2], e0[0] * e1[1] - e0[1] * e1[0]];
        let area = libm::sqrtf(across[0] * across[0] + across[1] * across[1] + across[2] * across[2]);
        put(&mut lights.normal, i, across.map(|x| x / area.max(1e-6)));
        lights.area[i] = area;
    }
    lights.near = random.row(0.0, 8.0);
    lights
}

#[test]
fn surface_points_are_the_same_on_every_level() {
    let mut random = Random(1);
    for round in 0..400 {
        let corners = [random.vectors(), random.vectors(), random.vectors()];
        let normals = [random.directions(), random.directions(), random.directions()];
        let weights = [random.row(0.0, 0.5), random.row(0.0, 0.5)];
        let directions = random.directions();
        let rays = core::array::from_fn(|i| {
            let [x, y, z] = at(&directions, i);
            [0.0, 0.0, 0.0, 1.0, x, y, z, 0.0]
        });
        let normals = (round % 2 == 0).then_some(&normals);
        let surfaces = Surfaces { corners: &corners, normals, weights: &weights, rays: &rays };
        let wanted = by(Level::SCALAR, SurfaceBlock::EMPTY, |level, block| surfaces.compute(level, block));
        for level in Level::detect().and_below() {
            let found = by(level, SurfaceBlock::EMPTY, |level, block| surfaces.compute(level, block));
            assert_eq!((found.front, found.regular), (wanted.front, wanted.regular), "{level:?}");
            for i in lanes(wanted.regular) {
                let all = |block: &super::surface::SurfaceBlock| {
                    let [t, b, n] = &block.frame;
                    let rows = [&block.position, &block.geometric_normal, t, b, n, &block.wo];
                    (rows.map(|rows| bits3(rows, i)), block.error[i].to_bits())
                };
                assert_eq!(all(&found), all(&wanted), "{level:?} {round} {i}");
            }
        }
    }
}

#[test]
fn light_samples_are_the_same_on_every_level() {
    let mut random = Random(2);
    let mut count = 0;
    for _ in 0..400 {
        let lights = emitters(&mut random);
        let (from, normal) = (random.vectors(), random.directions());
        let u = [random.row(0.0, 1.0), random.row(0.0, 1.0)];
        let probability = random.row(0.1, 1.0);
        let active = random.bits();
        let samples = EmitterSamples {
            lights: &lights,
            from: &from,
            normal: &normal,
            u: &u,
            probability: &probability,
            active,
        };
        let wanted = samples.compute(Level::SCALAR);
        count += wanted.exists.count_ones();
        for level in Level::detect().and_below() {
            let found = samples.compute(level);
            assert_eq!(found.exists, wanted.exists, "{level:?}");
            for i in lanes(wanted.exists) {
                let all = |block: &super::emitter::EmitterSampleBlock| {
                    let flags = [block.front, block.second].map(|bits| bits >> i & 1);
                    (bits3(&block.end, i), bits3(&block.direction, i), block.pdf[i].to_bits(), flags)
                };
                assert_eq!(all(&found), all(&wanted), "{level:?}");
            }
        }
    }
    assert!(count > 1000, "{count} samples");
}

#[test]
fn scattering_is_the_same_on_every_level() {
    let mut random = Random(3);
    let (mut shadows, mut rays) = (0, 0);
    for _ in 0..400 {
        let surface = seen(&mut random);
        let diffuse = random.bits();
        let metal = random.bits() & !diffuse;
        let reflectance = [random.row(0.0, 1.0), random.row(0.0, 1.0), random.row(0.0, 1.0)];
        let bsdf = BsdfBlock { reflectance, alpha: random.row(0.01, 1.0), diffuse, metal };
        let light = LightBlock {
            direction: random.directions(),
            end: random.vectors(),
            pdf: random.row(0.01, 4.0),
            radiance: [random.row(0.0, 9.0), random.row(0.0, 9.0), random.row(0.0, 9.0)],
            exists: random.bits() & surface.regular,
            bounded: random.bits(),
            area: random.bits(),
            alone: random.bits() & random.bits(),
            balance: random.bits(),
        };
        let (value, pdf, throughput) = (random.directions(), random.row(0.0, 1.0), random.directions());
        let (each, factor) = (random.row(0.25, 1.0), [random.row(0.0, 1.0); 3]);
        let direct = Direct {
            surface: &surface,
            bsdf: &bsdf,
            light: &light,
            value: &value,
            pdf: &pdf,
            each: &each,
            throughput: &throughput,
        };
        let given = given(&mut random);
        let u = [random.row(0.0, 1.0), random.row(0.0, 1.0)];
        let (roulette, most, eta_squared) =
            (random.row(0.0, 1.0), random.row(0.9, 1.0), random.row(0.5, 2.0));
        let scatter = Scatter {
            surface: &surface,
            bsdf: &bsdf,
            given: &given,
            u: &u,
            roulette: &roulette,
            most: &most,
            throughput: &throughput,
            factor: &factor,
            eta_squared: &eta_squared,
            active: random.bits() & surface.regular,
            certain: random.bits() & random.bits(),
        };
        let lit = by(Level::SCALAR, ShadowBlock::EMPTY, |level, block| direct.compute(level, block));
        let reached = by(Level::SCALAR, ShadowBlock::EMPTY, |level, block| direct.reach(level, block));
        let next = by(Level::SCALAR, NextBlock::EMPTY, |level, block| scatter.compute(level, block));
        let samples = scatter.samples(Level::SCALAR);
        shadows += lit.exists.count_ones();
        rays += next.exists.count_ones();
        for level in Level::detect().and_below() {
            let found = by(level, ShadowBlock::EMPTY, |level, block| direct.reach(level, block));
            assert_eq!(found.exists, reached.exists, "{level:?}");
            for i in lanes(reached.exists) {
                assert_eq!(found.rays[i].map(f32::to_bits), lit.rays[i].map(f32::to_bits), "{level:?}");
                assert_eq!(found.contribution[i], reached.contribution[i], "{level:?}");
            }
            let (found, exists) = scatter.samples(level);
            assert_eq!(exists, samples.1, "{level:?}");
            for i in lanes(exists) {
                let of = |block: &ScatterBlock| {
                    (at(&block.direction, i), at(&block.weight, i), block.pdf[i], block.eta[i])
                };
                assert_eq!(of(&found), of(&samples.0), "{level:?}");
            }
            let found = by(level, ShadowBlock::EMPTY, |level, block| direct.compute(level, block));
            assert_eq!(found.exists, lit.exists, "{level:?}");
            for i in lanes(lit.exists) {
                assert_eq!(found.rays[i].map(f32::to_bits), lit.rays[i].map(f32::to_bits), "{level:?}");
                let contributions = [found.contribution[i], lit.contribution[i]];
                assert_eq!(contributions[0], contributions[1], "{level:?}");
            }
            let found = by(level, NextBlock::EMPTY, |level, block| scatter.compute(level, block));
            assert_eq!(found.exists, next.exists, "{level:?}");
            for i in lanes(next.exists) {
                assert_eq!(found.rays[i].map(f32::to_bits), next.rays[i].map(f32::to_bits), "{level:?}");
                assert_eq!(found.states[i], next.states[i], "{level:?}");
                assert_eq!(found.normals[i], next.normals[i], "{level:?}");
                assert_eq!(at(&found.local, i), at(&next.local, i), "{level:?}");
            }
        }
    }
    assert!(shadows > 500 && rays > 500, "{shadows} shadow rays, {rays} rays");
}

/// Seen surfaces without normals.
fn seen(random: &mut Random) -> SurfaceBlock {
    let corners = [random.vectors(), random.vectors(), random.vectors()];
    let weights = [random.row(0.0, 0.5), random.row(0.0, 0.5)];
    let directions = random.directions();
    let views = core::array::from_fn(|i| {
        let [x, y, z] = at(&directions, i);
        [0.0, 0.0, 0.0, 1.0, x, y, z, 0.0]
    });
    let surfaces = Surfaces { corners: &corners, normals: None, weights: &weights, rays: &views };
    by(Level::SCALAR, SurfaceBlock::EMPTY, |level, block| surfaces.compute(level, block))
}

/// Coats of both kinds, rough and smooth, of which a part has no base.
fn coats(random: &mut Random) -> CoatBlock {
    let exists = random.bits();
    let mut coats = CoatBlock {
        base: [random.row(0.0, 1.0), random.row(0.0, 1.0), random.row(0.0, 1.0)],
        tint: [random.row(0.0, 1.0), random.row(0.0, 1.0), random.row(0.0, 1.0)],
        metal: [random.row(0.0, 1.0), random.row(0.0, 1.0), random.row(0.0, 1.0)],
        metallic: random.row(0.0, 1.0),
        alpha: random.row(-0.3, 1.0).map(|alpha| if alpha < 1e-4 { 0.0 } else { alpha }),
        eta: random.row(1.0, 12.0),
        mean: [random.row(0.0, 1.0), random.row(0.0, 1.0), random.row(0.0, 1.0)],
        base_weight: random.row(-0.5, 1.0).map(|weight| weight.max(0.0)),
        exists,
        apart: exists & random.bits(),
        dielectric: exists & random.bits(),
        ..CoatBlock::EMPTY
    };
    (coats.eta[2], coats.alpha[5]) = (1.0, 1.0);
    put(&mut coats.base, 7, [0.0; 3]);
    coats
}

/// Samples before a kernel writes its own.
fn given(random: &mut Random) -> ScatterBlock {
    ScatterBlock {
        direction: random.directions(),
        weight: random.vectors(),
        pdf: random.row(0.0, 1.0),
        eta: random.row(0.7, 1.5),
    }
}

/// Asserts that samples agree in the lanes of `set`, and that those beyond `written` are `before`.
fn check_samples(
    found: &ScatterBlock,
    wanted: &ScatterBlock,
    before: &ScatterBlock,
    [set, written]: [u32; 2],
) {
    let all = |block: &ScatterBlock, i: usize| {
        let vectors = [bits3(&block.direction, i), bits3(&block.weight, i)];
        (vectors, block.pdf[i].to_bits(), block.eta[i].to_bits())
    };
    lanes(set).for_each(|i| assert_eq!(all(found, i), all(wanted, i), "{i}"));
    lanes(!written & 0xffff).for_each(|i| assert_eq!(all(found, i), all(before, i), "{i}"));
}

#[test]
fn coats_are_the_same_on_every_level() {
    let mut random = Random(5);
    let tables: CoatTables = core::array::from_fn(|_| (random.next() * 4000.0) as i16 - 2000);
    let mut counts = [0; 3];
    for _ in 0..400 {
        let surface = seen(&mut random);
        let mut coats = coats(&mut random);
        let dark = coats.clone();
        coats.see(Level::SCALAR, &surface, &tables);
        let direction = random.directions();
        let (value, pdf, before) = (random.vectors(), random.row(0.0, 1.0), given(&mut random));
        let light = CoatLight { surface: &surface, coats: &coats, tables: &tables, direction: &direction };
        let u = [random.row(0.0, 1.0), random.row(0.0, 1.0)];
        let lobe = random.row(0.0, 1.0);
        let samples = CoatSamples { surface: &surface, coats: &coats, tables: &tables, u: &u, lobe: &lobe };
        let (mut lit, mut wanted) = ((value, pdf), before.clone());
        light.compute(Level::SCALAR, &mut lit.0, &mut lit.1);
        let sets = samples.compute(Level::SCALAR, &mut wanted);
        let set = coats.exists & surface.regular;
        counts[0] += lanes(set).filter(|&i| lit.1[i] > 0.0).count();
        counts[1] += (sets.exists & set).count_ones() as usize;
        counts[2] += (sets.delta & set).count_ones() as usize;
        for level in Level::detect().and_below() {
            let mut found = dark.clone();
            found.see(level, &surface, &tables);
            for i in lanes(set) {
                let all =
                    |coats: &CoatBlock| (bits3(&coats.transmittance, i), coats.probability[i].to_bits());
                assert_eq!(all(&found), all(&coats), "{level:?} {i}");
            }
            let mut found = (value, pdf);
            light.compute(level, &mut found.0, &mut found.1);
            for i in lanes(set | !coats.exists & 0xffff) {
                let all = |of: &(Row3, Row)| (bits3(&of.0, i), of.1[i].to_bits());
                assert_eq!(all(&found), all(&lit), "{level:?} {i}");
            }
            let mut found = before.clone();
            let found_sets = samples.compute(level, &mut found);
            let all = |sets: &CoatSets| [sets.exists, sets.delta].map(|bits| bits & set);
            assert_eq!(all(&found_sets), all(&sets), "{level:?}");
            assert_eq!((found_sets.exists | found_sets.delta) & !coats.exists, 0, "{level:?}");
            check_samples(&found, &wanted, &before, [sets.exists & set, coats.exists]);
        }
    }
    assert!(counts.iter().all(|&count| count > 200), "{counts:?}");
}

#[test]
fn coats_apart_are_the_same_on_every_level() {
    let mut random = Random(15);
    let tables: CoatTables = core::array::from_fn(|_| (random.next() * 4000.0) as i16 - 2000);
    let mut counts = [0; 4];
    for _ in 0..400 {
        let (surface, mut coats) = (seen(&mut random), coats(&mut random));
        coats.see(Level::SCALAR, &surface, &tables);
        let light = LightBlock {
            direction: random.directions(),
            pdf: random.row(0.01, 2.0),
            radiance: random.vectors(),
            alone: random.bits(),
            balance: random.bits(),
            ..LightBlock::EMPTY
        };
        let (each, throughput, before) = (random.row(0.1, 1.0), random.vectors(), given(&mut random));
        let (u, lobe) = ([random.row(0.0, 1.0), random.row(0.0, 1.0)], random.row(0.0, 1.0));
        let (surface, coats, tables, supplied) = (&surface, &coats, &tables, random.bits());
        let (each, throughput) = (&each, &throughput);
        let light = ApartLight { surface, coats, tables, light: &light, each, throughput, supplied };
        let samples = CoatSamples { surface, coats, tables, u: &u, lobe: &lobe };
        let (mut lit, mut wanted) = (ApartBlock::EMPTY, before.clone());
        light.compute(Level::SCALAR, &mut lit);
        let sets = samples.compute_apart(Level::SCALAR, &mut wanted);
        let set = coats.apart & surface.regular;
        counts[0] += lanes(set).filter(|&i| lit.contribution[0][i] != 0.0).count();
        for (count, set) in counts[1..].iter_mut().zip([sets.exists, sets.delta, sets.coat & !sets.delta]) {
            *count += (set & surface.regular).count_ones() as usize;
        }
        for level in Level::detect().and_below() {
            let found = by(level, ApartBlock::EMPTY, |level, block| light.compute(level, block));
            for i in lanes(set) {
                let all = |of: &ApartBlock| [&of.value, &of.contribution, &of.base].map(|row| bits3(row, i));
                assert_eq!(all(&found), all(&lit), "{level:?} {i}");
            }
            let mut found = before.clone();
            let found_sets = samples.compute_apart(level, &mut found);
            let all = |sets: &CoatSets| [sets.exists, sets.delta, sets.coat].map(|bits| bits & set);
            assert_eq!(all(&found_sets), all(&sets), "{level:?}");
            assert_eq!((found_sets.exists | found_sets.delta | found_sets.coat) & !coats.apart, 0);
            check_samples(&found, &wanted, &before, [sets.exists & set, coats.apart]);
        }
    }
    assert!(counts.iter().all(|&count| count > 200), "{counts:?}");
}

#[test]
fn smooth_surfaces_are_the_same_on_every_level() {
    let mut random = Random(6);
    let mut counts = [0; 3];
    for _ in 0..400 {
        let (surface, before) = (seen(&mut random), given(&mut random));
        let (exists, dielectric) = (random.bits(), random.bits());
        let metal = random.bits() & !dielectric;
        let color = [random.row(0.0, 1.0), random.row(0.0, 1.0), random.row(0.0, 1.0)];
        let mut specular = SpecularBlock { color, eta: random.row(0.4, 2.0), exists, metal, dielectric };
        specular.eta[3] = 1.0;
        put(&mut specular.color, 9, [0.0; 3]);
        let lobe = random.row(0.0, 1.0);
        let samples = SpecularSamples { surface: &surface, specular: &specular, lobe: &lobe };
        let mut wanted = before.clone();
        let set = samples.compute(Level::SCALAR, &mut wanted) & surface.regular;
        counts[0] += (set & !dielectric).count_ones();
        let refracted = lanes(set & dielectric).filter(|&i| wanted.direction[2][i] < 0.0).count() as u32;
        counts[1] += refracted;
        counts[2] += (set & dielectric).count_ones() - refracted;
        for level in Level::detect().and_below() {
            let mut found = before.clone();
            assert_eq!(samples.compute(level, &mut found) & surface.regular, set, "{level:?}");
            check_samples(&found, &wanted, &before, [set, exists]);
        }
    }
    assert!(counts.iter().all(|&count| count > 200), "{counts:?}");
}

#[test]
fn environment_samples_are_the_same_on_every_level() {
    let mut random = Random(7);
    let mut counts = [0; 2];
    for round in 0..400 {
        let mut sky = SkyBlock {
            at: [random.row(0.0, 1.0), random.row(0.0, 0.5)],
            density: random.row(0.0, 4.0),
            factors: [random.row(0.5, 2.0), random.row(0.1, 1.0)],
            normal: random.directions(),
        };
        // The pole of the map, a black cell, and all directions.
        (sky.at[1][1], sky.density[2]) = (0.0, 0.0);
        put(&mut sky.normal, 5, [0.0; 3]);
        let turned = at(&random.directions(), 0);
        let to_world = (round % 2 == 0).then_some([turned, [0.0, 1.0, 0.0], [-0.0, 0.6, 0.8]]);
        let samples = SkySamples { sky: &sky, to_world, active: random.bits() };
        let before = (random.vectors(), random.row(0.0, 1.0));
        let mut wanted = before;
        let set = samples.compute(Level::SCALAR, &mut wanted.0, &mut wanted.1);
        counts[round % 2] += set.count_ones();
        for level in Level::detect().and_below() {
            let mut found = before;
            assert_eq!(samples.compute(level, &mut found.0, &mut found.1), set, "{level:?}");
            let bits = |(direction, pdf): &(Row3, Row)| {
                (direction.map(|r| r.map(f32::to_bits)), pdf.map(f32::to_bits))
            };
            assert_eq!(bits(&found), bits(&wanted), "{level:?}");
        }
    }
    assert!(counts.iter().all(|&count| count > 1000), "{counts:?}");
}

#[test]
fn texture_look_ups_are_the_same_on_every_level() {
    let mut random = Random(8);
    for round in 0..400 {
        let far = [2.0, 100.0, 1e7][round % 3];
        let mut wanted = TextureBlock {
            at: [random.row(-far, far), random.row(-1.0, 2.0)],
            size: [random.row(1.0, 9.0).map(f32::floor), random.row(1.0, 5000.0).map(f32::floor)],
            clamps: random.bits(),
            texels: core::array::from_fn(|_| random.vectors()),
            ..TextureBlock::EMPTY
        };
        let wild = [f32::NAN, f32::INFINITY, -1e30, 8_388_607.5, -4_194_304.5, -1e-9, -0.0, 1.0 - 1e-7];
        wanted.at[0][..8].copy_from_slice(&wild);
        (wanted.size[0][5], wanted.size[1][6]) = (MAX_SIZE as f32, 1.0);
        let given = wanted.clone();
        wanted.surround(Level::SCALAR);
        let mut mixture = [[0.0; 16]; 3];
        wanted.mix(Level::SCALAR, &mut mixture);
        for i in 0..16 {
            for axis in 0..2 {
                let (size, weight) = (wanted.size[axis][i], wanted.weight[axis][i]);
                let (first, second) = (wanted.first[axis][i], wanted.second[axis][i]);
                let next = if first + 1.0 < size { first + 1.0 } else { 0.0 };
                let clamps = wanted.clamps >> i & 1 == 1;
                assert!(first >= 0.0 && first < size && first.fract() == 0.0, "{first} of {size}");
                assert_eq!(second, if clamps { (first + 1.0).min(size - 1.0) } else { next });
                assert!((0.0..=1.0).contains(&weight), "{weight}");
            }
        }
        for level in Level::detect().and_below() {
            let mut found = given.clone();
            found.surround(level);
            let bits = |rows: [[Row; 2]; 3]| rows.map(|rows| rows.map(|row| row.map(f32::to_bits)));
            let places = |block: &TextureBlock| bits([block.first, block.second, block.weight]);
            assert_eq!(places(&found), places(&wanted), "{level:?}");
            let mut mixed = [[0.0; 16]; 3];
            found.mix(level, &mut mixed);
            assert_eq!(mixed.map(|r| r.map(f32::to_bits)), mixture.map(|r| r.map(f32::to_bits)), "{level:?}");
        }
    }
}

#[test]
fn camera_rays_are_the_same_on_every_level() {
    let mut random = Random(4);
    for _ in 0..100 {
        let raster = [random.row(0.0, 640.0), random.row(0.0, 480.0)];
        let axes = [random.directions(), random.directions(), random.directions()]
            .map(|d| [d[0][0], d[1][0], d[2][0]]);
        let rays =
            CameraRays { eye: [1.0, -2.0, 3.0], axes, pixel: 0.002, half: [320.0, 240.0], raster: &raster };
        let wanted = by(Level::SCALAR, [[0.0; 8]; 16], |level, out| rays.compute(level, out));
        for level in Level::detect().and_below() {
            let found = by(level, [[0.0; 8]; 16], |level, out| rays.compute(level, out));
            assert_eq!(found, wanted, "{level:?}");
        }
    }
}

#[test]
fn rough_dielectrics_are_the_same_on_every_level() {
    let mut random = Random(11);
    let (mut lit, mut sampled) = ([0; 2], 0);
    for _ in 0..400 {
        let surface = seen(&mut random);
        let rough = RoughBlock {
            tint: [random.row(0.0, 1.0), random.row(0.0, 1.0), random.row(0.0, 1.0)],
            eta: random.row(0.4, 2.5),
            alpha: random.row(1e-3, 1.0),
            exists: random.bits() & surface.regular,
        };
        let (rough, direction) = (Rough { surface: &surface, rough: &rough }, random.directions());
        let (value, pdf, before) = (random.vectors(), random.row(0.0, 1.0), given(&mut random));
        let (u, lobe) = ([random.row(0.0, 1.0), random.row(0.0, 1.0)], random.row(0.0, 1.0));
        let (mut wanted, mut samples) = ((value, pdf), before.clone());
        rough.light(Level::SCALAR, &direction, &mut wanted.0, &mut wanted.1);
        let set = rough.sample(Level::SCALAR, (&u, &lobe), &mut samples);
        for i in lanes(rough.rough.exists).filter(|&i| wanted.1[i] > 0.0) {
            lit[usize::from(dot(at(&direction, i), at(&surface.frame[2], i)) < 0.0)] += 1;
        }
        sampled += set.count_ones();
        for level in Level::detect().and_below() {
            let (mut found, mut out) = ((value, pdf), before.clone());
            rough.light(level, &direction, &mut found.0, &mut found.1);
            assert_eq!(found, wanted, "{level:?}");
            assert_eq!(rough.sample(level, (&u, &lobe), &mut out), set, "{level:?}");
            check_samples(&out, &samples, &before, [set, rough.rough.exists]);
        }
    }
    assert!(lit[0] > 500 && lit[1] > 500 && sampled > 1500, "{lit:?} lit, {sampled} samples");
}
