//! All triangles of a scene in one mesh, in the coordinates of the core: placed, centred, scaled, checked.
//! Everything is f64 until the last step.

use super::fit::Fit;
use super::notes::Notes;
use super::obj::Group;
use super::split;
use super::texcoords::{self, Texcoords};
use glam::{DMat3, DVec2, DVec3};
use halflight_core::scene::Triangle;
use rayon::prelude::*;

/// Coordinates beyond this count as not finite: their squares would be.
const LARGEST: f64 = 1e150;

/// Where a mesh stands: `linear * p + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// Rotation, scale and whatever else is linear.
    pub(super) linear: DMat3,
    /// Translation.
    pub(super) offset: DVec3,
}

impl Placement {
    /// Where the file puts it.
    pub(super) const IDENTITY: Self = Self { linear: DMat3::IDENTITY, offset: DVec3::ZERO };

    pub(super) fn point(&self, p: [f64; 3]) -> [f64; 3] {
        if *self == Self::IDENTITY {
            return p;
        }
        (self.linear * DVec3::from(p) + self.offset).into()
    }

    /// The matrix that keeps normals normal to their surface and on its side: the inverse transposed, up to a
    /// positive factor.
    fn normal_matrix(&self) -> DMat3 {
        let [x, y, z] = [self.linear.x_axis, self.linear.y_axis, self.linear.z_axis];
        DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * self.linear.determinant().signum()
    }
}

/// Triangles of one material, in one place.
pub(super) struct Placed<'a> {
    pub(super) group: &'a Group,
    pub(super) placement: Placement,
    /// Index into the materials of the scene.
    pub(super) material: u32,
    pub(super) texcoords: Texcoords,
}

/// The buffers of [`halflight_core::scene::Mesh`].
#[derive(Debug, Default)]
pub(super) struct Geometry {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) texcoords: Vec<[f32; 2]>,
    pub(super) triangles: Vec<Triangle>,
}

/// The bounding box of all finite vertices.
pub(super) fn bounds(parts: &[Placed]) -> ([f64; 3], [f64; 3]) {
    const EMPTY: ([f64; 3], [f64; 3]) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let grow = |(min, max): ([f64; 3], [f64; 3]), (low, high): ([f64; 3], [f64; 3])| {
        let least = core::array::from_fn(|i| f64::min(min[i], low[i]));
        (least, core::array::from_fn(|i| f64::max(max[i], high[i])))
    };
    let of_part = |part: &Placed| {
        let placed = part.group.positions.iter().map(|&p| part.placement.point(p));
        placed.filter(is_usable).fold(EMPTY, |bounds, p| grow(bounds, (p, p)))
    };
    parts.par_iter().map(of_part).reduce(|| EMPTY, grow)
}

/// Puts everything into one mesh. The order of triangles is that of `parts`.
/// `pieces` is what [`pieces`] counts.
pub(super) fn assemble(parts: &[Placed], fit: &Fit, pieces: f64, notes: &mut Notes) -> Geometry {
    let with_normals = parts.iter().any(|part| !part.group.normals.is_empty());
    let with_texcoords = parts.iter().any(|part| !part.group.texcoords.is_empty());
    let cut = pieces > 0.0 && split::is_affordable(pieces);
    if pieces > 0.0 && !cut {
        notes.add(1, "very many triangles are very large: none is cut, and their shading is coarse");
    }
    let build = |part| build(part, fit, cut, with_normals, with_texcoords);
    let built: Vec<(Geometry, Repairs)> = parts.par_iter().map(build).collect();
    let mut all = Geometry::default();
    let vertices = built.iter().map(|(part, _)| part.positions.len()).sum();
    all.positions.reserve_exact(vertices);
    all.normals.reserve_exact(if with_normals { vertices } else { 0 });
    all.texcoords.reserve_exact(if with_texcoords { vertices } else { 0 });
    all.triangles.reserve_exact(built.iter().map(|(part, _)| part.triangles.len()).sum());
    let mut repairs = Repairs::default();
    for (part, of_part) in built {
        let first = all.positions.len() as u32;
        all.positions.extend(part.positions);
        all.normals.extend(part.normals);
        all.texcoords.extend(part.texcoords);
        let moved = |t: Triangle| Triangle { vertices: t.vertices.map(|v| v + first), ..t };
        all.triangles.extend(part.triangles.into_iter().map(moved));
        repairs.add(of_part);
    }
    notes.add(repairs.not_finite, "triangle with a vertex that is not finite left out");
    notes.add(repairs.without_area, "triangle without area left out");
    notes.add(repairs.broken_normals, "normal that is not finite is shaded flat");
    notes.add(repairs.broken_texcoords, "texture coordinate that is not finite is 0 0 now");
    notes.add(repairs.blurred_textures, texcoords::BLURRED);
    notes.add(
        repairs.too_far,
        "triangle that is smaller than 1e-5 of its distance from the detail of the scene: rounding bends it",
    );
    notes.add(repairs.against_winding, "triangle whose normals point against its winding (kept as it is)");
    all
}

