//! Focus of the light from infinity. In a scene that is much larger than the part that the camera sees, next
//! to no line through the scene's bounding sphere passes that part. The density of lines then falls with
//! their distance d from its centre as 1 / (d² + r²), with the radius r of the part.

use crate::geometry::{Bounds, Frame};
use core::f32::consts::PI;
use glam::{Vec2, Vec3};

/// Radius of a scene over that of its visible part, above which lines are focused.
const LARGE: f32 = 8.0;

/// Sphere around half of the surfaces that a camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focus {
    /// Its centre.
    pub center: Vec3,
    /// Its radius, above 0.
    pub radius: f32,
}

/// Disc through which light from infinity enters the scene: perpendicular to the light, around a centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entrance {
    pub(super) center: Vec3,
    /// Radius of the disc.
    pub(super) radius: f32,
    /// Radius of the focus; zero if all points are alike.
    focus: f32,
    /// ln(1 + radius² / focus²).
    logarithm: f32,
    /// Box around the scene.
    bounds: Bounds,
}

impl Entrance {
    /// Disc that covers a bounding sphere, focused if the sphere is much larger than the `focus`.
    pub(super) fn new(center: Vec3, radius: f32, bounds: &Bounds, focus: Option<Focus>) -> Self {
        let even = Self { center, radius, focus: 0.0, logarithm: 0.0, bounds: *bounds };
        let Some(focus) = focus.filter(|focus| radius > LARGE * focus.radius) else { return even };
        let radius = radius + center.distance(focus.center);
        let ratio = radius / focus.radius;
        let logarithm = libm::log1pf(ratio * ratio);
        let is_finite = focus.radius > 0.0 && focus.center.is_finite() && logarithm.is_finite();
        let focused = Self { center: focus.center, radius, focus: focus.radius, logarithm, ..even };
        if is_finite { focused } else { even }
    }

    /// Point of the disc, relative to its centre, for a uniform point of the unit disc.
    pub(super) fn point(&self, unit: Vec2) -> Vec2 {
        if self.focus == 0.0 {
            return unit * self.radius;
        }
        let distance = self.focus * libm::sqrtf(libm::expm1f(unit.length_squared() * self.logarithm));
        unit.normalize_or_zero() * distance
    }

    /// Inverse of [`Entrance::point`]; `None` outside.
    pub(super) fn unit(&self, point: Vec2) -> Option<Vec2> {
        let distance = point.length();
        if distance > self.radius {
            return None;
        }
        if self.focus == 0.0 {
            return Some(point / self.radius);
        }
        let ratio = distance / self.focus;
        let part = libm::log1pf(ratio * ratio) / self.logarithm;
        Some(point.normalize_or_zero() * libm::sqrtf(part.min(1.0)))
    }

    /// Density of lines along unit `way` through `position`, per m² of the disc.
    pub(super) fn density(&self, way: Vec3, position: Vec3) -> f32 {
        if !self.is_focused() {
            return 1.0 / (PI * self.radius * self.radius);
        }
        let offset = position - self.center;
        self.density_at((offset - offset.dot(way) * way).length_squared())
    }

    /// Focused density at a squared distance from the centre.
    fn density_at(&self, squared: f32) -> f32 {
        1.0 / (PI * self.logarithm * (squared + self.focus * self.focus))
    }

    /// Area of which a photon at a `point` of the disc, relative to its centre, has the power.
    pub(super) fn area_of(&self, point: Vec2) -> f32 {
        match self.is_focused() {
            true => 1.0 / self.density_at(point.length_squared()),
            false => PI * self.radius * self.radius,
        }
    }

    /// Area of an even disc with the density of the centre.
    pub(super) fn area(&self) -> f64 {
        const PI: f64 = core::f64::consts::PI;
        match self.focus {
            0.0 => PI * f64::from(self.radius) * f64::from(self.radius),
            focus => PI * f64::from(self.logarithm) * f64::from(focus) * f64::from(focus),
        }
    }

