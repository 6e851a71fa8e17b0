//! Coats apart from their bases at the vertices of a block, over lanes, where a data structure supplies
//! light of the bases: a sample is of the base or of the coat alone, and light samples of each are weighted
//! against its own density, with the operations of the scalar BSDFs in their order.

use super::bsdf::{frame, to_local, viewer};
use super::coat::{CoatBlock, CoatLanes, CoatSamples, SampleLanes, coats};
use super::coat_tables::CoatTables;
use super::direct::{LightBlock, LightLanes};
use super::ggx::Ggx;
use super::load::{All, Load, One};
use super::scatter::ScatterBlock;
use super::surface::SurfaceBlock;
use super::vector::{self, add, divide, mul, scale};
use super::{Row, Row3, load3, put, warp};
use crate::lanes::{Lanes, Mask, Simd, dot};
use crate::level::{Kernel, Level};
use core::f32::consts::FRAC_1_PI;

/// f cos θ_i of a lobe, and the density of its samples.
type Lobe<L> = ([L; 3], L);

impl<L: Lanes> CoatLanes<L> {
    /// Base and coat, each alone, with the probabilities of their choice; zeros for smooth coats and below
    /// the horizon.
    #[inline(always)]
    fn evaluate_apart(&self, tables: &CoatTables, wo: [L; 3], wi: [L; 3]) -> [Lobe<L>; 2] {
        let (zero, one) = (wi[2].all(0.0), wi[2].all(1.0));
        let (above, p, lambert) = (zero.lt(wi[2]), self.probability, wi[2] * zero.all(FRAC_1_PI));
        let (transmittance, _) = self.transmittance(tables, wi[2], false);
        let base = scale(mul(mul(self.base, self.transmittance), transmittance), lambert);
        let base = vector::select(above, base, [zero; 3]);
        let of_base = (base, ((one - p) * lambert).select(above, zero));
        let rough = self.rough() & above & self.exists;
        let mut of_coat = ([zero; 3], zero);
        if rough.any() {
            let ggx = Ggx::new(self.alpha);
            let h = add(wo, wi);
            let reflectance = self.reflectance(dot(wo, h) / vector::length(h));
            let lobe = scale(reflectance, ggx.density(h) * ggx.visibility(wo, wi) * wi[2]);
            let density = p * ggx.reflection_density(wo, h);
            of_coat = (vector::select(rough, lobe, of_coat.0), density.select(rough, zero));
        }
        [of_base, of_coat]
    }

    /// Samples base or coat. The mask has the samples of coats.
    #[inline(always)]
    fn sample_apart(
        &self,
        tables: &CoatTables,
        wo: [L; 3],
        [u, v, lobe]: [L; 3],
    ) -> (SampleLanes<L>, L::Mask) {
        let (p, rough) = (self.probability, self.rough());
        let is_coat = lobe.lt(p) & self.exists;
        let mut direction = warp::cosine_hemisphere([u, v]);
        if (is_coat & rough).any() {
            let reflected = Ggx::new(self.alpha).sample_reflection(wo, [u, v]);
            direction = vector::select(is_coat & rough, reflected, direction);
        }
        let [of_base, of_coat] = self.evaluate_apart(tables, wo, direction);
        let value = vector::select(is_coat, of_coat.0, of_base.0);
        let mut pdf = of_coat.1.select(is_coat, of_base.1);
        let mut weight = divide(value, pdf);
        let mut exists = self.exists & pdf.all(0.0).lt(pdf);
        let delta = is_coat & !rough;
        if delta.any() {
            direction = vector::select(delta, [-wo[0], -wo[1], wo[2]], direction);
            weight = vector::select(delta, divide(self.reflectance(wo[2]), p), weight);
            pdf = p.all(f32::INFINITY).select(delta, pdf);
            exists = exists | delta;
        }
        (SampleLanes { direction, weight, pdf, exists, delta }, is_coat)
    }
}

/// Coats apart from their bases over lanes.
#[inline(always)]
fn apart<F: Load>(from: F, block: &CoatBlock) -> CoatLanes<F::Lanes> {
    let mut coats = coats(from, block);
    coats.exists = from.set(block.apart);
    coats
}

/// Light samples on coats apart from their bases.
#[derive(Debug)]
pub struct ApartLight<'b> {
    /// Vertices.
    pub surface: &'b SurfaceBlock,
    /// Their coats, seen by [`CoatBlock::see`].
    pub coats: &'b CoatBlock,
    /// Tables of rough coats.
    pub tables: &'b CoatTables,
    /// Light samples.
    pub light: &'b LightBlock,
    /// Shares of the samples, one over the number of light samples of the vertices.
    pub each: &'b Row,
    /// Throughputs of the paths.
    pub throughput: &'b Row3,
    /// Bit `i`: base `i` takes no light sample.
    pub supplied: u32,
}

/// Light of samples on coats apart from their bases.
#[derive(Clone, Debug)]
pub struct ApartBlock {
    /// f |cos| of base and coat together.
    pub value: Row3,
    /// Unoccluded contributions to the pixels.
    pub contribution: Row3,
    /// Fractions of the contributions that the bases reflect: 0 … 1.
    pub base: Row3,
}

