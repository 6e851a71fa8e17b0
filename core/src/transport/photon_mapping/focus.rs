//! Focus of the light from infinity: a sphere around half of the surfaces that camera rays meet, or around
//! half of some points.

use crate::Level;
use crate::bvh::Bvh;
use crate::light::Focus;
use crate::scene::Scene;
use glam::Vec3;

/// Number of rays across and down.
const RAYS_PER_SIDE: u32 = 16;

/// Most points of a focus.
pub const FOCUS_POINTS: usize = (RAYS_PER_SIDE * RAYS_PER_SIDE) as usize;

/// Sphere around the median of the surfaces that the camera sees in a picture of `frame` pixels across and
/// down; `None` if it sees none.
pub fn visible_focus((scene, bvh): (&Scene, &Bvh), frame: [u32; 2], level: Level) -> Option<Focus> {
    let (mut points, mut count) = ([Vec3::ZERO; FOCUS_POINTS], 0);
    for i in 0..RAYS_PER_SIDE * RAYS_PER_SIDE {
        let at = |i: u32, pixels: u32| (i as f32 + 0.5) * pixels as f32 / RAYS_PER_SIDE as f32;
        let (x, y) = (at(i % RAYS_PER_SIDE, frame[0]), at(i / RAYS_PER_SIDE, frame[1]));
        let ray = scene.camera.ray(frame[0], frame[1], x, y, [0.5; 2]);
        let hit = bvh.nearest(level, &ray);
        if hit.is_some() {
            points[count] = Vec3::from(ray.origin) + hit.t * Vec3::from(ray.direction);
            count += 1;
        }
    }
    focus_on(points.get(..count)?)
}

/// Sphere around the median of `points`, of which there are at most [`FOCUS_POINTS`]; `None` without extent.
pub fn focus_on(points: &[Vec3]) -> Option<Focus> {
    let (mut values, count) = ([0.0; FOCUS_POINTS], points.len());
    let mut median = |value: &dyn Fn(&Vec3) -> f32| {
        let values = values.get_mut(..count)?;
        values.iter_mut().zip(points).for_each(|(slot, point)| *slot = value(point));
        (count > 0).then(|| *values.select_nth_unstable_by(count / 2, f32::total_cmp).1)
    };
    let center = Vec3::new(median(&|p| p.x)?, median(&|p| p.y)?, median(&|p| p.z)?);
    let radius = median(&|point| point.distance(center))?;
    (radius > 0.0 && radius.is_finite()).then_some(Focus { center, radius })
}
