//! Points on surfaces that the camera sees, or that light them.

use super::Built;
use glam::Vec3;
use halflight_core::geometry::{Frame, Ray};
use halflight_core::sampling::warp::cosine_hemisphere;
use halflight_core::{IrradiancePoint, Level};
use halflight_test_support::Random;

/// Size of the picture whose pixels camera rays pass.
const SIZE: u32 = 512;

/// Camera rays for each point, at most.
const RAYS: usize = 64;

/// At most `count` points of `built` on surfaces that do not emit.
pub(super) fn lit(built: &Built, count: usize, seed: u64) -> Vec<IrradiancePoint> {
    let mut random = Random(seed);
    let mut points = Vec::with_capacity(count);
    for number in 0..RAYS * count {
        let [x, y] = [0, 1].map(|_| random.unit_f32() * SIZE as f32);
        let ray = built.scene.camera.ray(SIZE, SIZE, x, y, [0.5; 2]);
        let Some((point, emits)) = hit(built, &ray) else { continue };
        let found = if number % 2 == 0 {
            Some((point, emits))
        } else {
            let frame = Frame::from_normal(point.geometric_normal.into());
            let direction = frame.to_world(cosine_hemisphere([0, 1].map(|_| random.unit_f32())));
            let origin = Vec3::from(point.position) + point.error * Vec3::from(point.geometric_normal);
            hit(built, &Ray::new(origin, direction))
        };
        if let Some((point, false)) = found {
            points.push(point);
        }
        if points.len() == count {
            break;
        }
    }
    points
}

/// The surface that `ray` meets, on the side of the ray, and whether it emits.
fn hit(built: &Built, ray: &Ray) -> Option<(IrradiancePoint, bool)> {
    let hit = built.bvh.nearest(Level::detect(), ray);
    let point = |front| IrradiancePoint::on_triangle(built.scene, hit.triangle, [hit.u, hit.v], front);
    let front = point(true)?;
    let is_front = Vec3::from(front.geometric_normal).dot(Vec3::from(ray.direction)) < 0.0;
    let material = built.scene.mesh.triangles.get(hit.triangle as usize)?.material;
    let emits = built.scene.materials.get(material as usize)?.emits();
    Some((if is_front { front } else { point(false)? }, emits))
}
