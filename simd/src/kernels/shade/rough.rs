//! Rough dielectrics at the vertices of a block, over lanes: value, density and sampling, with the operations
//! of the scalar BSDF in their order (Walter et al. 2007).

use super::bsdf::{frame, to_local, viewer};
use super::fresnel::{between, fresnel, reflection_probability};
use super::ggx::Ggx;
use super::load::{All, Load, One};
use super::scatter::ScatterBlock;
use super::surface::SurfaceBlock;
use super::vector::{self, add, divide, scale, sub};
use super::{Row, Row3, load3, put};
use crate::lanes::{Lanes, Mask, Simd, dot};
use crate::level::{Kernel, Level};

/// Bound of the rounding error in a sum of two unit vectors.
pub const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// Rough dielectrics of a block.
#[derive(Clone, Debug)]
pub struct RoughBlock {
    /// Factors on the transmitted light.
    pub tint: Row3,
    /// Indices of refraction on the far side over that of the viewer's side; not 1.
    pub eta: Row,
    /// GGX alpha.
    pub alpha: Row,
    /// Bit `i`: surface `i` is a rough dielectric.
    pub exists: u32,
}

impl RoughBlock {
    /// No surfaces.
    pub const EMPTY: Self = Self { tint: [[0.0; 16]; 3], eta: [1.5; 16], alpha: [1.0; 16], exists: 0 };
}

/// Light on the rough dielectrics of a block, and their sampling.
#[derive(Debug)]
pub struct Rough<'b> {
    /// Vertices.
    pub surface: &'b SurfaceBlock,
    /// Their dielectrics.
    pub rough: &'b RoughBlock,
}

/// Rough dielectrics over lanes.
struct RoughLanes<L: Lanes> {
    tint: [L; 3],
    eta: L,
    ggx: Ggx<L>,
}

/// Samples over lanes.
struct SampleLanes<L: Lanes> {
    direction: [L; 3],
    weight: [L; 3],
    pdf: L,
    eta: L,
    exists: L::Mask,
}

impl<L: Lanes> RoughLanes<L> {
    /// Solid angle of normals per solid angle of refracted directions (Walter 2007, eq. 17).
    #[inline(always)]
    fn jacobian(&self, c: L, c_i: L) -> L {
        let (one, eta) = (c.all(1.0), self.eta);
        let sum = (eta - one) * (eta + one) / (eta * c_i + c);
        eta * eta * c_i / (sum * sum)
    }

    /// f |cos| and density.
    #[inline(always)]
    fn evaluate(&self, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let (zero, one, eta) = (wi[2].all(0.0), wi[2].all(1.0), self.eta);
        let reflects = zero.lt(wi[2]);
        // The normal that refracts wo to wi (eq. 16), on the side of the viewer.
        let bent = scale(add(wo, scale(wi, eta)), one.copysign(one - eta));
        let is_above = !bent[2].lt(zero.all(-ROUNDING));
        let bent = [bent[0], bent[1], bent[2].max(zero)];
        let h = vector::select(reflects, add(wo, wi), bent);
        let length = vector::length(h);
        let (c, c_i) = (dot(wo, h) / length, -dot(wi, h) / length);
        let g2 = (eta - one) * (eta + one) + c * c;
        let g = g2.sqrt().select(reflects, eta * c_i);
        let is_total = reflects & !zero.lt(g2);
        let reflectance = one.select(is_total, between(c, g, eta));
        let p = reflection_probability(reflectance, self.tint);
        let normals = self.ggx.visible_density(wo, h, c);
        let lobe = self.ggx.density(h) * self.ggx.visibility(wo, wi) * wi[2];
        let density = normals * self.jacobian(c, c_i);
        let transmitted = (one - reflectance) * self.ggx.masking(wi) * density / (eta * eta);
        let value = vector::select(reflects, [reflectance * lobe; 3], scale(self.tint, transmitted));
        let pdf = (p * normals / (zero.all(4.0) * c)).select(reflects, (one - p) * density);
        let exists = reflects | is_above & wi[2].lt(zero) & zero.lt(c) & zero.lt(c_i);
        (vector::select(exists, value, [zero; 3]), pdf.select(exists, zero))
    }

    /// Samples a direction.
    #[inline(always)]
    fn sample(&self, wo: [L; 3], [u, v, lobe]: [L; 3]) -> SampleLanes<L> {
        let (zero, one, eta) = (u.all(0.0), u.all(1.0), self.eta);
        let m = self.ggx.sample_visible(wo, [u, v]);
        let c = dot(wo, m);
        let reflectance = fresnel(c, eta);
        let p = reflection_probability(reflectance, self.tint);
        let normals = self.ggx.visible_density(wo, m, c);
        let reflects = lobe.lt(p);
        let mirrored = sub(scale(m, zero.all(2.0) * c), wo);
        let g = ((eta - one) * (eta + one) + c * c).max(zero).sqrt();
        let bent = divide(sub(scale(m, c - g), wo), eta);
        let wi = vector::select(reflects, mirrored, bent);
        let c_i = -dot(wi, m);
        let masking = self.ggx.masking(wi);
        let transmittance = (one - reflectance) / ((one - p) * eta * eta);
        let refracted = scale(self.tint, transmittance * masking);
        let weight = vector::select(reflects, [reflectance / p * masking; 3], refracted);
        let pdf =
            (p * normals / (zero.all(4.0) * c)).select(reflects, (one - p) * normals * self.jacobian(c, c_i));
        let passes = wi[2].lt(zero) & zero.lt(c_i) & p.lt(one);
        let exists = zero.lt(c) & (reflects & zero.lt(wi[2]) | !reflects & passes);
        SampleLanes { direction: wi, weight, pdf, eta: one.select(reflects, eta), exists }
    }
}

