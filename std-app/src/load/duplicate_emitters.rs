//! Duplicate emitters. Files with doubled faces are common; each copy would add its light, although only one
//! is visible.

use super::geometry::Geometry;
use super::notes::Notes;
use glam::DVec3;
use halflight_core::scene::{Material, Triangle};
use std::collections::HashMap;

/// Pairs of coplanar lamps that are compared.
const MOST_PAIRS: usize = 10_000_000;
/// Least barycentric coordinate of a point inside a triangle.
const INSIDE: f64 = -1e-6;

/// Removes emitting triangles with the corners and emission of an earlier one; notes lamps that overlap in
/// another way.
pub(super) fn remove(geometry: &mut Geometry, materials: &[Material], names: &[String], notes: &mut Notes) {
    let material = |t: &Triangle| &materials[t.material as usize];
    if !materials.iter().any(Material::emits) {
        return;
    }
    let positions = &geometry.positions;
    let mut known: HashMap<[[u32; 3]; 3], Vec<(bool, u32)>> = HashMap::new();
    geometry.triangles.retain(|triangle| {
        if !material(triangle).emits() {
            return true;
        }
        let (corners, front) = unordered(triangle.vertices.map(|v| positions[v as usize]));
        let same = known.entry(corners).or_default();
        let is_there = same.iter().any(|&(other_front, other)| {
            let other = &materials[other as usize];
            other == material(triangle) && (other_front == front || other.two_sided)
        });
        if is_there {
            let name = &names[triangle.material as usize];
            let what =
                format!("triangle of the lamp `{name}` occurs twice in the same place: the copy is left out");
            notes.add(1, what);
        } else {
            same.push((front, triangle.material));
        }
        !is_there
    });
    let emitting = geometry.triangles.iter().filter(|t| material(t).emits());
    let lamps: Vec<Lamp> = emitting.filter_map(|t| Lamp::new(t, &geometry.positions)).collect();
    for material in overlapping(&lamps) {
        let name = &names[material as usize];
        let what = format!("triangle of the lamp `{name}` lies in the same place as another: both emit");
        notes.add(1, what);
    }
}

/// The corners in ascending order, and whether they keep their winding.
fn unordered(corners: [[f32; 3]; 3]) -> ([[u32; 3]; 3], bool) {
    // Adding 0 turns -0 into 0.
    let mut corners = corners.map(|p| p.map(|x| (x + 0.0).to_bits()));
    let mut front = true;
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if corners[i] > corners[j] {
            corners.swap(i, j);
            front = !front;
        }
    }
    (corners, front)
}

/// An emitting triangle in its plane.
struct Lamp {
    corners: [DVec3; 3],
    normal: DVec3,
    material: u32,
}

impl Lamp {
    fn new(triangle: &Triangle, positions: &[[f32; 3]]) -> Option<Self> {
        let corners = triangle.vertices.map(|v| DVec3::from(positions[v as usize].map(f64::from)));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize()?;
        Some(Self { corners, normal, material: triangle.material })
    }

    /// A key that lamps in one plane with the same front usually have in common.
    fn plane(&self) -> [i64; 4] {
        let distance = self.normal.dot(self.corners[0]);
        [self.normal.x, self.normal.y, self.normal.z, distance].map(|x| (x * 1024.0).round() as i64)
    }

    /// True if the centre of `other`, in the same plane, lies inside.
    fn covers(&self, other: &Lamp) -> bool {
        let [a, b, c] = self.corners;
        let centre = (other.corners[0] + other.corners[1] + other.corners[2]) / 3.0;
        let area = (b - a).cross(c - a).length();
        let side = |p: DVec3, q: DVec3| (q - p).cross(centre - p).dot(self.normal) / area >= INSIDE;
        let height = (centre - a).dot(self.normal).abs();
        side(a, b) && side(b, c) && side(c, a) && height * height <= 1e-12 * area
    }
}

/// The materials of lamps whose centre another lamp covers.
fn overlapping(lamps: &[Lamp]) -> Vec<u32> {
    let mut planes: HashMap<[i64; 4], Vec<&Lamp>> = HashMap::new();
    lamps.iter().for_each(|lamp| planes.entry(lamp.plane()).or_default().push(lamp));
    let pairs: usize = planes.values().map(|lamps| lamps.len() * lamps.len()).sum();
    if pairs > MOST_PAIRS {
        return Vec::new();
    }
    let mut found: Vec<u32> = Vec::new();
    for lamps in planes.values() {
        let is_covered = |(i, lamp): &(usize, &&Lamp)| {
            lamps.iter().enumerate().any(|(j, other)| j != *i && other.covers(lamp))
        };
        found.extend(lamps.iter().enumerate().filter(is_covered).map(|(_, lamp)| lamp.material));
    }
    found.sort_unstable();
    found
}
