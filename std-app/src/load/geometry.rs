//! Assembly of all triangles into one mesh in the coordinates of the core: placed, centred, scaled and
//! checked. Computed in f64 and rounded last.

use super::buffers::Geometry;
use super::fit::Fit;
use super::notes::Notes;
use super::obj::Group;
use super::placed::{Placed, is_usable};
use super::split;
use super::texcoords::{self, Texcoords};
use glam::{DVec2, DVec3};
use halflight_core::scene::Triangle;
use rayon::prelude::*;

/// Assembles all parts, in their order. `pieces` is the result of [`pieces`].
pub(super) fn assemble(parts: &[Placed], fit: &Fit, pieces: f64, notes: &mut Notes) -> Geometry {
    let has = |has: fn(&Group) -> bool| parts.iter().any(|part| has(part.group));
    let with = Attributes {
        normals: has(|group| !group.normals.is_empty()),
        texcoords: has(|group| !group.texcoords.is_empty()),
        second_texcoords: has(|group| !group.second_texcoords.is_empty()),
        colors: has(|group| !group.colors.is_empty()),
    };
    let cut = pieces > 0.0 && split::is_affordable(pieces);
    if pieces > 0.0 && !cut {
        notes.add(1, "very many triangles are very large: none is cut, and their shading is coarse");
    }
    let build = |part| Builder::new(part, fit, &with).build(cut);
    let built: Vec<(Geometry, Notes)> = parts.par_iter().map(build).collect();
    let mut all = Geometry::default();
    let vertices = built.iter().map(|(part, _)| part.positions.len()).sum();
    all.positions.reserve_exact(vertices);
    all.normals.reserve_exact(if with.normals { vertices } else { 0 });
    all.texcoords.reserve_exact(if with.texcoords { vertices } else { 0 });
    all.second_texcoords.reserve_exact(if with.second_texcoords { vertices } else { 0 });
    all.colors.reserve_exact(if with.colors { vertices } else { 0 });
    all.triangles.reserve_exact(built.iter().map(|(part, _)| part.triangles.len()).sum());
    all.objects.reserve_exact(all.triangles.capacity());
    for (part, of_part) in built {
        let first = all.positions.len() as u32;
        all.positions.extend(part.positions);
        all.normals.extend(part.normals);
        all.texcoords.extend(part.texcoords);
        all.second_texcoords.extend(part.second_texcoords);
        all.colors.extend(part.colors);
        let moved = |t: Triangle| Triangle { vertices: t.vertices.map(|v| v + first), ..t };
        all.triangles.extend(part.triangles.into_iter().map(moved));
        all.objects.extend(part.objects);
        all.ends.push(all.positions.len() as u32);
        notes.merge(of_part);
    }
    all
}

/// Attributes that some part has, so that all vertices have them.
struct Attributes {
    normals: bool,
    texcoords: bool,
    second_texcoords: bool,
    colors: bool,
}

/// Vertices of a part in the coordinates of the core; NaN if they are not finite.
fn exact(part: &Placed, fit: &Fit) -> Vec<DVec3> {
    let exact = |&p: &[f64; 3]| {
        let placed = part.placement.point(p);
        DVec3::from(if is_usable(&placed) { fit.transform.point_f64(placed) } else { [f64::NAN; 3] })
    };
    part.group.positions.iter().map(exact).collect()
}

/// Upper bound of the number of pieces of all triangles that are to be cut.
pub(super) fn pieces(parts: &[Placed], fit: &Fit) -> f64 {
    let of_part = |part: &Placed| {
        let exact = exact(part, fit);
        let counts = part.group.triangles.iter().map(|t| split::count(t.map(|v| exact[v as usize])));
        counts.filter(|count| *count > 1.0).sum::<f64>()
    };
    if fit.is_far { parts.iter().map(of_part).sum() } else { 0.0 }
}

/// A triangle smaller than this, relative to its coordinates, is deformed by rounding; the note of it.
const DEFORMED: (f64, &str) =
    (1e-5, "triangle smaller than 1e-5 of its distance from the detail: rounding deforms it");

/// Threshold for scenes without large surroundings, below the spacing of coordinates. Files often contain
/// small triangles that nobody sees.
const COLLAPSED: (f64, &str) =
    (1e-7, "triangle smaller than 1e-7 of its distance from the middle of the scene: rounding deforms it");

/// A part under construction.
struct Builder<'a> {
    part: &'a Placed<'a>,
    is_far: bool,
    exact: Vec<DVec3>,
    /// Texture coordinates before rounding; empty if the part has none.
    placed_texcoords: Vec<[f64; 2]>,
    geometry: Geometry,
    notes: Notes,
}

