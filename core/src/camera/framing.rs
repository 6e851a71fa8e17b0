//! The camera for a scene that names none: in front of the side of the bounding box that sees the most.

use super::Camera;
use crate::geometry::Bounds;
use crate::scene::Mesh;
use glam::Vec3;

/// Vertical field of view in degrees: that of the camera of the measured Cornell box (a lens of 35 mm
/// over a film of 25 mm).
const FIELD_OF_VIEW: f32 = 39.3;

/// Free space around the box, as a fraction of it.
const MARGIN: f32 = 0.04;

/// Directions to look along, in order of preference where they see the same, with the up vector of each.
const VIEWS: [(Vec3, Vec3); 6] = [
    (Vec3::NEG_Z, Vec3::Y),
    (Vec3::Z, Vec3::Y),
    (Vec3::NEG_X, Vec3::Y),
    (Vec3::X, Vec3::Y),
    (Vec3::NEG_Y, Vec3::NEG_Z),
    (Vec3::Y, Vec3::Z),
];

impl Camera {
    /// Frames all of `mesh`, looking along one of the six axis directions: the one for which the area of
    /// the triangles that face the camera exceeds most the area of those that turn their back and hide
    /// what is behind them. An open box is seen through its opening.
    pub fn framing(mesh: &Mesh) -> Camera {
        let bounds =
            Bounds::around(mesh.positions.iter().map(|&p| p.into()).filter(|p: &Vec3| p.is_finite()));
        if bounds.is_empty() {
            return Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, FIELD_OF_VIEW);
        }
        let cameras = VIEWS.map(|(forward, up)| in_front_of(&bounds, forward, up));
        let mut seen = [0.0f64; VIEWS.len()];
        let size = bounds.extent().max_element().max(f32::MIN_POSITIVE);
        for index in 0..mesh.triangles.len() as u32 {
            let [a, b, c] = mesh.corners(index).map(|p| (p - bounds.center()) / size);
            let normal = (b - a).cross(c - a);
            if normal.is_finite() {
                for (seen, camera) in seen.iter_mut().zip(&cameras) {
                    let to_camera = (camera.eye - bounds.center()) / size - a;
                    *seen += f64::from(normal.length().copysign(normal.dot(to_camera)));
                }
            }
        }
        // A later view must see clearly more than an earlier one, not more by rounding.
        let best = (1..VIEWS.len())
            .fold(0, |best, i| if seen[i] > seen[best] + TIE * seen[best].abs() { i } else { best });
        cameras[best]
    }
}

/// Relative difference of areas below which two views see the same.
const TIE: f64 = 1e-3;

fn in_front_of(bounds: &Bounds, forward: Vec3, up: Vec3) -> Camera {
    let camera = Camera::look_at(-forward, Vec3::ZERO, up, FIELD_OF_VIEW);
    let half = 0.5 * bounds.extent();
    let across = half.dot(camera.right.abs()).max(half.dot(camera.up.abs()));
    let depth = half.dot(forward.abs());
    // A flat scene seen edge-on still has a distance.
    let wanted = (across * (1.0 + MARGIN)).max(0.05 * depth).max(f32::MIN_POSITIVE);
    let distance = depth + wanted / camera.tan_half_fov;
    Camera { eye: bounds.center() - distance * forward, focus_distance: distance, ..camera }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Triangle;
    use std::vec::Vec;

    /// Five walls of the unit cube that face inwards; the sixth, towards -z or +z, is open.
    fn open_box(open: f32) -> (Vec<[f32; 3]>, Vec<Triangle>) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for axis in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z * -open] {
            let (u, v) = axis.any_orthonormal_pair();
            let (u, v) = if u.cross(v).dot(axis) > 0.0 { (v, u) } else { (u, v) };
            let first = positions.len() as u32;
            positions.extend([-u - v, u - v, u + v, v - u].map(|p| ((p + axis) * 0.5 + 3.0).to_array()));
            let quad = [[0, 1, 2], [0, 2, 3]];
            triangles.extend(quad.map(|t| Triangle { vertices: t.map(|i| first + i), material: 0 }));
        }
        (positions, triangles)
    }

    #[test]
    fn an_open_box_is_seen_through_its_opening() {
        for open in [-1.0, 1.0] {
            let (positions, triangles) = open_box(open);
            let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
            let camera = Camera::framing(&mesh);
            assert!(camera.forward.distance(Vec3::Z * -open) < 1e-6, "{camera:?}");
            let corner = camera.project(100, 100, Vec3::new(2.5, 3.5, 3.0 + 0.5 * open), [0.5; 2]);
            assert!(corner.is_some_and(|c| c.raster.cmpgt(glam::Vec2::ZERO).all() && c.raster.max_element() < 100.0));
        }
    }

    #[test]
    fn nothing_and_one_point_can_be_framed() {
        assert!(Camera::framing(&Mesh::default()).eye.is_finite());
        let point = [[1.0; 3]];
        let mesh = Mesh { positions: &point, ..Mesh::default() };
        assert!(Camera::framing(&mesh).eye.is_finite());
    }
}
