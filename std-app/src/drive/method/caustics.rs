//! Path tracing joined with photons of caustics (`halflight_core::transport::caustics`), which a [`Caster`] shoots.
//!
//! A first look shoots some photons at all that mirrors or refracts, and learns which of them show in the picture: where
//! that is not worth it (`caustic_look.rs`), the picture is path traced alone, as if photons had never been asked for.
//! Otherwise it is where most of them go from then on.

use super::caster::{Cast, Caster, FIRST_RADIUS, shooter};
use super::caustic_look::{Looked, missing, useful};
use super::path::Paths;
use super::photon_view::PhotonView;
use super::sppm::ProgressivePhotons;
use super::{Method, Renderer, Stage};
use crate::drive::audit::Audit;
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::{RenderError, Reuse};
use halflight_core::bsdf::Features;
use halflight_core::census::Census;
use halflight_core::light::{EmissionSampler, GuideStats, LightSampler};
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::method::PhotonUse;
use halflight_core::photon::Photons;
use halflight_core::transport::caustics::tracer::{CausticPhotonTracer, GuideSample, PATHS, ROOM};
use halflight_core::transport::{CausticMerging, PathIntegrator, PathReuse, RadiusSchedule, path::WAVE};

/// Light paths of a glance, which tells where there is next to nothing to find, and of each look after it.
const GLANCE: usize = 4 * PATHS;
const LOOK: usize = 32 * PATHS;

/// The share of the picture's light from which on photons may have all of it, where the method is left to us: paths find
/// next to none. But those of `sppm` are not aimed: so many of them must show, to those that are.
const MOST_SHARE: f64 = 0.75;
const LEAST_BY_CHANCE: f64 = 0.25;

/// What the look of a judge takes, the map of its photons, and how often its paths must find light to know of it.
const JUDGE: &str = "look of the audit";
const JUDGE_MAP: u32 = 0x7fff_ff00;
const FEWEST_HITS: f64 = 64.0;

/// Whether paths were joined with photons of caustics.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CausticUse {
    /// They were.
    pub used: bool,
    /// About what share of the picture's light photons bring that paths find badly, by a first look; `None` where nobody
    /// looked.
    pub share: Option<f64>,
    /// There was no memory to look for them.
    pub lacks_memory: bool,
}

/// Whether anything could throw a caustic.
pub(super) fn are_possible(stage: &Stage) -> bool {
    stage.settings.caustics && may_be(stage)
}

fn may_be(stage: &Stage) -> bool {
    let census = Census::of(stage.scene);
    let kinds = &census.surfaces;
    let mirrors = kinds.mirror + kinds.conductor + kinds.glossy + kinds.dielectric + kinds.rough_dielectric;
    mirrors > 0 && kinds.diffuse + kinds.glossy > 0 && census.has_light()
}

/// Working memory of paths and of light paths.
pub(super) fn scratch<F: Features>() -> Footprint {
    PathIntegrator::<F>::scratch_with::<((), CausticMerging), PathReuse>(WAVE)
        .or(CausticPhotonTracer::<F>::scratch())
}

/// Memory of a look.
pub(super) fn footprint(lights: &LightSampler) -> Footprint {
    let guide = GuideStats::guide_footprint(lights);
    EmissionSampler::footprint(lights).and(guide).and(GuideStats::footprint(lights)).and(guide).and(guide)
}

/// Bytes of a few photons.
pub(super) fn least_photons() -> usize {
    2 * Photons::footprint(ROOM).bytes()
}

/// Whether there is memory for a look, and for a few photons after it.
pub(super) fn has_memory(memory: &Memory, lights: &LightSampler, others: usize) -> bool {
    memory.has((footprint(lights).bytes() + least_photons()).saturating_add(others))
}