impl ApartBlock {
    /// Zeros.
    pub const EMPTY: Self =
        Self { value: [[0.0; 16]; 3], contribution: [[0.0; 16]; 3], base: [[0.0; 16]; 3] };
}

impl ApartLight<'_> {
    /// Values, contributions and fractions of the bases over lanes.
    #[inline(always)]
    fn at<F: Load>(&self, from: F) -> [[F::Lanes; 3]; 3] {
        let Self { surface, coats, tables, each, throughput, supplied, .. } = self;
        let (light, each) = (LightLanes::of(from, self.light), from.row(each));
        let (zero, one) = (each.all(0.0), each.all(1.0));
        let (wo, wi) = (viewer(from.row3(&surface.wo)), to_local(frame(from, surface), light.direction));
        let [base, coat] = apart(from, coats).evaluate_apart(tables, wo, wi);
        let of_base = vector::select(from.set(*supplied), [zero; 3], base.0);
        let value = add(of_base, coat.0);
        let of_base = scale(of_base, light.weight(each, base.1));
        let both = add(of_base, scale(coat.0, light.weight(each, coat.1)));
        let contribution = divide(mul(mul(from.row3(throughput), both), light.radiance), light.pdf);
        let part = |i: usize| (of_base[i] / both[i]).select(of_base[i].lt(both[i]), one);
        [value, contribution, [part(0), part(1), part(2)]]
    }

    /// Light by the instructions of `level`, into all lanes of `out`.
    pub fn compute(&self, level: Level, out: &mut ApartBlock) {
        level.dispatch(LightKernel(self, out));
    }

    /// Scalar reference; equals [`ApartLight::compute`] to the bit in lanes of coats apart with light
    /// samples.
    pub fn reference(&self, out: &mut ApartBlock) {
        for i in 0..super::BLOCK {
            let [value, contribution, base] = self.at(One(i));
            put(&mut out.value, i, value);
            put(&mut out.contribution, i, contribution);
            put(&mut out.base, i, base);
        }
    }
}

struct LightKernel<'k, 'b>(&'k ApartLight<'b>, &'k mut ApartBlock);

impl Kernel for LightKernel<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let [value, contribution, base] = self.0.at(All(simd));
        let out = self.1;
        out.value = vector::to_arrays(value);
        out.contribution = vector::to_arrays(contribution);
        out.base = vector::to_arrays(base);
    }
}

/// Sets of samples of coats apart from their bases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ApartSets {
    /// Bit `i`: there is a sample.
    pub exists: u32,
    /// Bit `i`: it is mirrored.
    pub delta: u32,
    /// Bit `i`: it is of the coat.
    pub coat: u32,
}

impl CoatSamples<'_> {
    /// Samples of coats apart from their bases over lanes.
    #[inline(always)]
    fn at_apart<F: Load>(&self, from: F) -> (SampleLanes<F::Lanes>, <F::Lanes as Lanes>::Mask) {
        let Self { surface, coats, tables, u, lobe } = self;
        let u = [from.row(&u[0]), from.row(&u[1]), from.row(lobe)];
        apart(from, coats).sample_apart(tables, viewer(from.row3(&surface.wo)), u)
    }

    /// Samples of coats apart from their bases by the instructions of `level`, into their lanes.
    pub fn compute_apart(&self, level: Level, out: &mut ScatterBlock) -> ApartSets {
        level.dispatch(SampleKernel(self, out))
    }

    /// Scalar reference; equals [`CoatSamples::compute_apart`] to the bit where samples exist.
    pub fn reference_apart(&self, out: &mut ScatterBlock) -> ApartSets {
        let mut sets = ApartSets { exists: 0, delta: 0, coat: 0 };
        for i in (0..super::BLOCK).filter(|i| self.coats.apart >> i & 1 == 1) {
            let (sample, is_coat) = self.at_apart(One(i));
            put(&mut out.direction, i, sample.direction);
            put(&mut out.weight, i, sample.weight);
            (out.pdf[i], out.eta[i]) = (sample.pdf, 1.0);
            sets.exists |= u32::from(sample.exists) << i;
            sets.delta |= u32::from(sample.delta) << i;
            sets.coat |= u32::from(is_coat) << i;
        }
        sets
    }
}

struct SampleKernel<'k, 'b>(&'k CoatSamples<'b>, &'k mut ScatterBlock);

impl Kernel for SampleKernel<'_, '_> {
    type Out = ApartSets;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> ApartSets {
        let Self(samples, out) = self;
        let ((sample, is_coat), apart) = (samples.at_apart(All(simd)), simd.mask16(samples.coats.apart));
        let (direction, weight) = (load3(simd, &out.direction), load3(simd, &out.weight));
        out.direction = vector::to_arrays(vector::select(apart, sample.direction, direction));
        out.weight = vector::to_arrays(vector::select(apart, sample.weight, weight));
        out.pdf = sample.pdf.select(apart, simd.load16(&out.pdf)).to_array();
        out.eta = simd.splat16(1.0).select(apart, simd.load16(&out.eta)).to_array();
        let (exists, delta) = (sample.exists.bits(), sample.delta.bits());
        ApartSets { exists, delta, coat: is_coat.bits() }
    }
}
