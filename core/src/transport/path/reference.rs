//! Pixels of the textbook path tracer (`single.rs`), with which [`crate::transport::path`] agrees to the bit.

use super::silhouette::{self, is_on_silhouette};
use super::single::{Start, follow};
use crate::bsdf::All;
use crate::bvh::Bvh;
use crate::geometry::MISS;
use crate::light::LightSampler;
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::transport::settings::PathSettings;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::{Level, Rgb};
use glam::Vec3;

pub use super::single::irradiance;

/// Radiance of sample `sample` of the pixel in column `x` and row `y`.
pub fn radiance(
    scene: &Scene,
    bvh: &Bvh,
    lights: &LightSampler,
    settings: &PathSettings,
    [x, y]: [u32; 2],
    sample: u32,
) -> Rgb {
    let PathSettings { width, height, seed, max_depth, .. } = *settings;
    let context = SceneContext::<All>::new(scene, bvh, lights, Level::BASELINE);
    let sampler = Sampler::new(seed, y * width + x, sample);
    let [dx, dy] = sampler.pair(dimension::PIXEL);
    let lens = sampler.pair(dimension::LENS);
    let ray = scene.camera.ray(width, height, x as f32 + dx, y as f32 + dy, lens);

    // Extra rays cover the lamps at pixels on their borders.
    let is_on_silhouette = is_on_silhouette(scene, lights, settings, [x, y]);
    let (from, normal) = (Vec3::ZERO, Vec3::ZERO);
    let start = Start { ray, from, normal, pdf: f32::INFINITY, triangle: MISS, segments: 1 };
    let radiance = follow(&context, &sampler, max_depth, is_on_silhouette, (start, Rgb::ZERO));
    let mut lamps = Rgb::ZERO;
    if is_on_silhouette {
        for ray in silhouette::rays(scene, settings, [x, y], sample) {
            let hit = context.nearest(&ray);
            lamps += silhouette::emission(&context, ray, hit);
        }
    }
    radiance + lamps
}
