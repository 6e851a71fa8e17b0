//! Rough or smooth coat over a diffuse base, over lanes: value, density and sampling. The base receives the
//! light that the coat transmits on the way in and on the way out (Ashikhmin et al. 2000, §2.4; Kelemen and
//! Szirmay-Kalos 2001):
//!
//! f = D G F / (4 cos θ_o cos θ_i) + base · T(θ_o) T(θ_i) / π
//!
//! The model is symmetric in the directions, hence reciprocal.
//!
//! A microfacet of a dielectric coat reflects tint · F + metal + (metallic - metal) · S, with Fresnel's F and
//! S = (1 - c)^5. One of a coat of Schlick reflects metal + (1 - metal) · S. The part of a coat that depends
//! on the viewer is computed once a vertex.

use super::bsdf::{SampleLanes, local, viewer};
use super::coat_tables::{AMPLITUDES, CoatTables, STEP, TablePlace, amplitude, lerp, unit};
use super::fresnel::{dielectric, schlick_weight};
use super::ggx::Ggx;
use super::scatter::ScatterBlock;
use super::surface::SurfaceBlock;
use super::vector::{self, add, divide, mul, scale, sub};
use super::{Row, Row3, load2, load3, put, warp};
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

/// Coats over lanes.
#[derive(Clone, Copy)]
pub struct CoatLanes<L: Lanes> {
    /// Factors of the bases.
    pub base: [L; 3],
    /// Factors of Fresnel's reflectance; reflectances at normal incidence of coats of Schlick.
    pub tint: [L; 3],
    /// Reflectances of the metals at normal incidence; of coats of Schlick with their metals.
    pub metal: [L; 3],
    /// Fractions of the metals; 1 for coats of Schlick.
    pub metallic: L,
    /// GGX alpha; 0 is smooth.
    pub alpha: L,
    /// Indices of refraction; above 1 for coats of Schlick, which do not use it.
    pub eta: L,
    /// Mean transmittances for uniform light from the bases.
    pub mean: [L; 3],
    /// Weights of the bases in the choice of the lobe.
    pub base_weight: L,
    /// Lanes with a coat.
    pub exists: L::Mask,
    /// Those of a dielectric. Others are coats of Schlick.
    pub dielectric: L::Mask,
    /// Transmittances T(θ_o), by [`CoatLanes::see`].
    pub transmittance: [L; 3],
    /// Probabilities of the coats in the choice of the lobe, by [`CoatLanes::see`].
    pub probability: L,
}

impl CoatLanes<f32> {
    /// Smooth black coat of Schlick over a black base.
    pub const SMOOTH: Self = Self {
        base: [0.0; 3],
        tint: [0.0; 3],
        metal: [0.0; 3],
        metallic: 0.0,
        alpha: 0.0,
        eta: 1.5,
        mean: [0.0; 3],
        base_weight: 1.0,
        exists: true,
        dielectric: false,
        transmittance: [1.0; 3],
        probability: 0.0,
    };
}

/// Transmittance of coats, and the numbers that it shares with their albedos.
struct Transmitted<L: Lanes> {
    transmittance: [L; 3],
    /// Fresnel's reflectance of dielectric coats.
    fresnel: L,
    /// Albedos for F = 1 and F = (1 - c)^5.
    white: L,
    edge: L,
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
    pub fn reflectance(&self, c: L) -> [L; 3] {
        let fresnel = if self.dielectric.any() { dielectric(c, self.eta) } else { c };
        self.mix(fresnel, schlick_weight(c))
    }

    /// `f0 · (white - edge) + edge`: albedo of a coat of Schlick.
    #[inline(always)]
    fn albedo(f0: [L; 3], white: L, edge: L) -> [L; 3] {
        add(scale(f0, white - edge), [edge; 3])
    }

    /// Transmittance at the cosine `c`; the albedos of dielectric coats are computed if `all`.
    #[inline(always)]
    fn transmitted(&self, tables: &CoatTables, c: L, all: bool) -> Transmitted<L> {
        let (one, step, amplitudes) = (c.all(1.0), c.all(STEP), c.all(AMPLITUDES as f32));
        let rough = self.rough() & self.exists;
        let (mut fresnel, mut white, mut edge) = (c, one, schlick_weight(c));
        if self.dielectric.any() {
            fresnel = dielectric(c, self.eta);
        }
        let mut of_dielectric = one - fresnel;
        if rough.any() {
            let at = TablePlace::new(c, self.alpha);
            if (rough & self.dielectric).any() {
                let [k, t] = amplitude(self.eta);
                let difference = lerp(at.value(tables, k), at.value(tables, k + one), t);
                of_dielectric = unit(of_dielectric + step * difference).select(rough, of_dielectric);
            }
            if all || (rough & !self.dielectric).any() {
                white = unit(one + step * at.value(tables, amplitudes)).select(rough, one);
                edge = unit(edge + step * at.value(tables, amplitudes + one)).select(rough, edge);
            }
        }
        let of_schlick = sub([one; 3], Self::albedo(self.tint, white, edge));
        let transmittance = vector::select(self.dielectric, [of_dielectric; 3], of_schlick);
        Transmitted { transmittance, fresnel, white, edge }
    }

    /// Transmittance T at the cosine `c`.
    #[inline(always)]
    pub fn transmittance(&self, tables: &CoatTables, c: L) -> [L; 3] {
        self.transmitted(tables, c, false).transmittance
    }

