//! Morton order of queries (Morton 1966): neighbouring places follow each other. A search then finds in the
//! cache the nodes that the previous search read, and takes from it a bound on the distance of the k-th
//! photon.

use super::PhotonMap;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bits of a code for each axis.
const BITS: u32 = 10;

/// Morton code and index of a place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[repr(C)]
pub struct QueryOrder {
    code: u32,
    /// Index of the place.
    pub index: u32,
}

/// Fills `order` with the first of `places`, as far as there is room, in Morton order. Returns the filled
/// part.
pub(super) fn along<'t>(
    map: &PhotonMap,
    places: impl ExactSizeIterator<Item = Vec3>,
    order: &'t mut [QueryOrder],
) -> &'t mut [QueryOrder] {
    let [lo, hi] = map.bounds();
    let cells = (1u32 << BITS) as f32;
    let count = places.len().min(order.len());
    let order = &mut order[..count];
    for (index, (next, place)) in order.iter_mut().zip(places).enumerate() {
        let place = map.space.to_map(place.to_array());
        let cell = [0, 1, 2].map(|axis| {
            // The cast saturates, so that every place, NaN included, falls into a cell.
            ((place[axis] - lo[axis]) / (hi[axis] - lo[axis]) * cells) as u32
        });
        let [x, y, z] = cell.map(|cell| spread(cell.min((1 << BITS) - 1)));
        *next = QueryOrder { code: x | y << 1 | z << 2, index: index as u32 };
    }
    order.sort_unstable();
    order
}

/// Spreads ten bits, with two zeros after each.
fn spread(bits: u32) -> u32 {
    let bits = (bits | bits << 16) & 0x0300_00ff;
    let bits = (bits | bits << 8) & 0x0300_f00f;
    let bits = (bits | bits << 4) & 0x030c_30c3;
    (bits | bits << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread() {
        for bits in 0..1 << BITS {
            let slow = (0..BITS).fold(0, |code, i| code | (bits >> i & 1) << (3 * i));
            assert_eq!(spread(bits), slow);
        }
    }
}
