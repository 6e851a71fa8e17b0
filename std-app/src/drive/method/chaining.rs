//! Chains of light paths for a method whose photons are of use where the camera sees them (`halflight_core::transport::chain`).
//!
//! A first look shoots some light paths and asks how many leave a photon that is seen. Where most do, or none does, chains have
//! nothing to bring and are left out.

use super::Stage;
use super::photons::Drawer;
use crate::drive::RenderError;
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use core::sync::atomic::{AtomicBool, Ordering};
use halflight_core::bsdf::Features;
use halflight_core::light::Emission;
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::photon::Photon;
use halflight_core::transport::chain::{Chains, Share};
use halflight_core::transport::shoot::{Keep, PATHS, ROOM, ShootSettings, Shooter};
use halflight_core::transport::sight::{Raster, Sight};

/// Light paths of the look, and the map that they are of, which no sample has.
const LOOK: usize = 32 * PATHS;
const LOOK_MAP: u32 = 0x7fff_fffe;

/// The share of light paths that leave seen photons from which on independent ones are good enough: neighbours in a chain
/// are alike.
const MOST_SEEN: f64 = 0.1;

/// The smallest share of all paths that is left to chains where there are few tasks.
const FEWEST_TASKS: usize = 2;

/// Chains, where they are of use.
pub(super) struct Chaining {
    raster: Raster,
    places: Drawer,
    /// What independent paths keep of seen light.
    kept: f32,
    /// Whether path `i` of a map was seen.
    flags: Vec<AtomicBool>,
    starts: Vec<u32>,
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
        let Stage { scene, bvh, settings, workers, .. } = *stage;
        let raster = Raster::new([settings.width, settings.height]);
        let flags = tasks * PATHS * (size_of::<AtomicBool>() + size_of::<u32>());
        let needed = raster.footprint().bytes() + flags + LOOK;
        if std::env::var("NOCHAIN").is_ok() { return Ok((None, None)); }
        if tasks < FEWEST_TASKS || !memory.has(needed.saturating_add(others)) {
            return Ok((None, None));
        }
        let mut places = Drawer::new(raster.rays(), memory)?;
        let look = |task: usize, _: &mut Arena, out: &mut [Photon]| {
            raster.run::<F>(task, (scene, bvh, settings.level), settings.seed, out);
            Ok(Default::default())
        };
        places.fill_with(workers, |photons| {
            Ok(workers.pass(photons, Raster::TASK, scratch, &|| false, &look)?.1)
        })?;
        let mut chaining = Self { raster, places, kept: 1.0, flags: Vec::new(), starts: Vec::new() };
        let Some(map) = chaining.places.map()? else { return Ok((None, None)) };
        let sight = Sight::new(&map, &raster, stage.discs(), pixels, settings.level);
        let share = Share { sight, kept: 0.0 };
        let shooter = shooter::<F>(stage, emission, LOOK);
        let shoot = |task: usize, arena: &mut Arena, out: &mut [bool]| {
            let mut none = [];
            let first = (task * PATHS) as u32;
            let mut counters = shooter.run_beside((task, LOOK_MAP), &share, arena, &mut none, &mut |path| {
                if let Some(seen) = out.get_mut((path - first) as usize) {
                    *seen = true;
                }
            })?;
            counters.dropped = Default::default();
            Ok(counters)
        };
        let mut seen = vec![false; LOOK];
        workers.pass(&mut seen, PATHS, scratch, &|| false, &shoot)?;
        let share = seen.iter().filter(|seen| **seen).count() as f64 / LOOK as f64;
        if !(share > 0.0 && share < MOST_SEEN) {
            return Ok((None, Some(share)));
        }
        memory.set_aside("photons", Footprint::default().slice::<u8>(flags))?;
        // Independent paths are as many as those of chains, and a share of them is seen.
        let kept = (share / (1.0 + share)) as f32;
        let flags = (0..tasks.div_ceil(2) * PATHS).map(|_| AtomicBool::new(false)).collect();
        Ok((Some(Self { kept, flags, ..chaining }), Some(share)))
    }

    /// Fills `drawer`, which has room for `tasks`: half of them with independent paths, the rest with chains. Whether all were
    /// shot.
    pub(super) fn fill<F: Features>(
        &mut self,
        stage: &Stage,
        (emission, pixels): (&Emission, f32),
        (drawer, tasks, map): (&mut Drawer, usize, u32),
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<bool, RenderError> {
        let Self { raster, places, kept, flags, starts, .. } = self;
        let Some(places) = places.map()? else { return Ok(false) };
        let sight = Sight::new(&places, raster, stage.discs(), pixels, stage.settings.level);
        let share = Share { sight, kept: *kept };
        let independent = tasks.div_ceil(2);
        let shooter = shooter::<F>(stage, emission, independent * PATHS);
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
            starts.clear();
            let seen = flags.iter().enumerate().filter(|(_, flag)| flag.load(Ordering::Relaxed));
            starts.extend(seen.map(|(path, _)| path as u32));
            let chains = Chains::new(&shooter, tasks - independent, share, starts);
            let run = |task: usize, arena: &mut Arena, out: &mut [Photon]| chains.run(task, map, arena, out);
            Ok(crew.pass(theirs, ROOM, scratch, &run)?)
        })
    }
}

/// Shoots so many paths of reflected light.
fn shooter<'s, F: Features>(stage: &Stage<'s>, emission: &'s Emission<'s>, paths: usize) -> Shooter<'s, F> {
    let Stage { scene, bvh, lights, settings, .. } = *stage;
    let max_depth = crate::drive::run::path_settings(settings).max_depth;
    let shot = ShootSettings { keep: Keep::Reflected, seed: settings.seed, paths: paths as u32, max_depth };
    Shooter::new(scene, bvh, lights, emission, shot, settings.level)
}
