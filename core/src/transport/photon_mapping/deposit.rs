//! Light paths: photons from the lights, left on every rough surface that they meet after the first (Jensen
//! 1996).
//!
//! What they leave is, by [`PhotonFilter`], the light that surfaces reflect onto each other, and that mirrors
//! and glass throw onto surfaces, where light straight from a light is for shadow rays to find; all light; or
//! caustics alone. How they get there is in `walk/light.rs`.
//!
//! Departures from the plain algorithm:
//! 1. After a photon was left, its path goes on with a probability of at most [`MAX_CONTINUATION`]. A path
//!    then leaves five photons on average at most, wherever it runs, so that [`ROOM`] for a task is enough:
//!    to be 14 standard deviations above the mean it would have to live through as many ends as no sequence
//!    of random numbers holds.
//! 2. The price: where surfaces are lighter than that, photons differ in power.

use crate::bsdf::Features;
use crate::bvh::Bvh;
use crate::light::{EmissionSampler, LightSampler, luminance};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::Photon;
use crate::scene::Scene;
use crate::transport::photon_mapping::visible_points::VisiblePoints;
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::light::{
    Continuation, LightPathState, LightWalk, MAX_CONTINUATION, PhotonBuffer, Vertex, Visitor,
};
pub use crate::transport::walk::light::{PATHS, ROOM};
use crate::{Level, Rgb};

/// Which photons are left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PhotonFilter {
    /// All but those that come straight from a light.
    #[default]
    Reflected,
    /// All.
    All,
    /// Those that came from a light by mirrors and glass alone, at least one of them. Their paths end there.
    Caustic,
}

impl PhotonFilter {
    /// Whether a path leaves a photon where it met a surface.
    #[inline]
    pub(in crate::transport) fn leaves(self, state: &LightPathState, vertex: &Vertex) -> bool {
        vertex.bsdf.stores_photons()
            && match self {
                PhotonFilter::All => true,
                PhotonFilter::Reflected | PhotonFilter::Caustic => state.segments > 1,
            }
    }

    /// How it goes on from there.
    #[inline]
    pub(in crate::transport) fn onward(self, vertex: &Vertex, leaves: bool) -> Option<Continuation> {
        let ends = self == PhotonFilter::Caustic
            && (vertex.bsdf.stores_photons() || !vertex.bsdf.is_caustic_caster());
        (!ends).then_some(Continuation { most: if leaves { MAX_CONTINUATION } else { 1.0 }, mirrored: false })
    }
}

/// What is shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhotonTracerSettings {
    /// Which photons are left.
    pub keep: PhotonFilter,
    /// Another seed, other photons.
    pub seed: u32,
    /// Light paths for each map.
    pub paths: u32,
    /// The largest number of segments between camera and light, of which the last is the camera's.
    pub max_depth: u32,
}

/// Shoots the photons of one scene: a pass of tasks of [`PATHS`] paths.
#[derive(Clone, Copy)]
pub struct PhotonTracer<'a, F> {
    pub(in crate::transport) flight: LightWalk<'a, F>,
    keep: PhotonFilter,
}

impl<'a, F: Features> PhotonTracer<'a, F> {
    /// A shooter over frozen structures. `F` has at least the features of the scene.
    pub fn new(
        scene: &'a Scene<'a>,
        bvh: &'a Bvh<'a>,
        lights: &'a LightSampler<'a>,
        emission: &'a EmissionSampler<'a>,
        settings: PhotonTracerSettings,
        level: Level,
    ) -> Self {
        let PhotonTracerSettings { keep, seed, paths, max_depth } = settings;
        Self {
            flight: LightWalk {
                context: SceneContext::new(scene, bvh, lights, level),
                emission,
                seed,
                paths,
                max_depth,
            },
            keep,
        }
    }

    /// Number of tasks of a map.
    pub fn tasks(&self) -> usize {
        self.flight.tasks()
    }

    /// Working memory of one task.
    pub fn scratch() -> Footprint {
        LightWalk::<F>::scratch()
    }

    /// Photons that a task needs room for.
    pub fn room(&self) -> usize {
        if self.keep == PhotonFilter::Caustic { PATHS } else { ROOM }
    }

    /// Shoots the photons of task `task` of map number `map` (below 2^31). All of `out` is written; what is
    /// not needed, with photons of no place, which a map refuses. Room for [`PhotonTracer::room`] is enough.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`PhotonTracer::scratch`] bytes.
    pub fn run(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [Photon],
    ) -> Result<Counters, OutOfMemory> {
        let mut leaver = Depositor { keep: self.keep, pile: PhotonBuffer::new(out) };
        let counters = self.flight.follow(task, map, scratch, &mut leaver)?;
        leaver.pile.finish();
        Ok(counters)
    }

    /// Which photons of task `task` of map number `map` are left in `sight`: `seen` is told of each.
    ///
    /// # Errors
    /// Those of [`PhotonTracer::run`].
    pub fn look(
        &self,
        (task, map): (usize, u32),
        sight: VisiblePoints,
        scratch: &mut Arena,
        seen: &mut dyn FnMut(Seen),
    ) -> Result<Counters, OutOfMemory> {
        self.flight.follow(task, map, scratch, &mut VisibilityCounter { keep: self.keep, sight, seen })
    }
}

/// A photon that is seen.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The number of its path among those of its task.
    pub path: usize,
    /// From which cell of a guide it came.
    pub cell: u32,
    /// W: the luminance of its power.
    pub power: f32,
}

/// Tells of photons that are seen.
struct VisibilityCounter<'s> {
    keep: PhotonFilter,
    sight: VisiblePoints<'s>,
    seen: &'s mut dyn FnMut(Seen),
}

impl Visitor for VisibilityCounter<'_> {
    const SEED: u64 = Depositor::SEED;

    #[inline]
    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        _: &mut Counters,
    ) -> Option<Continuation> {
        let leaves = self.keep.leaves(state, vertex);
        if leaves && self.sight.shows(vertex.point.position, vertex.point.geometric_normal) {
            let power = luminance(Rgb::from(state.power));
            (self.seen)(Seen { path: state.number as usize % PATHS, cell: state.cell, power });
        }
        self.keep.onward(vertex, leaves)
    }
}

/// Leaves the photons that are wanted.
pub(in crate::transport) struct Depositor<'p> {
    keep: PhotonFilter,
    pile: PhotonBuffer<'p>,
}

impl Visitor for Depositor<'_> {
    const SEED: u64 = 0x7068_6f74_6f6e_7321;

    #[inline]
    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        counters: &mut Counters,
    ) -> Option<Continuation> {
        let leaves = self.keep.leaves(state, vertex);
        if leaves {
            let power = Rgb::from(state.power);
            if power.max_element() > 0.0 {
                self.pile.leave(vertex.photon(power), counters);
            }
        }
        self.keep.onward(vertex, leaves)
    }
}
