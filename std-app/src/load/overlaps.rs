//! Triangles that overlap in one plane within rounding: the two sides of a sheet with a material each,
//! surfaces that lie on others, doubled faces. The core decides for each ray which of them it sees
//! ([`halflight_core::scene::Scene::visible_hit`]).
//!
//! Triangles are sorted by rounded planes. Those of a plane are split by their boxes (Bentley and Wood 1980)
//! until few are left, which are compared in pairs.

use super::buffers::Geometry;
use super::notes::Notes;
use glam::{DVec2, DVec3};
use halflight_core::sampling::mix;
use halflight_core::scene::{Material, Overlap, Surface, Triangle};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Relative error of a coordinate that is rounded to f32.
const ROUNDING: f64 = 0.5 * f32::EPSILON as f64;
/// Distance of a corner from the plane of another triangle, in rounding errors of the coordinates.
const MOST_ERRORS: f64 = 2.0;
/// Smallest part of the smaller triangle that counts as an overlap. Neighbours overlap by rounding.
const LEAST_PART: f64 = 1e-3;
/// Steps of a component of a normal, and of the distance of a plane from the origin.
const STEPS: [f64; 4] = [512.0, 512.0, 512.0, 2048.0];
/// Triangles that are compared without a further split.
const FEW: usize = 16;
/// Most pairs of triangles in one plane that are compared after the last split.
const MOST_PAIRS: usize = 1 << 24;

/// Pairs of triangles that overlap in one plane and differ, ascending.
pub(super) fn locate(geometry: &Geometry, materials: &[Material]) -> Vec<Pair> {
    let Geometry { triangles, positions, .. } = geometry;
    let differ =
        |a: &Triangle, b: &Triangle| a.material != b.material || !is_plain(&materials[a.material as usize]);
    if triangles.windows(2).all(|pair| !differ(&pair[0], &pair[1])) {
        return Vec::new();
    }
    let face = |index: u32| Face::new(index, &triangles[index as usize], positions);
    let keys =
        |index: u32| face(index).into_iter().flat_map(move |face| face.planes().map(move |key| (key, index)));
    let mut planes: Vec<(u64, u32)> =
        (0..triangles.len() as u32).into_par_iter().flat_map_iter(keys).collect();
    planes.par_sort_unstable();
    let groups: Vec<&[(u64, u32)]> =
        planes.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1).collect();
    let search = |group: &&[(u64, u32)]| {
        let indices: Vec<u32> = group.iter().map(|&(_, index)| index).collect();
        let differ = |a: u32, b: u32| differ(&triangles[a as usize], &triangles[b as usize]);
        let mut pairs = Vec::new();
        if indices.windows(2).any(|pair| differ(pair[0], pair[1])) {
            collect(&face, indices, &differ, &mut pairs);
        }
        pairs
    };
    let mut pairs: Vec<Pair> = groups.par_iter().flat_map_iter(search).collect();
    pairs.par_sort_unstable_by_key(|pair| pair.triangles);
    pairs.dedup_by_key(|pair| pair.triangles);
    pairs
}

/// The pairs in both orders, ascending, for the core.
pub(super) fn both_orders(pairs: &[Pair]) -> Vec<Overlap> {
    let orders = |&Pair { triangles: [a, b], same_front, .. }: &Pair| {
        [(a, b), (b, a)].map(|(triangle, other)| Overlap { triangle, other, same_front })
    };
    let mut both: Vec<Overlap> = pairs.iter().flat_map(orders).collect();
    both.par_sort_unstable();
    both
}

/// True if a triangle and a copy of it look the same.
fn is_plain(material: &Material) -> bool {
    let is_constant = match &material.surface {
        Surface::Diffuse { reflectance } | Surface::Mirror { reflectance } => reflectance.texture.is_none(),
        Surface::Conductor { reflectance, roughness } => {
            reflectance.texture.is_none() && roughness.texture.is_none()
        }
        Surface::Glossy { base, specular, roughness, metallic, .. } => {
            let [base, specular] = [base, specular].map(|colour| colour.texture.is_none());
            base && specular && roughness.texture.is_none() && metallic.texture.is_none()
        }
        Surface::Dielectric { .. } => false,
    };
    is_constant && !material.emits() && !material.has_cutout() && material.normal_map.is_none()
}

