//! Light paths for caustics: from the lights by mirrors and glass to the first rough surface, where a photon
//! is left (Jensen 1996), weighted for the paths from the eye that it shares its light with (`merge.rs`).
//!
//! From there paths go on in whatever way, and leave a photon on each rough surface, so that paths from the
//! eye need not find the caustic by chance. A path that meets a rough surface first goes on by what a smooth
//! coat mirrors there alone. Beside the records of an irradiance cache a photon is left only by what comes
//! straight from a mirror or smooth glass: records have all that something rough sent. How paths go is in
//! `walk/light.rs`.

use crate::bsdf::{BsdfSample, Features};
use crate::bvh::Bvh;
use crate::geometry::Ray;
use crate::light::{EmissionSampler, LightSampler, LightType, luminance};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::Photon;
use crate::scene::Scene;
use crate::transport::caustics::merge::is_wide_enough;
use crate::transport::photon_mapping::deposit::PhotonTracerSettings;
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::settings::{Counters, UNLIMITED};
use crate::transport::walk::context::SceneContext;
pub use crate::transport::walk::light::PATHS_PER_TASK;
use crate::transport::walk::light::{Continuation, LightPathState, LightWalk, PhotonBuffer, Vertex, Visitor};
use crate::transport::walk::mis::{ChainLink, merging_weight};
use crate::{Level, Rgb};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::PI;
use glam::{Vec2, Vec3};

/// Photons that a task has room for: a path leaves two on average at most.
pub const PHOTONS_PER_TASK: usize = 3 * PATHS_PER_TASK;

/// Probability with which a path goes on, at most, where it leaves a photon.
const MOST: f32 = 0.5;

/// Photons of less weight than this are left so much less often, with this weight: paths find their light.
const LEAST_WEIGHT: f32 = 0.1;

/// What light outside of the picture, or hidden from the eye, counts: some of it comes back.
const INDIRECT: f32 = 0.02;

/// What a surface is thought to reflect.
const REFLECTED: f32 = 0.5;

/// Surfaces of glass between the eye and what it sees, at most, and how far from both ends it is looked for
/// them, in shares of the distance.
const MOST_GLASS: u32 = 16;
const NEAR: f32 = 1e-4;

/// Shoots photons of caustics: a pass of tasks of [`PATHS_PER_TASK`] paths.
#[derive(Clone, Copy)]
pub struct CausticPhotonTracer<'a, F> {
    flight: LightWalk<'a, F>,
    discs: RadiusSchedule,
    /// Pixels across and down.
    frame: [u32; 2],
    beside_records: bool,
}

/// What became of a light path: what its photons are worth, and from which cell of the guide it came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GuideSample {
    /// Its cell.
    pub cell: u32,
    /// Zero where nothing was left.
    pub worth: f32,
    /// The block of the picture, of [`BLOCKS`] across and down, where it shows, and
    pub block: u32,
    /// the radiance that its photons bring to each pixel of their disc, of that which paths find badly;
    pub light: f32,
    /// how often a sample of each of these pixels finds it, if paths alone are to, and
    pub hits: f32,
    /// the radiance that a sample has then; infinite where none does.
    pub flash: f32,
}

/// Blocks of the picture, across and down, that tell where caustics are.
pub const BLOCKS: u32 = 16;

impl<'a, F: Features> CausticPhotonTracer<'a, F> {
    /// A shooter over frozen structures, for photons that will be gathered from `discs` in a picture of so
    /// many pixels across and down. `F` has at least the features of the scene. All photons are kept,
    /// whatever `settings` say.
    pub fn new(
        (scene, bvh, lights): (&'a Scene<'a>, &'a Bvh<'a>, &'a LightSampler<'a>),
        emission: &'a EmissionSampler<'a>,
        settings: PhotonTracerSettings,
        (discs, frame): (RadiusSchedule, [u32; 2]),
        level: Level,
    ) -> Self {
        let PhotonTracerSettings { seed, paths, max_depth, .. } = settings;
        let context = SceneContext::new(scene, bvh, lights, level);
        let flight = LightWalk { context, emission, seed, paths, max_depth };
        Self { flight, discs, frame, beside_records: false }
    }

    /// The same, of photons for
    /// [`CausticMerging::beside_records`](crate::transport::CausticMerging::beside_records), if so.
    pub fn beside_records(self, beside_records: bool) -> Self {
        Self { beside_records, ..self }
    }

    /// Light paths of a map.
    pub fn paths(&self) -> u32 {
        self.flight.paths
    }

    /// Number of tasks of a map.
    pub fn tasks(&self) -> usize {
        self.flight.tasks()
    }

    /// Working memory of one task.
    pub fn scratch() -> Footprint {
        LightWalk::<F>::scratch()
    }

