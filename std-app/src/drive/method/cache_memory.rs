//! Memory of cached pictures beside their records and photons: tables of the strata that may be gathered, working memory
//! of threads.

use super::caustics;
use super::{Method, Stage};
use crate::drive::Settings;
use crate::drive::audit::Audit;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{CellFlux, IrradianceCache};
use halflight_core::memory::Footprint;
use halflight_core::transport::{CausticMerging, PathIntegrator, path::WAVE};

/// Strata along a side are multiples of this.
const BLOCK: usize = 8;

/// What a picture takes of memory, whatever is left of it for records and photons.
pub(super) struct Needs {
    /// Strata along a side that are gathered: for what rough surfaces see, and else.
    pub(super) strata: [usize; 2],
    /// Of each thread.
    pub(super) scratch: Footprint,
}

impl Needs {
    /// With photons of caustics or without.
    pub(super) fn of<F: Features>(stage: &Stage, has_caustics: bool) -> Self {
        let Stage { settings, .. } = *stage;
        let strata = settings.cache.strata() as usize;
        let coarse = strata.div_ceil(2 * BLOCK) * BLOCK;
        // Of paths that look caches up, and of gather rays, both beside photons.
        let gathering = PathIntegrator::<F>::gather_scratch_with::<((), CausticMerging)>(strata);
        let scratch = PathIntegrator::<F>::scratch_with::<((), CausticMerging), ()>(WAVE).or(gathering);
        let scratch = if has_caustics { scratch.or(caustics::scratch::<F>()) } else { scratch };
        Self { strata: [coarse, strata], scratch }
    }

    /// All of it.
    pub(super) fn bytes(&self, stage: &Stage) -> usize {
        let tables: usize = self.strata.iter().map(|&n| CellFlux::footprint(n).bytes()).sum();
        let scratch = self.scratch.bytes().saturating_mul(stage.workers.count());
        scratch.saturating_add(tables)
    }

    /// What comes after photons of caustics: the audit, and room for `fewest` records in each half.
    pub(super) fn later<F: Features>(stage: &Stage, fewest: usize) -> usize {
        let records = IrradianceCache::footprint(fewest).bytes().saturating_mul(2);
        Audit::bytes::<F>(stage, Method::IrradianceCache.is_biased()) + records
    }
}

/// Whether paths are long enough for light to be reflected by one surface before the one that is seen.
pub(super) fn has_indirect_light(settings: &Settings) -> bool {
    settings.max_depth.is_none_or(|depth| depth > 2)
}