impl<'a> Builder<'a> {
    fn new(part: &'a Placed, fit: &Fit, with: &Attributes) -> Self {
        let group = part.group;
        let mut notes = Notes::default();
        let exact = exact(part, fit);
        let mut geometry = Geometry { positions: exact.iter().map(rounded).collect(), ..Geometry::default() };
        if with.normals {
            let matrix = part.placement.normal_matrix();
            let normal = |n: &[f64; 3]| unit_normal(matrix * DVec3::from(*n), &mut notes);
            geometry.normals = group.normals.iter().map(normal).collect();
            geometry.normals.resize(exact.len(), [0.0; 3]);
        }
        let placed_texcoords = part.texcoords.placed(&group.texcoords, &mut notes);
        if with.texcoords {
            geometry.texcoords = placed_texcoords.iter().map(|uv| uv.map(|x| x as f32)).collect();
            geometry.texcoords.resize(exact.len(), [0.0; 2]);
        }
        if with.second_texcoords {
            let placed = Texcoords::default().placed(&group.second_texcoords, &mut notes);
            geometry.second_texcoords = placed.iter().map(|uv| uv.map(|x| x as f32)).collect();
            geometry.second_texcoords.resize(exact.len(), [0.0; 2]);
        }
        if with.colors {
            geometry.colors.clone_from(&group.colors);
            geometry.colors.resize(exact.len(), [1.0; 4]);
        }
        Self { part, is_far: fit.is_far, exact, placed_texcoords, geometry, notes }
    }

    /// All usable triangles; large ones are cut if `cut`.
    fn build(mut self, cut: bool) -> (Geometry, Notes) {
        let Placed { group, placement, material, texcoords, .. } = self.part;
        let is_mirrored = placement.linear.determinant() < 0.0;
        self.geometry.triangles.reserve_exact(group.triangles.len());
        for (&[a, b, c], object) in group.triangles.iter().zip(self.part.triangle_objects()) {
            // A reflection reverses the winding; reversed again, the front stays the front.
            let vertices = if is_mirrored { [a, c, b] } else { [a, b, c] };
            let corners = vertices.map(|v| self.exact[v as usize]);
            if !self.is_usable(vertices, corners) {
                continue;
            }
            if cut && split::count(corners) > 1.0 {
                self.push_pieces(vertices, corners);
            } else {
                self.geometry.triangles.push(Triangle { vertices, material: *material });
            }
            self.geometry.objects.resize(self.geometry.triangles.len(), object);
        }
        let blurred = texcoords::subtract_periods(texcoords, &self.placed_texcoords, &mut self.geometry);
        self.notes.add(blurred, texcoords::BLURRED);
        (self.geometry, self.notes)
    }

    /// True if a triangle is finite and has an area; notes doubtful ones.
    fn is_usable(&mut self, vertices: [u32; 3], corners: [DVec3; 3]) -> bool {
        let [p, q, r] = corners;
        let area = (q - p).cross(r - p);
        if !area.is_finite() {
            self.notes.add(1, "triangle with a vertex that is not finite left out");
            return false;
        }
        if area == DVec3::ZERO {
            self.notes.add(1, "triangle without area left out");
            return false;
        }
        let normals = &self.geometry.normals;
        let is_against = |&v: &u32| {
            normals.get(v as usize).is_some_and(|&n| area.dot(DVec3::from(n.map(f64::from))) < 0.0)
        };
        if vertices.iter().all(is_against) {
            self.notes.add(1, "triangle whose normals point against its winding (kept as it is)");
        }
        let (low, high) = (p.min(q).min(r), p.max(q).max(r));
        let farthest = low.abs().max(high.abs()).max_element();
        let (least, what) = if self.is_far { DEFORMED } else { COLLAPSED };
        if (high - low).max_element() < least * farthest {
            self.notes.add(1, what);
        }
        true
    }