    /// Shoots the photons of task `task` of map number `map` (below 2^31). All of `out` is written; what is
    /// not needed, with photons of no place, which a map refuses. Room for [`PHOTONS_PER_TASK`] is enough.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`CausticPhotonTracer::scratch`] bytes.
    pub fn run(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [Photon],
    ) -> Result<Counters, OutOfMemory> {
        let mut pile = PhotonBuffer::new(out);
        let leave = |_: &LightPathState, photon, _, counters: &mut Counters| pile.push(photon, counters);
        let counters = self.flight.follow(
            task,
            map,
            scratch,
            &mut MisDepositor { shooter: self, leave, goes_on: true },
        )?;
        pile.finish();
        Ok(counters)
    }

    /// Shoots the same photons to see where those are from that show in the picture. `out` gets one for each
    /// path, up to [`PATHS_PER_TASK`].
    ///
    /// # Errors
    /// As [`CausticPhotonTracer::run`].
    pub fn look(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [GuideSample],
    ) -> Result<Counters, OutOfMemory> {
        let first = (task * PATHS_PER_TASK) as u32;
        out.fill(GuideSample::default());
        let leave = |state: &LightPathState, photon: Photon, share: CausticShare, _: &mut Counters| {
            if let Some(find) = out.get_mut((state.number - first) as usize) {
                let place = photon.position();
                let power = luminance(photon.power());
                let radius = self.discs.radius(place);
                let pixels = 1.0 / (radius * radius);
                find.cell = state.cell;
                let Some(block) = self.block(place) else {
                    find.worth += power * pixels * INDIRECT;
                    return;
                };
                find.worth += power * pixels;
                find.block = block;
                let light = REFLECTED / PI * power * pixels / PI;
                let whole = light * share.chance / share.weight;
                find.light += light;
                (find.hits, find.flash) = (share.ratio / share.chance, whole / share.ratio);
            }
        };
        self.flight.follow(task, map, scratch, &mut MisDepositor { shooter: self, leave, goes_on: false })
    }

    /// In which block of the picture light at `place` shows, straight or through glass; `None` where it is
    /// outside, or hidden from the eye: some of it comes back.
    fn block(&self, place: Vec3) -> Option<u32> {
        let context = &self.flight.context;
        let camera = &context.scene.camera;
        let [width, height] = self.frame;
        let at = camera.project(width, height, place, [0.5; 2])?.raster;
        let frame = Vec2::new(width as f32, height as f32);
        if at.cmplt(Vec2::ZERO).any() || at.cmpge(frame).any() {
            return None;
        }
        // What is seen through glass is seen.
        let to_eye = camera.eye - place;
        let mut ray = Ray::segment(place + NEAR * to_eye, (1.0 - NEAR) * to_eye, 1.0);
        let mut crossed = 0;
        loop {
            let hit = context.nearest(&ray);
            let Some(point) = context.surface_at(&ray, &hit) else {
                let [x, y] = (at / frame * BLOCKS as f32).to_array();
                return Some((y as u32).min(BLOCKS - 1) * BLOCKS + (x as u32).min(BLOCKS - 1));
            };
            crossed += 1;
            if crossed > MOST_GLASS || !point.material.may_pass_caustics() {
                return None;
            }
            ray = point.spawn_to(camera.eye);
        }
    }

    /// The share that photons have in the light of this path at `place`.
    fn share(&self, state: &LightPathState, place: Vec3) -> CausticShare {
        let ratio =
            state.path_pdfs / (self.discs.merge_factor(place, self.flight.paths as f32) * state.chain_ratio);
        let weight = merging_weight(ratio);
        // Zero over zero: without any other technique photons have it all.
        let weight = if state.path_pdfs == 0.0 { 1.0 } else { weight };
        CausticShare { weight, chance: (weight / LEAST_WEIGHT).min(1.0), ratio }
    }

    /// `chain` and `others` before the first surface: `back` is the density of the direction to the light,
    /// where it is not the only one.
    fn first(&self, state: &LightPathState, vertex: &Vertex, back: Option<f32>) -> (f32, f32) {
        let LightWalk { context: SceneContext { scene, lights, .. }, emission, .. } = self.flight;
        let &Vertex { point, bsdf, to_light, .. } = vertex;
        let normal = if F::DIELECTRIC && bsdf.transmits() { Vec3::ZERO } else { point.frame.normal };
        let position = point.position;
        let with = |chosen: f32| back.map_or(0.0, |back| chosen / back);
        let by_chance = |chosen: f32| libm::sqrtf(1.0 + with(chosen) * with(chosen));
        match emission.light_type(lights, state.light) {
            LightType::Area => {
                let from = (state.origin.into(), -to_light);
                let density = emission.density_of_emitter(scene, lights, state.light as usize, from);
                let chosen = match (back, lights.triangle_of(state.light)) {
                    (Some(_), Some(triangle)) => {
                        let distance = position.distance(state.origin.into());
                        lights.pdf_hit(scene, position, normal, triangle, distance, to_light)
                    }
                    _ => 0.0,
                };
                (density, by_chance(chosen))
            }
            LightType::Infinite => {
                let density = emission.density_of_environment(scene, lights, to_light, position);
                let chosen = match back {
                    Some(_) => lights.pdf_escape(scene, position, normal, to_light),
                    None => 0.0,
                };
                (density, by_chance(chosen))
            }
            LightType::Delta => {
                let density = emission.density_of_delta(scene, lights, state.light, position);
                (density, with(lights.probability(state.light, position, normal)))
            }
        }
    }
}

