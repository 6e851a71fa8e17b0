//! Chains of light paths for a method whose photons are of use where the camera sees them (`halflight_core::transport::chain`).
//!
//! A first look shoots some light paths and asks how many leave a photon that is seen. Where many do, chains have nothing to
//! bring, where next to none does, nothing to begin with: they are left out.

use super::Stage;
use super::photons::Drawer;
use super::places::{self, PLACES};
use crate::drive::RenderError;
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use core::sync::atomic::{AtomicBool, Ordering};
use halflight_core::bsdf::Features;
use halflight_core::light::Emission;
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::photon::{Photon, PhotonMap};
use halflight_core::transport::chain::{Chains, Share, Start, Starts};
use halflight_core::transport::shoot::{Keep, PATHS, ROOM, ShootSettings, Shooter};
use halflight_core::transport::sight::{Raster, Sight};
use std::collections::VecDeque;

/// Light paths of the look, and the map that they are of, which no sample has.
const LOOK: usize = 32 * PATHS;
const LOOK_MAP: u32 = 0x7fff_fffe;

/// The share of light paths that leave seen photons from which on independent ones are good enough: neighbours in a chain
/// are alike.
pub const MOST_SEEN: f64 = 0.1;

/// Paths that chains need to begin at, and maps that these come from, at most: fewer beginnings would be seen as stains.
const STARTS: f64 = 256.0;
const FEWEST_STARTS: f64 = 64.0;
const MOST_MAPS: usize = 32;

/// Tasks of a map, at least: one of independent paths, one of chains.
const FEWEST_TASKS: usize = 2;

/// Chains, where they are of use.
pub(super) struct Chaining {
    raster: Raster,
    places: Drawer,
    /// Of the widest disc, in pixels.
    pixels: f32,
    /// What independent paths keep of seen light.
    kept: f32,
    /// Whether path `i` of a map was seen.
    flags: Vec<AtomicBool>,
    /// Maps whose paths chains begin at.
    maps: usize,
    /// What was seen of the last maps of even numbers, and of odd ones: halves of the film have nothing in common.
    memories: [VecDeque<Seen>; 2],
    starts: Vec<Start>,
}

/// What was seen of the paths of a map.
struct Seen {
    map: u32,
    paths: Vec<u32>,
}

/// Working memory of a task.
pub(super) fn scratch<F: Features>() -> Footprint {
    Chains::<F>::scratch().or(Shooter::<F>::scratch())
}

