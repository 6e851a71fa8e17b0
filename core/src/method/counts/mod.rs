//! Counts of techniques that suit a picture, down to none: path tracing alone.
//!
//! The scene itself rules some out. Then a [`pilot`] predicts noise × work of all candidates, in rays
//! rather than seconds, so that the choice follows from scene, settings and seed alone. Path tracing has
//! its own means beside it, path reuse and caustic photons, whose pilots are asked before light paths are
//! chosen.

pub mod pilot;
pub mod prediction;
pub mod rarity;

use self::pilot::{Found, PilotSettings, RESTS};
use self::prediction::{CANDIDATES, Candidate, Given};
use self::rarity::Rarity;
use super::bidirectional::{Bidirectional, BidirectionalSettings};
use super::caustics;
use super::tuned::{CAUSTIC_LIGHT, LEAST_GAIN, REUSE_GAIN};
use super::{Executor, RenderContext};
use crate::bsdf::Features;
use crate::census::Census;
use crate::findings::{Decision, Finding, Findings, Value};
use crate::memory::{Footprint, MemorySource, OutOfMemory};

/// Counts that suit a picture, and why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Numbers of techniques.
    pub counts: Candidate,
    /// Noise × work of path tracing over that of the best other counts; `None` where no pilot ran, or where
    /// path tracing is no choice.
    pub gain: Option<f32>,
    /// Noise × work of the best counts without connections, path tracing included, over that of the best.
    pub gain_of_connections: f32,
    /// Noise and work by the pilot.
    pub noise: PilotNoise,
    /// Reason for the number of light paths.
    pub light_paths: &'static str,
    /// Reason for the number of connections.
    pub connections: &'static str,
    /// Reason for merging or not; `None` where that was given.
    pub merging: Option<&'static str>,
}

/// Working memory of a worker.
pub fn scratch<F: Features>() -> Footprint {
    let settings = BidirectionalSettings::default();
    pilot::scratch::<F>().or(Bidirectional::<F>::scratch(&settings))
}

/// Counts for a picture of `context`, as far as `settings` leave them open, by a pilot with one pixel for
/// each `part` of the picture, which may have caustic photons; `None` where all are given or memory is too
/// short for a pilot.
///
/// # Errors
/// [`OutOfMemory`] where the scratch of the executor is smaller than [`scratch`].
pub fn choose<'a, F: Features>(
    context: &RenderContext<'a>,
    (settings, part, has_photons): (&BidirectionalSettings, usize, bool),
    memory: &mut impl MemorySource<'a>,
    executor: &mut impl Executor,
) -> Result<Option<Choice>, OutOfMemory> {
    let BidirectionalSettings { light_paths, connections, merging } = *settings;
    if settings.is_complete() {
        return Ok(None);
    }
    let is_open = light_paths.is_none() && connections.is_none() && merging != Some(true);
    if let Some(reason) = structural(context).filter(|_| is_open) {
        return Ok(Some(Choice::paths(reason)));
    }
    let may_merge = caustics::are_possible(context.scene);
    let given = Given {
        light_paths: light_paths.map(|paths| paths as f32 / context.pixels() as f32),
        connections,
        merging: if may_merge { merging } else { merging.or(Some(false)) },
    };
    let candidates = Candidate::all(&given);
    let merges = may_merge && merging != Some(false);
    let emission = Bidirectional::<F>::emission(context, (merges, 0), memory, executor)?;
    let pilot = PilotSettings { part, merging: may_merge, has_photons };
    let Some(found) = pilot::run::<F>(context, &emission, (&candidates, pilot), memory, executor)? else {
        return Ok(None);
    };
    let without = match may_merge {
        true => "no caustic is seen through a mirror or glass",
        false => "nothing mirrors or refracts light narrowly",
    };
    let choice = Choice::by_pilot(&found, &candidates, merging.is_none().then_some(without));
    Ok(Some(match is_open {
        true => choice.or_paths("path tracing has less noise for the work by a pilot"),
        false => Choice { gain: None, ..choice },
    }))
}

/// The reason for which the scene of `context` needs no light paths, if there is one.
fn structural(context: &RenderContext) -> Option<&'static str> {
    let census = Census::of(context.scene);
    let lamps = census.emissive + census.point_lights + census.spot_lights + census.directional_lights;
    match lamps {
        _ if context.lights.is_empty() => Some("the scene has no light"),
        0 if !caustics::are_possible(context.scene) => {
            Some("the sky is the only light, and nothing mirrors or refracts")
        }
        _ => None,
    }
}

/// Noise and work of a picture, by the pilot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PilotNoise {
    /// Noise of light paths with the chosen counts.
    pub light_paths: Rarity,
    /// Rays of a sample of a pixel with the chosen counts.
    pub work: f32,
    /// Noise of path tracing: all light that its caustic photons leave, the rest beside records of
    /// irradiance, and that beside records of lobes.
    pub rests: [Rarity; RESTS],
    /// Rays of a sample of a pixel by path tracing.
    pub work_of_paths: f32,
}

/// Finding on `topic`, if the part is used.
fn used<'f>(findings: &'f Findings, topic: &str) -> Option<&'f Finding> {
    findings.get(topic).filter(|finding| finding.decision != Decision::LeftOut)
}

