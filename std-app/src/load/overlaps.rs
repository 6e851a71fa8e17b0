//! Triangles that overlap in one plane within rounding: the two sides of a sheet with a material each,
//! surfaces that lie on others, doubled faces. The core decides for each ray which of them it sees
//! ([`halflight_core::scene::Scene::visible_hit`]).
//!
//! Triangles are sorted by rounded planes. Those of a plane are split by their boxes (Bentley and Wood 1980)
//! until few are left, which are compared in pairs.

use super::buffers::Geometry;
pub(super) use super::coplanar::Pair;
use super::coplanar::{Face, MOST_ERRORS, longest_axis};
use super::notes::Notes;
use core::cell::OnceCell;
use glam::Vec3;
use halflight_core::scene::{Material, Overlap, Surface, Triangle};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Triangles, and planes, of a task.
const CHUNK: usize = 1 << 12;
/// Triangles that are compared without a further split.
const FEW: usize = 16;
/// Most pairs of triangles in one plane that are compared after the last split.
const MOST_PAIRS: usize = 1 << 24;

/// Pairs of triangles that overlap in one plane and differ, ascending.
pub(super) fn locate(geometry: &Geometry, materials: &[Material]) -> Vec<Pair> {
    let Geometry { triangles, positions, .. } = geometry;
    let plain: Vec<bool> = materials.iter().map(is_plain).collect();
    let differ = |a: &Triangle, b: &Triangle| a.material != b.material || !plain[a.material as usize];
    if triangles.windows(2).all(|pair| !differ(&pair[0], &pair[1])) {
        return Vec::new();
    }
    let face = |index: u32| Face::new(index, &triangles[index as usize], positions);
    let keys = |chunk: &[Triangle], first: u32| {
        let mut keys = Vec::with_capacity(chunk.len() + chunk.len() / 8);
        for (index, triangle) in (first..).zip(chunk) {
            if let Some(face) = Face::new(index, triangle, positions) {
                face.for_each_plane(|key| keys.push((key, index)));
            }
        }
        keys
    };
    let keys: Vec<Vec<(u64, u32)>> = triangles
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(number, chunk)| keys(chunk, (number * CHUNK) as u32))
        .collect();
    let mut planes = shared(&keys);
    drop(keys);
    planes.par_sort_unstable();
    let differ = |a: u32, b: u32| differ(&triangles[a as usize], &triangles[b as usize]);
    let is_mixed = |group: &&[(u64, u32)]| group.windows(2).any(|pair| differ(pair[0].1, pair[1].1));
    let groups: Vec<&[(u64, u32)]> = planes.chunk_by(|a, b| a.0 == b.0).filter(is_mixed).collect();
    let boxed = |&(_, index): &(u64, u32)| Boxed::new(index, &triangles[index as usize], positions);
    let search = |groups: &[&[(u64, u32)]]| {
        let mut pairs = Vec::new();
        for group in groups {
            // Most planes have the two halves of a rectangle.
            if let [first, second] = group {
                let (a, b) = (boxed(first), boxed(second));
                if a.is_near(&b) && a.index != b.index {
                    pairs.extend(face(a.index).zip(face(b.index)).and_then(|(a, b)| a.overlap(&b)));
                }
            } else {
                collect(&face, group.iter().map(boxed).collect(), &differ, &mut pairs);
            }
        }
        pairs
    };
    let mut pairs = groups.par_chunks(CHUNK).map(search).collect::<Vec<_>>().concat();
    pairs.par_sort_unstable_by_key(|pair| pair.triangles);
    pairs.dedup_by_key(|pair| pair.triangles);
    pairs
}

/// The entries of `keys` that have a key more than once, and a few others: sorting all takes longer.
fn shared(keys: &[Vec<(u64, u32)>]) -> Vec<(u64, u32)> {
    let slots = (4 * keys.iter().map(Vec::len).sum::<usize>()).next_power_of_two();
    let slot = |key: u64| key as usize & (slots - 1);
    let mut counts = vec![0u8; slots];
    let all = || keys.iter().flatten().copied();
    all().for_each(|(key, _)| counts[slot(key)] = counts[slot(key)].saturating_add(1));
    all().filter(|(key, _)| counts[slot(*key)] > 1).collect()
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
        Surface::Diffuse { reflectance } | Surface::Mirror { reflectance } => !reflectance.varies(),
        Surface::Conductor { reflectance, roughness } => !reflectance.varies() && !roughness.varies(),
        Surface::Glossy { base, specular, roughness, metallic, .. } => {
            !(base.varies() || specular.varies() || roughness.varies() || metallic.varies())
        }
        Surface::Pane { .. } | Surface::Dielectric { .. } => false,
    };
    is_constant && !material.emits() && !material.has_cutout() && material.normal_map.is_none()
}

/// Covered part of a triangle that counts as all of it.
pub(super) const ALL: f64 = 0.999;

/// The box of a triangle, with a margin for rounding.
#[derive(Clone, Copy)]
struct Boxed {
    index: u32,
    low: Vec3,
    high: Vec3,
}

impl Boxed {
    fn new(index: u32, triangle: &Triangle, positions: &[[f32; 3]]) -> Self {
        let [p, q, r] = triangle.vertices.map(|v| Vec3::from(positions[v as usize]));
        let (low, high) = (p.min(q).min(r), p.max(q).max(r));
        // The sums are rounded, too.
        let slack = (MOST_ERRORS as f32 + 1.0) * f32::EPSILON * low.abs().max(high.abs()).max_element();
        Self { index, low: low - slack, high: high + slack }
    }

    fn is_near(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

/// Collects the pairs among the triangles in `boxes`; `face` returns the triangle of an index.
fn collect(
    face: &impl Fn(u32) -> Option<Face>,
    boxes: Vec<Boxed>,
    differ: &impl Fn(u32, u32) -> bool,
    pairs: &mut Vec<Pair>,
) {
    if boxes.len() > FEW {
        let whole = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) =
            boxes.iter().fold(whole, |whole, one| (whole.0.min(one.low), whole.1.max(one.high)));
        let axis = longest_axis((high - low).as_dvec3());
        let mut centres: Vec<f32> =
            boxes.iter().map(|one| 0.5 * one.low[axis] + 0.5 * one.high[axis]).collect();
        let half = centres.len() / 2;
        let middle = *centres.select_nth_unstable_by(half, f32::total_cmp).1;
        drop(centres);
        let below: Vec<Boxed> = boxes.iter().copied().filter(|one| one.low[axis] <= middle).collect();
        let above: Vec<Boxed> = boxes.iter().copied().filter(|one| one.high[axis] >= middle).collect();
        let (total, most) = (below.len() + above.len(), below.len().max(above.len()));
        if most < boxes.len() && total < boxes.len() * 7 / 4 {
            drop(boxes);
            collect(face, below, differ, pairs);
            return collect(face, above, differ, pairs);
        }
    }
    if boxes.len() * boxes.len() / 2 > MOST_PAIRS {
        return;
    }
    let mut faces = Vec::new();
    faces.resize_with(boxes.len(), OnceCell::new);
    let face = |i: usize| faces[i].get_or_init(|| face(boxes[i].index)).as_ref();
    for (i, a) in boxes.iter().enumerate() {
        for (j, b) in boxes.iter().enumerate().skip(i + 1) {
            if a.is_near(b) && a.index != b.index && differ(a.index, b.index) {
                pairs.extend(face(i).zip(face(j)).and_then(|(a, b)| a.overlap(b)));
            }
        }
    }
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
    use glam::{DQuat, DVec3};
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
