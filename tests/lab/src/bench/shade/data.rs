//! Random blocks of vertices in a box under a square lamp, and the kernels that shade them.

use core::hint::black_box;
use halflight_core::Level;
use halflight_core::sampling::{mix, unit_float};
use halflight_simd::kernels::shade::bsdf::BsdfBlock;
use halflight_simd::kernels::shade::camera::CameraRays;
use halflight_simd::kernels::shade::choice::{ChoiceBlock, Choices};
use halflight_simd::kernels::shade::coat::CoatBlock;
use halflight_simd::kernels::shade::coat_tables::CoatTables;
use halflight_simd::kernels::shade::direct::{Direct, LightBlock, ShadowBlock};
use halflight_simd::kernels::shade::emitter::{EmitterBlock, EmitterSampleBlock, EmitterSamples};
use halflight_simd::kernels::shade::numbers::{Offsets, SampleBlock, VertexNumbers};
use halflight_simd::kernels::shade::scatter::{NextBlock, Scatter, ScatterBlock};
use halflight_simd::kernels::shade::sky::{SkyBlock, SkySamples};
use halflight_simd::kernels::shade::specular::SpecularBlock;
use halflight_simd::kernels::shade::surface::{SurfaceBlock, Surfaces};
use halflight_simd::kernels::shade::texture::TextureBlock;
use halflight_simd::kernels::shade::{Row, Row3, at};

/// Kernel by name.
pub(super) struct Kernel {
    pub(super) name: &'static str,
    /// Shades one block by the lanes of a level.
    pub(super) run: fn(&Blocks, usize, Level),
}

/// Kernels in the order of a path.
pub(super) const KERNELS: &[Kernel] = &[
    Kernel { name: "camera rays", run: |blocks, i, level| blocks.0[i].camera(level) },
    Kernel { name: "surface points", run: |blocks, i, level| blocks.0[i].surface(level) },
    Kernel { name: "texels around coordinates", run: |blocks, i, level| blocks.0[i].surround(level) },
    Kernel { name: "mixtures of texels", run: |blocks, i, level| blocks.0[i].mix(level) },
    Kernel { name: "numbers of a vertex", run: |blocks, i, level| blocks.0[i].numbers(level) },
    Kernel { name: "numbers of a light sample", run: |blocks, i, level| blocks.0[i].light_numbers(level) },
    Kernel { name: "groups of lights", run: |blocks, i, level| blocks.0[i].groups(level) },
    Kernel { name: "near rectangle lights", run: |blocks, i, level| blocks.0[i].light(level) },
    Kernel { name: "samples of a sky map", run: |blocks, i, level| blocks.0[i].sky(level) },
    Kernel { name: "light on diffuse", run: |blocks, i, level| blocks.0[i].direct(DIFFUSE, level) },
    Kernel { name: "light on rough metal", run: |blocks, i, level| blocks.0[i].direct(METAL, level) },
    Kernel { name: "values on rough metal", run: |blocks, i, level| blocks.0[i].reach(METAL, level) },
    Kernel { name: "viewers of coats", run: |blocks, i, level| blocks.0[i].see(level) },
    Kernel { name: "light on coats", run: |blocks, i, level| blocks.0[i].light_coats(level) },
    Kernel { name: "samples of coats", run: |blocks, i, level| blocks.0[i].sample_coats(level) },
    Kernel { name: "light on coats apart", run: |blocks, i, level| blocks.0[i].light_apart(level) },
    Kernel { name: "samples of coats apart", run: |blocks, i, level| blocks.0[i].sample_apart(level) },
    Kernel { name: "samples of dielectrics", run: |blocks, i, level| blocks.0[i].refract(level) },
    Kernel { name: "light on rough glass", run: |blocks, i, level| blocks.0[i].light_rough(level) },
    Kernel { name: "samples of rough glass", run: |blocks, i, level| blocks.0[i].sample_rough(level) },
    Kernel { name: "numbers of lobes", run: |blocks, i, level| blocks.0[i].lobes(level) },
    Kernel { name: "scattering, diffuse", run: |blocks, i, level| blocks.0[i].scatter(DIFFUSE, level) },
    Kernel { name: "scattering, rough metal", run: |blocks, i, level| blocks.0[i].scatter(METAL, level) },
    Kernel { name: "samples of rough metal", run: |blocks, i, level| blocks.0[i].sample_metal(level) },
];

const DIFFUSE: usize = 0;
const METAL: usize = 1;

/// Tables of rough coats; their values do not affect the time.
pub(super) static TABLES: CoatTables = [-100; 2112];

/// Offset of the choice of the lobe.
pub(super) const LOBE: u32 = 3;

