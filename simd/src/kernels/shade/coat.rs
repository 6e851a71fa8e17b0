//! Coats over diffuse bases at the vertices of a block, over lanes: value, density and sampling, with the
//! operations of the scalar BSDFs in their order (Ashikhmin et al. 2000, §2.4; Kelemen and Szirmay-Kalos
//! 2001).
//!
//! A microfacet of a dielectric coat reflects tint · F + metal + (metallic - metal) · S, with Fresnel's F and
//! S = (1 - c)^5. One of a coat of Schlick reflects metal + (1 - metal) · S. The part of a coat that depends
//! on the viewer is computed once a vertex.

use super::bsdf::{frame, to_local, viewer};
use super::coat_tables::{AMPLITUDES, CoatTables, LAST_AMPLITUDE, STEP, TablePlace, lerp, place, unit};
use super::fresnel::{fresnel, schlick_weight};
use super::ggx::Ggx;
use super::load::{All, Load, One};
use super::scatter::ScatterBlock;
use super::surface::SurfaceBlock;
use super::vector::{self, add, divide, mul, scale, sub};
use super::{Row, Row3, load3, put, warp};
use crate::lanes::{Lanes, Mask, Simd, dot};
use crate::level::{Kernel, Level};
use core::f32::consts::FRAC_1_PI;

/// Weight of the coat over the base in the choice of the lobe. Light samples find the emitters that the base
/// reflects, whereas the coat has to find its reflections alone (docs/decisions/bsdfs.md#choice-of-the-coat).
pub const COAT_WEIGHT: f32 = 2.0;

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
}

/// Coats over lanes.
pub(super) struct CoatLanes<L: Lanes> {
    pub(super) base: [L; 3],
    tint: [L; 3],
    metal: [L; 3],
    metallic: L,
    pub(super) alpha: L,
    eta: L,
    mean: [L; 3],
    base_weight: L,
    pub(super) exists: L::Mask,
    dielectric: L::Mask,
    pub(super) transmittance: [L; 3],
    pub(super) probability: L,
}

impl<L: Lanes> CoatLanes<L> {
    #[inline(always)]
    pub(super) fn rough(&self) -> L::Mask {
        !self.alpha.eq(self.alpha.all(0.0))
    }

    /// tint · fresnel + metal + (metallic - metal) · schlick, for coats of Schlick without the first.
    #[inline(always)]
    fn mix(&self, fresnel: L, schlick: L) -> [L; 3] {
        let coat = scale(self.tint, fresnel);
        let coat = vector::select(self.dielectric, add(coat, self.metal), self.metal);
        add(coat, scale(sub([self.metallic; 3], self.metal), schlick))
    }

    /// Reflectance of a microfacet at the cosine `c`.
    #[inline(always)]
    pub(super) fn reflectance(&self, c: L) -> [L; 3] {
        self.mix(fresnel(c, self.eta), schlick_weight(c))
    }

    /// `f0 · (white - edge) + edge`: albedo of a coat of Schlick.
    #[inline(always)]
    fn albedo(f0: [L; 3], [white, edge]: [L; 2]) -> [L; 3] {
        add(scale(f0, white - edge), [edge; 3])
    }

    /// Transmittance at the cosine `c`, and the albedos of coats of Schlick for F = 1 and F = (1 - c)^5. The
    /// albedos of dielectric coats are computed if `all`.
    #[inline(always)]
    pub(super) fn transmittance(&self, tables: &CoatTables, c: L, all: bool) -> ([L; 3], [L; 2]) {
        let (one, step) = (c.all(1.0), c.all(STEP));
        let amplitudes = c.all(AMPLITUDES as f32);
        let (rough, smooth) = (self.rough(), one - fresnel(c, self.eta));
        let (mut dielectric, mut white, mut edge) = (smooth, one, schlick_weight(c));
        let at = TablePlace::new(c, self.alpha);
        if (rough & self.dielectric).any() {
            let amplitude = (self.eta - one) / (self.eta + one) / c.all(LAST_AMPLITUDE);
            let [k, t] = place(amplitude, AMPLITUDES);
            let difference = lerp(at.value(tables, k), at.value(tables, k + one), t);
            dielectric = unit(smooth + step * difference).select(rough, smooth);
        }
        let of_schlick = if all { rough } else { rough & !self.dielectric };
        if of_schlick.any() {
            white = unit(one + step * at.value(tables, amplitudes)).select(rough, one);
            edge = unit(edge + step * at.value(tables, amplitudes + one)).select(rough, edge);
        }
        let of_schlick = sub([one; 3], Self::albedo(self.tint, [white, edge]));
        (vector::select(self.dielectric, [dielectric; 3], of_schlick), [white, edge])
    }