    /// `self` with T(θ_o) and the probability of the coat for a viewer at the cosine `c`: the fraction of the
    /// coat in the energy that leaves, with the weights [`COAT_WEIGHT`] and `base_weight`.
    #[inline(always)]
    #[must_use]
    pub fn see(self, tables: &CoatTables, c: L) -> Self {
        let (zero, one) = (c.all(0.0), c.all(1.0));
        let sum = |[a, b, c]: [L; 3]| a + b + c;
        let Transmitted { transmittance, fresnel, white, edge } = self.transmitted(tables, c, true);
        let mut albedo = Self::albedo(self.metal, white, edge);
        if self.dielectric.any() {
            // The albedo tables of Schlick's coat also serve the dielectric coat.
            let amplitude = (self.eta - one) / (self.eta + one);
            let by_table = edge + amplitude * amplitude * (white - edge);
            let of_dielectric = self.mix(by_table.select(self.rough(), fresnel), edge);
            albedo = vector::select(self.dielectric, of_dielectric, albedo);
        }
        let coat = c.all(COAT_WEIGHT) * sum(albedo);
        let base = sum(mul(mul(self.base, transmittance), self.mean)) * self.base_weight;
        let probability = unit(coat / (coat + base)).select(zero.lt(base), one);
        Self { transmittance, probability, ..self }
    }

    /// base · T(θ_o) · T(θ_i).
    #[inline(always)]
    fn reflected(&self, tables: &CoatTables, wi: [L; 3]) -> [L; 3] {
        mul(mul(self.base, self.transmittance), self.transmittance(tables, wi[2]))
    }

    /// f cos θ_i of the base alone, for `wi` above the horizon.
    #[inline(always)]
    pub fn base_value(&self, tables: &CoatTables, wi: [L; 3]) -> [L; 3] {
        scale(self.reflected(tables, wi), wi[2] * wi[2].all(FRAC_1_PI))
    }

    /// f cos θ_i of rough coats alone, and the density of their samples without the probability of the choice.
    #[inline(always)]
    pub(super) fn lobe(&self, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let ggx = Ggx::new(self.alpha);
        let h = add(wo, wi);
        let reflectance = self.reflectance(dot(wo, h) / vector::length(h));
        let lobe = ggx.density(h) * ggx.visibility(wo, wi) * wi[2];
        (scale(reflectance, lobe), ggx.reflection_density(wo, h))
    }

    /// f cos θ_i and density of base and rough coat together, zeros below the horizon.
    #[inline(always)]
    pub fn evaluate(&self, tables: &CoatTables, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let above = wi[2].all(0.0).lt(wi[2]);
        let (value, pdf) = self.both(self.reflected(tables, wi), wo, wi);
        (vector::select(above, value, [wi[2].all(0.0); 3]), pdf.select(above, wi[2].all(0.0)))
    }

    /// [`CoatLanes::evaluate`] above the horizon, for known base · T(θ_o) · T(θ_i).
    #[inline(always)]
    fn both(&self, reflected: [L; 3], wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let (one, lambert, p) = (wi[2].all(1.0), wi[2] * wi[2].all(FRAC_1_PI), self.probability);
        let (mut value, mut pdf) = (scale(reflected, lambert), (one - p) * lambert);
        let rough = self.rough() & self.exists & one.all(0.0).lt(wi[2]);
        if rough.any() {
            let (lobe, density) = self.lobe(wo, wi);
            value = vector::select(rough, add(value, lobe), value);
            pdf = (pdf + p * density).select(rough, pdf);
        }
        (value, pdf)
    }

    /// Directions of the lobes that are chosen: of the coat in the lanes `of_coat`, which are rough, of the
    /// base elsewhere.
    #[inline(always)]
    pub(super) fn direction(&self, of_coat: L::Mask, wo: [L; 3], u: [L; 2]) -> [L; 3] {
        let mut direction = wo;
        if (!of_coat).any() {
            direction = warp::cosine_hemisphere(u);
        }
        if of_coat.any() {
            let reflected = Ggx::new(self.alpha).sample_reflection(wo, u);
            direction = vector::select(of_coat, reflected, direction);
        }
        direction
    }

    /// Samples a direction.
    #[inline(always)]
    pub fn sample(&self, tables: &CoatTables, wo: [L; 3], [u, v, lobe]: [L; 3]) -> SampleLanes<L> {
        let (zero, one) = (u.all(0.0), u.all(1.0));
        let (p, rough, is_coat) = (self.probability, self.rough(), lobe.lt(self.probability));
        let delta = is_coat & !rough;
        let mut sample = SampleLanes::mirrored(wo, [zero; 3], p);
        if (delta & self.exists).any() {
            sample.weight = divide(self.reflectance(wo[2]), p);
        }
        if (!delta & self.exists).any() {
            let wi = self.direction(is_coat & rough & self.exists, wo, [u, v]);
            let reflected = self.reflected(tables, wi);
            let (mut weight, mut pdf) = (reflected, (one - p) * wi[2] * zero.all(FRAC_1_PI));
            let mut exists = zero.lt(wi[2]);
            if rough.any() {
                let (value, density) = self.both(reflected, wo, wi);
                weight = vector::select(rough, divide(value, density), weight);
                pdf = density.select(rough, pdf);
                exists = exists & (!rough | zero.lt(density));
            }
            if (!rough).any() {
                // Under a smooth coat D, the cosine and π cancel.
                weight = vector::select(rough, weight, divide(reflected, one - p));
            }
            let wide = SampleLanes { direction: wi, weight, pdf, eta: one, exists, delta: one.lt(zero) };
            sample = sample.select(delta, wide);
        }
        SampleLanes { exists: sample.exists & self.exists, delta: delta & self.exists, ..sample }
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
