//! Open glass: the inside of a dielectric lies behind its faces, so a single sheet fills half of the space
//! with glass. Flat sheets of an MTL become panes, other open glass is noted.

use super::buffers::Geometry;
use super::notes::Notes;
use glam::Vec3;
use halflight_core::scene::{Material, Surface, Triangle};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

/// Least index of sheets that are panes: water has 1.33, and its surface is a flat sheet of glass too.
const SOLID: f32 = 1.4;

/// Distance of the points of a flat sheet from its plane, in lengths of the largest side of its triangles.
const FLAT: f32 = 1e-4;

/// Finds glass with edges of one face only, counting faces of all materials. It becomes panes if
/// `may_be_panes` has its material and all pieces of that are flat; else it is noted.
pub(super) fn repair(
    geometry: &Geometry,
    may_be_panes: &[bool],
    materials: &mut [Material],
    names: &[String],
    notes: &mut Notes,
) {
    let open = open(geometry, materials);
    for (material, (count, roots, pieces)) in open {
        let name = &names[material as usize];
        let may_be_pane = may_be_panes.get(material as usize) == Some(&true) && roots.len() == pieces;
        if may_be_pane && is_flat(geometry, material) {
            let Surface::Dielectric { ior, tint, roughness } = materials[material as usize].surface else {
                continue;
            };
            if ior >= SOLID && roughness == 0.0.into() {
                materials[material as usize].surface = Surface::Pane { ior, tint };
                let what = format!(
                    "glass `{name}` is flat sheets without an inside: they are thin panes; \
                     `kind = \"glass\"` in a scene file keeps them solid"
                );
                notes.add(1, what);
                continue;
            }
        }
        let which = match (count, roots.len()) {
            (0, flat) => format!("has {flat} flat pieces of two faces"),
            (_, open) => format!("is open ({count} edges of one face, in {open} of its pieces)"),
        };
        let what = format!(
            "glass `{name}` {which}: everything behind it is its inside; `kind = \"pane\"` in a scene \
             file makes it thin"
        );
        notes.add(1, what);
    }
}

/// True if the triangles of `material` that share corners lie in one plane each.
fn is_flat(geometry: &Geometry, material: u32) -> bool {
    let position = |v: u32| Vec3::from(geometry.positions[v as usize]);
    let mut planes: HashMap<[u32; 3], (Vec3, Vec3)> = HashMap::new();
    let bits = |p: Vec3| (p + 0.0).to_array().map(f32::to_bits);
    geometry.triangles.iter().filter(|t| t.material == material).all(|triangle| {
        let corners = triangle.vertices.map(position);
        let (normal, distance) = plane(corners);
        // Every corner has a plane of the triangles around it: neighbours hand it on.
        corners.iter().all(|&corner| {
            let (origin, of_corner) = *planes.entry(bits(corner)).or_insert((corners[0], normal));
            corners.iter().all(|&other| of_corner.dot(other - origin).abs() <= distance)
        })
    })
}

/// Unit normal of a triangle, zero without one, and the distance within which points lie in its plane.
fn plane([a, b, c]: [Vec3; 3]) -> (Vec3, f32) {
    let [along, across] = [b - a, c - a];
    (along.cross(across).normalize_or_zero(), FLAT * along.length().max(across.length()))
}