/// Rough dielectrics of a block over lanes.
#[inline(always)]
fn rough<F: Load>(from: F, rough: &RoughBlock) -> RoughLanes<F::Lanes> {
    RoughLanes {
        tint: from.row3(&rough.tint),
        eta: from.row(&rough.eta),
        ggx: Ggx::new(from.row(&rough.alpha)),
    }
}

impl Rough<'_> {
    /// f |cos| and densities in the directions to lights over lanes.
    #[inline(always)]
    fn light_at<F: Load>(&self, from: F, direction: &Row3) -> ([F::Lanes; 3], F::Lanes) {
        let wi = to_local(frame(from, self.surface), from.row3(direction));
        rough(from, self.rough).evaluate(viewer(from.row3(&self.surface.wo)), wi)
    }

    /// Samples over lanes.
    #[inline(always)]
    fn sample_at<F: Load>(&self, from: F, u: &[Row; 2], lobe: &Row) -> SampleLanes<F::Lanes> {
        let u = [from.row(&u[0]), from.row(&u[1]), from.row(lobe)];
        rough(from, self.rough).sample(viewer(from.row3(&self.surface.wo)), u)
    }

    /// f |cos| and densities in the unit `direction`s, by the instructions of `level`, into the lanes of
    /// rough dielectrics.
    pub fn light(&self, level: Level, direction: &Row3, value: &mut Row3, pdf: &mut Row) {
        level.dispatch(LightKernel(self, direction, value, pdf));
    }

    /// Scalar reference; equals [`Rough::light`] to the bit.
    pub fn light_reference(&self, direction: &Row3, value: &mut Row3, pdf: &mut Row) {
        for i in (0..super::BLOCK).filter(|i| self.rough.exists >> i & 1 == 1) {
            let (f, density) = self.light_at(One(i), direction);
            put(value, i, f);
            pdf[i] = density;
        }
    }

    /// Samples at `u`, whose lobes `lobe` chooses, by the instructions of `level`, into the lanes of rough
    /// dielectrics. Returns the set of samples.
    pub fn sample(&self, level: Level, (u, lobe): (&[Row; 2], &Row), out: &mut ScatterBlock) -> u32 {
        level.dispatch(SampleKernel(self, (u, lobe), out))
    }

    /// Scalar reference; equals [`Rough::sample`] to the bit where samples exist.
    pub fn sample_reference(&self, (u, lobe): (&[Row; 2], &Row), out: &mut ScatterBlock) -> u32 {
        let mut exists = 0;
        for i in (0..super::BLOCK).filter(|i| self.rough.exists >> i & 1 == 1) {
            let sample = self.sample_at(One(i), u, lobe);
            put(&mut out.direction, i, sample.direction);
            put(&mut out.weight, i, sample.weight);
            (out.pdf[i], out.eta[i]) = (sample.pdf, sample.eta);
            exists |= u32::from(sample.exists) << i;
        }
        exists
    }
}

struct LightKernel<'k, 'b>(&'k Rough<'b>, &'k Row3, &'k mut Row3, &'k mut Row);

impl Kernel for LightKernel<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self(rough, direction, value, pdf) = self;
        let (f, density) = rough.light_at(All(simd), direction);
        let exists = simd.mask16(rough.rough.exists);
        *value = vector::to_arrays(vector::select(exists, f, load3(simd, value)));
        *pdf = density.select(exists, simd.load16(pdf)).to_array();
    }
}

struct SampleKernel<'k, 'b>(&'k Rough<'b>, (&'k [Row; 2], &'k Row), &'k mut ScatterBlock);

impl Kernel for SampleKernel<'_, '_> {
    type Out = u32;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> u32 {
        let Self(rough, (u, lobe), out) = self;
        let (sample, is) = (rough.sample_at(All(simd), u, lobe), simd.mask16(rough.rough.exists));
        let (direction, weight) = (load3(simd, &out.direction), load3(simd, &out.weight));
        out.direction = vector::to_arrays(vector::select(is, sample.direction, direction));
        out.weight = vector::to_arrays(vector::select(is, sample.weight, weight));
        out.pdf = sample.pdf.select(is, simd.load16(&out.pdf)).to_array();
        out.eta = sample.eta.select(is, simd.load16(&out.eta)).to_array();
        (sample.exists & is).bits()
    }
}
