//! Which lights the photons of a map come from, and where they go: by what they bring to what is visible.
//!
//! A first look follows some light paths from all lights by their power, and asks which leave photons that count: where the
//! camera sees them, or where rays go that gather for what it sees. Where few do, lights and directions are chosen by what
//! they have brought (`halflight_core::light::Worth`), look by look, until enough have brought something. The last look says
//! whether that pays; if not, or if most paths count as it is, the power of lights decides as if nobody had looked.

use super::Stage;
use super::places::{self, PLACES};
use crate::drive::RenderError;
use crate::drive::memory::Memory;
use halflight_core::bsdf::Features;
use halflight_core::light::{Emission, Worth};
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::transport::shoot::{Keep, PATHS, ShootSettings, Shooter};
use halflight_core::transport::sight::{Raster, Sight};

/// Light paths of each look; the map that those of the first are of, which no sample has; and looks after it, at most.
const LOOK: usize = 16 * PATHS;
const FIRST_MAP: u32 = 0x7fff_fff0;
const MOST_LOOKS: u32 = 3;

/// The share of light paths that count from which on power is good enough; the fewest to begin with, and the fewest of all
/// looks that tell of lights.
const MOST_SEEN: f64 = 0.5;
const FEWEST_TO_BEGIN: usize = 8;
const FEWEST_SEEN: usize = 512;

/// What is left of the variance of light that counts, at most, where aiming pays; and the mean square of what a path brings over
/// the square of its mean, at most, where photons are seen: chains are as good as so much.
const LESS: f64 = 0.5;
const AS_CHAINS: f64 = 12.0;

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
    pub(super) emission: Emission<'l>,
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

/// What cells are worth, as far as it is known.
enum Learned<'l> {
    /// For photons of all light.
    All(Vec<f32>),
    /// For those of what mirrors and refracts, which is aimed at from the beginning.
    Caustics(Worth<'l>),
}