/// Two triangles that overlap.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    /// Indices, ascending.
    pub(super) triangles: [u32; 2],
    /// Their fronts are on the same side.
    pub(super) same_front: bool,
    /// Part of each that the other covers.
    pub(super) covered: [f64; 2],
}

/// Covered part of a triangle that counts as all of it.
pub(super) const ALL: f64 = 0.999;

/// A triangle in its plane.
struct Face {
    index: u32,
    corners: [DVec3; 3],
    normal: DVec3,
    /// Twice the area.
    area: f64,
    /// Its box, with a margin for rounding.
    low: DVec3,
    high: DVec3,
}

impl Face {
    fn new(index: u32, triangle: &Triangle, positions: &[[f32; 3]]) -> Option<Self> {
        let corners = triangle.vertices.map(|v| DVec3::from(positions[v as usize].map(f64::from)));
        let [p, q, r] = corners;
        let area = (q - p).cross(r - p);
        let normal = area.try_normalize()?;
        let (low, high) = (p.min(q).min(r), p.max(q).max(r));
        let slack = DVec3::splat(MOST_ERRORS * ROUNDING * low.abs().max(high.abs()).max_element());
        let (low, high) = (low - slack, high + slack);
        Some(Self { index, corners, normal, area: area.length(), low, high })
    }

    /// Largest magnitude of a coordinate.
    fn coordinates(&self) -> f64 {
        self.low.abs().max(self.high.abs()).max_element()
    }

    /// Keys of the rounded plane, equal on both sides; several where rounding may decide for another.
    fn planes(&self) -> impl Iterator<Item = u64> + use<> {
        let longest = (self.high - self.low).length();
        let tilt = 2.0 * MOST_ERRORS * ROUNDING * self.coordinates() * longest / self.area;
        let values = [self.normal.x, self.normal.y, self.normal.z, self.normal.dot(self.corners[0])];
        let shift = (tilt + MOST_ERRORS * ROUNDING) * self.coordinates();
        let steps: [[i64; 2]; 4] = core::array::from_fn(|i| {
            let error = STEPS[i] * if i < 3 { tilt } else { shift };
            let error = error.min(0.5);
            [-error, error].map(|error| (STEPS[i] * values[i] + error).round() as i64)
        });
        let choices =
            (0..16usize).filter(move |bits| (0..4).all(|i| bits >> i & 1 == 0 || steps[i][0] != steps[i][1]));
        choices.map(move |bits| {
            let cell: [i64; 4] = core::array::from_fn(|i| steps[i][bits >> i & 1]);
            let sign = cell.iter().find(|step| **step != 0).map_or(1, |step| step.signum());
            cell.iter().fold(0, |hash, step| mix(hash ^ (sign * step) as u64))
        })
    }

    /// The pair with a triangle in the same plane that shares some of it.
    fn overlap(&self, other: &Face) -> Option<Pair> {
        let (first, second) = if self.index < other.index { (self, other) } else { (other, self) };
        let (large, small) = if self.area >= other.area { (self, other) } else { (other, self) };
        let tolerance = MOST_ERRORS * ROUNDING * large.coordinates().max(small.coordinates());
        let height = |p: &DVec3| (*p - large.corners[0]).dot(large.normal);
        if small.corners.iter().any(|p| height(p).abs() > tolerance) {
            return None;
        }
        let common = large.common_area(small);
        let pair = Pair {
            triangles: [first.index, second.index],
            same_front: self.normal.dot(other.normal) > 0.0,
            covered: [common / first.area, common / second.area],
        };
        (common >= LEAST_PART * small.area).then_some(pair)
    }

    /// Twice the area of the intersection with a triangle in the same plane, seen along the axis in which the
    /// plane extends least, over the same of a whole (Sutherland and Hodgman 1974).
    fn common_area(&self, other: &Face) -> f64 {
        let axis = longest_axis(self.normal);
        let origin = self.corners[0];
        let flat = |p: DVec3| {
            DVec2::new(p[(axis + 1) % 3] - origin[(axis + 1) % 3], p[(axis + 2) % 3] - origin[(axis + 2) % 3])
        };
        let [corners, others] = [self.corners, other.corners].map(|corners| corners.map(flat));
        let side = self.normal[axis].signum();
        let mut polygon = others.to_vec();
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            let height = |p: DVec2| side * (b - a).perp_dot(p - a);
            let mut inside = Vec::with_capacity(polygon.len() + 1);
            for (j, &p) in polygon.iter().enumerate() {
                let q = polygon[(j + 1) % polygon.len()];
                let (at_p, at_q) = (height(p), height(q));
                if at_p >= 0.0 {
                    inside.push(p);
                }
                if (at_p < 0.0) != (at_q < 0.0) {
                    inside.push(p + (q - p) * (at_p / (at_p - at_q)));
                }
            }
            polygon = inside;
        }
        let fan =
            polygon.windows(2).skip(1).map(|pair| (pair[0] - polygon[0]).perp_dot(pair[1] - polygon[0]));
        fan.sum::<f64>().abs() / self.normal[axis].abs()
    }
}

