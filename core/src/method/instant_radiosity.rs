//! Instant radiosity (Keller 1997): each sample of the picture has light paths of its own, whose vertices
//! light camera paths as virtual point lights. The geometry term is bounded, and camera paths go on for what
//! the bound cuts (Kollig and Keller 2004); the clamped form leaves that out and estimates how much it is.
//!
//! If neighbouring pixels reuse paths, virtual lights light the second vertex, whose light all pixels of a
//! circle receive; otherwise the first.

use super::emission_guide::{EmissionGuide, GuideSettings, Target};
use super::executor::{Executor, Passed};
use super::path::{PathTracing, Reuse};
use super::splats::{add_splats, splats_of_tile};
use super::{RenderContext, RenderMethod, Round};
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Pixel, Splat, Tile};
use crate::findings::Decision::{LeftOut, Limited, Used};
use crate::findings::{Finding, Findings, Value};
use crate::light::{EmissionSampler, luminance};
use crate::memory::{Arena, Footprint, MemorySource, OutOfMemory};
use crate::transport::instant_radiosity::light_pass::{
    LightPass, PATHS_PER_TASK, TaskOutput, VERTICES_PER_TASK,
};
use crate::transport::instant_radiosity::lighting::VirtualLighting;
use crate::transport::instant_radiosity::lights::{VirtualLight, lit_area};
use crate::transport::photon_mapping::deposit::PhotonFilter;
use crate::transport::{Counters, PathIntegrator, PathReuse, PathSettings, path::WAVE};
use bytemuck::{Pod, Zeroable};

/// Pixels for each light path, where their number is left open.
const PIXELS_PER_LIGHT_PATH: usize = 16;

/// The same where some caustics are found by light paths alone.
const PIXELS_PER_SPLAT_PATH: usize = 2;

/// Distance from the end of a gather ray within which a virtual light counts as useful, over the diagonal of
/// the scene.
const NEAR_GATHERED: f32 = 0.1;

/// Sets of virtual lights at most.
const MOST_SETS: usize = 1024;

/// Connections of the first vertex, and of the second where pixels reuse paths.
const CONNECTIONS: u32 = 4;
const CONNECTIONS_WITH_REUSE: u32 = 2;

/// The bound over the density of connections on the area that is lit.
const BOUND: f32 = 4.0;

/// Number of the pass that the lit area is estimated from.
const PILOT: u32 = 1 << 30;

/// One of this number of tiles is rendered twice, to estimate the light that the bound cuts.
const TILES_PER_ESTIMATE: usize = 16;

/// Sample counts of virtual lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VirtualLightSettings {
    /// Light paths for each sample of the picture, in sets of 1024; `None`: a sixteenth of the pixels.
    pub light_paths: Option<u32>,
    /// Virtual lights that a camera path is connected to first; `None`: 4, and 2 where pixels reuse paths.
    pub connections: Option<u32>,
}

/// The use that was made of virtual lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VirtualLightUse {
    /// Light paths traced and virtual lights left by them.
    pub light_paths: u64,
    /// See above.
    pub lights: u64,
    /// Light paths of a sample, with the memory at hand and as wanted.
    pub given: u32,
    /// See above.
    pub wanted: u32,
    /// Connections of a camera path, where it has the first.
    pub connections: u32,
    /// Area that virtual lights lie on, m²; 0 where there are none.
    pub area: f32,
    /// Share of the light that the bound cuts, if it is left out: an estimate from some tiles.
    pub cut: Option<f64>,
}

/// Luminance of the pixels of a tile, summed over samples.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct TileLight {
    clamped: f64,
    whole: f64,
}

/// A picture by instant radiosity.
pub struct InstantRadiosity<'a, F> {
    context: RenderContext<'a>,
    paths: PathTracing<'a, F>,
    emission: EmissionSampler<'a>,
    /// Room for [`VERTICES_PER_TASK`] virtual lights of each set, and the outcome of its task.
    lights: &'a mut [VirtualLight],
    outputs: &'a mut [TaskOutput],
    /// Splats of each set, and of the sample in the order of the film; none where nothing needs them.
    splats: &'a mut [Splat],
    picture: &'a mut [[f32; 3]],
    /// Light of each tile, if some is left out.
    cut: &'a mut [TileLight],
    bound: f32,
    /// The sample that the sets are of.
    traced: Option<u32>,
    used: VirtualLightUse,
}

