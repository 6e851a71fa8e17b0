//! Predicted errors of paths, caches and light paths, by a trial and a pilot of counts. The difference of the
//! variances without and with records, divided by the gather rays of a record, is the noise of interpolated
//! light; it includes the difference of the estimators of direct light.

use super::Goal;
use super::method_pilot::{MethodPilot, SAMPLES};
use super::table::{Row, Table};
use super::trial::{IRRADIANCE, RADIANCE, SUPPLIES, Trial};
use crate::method::cache_resolution::{CacheResolution, CachedPicture};
use crate::method::counts::{self, PilotNoise};
use crate::method::tuned::{
    CACHED_RAY, COUNTS_RAYS, COUNTS_SHARE, FILLING_OF_LOBES, LEAST_GAIN, LEAST_GAIN_OF_LOBES,
    LIGHT_PATHS_ERROR, PHOTONS_ERROR, PROGRESSIVE_ERROR, RAYS_PER_SAMPLE,
};
use crate::method::{MethodKind, work_of_detail};

/// Candidates.
pub const ROWS: usize = 5;

/// Noise by the pilot of light paths, if one ran and path tracing is a choice.
fn pilot(light_paths: Result<counts::Choice, &'static str>) -> Option<PilotNoise> {
    light_paths.ok().filter(|choice| choice.gain.is_some()).map(|choice| choice.noise)
}

/// Path tracing, where it shows no noise.
fn paths_alone() -> Table<ROWS> {
    use MethodKind::{Bidirectional, IrradianceCache, Path, ProgressivePhotons, RadianceCache};
    let kinds = [Path, IrradianceCache, RadianceCache, Bidirectional, ProgressivePhotons];
    let mut rows = kinds.map(|kind| Row::without(kind, "paths show no noise"));
    rows[0].error = 0.0;
    Table(rows)
}

impl Trial {
    /// Work for each pixel that reaches `goal` by path tracing, in rays.
    fn budget(&self, goal: &Goal) -> f64 {
        let time = goal.rays.map(|rays| rays / self.pixels);
        let samples = goal.samples.map(|samples| f64::from(samples) * self.work[0]);
        let error = goal.error.map(|error| self.error_of_paths(1.0) / error);
        [time, samples, error].into_iter().flatten().fold(f64::INFINITY, f64::min)
    }

    /// Whether the pilot of light paths costs little beside the picture.
    pub fn affords_light_paths(&self, goal: &Goal) -> bool {
        self.budget(goal) * self.pixels > COUNTS_RAYS / COUNTS_SHARE
    }

    /// Whether the pilot of progressive photon mapping does: its samples have a light path for each pixel.
    pub fn affords_photons(&self, goal: &Goal) -> bool {
        self.budget(goal) > f64::from(SAMPLES) * RAYS_PER_SAMPLE / COUNTS_SHARE
    }

    /// Whether photons may be ahead of path tracing: it has some, or the pilot of `light_paths` finds light
    /// that the trial misses.
    pub fn may_need_photons(&self, goal: &Goal, light_paths: Result<counts::Choice, &'static str>) -> bool {
        let work = self.budget(goal);
        self.has_photons || self.error_of_rare_light(work, pilot(light_paths)) > self.error_of_paths(work)
    }

    /// relMSE of path tracing after so much work for each pixel by the pilot of light paths, which finds
    /// light that the few paths of the trial miss.
    fn error_of_rare_light(&self, work: f64, pilot: Option<PilotNoise>) -> f64 {
        pilot.map_or(0.0, |noise| {
            let samples = work / f64::from(noise.work_of_paths) / self.reuse;
            noise.rests[0].reduced(self.gains.samples).error(samples, self.pixels)
        })
    }

    /// relMSE of path tracing after so much work for each pixel.
    fn error_of_paths(&self, work: f64) -> f64 {
        self.reuse * self.noise[0] * self.work[0] / (self.gains.samples * work)
    }

