//! Large triangles are cut into pieces that are not much larger than they are far from the origin, where the detail of a scene
//! is ([`super::fit`]): a point on a piece is then as precise as its distance asks for.
//!
//! The planes x, y, z = ±16 · 4^k cut whatever lies on both sides of them, however small. A cut of an edge follows from its
//! ends and the plane alone, so that neighbours agree on it to the bit and no gap opens.

use glam::DVec3;

/// The planes next to the origin are this far from it; what is fine there is about 1 across.
const NEAREST: f64 = 16.0;

/// How much farther the next one is.
const STEP: f64 = 4.0;

/// Planes on each side: the last is at 16 · 4^15, beyond all that there is.
const PLANES: i32 = 16;

/// Pieces beyond which nothing is cut: a file of very many large triangles is no ground.
const MOST: f64 = 1e6;

/// A corner of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    pub(super) position: DVec3,
    /// Barycentric coordinates in the triangle.
    pub(super) weights: DVec3,
}

/// Planes between two coordinates.
fn planes(low: f64, high: f64) -> impl Iterator<Item = f64> {
    let all = (0..PLANES).flat_map(|k| {
        let distance = NEAREST * STEP.powi(k);
        [-distance, distance]
    });
    all.filter(move |at| low < *at && *at < high)
}

fn extent(corners: [DVec3; 3]) -> [DVec3; 2] {
    let [p, q, r] = corners;
    [p.min(q).min(r), p.max(q).max(r)]
}

/// At most how many pieces a triangle falls into; 1 where it stays whole.
pub(super) fn count(corners: [DVec3; 3]) -> f64 {
    let [low, high] = extent(corners);
    (0..3).map(|axis| 1.0 + planes(low[axis], high[axis]).count() as f64).product()
}

/// Whether so many pieces in all, of triangles that do not stay whole, are worth it.
pub(super) fn is_affordable(pieces: f64) -> bool {
    pieces <= MOST
}

/// The convex pieces of a triangle, wound as it is.
pub(super) fn pieces(corners: [DVec3; 3]) -> Vec<Vec<Corner>> {
    let [low, high] = extent(corners);
    let corner = |i: usize| Corner { position: corners[i], weights: DVec3::AXES[i] };
    let mut pieces = vec![vec![corner(0), corner(1), corner(2)]];
    for axis in 0..3 {
        for at in planes(low[axis], high[axis]) {
            pieces = pieces.into_iter().flat_map(|piece| cut(piece, axis, at)).collect();
        }
    }
    pieces
}

/// What of a convex polygon is below and above a plane.
fn cut(polygon: Vec<Corner>, axis: usize, at: f64) -> Vec<Vec<Corner>> {
    let height = |corner: &Corner| corner.position[axis] - at;
    if polygon.iter().all(|corner| height(corner) <= 0.0)
        || polygon.iter().all(|corner| height(corner) >= 0.0)
    {
        return vec![polygon];
    }
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        if height(a) <= 0.0 {
            below.push(*a);
        }
        if height(a) >= 0.0 {
            above.push(*a);
        }
        if height(a) * height(b) < 0.0 {
            let crossing = crossing(a, b, axis, at);
            below.push(crossing);
            above.push(crossing);
        }
    }
    vec![below, above]
}

/// Where the edge between two corners meets a plane: the same whichever comes first.
fn crossing(a: &Corner, b: &Corner, axis: usize, at: f64) -> Corner {
    let is_first = a.position.to_array() < b.position.to_array();
    let (a, b) = if is_first { (a, b) } else { (b, a) };
    let part = (at - a.position[axis]) / (b.position[axis] - a.position[axis]);
    let mut position = a.position + part * (b.position - a.position);
    position[axis] = at;
    Corner { position, weights: a.weights + part * (b.weights - a.weights) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    fn area(polygon: &[Corner]) -> f64 {
        let fan = polygon.windows(2).skip(1);
        let cross =
            fan.map(|w| (w[0].position - polygon[0].position).cross(w[1].position - polygon[0].position));
        0.5 * cross.sum::<DVec3>().length()
    }

    #[test]
    fn pieces_cover_the_triangle_and_are_small_near_the_origin() {
        let corners =
            [DVec3::new(-10.0, -1.0, -3e6), DVec3::new(-5.0, 7.0, 1e7), DVec3::new(2e7, -30.0, 10.0)];
        let whole = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
        let pieces = pieces(corners);
        assert!(pieces.len() > 50 && pieces.len() as f64 <= count(corners), "{}", pieces.len());
        let sum: f64 = pieces.iter().map(|piece| area(piece)).sum();
        assert!((sum / whole - 1.0).abs() < 1e-12);
        for piece in &pieces {
            let nearest = piece.iter().map(|c| c.position.abs().max_element()).fold(f64::INFINITY, f64::min);
            let size = piece.iter().map(|c| c.position.distance(piece[0].position)).fold(0.0, f64::max);
            assert!(size < 16.0 * nearest.max(NEAREST), "{size} {nearest}");
            for corner in piece {
                let back = (0..3).map(|i| corner.weights[i] * corners[i]).sum::<DVec3>();
                assert!(back.distance(corner.position) < 1e-7);
            }
        }
        let small = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!((count(small), self::pieces(small).len()), (1.0, 1));
    }

    #[test]
    fn neighbours_agree_on_every_cut_to_the_bit() {
        let at = |x: f64, z: f64| DVec3::new(x, 0.3 * x - 0.7 * z, z);
        let [a, b, c, d] = [at(-1e7, -3e3), at(77.3, 5e6), at(3e6, -11.0), at(9e6, 8e6)];
        // Along the edge from b to c, once each way.
        let mut seen: HashMap<[u64; 3], u32> = HashMap::new();
        for (triangle, apart) in [([a, b, c], 0), ([c, b, d], 2)] {
            for corner in pieces(triangle).into_iter().flatten().filter(|corner| corner.weights[apart] == 0.0)
            {
                let key = corner.position.to_array().map(f64::to_bits);
                *seen.entry(key).or_default() |= if apart == 0 { 1 } else { 2 };
            }
        }
        assert!(seen.len() > 15 && seen.values().all(|sides| *sides == 3), "{seen:?}");
    }
}
