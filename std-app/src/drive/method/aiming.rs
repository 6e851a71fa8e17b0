//! Which lights the photons of a map come from, and where they go: by what they bring to what is visible.
//!
//! A first look follows some light paths from all lights by their power, and asks which leave photons that count: where the
//! camera sees them, or where rays go that gather for what it sees. Where few do, lights and directions are chosen by what
//! they have brought (`halflight_core::light::GuideStats`), look by look, until enough have brought something. The last look says
//! whether that pays; if not, or if most paths count as it is, the power of lights decides as if nobody had looked.

use super::Stage;
use super::places::{self, PLACES};
use crate::drive::RenderError;
use crate::drive::memory::Memory;
use halflight_core::bsdf::Features;
use halflight_core::light::{EmissionSampler, GuideStats};
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::transport::photon_mapping::deposit::{
    PATHS, PhotonFilter, PhotonTracer, PhotonTracerSettings,
};
use halflight_core::transport::photon_mapping::visible_points::{VisiblePointSampler, VisiblePoints};

/// Light paths of each look; the map that those of the first are of, which no sample has; and looks after it, at most.
const LOOK: usize = 16 * PATHS;
const FIRST_MAP: u32 = 0x7fff_fff0;
const MOST_LOOKS: u32 = 3;

/// The share of light paths that count from which on power is good enough; the fewest to begin with, and the fewest of all
/// looks that tell of lights.
const MOST_SEEN: f64 = 0.5;
const FEWEST_TO_BEGIN: usize = 8;
const FEWEST_SEEN: usize = 512;

/// Variance of light that counts, at most, over that without guiding, where guiding pays.
const LESS: f64 = 0.5;

/// What its memory is counted as.
const STRUCTURE: &str = "emission";

/// Where photons count.
#[derive(Clone, Copy)]
pub(super) enum Wanted {
    /// Where the camera sees them, in discs of so many pixels.
    Seen(f32),
    /// Where rays end that gather for what it sees, and so far around.
    Gathered(f32),
}

/// The lights as they are to shine for a map.
pub(super) struct Aim<'l> {
    pub(super) emission: EmissionSampler<'l>,
    /// The share of light paths that count, where anybody looked,
    pub(super) seen: Option<f64>,
    /// and what it is by the power of lights, where they are aimed.
    pub(super) by_power: Option<f64>,
}

/// What a look tells.
struct Look {
    /// The cell of each path that counts, and what it brought.
    found: Vec<(u32, f32)>,
    /// The mean square of what a path brings over the square of its mean.
    spread: f64,
}