impl VirtualLightSettings {
    /// Sets of virtual lights of a sample, for a picture of so many pixels.
    fn sets(&self, pixels: usize, has_splats: bool) -> usize {
        let each = if has_splats { PIXELS_PER_SPLAT_PATH } else { PIXELS_PER_LIGHT_PATH };
        let wanted = self.light_paths.map_or(pixels / each, |paths| paths as usize);
        wanted.div_ceil(PATHS_PER_TASK).clamp(1, MOST_SETS)
    }
}

impl<'a, F: Features> InstantRadiosity<'a, F> {
    /// Working memory of a worker.
    pub fn scratch() -> Footprint {
        PathIntegrator::<F>::scratch_with::<VirtualLighting, PathReuse>(WAVE)
            .and(Footprint::default().slice::<Pixel>(PIXELS_PER_TILE))
            .or(PathTracing::<F>::scratch())
            .or(LightPass::<F>::scratch())
    }

    /// Memory of `sets` of virtual lights.
    fn footprint(sets: usize, has_splats: bool) -> Footprint {
        let splats = if has_splats { sets * PATHS_PER_TASK } else { 0 };
        Footprint::default()
            .slice::<VirtualLight>(sets * VERTICES_PER_TASK)
            .slice::<TaskOutput>(sets)
            .slice::<Splat>(splats)
    }

    /// Memory for a picture of `size`, at most.
    pub(super) fn usual_footprint(
        [width, height]: [u32; 2],
        lights: usize,
        settings: &VirtualLightSettings,
    ) -> Footprint {
        let (pixels, tiles) = (width as usize * height as usize, Tile::count(width, height));
        let [plain, splats] = [false, true].map(|splats| settings.sets(pixels, splats));
        let sets = Self::footprint(plain, false).or(Self::footprint(splats, true));
        let picture =
            Footprint::default().slice::<TileLight>(tiles).slice::<[f32; 3]>(tiles * PIXELS_PER_TILE);
        sets.and(picture).and(EmissionSampler::footprint(lights))
    }

    /// Instant radiosity of `context`. What the bound cuts `is_clamped`; otherwise paths find it, with
    /// `reuse` or without; `None` where a pilot decides. There are fewer light paths where memory is short,
    /// `others` bytes of which stay free.
    ///
    /// # Errors
    /// [`OutOfMemory`] where there is no memory for 1024 light paths, or too little scratch.
    pub fn new(
        context: &RenderContext<'a>,
        settings: &VirtualLightSettings,
        (is_clamped, reuse): (bool, Option<bool>),
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
        others: usize,
    ) -> Result<Self, OutOfMemory> {
        let all = context.lights;
        let PathSettings { width, height, max_depth, .. } = context.settings;
        let tiles = if is_clamped { Tile::count(width, height) } else { 0 };
        let cut = slice("cut light", tiles, memory)?;
        let has_splats = context.scene_context::<F>().has_hidden_light();
        let guide = GuideSettings {
            filter: PhotonFilter::All,
            max_depth,
            target: Target::Gathered(NEAR_GATHERED * context.bvh.bounds().diagonal()),
            reserve: others.saturating_add(Self::footprint(1, has_splats).bytes()),
        };
        let emission = EmissionGuide::learn::<F>(context, guide, memory, executor)?.emission;
        let pixels = if has_splats { Tile::count(width, height) * PIXELS_PER_TILE } else { 0 };
        let picture = slice("splats", pixels, memory)?;
        let wanted = if all.is_empty() { 0 } else { settings.sets(context.pixels(), has_splats) };
        let available = memory.available().saturating_sub(others);
        let sets = wanted.min(available / Self::footprint(1, has_splats).bytes()).max(wanted.min(1));
        let lights = slice("virtual lights", sets * VERTICES_PER_TASK, memory)?;
        let outputs = slice("virtual lights", sets, memory)?;
        let splats = slice("splats", if has_splats { sets * PATHS_PER_TASK } else { 0 }, memory)?;
        // Hidden caustics at the second vertex light the first by virtual lights alone.
        let reuse = if is_clamped || has_splats { Some(false) } else { reuse };
        let paths = PathTracing::new(context, reuse, executor)?;
        let usual = if paths.reuse().used { CONNECTIONS_WITH_REUSE } else { CONNECTIONS };
        let connections = settings.connections.unwrap_or(usual);
        let mut method = Self {
            context: *context,
            paths,
            emission,
            lights,
            outputs,
            splats,
            picture,
            cut,
            bound: 0.0,
            traced: None,
            used: VirtualLightUse {
                given: (sets * PATHS_PER_TASK) as u32,
                wanted: (wanted * PATHS_PER_TASK) as u32,
                connections,
                ..VirtualLightUse::default()
            },
        };
        if method.light_pass(PILOT, executor)?.is_some() {
            let area = lit_area(method.set(0));
            let bound = BOUND * connections as f32 / area;
            // Without virtual lights paths find all light.
            if area > 0.0 && bound < f32::INFINITY {
                (method.used.area, method.bound) = (area, bound);
            }
        }
        Ok(method)
    }