/// Collects the pairs among `indices`; `face` returns the triangle of an index.
fn collect(
    face: &impl Fn(u32) -> Option<Face>,
    indices: Vec<u32>,
    differ: &impl Fn(u32, u32) -> bool,
    pairs: &mut Vec<Pair>,
) {
    if indices.len() > FEW {
        let boxes = || indices.iter().filter_map(|&index| face(index)).map(|face| (face.low, face.high));
        let whole = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = boxes().fold(whole, |whole, one| (whole.0.min(one.0), whole.1.max(one.1)));
        let axis = longest_axis(high - low);
        let mut centres: Vec<f64> = boxes().map(|(low, high)| low[axis] + high[axis]).collect();
        let half = centres.len() / 2;
        let middle = 0.5 * *centres.select_nth_unstable_by(half, f64::total_cmp).1;
        drop(centres);
        let part = |is_in: fn(&Face, usize, f64) -> bool| -> Vec<u32> {
            let is_in = |index: &u32| face(*index).is_some_and(|face| is_in(&face, axis, middle));
            indices.iter().copied().filter(is_in).collect()
        };
        let below = part(|face, axis, middle| face.low[axis] <= middle);
        let above = part(|face, axis, middle| face.high[axis] >= middle);
        let (total, most) = (below.len() + above.len(), below.len().max(above.len()));
        if most < indices.len() && total < indices.len() * 7 / 4 {
            drop(indices);
            collect(face, below, differ, pairs);
            return collect(face, above, differ, pairs);
        }
    }
    if indices.len() * indices.len() / 2 > MOST_PAIRS {
        return;
    }
    let faces: Vec<Face> = indices.into_iter().filter_map(face).collect();
    for (i, a) in faces.iter().enumerate() {
        for b in &faces[i + 1..] {
            let is_near = a.low.cmple(b.high).all() && b.low.cmple(a.high).all();
            if is_near && a.index != b.index && differ(a.index, b.index) {
                pairs.extend(a.overlap(b));
            }
        }
    }
}

fn longest_axis(size: DVec3) -> usize {
    (0..3).fold(0, |most, i| if size[i].abs() > size[most].abs() { i } else { most })
}

