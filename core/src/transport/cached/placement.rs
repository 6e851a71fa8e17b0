//! Gather points of the picture: its pixels in coarse-to-fine order, of which the first n are evenly spread
//! for any n, and the diffuse point that a pixel sees directly or through other surfaces ([`Via`]), bare or
//! under a coat.

use crate::bsdf::{Bsdf, Features};
use crate::bvh::Coherence;
use crate::cache::radiance::ServedLobes;
use crate::geometry::{Hit, Ray};
use crate::sampling::Sampler;
use crate::scene::PixelWidth;
use crate::transport::cached::gather::GatherPoint;
use crate::transport::path::{LightEstimator, PathIntegrator};
use crate::transport::settings::Counters;
use crate::transport::walk::context::Segment;
use crate::transport::walk::dimension;
use crate::transport::walk::vertex::Scatterer;
use core::f32::consts::PI;
use glam::Vec3;

/// Number of pixels of a task.
pub const PIXELS: usize = 64;

/// Maximum number of surfaces on the way to the diffuse point.
const MOST_BOUNCES: u32 = 16;

/// Minimum cosine of the shading normal to the geometric normal; beyond it the normals are of details too
/// small for records.
pub(super) const SMOOTH: f32 = 0.9;

/// Number of pixel widths across a lobe of pdf p, whose radius is about 1 / √(π p). A record seen in a rough
/// surface is one of many in the pixel, and may be as coarse as that.
const PER_LOBE: f32 = 16.0;

/// Way in which the camera sees gather points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Via {
    /// Directly, or by specular surfaces.
    Specular,
    /// After one or more scatterings at rough surfaces.
    Glossy,
}

/// Pixels of a picture in an evenly spread order, restricted to every `stride`th column and row.
#[derive(Clone, Copy, Debug)]
pub struct ProgressiveOrder {
    width: u32,
    height: u32,
    stride: u32,
    /// Number of bits of a column or row, in strides.
    bits: u32,
}

impl ProgressiveOrder {
    /// Order of every `stride`th pixel across and down of `width` by `height`; the stride is rounded up to a
    /// power of two.
    pub fn new(width: u32, height: u32, stride: u32) -> Self {
        let stride = stride.clamp(1, 1 << 15).next_power_of_two();
        let longest = width.max(height).div_ceil(stride).max(1);
        Self { width, height, stride, bits: longest.next_power_of_two().trailing_zeros() }
    }

    /// Number of steps; some have no pixel.
    pub fn len(&self) -> u64 {
        1 << (2 * self.bits)
    }

    /// Always false: there is at least one step.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Column and row of step `i`, if that pixel exists. The bits of i alternate between column and row, from
    /// the highest bit of each down.
    pub fn pixel(&self, i: u64) -> Option<(u32, u32)> {
        let (mut x, mut y) = (0, 0);
        for bit in 0..self.bits {
            x |= (i >> (2 * bit) & 1) << (self.bits - 1 - bit);
            y |= (i >> (2 * bit + 1) & 1) << (self.bits - 1 - bit);
        }
        let (x, y) = (x as u32 * self.stride, y as u32 * self.stride);
        (i < self.len() && x < self.width && y < self.height).then_some((x, y))
    }
}

