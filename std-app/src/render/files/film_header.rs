//! Header of a film file: one JSON object, readable with `head -c`.

use super::identity::{Identity, fingerprint};
use crate::render::{ErrorEstimate, Method, Round, Settings};
use halflight_core::audit::{AuditState, AuditWork};
use halflight_core::film::Pixel;
use halflight_core::method::{RenderState, Shard};
use halflight_core::renderer::{Estimates, Rounds};
use halflight_core::scene::Scene;
use serde::{Deserialize, Serialize};

/// State of a film besides its pixels, counters and rejected samples.
#[derive(Clone, Serialize, Deserialize)]
pub(in crate::render) struct FilmHeader {
    pub(super) identity: Identity,
    method: String,
    width: u32,
    height: u32,
    /// Shard number, from 1, and number of shards.
    shard: [u32; 2],
    pub(in crate::render) is_correlated: bool,
    /// True if the file has the surfaces that pixels see, for the reconstruction of a merged picture.
    pub(in crate::render) has_surfaces: bool,
    pub(in crate::render) spp: u32,
    pub(in crate::render) rounds: u32,
    /// Samples at the next estimate of the error; samples and result of the last one; samples and noise of
    /// the first precise one.
    next_estimate: u32,
    last_estimate: Option<(u32, Interval)>,
    first_noise: Option<(u32, f64)>,
    pub(in crate::render) seconds: f64,
    history: Vec<RoundEntry>,
    audit: Option<AuditEntry>,
}

/// An estimated error and the ends of its interval.
type Interval = [f64; 3];

/// Seconds, samples, rays and error of a round.
type RoundEntry = (f64, u32, u64, Option<Interval>);

impl FilmHeader {
    pub(in crate::render) fn new(
        (identity, method): (&Identity, Method),
        state: &RenderState,
        rounds: &Rounds,
        (audit, has_surfaces): (Option<AuditState>, bool),
        seconds: f64,
        history: &[Round],
    ) -> Self {
        let RenderState { shard, film, .. } = state;
        let Estimates { next, last, first_noise } = rounds.estimates();
        let entry = |round: &Round| (round.seconds, round.spp, round.rays, round.error.map(interval));
        Self {
            identity: identity.clone(),
            method: method.name().into(),
            width: film.width(),
            height: film.height(),
            shard: [shard.index + 1, shard.count],
            is_correlated: state.is_correlated,
            has_surfaces,
            spp: state.spp(),
            rounds: rounds.count(),
            next_estimate: next,
            last_estimate: last.map(|(spp, error)| (spp, interval(error))),
            first_noise,
            seconds,
            history: history.iter().map(entry).collect(),
            audit: audit.map(AuditEntry::new),
        }
    }

    /// Identity of the film of a render; `cache` identifies the cache with which it begins.
    pub(in crate::render) fn identity(
        scene: &Scene,
        method: Method,
        settings: &Settings,
        cache: Option<&str>,
    ) -> Identity {
        let choice = |choice: bool| if choice { "on" } else { "off" };
        let is_joined = settings.caustics && method.may_join_caustics();
        Identity::of_program()
            .with("method", method.name())
            .with("size", format_args!("{}x{}", settings.width, settings.height))
            .with("seed", settings.seed)
            .with_some("max-depth", settings.max_depth, "unlimited")
            .with_some("reuse", settings.reuse.map(choice), "auto")
            .with_some("windows", settings.environment_visibility.map(choice), "auto")
            .with_scene(scene)
            .with("camera", fingerprint(scene, "camera"))
            .with("caustics", choice(is_joined))
            .with_some("cache", cache, "none")
            .with("settings", settings.of_method(method))
    }

    /// Pixels across and down.
    pub(in crate::render) fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// `None` if this version does not know the method.
    pub(in crate::render) fn method(&self) -> Option<Method> {
        Method::named(&self.method)
    }

    pub(in crate::render) fn shard(&self) -> Shard {
        Shard::part(self.shard[0].wrapping_sub(1), self.shard[1])
    }

    /// State of the audit, if there is one.
    pub(in crate::render) fn audit(&self) -> Option<AuditState<'_>> {
        self.audit.as_ref().map(AuditEntry::state)
    }

    /// Last and next estimate of the error.
    pub(in crate::render) fn estimates(&self) -> Estimates {
        let last = self.last_estimate.map(|(spp, error)| (spp, estimate(error)));
        Estimates { next: self.next_estimate, last, first_noise: self.first_noise }
    }

    pub(in crate::render) fn history(&self) -> Vec<Round> {
        let round = |&(seconds, spp, rays, error): &RoundEntry| Round {
            seconds,
            spp,
            rays,
            error: error.map(estimate),
            reference: None,
        };
        self.history.iter().map(round).collect()
    }
}

fn interval(error: ErrorEstimate) -> Interval {
    [error.relmse, error.lower, error.upper]
}

fn estimate([relmse, lower, upper]: Interval) -> ErrorEstimate {
    ErrorEstimate { relmse, lower, upper }
}

/// Audited pixels, their weights and samples, and the work of the audit.
#[derive(Clone, Serialize, Deserialize)]
struct AuditEntry {
    #[serde(with = "AuditWorkEntry")]
    work: AuditWork,
    pixels: Vec<[u32; 2]>,
    weights: Vec<f32>,
    /// Bits of the audited pixels.
    truth: Vec<[u32; size_of::<Pixel>() / 4]>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "AuditWork")]
struct AuditWorkEntry {
    fraction: f64,
    samples: u32,
    rays: u64,
    seconds: f64,
    has_photons: bool,
    unseen: f64,
}

impl AuditEntry {
    fn new(state: AuditState) -> Self {
        let AuditState { work, pixels, weights, truth } = state;
        let truth = bytemuck::cast_slice(truth).to_vec();
        Self { work, pixels: pixels.to_vec(), weights: weights.to_vec(), truth }
    }

    fn state(&self) -> AuditState<'_> {
        let Self { work, pixels, weights, truth } = self;
        AuditState { work: *work, pixels, weights, truth: bytemuck::cast_slice(truth) }
    }
}
