//! Rough dielectric boundary over lanes: GGX microfacets, each a smooth dielectric (Walter et al. 2007).

use super::bsdf::{SampleLanes, local, viewer};
use super::fresnel::{between, dielectric, reflection_probability, refract};
use super::ggx::Ggx;
use super::scatter::ScatterBlock;
use super::surface::SurfaceBlock;
use super::vector::{self, add, scale, sub};
use super::{Row, Row3, load2, load3};
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

/// Rough dielectrics over lanes. Masking and shadowing are independent.
#[derive(Clone, Copy)]
pub struct RoughLanes<L> {
    /// Factors on the transmitted light.
    pub tint: [L; 3],
    /// Indices of refraction on the far side over that of the viewer's side; not 1.
    pub eta: L,
    /// Distributions of the normals.
    pub ggx: Ggx<L>,
}

impl<L: Lanes> RoughLanes<L> {
    /// Solid angle of normals per solid angle of refracted directions (Walter 2007, eq. 17).
    #[inline(always)]
    fn jacobian(&self, c: L, c_i: L) -> L {
        let (one, eta) = (c.all(1.0), self.eta);
        // η c_i - c without cancellation for η near 1: (η c_i)² - c² = η² - 1.
        let sum = (eta - one) * (eta + one) / (eta * c_i + c);
        eta * eta * c_i / (sum * sum)
    }

    /// f |cos| and density.
    #[inline(always)]
    pub fn evaluate(&self, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let reflects = wi[2].all(0.0).lt(wi[2]);
        let (mut value, mut pdf) = (wi, wi[2]);
        if reflects.any() {
            (value, pdf) = self.reflected(wo, wi);
        }
        if (!reflects).any() {
            let (f, density) = self.refracted(wo, wi);
            (value, pdf) = (vector::select(reflects, value, f), pdf.select(reflects, density));
        }
        (value, pdf)
    }

    #[inline(always)]
    fn reflected(&self, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let h = add(wo, wi);
        let c = dot(wo, h) / vector::length(h);
        let reflectance = dielectric(c, self.eta);
        let p = reflection_probability(reflectance, self.tint);
        let lobe = self.ggx.density(h) * self.ggx.visibility(wo, wi) * wi[2];
        ([reflectance * lobe; 3], p * self.ggx.visible_density(wo, h, c) / (c.all(4.0) * c))
    }

    #[inline(always)]
    fn refracted(&self, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let (zero, one, eta) = (wi[2].all(0.0), wi[2].all(1.0), self.eta);
        // The normal that refracts wo to wi (Walter 2007, eq. 16) points to the side of the lower index; here
        // it is turned to the viewer. By rounding, a normal in the surface may seem to be below it.
        let h = scale(add(wo, scale(wi, eta)), one.copysign(one - eta));
        let is_above = !h[2].lt(zero.all(-ROUNDING));
        if !is_above.any() {
            return ([zero; 3], zero);
        }
        let h = [h[0], h[1], h[2].max(zero)];
        let length = vector::length(h);
        let (c, c_i) = (dot(wo, h) / length, -dot(wi, h) / length);
        let reflectance = between(c, eta * c_i, eta);
        let p = reflection_probability(reflectance, self.tint);
        let density = self.ggx.visible_density(wo, h, c) * self.jacobian(c, c_i);
        // Walter 2007, eq. 21, over eta² for radiance.
        let transmitted = (one - reflectance) * self.ggx.masking(wi) * density / (eta * eta);
        let exists = is_above & wi[2].lt(zero) & zero.lt(c) & zero.lt(c_i);
        let value = vector::select(exists, scale(self.tint, transmitted), [zero; 3]);
        (value, ((one - p) * density).select(exists, zero))
    }

    /// Samples a direction.
    #[inline(always)]
    pub fn sample(&self, wo: [L; 3], [u, v, lobe]: [L; 3]) -> SampleLanes<L> {
        let (zero, one, eta) = (u.all(0.0), u.all(1.0), self.eta);
        let m = self.ggx.sample_visible(wo, [u, v]);
        let c = dot(wo, m);
        let reflectance = dielectric(c, eta);
        let p = reflection_probability(reflectance, self.tint);
        let normals = self.ggx.visible_density(wo, m, c);
        let (reflects, delta) = (lobe.lt(p), one.lt(zero));
        let mut sample = SampleLanes::mirrored(wo, [one; 3], one);
        if reflects.any() {
            let direction = sub(scale(m, zero.all(2.0) * c), wo);
            let weight = [reflectance / p * self.ggx.masking(direction); 3];
            let (pdf, exists) = (p * normals / (zero.all(4.0) * c), zero.lt(direction[2]));
            sample = SampleLanes { direction, weight, pdf, eta: one, exists, delta };
        }
        if (!reflects).any() {
            let direction = refract(wo, m, c, eta);
            let c_i = -dot(direction, m);
            let transmittance = (one - reflectance) / ((one - p) * eta * eta);
            let weight = scale(self.tint, transmittance * self.ggx.masking(direction));
            let pdf = (one - p) * normals * self.jacobian(c, c_i);
            let exists = direction[2].lt(zero) & zero.lt(c_i) & p.lt(one);
            let refracted = SampleLanes { direction, weight, pdf, eta, exists, delta };
            sample = sample.select(reflects, refracted);
        }
        SampleLanes { exists: sample.exists & zero.lt(c), ..sample }
    }
}

impl RoughBlock {
    #[inline(always)]
    fn lanes<S: Simd>(&self, simd: S) -> RoughLanes<S::F16> {
        let ggx = Ggx::new(simd.load16(&self.alpha));
        RoughLanes { tint: load3(simd, &self.tint), eta: simd.load16(&self.eta), ggx }
    }
}

impl Rough<'_> {
    /// f |cos| and densities in the unit `direction`s, by the instructions of `level`, into the lanes of
    /// rough dielectrics.
    pub fn light(&self, level: Level, direction: &Row3, value: &mut Row3, pdf: &mut Row) {
        level.dispatch((self, direction, value, pdf));
    }

    /// Samples at `u`, whose lobes `lobe` chooses, by the instructions of `level`, into the lanes of rough
    /// dielectrics. Returns the set of samples.
    pub fn sample(&self, level: Level, (u, lobe): (&[Row; 2], &Row), out: &mut ScatterBlock) -> u32 {
        level.dispatch((self, u, lobe, out))
    }
}

impl Kernel for (&Rough<'_>, &Row3, &mut Row3, &mut Row) {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (Rough { surface, rough }, direction, value, pdf) = self;
        let [wo, wi] = local(simd, surface, direction);
        let (f, density) = rough.lanes(simd).evaluate(wo, wi);
        let exists = simd.mask16(rough.exists);
        *value = vector::to_arrays(vector::select(exists, f, load3(simd, value)));
        *pdf = density.select(exists, simd.load16(pdf)).to_array();
    }
}

impl Kernel for (&Rough<'_>, &[Row; 2], &Row, &mut ScatterBlock) {
    type Out = u32;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> u32 {
        let (Rough { surface, rough }, u, lobe, out) = self;
        let [u, v] = load2(simd, u);
        let u = [u, v, simd.load16(lobe)];
        let sample = rough.lanes(simd).sample(viewer(load3(simd, &surface.wo)), u);
        let is = simd.mask16(rough.exists);
        out.set(simd, is, &sample);
        (sample.exists & is).bits()
    }
}
