//! The edges of lamps that are made of many triangles: those that two triangles of one material share which
//! are both seen from the front, or both from behind, lie within what is seen of the lamp and are no border
//! of it.

use crate::sampling::mix;
use glam::Vec3;

/// Places for edges, a power of two.
const PLACES: usize = 1 << 13;

/// Places that an edge may have. One that finds all of them taken counts as a border.
const TRIES: u64 = 64;

/// Bits of a place that count, modulo their number: up for an edge, down for one that goes back.
const COUNTER: u32 = 7;

/// How often edges came, less how often they came the other way round. What an edge is known by is a hash of
/// its ends: two that are taken for the same may cost a border, and so noise, now and then.
pub(super) struct Edges([u32; PLACES]);

impl Edges {
    pub(super) const fn new() -> Self {
        Self([0; PLACES])
    }

    /// An edge came, of a triangle seen from a `side`, by number.
    pub(super) fn add(&mut self, edge: [Vec3; 2], side: u64) {
        let (key, step) = key(edge, side);
        let free = places(key).find(|place| self.0[*place] == 0 || self.0[*place] & !COUNTER == key);
        if let Some(place) = free {
            self.0[place] = key | (self.0[place].wrapping_add(step) & COUNTER);
        }
    }

    /// Whether such an edge is a border.
    pub(super) fn is_border(&self, edge: [Vec3; 2], side: u64) -> bool {
        let (key, _) = key(edge, side);
        let known = places(key).map(|place| self.0[place]).find(|known| known & !COUNTER == key);
        known.is_none_or(|known| known & COUNTER != 0)
    }
}

/// The same for an edge and for one that goes back, but for the step of the counter.
fn key([a, b]: [Vec3; 2], side: u64) -> (u32, u32) {
    // No zero is negative.
    let end = |point: Vec3| {
        (point + 0.0).to_array().iter().fold(side, |hash, x| mix(hash ^ u64::from(x.to_bits())))
    };
    let (a, b) = (end(a), end(b));
    let key = (a.wrapping_add(b) >> 32) as u32 & !COUNTER | (COUNTER + 1);
    (key, if a < b { 1 } else { COUNTER })
}

fn places(key: u32) -> impl Iterator<Item = usize> {
    let first = mix(u64::from(key));
    (0..TRIES).map(move |n| (first.wrapping_add(n) % PLACES as u64) as usize)
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
        // Also where every face is there twice.
        for _ in 0..2 {
            all().for_each(|edge| edges.add(edge, 1));
            assert_eq!(all().filter(|edge| edges.is_border(*edge, 1)).count(), 4 * SIDE as usize);
        }
        // Another side of it, or another material.
        let edge = [at(3, 3), at(3, 4)];
        edges.add(edge, 0);
        assert!(edges.is_border(edge, 0) && !edges.is_border(edge, 1));
    }

    #[test]
    fn too_many_edges_are_borders() {
        let mut edges = Edges::new();
        let edge = |i: u32| [Vec3::splat(i as f32), Vec3::X];
        for i in 0..4 * PLACES as u32 {
            edges.add(edge(i), 1);
        }
        assert!((0..4 * PLACES as u32).all(|i| edges.is_border(edge(i), 1)));
    }
}
