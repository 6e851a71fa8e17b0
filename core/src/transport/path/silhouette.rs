//! Extra camera rays for the emission of lamps in pixels on the border of a lamp. A lamp that covers a
//! hundredth of a pixel is hit by few samples and dominates the pixel: a row of such pixels has most of the
//! error of a picture, and estimates miss it. In these pixels direct emission comes from many camera rays per
//! sample, which evaluate emission only; the path of the sample finds all other light.
//!
//! The set of these pixels depends only on the camera and the corners of the lamps, so that there is no bias.

use super::PathIntegrator;
use super::estimator::LightEstimator;
use super::sharing::Sharing;
use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::film::{PIXELS_PER_TILE, PixelSet, REACH, SPAN, TILE, Tile};
use crate::geometry::{Hit, MISS, Ray};
use crate::light::{LightSampler, emitted};
use crate::sampling::Sampler;
use crate::scene::{Camera, CameraKind, Material, Scene};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::termination::MAX_CROSSINGS;
use crate::transport::wavefront::Wavefront;
use glam::{Vec2, Vec3};

/// Camera rays per sample; a power of two, so that their positions in the pixel form a net. They take about
/// as long as two samples, in one pixel of a hundred.
const RAYS_PER_SAMPLE: u32 = 32;

/// Maximum number of lamp triangles in view of a tile. With more, the triangles are smaller than pixels, and
/// testing all borders would take too long.
const MAX_EMITTERS: usize = 4096;

/// Distance in pixels within which a border counts as seen; exceeds rounding.
const MARGIN: f32 = 0.01;

/// Near plane of a border that starts behind the camera, as a fraction of the border's maximum depth.
const NEAR_PLANE: f32 = 1e-3;

/// Set of pixels of the square around a tile: one bit per column for each row.
type Rows = [u32; SPAN as usize];

/// Adds the pixels on the segment from `a` to `b`, in raster coordinates relative to the square's corner.
fn add(pixels: &mut Rows, a: Vec2, b: Vec2) {
    let (a, b) = if a.y <= b.y { (a, b) } else { (b, a) };
    let side = SPAN as f32;
    let (low, high) = (a.min(b) - MARGIN, a.max(b) + MARGIN);
    if !(low.x < side && high.x >= 0.0 && low.y < side && high.y >= 0.0) {
        return;
    }
    let slope = if b.y > a.y { (b.x - a.x) / (b.y - a.y) } else { 0.0 };
    let at = |y: f32| if slope == 0.0 { [a.x, b.x] } else { [a.x + slope * (y.clamp(a.y, b.y) - a.y); 2] };
    // Casts saturate.
    for y in low.y.max(0.0) as u32..=(high.y as u32).min(SPAN - 1) {
        let ([p, q], [r, s]) = (at(y as f32 - MARGIN), at(y as f32 + 1.0 + MARGIN));
        let (left, right) = (p.min(q).min(r.min(s)) - MARGIN, p.max(q).max(r.max(s)) + MARGIN);
        if right < 0.0 {
            continue;
        }
        for x in left.max(0.0) as u32..=(right as u32).min(SPAN - 1) {
            pixels[y as usize] |= 1 << x;
        }
    }
}

/// Cone around the view of a tile.
struct TileCone {
    eye: Vec3,
    axis: Vec3,
    cos: f32,
    sin: f32,
}

impl TileCone {
    fn of(camera: &Camera, settings: &PathSettings, tile: Tile) -> Self {
        let direction = |[x, y]: [f32; 2]| -> Vec3 {
            camera.ray(settings.width, settings.height, x, y, [0.0; 2]).direction.into()
        };
        // One more pixel on each side.
        let beyond = REACH as f32 + 1.0;
        let [near, far] = [-beyond, TILE as f32 + beyond].map(|by| tile.corner().map(|c| c as f32 + by));
        let axis = direction([0, 1].map(|i| 0.5 * (near[i] + far[i])));
        let corners = [near, far, [near[0], far[1]], [far[0], near[1]]];
        let cos = corners.map(|corner| direction(corner).dot(axis)).into_iter().fold(1.0, f32::min);
        Self { eye: camera.eye, axis, cos, sin: libm::sqrtf((1.0 - cos * cos).max(0.0)) }
    }