    /// Traces the light paths of pass number `pass`; `None` where the executor is over.
    fn light_pass(
        &mut self,
        pass: u32,
        executor: &mut impl Executor,
    ) -> Result<Option<Counters>, OutOfMemory> {
        let Self { context, emission, lights, outputs, splats, picture, .. } = self;
        let walk = LightPass::<F>::new(context.scene_context(), emission, context.settings, outputs.len());
        let rooms = splats.chunks_mut(PATHS_PER_TASK).map(Some).chain(core::iter::repeat_with(|| None));
        let sets = lights.chunks_mut(VERTICES_PER_TASK).zip(outputs.iter_mut()).zip(rooms);
        let Passed { counters, is_complete } =
            executor.pass(sets, |set, ((lights, output), splats), worker| {
                walk.run((set, pass), &mut worker.scratch, lights, splats.unwrap_or_default(), output)
            })?;
        if !is_complete {
            return Ok(None);
        }
        let (splats, outputs) = (&**splats, &**outputs);
        let lists = splats.chunks(PATHS_PER_TASK).zip(outputs.iter().map(TaskOutput::offsets));
        Ok(add_splats(executor, picture, lists)?.then_some(counters))
    }

    /// The virtual lights of tile `tile`.
    fn set(&self, tile: usize) -> &[VirtualLight] {
        let Some(set) = tile.checked_rem(self.outputs.len()) else { return &[] };
        &self.lights[set * VERTICES_PER_TASK..][..self.outputs[set].vertices as usize]
    }

    fn lighting(&self, tile: usize, is_clamped: bool) -> VirtualLighting<'_> {
        let (connections, bound) = (self.used.connections, self.bound);
        let splats = splats_of_tile(self.picture, tile);
        VirtualLighting { lights: self.set(tile), connections, bound, is_clamped, splats }
    }

    fn is_clamped(&self) -> bool {
        !self.cut.is_empty()
    }

    /// Use of path reuse, and its pilot.
    pub fn reuse(&self) -> Reuse {
        self.paths.reuse()
    }

    /// The use of virtual lights so far.
    pub fn used(&self) -> VirtualLightUse {
        let sum = |of: fn(&TileLight) -> f64| self.cut.iter().map(of).sum::<f64>();
        let (whole, clamped) = (sum(|tile| tile.whole), sum(|tile| tile.clamped));
        let cut = (whole > 0.0).then(|| 1.0 - clamped / whole);
        VirtualLightUse { cut, ..self.used }
    }

    /// Makes the virtual lights of `sample`, unless a round that ended early has left them. Returns whether
    /// they are there.
    fn prepare<E: Executor>(&mut self, sample: u32, round: &mut Round<E>) -> Result<bool, OutOfMemory> {
        if self.traced == Some(sample) {
            return Ok(true);
        }
        self.traced = None;
        let traced = round.executor.timed("light paths", |executor| self.light_pass(sample, executor))?;
        let Some(counters) = traced else { return Ok(false) };
        round.state.counters += counters;
        self.traced = Some(sample);
        self.used.light_paths += (self.outputs.len() * PATHS_PER_TASK) as u64;
        self.used.lights += self.outputs.iter().map(|output| u64::from(output.vertices)).sum::<u64>();
        if self.is_clamped() {
            self.estimate_cut(sample, round)?;
        }
        Ok(true)
    }

    /// Renders some tiles with the light that the bound cuts and without, by the same random numbers.
    fn estimate_cut<E: Executor>(&mut self, sample: u32, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        let mut cut = core::mem::take(&mut self.cut);
        let method = &*self;
        let every = cut.len().clamp(1, TILES_PER_ESTIMATE);
        let shard = round.state.shard;
        let is_next = |tile: usize| (tile + sample as usize).is_multiple_of(every) && shard.owns(tile);
        let tiles = cut.iter_mut().enumerate().filter(|(tile, _)| is_next(*tile));
        let passed = round.executor.pass(tiles, |_, (tile, light), worker| {
            let (clamped, mut counters) = method.tile_luminance(tile, sample, true, &mut worker.scratch)?;
            let (whole, more) = method.tile_luminance(tile, sample, false, &mut worker.scratch)?;
            counters += more;
            *light = TileLight { clamped: light.clamped + clamped, whole: light.whole + whole };
            Ok(Counters { paths: 0, ..counters })
        });
        self.cut = core::mem::take(&mut cut);
        let _ = passed?;
        Ok(())
    }

    /// Luminance of all pixels of a tile by one sample.
    fn tile_luminance(
        &self,
        tile: usize,
        sample: u32,
        is_clamped: bool,
        scratch: &mut Arena,
    ) -> Result<(f64, Counters), OutOfMemory> {
        let integrator = self.paths.integrator().with_virtual_lights(self.lighting(tile, is_clamped));
        let mut arena = scratch.scratch();
        let pixels: &mut [Pixel] = arena.slice(PIXELS_PER_TILE)?;
        pixels.fill(Pixel::zeroed());
        let counters = integrator.run(tile, sample..sample + 1, WAVE, &mut arena, pixels)?;
        let light = pixels.iter().map(|pixel| f64::from(luminance(pixel.mean()))).sum::<f64>();
        Ok((light, counters))
    }
}

