//! Shading kernels at every level against single f32 lanes, in the lanes that exist, to the bit.

use crate::numbers::coordinate;
use arbitrary::{Result, Unstructured};
use halflight_simd::Level;
use halflight_simd::kernels::shade::bsdf::BsdfBlock;
use halflight_simd::kernels::shade::camera::CameraRays;
use halflight_simd::kernels::shade::choice::{ChoiceBlock, Choices};
use halflight_simd::kernels::shade::coat::{CoatBlock, CoatLight, CoatSamples, CoatSets};
use halflight_simd::kernels::shade::coat_apart::{ApartBlock, ApartLight};
use halflight_simd::kernels::shade::coat_tables::CoatTables;
use halflight_simd::kernels::shade::direct::{Direct, LightBlock, ShadowBlock};
use halflight_simd::kernels::shade::emitter::{EmitterBlock, EmitterSamples};
use halflight_simd::kernels::shade::numbers::{Offsets, SampleBlock, VertexNumbers, pair, place_key, single};
use halflight_simd::kernels::shade::rough::{Rough, RoughBlock};
use halflight_simd::kernels::shade::scatter::{NextBlock, Scatter, ScatterBlock};
use halflight_simd::kernels::shade::sky::{SkyBlock, SkySamples};
use halflight_simd::kernels::shade::specular::{SpecularBlock, SpecularSamples};
use halflight_simd::kernels::shade::surface::{SurfaceBlock, Surfaces};
use halflight_simd::kernels::shade::texture::TextureBlock;
use halflight_simd::kernels::shade::{Row, Row3};

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

/// Numbers of the input, repeated in other orders for rows beyond its end.
struct Rows {
    numbers: [f32; 64],
    next: usize,
}

impl Rows {
    fn row(&mut self) -> Row {
        self.next += 1;
        core::array::from_fn(|i| self.numbers[(self.next * 7 + i * (2 * self.next + 1)) % 64])
    }

    fn unit(&mut self) -> Row {
        self.row().map(|x| if (0.0..1.0).contains(&x) { x } else { 0.5 })
    }

