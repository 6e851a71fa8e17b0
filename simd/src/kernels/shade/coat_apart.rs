//! Coats apart from their bases, over lanes, where a data structure supplies light of the bases: a sample is
//! of the base or of the coat alone, and light samples of each are weighted against its own density.

use super::bsdf::{SampleLanes, local};
use super::coat::CoatBlock;
use super::coat_lanes::CoatLanes;
use super::coat_tables::CoatTables;
use super::direct::{LightBlock, LightLanes};
use super::surface::SurfaceBlock;
use super::vector::{self, add, divide, mul, scale};
use super::{Row, Row3, load3};
use crate::lanes::{Lanes, Mask, Simd};
use crate::level::{Kernel, Level};
use core::f32::consts::FRAC_1_PI;

/// f cos θ_i of a lobe, and the density of its samples.
type Lobe<L> = ([L; 3], L);

impl<L: Lanes> CoatLanes<L> {
    /// Base and coat, each alone, with the probabilities of their choice; zeros for smooth coats and below
    /// the horizon.
    #[inline(always)]
    pub fn evaluate_apart(&self, tables: &CoatTables, wo: [L; 3], wi: [L; 3]) -> [Lobe<L>; 2] {
        let (zero, one) = (wi[2].all(0.0), wi[2].all(1.0));
        let (above, p, lambert) = (zero.lt(wi[2]), self.probability, wi[2] * zero.all(FRAC_1_PI));
        let base = vector::select(above, self.base_value(tables, wi), [zero; 3]);
        let of_base = (base, ((one - p) * lambert).select(above, zero));
        let rough = self.rough() & above & self.exists;
        let mut of_coat = ([zero; 3], zero);
        if rough.any() {
            let (lobe, density) = self.lobe(wo, wi);
            of_coat = (vector::select(rough, lobe, of_coat.0), (p * density).select(rough, zero));
        }
        [of_base, of_coat]
    }

    /// Samples base or coat. The mask has the samples of coats.
    #[inline(always)]
    pub fn sample_apart(
        &self,
        tables: &CoatTables,
        wo: [L; 3],
        [u, v, lobe]: [L; 3],
    ) -> (SampleLanes<L>, L::Mask) {
        let (p, rough, one) = (self.probability, self.rough(), u.all(1.0));
        let is_coat = lobe.lt(p) & self.exists;
        let delta = is_coat & !rough;
        let mut sample = SampleLanes::mirrored(wo, [one; 3], p);
        if delta.any() {
            sample.weight = divide(self.reflectance(wo[2]), p);
        }
        if (!delta & self.exists).any() {
            let direction = self.direction(is_coat & rough, wo, [u, v]);
            let [of_base, of_coat] = self.evaluate_apart(tables, wo, direction);
            let value = vector::select(is_coat, of_coat.0, of_base.0);
            let pdf = of_coat.1.select(is_coat, of_base.1);
            let (exists, weight) = (one.all(0.0).lt(pdf), divide(value, pdf));
            let wide = SampleLanes { direction, weight, pdf, eta: one, exists, delta: one.lt(one) };
            sample = sample.select(delta, wide);
        }
        (SampleLanes { exists: sample.exists & self.exists, delta, ..sample }, is_coat)
    }
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
    /// Light by the instructions of `level`, into all lanes of `out`.
    pub fn compute(&self, level: Level, out: &mut ApartBlock) {
        level.dispatch((self, out));
    }
}

impl Kernel for (&ApartLight<'_>, &mut ApartBlock) {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (ApartLight { surface, coats, tables, light, each, throughput, supplied }, out) = self;
        let (directions, light, each) = (&light.direction, LightLanes::of(simd, light), simd.load16(each));
        let (zero, one, [wo, wi]) = (each.all(0.0), each.all(1.0), local(simd, surface, directions));
        let [base, coat] = coats.lanes(simd, coats.apart).evaluate_apart(tables, wo, wi);
        let of_base = vector::select(simd.mask16(*supplied), [zero; 3], base.0);
        out.value = vector::to_arrays(add(of_base, coat.0));
        let of_base = scale(of_base, light.weight(each, base.1));
        let both = add(of_base, scale(coat.0, light.weight(each, coat.1)));
        let contribution = divide(mul(mul(load3(simd, throughput), both), light.radiance), light.pdf);
        let part = |i: usize| (of_base[i] / both[i]).select(of_base[i].lt(both[i]), one);
        out.contribution = vector::to_arrays(contribution);
        out.base = vector::to_arrays([part(0), part(1), part(2)]);
    }
}