/// What is known of a photon beside its power.
#[derive(Clone, Copy)]
struct CausticShare {
    /// In the light of its path.
    weight: f32,
    /// With which it is left at all.
    chance: f32,
    /// How densely paths from the eye find its light, over how densely photons do.
    ratio: f32,
}

impl CausticShare {
    /// Of a photon that has its weight already.
    const ALL: CausticShare = CausticShare { weight: 1.0, chance: 1.0, ratio: 0.0 };

    /// What is left of the power of a path with a photon at `vertex`; `None` where that is not left.
    fn kept(&self, vertex: &Vertex) -> Option<f32> {
        (vertex.visitor_number() < self.chance).then(|| self.weight / self.chance)
    }
}

/// `LightPathState::path_pdfs` of a path that a rough surface has scattered: its power has its weight, and
/// `LightPathState::chain_ratio` is the radius of discs at the last.
const SCATTERED: f32 = -1.0;

/// Leaves photons with their weights.
struct MisDepositor<'s, 'a, F, L> {
    shooter: &'s CausticPhotonTracer<'a, F>,
    leave: L,
    /// Whether paths go on from the first rough surface.
    goes_on: bool,
}

impl<F: Features, L> MisDepositor<'_, '_, F, L> {
    /// Whether light is gathered at `vertex`, which is rough, and not where it was scattered last.
    fn is_merged(&self, state: &LightPathState, vertex: &Vertex) -> bool {
        let LightWalk { max_depth, .. } = self.shooter.flight;
        let from =
            if state.path_pdfs == SCATTERED && max_depth == UNLIMITED { state.chain_ratio } else { 0.0 };
        is_wide_enough(self.shooter.discs.radius(vertex.point.position), from)
    }

    /// What is known of a photon at `vertex`, which is rough.
    fn share(&self, state: &LightPathState, vertex: &Vertex) -> CausticShare {
        match state.path_pdfs {
            SCATTERED => CausticShare::ALL,
            _ => self.shooter.share(state, vertex.point.position),
        }
    }
}

impl<F: Features, L: FnMut(&LightPathState, Photon, CausticShare, &mut Counters)> Visitor
    for MisDepositor<'_, '_, F, L>
{
    const DIMENSIONS: u32 = 4;
    const SEED: u64 = 0x6361_7573_7469_6373;

    #[inline]
    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        counters: &mut Counters,
    ) -> Option<Continuation> {
        let ends = vertex.bsdf.is_receiver();
        let is_known = self.shooter.beside_records && state.from_caster == 0;
        let leaves = ends && state.segments > 1 && !is_known;
        if leaves && self.is_merged(state, vertex) {
            let share = self.share(state, vertex);
            if let Some(kept) = share.kept(vertex) {
                (self.leave)(state, vertex.photon(Rgb::from(state.power) * kept), share, counters);
            }
        }
        Some(Continuation {
            most: if leaves { MOST } else { 1.0 },
            specular_only: ends && !(leaves && self.goes_on),
        })
    }

    /// Straight from a light no photon goes on by a rough coat: paths find that light.
    #[inline]
    fn is_apart(&self, state: &LightPathState, vertex: &Vertex) -> bool {
        state.segments > 1
            && vertex.bsdf.gathers_photons_on_base(self.shooter.flight.context.separates_coats())
    }

    /// Takes note of what a surface does with the densities of both ways, at the first of a path also of how
    /// the path tracer finds its light.
    #[inline]
    fn leave(
        &self,
        state: &mut LightPathState,
        vertex: &Vertex,
        from: Vec3,
        (sample, is_specular): (&BsdfSample, bool),
    ) {
        state.from_caster = vertex.bsdf.is_delta().into();
        if vertex.bsdf.is_receiver() && !is_specular {
            if state.path_pdfs != SCATTERED {
                // What goes on is what was left.
                let kept = self.share(state, vertex).kept(vertex).unwrap_or(0.0);
                state.power = (Rgb::from(state.power) * kept).to_array();
            }
            (state.path_pdfs, state.chain_ratio) =
                (SCATTERED, self.shooter.discs.radius(vertex.point.position));
        }
        if state.path_pdfs == SCATTERED {
            return;
        }
        // The way back, as the path tracer goes it.
        let Vertex { point, bsdf, .. } = *vertex;
        let coat_alone = is_specular && !sample.delta;
        let there = ChainLink { point, bsdf, near: from, far: sample.direction, coat_alone };
        let back = if sample.delta { 1.0 } else { there.pdf(&self.shooter.flight.context) };
        if state.segments == 1 {
            let back = (!sample.delta).then_some(back);
            (state.chain_ratio, state.path_pdfs) = self.shooter.first(state, vertex, back);
        }
        state.chain_ratio *= if sample.delta {
            sample.eta * sample.eta
        } else {
            sample.pdf / back * (from.z / sample.direction.z).abs()
        };
    }
}
