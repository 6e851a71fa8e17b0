//! Cameras with a long lens very far from the scene: relative to the eye, f32 would round the visible
//! surfaces. Their rays start on a plane before all visible surfaces, where coordinates are small.

use core::f64::consts::FRAC_PI_4;
use glam::{DVec3, Vec3};
use halflight_core::geometry::Bounds;
use halflight_core::scene::{Camera, CameraKind, Mesh, StartPlane};

/// Tangent of half the field of view of a long lens, at most.
const LONG: f32 = 1e-3;

/// Largest ratio of the width of a picture to its height.
const WIDEST: f64 = 32.0;

/// The plane is used if it is this many times nearer to the origin than the eye.
const NEARER: f64 = 64.0;

/// Distance of the plane from the first visible surface: this part of the way, plus the size of the detail.
const MARGIN: f64 = 1e-5;

/// Start of the rays of `camera`, which is at `eye` and looks `along` a unit vector; `None`: the eye.
pub(super) fn start(mesh: &Mesh, camera: &Camera, eye: DVec3, along: DVec3) -> Option<StartPlane> {
    if camera.tan_half_fov > LONG || camera.kind != CameraKind::Perspective {
        return None;
    }
    let [right, up] = [camera.right, camera.up].map(Vec3::as_dvec3);
    let (slope, lens) = (WIDEST * f64::from(camera.tan_half_fov), f64::from(camera.lens_radius));
    // Half-spaces around the visible volume before the plane in focus.
    let focus = if lens > 0.0 { f64::from(camera.focus_distance) } else { f64::INFINITY };
    let slope = slope - lens / focus;
    let sides: [DVec3; 8] = core::array::from_fn(|i| {
        let (sin, cos) = (i as f64 * FRAC_PI_4).sin_cos();
        cos * right + sin * up - slope * along
    });
    let depth = |corners: &[Vec3]| {
        let from_eye = |corner: &Vec3| corner.as_dvec3() - eye;
        let is_outside = |side: &DVec3| corners.iter().all(|corner| from_eye(corner).dot(*side) > lens);
        let depths = corners.iter().map(|corner| from_eye(corner).dot(along));
        let is_visible = depths.clone().any(|depth| depth > 0.0) && !sides.iter().any(is_outside);
        is_visible.then(|| depths.fold(f64::INFINITY, f64::min))
    };
    let triangles = (0..mesh.triangles.len() as u32).filter_map(|index| depth(&mesh.corners(index)));
    let of_box = |Bounds { min, max }: Bounds| {
        depth(&[0, 1, 2, 3, 4, 5, 6, 7].map(|i| Vec3::from([0, 1, 2].map(|k| [min, max][i >> k & 1][k]))))
    };
    let instances = &mesh.instances;
    let boxes = instances.placed.iter().filter_map(|instance| of_box(instances.bounds(instance)));
    let first = triangles.chain(boxes).fold(focus, f64::min);
    let depth = first - MARGIN * first - 1.0;
    let anchor = eye + depth * along;
    let is_useful = depth > 0.0 && depth < f64::INFINITY && NEARER * anchor.length() < eye.length();
    is_useful.then(|| StartPlane { anchor: anchor.as_vec3(), depth: depth as f32 })
}