    /// T(θ_o) and the probability of the coat for a viewer at the cosine `c`.
    #[inline(always)]
    fn see(&self, tables: &CoatTables, c: L) -> ([L; 3], L) {
        let (zero, one) = (c.all(0.0), c.all(1.0));
        let sum = |[a, b, c]: [L; 3]| a + b + c;
        let (transmittance, [white, edge]) = self.transmittance(tables, c, true);
        let amplitude = (self.eta - one) / (self.eta + one);
        let by_table = edge + amplitude * amplitude * (white - edge);
        let of_dielectric = self.mix(by_table.select(self.rough(), fresnel(c, self.eta)), edge);
        let of_schlick = Self::albedo(self.metal, [white, edge]);
        let albedo = vector::select(self.dielectric, of_dielectric, of_schlick);
        let coat = c.all(COAT_WEIGHT) * sum(albedo);
        let base = sum(mul(mul(self.base, transmittance), self.mean)) * self.base_weight;
        let probability = unit(coat / (coat + base)).select(zero.lt(base), one);
        (transmittance, probability)
    }

    /// base · T(θ_o) · T(θ_i), and f cos θ_i and density of base and rough coat together, zeros below the
    /// horizon.
    #[inline(always)]
    fn evaluate(&self, tables: &CoatTables, wo: [L; 3], wi: [L; 3]) -> ([L; 3], [L; 3], L) {
        let (zero, one) = (wi[2].all(0.0), wi[2].all(1.0));
        let (lambert, p) = (wi[2] * zero.all(FRAC_1_PI), self.probability);
        let (transmittance, _) = self.transmittance(tables, wi[2], false);
        let base = mul(mul(self.base, self.transmittance), transmittance);
        let mut value = scale(base, lambert);
        let mut pdf = (one - p) * lambert;
        let above = zero.lt(wi[2]);
        let rough = self.rough() & above & self.exists;
        if rough.any() {
            let ggx = Ggx::new(self.alpha);
            let h = add(wo, wi);
            let reflectance = self.reflectance(dot(wo, h) / vector::length(h));
            let lobe = ggx.density(h) * ggx.visibility(wo, wi) * wi[2];
            value = vector::select(rough, add(value, scale(reflectance, lobe)), value);
            pdf = (pdf + p * ggx.reflection_density(wo, h)).select(rough, pdf);
        }
        (base, vector::select(above, value, [zero; 3]), pdf.select(above, zero))
    }

    /// Samples a direction.
    #[inline(always)]
    fn sample(&self, tables: &CoatTables, wo: [L; 3], [u, v, lobe]: [L; 3]) -> SampleLanes<L> {
        let (zero, one) = (u.all(0.0), u.all(1.0));
        let (p, rough) = (self.probability, self.rough());
        let is_coat = lobe.lt(p);
        let mut wi = warp::cosine_hemisphere([u, v]);
        if (is_coat & rough & self.exists).any() {
            let reflected = Ggx::new(self.alpha).sample_reflection(wo, [u, v]);
            wi = vector::select(is_coat & rough, reflected, wi);
        }
        let (base, value, mut pdf) = self.evaluate(tables, wo, wi);
        let mut weight = divide(value, pdf);
        let mut exists = self.exists & zero.lt(pdf);
        let smooth = !rough & self.exists;
        let delta = smooth & is_coat;
        if smooth.any() {
            // D, the cosine and π cancel.
            weight = vector::select(smooth, divide(base, one - p), weight);
            pdf = ((one - p) * wi[2] * zero.all(FRAC_1_PI)).select(smooth, pdf);
            wi = vector::select(delta, [-wo[0], -wo[1], wo[2]], wi);
            weight = vector::select(delta, divide(self.reflectance(wo[2]), p), weight);
            pdf = zero.all(f32::INFINITY).select(delta, pdf);
            exists = exists | smooth & zero.lt(wi[2]);
        }
        SampleLanes { direction: wi, weight, pdf, exists, delta }
    }
}

/// Samples over lanes.
pub(super) struct SampleLanes<L: Lanes> {
    pub(super) direction: [L; 3],
    pub(super) weight: [L; 3],
    pub(super) pdf: L,
    pub(super) exists: L::Mask,
    pub(super) delta: L::Mask,
}

/// Coats of a block over lanes.
#[inline(always)]
pub(super) fn coats<F: Load>(from: F, coats: &CoatBlock) -> CoatLanes<F::Lanes> {
    CoatLanes {
        base: from.row3(&coats.base),
        tint: from.row3(&coats.tint),
        metal: from.row3(&coats.metal),
        metallic: from.row(&coats.metallic),
        alpha: from.row(&coats.alpha),
        eta: from.row(&coats.eta),
        mean: from.row3(&coats.mean),
        base_weight: from.row(&coats.base_weight),
        exists: from.set(coats.exists),
        dielectric: from.set(coats.dielectric),
        transmittance: from.row3(&coats.transmittance),
        probability: from.row(&coats.probability),
    }
}