impl<'l> Aim<'l> {
    /// By power alone.
    pub(super) fn by_power(
        stage: &Stage,
        (memory, lines): (&mut Memory, &'l mut Vec<Line>),
    ) -> Result<Self, RenderError> {
        *lines = memory.take(STRUCTURE, Emission::footprint(stage.lights))?;
        Self::plain(stage, &mut Arena::new(bytemuck::cast_slice_mut(lines)))
    }

    fn plain(stage: &Stage, arena: &mut Arena<'l>) -> Result<Self, RenderError> {
        let Stage { scene, bvh, lights, .. } = *stage;
        let emission = Emission::build(scene, lights, &bvh.bounds(), arena)?;
        Ok(Self { emission, seen: None, by_power: None })
    }

    /// For maps of photons that are to `keep`, of paths of so many segments at most. By power alone where `others` bytes
    /// would not be left.
    pub(super) fn look_first<F: Features>(
        stage: &Stage,
        (keep, max_depth): (Keep, u32),
        wanted: Wanted,
        scratch: &mut [Vec<Line>],
        (memory, lines): (&mut Memory, &'l mut Vec<Line>),
        others: usize,
    ) -> Result<Self, RenderError> {
        let Stage { scene, bvh, lights, settings, .. } = *stage;
        let raster = Raster::new([settings.width, settings.height]);
        let raster = if matches!(wanted, Wanted::Gathered(_)) { raster.gathering() } else { raster };
        let kept = Emission::footprint(lights).and(Learned::footprint(stage, keep));
        let found = Footprint::default().slice::<(u32, f32)>(LOOK).and(Learned::beside(stage, keep));
        let needed = kept.bytes() + raster.footprint().bytes() + found.bytes();
        if !memory.has(needed.saturating_add(others)) {
            return Self::by_power(stage, (memory, lines));
        }
        *lines = memory.take(STRUCTURE, kept)?;
        let mut arena = Arena::new(bytemuck::cast_slice_mut(lines));
        let mut aim = Self::plain(stage, &mut arena)?;
        let Some(mut learned) = Learned::new(stage, keep, &aim.emission, &mut arena)? else { return Ok(aim) };
        memory.set_aside(PLACES, found)?;
        let mut places = places::find::<F>(stage, &raster, scratch, memory)?;
        if let Some(map) = places.map()? {
            let sight = match wanted {
                Wanted::Seen(pixels) => Sight::new(&map, &raster, stage.discs(), pixels, settings.level),
                Wanted::Gathered(radius) => Sight::within(&map, radius, settings.level),
            };
            let shot = ShootSettings { keep, seed: settings.seed, paths: LOOK as u32, max_depth };
            let most = if matches!(wanted, Wanted::Seen(_)) { AS_CHAINS } else { f64::INFINITY };
            aim.learn(stage, (&mut learned, most), &mut arena, |emission, number| {
                let shooter = Shooter::<F>::new(scene, bvh, lights, emission, shot, settings.level);
                Look::of(stage, &shooter, sight, FIRST_MAP + number, scratch)
            })?;
        }
        drop(places);
        memory.give_back(PLACES);
        Ok(aim)
    }

    /// Looks, and again by what was learned where that may pay: where the spread is `most` at most.
    fn learn(
        &mut self,
        stage: &Stage,
        (learned, most): (&mut Learned<'l>, f64),
        arena: &mut Arena<'l>,
        mut look: impl FnMut(&Emission, u32) -> Result<Look, RenderError>,
    ) -> Result<(), RenderError> {
        let first = look(&learned.by_power(stage, &self.emission, &mut arena.scratch())?, 0)?;
        self.seen = Some(first.share());
        if first.share() >= MOST_SEEN || first.found.len() < learned.fewest_to_begin() {
            return Ok(());
        }
        let mut seen = learned.learn_first(&first);
        for number in 1..=MOST_LOOKS {
            let knew = seen;
            let again = look(&learned.guide(stage, &self.emission, &mut arena.scratch())?, number)?;
            seen += learned.learn(&again);
            if knew == 0 || seen < FEWEST_SEEN {
                continue;
            }
            // Where power alone found nothing, nothing is known of its spread, but that it is large.
            let most = if first.found.is_empty() { most } else { most.min(LESS * first.spread) };
            if again.spread <= most {
                self.emission = learned.guide(stage, &self.emission, arena)?;
                (self.seen, self.by_power) = (Some(again.share()), self.seen);
            }
            break;
        }
        Ok(())
    }
}

impl<'l> Learned<'l> {
    /// Bytes that it takes in an arena, with the guide that is made of it.
    fn footprint(stage: &Stage, keep: Keep) -> Footprint {
        match keep {
            Keep::Caustic => Worth::footprint(stage.lights).and(Worth::guide_footprint(stage.lights)),
            _ => Worth::footprint_of_all(stage.lights),
        }
    }

    /// Bytes that it takes besides.
    fn beside(stage: &Stage, keep: Keep) -> Footprint {
        match keep {
            Keep::Caustic => Footprint::default(),
            _ => Footprint::default().slice::<f32>(Worth::cells_of_all(stage.lights)),
        }
    }

    /// Nothing yet. `None` where no photon is worth anything.
    fn new(
        stage: &Stage,
        keep: Keep,
        plain: &Emission<'l>,
        arena: &mut Arena<'l>,
    ) -> Result<Option<Self>, RenderError> {
        Ok(match keep {
            Keep::Caustic => Worth::aimed(stage.scene, stage.lights, plain, arena)?
                .map(Worth::alone)
                .map(Learned::Caustics),
            _ => Some(Learned::All(vec![0.0; Worth::cells_of_all(stage.lights)])),
        })
    }

    /// The fewest paths of the first look to learn from: what mirrors and refracts can be aimed at without.
    fn fewest_to_begin(&self) -> usize {
        match self {
            Learned::All(_) => FEWEST_TO_BEGIN,
            Learned::Caustics(_) => 0,
        }
    }

    /// Lights by their power.
    fn by_power<'m>(
        &self,
        stage: &Stage,
        plain: &Emission<'m>,
        arena: &mut Arena<'m>,
    ) -> Result<Emission<'m>, RenderError>
    where
        'l: 'm,
    {
        match self {
            // By the power of cells, so that these are known.
            Learned::All(_) => self.guide(stage, plain, arena),
            Learned::Caustics(_) => Ok(*plain),
        }
    }

    /// Lights by what was learned.
    fn guide<'m>(
        &self,
        stage: &Stage,
        plain: &Emission<'m>,
        arena: &mut Arena<'m>,
    ) -> Result<Emission<'m>, RenderError>
    where
        'l: 'm,
    {
        match self {
            Learned::All(learned) => {
                let worth = Worth::of_all(stage.lights, plain, learned, arena)?;
                Ok(worth.guide(plain, arena)?)
            }
            Learned::Caustics(worth) => {
                let worth: &Worth<'m> = worth;
                Ok(worth.guide(plain, arena)?)
            }
        }
    }

    /// From a look by power; from how many paths.
    fn learn_first(&mut self, look: &Look) -> usize {
        match self {
            Learned::All(_) => self.learn(look),
            // Where nothing is aimed there are no such cells.
            Learned::Caustics(_) => 0,
        }
    }

    /// From a look by what was learned before; from how many paths.
    fn learn(&mut self, look: &Look) -> usize {
        for (cell, power) in &look.found {
            match self {
                Learned::All(learned) => {
                    if let Some(worth) = learned.get_mut(*cell as usize) {
                        *worth += power;
                    }
                }
                Learned::Caustics(worth) => worth.learn(*cell, *power),
            }
        }
        look.found.len()
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
        found.retain(|(_, power)| *power > 0.0 && power.is_finite());
        let powers = || found.iter().map(|(_, power)| f64::from(*power));
        let (sum, squares) = (powers().sum::<f64>(), powers().map(|power| power * power).sum::<f64>());
        Ok(Self { spread: LOOK as f64 * squares / (sum * sum), found })
    }

    /// The share of light paths that count.
    fn share(&self) -> f64 {
        self.found.len() as f64 / LOOK as f64
    }
}
