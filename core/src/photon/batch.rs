//! Batches of searches in Morton order, each bounded by the result of the previous search.

use super::PhotonMap;
use super::gather::{DensityEstimate, Response, gather};
use super::kernel::QueryDisc;
use super::morton::{self, QueryOrder};
use super::nearest::{Neighbours, search};
use glam::Vec3;
use halflight_simd::{Kernel, Simd};

/// Bound of the relative rounding error of a distance, with a factor of two to spare.
const ROUNDING: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Absolute bound for squared distances too small for a relative one.
const TINY: f32 = f32::MIN_POSITIVE;

/// The nearest photons of each place, in Morton order.
pub(super) struct NearestBatch<'a, 'm, 'n, F> {
    pub map: &'a PhotonMap<'m>,
    pub places: &'a [Vec3],
    pub squared_radius: f32,
    pub order: &'a mut [QueryOrder],
    pub neighbours: &'a mut Neighbours<'n>,
    pub each: F,
}

impl<F: FnMut(usize, &Neighbours)> Kernel for NearestBatch<'_, '_, '_, F> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let map = self.map;
        // Place of the previous search and the distance of its k-th photon.
        let mut last: Option<([f32; 3], f32)> = None;
        for next in morton::along(map, self.places.iter().copied(), self.order) {
            let index = next.index as usize;
            let Some(place) = self.places.get(index) else { continue };
            let place = map.space.to_map(place.to_array());
            // Triangle inequality: the k photons of the previous search are no farther from here than this.
            let near = last.map_or(f32::MAX, |(last, distance)| {
                let way = Vec3::from_array(last).distance(Vec3::from_array(place));
                let most = (way + distance) * ROUNDING;
                (most * most + TINY).min(f32::MAX)
            });
            search(simd, map, place, self.squared_radius.min(near), self.neighbours);
            let limit = self.neighbours.limit();
            // The result at a NaN place bounds nothing.
            last = (limit < f32::INFINITY).then(|| (place, libm::sqrtf(limit)));
            (self.each)(index, self.neighbours);
        }
    }
}

/// Density estimates at discs in Morton order, with one response for all.
pub(super) struct GatherBatch<'a, 'm, R> {
    pub map: &'a PhotonMap<'m>,
    pub discs: &'a [QueryDisc],
    pub response: &'a R,
    pub order: &'a mut [QueryOrder],
    pub densities: &'a mut [DensityEstimate],
}

impl<R: Response> Kernel for GatherBatch<'_, '_, R> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for next in morton::along(self.map, self.discs.iter().map(|disc| disc.place), self.order) {
            let index = next.index as usize;
            if let (Some(disc), Some(density)) = (self.discs.get(index), self.densities.get_mut(index)) {
                *density = gather(simd, self.map, disc, None, self.response);
            }
        }
    }
}