/// True if the photons of path tracing are its means against rare light.
fn has_caustic_photons(findings: &Findings) -> bool {
    let share = used(findings, "caustic_photons").and_then(|finding| finding.number("share_of_light"));
    share.is_some_and(|share| share > CAUSTIC_LIGHT)
}

impl Choice {
    /// Light paths, connections and merges.
    pub fn findings(&self) -> Findings {
        let counts = &self.counts;
        let has_light_paths = counts.light_paths > 0.0;
        let finding = |topic, is_used, reason| {
            Finding::new(topic, if is_used { Decision::Used } else { Decision::LeftOut }, reason)
        };
        let number = |value: f32| Value::Number(value.into());
        let light_paths = finding("light_paths", has_light_paths, self.light_paths)
            .with("per_pixel", number(counts.light_paths))
            .with_some("gain", self.gain.map(number))
            .with_some("noise", has_light_paths.then_some(number(self.noise.light_paths.noise())))
            .with_some("work", has_light_paths.then_some(number(self.noise.work)));
        let connections = finding("connections", counts.connections > 0, self.connections)
            .with("per_vertex", Value::Count(counts.connections.into()));
        let merging = self.merging.map(|reason| finding("merging", counts.merging, reason));
        Findings::from(light_paths).and(Some(connections)).and(merging)
    }

    /// Settings of a picture of `context`, with what is `given`.
    pub fn settings(&self, given: &BidirectionalSettings, context: &RenderContext) -> BidirectionalSettings {
        let light_paths = (self.counts.light_paths * context.pixels() as f32) as u32;
        BidirectionalSettings {
            light_paths: given.light_paths.or(Some(light_paths.max(1))),
            connections: Some(self.counts.connections),
            merging: Some(self.counts.merging),
        }
    }

    /// Path tracing alone, for a `reason`.
    pub(super) fn paths(reason: &'static str) -> Self {
        let without = "there are no light paths";
        Self {
            counts: Candidate::PATHS,
            gain: None,
            gain_of_connections: 1.0,
            noise: PilotNoise::default(),
            light_paths: reason,
            connections: without,
            merging: None,
        }
    }

    /// The best of the `candidates` with light paths; `merging` is the reason for no merges where none was
    /// seen.
    fn by_pilot(found: &Found, candidates: &[Candidate; CANDIDATES], merging: Option<&'static str>) -> Self {
        let products = || {
            let with =
                |(counts, found_with): (_, Rarity)| (found_with.noise() * found.work.of(counts), counts);
            candidates.iter().zip(found.candidates).map(with)
        };
        let best = products().enumerate().skip(1).min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
        let best = best.map_or(1, |(index, _)| index);
        let unconnected = products().filter(|(_, counts)| counts.connections == 0);
        let unconnected = unconnected.map(|(product, _)| product).fold(f32::INFINITY, f32::min);
        let (counts, light_paths) = (candidates[best], found.candidates[best]);
        let (work, work_of_paths) = (found.work.of(&counts), found.work.of(&Candidate::PATHS));
        let product = light_paths.noise() * work;
        let alone = found.candidates[0].noise() * work_of_paths;
        Self {
            counts,
            gain: Some(if alone > 0.0 { alone / product } else { 0.0 }),
            gain_of_connections: if unconnected > 0.0 { unconnected / product } else { 0.0 },
            noise: PilotNoise {
                light_paths: light_paths.without(found.edges),
                work,
                rests: found.rests,
                work_of_paths,
            },
            light_paths: "they reduce noise for the work by a pilot",
            connections: match counts.connections {
                0 => "splats alone have less noise for the work by a pilot",
                _ => "they reduce noise for the work by a pilot",
            },
            merging: match counts.merging {
                _ if merging.is_none() => None,
                true => Some("photons reduce noise for the work by a pilot"),
                false if found.merged == 0.0 => merging,
                false => Some("it costs more than it gains by a pilot"),
            },
        }
    }

    /// The choice beside path tracing with its own means, path reuse and caustic photons, by its `findings`.
    pub fn beside(mut self, findings: &Findings) -> Self {
        let Some(gain) = self.gain.filter(|_| self.counts.light_paths > 0.0) else { return self };
        let number = |name| used(findings, "path_reuse").and_then(|finding| finding.number(name));
        if let (Some(gained), Some(cost)) = (number("gain"), number("cost")) {
            self.gain = Some(gain * (cost / gained.min(REUSE_GAIN)) as f32);
        }
        // Photons find what splats and merges find of caustics.
        let has_photons = has_caustic_photons(findings);
        if has_photons {
            self.gain = self.gain.map(|gain| gain.min(self.gain_of_connections));
        }
        self.or_paths(match has_photons {
            true => "caustic photons have less noise for the work by a pilot",
            false => "path reuse has less noise for the work by a pilot",
        })
    }

    /// Path tracing for a `reason`, where the gain is too small. What the pilot has found stays.
    fn or_paths(self, reason: &'static str) -> Self {
        let Self { counts, light_paths, connections, merging, .. } = Self::paths(reason);
        match self.gain <= Some(LEAST_GAIN as f32) {
            true => Self { counts, light_paths, connections, merging, ..self },
            false => self,
        }
    }
}