    /// Adds the pieces of a large triangle, with vertices of their own.
    fn push_pieces(&mut self, vertices: [u32; 3], corners: [DVec3; 3]) {
        let Self { part, placed_texcoords, geometry, .. } = self;
        for piece in split::pieces(corners) {
            let first = geometry.positions.len() as u32;
            for corner in &piece {
                geometry.positions.push(rounded(&corner.position));
                if !geometry.normals.is_empty() {
                    let ends = vertices.map(|v| geometry.normals[v as usize]);
                    geometry.normals.push(interpolated_normal(ends, corner.weights));
                }
                if !geometry.texcoords.is_empty() {
                    let ends =
                        vertices.map(|v| placed_texcoords.get(v as usize).copied().unwrap_or_default());
                    let uv: DVec2 = (0..3).map(|i| corner.weights[i] * DVec2::from(ends[i])).sum();
                    geometry.texcoords.push(uv.as_vec2().to_array());
                    if !placed_texcoords.is_empty() {
                        placed_texcoords.push(uv.into());
                    }
                }
                push_mean(&mut geometry.second_texcoords, vertices, corner.weights);
                push_mean(&mut geometry.colors, vertices, corner.weights);
            }
            let fan = (1..piece.len() as u32 - 1).map(|i| [first, first + i, first + i + 1]);
            geometry.triangles.extend(fan.map(|vertices| Triangle { vertices, material: part.material }));
        }
    }
}

/// Adds the weighted mean of the values of three vertices, if there are values.
fn push_mean<const N: usize>(values: &mut Vec<[f32; N]>, vertices: [u32; 3], weights: DVec3) {
    if !values.is_empty() {
        let ends = vertices.map(|vertex| values[vertex as usize]);
        let mean = |k: usize| (0..3).map(|i| weights[i] * f64::from(ends[i][k])).sum::<f64>() as f32;
        values.push(core::array::from_fn(mean));
    }
}

/// The position in f32; the origin for NaN.
fn rounded(p: &DVec3) -> [f32; 3] {
    if p.is_nan() { [0.0; 3] } else { p.as_vec3().to_array() }
}

/// The interpolated unit normal, or zero if one of the three is zero.
fn interpolated_normal(normals: [[f32; 3]; 3], weights: DVec3) -> [f32; 3] {
    let ends = normals.map(|n| DVec3::from(n.map(f64::from)));
    if ends.contains(&DVec3::ZERO) {
        return [0.0; 3];
    }
    let sum: DVec3 = (0..3).map(|i| weights[i] * ends[i]).sum();
    sum.normalize_or_zero().as_vec3().into()
}

/// The unit normal, or zero (flat) if there is none.
fn unit_normal(n: DVec3, notes: &mut Notes) -> [f32; 3] {
    if !n.is_finite() {
        notes.add(1, "normal that is not finite is shaded flat");
        return [0.0; 3];
    }
    match n.abs().max_element() {
        0.0 => [0.0; 3],
        largest => (n / largest).normalize().as_vec3().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::placed::Placement;
    use glam::DMat3;

    fn triangle(positions: [[f64; 3]; 3]) -> Group {
        Group { positions: positions.to_vec(), triangles: vec![[0, 1, 2]], ..Group::default() }
    }

    fn placed(group: &Group, placement: Placement) -> Placed<'_> {
        Placed { group, placement, material: 0, texcoords: Texcoords::default(), objects: &[0] }
    }

    fn all(group: &Group, placement: Placement) -> (Geometry, Vec<String>) {
        let parts = [placed(group, placement)];
        let mut notes = Notes::default();
        let fit = Fit::of(&parts);
        (assemble(&parts, &fit, pieces(&parts, &fit), &mut notes), notes.sentences())
    }

    #[test]
    fn broken_triangles_are_noted() {
        let (geometry, notes) =
            all(&triangle([[0., 0., 0.], [1., 1., 1.], [3., 3., 3.]]), Placement::IDENTITY);
        assert!(geometry.triangles.is_empty());
        assert_eq!(notes, ["triangle without area left out"]);
        for bad in [f64::NAN, f64::INFINITY, 1e200] {
            let (geometry, notes) =
                all(&triangle([[0., 0., 0.], [1., 0., bad], [0., 3., 0.]]), Placement::IDENTITY);
            assert!(geometry.triangles.is_empty());
            assert!(geometry.positions.iter().flatten().all(|x| x.is_finite()));
            assert_eq!(notes, ["triangle with a vertex that is not finite left out"]);
        }
    }

    #[test]
    fn reflection_keeps_the_front() {
        let mut group = triangle([[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
        group.normals = vec![[0.0, 0.0, 2.0]; 3];
        let mirror =
            Placement { linear: DMat3::from_diagonal(DVec3::new(-2.0, 1.0, 1.0)), offset: DVec3::ONE };
        let (geometry, notes) = all(&group, mirror);
        assert!(notes.is_empty());
        let [p, q, r] =
            geometry.triangles[0].vertices.map(|v| glam::Vec3::from(geometry.positions[v as usize]));
        assert!((q - p).cross(r - p).z > 0.0);
        assert!(geometry.normals.iter().all(|&n| glam::Vec3::from(n) == glam::Vec3::Z));
    }
}