    /// Row of a cache after so much work for each pixel, by the light that records supply ([`SUPPLIES`]).
    /// `noise` is that of samples of each, `left` what a reconstruction leaves of it.
    fn cached(&self, supply: usize, work: f64, noise: &[f64; SUPPLIES], left: f64) -> Row {
        let work_of_sample = CACHED_RAY * work_of_detail(self.triangles) * self.work[supply];
        let pixels = self.pixels / f64::from(self.caches.shards);
        let picture = CachedPicture {
            rays: work * pixels,
            samples: left * work_of_sample * pixels,
            gathered: (noise[0] - noise[supply]).max(0.0),
        };
        let (kind, of_lobes) = match supply {
            IRRADIANCE => (MethodKind::IrradianceCache, 1.0),
            _ => (MethodKind::RadianceCache, FILLING_OF_LOBES),
        };
        let filling = |resolution: CacheResolution| {
            of_lobes * resolution.predicted_filling(self.pixels, self.triangles)
        };
        let chosen = || picture.resolution(filling(CacheResolution::COARSEST));
        let resolution = self.caches.resolution.unwrap_or_else(chosen);
        Row {
            error: picture.error_after(&resolution, filling(resolution)),
            work: work_of_sample,
            least_gain: LEAST_GAIN_OF_LOBES,
            picture: Some(picture),
            ..Row::without(kind, "noise of a trial without the light of records")
        }
    }

    /// All candidates for `goal`. `without_caches` is a reason against caches; `light_paths` are the counts
    /// of a pilot, `photons` the pilot of progressive photon mapping, or the reasons for none.
    pub fn table(
        &self,
        goal: &Goal,
        without_caches: Option<&'static str>,
        light_paths: Result<counts::Choice, &'static str>,
        photons: Result<MethodPilot, &'static str>,
    ) -> Table<ROWS> {
        use MethodKind::{Bidirectional, Path, ProgressivePhotons, VertexMerging};
        if self.noise[0] <= 0.0 {
            return paths_alone();
        }
        let work = self.budget(goal);
        let pilot = pilot(light_paths);
        let factor = if self.has_photons { PHOTONS_ERROR } else { 1.0 };
        let of_trial = self.error_of_paths(work);
        let of_pilot = self.error_of_rare_light(work, pilot);
        let paths = Row {
            error: (factor * of_trial).max(of_pilot),
            work: self.work[0],
            least_gain: LEAST_GAIN,
            ..Row::without(
                Path,
                match of_pilot > factor * of_trial {
                    true => "rare light by the pilot of light paths",
                    false => "noise of a trial",
                },
            )
        };
        // Rare light is that of records or of the rest.
        let beside = |i: usize, gain: f64| match pilot {
            None => factor * self.noise[i] / gain,
            Some(noise) => {
                let samples = work / self.work[i];
                let rare = noise.rests[i].reduced(gain).error(samples, self.pixels);
                (factor * self.noise[i] / gain).max(samples * rare)
            }
        };
        let noise = core::array::from_fn(|i| match i {
            0 => self.noise[0] * paths.error / of_trial,
            _ => beside(i, 1.0),
        });
        let without_lobes = (!self.has_lobes).then_some("records serve no lobe of the scene");
        let gain = self.gains.beside_records(self.has_photons);
        let cached = |supply, without: Option<_>| {
            let row = self.cached(supply, work, &noise, beside(supply, gain));
            without.map_or(row, |reason| Row::without(row.kind, reason))
        };
        let merges = light_paths.is_ok_and(|choice| choice.counts.merging);
        let kind = if merges { VertexMerging } else { Bidirectional };
        let light_paths = match (pilot, light_paths) {
            (Some(PilotNoise { light_paths: noise, work: rays, .. }), Ok(choice))
                if choice.counts.light_paths > 0.0 =>
            {
                let samples = work / f64::from(rays);
                let noise = noise.reduced(self.gains.samples);
                let error = noise.error(samples / LIGHT_PATHS_ERROR, self.pixels);
                Row { error, work: rays.into(), ..Row::without(kind, choice.light_paths) }
            }
            (_, Ok(choice)) => Row::without(kind, choice.light_paths),
            (_, Err(reason)) => Row::without(kind, reason),
        };
        let photons = match photons {
            Err(reason) => Row::without(ProgressivePhotons, reason),
            Ok(pilot) => Row {
                error: PROGRESSIVE_ERROR * pilot.reduced(self.gains.samples).error(work),
                work: pilot.work,
                ..Row::without(ProgressivePhotons, "noise and blur of its first samples")
            },
        };
        Table([
            paths,
            cached(IRRADIANCE, without_caches),
            cached(RADIANCE, without_caches.or(without_lobes)),
            light_paths,
            photons,
        ])
    }
}