/// Number of open edges of each glass, roots of the pieces that have them or are flat with two faces at each
/// edge, and number of all its pieces.
fn open(geometry: &Geometry, materials: &[Material]) -> BTreeMap<u32, (u64, BTreeSet<u32>, usize)> {
    let is_glass = |t: u32| matches!(materials[t as usize].surface, Surface::Dielectric { .. });
    if !(0..materials.len() as u32).any(is_glass) {
        return BTreeMap::new();
    }
    // Corners at the same position are one, regardless of normals and texture coordinates.
    let mut points: HashMap<[u32; 3], u32> = HashMap::new();
    let position = |v: u32| geometry.positions[v as usize].map(|x| (x + 0.0).to_bits());
    let mut pieces = Pieces::default();
    let mut edges: HashMap<[u32; 2], (u32, u32)> = HashMap::new();
    // The two faces of a sheet that has both enclose nothing.
    let mut faces: HashSet<[u32; 3]> = HashSet::new();
    let mut corner_of: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for triangle in geometry.triangles.iter().filter(|t| is_glass(t.material)) {
        let corners = triangle.vertices.map(|v| {
            let next = points.len() as u32;
            *points.entry(position(v)).or_insert(next)
        });
        pieces.join(corners);
        corner_of.entry(triangle.material).or_default().insert(corners[0]);
        let mut face = corners;
        face.sort_unstable();
        if !faces.insert(face) {
            continue;
        }
        for edge in edges_of(corners) {
            edges.entry(edge).or_insert((0, triangle.material)).0 += 1;
        }
    }
    edges.retain(|_, (faces, _)| *faces == 1);
    let with_edges: HashSet<u32> = edges.keys().map(|edge| pieces.root(edge[0])).collect();
    let mut open: BTreeMap<u32, (u64, BTreeSet<u32>, usize)> = BTreeMap::new();
    // A square of two faces whose diagonals cross has two faces at each edge.
    let is_glass_triangle = |triangle: &&Triangle| is_glass(triangle.material);
    for (root, material) in flat(geometry, is_glass_triangle, |v| pieces.root(points[&position(v)])) {
        if !with_edges.contains(&root) {
            open.entry(material).or_default().1.insert(root);
        }
    }
    for triangle in geometry.triangles.iter().filter(|t| !is_glass(t.material)) {
        let corners = triangle.vertices.map(|v| points.get(&position(v)).copied());
        for edge in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (corners[i], corners[j])) {
            if let (Some(a), Some(b)) = edge {
                edges.remove(&[a.min(b), a.max(b)]);
            }
        }
    }
    for (edge, (_, material)) in edges {
        let (count, roots, _) = open.entry(material).or_default();
        *count += 1;
        roots.insert(pieces.root(edge[0]));
    }
    for (material, (_, _, all)) in &mut open {
        let corners = corner_of.remove(material).unwrap_or_default();
        *all = corners.into_iter().map(|corner| pieces.root(corner)).collect::<BTreeSet<_>>().len();
    }
    open
}

/// Pieces whose triangles all lie in one plane: roots, and the material.
fn flat(
    geometry: &Geometry,
    is_glass: impl Fn(&&Triangle) -> bool,
    mut root: impl FnMut(u32) -> u32,
) -> Vec<(u32, u32)> {
    let mut planes: HashMap<u32, (Vec3, Vec3, u32, bool)> = HashMap::new();
    for triangle in geometry.triangles.iter().filter(is_glass) {
        let corners = triangle.vertices.map(|v| Vec3::from(geometry.positions[v as usize]));
        let (normal, distance) = plane(corners);
        // Others share the corners of a triangle that rounding has left without a plane.
        if normal == Vec3::ZERO {
            continue;
        }
        let piece = planes.entry(root(triangle.vertices[0]));
        let (origin, of_piece, _, is_flat) = piece.or_insert((corners[0], normal, triangle.material, true));
        *is_flat &= corners.iter().all(|&corner| of_piece.dot(corner - *origin).abs() <= distance);
    }
    planes.into_iter().filter(|(_, piece)| piece.3).map(|(root, piece)| (root, piece.2)).collect()
}

fn edges_of([a, b, c]: [u32; 3]) -> impl Iterator<Item = [u32; 2]> {
    [[a, b], [b, c], [c, a]].into_iter().filter(|[p, q]| p != q).map(|[p, q]| [p.min(q), p.max(q)])
}

/// Connected components of points (union-find, Tarjan 1975).
#[derive(Default)]
struct Pieces(Vec<u32>);

impl Pieces {
    fn root(&mut self, mut point: u32) -> u32 {
        while self.0[point as usize] != point {
            let above = self.0[self.0[point as usize] as usize];
            self.0[point as usize] = above;
            point = above;
        }
        point
    }

    fn join(&mut self, corners: [u32; 3]) {
        let most = corners.into_iter().max().unwrap_or_default();
        while self.0.len() <= most as usize {
            self.0.push(self.0.len() as u32);
        }
        let [a, b, c] = corners.map(|corner| self.root(corner));
        self.0[b as usize] = a;
        let c = self.root(c);
        self.0[c as usize] = self.root(a);
    }
}
