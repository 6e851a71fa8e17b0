//! Light that a method finds with no number of samples: that of lights without extent, if every two
//! neighbouring vertices of its paths have a mirror or smooth glass among them, so that no technique of the
//! method joins them (Veach 1997, 10.3.1). Photons find it: they need no connection.

use crate::Rgb;
use crate::bsdf::{BsdfSample, Features};
use crate::light::{EmissionSampler, LightType, luminance};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::{Kernel, Photon, PhotonMap, QueryDisc, Uniform};
use crate::transport::photon_mapping::density::{Light, reflected};
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::photon_mapping::visible_points::VisiblePointSampler;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::light::{
    Continuation, LightPathState, LightWalk, MAX_CONTINUATION, Vertex, Visitor,
};
use crate::transport::walk::photon_buffer::PhotonBuffer;
use glam::Vec3;

pub use crate::transport::walk::light::{PATHS_PER_TASK, VERTICES_PER_TASK};

/// Techniques of a method beside the light samples and hits of path tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Techniques {
    /// Vertices of light paths are connected to the camera.
    pub splats: bool,
    /// They are connected to vertices of camera paths.
    pub connections: bool,
}

/// Tracer of the photons of hidden light.
#[derive(Clone, Copy)]
pub struct HiddenLightTracer<'a, F> {
    walk: LightWalk<'a, F>,
    techniques: Techniques,
}

impl<'a, F: Features> HiddenLightTracer<'a, F> {
    /// Tracer of `paths` light paths for a method with these `techniques`.
    pub fn new(
        context: SceneContext<'a, F>,
        emission: &'a EmissionSampler<'a>,
        (settings, paths): (&PathSettings, u32),
        techniques: Techniques,
    ) -> Self {
        let PathSettings { seed, max_depth, .. } = *settings;
        Self { walk: LightWalk { context, emission, seed, paths, max_depth }, techniques }
    }

    /// Working memory of a task.
    pub fn scratch() -> Footprint {
        LightWalk::<F>::scratch()
    }

    /// Traces the photons of task `task` of map `map`, and fills the rest of `out` with photons that a map
    /// rejects. [`VERTICES_PER_TASK`] are enough.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`HiddenLightTracer::scratch`] bytes.
    #[inline(never)]
    pub fn run(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [Photon],
    ) -> Result<Counters, OutOfMemory> {
        let mut depositor = Depositor { tracer: self, buffer: PhotonBuffer::new(out) };
        let counters = self.walk.follow(task, map, scratch, &mut depositor)?;
        depositor.buffer.finish();
        Ok(counters)
    }

    /// Mean of the channels of the hidden radiance along camera ray `number` of `raster`, by the photons of
    /// `map` in kernels of `radii`.
    #[inline(never)]
    pub fn along(
        &self,
        raster: &VisiblePointSampler,
        number: (u32, u32),
        (map, radii): (&PhotonMap, RadiusSchedule),
        counters: &mut Counters,
    ) -> f32 {
        let context = &self.walk.context;
        let Some(seen) = raster.seen(context, number, counters) else { return 0.0 };
        let Techniques { splats, connections } = self.techniques;
        if splats && seen.is_first_rough || connections && seen.has_joint {
            return 0.0;
        }
        let disc = QueryDisc {
            place: seen.point.position,
            normal: seen.point.geometric_normal,
            radius: radii.radius(seen.point.position),
            kernel: Kernel::Constant,
        };
        let density = map.gather(context.level, &disc, &Uniform(Rgb::ONE));
        if density.photons == 0 {
            return 0.0;
        }
        let light = Light { map, is_caustic: true, min_photons: f32::INFINITY };
        let wo = seen.point.frame.to_local(seen.to_viewer);
        let found = reflected(light, context, (&disc, Some(density)), (&seen.point, &seen.bsdf), wo, 0.5);
        let radiance = seen.throughput * found.light;
        if radiance.is_finite() { radiance.element_sum() / 3.0 } else { 0.0 }
    }
}

/// Visitor that stores the photons of hidden light. `from_caster` is 1 behind a mirror or smooth glass.
struct Depositor<'s, 'a, F> {
    tracer: &'s HiddenLightTracer<'a, F>,
    buffer: PhotonBuffer<'s>,
}

impl<F: Features> Visitor for Depositor<'_, '_, F> {
    const SEED: u64 = 0x6869_6464_656e_2121;

    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        counters: &mut Counters,
    ) -> Option<Continuation> {
        let HiddenLightTracer { walk, techniques } = self.tracer;
        if walk.emission.light_type(&walk.context.lights, state.light) != LightType::Delta {
            return None;
        }
        // Light samples join a light to its first rough vertex.
        let is_joined = state.from_caster == 0 && (state.segments == 1 || techniques.connections);
        let stores = vertex.bsdf.stores_photons() && !is_joined;
        let power = Rgb::from(state.power);
        if stores && luminance(power) > 0.0 {
            self.buffer.push(vertex.photon(power), counters);
        }
        let most = if stores { MAX_CONTINUATION } else { 1.0 };
        Some(Continuation { most, specular_only: is_joined })
    }

    fn leave(&self, state: &mut LightPathState, _: &Vertex, _: Vec3, (sample, _): (&BsdfSample, bool)) {
        state.from_caster = u32::from(sample.delta);
    }
}
