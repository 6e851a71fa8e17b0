//! Rounding of texture coordinates to f32. Large ones would lose their fraction, the only part that a
//! repeating texture needs, so whole periods are subtracted in f64, per triangle.

use super::buffers::Geometry;
use super::map::Map;
use super::notes::Notes;
use halflight_core::scene::Wrap;
use std::collections::HashMap;

/// Least coordinate that is reduced: f32 resolves 1/65536 below, a sixteenth of a texel of 4096.
const FAR: f64 = 256.0;
/// Multiples of this are subtracted, so that neighbours share their vertices.
const STEP: f64 = 64.0;
/// Longest common period of maps of different scales.
const LONGEST_PERIOD: u32 = 1000;
/// Reduced coordinate above which f32 resolves less than 1/128.
const BLURS: f64 = 65536.0;

/// The note on triangles that [`subtract_periods`] counts.
pub(super) const BLURRED: &str =
    "triangle with texture coordinates beyond 65536: its textures lose all detail";

/// Transform of the texture coordinates of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Texcoords {
    /// Factor.
    scale: [f64; 2],
    /// Added after the scale.
    offset: [f64; 2],
    /// Common period of all maps; `None` if there is none.
    period: Option<f64>,
}

impl Default for Texcoords {
    fn default() -> Self {
        Self { scale: [1.0; 2], offset: [0.0; 2], period: None }
    }
}

impl Texcoords {
    /// The transform for `maps`; takes over a scale and offset that all maps have in common.
    pub(super) fn of_maps(maps: &mut [&mut Map]) -> Self {
        let mut texcoords = Self::default();
        let Some(first) = maps.first() else { return texcoords };
        let common = (first.options.scale, first.options.offset);
        if maps.iter().all(|map| (map.options.scale, map.options.offset) == common) {
            (texcoords.scale, texcoords.offset) = common;
            for map in maps.iter_mut() {
                (map.options.scale, map.options.offset) = ([1.0; 2], [0.0; 2]);
            }
        }
        if maps.iter().all(|map| map.options.wrap == Wrap::REPEAT) {
            let scales: Vec<f64> = maps.iter().flat_map(|map| map.options.scale).collect();
            texcoords.period = period(&scales);
        }
        texcoords
    }

    /// The coordinates before rounding; 0 with a note if they are not finite.
    pub(super) fn placed(&self, texcoords: &[[f64; 2]], notes: &mut Notes) -> Vec<[f64; 2]> {
        let transform = |uv: &[f64; 2]| {
            let uv = [0, 1].map(|i| uv[i] * self.scale[i] + self.offset[i]);
            if uv.iter().all(|&x| (x as f32).is_finite()) {
                return uv;
            }
            notes.add(1, "texture coordinate that is not finite is set to 0 0");
            [0.0; 2]
        };
        texcoords.iter().map(transform).collect()
    }
}

/// The least whole number whose products with all scales are whole.
fn period(scales: &[f64]) -> Option<f64> {
    let is_whole = |x: f64| (x - x.round()).abs() <= 1e-9 * x.abs().max(1.0);
    (1..=LONGEST_PERIOD).map(f64::from).find(|period| scales.iter().all(|scale| is_whole(scale * period)))
}

