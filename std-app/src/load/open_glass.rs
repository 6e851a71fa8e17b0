//! Notes on open glass: the inside of a dielectric lies behind its faces, so a single pane fills half of the
//! space with glass.

use super::buffers::Geometry;
use super::notes::Notes;
use halflight_core::scene::{Material, Surface};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Notes glass with edges of one face only, counting faces of all materials.
pub(super) fn note(geometry: &Geometry, materials: &[Material], names: &[String], notes: &mut Notes) {
    let is_glass = |t: u32| matches!(materials[t as usize].surface, Surface::Dielectric { .. });
    if !(0..materials.len() as u32).any(is_glass) {
        return;
    }
    // Corners at the same position are one, regardless of normals and texture coordinates.
    let mut points: HashMap<[u32; 3], u32> = HashMap::new();
    let position = |v: u32| geometry.positions[v as usize].map(|x| (x + 0.0).to_bits());
    let mut pieces = Pieces::default();
    let mut edges: HashMap<[u32; 2], (u32, u32)> = HashMap::new();
    for triangle in geometry.triangles.iter().filter(|t| is_glass(t.material)) {
        let corners = triangle.vertices.map(|v| {
            let next = points.len() as u32;
            *points.entry(position(v)).or_insert(next)
        });
        pieces.join(corners);
        for edge in edges_of(corners) {
            edges.entry(edge).or_insert((0, triangle.material)).0 += 1;
        }
    }
    edges.retain(|_, (faces, _)| *faces == 1);
    if edges.is_empty() {
        return;
    }
    for triangle in geometry.triangles.iter().filter(|t| !is_glass(t.material)) {
        let corners = triangle.vertices.map(|v| points.get(&position(v)).copied());
        for edge in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (corners[i], corners[j])) {
            if let (Some(a), Some(b)) = edge {
                edges.remove(&[a.min(b), a.max(b)]);
            }
        }
    }
    let mut open: BTreeMap<u32, (u64, BTreeSet<u32>)> = BTreeMap::new();
    for (edge, (_, material)) in edges {
        let (count, roots) = open.entry(material).or_default();
        *count += 1;
        roots.insert(pieces.root(edge[0]));
    }
    for (material, (count, roots)) in open {
        let (name, pieces) = (&names[material as usize], roots.len());
        let what = format!(
            "glass `{name}` is open ({count} edges of one face, in {pieces} of its pieces): everything \
             behind it is its inside; a pane needs two faces"
        );
        notes.add(1, what);
    }
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
