//! Header of a cache file: one JSON object.

use super::identity::{Identity, fingerprint};
use crate::render::{LobeSettings, Method, Settings};
use halflight_core::cache::irradiance::{IrradianceCache, Record};
use halflight_core::cache::radiance::PooledRecord;
use halflight_core::scene::Scene;
use serde::{Deserialize, Serialize};

/// Sixteen half floats of coefficients.
pub(super) type Register = [u16; 16];

/// View for which a cache was filled.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::render) struct View {
    camera: String,
    width: u32,
    height: u32,
    seed: u32,
}

impl View {
    pub(in crate::render) fn of(scene: &Scene, settings: &Settings) -> Self {
        let Settings { width, height, seed, .. } = *settings;
        Self { camera: fingerprint(scene, "camera"), width, height, seed }
    }

    /// Whether a cache filled for `self` suffices for `other`: another seed has the same gather points.
    fn serves(&self, other: &Self) -> bool {
        *self == View { seed: self.seed, ..other.clone() }
    }
}

/// One of the two caches in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::render) struct Half {
    pub(in crate::render) records: u32,
    /// Places gathered so far, which number the random streams of gather rays.
    pub(in crate::render) gathered: u32,
    /// Registers of the coefficients; none without a radiance cache.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(in crate::render) registers: u32,
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

impl Half {
    /// Counts of `cache`, for which light was gathered at `gathered` places.
    pub(in crate::render) fn of(cache: &IrradianceCache, gathered: u32) -> Self {
        let registers = cache.coefficients().map_or(0, |known| known.pool().registers().len());
        Self { records: cache.records().len() as u32, gathered, registers: registers as u32 }
    }

    /// Number of records that may have coefficients.
    pub(super) fn with_coefficients(&self) -> usize {
        if self.registers > 0 { self.records as usize } else { 0 }
    }

    /// Bytes of its sections.
    pub(in crate::render) fn bytes(&self) -> u64 {
        let records = u64::from(self.records) * size_of::<Record>() as u64;
        let pooled = (self.with_coefficients() * size_of::<PooledRecord>()) as u64;
        records + pooled + u64::from(self.registers) * size_of::<Register>() as u64
    }
}

/// Header of a cache file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::render) struct CacheHeader {
    pub(super) identity: Identity,
    /// Views for which the cache is complete.
    views: Vec<View>,
    pub(in crate::render) halves: [Half; 2],
}

impl CacheHeader {
    /// Header of a cache without records.
    pub(in crate::render) fn new(scene: &Scene, settings: &Settings) -> Self {
        Self::of(Self::identity(scene, settings))
    }

    pub(super) fn of(identity: Identity) -> Self {
        Self { identity, views: Vec::new(), halves: [Half::default(); 2] }
    }

    /// Everything that determines the values of records. Their positions depend on the views.
    pub(in crate::render) fn identity(scene: &Scene, settings: &Settings) -> Identity {
        let LobeSettings { basis, tolerance, degree } = settings.lobes;
        let lobes = format!("{}, lobe-degree {degree}, lobe-error {tolerance:e}", basis.name());
        let has_lobes = settings.method == Some(Method::RadianceCache);
        Identity::of_program()
            .with_scene(scene)
            .with_some("max-depth", settings.max_depth, "unlimited")
            .with("cache-metric", settings.cache.metric.name())
            .with("cache-error", format_args!("{:e}", settings.cache.allowed()))
            .with("cache-rays", settings.cache.strata().pow(2))
            .with_some("coefficients", has_lobes.then_some(lobes), "none")
    }

    /// Bytes of both halves.
    pub(in crate::render) fn bytes(&self) -> u64 {
        self.halves.iter().map(Half::bytes).sum()
    }

    /// Whether the cache is complete for `view`.
    pub(in crate::render) fn serves(&self, view: &View) -> bool {
        self.views.iter().any(|known| known.serves(view))
    }

    /// Adds `view` to the views for which the cache is complete.
    pub(in crate::render) fn is_filled_for(&mut self, view: View) {
        if !self.serves(&view) {
            self.views.push(view);
        }
    }

    /// Identifies the records of this cache, given scene and settings.
    pub(in crate::render) fn fingerprint(&self) -> String {
        format!("{:?} {:?}", self.views, self.halves)
    }
}
