//! Seams of a lightmap: edges of smooth surfaces at which charts are cut, each with its two sides in the map.

use super::charts::{ChartTriangle, Charts};
use crate::load::LoadedScene;
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, Vec3};
use halflight_core::IrradiancePoint;
use halflight_core::scene::Scene;

/// Cosine from which on two normals are those of one smooth surface.
const SMOOTH: f32 = 0.999;

/// Triangles at one edge that are compared with each.
const MOST_AT_EDGE: usize = 8;

/// An edge that two triangles share in space and not in the map.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Seam {
    /// Both ends in texels, y down, on either side.
    pub(super) sides: [[[f64; 2]; 2]; 2],
}

impl Seam {
    /// True if both sides are on a map of `size` texels, but for a texel of rounding.
    pub(super) fn is_on(&self, size: [u32; 2]) -> bool {
        let most = DVec2::from(size.map(f64::from)) + 1.0;
        self.sides
            .as_flattened()
            .iter()
            .all(|end| DVec2::from(*end).clamp(-DVec2::ONE, most) == DVec2::from(*end))
    }

    /// Longer side in texels.
    pub(super) fn length(&self) -> f64 {
        self.sides.map(|[a, b]| DVec2::from(a).distance(b.into())).into_iter().fold(0.0, f64::max)
    }

    /// The places of both sides at a part of the way from the first end.
    pub(super) fn at(&self, part: f64) -> [DVec2; 2] {
        self.sides.map(|[a, b]| DVec2::from(a).lerp(b.into(), part))
    }
}

/// An edge of a triangle of a chart. Its ends are in the order of their bits.
struct Edge {
    /// Bits of the positions of both ends.
    ends: [[u32; 3]; 2],
    /// Index in [`Charts::triangles`], and the corners of both ends.
    triangle: u32,
    corners: [usize; 2],
}

/// Bytes of a triangle while seams are found.
pub(super) const BYTES_OF_TRIANGLE: usize = 3 * (size_of::<Edge>() + size_of::<Seam>());

/// The seams of `charts`, in an order of their positions.
pub(super) fn seams(scene: &Scene, loaded: &LoadedScene, charts: &Charts) -> Vec<Seam> {
    let mut edges = Vec::with_capacity(3 * charts.triangles.len());
    for (number, of_map) in (0..).zip(&charts.triangles) {
        let vertices = loaded.triangles[of_map.triangle as usize].vertices;
        // Zero has two signs.
        let bits = |corner: usize| loaded.positions[vertices[corner] as usize].map(|x| (x + 0.0).to_bits());
        for corners in [[0, 1], [1, 2], [2, 0]] {
            let [a, b] = if bits(corners[0]) < bits(corners[1]) { corners } else { [corners[1], corners[0]] };
            edges.push(Edge { ends: [bits(a), bits(b)], triangle: number, corners: [a, b] });
        }
    }
    edges.sort_unstable_by_key(|edge| (edge.ends, edge.triangle));
    let mut seams = Vec::new();
    for edges in edges.chunk_by(|a, b| a.ends == b.ends) {
        for (number, edge) in edges.iter().enumerate() {
            let others = edges.iter().skip(number + 1).take(MOST_AT_EDGE);
            seams.extend(others.filter_map(|other| seam(scene, charts, [edge, other])));
        }
    }
    seams
}

/// The seam between two triangles at an edge; `None` where the map is not cut, or the surface is not smooth.
fn seam(scene: &Scene, charts: &Charts, edges: [&Edge; 2]) -> Option<Seam> {
    let triangles = edges.map(|edge| &charts.triangles[edge.triangle as usize]);
    let [first, second] = [0, 1].map(|i| edges[i].corners.map(|corner| triangles[i].corners[corner]));
    if first == second || first[0] == first[1] && second[0] == second[1] {
        return None;
    }
    let is_smooth = |end: usize| {
        let [a, b] = [0, 1].map(|i| normal(scene, triangles[i], edges[i].corners[end]));
        a.zip(b).is_some_and(|(a, b)| a.dot(b) >= SMOOTH)
    };
    let sides = [first, second].map(|side| side.map(|end| end.to_array()));
    (is_smooth(0) && is_smooth(1)).then_some(Seam { sides })
}

/// Normal at a corner, on the front.
fn normal(scene: &Scene, of_map: &ChartTriangle, corner: usize) -> Option<Vec3> {
    let weights = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][corner];
    Some(IrradiancePoint::on_triangle(scene, of_map.triangle, weights, true)?.normal.into())
}