    /// True if the sphere overlaps the cone.
    fn meets(&self, center: Vec3, radius: f32) -> bool {
        let to = center - self.eye;
        let distance = to.length();
        if radius >= distance || !distance.is_finite() {
            return true;
        }
        let sin = radius / distance;
        let cos = libm::sqrtf((1.0 - sin * sin).max(0.0));
        to.dot(self.axis) >= distance * (self.cos * cos - self.sin * sin - 1e-4)
    }
}

/// Pixels of a tile that see the border of a lamp, without regard to occlusion. Empty with a lens or with
/// cut-outs, where borders are not sharp, and with parallel rays or a panorama.
pub(in crate::transport) fn silhouette_pixels(
    scene: &Scene,
    lights: &LightSampler,
    settings: &PathSettings,
    tile: Tile,
) -> PixelSet {
    let camera = &scene.camera;
    if camera.lens_radius > 0.0 || camera.kind != CameraKind::Perspective {
        return PixelSet::default();
    }
    let mut rows = Rows::default();
    let corner = Vec2::from(tile.corner().map(|c| c as f32 - REACH as f32));
    let on_raster = |point| {
        let seen = camera.project(settings.width, settings.height, point, [0.0; 2])?;
        Some(seen.raster - corner)
    };
    let view = TileCone::of(camera, settings, tile);
    let meets = |center, radius| view.meets(center, radius);
    lights.borders(&scene.mesh, camera.eye, MAX_EMITTERS, meets, |[a, b]| {
        // Clips the part behind the camera.
        let [near, far] = [a, b].map(|point| (point - camera.eye).dot(camera.forward));
        let least = NEAR_PLANE * near.max(far);
        let cut = |point: Vec3, depth: f32, other: Vec3, beyond: f32| {
            if depth < least { point + (other - point) * ((least - depth) / (beyond - depth)) } else { point }
        };
        if let (Some(a), Some(b)) = (on_raster(cut(a, near, b, far)), on_raster(cut(b, far, a, near))) {
            add(&mut rows, a, b);
        }
    });
    let has_cutouts = || scene.materials.iter().any(Material::has_cutout);
    let mut pixels = PixelSet::default();
    if rows == Rows::default() || has_cutouts() {
        return pixels;
    }
    for i in 0..PIXELS_PER_TILE {
        let [row, column] =
            [tile.index_in_square(i) / SPAN as usize, tile.index_in_square(i) % SPAN as usize];
        if tile.pixel(i).is_some() && rows.get(row).is_some_and(|row| row >> column & 1 == 1) {
            pixels.insert(i);
        }
    }
    pixels
}

/// True if [`silhouette_pixels`] has the pixel in column `x` and row `y`.
pub(in crate::transport) fn is_on_silhouette(
    scene: &Scene,
    lights: &LightSampler,
    settings: &PathSettings,
    [x, y]: [u32; 2],
) -> bool {
    let position = Tile::position([settings.width, settings.height], x, y);
    let tile = Tile::new(settings.width, settings.height, position / PIXELS_PER_TILE);
    silhouette_pixels(scene, lights, settings, tile).contains(position % PIXELS_PER_TILE)
}

/// Extra rays of one sample of the pixel in column `x` and row `y`.
pub(in crate::transport) fn rays(
    scene: &Scene,
    settings: &PathSettings,
    [x, y]: [u32; 2],
    sample: u32,
) -> impl Iterator<Item = Ray> {
    let PathSettings { width, height, seed, .. } = *settings;
    let camera = scene.camera;
    (0..RAYS_PER_SAMPLE).map(move |n| {
        let index = (sample >> 1).wrapping_mul(RAYS_PER_SAMPLE).wrapping_add(n);
        let sampler = Sampler::replicate(seed, y * width + x, sample & 1, index);
        let [dx, dy] = sampler.pair(dimension::SILHOUETTE);
        camera.ray(width, height, x as f32 + dx, y as f32 + dy, [0.0; 2])
    })
}