impl Chaining {
    /// For maps of so many `tasks` of light paths, gathered from discs of so many `pixels` at most; `None` where chains
    /// are of no use, or `others` bytes would not be left. The second is what share of light paths was seen, where anybody
    /// looked.
    pub(super) fn look_first<F: Features>(
        stage: &Stage,
        (tasks, pixels): (usize, f32),
        emission: &Emission,
        scratch: &mut [Vec<Line>],
        memory: &mut Memory,
        others: usize,
    ) -> Result<(Option<Self>, Option<f64>), RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let raster = Raster::new([settings.width, settings.height]);
        let paths = tasks.div_ceil(2) * PATHS;
        // Of seen paths there are a tenth at most, or few.
        let most_starts = paths.max(MOST_MAPS * STARTS as usize);
        let own = Footprint::default().slice::<bool>(paths).slice::<Start>(2 * most_starts);
        let needed = raster.footprint().and(own).and(Footprint::default().slice::<bool>(LOOK));
        if tasks < FEWEST_TASKS || !memory.has(needed.bytes().saturating_add(others)) {
            return Ok((None, None));
        }
        let mut places = places::find::<F>(stage, &raster, scratch, memory)?;
        let Some(map) = places.map()? else { return Ok((None, None)) };
        let sight = sight(stage, &raster, &map, pixels);
        let shooter = shooter::<F>(stage, emission, LOOK);
        let look = |task: usize, arena: &mut Arena, out: &mut [bool]| {
            shooter.look((task, LOOK_MAP), sight, arena, &mut |photon| out[photon.path] = true)
        };
        let mut seen = vec![false; LOOK];
        if !workers.look(&mut seen, PATHS, scratch, &look)? {
            memory.give_back(PLACES);
            return Ok((None, None));
        }
        let share = seen.iter().filter(|seen| **seen).count() as f64 / LOOK as f64;
        let of_map = share * paths as f64;
        if share >= MOST_SEEN || of_map * (MOST_MAPS as f64) < FEWEST_STARTS {
            memory.give_back(PLACES);
            return Ok((None, Some(share)));
        }
        memory.set_aside(PLACES, own)?;
        let chaining = Self {
            raster,
            places,
            pixels,
            // Independent paths are as many as those of chains, and a share of them is seen.
            kept: (share / (1.0 + share)) as f32,
            flags: (0..paths).map(|_| AtomicBool::new(false)).collect(),
            maps: ((STARTS / of_map).ceil() as usize).clamp(1, MOST_MAPS),
            memories: Default::default(),
            starts: Vec::new(),
        };
        Ok((Some(chaining), Some(share)))
    }

    /// Fills `drawer`, which has room for `tasks`, with the photons of map number `map`: half of them are independent paths,
    /// the rest chains. Whether all were shot.
    pub(super) fn fill<F: Features>(
        &mut self,
        stage: &Stage,
        emission: &Emission,
        (drawer, tasks, map): (&mut Drawer, usize, u32),
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<bool, RenderError> {
        let Self { raster, places, pixels, kept, flags, maps, memories, starts } = self;
        let Some(places) = places.map()? else { return Ok(false) };
        let independent = tasks.div_ceil(2);
        let shooter = shooter::<F>(stage, emission, independent * PATHS);
        let share = Share { sight: sight(stage, raster, &places, *pixels), kept: *kept };
        let [even, odd] = memories;
        let memory = if map % 2 == 0 { even } else { odd };
        // Of a film that is resumed, or where chains began after all, maps before this one are looked at again.
        let before = (1..*maps as u32).rev().filter_map(|back| map.checked_sub(2 * back));
        memory.retain(|seen| seen.map < map && seen.map + 2 * *maps as u32 > map);
        for (place, before) in before.enumerate() {
            if memory.get(place).is_some_and(|seen| seen.map == before) {
                continue;
            }
            let mut all = vec![false; independent * PATHS];
            let look = |task: usize, arena: &mut Arena, out: &mut [bool]| {
                shooter.look((task, before), share.sight, arena, &mut |photon| out[photon.path] = true)
            };
            if !crew.pass(&mut all, PATHS, scratch, &look)? {
                return Ok(false);
            }
            memory.insert(place, Seen { map: before, paths: numbers(all.into_iter()) });
        }
        let workers = crew.workers;
        drawer.fill_with(workers, |photons| {
            let (ours, theirs) = photons.split_at_mut((independent * ROOM).min(photons.len()));
            flags.iter().for_each(|flag| flag.store(false, Ordering::Relaxed));
            let shoot = |task: usize, arena: &mut Arena, out: &mut [Photon]| {
                shooter.run_beside((task, map), &share, arena, out, &mut |path| {
                    if let Some(flag) = flags.get(path as usize) {
                        flag.store(true, Ordering::Relaxed);
                    }
                })
            };
            if !crew.pass(ours, ROOM, scratch, &shoot)? {
                return Ok(false);
            }
            let own = numbers(flags.iter().map(|flag| flag.load(Ordering::Relaxed)));
            memory.push_back(Seen { map, paths: own });
            starts.clear();
            let of_map = |seen: &Seen| {
                let map = seen.map;
                seen.paths.iter().map(move |path| Start { map, path: *path }).collect::<Vec<_>>()
            };
            starts.extend(memory.iter().flat_map(of_map));
            let from = Starts { seen: starts, of: (memory.len() * independent * PATHS) as u64 };
            let chains = Chains::new(&shooter, tasks - independent, share, from);
            let run = |task: usize, arena: &mut Arena, out: &mut [Photon]| chains.run(task, map, arena, out);
            Ok(crew.pass(theirs, ROOM, scratch, &run)?)
        })
    }
}

/// Which of `all` are.
fn numbers(all: impl Iterator<Item = bool>) -> Vec<u32> {
    all.zip(0..).filter_map(|(is, number)| is.then_some(number)).collect()
}

fn sight<'p>(stage: &Stage, raster: &Raster, places: &'p PhotonMap<'p>, pixels: f32) -> Sight<'p> {
    Sight::new(places, raster, stage.discs(), pixels, stage.settings.level)
}

/// Shoots so many paths of reflected light.
fn shooter<'s, F: Features>(stage: &Stage<'s>, emission: &'s Emission<'s>, paths: usize) -> Shooter<'s, F> {
    let Stage { scene, bvh, lights, settings, .. } = *stage;
    let max_depth = path_settings(settings).max_depth;
    let shot = ShootSettings { keep: Keep::Reflected, seed: settings.seed, paths: paths as u32, max_depth };
    Shooter::new(scene, bvh, lights, emission, shot, settings.level)
}
