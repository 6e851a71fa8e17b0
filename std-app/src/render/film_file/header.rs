//! Header of a film file: one JSON object, readable with `head -c`.

use super::audit::AuditEntry;
use super::identity::Identity;
use crate::render::{ErrorEstimate, Method, Round};
use halflight_core::audit::AuditState;
use halflight_core::film::Dropped;
use halflight_core::method::{RenderState, Shard};
use halflight_core::renderer::{Estimates, Rounds};
use halflight_core::transport::Counters;
use serde::{Deserialize, Serialize};

/// State of a film besides its pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::render) struct Header {
    pub(super) identity: Identity,
    /// Shard number, from 1, and number of shards.
    shard: [u32; 2],
    pub(in crate::render) shares: bool,
    pub(in crate::render) spp: u32,
    pub(in crate::render) rounds: u32,
    estimates: EstimatesEntry,
    pub(in crate::render) seconds: f64,
    paths: u64,
    rays: u64,
    shadow_rays: u64,
    dropped: Causes,
    /// Tiles with rejected samples, and their numbers by cause.
    ledger: Vec<(u32, Causes)>,
    history: Vec<Entry>,
    audit: Option<AuditEntry>,
}

/// Rejected samples: NaN, infinite, negative, unfinished.
type Causes = [u64; 4];

/// A round: seconds, samples, rays, and the estimated error with its interval.
type Entry = (f64, u32, u64, Option<[f64; 3]>);

impl Header {
    pub(in crate::render) fn new(
        identity: Identity,
        state: &RenderState,
        rounds: &Rounds,
        audit: Option<AuditState>,
        seconds: f64,
        history: &[Round],
    ) -> Self {
        let RenderState { shard, counters, dropped, .. } = state;
        Self {
            identity,
            shard: [shard.index + 1, shard.count],
            shares: state.is_correlated,
            spp: state.spp(),
            rounds: rounds.count(),
            estimates: estimates_entry(rounds.estimates()),
            seconds,
            paths: counters.paths,
            rays: counters.rays,
            shadow_rays: counters.shadow_rays,
            dropped: causes(counters.dropped),
            ledger: (0..)
                .zip(dropped.iter())
                .filter(|(_, dropped)| dropped.total() > 0)
                .map(|(tile, dropped)| (tile, causes(*dropped)))
                .collect(),
            history: history.iter().map(|r| (r.seconds, r.spp, r.rays, r.error.map(numbers))).collect(),
            audit: audit.map(|audit| AuditEntry::new(&audit)),
        }
    }

    /// Pixels across and down.
    pub(in crate::render) fn size(&self) -> [u32; 2] {
        [self.identity.width, self.identity.height]
    }

    /// `None` if this version does not know the method.
    pub(in crate::render) fn method(&self) -> Option<Method> {
        Method::named(&self.identity.method)
    }

    pub(in crate::render) fn shard(&self) -> Shard {
        Shard { index: self.shard[0].wrapping_sub(1), count: self.shard[1] }
    }

    pub(in crate::render) fn counters(&self) -> Counters {
        let dropped = dropped(self.dropped);
        Counters { paths: self.paths, rays: self.rays, shadow_rays: self.shadow_rays, dropped }
    }

    /// Tiles with rejected samples.
    pub(in crate::render) fn dropped(&self) -> impl Iterator<Item = (usize, Dropped)> {
        self.ledger.iter().map(|(tile, causes)| (*tile as usize, dropped(*causes)))
    }

    /// State of the audit, if there is one.
    pub(in crate::render) fn audit(&self) -> Option<AuditState<'_>> {
        self.audit.as_ref().map(AuditEntry::state)
    }

    /// Last and next estimate of the error.
    pub(in crate::render) fn estimates(&self) -> Estimates {
        let EstimatesEntry { next, last, first_noise } = self.estimates;
        Estimates { next, last: last.map(|(spp, error)| (spp, estimate(error))), first_noise }
    }

    pub(in crate::render) fn history(&self) -> Vec<Round> {
        let round = |&(seconds, spp, rays, error): &Entry| {
            let error = error.map(estimate);
            Round { seconds, spp, rays, error, reference: None }
        };
        self.history.iter().map(round).collect()
    }
}

/// State of error estimation: last and next estimate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct EstimatesEntry {
    next: u32,
    last: Option<(u32, [f64; 3])>,
    first_noise: Option<(u32, f64)>,
}

fn estimates_entry(Estimates { next, last, first_noise }: Estimates) -> EstimatesEntry {
    EstimatesEntry { next, last: last.map(|(spp, error)| (spp, numbers(error))), first_noise }
}

fn numbers(error: ErrorEstimate) -> [f64; 3] {
    [error.relmse, error.lower, error.upper]
}

fn estimate([relmse, lower, upper]: [f64; 3]) -> ErrorEstimate {
    ErrorEstimate { relmse, lower, upper }
}

fn causes(dropped: Dropped) -> Causes {
    [dropped.nan, dropped.infinite, dropped.negative, dropped.unfinished]
}

fn dropped([nan, infinite, negative, unfinished]: Causes) -> Dropped {
    Dropped { nan, infinite, negative, unfinished }
}
