//! A camera with a long lens that stands very far away: seen from the eye, f32 would round what it looks at. Its rays start
//! on a plane before all that it sees, where coordinates are small.

use super::scene::{LoadedScene, View};
use super::transform::direction;
use core::f64::consts::FRAC_PI_4;
use glam::{DVec3, Vec3};
use halflight_core::scene::Camera;
use halflight_core::scene::StartPlane;

/// Tangent of half of the field of view below which a lens is long.
const LONG: f32 = 1e-3;

/// Pictures are at most this many times as wide as high.
const WIDEST: f64 = 32.0;

/// The plane is worth it where it is this many times nearer to the origin than the eye.
const NEARER: f64 = 64.0;

/// The plane is this share of the way, and as much as what is fine is across, before what is seen first.
const MARGIN: f64 = 1e-5;

/// Where the rays of `camera`, which stands at `view`, start; `None` at the eye.
pub(super) fn start(scene: &LoadedScene, camera: &Camera, view: View) -> Option<StartPlane> {
    if camera.tan_half_fov > LONG {
        return None;
    }
    let along = direction(view.eye, view.look_at)?;
    let eye = DVec3::from(scene.transform.point_f64(view.eye));
    let [right, up] = [camera.right, camera.up].map(Vec3::as_dvec3);
    let (slope, lens) = (WIDEST * f64::from(camera.tan_half_fov), f64::from(camera.lens_radius));
    // Half-spaces around all that the camera sees before what is sharp.
    let focus = if lens > 0.0 { f64::from(camera.focus_distance) } else { f64::INFINITY };
    let slope = slope - lens / focus;
    let sides: [DVec3; 8] = core::array::from_fn(|i| {
        let (sin, cos) = (i as f64 * FRAC_PI_4).sin_cos();
        cos * right + sin * up - slope * along
    });
    let mesh = scene.mesh();
    let depth = |index: u32| {
        let corners = mesh.corners(index).map(|corner| corner.as_dvec3() - eye);
        let is_outside = |side: &DVec3| corners.iter().all(|corner| corner.dot(*side) > lens);
        let depths = corners.map(|corner| corner.dot(along));
        let is_seen = depths.iter().any(|depth| *depth > 0.0) && !sides.iter().any(is_outside);
        is_seen.then(|| depths.into_iter().fold(f64::INFINITY, f64::min))
    };
    let first = (0..mesh.triangles.len() as u32).filter_map(depth).fold(focus, f64::min);
    let depth = first - MARGIN * first - 1.0;
    let anchor = eye + depth * along;
    let is_worth_it = depth > 0.0 && depth < f64::INFINITY && NEARER * anchor.length() < eye.length();
    is_worth_it.then(|| StartPlane { anchor: anchor.as_vec3(), depth: depth as f32 })
}