#[derive(Clone, Copy, Debug, Default)]
struct Repairs {
    not_finite: u64,
    without_area: u64,
    broken_normals: u64,
    broken_texcoords: u64,
    blurred_textures: u64,
    against_winding: u64,
    too_far: u64,
}

impl Repairs {
    fn add(&mut self, other: Repairs) {
        self.not_finite += other.not_finite;
        self.without_area += other.without_area;
        self.broken_normals += other.broken_normals;
        self.broken_texcoords += other.broken_texcoords;
        self.blurred_textures += other.blurred_textures;
        self.against_winding += other.against_winding;
        self.too_far += other.too_far;
    }
}

fn is_usable(p: &[f64; 3]) -> bool {
    p.iter().all(|x| x.abs() <= LARGEST)
}

/// The corners of the triangles of a part, in the coordinates of the core; not numbers where they are of no use.
fn exact(part: &Placed, fit: &Fit) -> Vec<DVec3> {
    let place = |&p: &[f64; 3]| {
        let placed = part.placement.point(p);
        DVec3::from(if is_usable(&placed) { fit.transform.point_f64(placed) } else { [f64::NAN; 3] })
    };
    part.group.positions.iter().map(place).collect()
}

/// How many pieces, at most, those triangles become that are to be cut.
pub(super) fn pieces(parts: &[Placed], fit: &Fit) -> f64 {
    let of_part = |part: &Placed| {
        let exact = exact(part, fit);
        let counts = part.group.triangles.iter().map(|t| split::count(t.map(|v| exact[v as usize])));
        counts.filter(|count| *count > 1.0).sum::<f64>()
    };
    if fit.is_far { parts.iter().map(of_part).sum() } else { 0.0 }
}

/// A triangle smaller than this share of its coordinates is bent by rounding.
const BENT: f64 = 1e-5;

