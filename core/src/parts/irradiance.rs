//! Irradiance at points of surfaces, and the derivatives of irradiance from gather rays (Schwarzhaupt, Jensen
//! and Jarosz 2012). [`IrradianceRenderer`](crate::IrradianceRenderer) is for many points: on threads, with
//! intervals, until their error is small.
//!
//! ```
//! use halflight_core::glam::Vec3;
//! use halflight_core::parts::irradiance::IrradianceSampler;
//! use halflight_core::parts::rays::Ray;
//! use halflight_core::scene::{Environment, Material, Mesh, Triangle};
//! use halflight_core::{Arena, Line, Rgb, Scene};
//!
//! // A floor under a white sky.
//! let scene = Scene {
//!     mesh: Mesh {
//!         positions: &[[-1.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, -1.0]],
//!         triangles: &[Triangle { vertices: [0, 1, 2], material: 0 }],
//!         ..Mesh::default()
//!     },
//!     materials: &[Material::diffuse(Rgb::splat(0.5))],
//!     environment: Some(Environment::uniform(Rgb::ONE)),
//!     ..Scene::default()
//! };
//! let mut lines = vec![Line::ZERO; Line::count(IrradianceSampler::required_memory(&scene))];
//! let sampler = IrradianceSampler::new(&scene, &mut Arena::over(&mut lines))?;
//! let down = Ray::new(Vec3::new(0.0, 1.0, 0.0), Vec3::NEG_Y);
//! let floor = sampler.irradiance(&down, 0, 256).expect("the ray hits the floor");
//! assert!((floor.mean.x - core::f32::consts::PI).abs() < 1e-3);
//! # Ok::<(), halflight_core::memory::OutOfMemory>(())
//! ```

pub use crate::cache::irradiance::{
    CellFlux, Derivatives, Hemisphere, Hessian, Metric, Validity, metric, validity,
};
pub use crate::sampling::warp::cosine_hemisphere;

use crate::bsdf::All;
use crate::bvh::Bvh;
use crate::geometry::Ray;
use crate::light::LightSampler;
use crate::memory::{Arena, OutOfMemory};
use crate::sampling::Sampler;
use crate::scene::{Scene, SurfacePoint};
use crate::transport::UNLIMITED;
use crate::transport::path::single::irradiance;
use crate::{Level, Rgb};

/// A scene that is ready for estimates of irradiance by path tracing.
#[derive(Clone, Copy)]
pub struct IrradianceSampler<'a> {
    scene: &'a Scene<'a>,
    bvh: Bvh<'a>,
    lights: LightSampler<'a>,
}

/// Irradiance of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Irradiance {
    /// Mean of the paths, W/m².
    pub mean: Rgb,
    /// Standard error of the mean.
    pub standard_error: Rgb,
}

impl<'a> IrradianceSampler<'a> {
    /// Bytes that [`IrradianceSampler::new`] needs.
    pub fn required_memory(scene: &Scene) -> usize {
        let lights = LightSampler::footprint(scene).and(LightSampler::scratch(scene));
        Bvh::footprint_of(&scene.mesh).and(lights).bytes()
    }

    /// Builds the hierarchy and the lights of `scene`, whose camera is of no matter.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`IrradianceSampler::required_memory`].
    pub fn new(scene: &'a Scene<'a>, arena: &mut Arena<'a>) -> Result<Self, OutOfMemory> {
        let bvh = Bvh::build(&scene.mesh, arena)?;
        Ok(Self { scene, bvh, lights: LightSampler::build(scene, arena)? })
    }

    /// Irradiance of the surface that `ray` hits, on its side, by so many paths; `number` makes their random
    /// numbers others than those of other points. `None` where the ray hits nothing.
    pub fn irradiance(&self, ray: &Ray, number: u32, paths: u32) -> Option<Irradiance> {
        let hit = self.bvh.nearest(Level::detect(), ray);
        let point = SurfacePoint::at::<All>(self.scene, ray, &hit)?;
        let (mut sum, mut squares) = (Rgb::ZERO, Rgb::ZERO);
        for path in 0..paths {
            let sampler = Sampler::new(0, number, path);
            let sample = irradiance(self.scene, &self.bvh, &self.lights, UNLIMITED, &sampler, &point);
            sum += sample;
            squares += sample * sample;
        }
        let count = paths.max(1) as f32;
        let mean = sum / count;
        let variance = (squares / count - mean * mean).max(Rgb::ZERO) / (count - 1.0).max(1.0);
        Some(Irradiance { mean, standard_error: variance.map(libm::sqrtf) })
    }
}