impl<F: Features, E: LightEstimator<F>> PathIntegrator<'_, F, E> {
    /// First diffuse points that sample `sample` of the pixels of [`PIXELS`] steps from `first` sees in the
    /// way `sight`, written to `out` in order. A step without pixel or diffuse point gives a place without
    /// triangle ([`GatherPoint::is_some`]).
    pub fn places(
        &self,
        order: &ProgressiveOrder,
        first: u64,
        (sample, sight): (u32, Via),
        out: &mut [GatherPoint],
        counters: &mut Counters,
    ) {
        self.places_with(order, first, (sample, sight), None, out, counters);
    }

    /// [`PathIntegrator::places`], and points with one of the `lobes` that records serve.
    #[inline(never)]
    pub fn places_with(
        &self,
        order: &ProgressiveOrder,
        first: u64,
        (sample, sight): (u32, Via),
        lobes: Option<&ServedLobes>,
        out: &mut [GatherPoint],
        counters: &mut Counters,
    ) {
        let mut rays = [Ray::segment(Vec3::ZERO, Vec3::Z, -1.0); PIXELS];
        let mut hits = [Hit::NONE; PIXELS];
        let (width, height) = (self.settings.width, self.settings.height);
        for (i, ray) in rays.iter_mut().enumerate() {
            if let Some((x, y)) = order.pixel(first + i as u64) {
                *ray = self.camera_ray([x, y], &Sampler::new(self.settings.seed, y * width + x, sample));
                counters.rays += 1;
            }
        }
        self.context.nearest_batch(&rays, Coherence::Incoherent, &mut hits);
        let pixel = self.context.scene.camera.pixel_width(height);
        for (i, place) in out.iter_mut().enumerate().take(PIXELS) {
            *place = GatherPoint::NONE;
            if let Some((x, y)) = order.pixel(first + i as u64) {
                let sampler = Sampler::new(self.settings.seed, y * width + x, sample);
                let found = self.first_diffuse((rays[i], hits[i]), pixel, (sight, lobes), &sampler, counters);
                *place = found.unwrap_or(GatherPoint::NONE);
            }
        }
    }

    /// True if the scene may have rough surfaces.
    pub fn has_rough_surfaces(&self) -> bool {
        self.context.scene.materials.iter().any(|material| material.surface.may_be_rough())
    }

    /// First diffuse point, or point with a served lobe, of a camera ray with first hit `hit`, whose `pixel`
    /// has this width.
    fn first_diffuse(
        &self,
        (ray, mut hit): (Ray, Hit),
        pixel: PixelWidth,
        (sight, lobes): (Via, Option<&ServedLobes>),
        sampler: &Sampler,
        counters: &mut Counters,
    ) -> Option<GatherPoint> {
        let context = &self.context;
        let mut segment = Segment::first(ray);
        let (mut width, mut spread, mut seen) = (pixel.at_eye, pixel.per_length, Via::Specular);
        for segments in 1..=MOST_BOUNCES {
            let opacity = |n| sampler.single(dimension::CROSSING + n);
            let (met, point) = context.surface_from(hit, &mut segment, opacity, counters)?;
            width += spread * segment.length;
            let bsdf = self.context.bsdf_at(&point);
            let is_wanted = seen == sight && point.frame.normal.dot(point.geometric_normal) > SMOOTH;
            let place = || is_wanted.then(|| GatherPoint::of(&point, width));
            if let Bsdf::Diffuse(_) = bsdf {
                return place();
            }
            let direction = Vec3::from(segment.ray.direction);
            let wo = point.frame.to_local(-direction);
            // Paths end at a served lobe, and records behind rough surfaces have no coefficients.
            if F::GLOSSY && seen == Via::Specular && lobes.is_some_and(|lobes| lobes.serves(&bsdf, wo.z)) {
                return place().map(|place| place.with_lobe(direction, &met));
            }
            let [u, v] = dimension::scattering(sampler, segments);
            let lobe = sampler.single(dimension::vertex(segments) + dimension::LOBE);
            let sample = if F::GLOSSY && bsdf.has_coated_base() {
                // A path goes on by the coat, and a smooth coat shows its base and what it mirrors.
                let base_weight = if seen == sight { 1.0 } else { 0.0 };
                let sample = bsdf.sample_apart::<F>(wo, [u, v, lobe], base_weight);
                match sample.filter(|(_, is_coat)| *is_coat) {
                    Some((sample, _)) if seen != sight || sample.delta => sample,
                    _ => return place(),
                }
            } else {
                bsdf.sample::<F>(wo, [u, v, lobe])?
            };
            if !sample.delta {
                if sight == Via::Specular {
                    return None;
                }
                seen = Via::Glossy;
                spread = spread.max(1.0 / (PER_LOBE * libm::sqrtf(PI * sample.pdf)));
            }
            let next = Scatterer { point: &point, bsdf: &bsdf }.towards(&sample)?;
            segment = segment.onward(&point, &met, next);
            counters.rays += 1;
            hit = self.context.nearest(&segment.ray);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::vec::Vec;

    #[test]
    fn the_order_has_every_pixel_once_and_spreads_them() {
        for (width, height, stride) in [(1, 1, 1), (37, 20, 1), (64, 64, 4), (5, 300, 2), (33, 9, 64)] {
            let order = ProgressiveOrder::new(width, height, stride);
            let pixels: Vec<_> = (0..order.len()).filter_map(|i| order.pixel(i)).collect();
            let wanted = width.div_ceil(stride) * height.div_ceil(stride);
            assert_eq!(pixels.len(), wanted as usize, "{width} {height} {stride}");
            assert_eq!(pixels.iter().collect::<BTreeSet<_>>().len(), pixels.len());
        }
        let order = ProgressiveOrder::new(64, 64, 1);
        let coarse: BTreeSet<_> = (0..16).filter_map(|i| order.pixel(i)).collect();
        assert!(coarse.iter().all(|(x, y)| x % 16 == 0 && y % 16 == 0) && coarse.len() == 16);
        assert_eq!(order.pixel(order.len()), None);
    }
}
