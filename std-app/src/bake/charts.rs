//! Charts of a lightmap: the triangles that share vertices in space and in the texture plane.

use crate::load::LoadedScene;
use glam::DVec2;
use halflight_core::scene::Triangle;
use std::collections::HashMap;

/// Rounding of texture coordinates of a file, by which a chart may leave the unit square.
const ROUNDING: f64 = 1e-5;

/// A triangle of a chart in the plane of the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChartTriangle {
    /// Triangle of the scene.
    pub(super) triangle: u32,
    /// Number of its chart.
    pub(super) chart: u32,
    /// Corners in texels, y down.
    pub(super) corners: [DVec2; 3],
}

impl ChartTriangle {
    /// Twice the area in texels, negative where the chart is mirrored.
    pub(super) fn area(&self) -> f64 {
        let [a, b, c] = self.corners;
        (b - a).perp_dot(c - a)
    }
}

/// The charts of some triangles of a scene.
#[derive(Debug, Default)]
pub(super) struct Charts {
    pub(super) triangles: Vec<ChartTriangle>,
    /// Number of charts.
    pub(super) count: usize,
    /// Triangles without area in the plane of the map, which have no texels.
    pub(super) flat: usize,
}

/// Bytes of a triangle while charts are found.
pub(super) const BYTES_OF_TRIANGLE: usize = size_of::<ChartTriangle>() + 3 * 48;

/// The charts of the triangles that `is_chosen`, in a map of `size` texels.
///
/// # Errors
/// A sentence if there are no charts, or if some leave the unit square.
pub(super) fn charts(
    loaded: &LoadedScene,
    is_chosen: impl Fn(u32, &Triangle) -> bool,
    size: [u32; 2],
) -> Result<Charts, String> {
    if loaded.texcoords.is_empty() {
        return Err("has no texture coordinates".into());
    }
    let [width, height] = size.map(f64::from);
    let mut charts = Charts::default();
    let mut corners_of = Vec::new();
    let mut outside: Option<(usize, String)> = None;
    for (number, triangle) in (0..).zip(&loaded.triangles) {
        if !is_chosen(number, triangle) {
            continue;
        }
        let uv =
            triangle.vertices.map(|vertex| DVec2::from(loaded.texcoords[vertex as usize].map(f64::from)));
        if let Some(uv) = uv.into_iter().find(|uv| *uv != uv.clamp(-SLACK, DVec2::ONE + SLACK)) {
            let name = &loaded.material_names[triangle.material as usize];
            let first = || (0, format!("the first of material `{name}` at ({}, {})", uv.x, uv.y));
            outside.get_or_insert_with(first).0 += 1;
            continue;
        }
        let corners = uv.map(|uv| DVec2::new(uv.x * width, (1.0 - uv.y) * height));
        let of_map = ChartTriangle { triangle: number, chart: 0, corners };
        if of_map.area() == 0.0 {
            charts.flat += 1;
            continue;
        }
        charts.triangles.push(of_map);
        corners_of.push(triangle.vertices);
    }
    if let Some((count, first)) = outside {
        let plural = if count == 1 { "triangle has" } else { "triangles have" };
        return Err(format!("{count} {plural} texture coordinates outside 0 to 1, {first}"));
    }
    if charts.triangles.is_empty() {
        return Err("has no area in texture coordinates".into());
    }
    charts.count = number(loaded, &corners_of, &mut charts.triangles);
    Ok(charts)
}

const SLACK: DVec2 = DVec2::splat(ROUNDING);

/// Numbers the charts by their first triangle and returns their count. Vertices of equal position and texture
/// coordinates are one, whatever their normals are.
fn number(loaded: &LoadedScene, corners: &[[u32; 3]], triangles: &mut [ChartTriangle]) -> usize {
    let mut parents: Vec<u32> = (0..corners.len() as u32).collect();
    let mut first_of: HashMap<[u32; 5], u32> = HashMap::new();
    for (number, corners) in (0..).zip(corners) {
        for &vertex in corners {
            let ([x, y, z], [u, v]) = (loaded.positions[vertex as usize], loaded.texcoords[vertex as usize]);
            // Zero has two signs.
            let key = [x, y, z, u, v].map(|number| (number + 0.0).to_bits());
            let other = *first_of.entry(key).or_insert(number);
            let (a, b) = (root(&mut parents, number), root(&mut parents, other));
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    let mut charts = HashMap::new();
    for (number, triangle) in (0..).zip(triangles) {
        let count = charts.len() as u32;
        triangle.chart = *charts.entry(root(&mut parents, number)).or_insert(count);
    }
    charts.len()
}

/// The first triangle of the chart of `triangle` so far. Paths are halved.
fn root(parents: &mut [u32], mut triangle: u32) -> u32 {
    while parents[triangle as usize] != triangle {
        parents[triangle as usize] = parents[parents[triangle as usize] as usize];
        triangle = parents[triangle as usize];
    }
    triangle
}