/// Notes pairs of different materials with the same front.
pub(super) fn note(
    pairs: &[Pair],
    triangles: &[Triangle],
    materials: &[Material],
    names: &[String],
    notes: &mut Notes,
) {
    let mut counts: BTreeMap<[u32; 2], u64> = BTreeMap::new();
    for pair in pairs.iter().filter(|pair| pair.same_front) {
        let [a, b] = pair.triangles.map(|index| triangles[index as usize].material);
        *counts.entry([a.min(b), a.max(b)]).or_default() += 1;
    }
    for ([a, b], count) in counts {
        let [of_a, of_b] = [a, b].map(|material| &materials[material as usize]);
        let (a, b) = (&names[a as usize], &names[b as usize]);
        if of_a.emits() && of_b.emits() {
            let what = format!("triangles of the lamps `{a}` and `{b}` lie in the same place: both emit");
            notes.add(count, what);
        } else if of_a != of_b {
            let what = format!(
                "triangles of `{a}` and `{b}` lie in the same place with the same front: a lamp, else one without \
                 cut-outs, else the first of the file is visible"
            );
            notes.add(count, what);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, Vec3};
    use halflight_core::Rgb;
    use halflight_core::sampling::Random;

    /// Two quads, cut along different diagonals, the second with the other front.
    const SIDES: [[u32; 3]; 4] = [[0, 1, 2], [0, 2, 3], [5, 4, 7], [7, 6, 5]];

    fn geometry(corners: &[DVec3], triangles: &[[u32; 3]]) -> Geometry {
        let positions = corners.iter().map(|p| p.as_vec3().to_array()).collect();
        let triangle = |(i, &vertices): (usize, &[u32; 3])| Triangle { vertices, material: i as u32 / 2 };
        let triangles = triangles.iter().enumerate().map(triangle).collect();
        Geometry { positions, triangles, ..Geometry::default() }
    }

    fn pairs(geometry: &Geometry) -> Vec<[u32; 2]> {
        let materials = vec![Material::diffuse(Rgb::ONE); geometry.triangles.len()];
        locate(geometry, &materials).iter().map(|pair| pair.triangles).collect()
    }

    #[test]
    fn sides_of_a_sheet_overlap_in_every_orientation() {
        let random = Random::new(7, 0);
        let mut next = (0..).map(|i| f64::from(random.single(i)));
        let mut number = move |low: f64, high: f64| low + (high - low) * next.next().unwrap_or_default();
        for round in 0..2000 {
            let turn = DQuat::from_euler(
                glam::EulerRot::XYZ,
                number(-4.0, 4.0) * f64::from(round % 4 > 0),
                number(-4.0, 4.0) * f64::from(round % 4 > 1),
                number(-4.0, 4.0) * f64::from(round % 4 > 2),
            );
            let size = 10f64.powf(number(-3.0, 0.0));
            let offset = DVec3::from_array([(); 3].map(|()| number(-1.0, 1.0)));
            let square = [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]];
            let place = |[x, y]: [f64; 2]| offset + size * (turn * DVec3::new(x, y, 0.0));
            let front = square.map(place);
            // The other side is turned by another way, and rounded for itself.
            let back = front.map(|p| {
                DQuat::from_rotation_x(-1.0) * (DQuat::from_rotation_x(1.0) * p.as_vec3().as_dvec3())
            });
            let corners = [front, back].concat();
            let sheet = geometry(&corners, &SIDES);
            assert_eq!(pairs(&sheet), [[0, 2], [0, 3], [1, 2], [1, 3]], "{round} {size} {offset} {turn}");
            for pair in locate(&sheet, &[Material::GREY; 2]) {
                assert!(!pair.same_front && pair.covered.iter().all(|part| (part - 0.5).abs() < 1e-2));
            }
            // Neighbours, and sheets with a gap of a thousandth, do not overlap.
            assert!(
                pairs(&geometry(&corners, &[SIDES[0], SIDES[0], SIDES[1]]))
                    .iter()
                    .all(|pair| *pair == [0, 1])
            );
            let apart = front.map(|p| p + 1e-3 * (turn * DVec3::Z));
            assert!(pairs(&geometry(&[front, apart].concat(), &SIDES)).is_empty());
        }
    }

    #[test]
    fn large_flat_grids_have_no_pairs_and_doubled_ones_have_all() {
        let side = 40;
        let corner =
            |i: u32| DVec3::new(f64::from(i % (side + 1)), f64::from(i / (side + 1)), 0.25) / f64::from(side);
        let corners: Vec<DVec3> = (0..(side + 1) * (side + 1)).map(corner).collect();
        let first = |i: u32| i / side * (side + 1) + i % side;
        let cells = (0..side * side).flat_map(|i| {
            let a = first(i);
            [[a, a + 1, a + side + 2], [a, a + side + 2, a + side + 1]]
        });
        let grid: Vec<[u32; 3]> = cells.collect();
        assert!(pairs(&geometry(&corners, &grid)).is_empty());
        let back = grid.iter().map(|&[a, b, c]| [c, b, a]);
        let both: Vec<[u32; 3]> = grid.iter().copied().chain(back).collect();
        let expected: Vec<[u32; 2]> = (0..grid.len() as u32).map(|i| [i, i + grid.len() as u32]).collect();
        assert_eq!(pairs(&geometry(&corners, &both)), expected);
    }

    #[test]
    fn plain_copies_of_one_material_need_no_choice() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p.as_dvec3());
        let mut copies = geometry(&corners, &[[0, 1, 2], [0, 1, 2], [2, 1, 0]]);
        copies.triangles.iter_mut().for_each(|triangle| triangle.material = 0);
        let lamp = Material { emission: Rgb::ONE.into(), ..Material::GREY };
        assert!(locate(&copies, &[Material::GREY]).is_empty());
        assert_eq!(locate(&copies, &[lamp]).len(), 3);
    }
}
