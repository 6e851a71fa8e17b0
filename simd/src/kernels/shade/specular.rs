//! Sampling of smooth surfaces at the vertices of a block, over lanes: mirrors, smooth metals, and smooth
//! dielectrics with Fresnel reflection and refraction by Snell's law.

use super::bsdf::viewer;
use super::fresnel::{fresnel, reflection_probability, schlick};
use super::load::{All, Load, One};
use super::scatter::ScatterBlock;
use super::surface::SurfaceBlock;
use super::vector::{self, scale};
use super::{Row, Row3, load3, put};
use crate::lanes::{Lanes, Mask, Simd};
use crate::level::{Kernel, Level};

/// Smooth surfaces of a block.
#[derive(Clone, Debug)]
pub struct SpecularBlock {
    /// Reflectances of mirrors, of metals at normal incidence; tints of dielectrics.
    pub color: Row3,
    /// Indices of refraction of dielectrics on the far side over that of the viewer's side.
    pub eta: Row,
    /// Bit `i`: surface `i` is smooth.
    pub exists: u32,
    /// Bit `i`: it is a metal.
    pub metal: u32,
    /// Bit `i`: it is a dielectric. Others are mirrors.
    pub dielectric: u32,
}

impl SpecularBlock {
    /// No surfaces.
    pub const EMPTY: Self =
        Self { color: [[0.0; 16]; 3], eta: [1.0; 16], exists: 0, metal: 0, dielectric: 0 };
}

/// Sampling of the smooth surfaces of a block.
#[derive(Debug)]
pub struct SpecularSamples<'b> {
    /// Vertices.
    pub surface: &'b SurfaceBlock,
    /// Their surfaces.
    pub specular: &'b SpecularBlock,
    /// Numbers that choose between reflection and refraction.
    pub lobe: &'b Row,
}

/// Smooth surfaces over lanes.
struct SpecularLanes<L: Lanes> {
    color: [L; 3],
    eta: L,
    metal: L::Mask,
    dielectric: L::Mask,
}

/// Samples over lanes.
struct SampleLanes<L: Lanes> {
    direction: [L; 3],
    weight: [L; 3],
    eta: L,
    exists: L::Mask,
}

impl<L: Lanes> SpecularLanes<L> {
    /// Samples a direction.
    #[inline(always)]
    fn sample(&self, wo: [L; 3], lobe: L) -> SampleLanes<L> {
        let (zero, one, c, eta) = (lobe.all(0.0), lobe.all(1.0), wo[2], self.eta);
        let mut direction = [-wo[0], -wo[1], c];
        let mut weight = vector::select(self.metal, schlick(self.color, c), self.color);
        let (mut ratio, mut exists) = (one, one.eq(one));
        if self.dielectric.any() {
            let reflectance = fresnel(c, eta);
            let p = reflection_probability(reflectance, self.color);
            let reflects = lobe.lt(p);
            let refracts = self.dielectric & !reflects;
            let transmittance = (one - reflectance) / ((one - p) * eta * eta);
            let of_dielectric =
                vector::select(reflects, [reflectance / p; 3], scale(self.color, transmittance));
            weight = vector::select(self.dielectric, of_dielectric, weight);
            // g = eta cos θ_t (Walter et al. 2007, eq. 40).
            let g = ((eta - one) * (eta + one) + c * c).max(zero).sqrt();
            let normal = scale([zero, zero, one], c - g);
            let bent = vector::divide(vector::sub(normal, wo), eta);
            let bent = vector::select(eta.eq(one), vector::negate(wo), bent);
            direction = vector::select(refracts, bent, direction);
            ratio = eta.select(refracts, one);
            exists = !refracts | p.lt(one);
        }
        SampleLanes { direction, weight, eta: ratio, exists }
    }
}

impl SpecularSamples<'_> {
    /// Samples over lanes.
    #[inline(always)]
    fn at<F: Load>(&self, from: F) -> SampleLanes<F::Lanes> {
        let Self { surface, specular, lobe } = self;
        let lanes = SpecularLanes {
            color: from.row3(&specular.color),
            eta: from.row(&specular.eta),
            metal: from.set(specular.metal),
            dielectric: from.set(specular.dielectric),
        };
        lanes.sample(viewer(from.row3(&surface.wo)), from.row(lobe))
    }

    /// Samples by the instructions of `level`, into the lanes of smooth surfaces. Returns the set of samples.
    pub fn compute(&self, level: Level, out: &mut ScatterBlock) -> u32 {
        level.dispatch(SampleKernel(self, out))
    }

    /// Scalar reference; equals [`SpecularSamples::compute`] to the bit where samples exist.
    pub fn reference(&self, out: &mut ScatterBlock) -> u32 {
        let mut exists = 0;
        for i in (0..super::BLOCK).filter(|i| self.specular.exists >> i & 1 == 1) {
            let sample = self.at(One(i));
            put(&mut out.direction, i, sample.direction);
            put(&mut out.weight, i, sample.weight);
            (out.pdf[i], out.eta[i]) = (f32::INFINITY, sample.eta);
            exists |= u32::from(sample.exists) << i;
        }
        exists
    }
}

struct SampleKernel<'k, 'b>(&'k SpecularSamples<'b>, &'k mut ScatterBlock);

impl Kernel for SampleKernel<'_, '_> {
    type Out = u32;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> u32 {
        let Self(samples, out) = self;
        let (sample, is) = (samples.at(All(simd)), simd.mask16(samples.specular.exists));
        let (direction, weight) = (load3(simd, &out.direction), load3(simd, &out.weight));
        out.direction = vector::to_arrays(vector::select(is, sample.direction, direction));
        out.weight = vector::to_arrays(vector::select(is, sample.weight, weight));
        out.pdf = simd.splat16(f32::INFINITY).select(is, simd.load16(&out.pdf)).to_array();
        out.eta = sample.eta.select(is, simd.load16(&out.eta)).to_array();
        (sample.exists & is).bits()
    }
}