    fn vectors(&mut self) -> Row3 {
        [self.row(), self.row(), self.row()]
    }
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// Asserts that both rows agree in the lanes of `set`.
fn check(what: &str, set: u32, a: &[Row], b: &[Row]) {
    for (a, b) in a.iter().zip(b) {
        for i in (0..16).filter(|i| set >> i & 1 == 1) {
            assert!(same(a[i], b[i]), "{what}, lane {i}: {} and {}", a[i], b[i]);
        }
    }
}

/// Asserts that both records agree in the lanes of `set`.
fn check_records<const N: usize>(what: &str, set: u32, a: &[[f32; N]; 16], b: &[[f32; N]; 16]) {
    for i in (0..16).filter(|i| set >> i & 1 == 1) {
        assert!(a[i].iter().zip(&b[i]).all(|(&a, &b)| same(a, b)), "{what}, lane {i}: {:?} {:?}", a[i], b[i]);
    }
}

/// Result of a kernel at a level and by single lanes, written to copies of `empty`.
fn both<T: Clone>(level: Level, empty: T, compute: impl Fn(Level, &mut T)) -> [T; 2] {
    [level, Level::SCALAR].map(|level| {
        let mut out = empty.clone();
        compute(level, &mut out);
        out
    })
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let mut rows = Rows { numbers: [0.0; 64], next: 0 };
    for number in &mut rows.numbers {
        *number = coordinate(input)?;
    }
    let sets: [u16; 6] = input.arbitrary()?;
    let [active, triangles, two_sided, diffuse, metal, flags] = sets.map(u32::from);
    let corners = [rows.vectors(), rows.vectors(), rows.vectors()];
    let normals = [rows.vectors(), rows.vectors(), rows.vectors()];
    let weights = [rows.unit(), rows.unit()];
    let mut views = [[0.0; 8]; 16];
    views.as_flattened_mut().iter_mut().zip(rows.numbers.iter().cycle()).for_each(|(x, y)| *x = *y);
    let normals = (flags & 1 == 0).then_some(&normals);
    let surfaces = Surfaces { corners: &corners, normals, weights: &weights, rays: &views };
    let mut surface = SurfaceBlock::EMPTY;
    surfaces.compute(Level::SCALAR, &mut surface);
    let lights = EmitterBlock {
        origin: rows.vectors(),
        edges: [rows.vectors(), rows.vectors()],
        normal: rows.vectors(),
        area: rows.row(),
        near: rows.row(),
        triangles,
        rectangles: flags & !triangles,
        two_sided,
    };
    let (u, probability, side) = ([rows.unit(), rows.unit()], rows.unit(), rows.vectors());
    let emitters = EmitterSamples {
        lights: &lights,
        from: &surface.position,
        normal: &side,
        u: &u,
        probability: &probability,
        active,
    };
    let bsdf =
        BsdfBlock { reflectance: rows.vectors(), alpha: rows.unit(), diffuse, metal: metal & !diffuse };
    let light = LightBlock {
        direction: rows.vectors(),
        end: rows.vectors(),
        pdf: rows.row(),
        radiance: rows.vectors(),
        exists: active,
        bounded: triangles,
        area: two_sided,
        alone: flags,
        balance: metal,
    };
    let (value, pdf, throughput) = (rows.vectors(), rows.row(), rows.vectors());
    let (roulette, most, eta_squared) = (rows.unit(), rows.unit(), rows.row());
    let direct = Direct {
        surface: &surface,
        bsdf: &bsdf,
        light: &light,
        value: &value,
        pdf: &pdf,
        each: &eta_squared,
        throughput: &throughput,
    };
    let given =
        ScatterBlock { direction: rows.vectors(), weight: rows.vectors(), pdf: rows.row(), eta: rows.row() };
    let scatter = Scatter {
        surface: &surface,
        bsdf: &bsdf,
        given: &given,
        u: &u,
        roulette: &roulette,
        most: &most,
        throughput: &throughput,
        factor: &value,
        eta_squared: &eta_squared,
        active,
        certain: flags,
    };
    let mut samples = SampleBlock::EMPTY;
    for i in 0..16 {
        (samples.place[i], samples.index[i], samples.dimension[i]) =
            (input.arbitrary()?, input.arbitrary()?, input.arbitrary::<u32>()? >> 1);
    }
    let offsets = Offsets { light: 0, choice: 1, scatter: 2, roulette: 4 };
    let raster = [rows.row(), rows.row()];
    let camera = CameraRays {
        eye: [0.0; 3],
        axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
        pixel: probability[0],
        half: [320.0, 240.0],
        raster: &raster,
    };
    let coats = CoatBlock {
        base: rows.vectors(),
        tint: rows.vectors(),
        metal: rows.vectors(),
        metallic: rows.row(),
        alpha: rows.unit(),
        eta: rows.row(),
        mean: rows.vectors(),
        base_weight: rows.unit(),
        exists: diffuse,
        apart: diffuse & two_sided,
        dielectric: metal,
        transmittance: rows.vectors(),
        probability: rows.unit(),
    };
    let specular = SpecularBlock {
        color: rows.vectors(),
        eta: rows.row(),
        exists: triangles,
        metal: two_sided & !metal,
        dielectric: metal,
    };
    check_coats(&mut rows, input.arbitrary()?, &surface, &coats, &specular);
    check_apart(&mut rows, [active, triangles], &surface, &coats);
    check_rough(&mut rows, &surface, two_sided);
    check_sky(&mut rows, active, flags & 2 == 0);
    check_textures(&mut rows, flags);
    check_choices(&mut rows);
    for level in Level::detect().and_below() {
        let [found, _] = both(level, SurfaceBlock::EMPTY, |level, block| surfaces.compute(level, block));
        assert_eq!(found.regular, surface.regular, "{level:?}");
        let set = surface.regular;
        check("position", set, &found.position, &surface.position);
        check("normal", set, &found.geometric_normal, &surface.geometric_normal);
        check("frame", set, found.frame.as_flattened(), surface.frame.as_flattened());
        check("viewer", set, &found.wo, &surface.wo);
        check("error", set, &[found.error], &[surface.error]);

        let (found, wanted) = (emitters.compute(level), emitters.compute(Level::SCALAR));
        assert_eq!(found.exists, wanted.exists, "{level:?}");
        check("end", wanted.exists, &found.end, &wanted.end);
        check("direction", wanted.exists, &found.direction, &wanted.direction);
        check("density", wanted.exists, &[found.pdf], &[wanted.pdf]);

        let [found, wanted] = both(level, ShadowBlock::EMPTY, |level, block| direct.compute(level, block));
        assert_eq!(found.exists, wanted.exists, "{level:?}");
        check_records("shadow ray", wanted.exists, &found.rays, &wanted.rays);
        check_records("contribution", wanted.exists, &found.contribution, &wanted.contribution);

        let [found, wanted] = both(level, ShadowBlock::EMPTY, |level, block| direct.reach(level, block));
        assert_eq!(found.exists, wanted.exists, "{level:?}");
        check_records("ray to a light", wanted.exists, &found.rays, &wanted.rays);
        check_records("value", wanted.exists, &found.contribution, &wanted.contribution);

        let ((found, exists), (wanted, set)) = (scatter.samples(level), scatter.samples(Level::SCALAR));
        assert_eq!(exists, set, "{level:?}");
        check("sampled direction", set, &found.direction, &wanted.direction);
        check("sampled weight", set, &found.weight, &wanted.weight);
        check("sampled density", set, &[found.pdf], &[wanted.pdf]);

        let [found, wanted] = both(level, NextBlock::EMPTY, |level, block| scatter.compute(level, block));
        assert_eq!(found.exists, wanted.exists, "{level:?}");
        check_records("ray", wanted.exists, &found.rays, &wanted.rays);
        check("local direction", wanted.exists, &found.local, &wanted.local);
        check_records("state", wanted.exists, &found.states, &wanted.states);

        let (mut found, mut lights) = (VertexNumbers::EMPTY, VertexNumbers::EMPTY);
        samples.vertices(level, offsets, true, &mut found);
        check_numbers(&samples, offsets, &found);
        samples.lights(level, offsets, &mut lights);
        assert_eq!((lights.light, lights.choice), (found.light, found.choice), "{level:?}");
        let [found, wanted] = both(level, [[0.0; 8]; 16], |level, rays| camera.compute(level, rays));
        check_records("camera ray", 0xffff, &found, &wanted);
    }
    Ok(())
}

/// Numbers of the vertices against those of single samples.
fn check_numbers(samples: &SampleBlock, offsets: Offsets, found: &VertexNumbers) {
    for i in 0..16 {
        let (key, index) = (place_key(samples.place[i]), samples.index[i].reverse_bits());
        let first = samples.dimension[i];
        let of = |row: &[Row; 2]| [row[0][i], row[1][i]];
        assert_eq!(of(&found.light), pair(key, index, first + offsets.light));
        assert_eq!(of(&found.scatter), pair(key, index, first + offsets.scatter));
        assert_eq!(found.roulette[i], single(key, index, first + offsets.roulette));
        assert_eq!(found.choice[i], single(key, index, first + offsets.choice));
    }
}

/// Samples of the environment at every level against single lanes.
fn check_sky(rows: &mut Rows, active: u32, is_map: bool) {
    let sky = SkyBlock {
        at: [rows.unit(), rows.unit()],
        density: rows.row(),
        factors: [rows.row(), rows.row()],
        normal: rows.vectors(),
    };
    let [x, y, z] = rows.vectors().map(|[a, b, c, ..]| [a, b, c]);
    let samples = SkySamples { sky: &sky, to_world: is_map.then_some([x, y, z]), active };
    let before = (rows.vectors(), rows.row());
    let (mut direction, mut pdf) = before;
    let set = samples.compute(Level::SCALAR, &mut direction, &mut pdf);
    for level in Level::detect().and_below() {
        let mut found = before;
        assert_eq!(samples.compute(level, &mut found.0, &mut found.1), set, "{level:?}");
        check("sky direction", 0xffff, &found.0, &direction);
        check("sky density", 0xffff, &[found.1], &[pdf]);
    }
}

/// Chosen groups at every level against single lanes.
fn check_choices(rows: &mut Rows) {
    let weight = |x: f32| if x > 0.0 { x.min(1e30) } else { 0.0 };
    let columns: [Row; 8] = core::array::from_fn(|_| rows.row().map(weight));
    let weights = core::array::from_fn(|i| columns.map(|column| column[i]));
    let u = rows.unit();
    let choices = Choices { weights: &weights, u: &u };
    for level in Level::detect().and_below() {
        let [found, wanted] = both(level, ChoiceBlock::EMPTY, |level, block| choices.compute(level, block));
        assert_eq!(found.exists, wanted.exists, "{level:?}");
        check("group", wanted.exists, &[found.group], &[wanted.group]);
        check("probability", wanted.exists, &[found.probability], &[wanted.probability]);
        check("remainder", wanted.exists, &[found.rest], &[wanted.rest]);
    }
}

/// Rough dielectrics at every level against single lanes.
fn check_rough(rows: &mut Rows, surface: &SurfaceBlock, exists: u32) {
    let eta = rows.unit().map(|x| 0.25 + 2.5 * x);
    let rough =
        RoughBlock { tint: rows.vectors(), eta, alpha: rows.unit(), exists: exists & surface.regular };
    let (rough, direction) = (Rough { surface, rough: &rough }, rows.vectors());
    let (u, lobe, before) = ([rows.unit(), rows.unit()], rows.unit(), (rows.vectors(), rows.row()));
    let (mut wanted, mut sampled) = (before, ScatterBlock::EMPTY);
    rough.light(Level::SCALAR, &direction, &mut wanted.0, &mut wanted.1);
    let set = rough.sample(Level::SCALAR, (&u, &lobe), &mut sampled);
    for level in Level::detect().and_below() {
        let (mut found, mut out) = (before, ScatterBlock::EMPTY);
        rough.light(level, &direction, &mut found.0, &mut found.1);
        check("value of rough glass", rough.rough.exists, &found.0, &wanted.0);
        check("density of rough glass", rough.rough.exists, &[found.1], &[wanted.1]);
        assert_eq!(rough.sample(level, (&u, &lobe), &mut out), set, "{level:?}");
        check("direction by rough glass", set, &out.direction, &sampled.direction);
        check("weight by rough glass", set, &out.weight, &sampled.weight);
        check("density and refraction", set, &[out.pdf, out.eta], &[sampled.pdf, sampled.eta]);
    }
}

/// Texture look-ups at every level against single lanes.
fn check_textures(rows: &mut Rows, clamps: u32) {
    let size = |row: Row| row.map(|x| 1.0 + (x * 5000.0).floor());
    let given = TextureBlock {
        at: [rows.row(), rows.row()],
        size: [size(rows.unit()), size(rows.unit())],
        clamps,
        texels: [rows.vectors(), rows.vectors(), rows.vectors(), rows.vectors()],
        ..TextureBlock::EMPTY
    };
    let (mut wanted, mut mixture) = (given.clone(), rows.vectors());
    wanted.surround(Level::SCALAR);
    wanted.mix(Level::SCALAR, &mut mixture);
    for level in Level::detect().and_below() {
        let (mut found, mut mixed) = (given.clone(), mixture);
        found.surround(level);
        found.mix(level, &mut mixed);
        check("first texels", 0xffff, &found.first, &wanted.first);
        check("second texels", 0xffff, &found.second, &wanted.second);
        check("weights of texels", 0xffff, &found.weight, &wanted.weight);
        check("mixture", 0xffff, &mixed, &mixture);
    }
}

/// Coats apart from their bases at every level against single lanes.
fn check_apart(rows: &mut Rows, [alone, balance]: [u32; 2], surface: &SurfaceBlock, coats: &CoatBlock) {
    let tables: &CoatTables = &[-100; 2112];
    let light = LightBlock {
        direction: rows.vectors(),
        pdf: rows.row(),
        radiance: rows.vectors(),
        alone,
        balance,
        ..LightBlock::EMPTY
    };
    let (each, throughput, u, lobe) = (rows.unit(), rows.vectors(), [rows.unit(), rows.unit()], rows.unit());
    let (each, throughput, supplied) = (&each, &throughput, balance);
    let light = ApartLight { surface, coats, tables, light: &light, each, throughput, supplied };
    let samples = CoatSamples { surface, coats, tables, u: &u, lobe: &lobe };
    let mut wanted = ScatterBlock::EMPTY;
    let sets = samples.compute_apart(Level::SCALAR, &mut wanted);
    for level in Level::detect().and_below() {
        let [found, lit] = both(level, ApartBlock::EMPTY, |level, block| light.compute(level, block));
        let mut out = ScatterBlock::EMPTY;
        assert_eq!(samples.compute_apart(level, &mut out), sets, "{level:?}");
        check("value", coats.apart, &found.value, &lit.value);
        check("contribution", coats.apart, &found.contribution, &lit.contribution);
        check("part of the base", coats.apart, &found.base, &lit.base);
        check("direction", sets.exists, &out.direction, &wanted.direction);
        check("weight", sets.exists, &out.weight, &wanted.weight);
        check("density", sets.exists, &[out.pdf], &[wanted.pdf]);
    }
}

/// Coats and smooth surfaces at every level against single lanes.
fn check_coats(
    rows: &mut Rows,
    seed: i16,
    surface: &SurfaceBlock,
    coats: &CoatBlock,
    specular: &SpecularBlock,
) {
    let tables: &CoatTables = &core::array::from_fn(|i| seed.wrapping_mul(i as i16));
    let (u, lobe, direction) = ([rows.unit(), rows.unit()], rows.unit(), rows.vectors());
    let light = CoatLight { surface, coats, tables, direction: &direction };
    let samples = CoatSamples { surface, coats, tables, u: &u, lobe: &lobe };
    let smooth = SpecularSamples { surface, specular, lobe: &lobe };
    let before = (rows.vectors(), rows.row(), ScatterBlock::EMPTY);
    let compute = |level: Level| {
        let (mut seen, (mut value, mut pdf, mut out)) = (coats.clone(), before.clone());
        seen.see(level, surface, tables);
        light.compute(level, &mut value, &mut pdf);
        let CoatSets { exists, delta, .. } = samples.compute(level, &mut out);
        let sets = [exists, delta, smooth.compute(level, &mut out)];
        (seen, value, pdf, out, sets)
    };
    let wanted = compute(Level::SCALAR);
    for level in Level::detect().and_below() {
        let found = compute(level);
        assert_eq!(found.4, wanted.4, "{level:?}");
        check("transmittance", coats.exists, &found.0.transmittance, &wanted.0.transmittance);
        check("probability", coats.exists, &[found.0.probability], &[wanted.0.probability]);
        check("value", 0xffff, &found.1, &wanted.1);
        check("density", 0xffff, &[found.2], &[wanted.2]);
        let set = (wanted.4[0] & !specular.exists) | wanted.4[2];
        check("direction", set, &found.3.direction, &wanted.3.direction);
        check("weight", set, &found.3.weight, &wanted.3.weight);
        check("density", set, &[found.3.pdf], &[wanted.3.pdf]);
        check("index", set, &[found.3.eta], &[wanted.3.eta]);
    }
}