/// Subtracts whole periods from large texture coordinates; a vertex between distant triangles is duplicated.
/// `placed`: the coordinates in f64. Returns the number of triangles that lose all detail.
pub(super) fn subtract_periods(texcoords: &Texcoords, placed: &[[f64; 2]], geometry: &mut Geometry) -> u64 {
    let Some(period) = texcoords.period else { return 0 };
    if placed.iter().flatten().all(|x| x.abs() < FAR) {
        return 0;
    }
    let step = period * (STEP / period).ceil();
    let mut blurred = 0;
    // The vertex for a vertex of the file minus a multiple of the step.
    let mut vertices: HashMap<(u32, [i64; 2]), u32> = HashMap::new();
    let mut is_taken = vec![false; placed.len()];
    let mut triangles = core::mem::take(&mut geometry.triangles);
    for triangle in &mut triangles {
        let corners = triangle.vertices.map(|v| placed[v as usize]);
        let steps = [0, 1].map(|i| {
            let least = corners.iter().map(|uv| uv[i]).fold(f64::INFINITY, f64::min);
            let is_far = corners.iter().any(|uv| uv[i].abs() >= FAR);
            if is_far { (least / step).floor() as i64 } else { 0 }
        });
        let near = corners.map(|uv| [0, 1].map(|i| uv[i] - steps[i] as f64 * step));
        blurred += u64::from(near.iter().flatten().any(|x| x.abs() > BLURS));
        for (vertex, uv) in triangle.vertices.iter_mut().zip(near) {
            let old = *vertex as usize;
            *vertex = *vertices.entry((*vertex, steps)).or_insert_with(|| {
                let uv = uv.map(|x| x as f32);
                if !core::mem::replace(&mut is_taken[old], true) {
                    geometry.texcoords[old] = uv;
                    return old as u32;
                }
                geometry.push_copy(old);
                geometry.texcoords.push(uv);
                geometry.positions.len() as u32 - 1
            });
        }
    }
    geometry.triangles = triangles;
    blurred
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_core::scene::Triangle;

    /// Two triangles with a common edge; `u` are the texture coordinates of the corners along u.
    fn strip(u: [f64; 4], texcoords: Texcoords) -> (Geometry, u64) {
        let uv = u.map(|u| [u, 0.25]);
        let triangles = [[0, 1, 2], [1, 3, 2]].map(|vertices| Triangle { vertices, material: 0 }).to_vec();
        let mut geometry = Geometry {
            positions: vec![[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3]],
            texcoords: uv.map(|uv| uv.map(|x| x as f32)).to_vec(),
            triangles,
            ..Geometry::default()
        };
        let blurred = subtract_periods(&texcoords, &uv, &mut geometry);
        (geometry, blurred)
    }

    fn repeating(scales: [f64; 2]) -> Texcoords {
        let mut maps =
            scales.map(|scale| Map::of_statement(format!("-s {scale} 1 a.png").as_bytes(), 1).unwrap());
        maps.iter_mut().zip(scales).for_each(|(map, scale)| map.options.scale = [scale, 1.0]);
        let [a, b] = &mut maps;
        Texcoords::of_maps(&mut [a, b])
    }

    fn of_triangle(geometry: &Geometry, triangle: usize) -> [f32; 3] {
        geometry.triangles[triangle].vertices.map(|v| geometry.texcoords[v as usize][0])
    }

    #[test]
    fn large_coordinates_keep_their_fraction() {
        for whole in [1e3, 1e5, 1e7, 1e12, -1e5, -1e12] {
            let (geometry, blurred) = strip([0.25, 0.5, 0.75, 1.0].map(|u| whole + u), repeating([1.0; 2]));
            let [a, b, c] = of_triangle(&geometry, 0);
            assert_eq!([a.rem_euclid(1.0), b - a, c - a], [0.25, 0.25, 0.5], "{whole}");
            assert!((0.0..64.0).contains(&a));
            assert_eq!((geometry.positions.len(), blurred), (4, 0));
        }
    }

    #[test]
    fn small_and_clamped_coordinates_keep_their_bits() {
        let near = [0.1, -200.0, 255.9, 0.3];
        assert_eq!(strip(near, repeating([1.0; 2])).0.texcoords[1][0], -200.0);
        let far = [1e6, 1e6 + 1.0, 1e6, 1e6];
        assert_eq!(strip(far, Texcoords::default()).0.texcoords[1][0], 1_000_001.0);
        let mut clamped = Map::default();
        clamped.options.wrap = Wrap::CLAMP;
        assert_eq!(strip(far, Texcoords::of_maps(&mut [&mut clamped])).0.texcoords[1][0], 1_000_001.0);
    }

    #[test]
    fn vertex_between_distant_triangles_is_duplicated() {
        let (geometry, _) = strip([0.0, 300.5, 301.0, 1000.25], repeating([1.0; 2]));
        assert_eq!(of_triangle(&geometry, 0), [0.0, 300.5, 301.0]);
        assert_eq!(of_triangle(&geometry, 1), [44.5, 744.25, 45.0]);
        assert_eq!(geometry.positions.len(), 6);
        assert_eq!(geometry.positions[5], geometry.positions[2]);
        let (_, blurred) = strip([0.0, 1e9, 0.0, 1e9], repeating([1.0; 2]));
        assert_eq!(blurred, 2);
    }

    #[test]
    fn maps_of_different_scales_have_a_common_period() {
        assert_eq!(period(&[1.0, 1.0]), Some(1.0));
        assert_eq!(period(&[1.0, 0.5, 0.1]), Some(10.0));
        assert_eq!(period(&[0.0, -2.0]), Some(1.0));
        assert_eq!(period(&[1.0, core::f64::consts::PI]), None);
        let (geometry, _) = strip([1e6 + 0.5, 1e6, 1e6, 1e6], repeating([1.0, 0.3]));
        let left = 1e6 + 0.5 - f64::from(of_triangle(&geometry, 0)[0]);
        assert_eq!(left % 10.0, 0.0);
        assert!(left > 9e5);
    }

    #[test]
    fn common_transform_is_applied_once() {
        let mut maps = [1.0, 1.0].map(|_| Map::of_statement(b"a.png", 1).unwrap());
        maps.iter_mut().for_each(|map| map.options.scale = [0.37, 2.0]);
        let [a, b] = &mut maps;
        let texcoords = Texcoords::of_maps(&mut [a, b]);
        assert_eq!((texcoords.scale, texcoords.period), ([0.37, 2.0], Some(1.0)));
        assert_eq!(maps[0].options.scale, [1.0; 2]);
    }
}
