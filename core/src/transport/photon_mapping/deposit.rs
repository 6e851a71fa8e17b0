//! Photon tracing: light paths that store photons on rough surfaces (Jensen 1996).
//!
//! A [`PhotonFilter`] selects the stored light: light reflected by surfaces, mirrors and glass, beside which
//! shadow rays find direct light; all light; or caustics alone. `walk/light.rs` traces the paths.
//!
//! Departures from the plain algorithm:
//! 1. Between white walls a path stores many photons. If those of a task exceed [`VERTICES_PER_TASK`], a
//!    random part of them is kept (`walk/photon_buffer.rs`). Paths are not ended earlier instead: photons of
//!    long paths would have so much power that the variance of their sum is infinite from an albedo of 0.89
//!    on.

use crate::bsdf::Features;
use crate::bvh::Bvh;
use crate::light::{EmissionSampler, LightSampler, luminance};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::Photon;
use crate::scene::Scene;
use crate::transport::photon_mapping::visible_points::VisiblePoints;
use crate::transport::settings::{Counters, UNLIMITED};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::light::{Continuation, LightPathState, LightWalk, Vertex, Visitor};
pub use crate::transport::walk::light::{PATHS_PER_TASK, VERTICES_PER_TASK};
use crate::transport::walk::photon_buffer::PhotonSample;
use crate::{Level, Rgb};

/// Selection of the photons to store.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PhotonFilter {
    /// All except those directly from a light.
    #[default]
    Reflected,
    /// All photons.
    All,
    /// Photons whose path from the light has specular vertices alone, and at least one. The path ends there.
    Caustic,
}

impl PhotonFilter {
    /// True if the path stores a photon at `vertex`.
    #[inline]
    pub(in crate::transport) fn stores(self, state: &LightPathState, vertex: &Vertex) -> bool {
        vertex.bsdf.stores_photons()
            && match self {
                PhotonFilter::All => true,
                PhotonFilter::Reflected | PhotonFilter::Caustic => state.segments > 1,
            }
    }

    /// Continuation of the path behind `vertex`.
    #[inline]
    pub(in crate::transport) fn continuation(self, vertex: &Vertex) -> Option<Continuation> {
        let ends = self == PhotonFilter::Caustic
            && (vertex.bsdf.stores_photons() || !vertex.bsdf.is_caustic_caster());
        (!ends).then_some(Continuation { most: 1.0, specular_only: false })
    }
}

/// Settings of a photon tracer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhotonTracerSettings {
    /// Selection of the photons to store.
    pub keep: PhotonFilter,
    /// Seed of the random numbers of photons.
    pub seed: u32,
    /// Number of light paths per map.
    pub paths: u32,
    /// Maximum number of segments between camera and light, including the camera's segment.
    pub max_depth: u32,
}

/// Photon tracer of one scene: a pass of tasks of [`PATHS_PER_TASK`] paths.
#[derive(Clone, Copy)]
pub struct PhotonTracer<'a, F> {
    pub(in crate::transport) flight: LightWalk<'a, F>,
    keep: PhotonFilter,
}

impl<'a, F: Features> PhotonTracer<'a, F> {
    /// Photon tracer over frozen structures. `F` has at least the features of the scene.
    pub fn new(
        scene: &'a Scene<'a>,
        bvh: &Bvh<'a>,
        lights: &LightSampler<'a>,
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

    /// Scratch memory of one task.
    pub fn scratch() -> Footprint {
        LightWalk::<F>::scratch()
    }

    /// Photon capacity that a task needs.
    pub fn room(&self) -> usize {
        if self.keep == PhotonFilter::Caustic { PATHS_PER_TASK } else { VERTICES_PER_TASK }
    }

    /// Traces the photons of task `task` of map `map` (below 2³¹). Fills the rest of `out` with photons
    /// without position, which a map rejects. A capacity of [`PhotonTracer::room`] is enough.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PhotonTracer::scratch`] bytes.
    #[inline(never)]
    pub fn run(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [Photon],
    ) -> Result<Counters, OutOfMemory> {
        let max_depth = self.flight.max_depth;
        let buffer = PhotonSample::new(out, max_depth != UNLIMITED);
        let mut depositor = Depositor { keep: self.keep, max_depth, buffer };
        let counters = self.flight.follow(task, map, scratch, &mut depositor)?;
        depositor.buffer.finish();
        Ok(counters)
    }

    /// Calls `seen` for each photon of task `task` of map `map` that lies near a visible point of `sight`.
    ///
    /// # Errors
    /// Errors of [`PhotonTracer::run`].
    pub fn trace_visible(
        &self,
        (task, map): (usize, u32),
        sight: VisiblePoints,
        scratch: &mut Arena,
        seen: &mut dyn FnMut(VisiblePhoton),
    ) -> Result<Counters, OutOfMemory> {
        self.flight.follow(task, map, scratch, &mut VisibilityCounter { keep: self.keep, sight, seen })
    }
}

/// Photon near a visible point.
#[derive(Clone, Copy, Debug)]
pub struct VisiblePhoton {
    /// Index of its path in the task.
    pub path: usize,
    /// Cell of the emission guide.
    pub cell: u32,
    /// Luminance of its power in W, or of its light in the picture, up to a factor.
    pub light: f32,
}

/// Visitor that reports photons near visible points.
struct VisibilityCounter<'s> {
    keep: PhotonFilter,
    sight: VisiblePoints<'s>,
    seen: &'s mut dyn FnMut(VisiblePhoton),
}

impl Visitor for VisibilityCounter<'_> {
    const SEED: u64 = Depositor::SEED;

    #[inline]
    fn has_densities(&self, _: &LightPathState, _: &Vertex) -> bool {
        false
    }

    #[inline]
    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        _: &mut Counters,
    ) -> Option<Continuation> {
        if self.keep.stores(state, vertex) {
            let importance = self.sight.importance(vertex.point.position, vertex.point.geometric_normal);
            let light = luminance(Rgb::from(state.power)) * importance;
            if light > 0.0 {
                let path = state.number as usize % PATHS_PER_TASK;
                (self.seen)(VisiblePhoton { path, cell: state.cell, light });
            }
        }
        self.keep.continuation(vertex)
    }
}

/// Visitor that stores the selected photons.
pub(in crate::transport) struct Depositor<'p> {
    keep: PhotonFilter,
    max_depth: u32,
    buffer: PhotonSample<'p>,
}

impl Visitor for Depositor<'_> {
    const SEED: u64 = 0x7068_6f74_6f6e_7321;

    #[inline]
    fn has_densities(&self, _: &LightPathState, _: &Vertex) -> bool {
        false
    }

    #[inline]
    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        counters: &mut Counters,
    ) -> Option<Continuation> {
        let stores = self.keep.stores(state, vertex);
        if stores {
            let power = Rgb::from(state.power);
            if power.max_element() > 0.0 {
                self.buffer.push(state.limited(vertex.photon(power), self.max_depth), counters);
            }
        }
        self.keep.continuation(vertex)
    }
}
