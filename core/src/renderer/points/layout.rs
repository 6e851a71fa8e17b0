//! Order of points in a film: along a Z-curve (Morton 1966), so that tiles are near points.

use crate::estimate::POOLED_POINTS;
use crate::film::{PIXELS_PER_TILE, TILE};
use crate::memory::Footprint;
use crate::method::RenderState;
use crate::transport::IrradiancePoint;
use glam::Vec3;

/// Points of a film and their replicates.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    pub(super) points: usize,
    /// Pixels of each point, so that few points are pooled as well.
    pub(super) replicates: usize,
}

impl Layout {
    pub(super) fn of(points: usize) -> Self {
        Self { points, replicates: POOLED_POINTS.div_ceil(points.clamp(1, POOLED_POINTS)) }
    }

    pub(super) fn pixels(&self) -> usize {
        self.points * self.replicates
    }

    pub(super) fn tiles(&self) -> usize {
        self.pixels().div_ceil(PIXELS_PER_TILE)
    }

    /// Pixels of the film across and down.
    pub(super) fn size(&self) -> [u32; 2] {
        [TILE, TILE * self.tiles() as u32]
    }

    /// Memory of sums and half-widths.
    pub(super) fn of_film(&self) -> Footprint {
        let [width, height] = self.size();
        RenderState::footprint(width, height).slice::<f32>(self.pixels())
    }

    pub(super) fn footprint(&self) -> Footprint {
        self.of_film()
            .slice::<IrradiancePoint>(self.pixels())
            .slice::<u64>(self.pixels())
            .slice::<u32>(self.pixels())
            .slice::<u8>(self.tiles())
    }
}

/// Writes the places of all replicates of `points` along a Z-curve of position and octant of the normal:
/// each key ends with the number of the replicate.
pub(super) fn order_along_curve(points: &[IrradiancePoint], replicates: usize, keys: &mut [u64]) {
    let positions = || points.iter().map(|point| Vec3::from(point.position));
    let lowest = positions().fold(Vec3::INFINITY, Vec3::min);
    let size = (positions().fold(Vec3::NEG_INFINITY, Vec3::max) - lowest).max_element();
    let scale = if size > 0.0 { 1023.0 / size } else { 0.0 };
    for (number, key) in keys.iter_mut().enumerate() {
        let Some(point) = points.get(number / replicates) else { continue };
        let cell = ((Vec3::from(point.position) - lowest) * scale).to_array();
        let curve = (0..3).fold(0, |curve, axis| curve | spread(cell[axis] as u32) << axis);
        let octant = (0..3).fold(0, |octant, axis| octant | u64::from(point.normal[axis] < 0.0) << axis);
        *key = (curve << 3 | octant) << NUMBER_BITS | number as u64;
    }
    keys.sort_unstable();
}

/// Bits of the number of a replicate in its key.
const NUMBER_BITS: u32 = 31;

/// Number of the replicate of a key.
pub(super) fn number_of(key: u64) -> usize {
    (key & ((1 << NUMBER_BITS) - 1)) as usize
}

/// The ten low bits of `x`, three apart.
fn spread(x: u32) -> u64 {
    (0..10).fold(0, |bits, bit| bits | u64::from(x >> bit & 1) << (3 * bit))
}