/// What a first look finds: how photons are to be shot, if they are worth it; and whether they may have all light.
pub(super) fn look_first<'l, F: Features>(
    stage: &Stage,
    paths: &mut Paths<F>,
    beside_records: bool,
    arena: &mut Arena<'l>,
) -> Result<(Option<Cast<'l>>, bool), RenderError> {
    let Stage { scene, bvh, lights, settings, .. } = *stage;
    let discs = stage.discs();
    let plain = EmissionSampler::build(scene, lights, &bvh.bounds(), arena)?;
    let eye = Eye { discs, beside_records };
    if !glance::<F>(stage, paths, (&plain, &eye), &mut arena.scratch())?
        .is_some_and(|glance| glance.may_pay())
    {
        return Ok((None, false));
    }
    let Some(mut worth) = GuideStats::aimed(scene, lights, &plain, arena)? else { return Ok((None, false)) };
    let aimed = worth.guide(&plain, arena)?;
    for find in look::<F>(stage, paths, &aimed, &eye, (LOOK, 0))? {
        worth.learn(find.cell, find.worth);
    }
    let learned = worth.guide(&plain, arena)?;
    let finds = look::<F>(stage, paths, &learned, &eye, (LOOK, 1))?;
    finds.iter().for_each(|find| worth.learn(find.cell, find.worth));
    let beside = beside::<F>(stage, paths, &learned, &eye)?;
    let looked = looked(stage, paths, &finds, beside);
    drop(finds);
    let is_open = settings.method.is_none() && settings.resume.is_none();
    let mut is_all = false;
    if is_open && looked.share >= MOST_SHARE {
        let by_chance = useful(&look::<F>(stage, paths, &plain, &eye, (LOOK, 2))?);
        is_all = by_chance > 0.0 && by_chance >= LEAST_BY_CHANCE * looked.useful;
    }
    let emission = looked.pays(stage, paths)?.then(|| worth.guide(&plain, arena)).transpose()?;
    paths.caustics.used = emission.is_some() && !is_all;
    let Some(emission) = emission else { return Ok((None, false)) };
    let (pilot, shared) = paths.pilot(stage, looked.mean as f32)?;
    let (plenty, alone) = (looked.plenty(), looked.alone(&pilot, shared));
    Ok((Some(Cast { emission, discs, plenty, alone }), is_all))
}

/// Takes the memory, sets the method up, and hands it to `then`.
pub(super) fn with<'a, F: Features, T>(
    stage: &Stage<'a>,
    memory: &mut Memory<'a>,
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let mut paths = Paths::<F>::with_scratch(stage, memory, scratch::<F>())?;
    let others = Audit::bytes::<F>(stage, Method::Path.is_biased());
    // Where memory is short, paths go without.
    if !has_memory(memory, stage.lights, others) {
        paths.caustics.lacks_memory = true;
        return then(&mut paths, memory);
    }
    let mut lines = memory.take("emission", footprint(stage.lights))?;
    let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut lines));
    let (cast, is_all) = look_first::<F>(stage, &mut paths, false, &mut arena)?;
    if is_all {
        drop((lines, paths));
        ["emission", "paths"].into_iter().for_each(|structure| memory.give_back(structure));
        return then(&mut ProgressivePhotons::<F>::new(stage, memory)?, memory);
    }
    let Some(cast) = cast else {
        drop(lines);
        memory.give_back("emission");
        return then(&mut paths, memory);
    };
    let mut caster = Caster::new(stage, memory, cast, false, others)?;
    let pair = (&paths.tracer().clone(), paths.reuse().used);
    if caster.pays(pair, &mut paths.scratch)? {
        return then(&mut Joined { paths, caster }, memory);
    }
    drop(caster);
    drop(lines);
    ["photons", "emission"].into_iter().for_each(|structure| memory.give_back(structure));
    paths.caustics.used = false;
    then(&mut paths, memory)
}

/// How photons are seen.
struct Eye {
    discs: RadiusSchedule,
    /// Beside a cache.
    beside_records: bool,
}

/// What a few light paths tell that go to all that mirrors or refracts; `None` where nothing does.
fn glance<'l, F: Features>(
    stage: &Stage,
    paths: &mut Paths<F>,
    (plain, eye): (&EmissionSampler<'l>, &Eye),
    arena: &mut Arena<'l>,
) -> Result<Option<Looked>, RenderError> {
    let Some(worth) = GuideStats::aimed(stage.scene, stage.lights, plain, arena)? else { return Ok(None) };
    let finds = look::<F>(stage, paths, &worth.guide(plain, arena)?, eye, (GLANCE, 0))?;
    let mean = paths.mean(stage)?;
    Ok(Some(looked(stage, paths, &finds, mean)))
}

