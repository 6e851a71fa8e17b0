//! Structures and settings of a picture that all of its methods use.

use super::threads::Workers;
use super::{Method, Settings};
use halflight_core::bsdf::Features;
use halflight_core::bvh::Bvh;
use halflight_core::light::LightSampler;
use halflight_core::method::choice::Goal;
use halflight_core::method::{MethodOptions, PathOptions, PilotSize, RenderContext, rays_per_second};
use halflight_core::scene::Scene;
use halflight_core::transport::{PathIntegrator, PathSettings, UNLIMITED};

/// Seconds per pixel reserved for the picture and its file.
const WRITING: f64 = 2e-7;

/// Structures that all methods use.
#[derive(Clone, Copy)]
pub(super) struct RenderSetup<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) bvh: Bvh<'a>,
    pub(super) lights: LightSampler<'a>,
    pub(super) settings: &'a Settings,
    pub(super) workers: &'a Workers<'a>,
}

impl<'a> RenderSetup<'a> {
    /// Path tracer of the picture, with another `seed`.
    pub(super) fn paths<F: Features>(&self, seed: u32) -> PathIntegrator<'a, F> {
        let Self { scene, bvh, lights, settings, .. } = *self;
        let paths = PathSettings { seed, ..settings.paths() };
        PathIntegrator::new(scene, &bvh, &lights, paths, settings.level)
    }

    /// End of the picture.
    pub(super) fn goal(&self) -> Goal {
        let stop = &self.settings.stop;
        let rays = rays_per_second(self.scene.mesh.triangles.len()) * self.workers.count() as f64;
        let rays = stop.seconds.map(|seconds| seconds * rays);
        Goal { rays, samples: stop.most_samples(), error: stop.error }
    }

    /// Context for methods of the core.
    pub(super) fn context(&self) -> RenderContext<'a> {
        let Self { scene, bvh, lights, settings, .. } = *self;
        let pilots = self.goal().rays_alone().map_or(PilotSize::USUAL, PilotSize::of_picture);
        let paths = settings.paths();
        RenderContext { scene, bvh, lights, settings: paths, level: settings.level, pilots }
    }
}

impl Settings {
    /// Path settings common to all methods.
    fn paths(&self) -> PathSettings {
        let Settings { width, height, seed, max_depth, .. } = *self;
        PathSettings { width, height, seed, max_depth: max_depth.unwrap_or(UNLIMITED) }
    }

    /// Seconds reserved for the end of a picture: each layer takes as long as a picture of its channels.
    pub(super) fn ending_seconds(&self) -> f64 {
        let pixels = f64::from(self.width) * f64::from(self.height);
        let channels = self.layers.as_ref().map_or(0, |layers| layers.channels());
        WRITING * pixels * (1.0 + f64::from(channels) / 3.0)
    }

    /// Options of all methods.
    pub(super) fn options(&self) -> MethodOptions {
        MethodOptions {
            paths: PathOptions { reuse: self.reuse, caustics: self.caustics },
            cache: self.cache,
            lobes: self.lobes,
            photons: self.photons,
            bidirectional: self.bidirectional,
            virtual_lights: self.virtual_lights,
            metropolis: self.metropolis,
        }
    }

    /// The settings that determine a picture of `method` and of no other, as text.
    pub(super) fn of_method(&self, method: Method) -> String {
        match method {
            Method::Path => String::new(),
            Method::IrradianceCache => format!("{:?}", self.cache),
            Method::RadianceCache => format!("{:?}, {:?}", self.cache, self.lobes),
            Method::PhotonMap | Method::ProgressivePhotons => format!("{:?}", self.photons),
            Method::LightTracing | Method::Bidirectional | Method::VertexMerging => {
                format!("{:?}", self.bidirectional)
            }
            Method::InstantRadiosity | Method::ClampedInstantRadiosity => {
                format!("{:?}", self.virtual_lights)
            }
            Method::Metropolis => format!("{:?}", self.metropolis),
        }
    }
}
