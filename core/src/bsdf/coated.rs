//! BSDFs with a coat over a diffuse base. [`super::Glossy`] and [`super::Plastic`] show that energy is
//! conserved.

use super::{All, Bsdf, BsdfSample, COATS, Features};
use crate::Rgb;
use glam::Vec3;
use halflight_simd::kernels::shade::bsdf::viewer;
use halflight_simd::kernels::shade::coat_lanes::CoatLanes;

/// BSDF for a fixed viewer, with everything precomputed that does not depend on the light.
#[derive(Clone, Copy)]
pub(crate) struct BsdfView<'b> {
    bsdf: &'b Bsdf,
    wo: Vec3,
    /// Coat with T(θ_o).
    coat: Option<CoatLanes<f32>>,
    /// True to leave out the coat.
    base_alone: bool,
}

impl BsdfView<'_> {
    /// f(wo, wi) |cos θ_i|, equal to [`Bsdf::evaluate`] to the bit.
    #[inline]
    pub(crate) fn value<F: Features>(&self, wi: Vec3) -> Rgb {
        match &self.coat {
            Some(_) if !(wi.z > 0.0) => Rgb::ZERO,
            Some(coat) if self.base_alone => coat.base_value(&COATS, wi.into()).into(),
            Some(coat) => coat.evaluate(&COATS, viewer(self.wo.into()), wi.into()).0.into(),
            None => self.bsdf.evaluate::<F>(self.wo, wi).0,
        }
    }
}

impl Bsdf {
    /// Coat and base as a lane; `None` without a coat.
    #[inline(always)]
    pub(crate) fn coat<F: Features>(&self) -> Option<CoatLanes<f32>> {
        match self {
            Bsdf::Glossy(b) if F::GLOSSY => Some(b.lane()),
            Bsdf::Plastic(b) if F::GLOSSY => Some(b.lane()),
            _ => None,
        }
    }

    /// BSDF for the viewer at `wo`, for light from many directions.
    #[inline]
    pub(crate) fn view<F: Features>(&self, wo: Vec3) -> BsdfView<'_> {
        let [.., c] = viewer(wo.into());
        let with = |coat: CoatLanes<f32>| CoatLanes { transmittance: coat.transmittance(&COATS, c), ..coat };
        BsdfView { bsdf: self, wo, coat: self.coat::<F>().map(with), base_alone: false }
    }

    /// [`Bsdf::view`] without the coat if `base_alone`.
    #[inline]
    pub(crate) fn view_apart<F: Features>(&self, wo: Vec3, base_alone: bool) -> BsdfView<'_> {
        BsdfView { base_alone, ..self.view::<F>(wo) }
    }

    /// [`Bsdf::sample`] of the base or the coat alone. Weight and density are those of the chosen lobe,
    /// including the probability of the choice; the base has the weight `base_weight` in the choice, 1 in
    /// [`Bsdf::sample`], 0 to sample the coat always. The flag is true for the coat.
    #[inline]
    pub(crate) fn sample_apart<F: Features>(
        &self,
        wo: Vec3,
        u: [f32; 3],
        base_weight: f32,
    ) -> Option<(BsdfSample, bool)> {
        let (wo, coat) = (viewer(wo.into()), self.coat::<F>()?);
        let coat = CoatLanes { base_weight, ..coat }.see(&COATS, wo[2]);
        let (sample, is_coat) = coat.sample_apart(&COATS, wo, u);
        BsdfSample::of(sample).map(|sample| (sample, is_coat))
    }

    /// [`Bsdf::evaluate`] of the base and of the coat, each alone, with the densities of
    /// [`Bsdf::sample_apart`]; zeros for a smooth coat.
    #[inline]
    pub(crate) fn evaluate_apart<F: Features>(
        &self,
        wo: Vec3,
        wi: Vec3,
        base_weight: f32,
    ) -> [(Rgb, f32); 2] {
        let (wo, wi) = (viewer(wo.into()), wi.to_array());
        match self.coat::<F>() {
            Some(coat) if wi[2] > 0.0 => {
                let coat = CoatLanes { base_weight, ..coat }.see(&COATS, wo[2]);
                coat.evaluate_apart(&COATS, wo, wi).map(|(f, pdf)| (f.into(), pdf))
            }
            _ => [(Rgb::ZERO, 0.0); 2],
        }
    }

    /// True for a coat, rough or smooth, whose peak is brighter than a quarter of a white diffuse surface
    /// (1 / π). At normal incidence the peak of GGX is F / (4 π α²).
    #[inline]
    pub(crate) fn has_narrow_coat(&self) -> bool {
        let is_narrow =
            |coat: CoatLanes<f32>| coat.alpha * coat.alpha < Rgb::from(coat.reflectance(1.0)).max_element();
        self.coat::<All>().is_some_and(is_narrow)
    }

    /// True for a coat that is not smooth.
    #[inline]
    pub(crate) fn has_rough_coat(&self) -> bool {
        self.coat::<All>().is_some_and(|coat| coat.alpha > 0.0)
    }

    /// Directional albedo of coat and base at normal incidence, an estimate; `None` without a coat.
    pub(super) fn coated_albedo(&self) -> Option<Rgb> {
        let coat = self.coat::<All>()?;
        let transmittance = Rgb::from(coat.transmittance(&COATS, 1.0));
        Some(Rgb::from(coat.reflectance(1.0)) + Rgb::from(coat.base) * transmittance * Rgb::from(coat.mean))
    }

    /// Transmittance of a coat at the cosine `c`.
    #[inline]
    pub(crate) fn transmittance_at(&self, c: f32) -> Rgb {
        self.coat::<All>().map_or(Rgb::ONE, |coat| coat.transmittance(&COATS, c).into())
    }
}