/// Contribution of one of [`rays`], with result `hit`, to its pixel. Like a camera path, the ray skips a
/// surface that the camera lies on.
pub(in crate::transport) fn emission<F: Features>(
    context: &SceneContext<F>,
    mut ray: Ray,
    mut hit: Hit,
) -> Rgb {
    let mut left = MISS;
    for _ in 0..=MAX_CROSSINGS {
        let Some(point) = context.surface_at(&ray, &hit) else { break };
        if hit.triangle != left && !point.is_left_by(&ray) {
            let emits = point.material.emits();
            let light = if emits {
                emitted(context.scene, hit.triangle, &point.attributes, point.front)
            } else {
                Rgb::ZERO
            };
            return light / RAYS_PER_SAMPLE as f32;
        }
        left = hit.triangle;
        ray = point.spawn(ray.direction.into());
        hit = context.nearest(&ray);
    }
    Rgb::ZERO
}

impl<F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'_, F, E, R> {
    /// Sets `wave.shadows.light` of the first `count` paths to the emission of lamps in their pixels, or to
    /// zero if the place of the pixel is not `on_silhouette`.
    pub(super) fn trace_silhouettes(
        &self,
        mut on_silhouette: impl FnMut(u32) -> bool,
        wave: &mut Wavefront,
        count: usize,
        counters: &mut Counters,
    ) {
        let (mut filled, capacity) = (0, wave.rays.len());
        for i in 0..count {
            wave.shadows.light[i] = [0.0; 3];
            let path = wave.paths[i];
            if !on_silhouette(path.place) {
                continue;
            }
            let place = [path.pixel % self.settings.width, path.pixel / self.settings.width];
            for ray in rays(self.context.scene, &self.settings, place, path.sample) {
                wave.rays[filled] = Ray { tag: i as u32, ..ray };
                filled += 1;
                if filled == capacity {
                    self.add_emission(wave, core::mem::take(&mut filled), counters);
                }
            }
        }
        self.add_emission(wave, filled, counters);
    }

    /// Adds the emission at the hits of the first `count` rays of the wave.
    fn add_emission(&self, wave: &mut Wavefront, count: usize, counters: &mut Counters) {
        wave.trace(&self.context, count, Coherence::Coherent, counters);
        for (ray, hit) in wave.rays.iter().zip(&*wave.hits).take(count) {
            let light = emission(&self.context, *ray, *hit);
            if let Some(sum) = wave.shadows.light.get_mut(ray.tag as usize) {
                *sum = (Rgb::from(*sum) + light).to_array();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;

    #[test]
    fn every_pixel_on_the_way_is_marked_and_few_others() {
        for n in 0..200 {
            let random = Random::new(7, n);
            let at = |i: u32| Vec2::new(random.single(i), random.single(i + 1)) * 48.0 - 12.0;
            let (a, mut b) = (at(0), at(2));
            match n % 4 {
                0 => b.y = a.y,
                1 => b.x = a.x,
                _ => (),
            }
            let mut pixels = Rows::default();
            add(&mut pixels, a, b);
            let mut near = Rows::default();
            for step in 0..=4000 {
                let point = a.lerp(b, step as f32 / 4000.0);
                for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let [x, y] = [point.x - 0.03 + 0.06 * x as f32, point.y - 0.03 + 0.06 * y as f32];
                    if (0.0..SPAN as f32).contains(&x) && (0.0..SPAN as f32).contains(&y) {
                        near[y as usize] |= 1 << x as u32;
                    }
                }
                if point.cmpge(Vec2::ZERO).all() && point.cmplt(Vec2::splat(SPAN as f32)).all() {
                    assert!(pixels[point.y as usize] >> point.x as u32 & 1 == 1, "{a} {b} {point}");
                }
            }
            assert!(pixels.iter().zip(near).all(|(pixels, near)| pixels & !near == 0), "{a} {b}");
        }
    }

    #[test]
    fn segments_that_are_no_numbers_are_none() {
        let mut pixels = Rows::default();
        add(&mut pixels, Vec2::splat(f32::NAN), Vec2::splat(3.0));
        add(&mut pixels, Vec2::new(f32::NEG_INFINITY, 3.0), Vec2::new(f32::INFINITY, f32::NAN));
        add(&mut pixels, Vec2::new(-1e30, -1e30), Vec2::new(1e30, 1e30));
        add(&mut pixels, Vec2::new(f32::NEG_INFINITY, 3.0), Vec2::new(f32::INFINITY, 3.5));
    }
}
