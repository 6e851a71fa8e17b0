//! Coats of a block: their parameters, the parts that depend on the viewers, light on them, and samples.

use super::bsdf::{local, viewer};
use super::coat_lanes::CoatLanes;
use super::coat_tables::CoatTables;
use super::scatter::ScatterBlock;
use super::surface::SurfaceBlock;
use super::{Row, Row3, load2, load3, put, vector};
use crate::lanes::{Lanes, Mask, Simd};
use crate::level::{Kernel, Level};

/// Coats of a block.
#[derive(Clone, Debug)]
pub struct CoatBlock {
    /// Factors of the bases.
    pub base: Row3,
    /// Factors of Fresnel's reflectance; reflectances at normal incidence of coats of Schlick.
    pub tint: Row3,
    /// Reflectances of the metals at normal incidence; of coats of Schlick with their metals.
    pub metal: Row3,
    /// Shares of the metals; 1 for coats of Schlick.
    pub metallic: Row,
    /// GGX alpha; 0 is smooth.
    pub alpha: Row,
    /// Indices of refraction; above 1 for coats of Schlick, which do not use it.
    pub eta: Row,
    /// Mean transmittances for uniform light from the bases.
    pub mean: Row3,
    /// Weights of the bases in the choice of the lobe.
    pub base_weight: Row,
    /// Bit `i`: surface `i` has a coat.
    pub exists: u32,
    /// Bit `i`: it is sampled and weighted apart from its base (`coat_apart.rs`).
    pub apart: u32,
    /// Bit `i`: its coat is a dielectric. Others are coats of Schlick.
    pub dielectric: u32,
    /// Transmittances T(θ_o), by [`CoatBlock::see`].
    pub transmittance: Row3,
    /// Probabilities of the coats in the choice of the lobe, by [`CoatBlock::see`].
    pub probability: Row,
}

impl CoatBlock {
    /// No coats.
    pub const EMPTY: Self = Self {
        base: [[0.0; 16]; 3],
        tint: [[0.0; 16]; 3],
        metal: [[0.0; 16]; 3],
        metallic: [0.0; 16],
        alpha: [0.0; 16],
        eta: [1.5; 16],
        mean: [[0.0; 16]; 3],
        base_weight: [1.0; 16],
        exists: 0,
        apart: 0,
        dielectric: 0,
        transmittance: [[0.0; 16]; 3],
        probability: [0.0; 16],
    };

    /// Makes the surface of vertex `i`, below 16, that of `coat`.
    #[inline]
    pub fn put(&mut self, i: usize, coat: &CoatLanes<f32>) {
        put(&mut self.base, i, coat.base);
        put(&mut self.tint, i, coat.tint);
        put(&mut self.metal, i, coat.metal);
        put(&mut self.mean, i, coat.mean);
        (self.metallic[i & 15], self.alpha[i & 15], self.eta[i & 15]) = (coat.metallic, coat.alpha, coat.eta);
        self.exists |= 1 << i;
        self.dielectric |= u32::from(coat.dielectric) << i;
    }

    /// Coats of the vertices `exists` over lanes.
    #[inline(always)]
    pub(super) fn lanes<S: Simd>(&self, simd: S, exists: u32) -> CoatLanes<S::F16> {
        CoatLanes {
            base: load3(simd, &self.base),
            tint: load3(simd, &self.tint),
            metal: load3(simd, &self.metal),
            metallic: simd.load16(&self.metallic),
            alpha: simd.load16(&self.alpha),
            eta: simd.load16(&self.eta),
            mean: load3(simd, &self.mean),
            base_weight: simd.load16(&self.base_weight),
            exists: simd.mask16(exists),
            dielectric: simd.mask16(self.dielectric),
            transmittance: load3(simd, &self.transmittance),
            probability: simd.load16(&self.probability),
        }
    }

    /// Computes the parts that depend on the viewers of `surface`, by the instructions of `level`.
    pub fn see(&mut self, level: Level, surface: &SurfaceBlock, tables: &CoatTables) {
        level.dispatch((self, surface, tables));
    }
}

