//! Pixels that see an edge: of a thing before another, between two walls, between two materials. Where indirect light
//! is interpolated, what is left of noise is shadows' and theirs, and theirs lies in one pixel of twenty. So these have
//! several paths for each of their first samples. An edge is noise of few samples: it falls faster than others with the points of a
//! net, and later ones are better spent on all pixels alike.
//!
//! Which pixels these are follows from what rays through their corners meet, and from no sample, so that nothing is
//! biased. An edge that lies within a pixel and passes none of its corners is missed, and costs noise.

use super::estimator::Counters;
use super::path::PathTracer;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::film::{PIXELS_PER_TILE, PixelSet, TILE, Tile};
use crate::geometry::{Hit, Ray};
use core::ops::Range;
use glam::Vec3;

/// Paths for each of the first samples of a pixel with an edge, a power of two: their numbers stay a net.
pub(super) const PER_EDGE: u32 = 4;

/// So many of them in each half of the samples.
const FIRST: u32 = 8;

/// The cosine between normals from which on there is an edge.
const BENT: f32 = 0.95;

/// Corners along the side of a tile.
const CORNERS: usize = TILE as usize + 1;

/// The paths of sample `index` of a half of the samples of a pixel with an edge: points of its net.
pub(super) fn points_of(index: u32) -> Range<u32> {
    let first = index + (PER_EDGE - 1) * index.min(FIRST);
    first..first + if index < FIRST { PER_EDGE } else { 1 }
}

/// The sample of the half that such a point belongs to.
pub(super) fn sample_of(point: u32) -> u32 {
    if is_of_several(point) { point / PER_EDGE } else { point - (PER_EDGE - 1) * FIRST }
}

/// Whether it belongs to a sample of several.
pub(super) fn is_of_several(point: u32) -> bool {
    point < PER_EDGE * FIRST
}

impl<'a, F: Features> PathTracer<'a, F> {
    /// The same, where the pixels of `edges`, tile by tile, have several paths for each of their first samples. Not where pixels
    /// share their paths.
    pub fn with_edges(&self, edges: &'a [PixelSet]) -> Self {
        let mut other = *self;
        other.edges = edges;
        other
    }

    /// The pixels of tile `task` that see an edge. None through a lens, which blurs them.
    pub fn edges(&self, task: usize, counters: &mut Counters) -> PixelSet {
        let (width, height) = (self.settings.width, self.settings.height);
        let camera = &self.scene.camera;
        let mut edges = PixelSet::default();
        if camera.lens_radius > 0.0 {
            return edges;
        }
        let tile = Tile::new(width, height, task);
        let [left, top] = tile.corner();
        let mut rays = [Ray::segment(Vec3::ZERO, Vec3::Z, -1.0); CORNERS * CORNERS];
        for (i, ray) in rays.iter_mut().enumerate() {
            let (x, y) = (left + (i % CORNERS) as u32, top + (i / CORNERS) as u32);
            if x <= width && y <= height {
                *ray = self.scene.camera.ray(width, height, x as f32, y as f32, [0.0; 2]);
                counters.rays += 1;
            }
        }
        let mut hits = [Hit::NONE; CORNERS * CORNERS];
        self.bvh.nearest_batch(self.level, &rays, Coherence::Coherent, &mut hits);
        let pixel = 2.0 * camera.tan_half_fov / height as f32;
        for place in 0..PIXELS_PER_TILE {
            if tile.pixel(place).is_none() {
                continue;
            }
            let (x, y) = Tile::place(place);
            let first = y as usize * CORNERS + x as usize;
            let corners = [first, first + 1, first + CORNERS, first + CORNERS + 1];
            let mut others = corners.iter().skip(1);
            if others.any(|&i| self.is_edge((&rays[first], &hits[first]), (&rays[i], &hits[i]), pixel)) {
                edges.insert(place);
            }
        }
        edges
    }

    /// Whether two rays meet different surfaces. `pixel` is the width of a pixel at a distance of one.
    fn is_edge(&self, (ray, hit): (&Ray, &Hit), (other_ray, other): (&Ray, &Hit), pixel: f32) -> bool {
        if hit.triangle == other.triangle {
            return false;
        }
        let mesh = &self.scene.mesh;
        let (Some(triangle), Some(other_triangle)) =
            (mesh.triangles.get(hit.triangle as usize), mesh.triangles.get(other.triangle as usize))
        else {
            return true;
        };
        let normal = |hit: &Hit| {
            let [a, b, c] = mesh.corners(hit.triangle);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let end = |ray: &Ray, hit: &Hit| Vec3::from(ray.origin) + hit.t * Vec3::from(ray.direction);
        let here = normal(hit);
        let step = (end(other_ray, other) - end(ray, hit)).dot(here);
        let bent = here.dot(normal(other)).abs() < BENT;
        triangle.material != other_triangle.material || bent || step.abs() > pixel * hit.t
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_have_all_points_one_after_the_other() {
        let mut next = 0;
        for index in 0..4 * FIRST {
            let points = points_of(index);
            assert_eq!((points.start, points.len()), (next, if index < FIRST { 4 } else { 1 }));
            assert!(points.clone().all(|point| sample_of(point) == index));
            next = points.end;
        }
    }
}