const OFFSETS: Offsets = Offsets { light: 0, choice: 1, scatter: 2, roulette: 4 };

/// Blocks of vertices.
pub(super) struct Blocks(Vec<Block>);

impl Blocks {
    pub(super) fn new(count: usize) -> Self {
        Self((0..count).map(|i| Block::new(i as u64)).collect())
    }
}

pub(super) struct Block {
    corners: [Row3; 3],
    weights: [Row; 2],
    rays: [[f32; 8]; 16],
    pub(super) surface: SurfaceBlock,
    pub(super) samples: SampleBlock,
    pub(super) numbers: VertexNumbers,
    groups: [[f32; 8]; 16],
    lights: EmitterBlock,
    pub(super) light: LightBlock,
    bsdfs: [BsdfBlock; 2],
    pub(super) coats: CoatBlock,
    pub(super) glass: SpecularBlock,
    given: ScatterBlock,
    pub(super) ones: Row3,
    raster: [Row; 2],
    textures: TextureBlock,
}

impl Block {
    fn new(seed: u64) -> Self {
        let mut counter = seed << 32;
        let mut random = || {
            counter += 1;
            unit_float((mix(counter) >> 32) as u32)
        };
        let mut row = |from: f32, to: f32| -> Row { core::array::from_fn(|_| from + (to - from) * random()) };
        let corner = |row: &mut dyn FnMut(f32, f32) -> Row| [row(-1.0, 1.0), row(0.0, 0.2), row(-1.0, 1.0)];
        let corners = [corner(&mut row), corner(&mut row), corner(&mut row)];
        let weights = [row(0.0, 0.5), row(0.0, 0.5)];
        let ways = [row(-1.0, 1.0), row(-1.0, -0.2), row(-1.0, 1.0)];
        let rays = core::array::from_fn(|i| {
            let [x, y, z] = at(&ways, i);
            let length = (x * x + y * y + z * z).sqrt();
            [0.0, 1.0, 0.0, f32::INFINITY, x / length, y / length, z / length, 0.0]
        });
        let (mut surface, mut numbers) = (SurfaceBlock::EMPTY, VertexNumbers::EMPTY);
        Surfaces { corners: &corners, normals: None, weights: &weights, rays: &rays }
            .compute(Level::BASELINE, &mut surface);
        let mut samples = SampleBlock::EMPTY;
        for i in 0..16 {
            (samples.place[i], samples.index[i], samples.dimension[i]) =
                (seed << 8 | i as u64, seed as u32, 7);
        }
        samples.vertices(Level::BASELINE, OFFSETS, true, &mut numbers);
        // A square lamp of side 1 at the height 2, which shines downwards.
        let mut lights = EmitterBlock::EMPTY;
        lights.origin = [[-0.5; 16], [2.0; 16], [-0.5; 16]];
        lights.edges = [[[1.0; 16], [0.0; 16], [0.0; 16]], [[0.0; 16], [0.0; 16], [1.0; 16]]];
        lights.normal = [[0.0; 16], [-1.0; 16], [0.0; 16]];
        (lights.area, lights.near, lights.rectangles) = ([1.0; 16], [9.0; 16], 0xffff);
        let probability = [1.0; 16];
        let EmitterSampleBlock { end, direction, pdf, exists, .. } = EmitterSamples {
            lights: &lights,
            from: &surface.position,
            normal: &surface.frame[2],
            u: &numbers.light,
            probability: &probability,
            active: 0xffff,
        }
        .compute(Level::BASELINE);
        let light = LightBlock {
            direction,
            end,
            pdf,
            exists,
            bounded: exists,
            area: exists,
            ..LightBlock { radiance: [[1.0; 16]; 3], ..LightBlock::EMPTY }
        };
        let reflectance = [[0.8; 16], [0.6; 16], [0.4; 16]];
        let alpha = [0.2; 16];
        let bsdfs = [
            BsdfBlock { reflectance, alpha, diffuse: 0xffff, metal: 0 },
            BsdfBlock { reflectance, alpha, diffuse: 0, metal: 0xffff },
        ];
        // A rough varnish.
        let mut coats = CoatBlock {
            base: reflectance,
            tint: [[1.0; 16]; 3],
            mean: [[0.9; 16]; 3],
            alpha,
            exists: 0xffff,
            apart: 0xffff,
            dielectric: 0xffff,
            ..CoatBlock::EMPTY
        };
        coats.see(Level::BASELINE, &surface, &TABLES);
        let glass = SpecularBlock {
            color: [[1.0; 16]; 3],
            eta: [1.5; 16],
            exists: 0xffff,
            dielectric: 0xffff,
            ..SpecularBlock::EMPTY
        };
        let powers = [row(0.0, 1.0), row(0.0, 1.0), row(0.0, 1.0), row(0.0, 1.0)];
        let groups = core::array::from_fn(|i| core::array::from_fn(|k| powers[k % 4][(i + k) % 16]));
        let raster = [row(0.0, 640.0), row(0.0, 480.0)];
        let textures = TextureBlock {
            at: weights,
            size: [[512.0; 16]; 2],
            weight: weights,
            texels: [corners[0], corners[1], corners[2], ways],
            ..TextureBlock::EMPTY
        };
        Self {
            corners,
            weights,
            rays,
            surface,
            samples,
            numbers,
            groups,
            lights,
            light,
            bsdfs,
            coats,
            glass,
            given: ScatterBlock::EMPTY,
            ones: [[1.0; 16]; 3],
            raster,
            textures,
        }
    }