impl Kernel for (&mut CoatBlock, &SurfaceBlock, &CoatTables) {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (block, surface, tables) = self;
        let [.., c] = viewer(load3(simd, &surface.wo));
        let CoatLanes { transmittance, probability, .. } = block.lanes(simd, block.exists).see(tables, c);
        (block.transmittance, block.probability) = (vector::to_arrays(transmittance), probability.to_array());
    }
}

/// Light on the coats of a block.
#[derive(Debug)]
pub struct CoatLight<'b> {
    /// Vertices.
    pub surface: &'b SurfaceBlock,
    /// Their coats, seen by [`CoatBlock::see`].
    pub coats: &'b CoatBlock,
    /// Tables of rough coats.
    pub tables: &'b CoatTables,
    /// Unit directions to the lights.
    pub direction: &'b Row3,
}

impl CoatLight<'_> {
    /// f |cos| and densities by the instructions of `level`, into the lanes of coats.
    pub fn compute(&self, level: Level, value: &mut Row3, pdf: &mut Row) {
        level.dispatch((self, value, pdf));
    }
}

impl Kernel for (&CoatLight<'_>, &mut Row3, &mut Row) {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (CoatLight { surface, coats, tables, direction }, value, pdf) = self;
        let [wo, wi] = local(simd, surface, direction);
        let (coats, exists) = (coats.lanes(simd, coats.exists), simd.mask16(coats.exists));
        let (f, density) = coats.evaluate(tables, wo, wi);
        *value = vector::to_arrays(vector::select(exists, f, load3(simd, value)));
        *pdf = density.select(exists, simd.load16(pdf)).to_array();
    }
}

/// Sampling of the coats of a block.
#[derive(Debug)]
pub struct CoatSamples<'b> {
    /// Vertices.
    pub surface: &'b SurfaceBlock,
    /// Their coats, seen by [`CoatBlock::see`].
    pub coats: &'b CoatBlock,
    /// Tables of rough coats.
    pub tables: &'b CoatTables,
    /// Positions in the unit square.
    pub u: &'b [Row; 2],
    /// Numbers that choose the lobes.
    pub lobe: &'b Row,
}

/// Sets of samples of coats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoatSets {
    /// Bit `i`: there is a sample.
    pub exists: u32,
    /// Bit `i`: it is mirrored.
    pub delta: u32,
    /// Bit `i`: it is of the coat; unspecified unless the coat is sampled apart.
    pub coat: u32,
}

impl CoatSamples<'_> {
    /// Samples by the instructions of `level`, into the lanes of coats.
    pub fn compute(&self, level: Level, out: &mut ScatterBlock) -> CoatSets {
        level.dispatch(SampleKernel::<false>(self, out))
    }

    /// Samples of coats apart from their bases by the instructions of `level`, into their lanes.
    pub fn compute_apart(&self, level: Level, out: &mut ScatterBlock) -> CoatSets {
        level.dispatch(SampleKernel::<true>(self, out))
    }
}

struct SampleKernel<'k, 'b, const APART: bool>(&'k CoatSamples<'b>, &'k mut ScatterBlock);

impl<const APART: bool> Kernel for SampleKernel<'_, '_, APART> {
    type Out = CoatSets;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> CoatSets {
        let Self(CoatSamples { surface, coats, tables, u, lobe }, out) = self;
        let set = if APART { coats.apart } else { coats.exists };
        let (coats, wo) = (coats.lanes(simd, set), viewer(load3(simd, &surface.wo)));
        let [u, v] = load2(simd, u);
        let u = [u, v, simd.load16(lobe)];
        let (sample, is_coat) = match APART {
            true => coats.sample_apart(tables, wo, u),
            false => (coats.sample(tables, wo, u), coats.exists),
        };
        out.set(simd, coats.exists, &sample);
        CoatSets { exists: sample.exists.bits(), delta: sample.delta.bits(), coat: is_coat.bits() }
    }
}
