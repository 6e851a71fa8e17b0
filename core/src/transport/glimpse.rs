//! What the camera sees in mirrors and behind glass: a few places, so that a look at photons of caustics can tell that those
//! show which lie there (`caustics.rs`). What is seen straight on, or straight through glass, needs none: it is projected.

use super::caustics::BLOCKS;
use super::estimator::dimension;
use super::merge::ends_chain;
use crate::bsdf::{Bsdf, Features};
use crate::bvh::Bvh;
use crate::sampling::Sampler;
use crate::scene::{Scene, SurfacePoint};
use crate::{Level, Rgb};
use glam::Vec3;

/// Camera rays across and down.
const ACROSS: u32 = 32;
/// The most places that are found.
pub const GLIMPSES: usize = (ACROSS * ACROSS) as usize;

/// Mirrors and surfaces of glass on the way, at most.
const MOST_MIRRORS: u32 = 16;

/// How far a place stands for others, in distances of two rays that meet a surface straight on.
const REACH: f32 = 0.75;

/// Cosine of the angle at which a ray meets a surface that counts as this, if it is less.
const GRAZING: f32 = 0.25;

/// Cosine of the largest angle between normals of places that are alike.
const ALIKE: f32 = 0.7;

/// A place that is seen so.
#[derive(Clone, Copy, Debug, Default)]
pub struct Glimpse {
    place: Vec3,
    normal: Vec3,
    /// Places within this distance are seen as well.
    reach: f32,
    /// How long the way is from the eye.
    pub(super) travelled: f32,
    /// The block of the picture, of [`BLOCKS`] across and down.
    pub(super) block: u32,
}

impl Glimpse {
    /// Finds places that show in mirrors and behind glass, for a picture of `scene` that is `frame` pixels wide and high;
    /// returns how many are in `out` now, [`GLIMPSES`] at most. What is mirrored faintly is found so much less often.
    pub fn find<F: Features>(
        (scene, bvh, level): (&Scene, &Bvh, Level),
        frame: [u32; 2],
        seed: u32,
        out: &mut [Glimpse],
    ) -> usize {
        let found =
            (0..GLIMPSES as u32).filter_map(|i| Self::along::<F>((scene, bvh, level), frame, seed, i));
        out.iter_mut().zip(found).map(|(slot, glimpse)| *slot = glimpse).count()
    }

    /// What camera ray `i` finds behind mirrors and glass.
    fn along<F: Features>(
        (scene, bvh, level): (&Scene, &Bvh, Level),
        [width, height]: [u32; 2],
        seed: u32,
        i: u32,
    ) -> Option<Self> {
        let camera = &scene.camera;
        let (column, row) = (i % ACROSS, i / ACROSS);
        let at = |i: u32, pixels: u32| (i as f32 + 0.5) * pixels as f32 / ACROSS as f32;
        let sampler = Sampler::new(seed, i, 0);
        let mut ray = camera.ray(width, height, at(column, width), at(row, height), [0.5; 2]);
        let (mut from, mut travelled, mut throughput) = (camera.eye, 0.0, Rgb::ONE);
        for segments in 1..=MOST_MIRRORS + 1 {
            let hit = bvh.nearest(level, &ray);
            let point = SurfacePoint::at::<F>(scene, &ray, &hit).filter(|_| hit.is_some())?;
            let direction = Vec3::from(ray.direction).normalize_or_zero();
            travelled += from.distance(point.position);
            let bsdf = Bsdf::at::<F>(scene, point.material, point.uv, point.front);
            let first = dimension::vertex(segments);
            if ends_chain(&bsdf) {
                let is_kept = sampler.single(first + dimension::ROULETTE) < throughput.max_element();
                let between =
                    2.0 * camera.tan_half_fov * width.max(height) as f32 / (height.max(1) * ACROSS) as f32;
                let cosine = direction.dot(point.geometric_normal).abs().max(GRAZING);
                return (segments > 1 && is_kept).then_some(Self {
                    place: point.position,
                    normal: point.geometric_normal,
                    reach: REACH * between * travelled / cosine,
                    travelled,
                    block: row * BLOCKS / ACROSS * BLOCKS + column * BLOCKS / ACROSS,
                });
            }
            let [u, v] = dimension::scattering(&sampler, segments);
            let lobe = sampler.single(first + dimension::LOBE);
            let wo = point.frame.to_local(-direction);
            let sample = bsdf.sample::<F>(wo, [u, v, lobe]).filter(|sample| sample.delta)?;
            throughput *= sample.weight;
            from = point.position;
            ray = point.spawn(point.frame.to_world(sample.direction));
        }
        None
    }

    /// Whether a surface at `place` with `normal` is seen with it.
    #[inline]
    pub(super) fn shows(&self, place: Vec3, normal: Vec3) -> bool {
        self.place.distance_squared(place) < self.reach * self.reach && self.normal.dot(normal) > ALIKE
    }
}
