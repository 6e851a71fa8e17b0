//! Automatic camera for a scene without one: in front of the side of the bounding box from which the most is
//! visible.

use super::{Camera, Mesh};
use crate::geometry::Bounds;
use glam::{Vec2, Vec3};

/// Vertical field of view in degrees, equal to that of the measured Cornell box (a lens of 35 mm over a film
/// of 25 mm).
const FIELD_OF_VIEW: f32 = 39.3;

/// Free space around the box, as a fraction of it.
const MARGIN: f32 = 0.04;

/// View directions with their up vectors, in order of preference at equal visible area.
const VIEWS: [(Vec3, Vec3); 6] = [
    (Vec3::NEG_Z, Vec3::Y),
    (Vec3::Z, Vec3::Y),
    (Vec3::NEG_X, Vec3::Y),
    (Vec3::X, Vec3::Y),
    (Vec3::NEG_Y, Vec3::NEG_Z),
    (Vec3::Y, Vec3::Z),
];

/// Side in pixels of the pictures that rate the views.
const GRID: usize = 24;

/// Factor by which a later view must exceed an earlier one, and the front: glTF and exporters of OBJ turn the
/// front of a model towards +z.
const PREFERENCE_FACTOR: f32 = 1.05;
const FRONT_FACTOR: f32 = 1.3;

/// Weight of a vertical view, because most scenes stand upright.
const VERTICAL_WEIGHT: f32 = 0.6;

impl Camera {
    /// Camera that frames all of `mesh`, looking along that of the six axis directions from which the largest
    /// area of surface is visible. An open box is seen through its opening, with either winding of its walls.
    pub fn framing(mesh: &Mesh) -> Camera {
        let bounds = mesh.bounds();
        if bounds.is_empty() {
            return Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, FIELD_OF_VIEW);
        }
        let mut best = (0.0, in_front_of(&bounds, VIEWS[0].0, VIEWS[0].1));
        for (forward, up) in VIEWS {
            let camera = in_front_of(&bounds, forward, up);
            let weight = if forward.y == 0.0 { 1.0 } else { VERTICAL_WEIGHT };
            let seen = weight * visible_area(&camera, mesh, &bounds);
            if seen > best.0 {
                let factor = if forward == VIEWS[0].0 { FRONT_FACTOR } else { PREFERENCE_FACTOR };
                best = (factor * seen, camera);
            }
        }
        best.1
    }
}

/// Area visible to `camera`, which is outside `bounds`, in squares of their longest edge, by a small depth
/// buffer.
fn visible_area(camera: &Camera, mesh: &Mesh, bounds: &Bounds) -> f32 {
    let size = bounds.extent().max_element().max(f32::MIN_POSITIVE);
    let half = 0.5 * GRID as f32;
    let focal = half / camera.tan_half_fov;
    let mut nearest = [(0.0f32, 0.0f32); GRID * GRID]; // (1 / depth, area)
    let own = (0..mesh.triangles.len() as u32).map(|index| mesh.corners(index));
    let of_boxes = mesh.instances.placed.iter().flat_map(|instance| sides(mesh.instances.bounds(instance)));
    for corners in own.chain(of_boxes) {
        let [a, b, c] = corners.map(|p| (p - camera.eye) / size);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        let height = normal.dot(a).abs();
        let inverse = [a, b, c].map(|v| 1.0 / v.dot(camera.forward));
        let at = |v: Vec3, i: f32| Vec2::new(v.dot(camera.right), -v.dot(camera.up)) * (focal * i) + half;
        let [p, q, r] = [at(a, inverse[0]), at(b, inverse[1]), at(c, inverse[2])];
        let whole = (q - p).perp_dot(r - p);
        if whole == 0.0 || !whole.is_finite() || inverse.iter().any(|&i| i <= 0.0) {
            continue;
        }
        let (low, high) = (p.min(q).min(r).max(Vec2::ZERO), p.max(q).max(r));
        // Casts saturate. One pixel more than needed is tested and found outside.
        for y in low.y as usize..(high.y as usize + 1).min(GRID) {
            for x in low.x as usize..(high.x as usize + 1).min(GRID) {
                let pixel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let u = (pixel - p).perp_dot(r - p) / whole;
                let v = (q - p).perp_dot(pixel - p) / whole;
                if u < 0.0 || v < 0.0 || u + v > 1.0 {
                    continue;
                }
                let inverse_depth = (1.0 - u - v) * inverse[0] + u * inverse[1] + v * inverse[2];
                let place = &mut nearest[y * GRID + x];
                if inverse_depth > place.0 {
                    // A pixel of area 1 / focal² at depth 1 shows the area z³ / height of a plane. At grazing
                    // angles it counts for at most ten times its own cross section.
                    let depth = 1.0 / inverse_depth;
                    *place = (inverse_depth, depth * depth * depth / height.max(0.1 * depth));
                }
            }
        }
    }
    nearest.iter().map(|(_, area)| area).sum::<f32>() / (focal * focal)
}

