//! The edges of lamps that are made of many triangles: those that two triangles share which are both seen from the front,
//! or both from behind, lie within what is seen of the lamp and are no border of it.

use crate::sampling::mix;
use glam::Vec3;

/// Places for edges, a power of two: about twice as many as lamps have in a tile.
const PLACES: usize = 1 << 13;

/// Places that an edge may have. One that finds all of them taken counts as a border.
const TRIES: u64 = 64;

/// Which edges came an odd number of times. What an edge is known by is a hash of its ends: two that are taken for the same
/// cost a border, and so noise, once in thousands of pictures.
pub(super) struct Edges([u32; PLACES]);

impl Edges {
    pub(super) const fn new() -> Self {
        Self([0; PLACES])
    }

    /// An edge came, of a triangle of which the `front` is seen or not.
    pub(super) fn add(&mut self, edge: [Vec3; 2], front: bool) {
        let key = key(edge, front);
        let free = places(key).find(|place| self.0[*place] == 0 || self.0[*place] >> 1 == key >> 1);
        if let Some(place) = free {
            self.0[place] = (self.0[place] | key & !1) ^ 1;
        }
    }

    /// Whether such an edge is a border.
    pub(super) fn is_border(&self, edge: [Vec3; 2], front: bool) -> bool {
        let key = key(edge, front);
        let known = places(key).map(|place| self.0[place]).find(|known| known >> 1 == key >> 1);
        known.is_none_or(|known| known & 1 == 1)
    }
}

/// The same for an edge and for one that goes back.
fn key([a, b]: [Vec3; 2], front: bool) -> u32 {
    // No zero is negative.
    let end = |point: Vec3| {
        (point + 0.0).to_array().iter().fold(u64::from(front), |hash, x| mix(hash ^ u64::from(x.to_bits())))
    };
    (end(a).wrapping_add(end(b)) >> 32) as u32 | 2
}

fn places(key: u32) -> impl Iterator<Item = usize> {
    let first = mix(u64::from(key >> 1));
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
        all().for_each(|edge| edges.add(edge, true));
        assert_eq!(all().filter(|edge| edges.is_border(*edge, true)).count(), 4 * SIDE as usize);
        // Seen from the front on one side and from behind on the other.
        let edge = [at(3, 3), at(3, 4)];
        edges.add(edge, false);
        assert!(edges.is_border(edge, false) && !edges.is_border(edge, true));
    }

    #[test]
    fn too_many_edges_are_borders() {
        let mut edges = Edges::new();
        let edge = |i: u32| [Vec3::splat(i as f32), Vec3::X];
        for i in 0..4 * PLACES as u32 {
            edges.add(edge(i), true);
        }
        assert!((0..4 * PLACES as u32).all(|i| edges.is_border(edge(i), true)));
    }
}
