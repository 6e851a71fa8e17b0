//! Path tracing joined with caustic photons by vertex merging (Georgiev et al. 2012).
//!
//! A prepass learns where photons should go, and whether they pay; if not, the picture is path traced alone,
//! with the same bits as without a prepass. An irradiance cache uses the same photons for its picture and its
//! records.

mod benefit;
mod emission;
mod photons;
mod points;
mod prepass;
mod receivers;
#[cfg(test)]
mod tests;

pub use emission::{CausticEmission, CausticSettings, least_footprint};
pub use photons::{CausticPhotons, RecordPhotons};
pub use points::PointReceivers;
pub(super) use points::{for_pilot_tiles, median_step};
pub use prepass::{Decision, Prepass, prepass, unseen, unseen_footprint};

use super::path::{PathTracing, Reuse};
use super::{Executor, LastMaps, PhotonUse, RenderContext, RenderMethod, Round};
use crate::bsdf::Features;
use crate::census::Census;
use crate::findings::Decision::LeftOut;
use crate::findings::{Finding, Findings, Value};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::scene::Scene;
use crate::transport::caustics::tracer::CausticPhotonTracer;
use crate::transport::path::WAVE;
use crate::transport::{CausticMerging, PathIntegrator, PathReuse};
use receivers::Receivers;

/// Working memory of a worker: that of paths or of light paths.
pub fn scratch<F: Features>() -> Footprint {
    PathIntegrator::<F>::scratch_with::<((), CausticMerging), PathReuse>(WAVE)
        .or(CausticPhotonTracer::<F>::scratch())
}

/// Least memory of photons and their prepass in a scene of so many lights, beside `reserved` bytes.
pub(super) fn least_memory(lights: usize, reserved: usize) -> usize {
    prepass::least(lights, reserved)
}

/// Memory of a prepass and of photon maps for a picture of so many `pixels` with so many `lights`.
pub(super) fn footprint(lights: usize, pixels: usize) -> Footprint {
    prepass::footprint(lights, pixels).and(photons::footprint(pixels))
}

/// True if `scene` has casters, receivers and light.
pub fn are_possible(scene: &Scene) -> bool {
    let census = Census::of(scene);
    let kinds = &census.surfaces;
    let metals = kinds.mirror + kinds.conductor + kinds.glossy;
    let casters = metals + kinds.dielectric + kinds.rough_dielectric + kinds.pane;
    casters > 0 && kinds.diffuse + kinds.glossy > 0 && census.has_light()
}

/// Use of caustic photons beside paths.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CausticUse {
    /// True if photons are merged into paths.
    pub used: bool,
    /// Estimated fraction of the picture's light that photons carry and path tracing finds badly; `None`
    /// without a prepass.
    pub share: Option<f64>,
    /// True if memory was too short for a prepass.
    pub lacks_memory: bool,
}

impl CausticUse {
    /// Findings on caustic photons and their maps, whose statistics are `photons`.
    pub fn findings(&self, photons: Option<PhotonUse>) -> Findings {
        let photons = photons.unwrap_or_default();
        let left_out = |reason| Some(Finding::new("caustic_photons", LeftOut, reason));
        let finding = match (self.lacks_memory, self.used, self.share) {
            (true, ..) => left_out("not enough memory: caustics may be missing or noisy"),
            (_, true, _) => Some(photons.caustic.unwrap_or_default().finding("caustic_photons")),
            (.., Some(_)) => left_out("they carry too little light by a pilot"),
            (.., None) => None,
        };
        let share = self.share.map(Value::Fraction);
        photons.findings().and(finding.map(|finding| finding.with_some("share_of_light", share)))
    }
}

/// Photons for `receivers` where a prepass and their first maps find that they pay.
///
/// # Errors
/// [`OutOfMemory`] where the executor's scratch is smaller than [`scratch`].
pub fn photons_that_pay<'a, F: Features>(
    context: &RenderContext<'a>,
    receivers: &mut impl Receivers<'a, F>,
    settings: CausticSettings,
    memory: &mut impl MemorySource<'a>,
    executor: &mut impl Executor,
) -> Result<(Option<CausticPhotons<'a>>, CausticUse), OutOfMemory> {
    let Prepass { decision, share, lacks_memory } = prepass(context, receivers, settings, memory, executor)?;
    let without = CausticUse { used: false, share, lacks_memory };
    let Decision::Photons(emission) = decision else { return Ok((None, without)) };
    let Some(mut photons) = CausticPhotons::new(context, emission, settings, memory)? else {
        return Ok((None, CausticUse { lacks_memory: true, ..without }));
    };
    let used = photons.pays(receivers, executor)?;
    Ok((used.then_some(photons), CausticUse { used, ..without }))
}

/// Path tracing of one picture, with caustic photons where they pay.
pub struct CausticPathTracing<'a, F> {
    paths: PathTracing<'a, F>,
    photons: Option<CausticPhotons<'a>>,
    finding: CausticUse,
}

impl<'a, F: Features> CausticPathTracing<'a, F> {
    /// `paths` joined with photons if a prepass finds that they pay.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is smaller than [`scratch`].
    pub fn new(
        context: &RenderContext<'a>,
        mut paths: PathTracing<'a, F>,
        settings: CausticSettings,
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        let (photons, finding) = photons_that_pay(context, &mut paths, settings, memory, executor)?;
        Ok(Self { paths, photons, finding })
    }

    /// `paths` alone, after the `finding` of a prepass.
    pub fn without_photons(paths: PathTracing<'a, F>, finding: CausticUse) -> Self {
        Self { paths, photons: None, finding: CausticUse { used: false, ..finding } }
    }

    /// Use of photons, and the reason.
    pub fn finding(&self) -> CausticUse {
        self.finding
    }

    /// Use of path reuse, and its pilot.
    pub fn reuse(&self) -> Reuse {
        self.paths.reuse()
    }

    /// The mean radiance of the picture by the pilot of paths.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the executor's scratch is too small.
    pub fn mean_radiance(&mut self, executor: &mut impl Executor) -> Result<f32, OutOfMemory> {
        self.paths.mean_radiance(executor)
    }

    /// Statistics of its photon maps, if it has some.
    pub fn statistics(&self) -> Option<PhotonUse> {
        self.photons.as_ref().map(|photons| photons.statistics())
    }

    /// Its photons, if it has some.
    pub fn photons(&mut self) -> Option<&mut CausticPhotons<'a>> {
        self.photons.as_mut()
    }
}

impl<F: Features> RenderMethod for CausticPathTracing<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        match &mut self.photons {
            None => self.paths.round(round),
            Some(photons) => match self.paths.reusing() {
                Some(integrator) => photons.round(&integrator, round),
                None => photons.round(self.paths.integrator(), round),
            },
        }
    }

    fn findings(&self) -> Findings {
        Findings::default().and(self.reuse().finding()).and(self.finding.findings(self.statistics()))
    }

    fn last_maps(&mut self) -> Result<LastMaps<'_>, OutOfMemory> {
        let caustic = self.photons.as_mut().map_or(Ok(None), CausticPhotons::last_map)?;
        Ok(LastMaps { global: None, caustic })
    }
}
