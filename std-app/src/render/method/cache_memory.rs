//! Memory of irradiance caching besides records and photons: tables of strata, and working memory of threads.

use super::{Method, RenderSetup};
use crate::render::audit::Audit;
use halflight_core::bsdf::Features;
use halflight_core::memory::Footprint;
use halflight_core::method::caustics;
use halflight_core::method::irradiance_cache::{CacheSettings, IrradianceCaching};
use halflight_core::method::record_placement::CacheBuilder;

/// Settings of a picture's caches with room for at least `fewest` records each.
pub(super) fn settings<F: Features>(setup: &RenderSetup, fewest: usize) -> CacheSettings {
    let RenderSetup { settings, .. } = *setup;
    CacheSettings {
        metric: settings.cache.metric,
        error: settings.cache.allowed(),
        strata: settings.cache.strata() as usize,
        fewest,
        reserve: Audit::bytes::<F>(setup, Method::IrradianceCache.is_biased()),
        // Records saved to a file keep their validity radii.
        widens: settings.save_cache.is_none(),
    }
}

/// Working memory of a thread, with or without caustic photons.
pub(super) fn scratch<F: Features>(cache: &CacheSettings, has_caustics: bool) -> Footprint {
    let scratch = IrradianceCaching::<F>::scratch(cache);
    if has_caustics { scratch.or(caustics::scratch::<F>()) } else { scratch }
}

/// Bytes to leave when caustic photons take memory: for tables, for the fewest records of each cache, and for
/// the audit.
pub(super) fn later(cache: &CacheSettings) -> usize {
    let records = CacheBuilder::footprint(cache.fewest).bytes().saturating_mul(2);
    let tables = cache.gathering_footprint().bytes();
    records.saturating_add(tables).saturating_add(cache.reserve)
}