/// `count` values of zero.
fn slice<'a, T: Pod>(
    structure: &'static str,
    count: usize,
    memory: &mut impl MemorySource<'a>,
) -> Result<&'a mut [T], OutOfMemory> {
    if count == 0 {
        return Ok(&mut []);
    }
    let slice: &mut [T] = memory.take(structure, Footprint::default().slice::<T>(count))?.slice(count)?;
    slice.fill(T::zeroed());
    Ok(slice)
}

impl VirtualLightUse {
    /// Finding on virtual lights, and on the light that the bound cuts if that is left out.
    fn findings(&self, has_reuse: bool) -> [Option<Finding>; 2] {
        let (decision, reason) = match has_reuse {
            _ if self.given < self.wanted => (Limited, "not enough memory: the picture is noisier"),
            _ if self.area == 0.0 => (LeftOut, "a pilot found none: paths find all light"),
            true => (Used, "they light the second vertex of paths, whose light neighbouring pixels share"),
            false => (Used, "they light the first rough vertex of paths"),
        };
        let limited = |paths: u32| (decision == Limited).then_some(Value::Count(paths.into()));
        let lights = Finding::new("virtual_lights", decision, reason)
            .with("light_paths", Value::Count(self.light_paths))
            .with("virtual_lights", Value::Count(self.lights))
            .with("connections", Value::Count(self.connections.into()))
            .with("lit_area", Value::Number(self.area.into()))
            .with_some("light_paths_given", limited(self.given))
            .with_some("light_paths_wanted", limited(self.wanted));
        let cut = self.cut.map(|share| {
            let reason = "the bound of the geometry term cuts it, in corners most";
            Finding::new("cut_light", LeftOut, reason).with("share_of_light", Value::Fraction(share))
        });
        [Some(lights), cut]
    }
}

impl<F: Features> RenderMethod for InstantRadiosity<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        while let Some(sample) = round.next_sample() {
            if !self.prepare(sample, round)? {
                break;
            }
            let method = &*self;
            let lighting = |tile| method.lighting(tile, method.is_clamped());
            if let Some(integrator) = self.paths.reusing() {
                round.tiles(sample + 1, |tile, samples, scratch, pixels| {
                    let integrator = integrator.with_virtual_lights(lighting(tile));
                    integrator.run(tile, samples, WAVE, scratch, pixels)
                })?;
                continue;
            }
            let integrator = self.paths.integrator();
            round.tiles(sample + 1, |tile, samples, scratch, pixels| {
                let integrator = integrator.with_virtual_lights(lighting(tile));
                integrator.run(tile, samples, WAVE, scratch, pixels)
            })?;
        }
        Ok(())
    }

    fn findings(&self) -> Findings {
        let reuse = self.reuse();
        let lights = self.used().findings(reuse.used);
        Findings::default().and(reuse.finding()).and(lights.into_iter().flatten())
    }
}
