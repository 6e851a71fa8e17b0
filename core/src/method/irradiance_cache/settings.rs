//! Settings of the caches of a picture, and the bytes of their tables.

use crate::cache::irradiance::{CellFlux, Metric};
use crate::cache::radiance::{LobeSettings, Representation, ServedLobes};
use crate::memory::Footprint;
use crate::method::cache_resolution::{CacheResolution, CachedPicture};
use crate::method::record_placement::{LobeGathering, step_footprint};
use crate::scene::Scene;

/// Strata along a side behind rough surfaces are half as many, in multiples of this.
const BLOCK: usize = 8;

/// Pixels for each record of a cache without a limit of memory.
const PIXELS_PER_RECORD: usize = 8;

/// The fewest records that it has memory for, for small pictures.
const FEWEST_RECORDS: usize = 4096;

/// Settings of both caches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheSettings {
    /// The rule of the validity radii.
    pub metric: Metric,
    /// Error allowed, in the unit of the metric.
    pub error: f32,
    /// Strata along a side of the hemisphere of a record.
    pub strata: usize,
    /// Records of each cache, if memory suffices; `None`: by the pixels of the picture.
    pub records: Option<u32>,
    /// Records that each cache has memory for at least, whatever is available.
    pub fewest: usize,
    /// Bytes that are to stay available.
    pub reserve: usize,
    /// True if records become wider where there was no time to fill the caches.
    pub widens: bool,
    /// Lobes that records serve; `None` for irradiance alone.
    pub lobes: Option<LobeSettings>,
    /// Picture whose cache may become finer than the settings say; they are then those of
    /// [`CacheResolution::COARSEST`].
    pub picture: Option<CachedPicture>,
}

impl CacheSettings {
    /// Records of each cache for a picture of so many pixels, if memory suffices.
    pub(in crate::method) fn records(&self, pixels: usize) -> usize {
        self.records.map_or((pixels / PIXELS_PER_RECORD).max(FEWEST_RECORDS), |records| records as usize)
    }

    /// Strata along a side of records that are seen, and of those behind rough surfaces, of which a pixel
    /// sees the mean.
    pub(super) fn strata_of(strata: usize) -> [usize; 2] {
        [strata, strata.div_ceil(2 * BLOCK) * BLOCK]
    }

    /// Most strata along a side of a record without coefficients.
    pub(super) fn most_strata(&self) -> usize {
        self.picture.map_or(self.strata, |_| self.strata.max(CacheResolution::FINEST.strata as usize))
    }

    /// Strata along a side for records with coefficients.
    pub(super) fn lobe_strata(&self) -> usize {
        self.lobes.map_or(0, |lobes| lobes.strata().max(self.strata))
    }

    /// Representation of the coefficients at most, if records have any.
    pub fn representation(&self) -> Option<Representation> {
        self.lobes.map(|lobes| lobes.representation())
    }

    /// Bytes of the tables of lobes in `scene`, and of their strata.
    pub fn lobe_footprint(&self, scene: &Scene) -> Footprint {
        match self.lobes {
            Some(lobes) => ServedLobes::footprint(scene, lobes.basis)
                .and(LobeGathering::footprint(self.lobe_strata(), lobes.representation())),
            None => Footprint::default(),
        }
    }

    /// Bytes of the tables of strata, and of the points of placement.
    pub fn gathering_footprint(&self) -> Footprint {
        let both = |strata| {
            let [seen, behind_rough] = Self::strata_of(strata).map(CellFlux::footprint);
            seen.and(behind_rough)
        };
        let finest = self.picture.map_or(Footprint::default(), |_| both(self.most_strata()));
        both(self.strata).and(finest).and(step_footprint())
    }
}
