//! Gather points of a film of points, in an order that is spread evenly along their curve from its first one
//! on.

use super::gather_point::GatherPoint;
use super::placement::SMOOTH;
use crate::film::PIXELS_PER_TILE;
use crate::geometry::MISS;
use crate::scene::SurfacePoint;
use crate::transport::path::IrradiancePoint;
use glam::Vec3;

/// Triangle of places in space, which no ray meets.
const FREE: u32 = MISS - 1;

/// Points of a film as places of records.
#[derive(Clone, Copy)]
pub struct PointPlaces<'p> {
    /// Along a Z-curve.
    points: &'p [IrradiancePoint],
    /// Distance between neighbours, which takes the place of the width of a pixel.
    step: f32,
    /// Number of tiles whose points alone are places.
    tiles: Option<usize>,
}

impl<'p> PointPlaces<'p> {
    /// Places at `points` along a curve, whose neighbours are about `step` apart.
    pub fn new(points: &'p [IrradiancePoint], step: f32) -> Self {
        Self { points, step, tiles: None }
    }

    /// The places of so many tiles, spread over all of them: a part of the surfaces at full density.
    pub fn of_tiles(self, tiles: usize) -> Self {
        Self { tiles: Some(tiles), ..self }
    }

    /// Number of tiles of all points.
    pub fn tiles(&self) -> usize {
        self.points.len().div_ceil(PIXELS_PER_TILE)
    }

    /// Number of steps of the order; some have no point.
    pub fn len(&self) -> u64 {
        match self.tiles {
            Some(tiles) => (tiles * PIXELS_PER_TILE) as u64,
            None => self.points.len().next_power_of_two() as u64,
        }
    }

    /// True if there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Writes the places of the steps from `first` on to `out`.
    pub fn places(&self, first: u64, out: &mut [GatherPoint]) {
        for (i, place) in (first..).zip(out) {
            *place = self.place(i).unwrap_or(GatherPoint::NONE);
        }
    }

    /// Number of the point of step `i`, whose bits are those of the step in reverse; of some tiles, with a
    /// point of each in turn.
    fn number(&self, i: u64) -> Option<usize> {
        let reverse = |i: u64, count: u64| match count.trailing_zeros() {
            0 => i,
            bits => i.reverse_bits() >> (u64::BITS - bits),
        };
        let Some(tiles) = self.tiles else { return usize::try_from(reverse(i, self.len())).ok() };
        let (turn, of_tile) = (usize::try_from(i).ok()? % tiles, i / tiles as u64);
        let tile = (2 * turn + 1) * self.tiles() / (2 * tiles);
        Some(tile * PIXELS_PER_TILE + reverse(of_tile, PIXELS_PER_TILE as u64) as usize)
    }

    /// Place of step `i`; `None` at normals of details too small for records.
    fn place(&self, i: u64) -> Option<GatherPoint> {
        let point = self.points.get(self.number(i)?).filter(|_| i < self.len())?;
        let normals = [point.normal, point.geometric_normal].map(Vec3::from);
        let surface = SurfacePoint { triangle: point.triangle.min(FREE), ..point.surface() };
        (normals[0].dot(normals[1]) > SMOOTH).then(|| GatherPoint::of(&surface, self.step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    #[test]
    fn every_point_has_a_place_and_the_first_ones_are_far_apart() {
        for count in [1, 2, 7, 64, 100] {
            let at = |i: usize| IrradiancePoint::free(Vec3::X * i as f32, Vec3::Y);
            let points: vec::Vec<_> = (0..count).map(at).collect();
            let order = PointPlaces::new(&points, 1.0);
            let mut places = vec![GatherPoint::NONE; order.len() as usize + 3];
            order.places(0, &mut places);
            let mut found: vec::Vec<_> =
                places.iter().filter(|place| place.is_some()).map(|place| place.position().x).collect();
            if count == 64 {
                assert_eq!(found[..4], [0.0, 32.0, 16.0, 48.0]);
            }
            found.sort_by(f32::total_cmp);
            assert!(found.into_iter().eq((0..count).map(|i| i as f32)));
        }
    }

    #[test]
    fn places_of_tiles_are_all_points_of_some() {
        let at = |i: usize| IrradiancePoint::free(Vec3::X * i as f32, Vec3::Y);
        let points: vec::Vec<_> = (0..7 * PIXELS_PER_TILE - 9).map(at).collect();
        let order = PointPlaces::new(&points, 1.0).of_tiles(2);
        let mut places = vec![GatherPoint::NONE; order.len() as usize];
        order.places(0, &mut places);
        let mut found: vec::Vec<_> = places.iter().map(|place| place.position().x as usize).collect();
        assert_eq!(found[..3], [256, 1280, 384]);
        found.sort_unstable();
        assert!(found.into_iter().eq((256..512).chain(1280..1536)));
    }
}