impl<'l> Aim<'l> {
    /// By power alone.
    pub(super) fn by_power(
        stage: &Stage,
        (memory, lines): (&mut Memory, &'l mut Vec<Line>),
    ) -> Result<Self, RenderError> {
        *lines = memory.take(STRUCTURE, EmissionSampler::footprint(stage.lights))?;
        Self::plain(stage, &mut Arena::new(bytemuck::cast_slice_mut(lines)))
    }

    fn plain(stage: &Stage, arena: &mut Arena<'l>) -> Result<Self, RenderError> {
        let Stage { scene, bvh, lights, .. } = *stage;
        let emission = EmissionSampler::build(scene, lights, &bvh.bounds(), arena)?;
        Ok(Self { emission, seen: None, by_power: None })
    }

    /// For maps of photons that are to `keep`, of paths of so many segments at most. By power alone where `others` bytes
    /// would not be left.
    pub(super) fn look_first<F: Features>(
        stage: &Stage,
        (keep, max_depth): (PhotonFilter, u32),
        wanted: Wanted,
        scratch: &mut [Vec<Line>],
        (memory, lines): (&mut Memory, &'l mut Vec<Line>),
        others: usize,
    ) -> Result<Self, RenderError> {
        let Stage { scene, bvh, lights, settings, .. } = *stage;
        let raster = VisiblePointSampler::new([settings.width, settings.height]);
        let raster = if matches!(wanted, Wanted::Gathered(_)) { raster.gathering() } else { raster };
        let of_caustics = keep == PhotonFilter::Caustic;
        let worth = if of_caustics {
            GuideStats::footprint(lights).and(GuideStats::guide_footprint(lights))
        } else {
            GuideStats::footprint_of_all(lights)
        };
        let kept = EmissionSampler::footprint(lights).and(worth);
        let found = Footprint::default().slice::<(u32, f32)>(LOOK);
        let needed = kept.bytes() + raster.footprint().bytes() + found.bytes();
        if !memory.has(needed.saturating_add(others)) {
            return Self::by_power(stage, (memory, lines));
        }
        *lines = memory.take(STRUCTURE, kept)?;
        let mut arena = Arena::new(bytemuck::cast_slice_mut(lines));
        let mut aim = Self::plain(stage, &mut arena)?;
        let worth = if of_caustics {
            GuideStats::aimed(scene, lights, &aim.emission, &mut arena)?.map(GuideStats::alone)
        } else {
            Some(GuideStats::of_all(lights, &mut arena)?)
        };
        let Some(mut worth) = worth else { return Ok(aim) };
        memory.set_aside(PLACES, found)?;
        let mut places = places::find::<F>(stage, &raster, scratch, memory)?;
        if let Some(map) = places.map()? {
            let sight = match wanted {
                Wanted::Seen(pixels) => {
                    VisiblePoints::new(&map, &raster, stage.discs(), pixels, settings.level)
                }
                Wanted::Gathered(radius) => VisiblePoints::within(&map, radius, settings.level),
            };
            let shot = PhotonTracerSettings { keep, seed: settings.seed, paths: LOOK as u32, max_depth };
            aim.learn((&mut worth, of_caustics), &mut arena, |emission, number| {
                let shooter = PhotonTracer::<F>::new(scene, bvh, lights, emission, shot, settings.level);
                Look::of(stage, &shooter, sight, FIRST_MAP + number, scratch)
            })?;
        }
        drop(places);
        memory.give_back(PLACES);
        Ok(aim)
    }

    /// Looks, and again by what was learned where that may pay.
    fn learn(
        &mut self,
        (worth, of_caustics): (&mut GuideStats<'l>, bool),
        arena: &mut Arena<'l>,
        mut look: impl FnMut(&EmissionSampler, u32) -> Result<Option<Look>, RenderError>,
    ) -> Result<(), RenderError> {
        let plain = self.emission;
        // By power; of all light by that of cells, which are known then, as those of mirrors and glass are not.
        let first = if of_caustics { plain } else { worth.guide(&plain, &mut arena.scratch())? };
        let Some(first) = look(&first, 0)? else { return Ok(()) };
        self.seen = Some(first.share());
        // What mirrors and refracts can be aimed at before anything was seen of it.
        let fewest = if of_caustics { 0 } else { FEWEST_TO_BEGIN };
        if first.share() >= MOST_SEEN || first.found.len() < fewest {
            return Ok(());
        }
        let learn = |worth: &mut GuideStats, look: &Look| {
            look.found.iter().for_each(|&(cell, power)| worth.learn(cell, power));
            if !of_caustics {
                worth.even_out(&plain);
            }
            look.found.len()
        };
        let mut seen = if of_caustics { 0 } else { learn(worth, &first) };
        // Where power alone found nothing, nothing is known of its spread, but that it is large.
        let most = if first.found.is_empty() { f64::INFINITY } else { LESS * first.spread };
        for number in 1..=MOST_LOOKS {
            let knew = seen;
            let Some(again) = look(&worth.guide(&plain, &mut arena.scratch())?, number)? else { break };
            seen += learn(worth, &again);
            if knew == 0 || seen < FEWEST_SEEN {
                continue;
            }
            if again.spread <= most {
                self.emission = worth.guide(&plain, arena)?;
                (self.seen, self.by_power) = (Some(again.share()), self.seen);
            }
            break;
        }
        Ok(())
    }
}

impl Look {
    /// Of the paths of map number `map`; `None` where the render is over.
    fn of<F: Features>(
        stage: &Stage,
        shooter: &PhotonTracer<F>,
        sight: VisiblePoints,
        map: u32,
        scratch: &mut [Vec<Line>],
    ) -> Result<Option<Self>, RenderError> {
        let mut found = vec![(0u32, 0.0f32); LOOK];
        let task = |task: usize, arena: &mut Arena, out: &mut [(u32, f32)]| {
            shooter.look((task, map), sight, arena, &mut |photon| {
                // All photons of a path come from one cell.
                out[photon.path] = (photon.cell, out[photon.path].1 + photon.power);
            })
        };
        if !stage.workers.look(&mut found, PATHS, scratch, &task)? {
            return Ok(None);
        }
        found.retain(|(_, power)| *power > 0.0 && power.is_finite());
        let powers = || found.iter().map(|(_, power)| f64::from(*power));
        let (sum, squares) = (powers().sum::<f64>(), powers().map(|power| power * power).sum::<f64>());
        Ok(Some(Self { spread: LOOK as f64 * squares / (sum * sum), found }))
    }

    /// The share of light paths that count.
    fn share(&self) -> f64 {
        self.found.len() as f64 / LOOK as f64
    }
}