    /// True if the density of lines is higher in a part of the scene.
    pub(super) fn is_focused(&self) -> bool {
        self.focus > 0.0
    }

    /// Start of the line along unit `way` through a `point` of the disc, relative to its centre; `None` if
    /// the line misses the scene. Focused lines start close to the scene's box: far away, rounding would
    /// bend them.
    pub(super) fn start(&self, way: Vec3, point: Vec2) -> Option<Vec3> {
        let frame = Frame::from_normal(way);
        if !self.is_focused() {
            return Some(self.center + frame.to_world(point.extend(-self.radius)));
        }
        let on = self.center + frame.to_world(point.extend(0.0));
        let Bounds { min, max } = self.bounds;
        let margin = 1e-5 * (max - min).max_element();
        let (mut enters, mut leaves) = (f32::NEG_INFINITY, f32::INFINITY);
        for axis in 0..3 {
            let (low, high) = (min[axis] - margin - on[axis], max[axis] + margin - on[axis]);
            if way[axis] == 0.0 {
                leaves = if low <= 0.0 && high >= 0.0 { leaves } else { f32::NEG_INFINITY };
            } else {
                let (a, b) = (low / way[axis], high / way[axis]);
                (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
            }
        }
        (enters <= leaves).then(|| on + enters * way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use crate::sampling::warp::concentric_disk;

    const FOCUS: Focus = Focus { center: Vec3::new(3.0, -2.0, 1.0), radius: 0.5 };

    fn entrance(focus: Option<Focus>) -> Entrance {
        let bounds = Bounds { min: Vec3::splat(-1000.0), max: Vec3::splat(1000.0) };
        Entrance::new(bounds.center(), 0.5 * bounds.diagonal(), &bounds, focus)
    }

    #[test]
    fn points_have_their_density_and_an_inverse() {
        for focus in [None, Some(FOCUS)] {
            let entrance = entrance(focus);
            let way = Vec3::new(0.3, -0.9, 0.2).normalize();
            let frame = Frame::from_normal(way);
            const COUNT: u32 = 1 << 16;
            let mut area = 0.0;
            for i in 0..COUNT {
                let unit = concentric_disk(Sampler::replicate(1, 0, 0, i).pair(0));
                let point = entrance.point(unit);
                let back = entrance.unit(point).unwrap_or(Vec2::INFINITY);
                assert!(back.distance(unit) < 1e-3, "{unit} {back}");
                let on = entrance.center + frame.to_world(point.extend(7.0));
                area += f64::from(1.0 / entrance.density(way, on)) / f64::from(COUNT);
            }
            let expected = core::f64::consts::PI * f64::from(entrance.radius) * f64::from(entrance.radius);
            assert!((area / expected - 1.0).abs() < 0.01, "{area} {expected}");
        }
    }

    #[test]
    fn focused_lines_pass_the_focus_and_start_outside_of_the_box() {
        let (focused, even) = (entrance(Some(FOCUS)), entrance(None));
        let way = Vec3::new(0.1, -1.0, 0.2).normalize();
        let mut near = [0, 0];
        for i in 0..1 << 12 {
            let unit = concentric_disk(Sampler::replicate(1, 0, 0, i).pair(0));
            for (near, entrance) in near.iter_mut().zip([&focused, &even]) {
                let Some(start) = entrance.start(way, entrance.point(unit)) else { continue };
                let offset = start - FOCUS.center;
                *near += u32::from((offset - offset.dot(way) * way).length() < FOCUS.radius);
                assert!(start.abs().max_element() > 1000.0);
            }
        }
        // ln 2 / ln (1 + (1735.9 / 0.5)²) of 4096 lines; four deviations.
        assert!((near[0] as f32 - 174.0).abs() < 53.0 && near[1] == 0, "{near:?}");
    }
}