/// The twelve triangles of a box, which stand for an instance.
fn sides(bounds: Bounds) -> impl Iterator<Item = [Vec3; 3]> {
    (0..12usize).map(move |i| {
        let (axis, end, half) = (i % 3, i / 3 % 2, i / 6);
        let corner = |u: usize, v: usize| {
            let mut at = [0; 3];
            (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (end, u, v);
            Vec3::from([0, 1, 2].map(|k| [bounds.min, bounds.max][at[k]][k]))
        };
        [corner(0, 0), corner(1, 1), corner(half, 1 - half)]
    })
}

fn in_front_of(bounds: &Bounds, forward: Vec3, up: Vec3) -> Camera {
    let camera = Camera::look_at(-forward, Vec3::ZERO, up, FIELD_OF_VIEW);
    let half = 0.5 * bounds.extent();
    let across = half.dot(camera.right.abs()).max(half.dot(camera.up.abs()));
    let depth = half.dot(forward.abs());
    // A flat scene seen edge-on still needs a distance.
    let wanted = (across * (1.0 + MARGIN)).max(0.05 * depth).max(f32::MIN_POSITIVE);
    let distance = depth + wanted / camera.tan_half_fov;
    Camera { eye: bounds.center() - distance * forward, focus_distance: distance, ..camera }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Triangle;
    use std::vec::Vec;

    /// Five walls of the unit cube; the sixth, towards -z or +z, is open.
    fn open_box(open: f32, inwards: bool) -> (Vec<[f32; 3]>, Vec<Triangle>) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for axis in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z * -open] {
            let (u, v) = axis.any_orthonormal_pair();
            let (u, v) = if (u.cross(v).dot(axis) > 0.0) == inwards { (v, u) } else { (u, v) };
            let first = positions.len() as u32;
            positions.extend([-u - v, u - v, u + v, v - u].map(|p| ((p + axis) * 0.5 + 3.0).to_array()));
            let quad = [[0, 1, 2], [0, 2, 3]];
            triangles.extend(quad.map(|t| Triangle { vertices: t.map(|i| first + i), material: 0 }));
        }
        (positions, triangles)
    }

    #[test]
    fn an_open_box_is_seen_through_its_opening() {
        for (open, inwards) in [(-1.0, true), (1.0, true), (-1.0, false), (1.0, false)] {
            let (positions, triangles) = open_box(open, inwards);
            let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
            let camera = Camera::framing(&mesh);
            assert!(camera.forward.distance(Vec3::Z * -open) < 1e-6, "{camera:?}");
            let corner = camera.project(100, 100, Vec3::new(2.5, 3.5, 3.0 + 0.5 * open), [0.5; 2]);
            let inside = |raster: Vec2| raster.cmpgt(Vec2::ZERO).all() && raster.max_element() < 100.0;
            assert!(corner.is_some_and(|corner| inside(corner.raster)));
        }
    }

    #[test]
    fn a_relief_before_a_plate_is_seen_from_its_front() {
        // From behind the plate hides all: its area alone is a little larger.
        let square =
            |half: f32, z: f32| [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]];
        let positions: Vec<[f32; 3]> = [square(1.0, 0.0), square(0.8, 0.1)].into_iter().flatten().collect();
        let faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let triangles = faces.map(|vertices| Triangle { vertices, material: 0 });
        let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
        assert_eq!(Camera::framing(&mesh).forward, Vec3::NEG_Z);
    }

    #[test]
    fn nothing_and_one_point_can_be_framed() {
        assert!(Camera::framing(&Mesh::default()).eye.is_finite());
        let point = [[1.0; 3]];
        let mesh = Mesh { positions: &point, ..Mesh::default() };
        assert!(Camera::framing(&mesh).eye.is_finite());
    }
}