    fn camera(&self, level: Level) {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
        let raster = &self.raster;
        let rays = CameraRays { eye: [0.0; 3], axes, pixel: 0.002, half: [320.0, 240.0], raster };
        let mut out = [[0.0; 8]; 16];
        rays.compute(level, &mut out);
        black_box(&out);
    }

    fn surface(&self, level: Level) {
        let Self { corners, weights, rays, .. } = self;
        let surfaces = Surfaces { corners, normals: None, weights, rays };
        let mut block = SurfaceBlock::EMPTY;
        surfaces.compute(level, &mut block);
        black_box(&block);
    }

    fn numbers(&self, level: Level) {
        let samples = &self.samples;
        let mut numbers = VertexNumbers::EMPTY;
        samples.vertices(level, OFFSETS, true, &mut numbers);
        black_box(&numbers);
    }

    fn light_numbers(&self, level: Level) {
        let samples = &self.samples;
        let mut numbers = VertexNumbers::EMPTY;
        samples.lights(level, OFFSETS, &mut numbers);
        black_box(&numbers);
    }

    fn surround(&self, level: Level) {
        let mut block = self.textures.clone();
        block.surround(level);
        black_box(&block);
    }

    fn mix(&self, level: Level) {
        let mut mixture = self.ones;
        self.textures.mix(level, &mut mixture);
        black_box(&mixture);
    }

    fn groups(&self, level: Level) {
        let choices = Choices { weights: &self.groups, u: &self.numbers.choice };
        let mut block = ChoiceBlock::EMPTY;
        choices.compute(level, &mut block);
        black_box(&block);
    }

    fn light(&self, level: Level) {
        let samples = EmitterSamples {
            lights: &self.lights,
            from: &self.surface.position,
            normal: &self.surface.frame[2],
            u: &self.numbers.light,
            probability: &self.ones[0],
            active: 0xffff,
        };
        black_box(samples.compute(level));
    }

    fn sky(&self, level: Level) {
        let sky = SkyBlock { at: self.numbers.light, ..SkyBlock::EMPTY };
        let to_world = Some([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let samples = SkySamples { sky: &sky, to_world, active: 0xffff };
        let (mut direction, mut pdf) = (self.ones, self.ones[0]);
        black_box(samples.compute(level, &mut direction, &mut pdf));
        black_box((&direction, &pdf));
    }

    fn lit(&self, bsdf: usize) -> Direct<'_> {
        Direct {
            surface: &self.surface,
            bsdf: &self.bsdfs[bsdf],
            light: &self.light,
            value: &self.ones,
            pdf: &self.ones[0],
            each: &self.ones[0],
            throughput: &self.ones,
        }
    }

    fn reach(&self, bsdf: usize, level: Level) {
        let direct = self.lit(bsdf);
        let mut block = ShadowBlock::EMPTY;
        direct.reach(level, &mut block);
        black_box(&block);
    }

    fn direct(&self, bsdf: usize, level: Level) {
        let direct = self.lit(bsdf);
        let mut block = ShadowBlock::EMPTY;
        direct.compute(level, &mut block);
        black_box(&block);
    }

    fn scattered(&self, bsdf: usize) -> Scatter<'_> {
        Scatter {
            surface: &self.surface,
            bsdf: &self.bsdfs[bsdf],
            given: &self.given,
            u: &self.numbers.scatter,
            roulette: &self.numbers.roulette,
            most: &self.ones[0],
            throughput: &self.ones,
            factor: &self.ones,
            eta_squared: &self.ones[0],
            active: 0xffff,
            certain: 0,
        }
    }

    fn sample_metal(&self, level: Level) {
        let scatter = self.scattered(METAL);
        black_box(scatter.samples(level));
    }

    fn scatter(&self, bsdf: usize, level: Level) {
        let scatter = self.scattered(bsdf);
        let mut block = NextBlock::EMPTY;
        scatter.compute(level, &mut block);
        black_box(&block);
    }
}