fn build(
    part: &Placed,
    fit: &Fit,
    cut: bool,
    with_normals: bool,
    with_texcoords: bool,
) -> (Geometry, Repairs) {
    let group = part.group;
    let mut repairs = Repairs::default();
    let exact = exact(part, fit);
    let rounded = |p: &DVec3| if p.is_nan() { [0.0; 3] } else { p.as_vec3().to_array() };
    let mut positions: Vec<[f32; 3]> = exact.iter().map(rounded).collect();
    let vertices = positions.len();

    let normal_matrix = part.placement.normal_matrix();
    let mut normal = |n: &[f64; 3]| unit_normal(normal_matrix * DVec3::from(*n), &mut repairs);
    let mut normals: Vec<[f32; 3]> = match (with_normals, group.normals.is_empty()) {
        (false, _) => Vec::new(),
        (true, true) => vec![[0.0; 3]; vertices],
        (true, false) => group.normals.iter().map(&mut normal).collect(),
    };

    let mut placed = part.texcoords.placed(&group.texcoords, &mut repairs.broken_texcoords);
    let mut texcoords: Vec<[f32; 2]> = match (with_texcoords, group.texcoords.is_empty()) {
        (false, _) => Vec::new(),
        (true, true) => vec![[0.0; 2]; vertices],
        (true, false) => placed.iter().map(|uv| uv.map(|x| x as f32)).collect(),
    };

    let mirrored = part.placement.linear.determinant() < 0.0;
    let mut triangles = Vec::with_capacity(group.triangles.len());
    for &[a, b, c] in &group.triangles {
        // A reflection turns the winding around; turned back, the front stays the front.
        let corners = if mirrored { [a, c, b] } else { [a, b, c] };
        let [p, q, r] = corners.map(|v| exact[v as usize]);
        let area = (q - p).cross(r - p);
        if !area.is_finite() {
            repairs.not_finite += 1;
        } else if area == DVec3::ZERO {
            repairs.without_area += 1;
        } else {
            let against = |v: u32| {
                normals.get(v as usize).is_some_and(|&n| area.dot(DVec3::from(n.map(f64::from))) < 0.0)
            };
            repairs.against_winding += u64::from(corners.iter().all(|&v| against(v)));
            if fit.is_far {
                let (low, high) = (p.min(q).min(r), p.max(q).max(r));
                let farthest = low.abs().max(high.abs()).max_element();
                repairs.too_far += u64::from((high - low).max_element() < BENT * farthest);
            }
            let material = part.material;
            if !(cut && split::count([p, q, r]) > 1.0) {
                triangles.push(Triangle { vertices: corners, material });
                continue;
            }
            for piece in split::pieces([p, q, r]) {
                let first = positions.len() as u32;
                for corner in &piece {
                    positions.push(rounded(&corner.position));
                    if with_normals {
                        normals.push(normal_between(corners.map(|v| normals[v as usize]), corner.weights));
                    }
                    if with_texcoords {
                        let ends = corners.map(|v| placed.get(v as usize).copied().unwrap_or_default());
                        let between: DVec2 = (0..3).map(|i| corner.weights[i] * DVec2::from(ends[i])).sum();
                        texcoords.push(between.as_vec2().to_array());
                        if !placed.is_empty() {
                            placed.push(between.into());
                        }
                    }
                }
                let fan = (1..piece.len() as u32 - 1).map(|i| [first, first + i, first + i + 1]);
                triangles.extend(fan.map(|vertices| Triangle { vertices, material }));
            }
        }
    }
    let mut geometry = Geometry { positions, normals, texcoords, triangles };
    repairs.blurred_textures = texcoords::take_whole_numbers_off(&part.texcoords, &placed, &mut geometry);
    (geometry, repairs)
}

/// The unit normal between three, or zero where one of them is.
fn normal_between(normals: [[f32; 3]; 3], weights: DVec3) -> [f32; 3] {
    let ends = normals.map(|n| DVec3::from(n.map(f64::from)));
    if ends.contains(&DVec3::ZERO) {
        return [0.0; 3];
    }
    let between: DVec3 = (0..3).map(|i| weights[i] * ends[i]).sum();
    between.normalize_or_zero().as_vec3().into()
}

/// The unit normal, or zero (flat) where there is none.
fn unit_normal(n: DVec3, repairs: &mut Repairs) -> [f32; 3] {
    let largest = n.abs().max_element();
    if !n.is_finite() {
        repairs.broken_normals += 1;
        return [0.0; 3];
    }
    if largest == 0.0 {
        return [0.0; 3];
    }
    (n / largest).normalize().as_vec3().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(positions: [[f64; 3]; 3]) -> Group {
        Group { positions: positions.to_vec(), triangles: vec![[0, 1, 2]], ..Group::default() }
    }

    fn placed(group: &Group, placement: Placement) -> Placed<'_> {
        Placed { group, placement, material: 0, texcoords: Texcoords::default() }
    }

    fn all(group: &Group, placement: Placement) -> (Geometry, Vec<String>) {
        let parts = [placed(group, placement)];
        let mut notes = Notes::default();
        let fit = Fit::of(&parts);
        (assemble(&parts, &fit, pieces(&parts, &fit), &mut notes), notes.sentences())
    }

    #[test]
    fn broken_triangles_are_left_out_and_said() {
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
    fn a_reflection_keeps_the_front() {
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