impl CoatBlock {
    /// Computes the parts that depend on the viewers of `surface`, by the instructions of `level`.
    pub fn see(&mut self, level: Level, surface: &SurfaceBlock, tables: &CoatTables) {
        level.dispatch(SeeKernel(self, surface, tables));
    }

    /// Scalar reference; equals [`CoatBlock::see`] to the bit where coats exist.
    pub fn see_reference(&mut self, surface: &SurfaceBlock, tables: &CoatTables) {
        for i in 0..super::BLOCK {
            let [.., c] = viewer(One(i).row3(&surface.wo));
            let (transmittance, probability) = coats(One(i), self).see(tables, c);
            put(&mut self.transmittance, i, transmittance);
            self.probability[i] = probability;
        }
    }
}

struct SeeKernel<'k>(&'k mut CoatBlock, &'k SurfaceBlock, &'k CoatTables);

impl Kernel for SeeKernel<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self(block, surface, tables) = self;
        let [.., c] = viewer(All(simd).row3(&surface.wo));
        let (transmittance, probability) = coats(All(simd), block).see(tables, c);
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
    /// f |cos| and densities over lanes.
    #[inline(always)]
    fn at<F: Load>(&self, from: F) -> ([F::Lanes; 3], F::Lanes) {
        let Self { surface, coats: block, tables, direction } = self;
        let wi = to_local(frame(from, surface), from.row3(direction));
        let (_, f, density) = coats(from, block).evaluate(tables, viewer(from.row3(&surface.wo)), wi);
        (f, density)
    }

    /// f |cos| and densities by the instructions of `level`, into the lanes of coats.
    pub fn compute(&self, level: Level, value: &mut Row3, pdf: &mut Row) {
        level.dispatch(LightKernel(self, value, pdf));
    }

    /// Scalar reference; equals [`CoatLight::compute`] to the bit.
    pub fn reference(&self, value: &mut Row3, pdf: &mut Row) {
        for i in (0..super::BLOCK).filter(|i| self.coats.exists >> i & 1 == 1) {
            let (f, density) = self.at(One(i));
            put(value, i, f);
            pdf[i] = density;
        }
    }
}

struct LightKernel<'k, 'b>(&'k CoatLight<'b>, &'k mut Row3, &'k mut Row);

impl Kernel for LightKernel<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self(light, value, pdf) = self;
        let (f, density) = light.at(All(simd));
        let exists = simd.mask16(light.coats.exists);
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

impl CoatSamples<'_> {
    /// Samples over lanes.
    #[inline(always)]
    fn at<F: Load>(&self, from: F) -> SampleLanes<F::Lanes> {
        let Self { surface, coats: block, tables, u, lobe } = self;
        let u = [from.row(&u[0]), from.row(&u[1]), from.row(lobe)];
        coats(from, block).sample(tables, viewer(from.row3(&surface.wo)), u)
    }

    /// Samples by the instructions of `level`, into the lanes of coats. Returns the set of samples, and that
    /// of mirrored ones.
    pub fn compute(&self, level: Level, out: &mut ScatterBlock) -> [u32; 2] {
        level.dispatch(SampleKernel(self, out))
    }

    /// Scalar reference; equals [`CoatSamples::compute`] to the bit where samples exist.
    pub fn reference(&self, out: &mut ScatterBlock) -> [u32; 2] {
        let mut sets = [0; 2];
        for i in (0..super::BLOCK).filter(|i| self.coats.exists >> i & 1 == 1) {
            let sample = self.at(One(i));
            put(&mut out.direction, i, sample.direction);
            put(&mut out.weight, i, sample.weight);
            (out.pdf[i], out.eta[i]) = (sample.pdf, 1.0);
            sets[0] |= u32::from(sample.exists) << i;
            sets[1] |= u32::from(sample.delta) << i;
        }
        sets
    }
}

struct SampleKernel<'k, 'b>(&'k CoatSamples<'b>, &'k mut ScatterBlock);

impl Kernel for SampleKernel<'_, '_> {
    type Out = [u32; 2];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [u32; 2] {
        let Self(samples, out) = self;
        let (sample, exists) = (samples.at(All(simd)), simd.mask16(samples.coats.exists));
        let (direction, weight) = (load3(simd, &out.direction), load3(simd, &out.weight));
        out.direction = vector::to_arrays(vector::select(exists, sample.direction, direction));
        out.weight = vector::to_arrays(vector::select(exists, sample.weight, weight));
        out.pdf = sample.pdf.select(exists, simd.load16(&out.pdf)).to_array();
        out.eta = simd.splat16(1.0).select(exists, simd.load16(&out.eta)).to_array();
        [sample.exists.bits(), sample.delta.bits()]
    }
}
