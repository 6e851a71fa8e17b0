//! Which lights the photons of a map come from, and where they go: by what they bring to what is visible.
//!
//! A first look follows some light paths from all lights by their power, and asks which leave photons that count: where the
//! camera sees them, or where rays go that gather for what it sees. Where few do, lights and directions are chosen by what
//! they have brought (`halflight_core::light::Worth`). A second look says whether that pays; if not, or if most paths
//! count as it is, the power of lights decides as if nobody had looked.

use super::Stage;
use super::places::{self, PLACES};
use crate::drive::RenderError;
use crate::drive::memory::Memory;
use halflight_core::bsdf::Features;
use halflight_core::light::{Emission, Lights, Worth};
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::transport::shoot::{Keep, PATHS, ShootSettings, Shooter};
use halflight_core::transport::sight::{Raster, Sight};

/// Light paths of each look, and the maps that they are of, which no sample has.
const LOOK: usize = 16 * PATHS;
const LOOK_MAPS: [u32; 2] = [0x7fff_fffc, 0x7fff_fffd];

/// The share of light paths that count from which on power is good enough; and the fewest that tell of lights.
const MOST_SEEN: f64 = 0.5;
const FEWEST_SEEN: usize = 512;

/// What is left of the variance of light that counts, at most, where aiming pays.
const LESS: f64 = 0.7;

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

/// See the file.
pub(super) struct Aiming {
    lines: Vec<Line>,
    /// What cells are worth, where photons are aimed.
    learned: Option<Vec<f32>>,
    /// The share of light paths that count, where anybody looked,
    pub(super) seen: Option<f64>,
    /// and what it is by the power of lights, where they are aimed.
    pub(super) by_power: Option<f64>,
}

/// What a look tells.
struct Look {
    /// Of each cell.
    worth: Vec<f32>,
    paths: usize,
    /// The mean square of what a path brings over the square of its mean.
    spread: f64,
}

impl Aiming {
    /// By power alone.
    pub(super) fn by_power(lights: &Lights, memory: &mut Memory) -> Result<Self, RenderError> {
        let lines = memory.take(STRUCTURE, Emission::footprint(lights))?;
        Ok(Self { lines, learned: None, seen: None, by_power: None })
    }

    /// For maps of photons that are to `keep`, of paths of so many segments at most. By power alone where `others` bytes
    /// would not be left.
    pub(super) fn look_first<F: Features>(
        stage: &Stage,
        (keep, max_depth): (Keep, u32),
        wanted: Wanted,
        scratch: &mut [Vec<Line>],
        memory: &mut Memory,
        others: usize,
    ) -> Result<Self, RenderError> {
        let Stage { scene, bvh, lights, settings, .. } = *stage;
        let raster = Raster::new([settings.width, settings.height]);
        let raster = if matches!(wanted, Wanted::Gathered(_)) { raster.gathering() } else { raster };
        let cells = Footprint::default().slice::<f32>(Worth::cells_of_all(lights));
        let kept = Emission::footprint(lights).and(Worth::footprint_of_all(lights)).and(cells);
        let found = Footprint::default().slice::<(u32, f32)>(LOOK).and(cells);
        let needed = kept.bytes() + raster.footprint().bytes() + found.bytes();
        if !memory.has(needed.saturating_add(others)) {
            return Self::by_power(lights, memory);
        }
        let lines = memory.take(STRUCTURE, kept)?;
        let learned = Some(vec![0.0; Worth::cells_of_all(lights)]);
        let mut aiming = Self { lines, learned, seen: None, by_power: None };
        memory.set_aside(PLACES, found)?;
        let mut places = places::find::<F>(stage, &raster, scratch, memory)?;
        if let Some(map) = places.map()? {
            let sight = match wanted {
                Wanted::Seen(pixels) => Sight::new(&map, &raster, stage.discs(), pixels, settings.level),
                Wanted::Gathered(radius) => Sight::within(&map, radius, settings.level),
            };
            aiming.learn(stage, |emission, map| {
                let shot = ShootSettings { keep, seed: settings.seed, paths: LOOK as u32, max_depth };
                let shooter = Shooter::<F>::new(scene, bvh, lights, emission, shot, settings.level);
                Look::of(stage, &shooter, sight, map, scratch)
            })?;
        }
        drop(places);
        memory.give_back(PLACES);
        Ok(aiming)
    }

    /// Looks, and once more by what was learned where that may pay.
    fn learn(
        &mut self,
        stage: &Stage,
        mut look: impl FnMut(&Emission, u32) -> Result<Look, RenderError>,
    ) -> Result<(), RenderError> {
        let share = |look: &Look| look.paths as f64 / LOOK as f64;
        let first = look(&self.emission(stage)?, LOOK_MAPS[0])?;
        self.seen = Some(share(&first));
        if share(&first) < MOST_SEEN && first.paths >= FEWEST_SEEN {
            self.learned = Some(first.worth);
            let second = look(&self.emission(stage)?, LOOK_MAPS[1])?;
            if second.spread <= LESS * first.spread {
                (self.seen, self.by_power) = (Some(share(&second)), self.seen);
                return Ok(());
            }
        }
        self.learned = None;
        Ok(())
    }

    /// The lights as they are to shine.
    pub(super) fn emission<'m>(&'m mut self, stage: &Stage) -> Result<Emission<'m>, RenderError> {
        let Stage { scene, bvh, lights, .. } = *stage;
        let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut self.lines));
        let plain = Emission::build(scene, lights, &bvh.bounds(), &mut arena)?;
        let Some(learned) = &self.learned else { return Ok(plain) };
        let worth = Worth::of_all(lights, &plain, learned, &mut arena)?;
        Ok(worth.guide(&plain, &mut arena)?)
    }
}

impl Look {
    /// Of the paths of map number `map`.
    fn of<F: Features>(
        stage: &Stage,
        shooter: &Shooter<F>,
        sight: Sight,
        map: u32,
        scratch: &mut [Vec<Line>],
    ) -> Result<Self, RenderError> {
        let mut found = vec![(0u32, 0.0f32); LOOK];
        let task = |task: usize, arena: &mut Arena, out: &mut [(u32, f32)]| {
            shooter.look((task, map), sight, arena, &mut |photon| {
                // All photons of a path come from one cell.
                out[photon.path] = (photon.cell, out[photon.path].1 + photon.power);
            })
        };
        stage.workers.pass(&mut found, PATHS, scratch, &|| false, &task)?;
        let mut worth = vec![0.0; Worth::cells_of_all(stage.lights)];
        let (mut paths, mut sum, mut squares) = (0, 0.0, 0.0);
        for (cell, power) in found.into_iter().filter(|(_, power)| *power > 0.0 && power.is_finite()) {
            if let Some(worth) = worth.get_mut(cell as usize) {
                *worth += power;
            }
            paths += 1;
            sum += f64::from(power);
            squares += f64::from(power) * f64::from(power);
        }
        Ok(Self { worth, paths, spread: LOOK as f64 * squares / (sum * sum) })
    }
}