/// The mean radiance of what is seen beside photons of a look. Not that of the picture, of which a lamp that is seen, or a path that
/// meets one through glass, may be nearly all, or not be there by chance.
fn beside<F: Features>(
    stage: &Stage,
    paths: &mut Paths<F>,
    emission: &EmissionSampler,
    eye: &Eye,
) -> Result<f32, RenderError> {
    let (_, discs) = shooter::<F>(stage, emission, LOOK, (eye.discs, 0), eye.beside_records);
    // Weights alone: no photon adds to what paths find.
    let mut line = [Line([0; _])];
    let none = Photons::new(0, &mut Arena::new(bytemuck::cast_slice_mut(&mut line)))?.build(0);
    let merging =
        CausticMerging::new([&none; 2], emission, discs, LOOK as u32).beside_records(eye.beside_records);
    let tracer = paths.tracer().with_caustics(merging);
    Ok(stage.workers.pilot_rest(&tracer, &mut paths.scratch)?)
}

/// What `finds` tell together, where all other light has such a mean radiance.
fn looked<F: Features>(stage: &Stage, paths: &mut Paths<F>, finds: &[GuideSample], mean: f32) -> Looked {
    let pixels = f64::from(stage.settings.width) * f64::from(stage.settings.height);
    let looked = Looked::new(finds, FIRST_RADIUS, pixels, f64::from(mean));
    paths.caustics.share = Some(looked.share);
    looked
}

/// What `count` photons of `emission`, those of map `map`, are worth.
fn look<F: Features>(
    stage: &Stage,
    paths: &mut Paths<F>,
    emission: &EmissionSampler,
    eye: &Eye,
    (count, map): (usize, u32),
) -> Result<Vec<GuideSample>, RenderError> {
    look_with::<F>(stage, &mut paths.scratch, emission, eye, (count, map))
}

fn look_with<F: Features>(
    stage: &Stage,
    scratch: &mut [Vec<Line>],
    emission: &EmissionSampler,
    &Eye { discs, beside_records }: &Eye,
    (count, map): (usize, u32),
) -> Result<Vec<GuideSample>, RenderError> {
    let (shooter, _) = shooter::<F>(stage, emission, count, (discs, 0), beside_records);
    let mut finds = vec![GuideSample::default(); count];
    let look = |task: usize, arena: &mut Arena, out: &mut [GuideSample]| shooter.look(task, map, arena, out);
    // Where the render is over a part of them has to do.
    stage.workers.look(&mut finds, PATHS, scratch, &look)?;
    Ok(finds)
}

/// About the share of the picture's light that photons find and paths as good as never, which take so many `samples` of each
/// pixel: that of lamps without size, and of small ones, by mirrors and glass. `None` where there is no memory to look.
pub(in crate::drive) fn unseen<F: Features>(
    stage: &Stage,
    samples: f64,
    scratch: &mut [Vec<Line>],
    memory: &mut Memory,
) -> Result<Option<f64>, RenderError> {
    let Stage { scene, bvh, lights, settings, .. } = *stage;
    let emission = EmissionSampler::footprint(lights);
    if !may_be(stage) || !memory.has(emission.bytes()) {
        return Ok(None);
    }
    let mut lines = memory.take(JUDGE, emission)?;
    let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut lines));
    let plain = EmissionSampler::build(scene, lights, &bvh.bounds(), &mut arena)?;
    let eye = Eye { discs: stage.discs(), beside_records: false };
    let finds = look_with::<F>(stage, scratch, &plain, &eye, (LOOK, JUDGE_MAP))?;
    let pixels = f64::from(settings.width) * f64::from(settings.height);
    let missing = missing(&finds, FIRST_RADIUS, pixels, (samples, FEWEST_HITS));
    let mean = f64::from(stage.workers.pilot_mean(&stage.paths::<F>(settings.seed), scratch)?);
    drop((finds, lines));
    memory.give_back(JUDGE);
    Ok((missing > 0.0).then(|| missing / (missing + mean)))
}

/// See the file.
struct Joined<'a, F> {
    paths: Paths<'a, F>,
    caster: Caster<'a>,
}

impl<F: Features> Renderer for Joined<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        let Paths { method, scratch, .. } = &mut self.paths;
        match method.reusing() {
            Some(tracer) => self.caster.round(&tracer, scratch, crew),
            None => self.caster.round(method.integrator(), scratch, crew),
        }
    }

    fn reuse(&self) -> Reuse {
        self.paths.reuse()
    }

    fn caustics(&self) -> CausticUse {
        self.paths.caustics
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        self.caster.view::<F>()
    }

    fn photons(&self) -> Option<PhotonUse> {
        Some(self.caster.used)
    }
}
