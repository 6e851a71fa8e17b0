//! Border edges of lights made of many triangles. An edge between two triangles of one material that both
//! show their front, or both their back, lies inside the visible light and is no border.

use crate::sampling::mix;
use glam::Vec3;

/// Slots of the hash table, a power of two.
const SLOTS: usize = 1 << 13;

/// Slots that an edge may use (linear probing). An edge that finds all of them taken counts as a border.
const MAX_PROBES: u64 = 64;

/// Bits of a slot that count modulo their range: up for an edge, down for its reverse.
const COUNTER: u32 = 7;

/// Hash table of edges, with the number of occurrences of each less those of its reverse. The key is a hash
/// of both ends. A collision may drop a border now and then, which costs only noise.
pub(super) struct Edges([u32; SLOTS]);

impl Edges {
    pub(super) const fn new() -> Self {
        Self([0; SLOTS])
    }

    /// Adds an edge of a triangle seen from a `side`, a number.
    pub(super) fn add(&mut self, edge: [Vec3; 2], side: u64) {
        let (key, step) = key(edge, side);
        let free = slots(key).find(|slot| self.0[*slot] == 0 || self.0[*slot] & !COUNTER == key);
        if let Some(slot) = free {
            self.0[slot] = key | (self.0[slot].wrapping_add(step) & COUNTER);
        }
    }

    /// True if the edge is a border of that side.
    pub(super) fn is_border(&self, edge: [Vec3; 2], side: u64) -> bool {
        let (key, _) = key(edge, side);
        let known = slots(key).map(|slot| self.0[slot]).find(|known| known & !COUNTER == key);
        known.is_none_or(|known| known & COUNTER != 0)
    }
}

/// Key of an edge, equal for its reverse, and the step of its counter.
fn key([a, b]: [Vec3; 2], side: u64) -> (u32, u32) {
    // The sum turns negative zero into zero.
    let end = |point: Vec3| {
        (point + 0.0).to_array().iter().fold(side, |hash, x| mix(hash ^ u64::from(x.to_bits())))
    };
    let (a, b) = (end(a), end(b));
    let key = (a.wrapping_add(b) >> 32) as u32 & !COUNTER | (COUNTER + 1);
    (key, if a < b { 1 } else { COUNTER })
}

fn slots(key: u32) -> impl Iterator<Item = usize> {
    let first = mix(u64::from(key));
    (0..MAX_PROBES).map(move |n| (first.wrapping_add(n) % SLOTS as u64) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_two_triangles_share_is_no_border() {
        let mut edges = Edges::new();
        let at = |x: u32, y: u32| Vec3::new(x as f32, 0.1 * y as f32, -0.0);
        let square = |x, y| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b], [b, c], [c, a], [a, c], [c, d], [d, a]]
        };
        const SIDE: u32 = 40;
        let all = || (0..SIDE * SIDE).flat_map(|i| square(i % SIDE, i / SIDE));
        // Also if every face occurs twice.
        for _ in 0..2 {
            all().for_each(|edge| edges.add(edge, 1));
            assert_eq!(all().filter(|edge| edges.is_border(*edge, 1)).count(), 4 * SIDE as usize);
        }
        // The other side of the light, or another material.
        let edge = [at(3, 3), at(3, 4)];
        edges.add(edge, 0);
        assert!(edges.is_border(edge, 0) && !edges.is_border(edge, 1));
    }

    #[test]
    fn too_many_edges_are_borders() {
        let mut edges = Edges::new();
        let edge = |i: u32| [Vec3::splat(i as f32), Vec3::X];
        for i in 0..4 * SLOTS as u32 {
            edges.add(edge(i), 1);
        }
        assert!((0..4 * SLOTS as u32).all(|i| edges.is_border(edge(i), 1)));
    }
}
