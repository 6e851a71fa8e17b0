//! Unit rooms with exact light on the black floor z = 0: walls, ceiling and a patch of the ceiling shine, a
//! square in the air hides them.

use crate::polygon::{above, behind, irradiance, normal};
use crate::rays::Hit;
use glam::{DVec2, DVec3};

/// Square of the ceiling.
#[derive(Clone, Copy, Debug)]
pub struct CeilingPatch {
    /// Lowest corner.
    pub corner: DVec2,
    /// Length of a side.
    pub side: f64,
    /// Radiance, in place of that of the ceiling.
    pub radiance: f64,
}

/// Black square in the air, parallel to the floor, and turned: aligned with the walls, its edges would cross
/// theirs all at once, and the irradiance would have kinks.
#[derive(Clone, Copy, Debug)]
pub struct FloatingSquare {
    /// Centre.
    pub centre: DVec3,
    /// Length of a side.
    pub side: f64,
}

/// Unit room, seen from its floor.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// Radiance of the walls x = 0, x = 1, y = 0, y = 1 and of the ceiling.
    pub walls: [f64; 5],
    /// Bright part of the ceiling.
    pub patch: Option<CeilingPatch>,
    /// Occluder.
    pub square: Option<FloatingSquare>,
    /// True if walls and ceiling are at infinity, as a sky.
    pub is_sky: bool,
}

/// Rotation of the square, radians.
const SKEW: f64 = 0.4;

/// Polygon, counter-clockwise as seen from a receiver at the origin.
type Polygon = Vec<DVec3>;

impl Room {
    /// Walls, ceiling and patch as seen from `at` on the floor, each with the radiance that it adds to the
    /// polygons before it.
    pub fn polygons(&self, at: DVec2) -> Vec<(Polygon, f64)> {
        let [west, east, south, north, ceiling] = self.walls;
        let upright = |a: DVec2, b: DVec2| [a.extend(0.0), b.extend(0.0), b.extend(1.0), a.extend(1.0)];
        let mut polygons = vec![
            (seen(upright(DVec2::ZERO, DVec2::Y), at), west),
            (seen(upright(DVec2::X, DVec2::ONE), at), east),
            (seen(upright(DVec2::ZERO, DVec2::X), at), south),
            (seen(upright(DVec2::Y, DVec2::ONE), at), north),
            (seen(flat(DVec2::ZERO, 1.0, 1.0), at), ceiling),
        ];
        polygons.extend(self.patch.map(|CeilingPatch { corner, side, radiance }| {
            (seen(flat(corner, side, 1.0), at), radiance - ceiling)
        }));
        polygons
    }

    /// Occluder as seen from `at`.
    pub fn occluder(&self, at: DVec2) -> Option<Polygon> {
        let FloatingSquare { centre, side } = self.square?;
        let corners = flat(DVec2::splat(-0.5 * side), side, 0.0);
        let turned = corners.map(|p| centre + DVec2::from_angle(SKEW).rotate(p.truncate()).extend(0.0));
        Some(seen(turned, at))
    }

    /// Irradiance on the floor.
    pub fn irradiance(&self, at: DVec2) -> f64 {
        self.irradiance_of(at, DVec3::Z)
    }

    /// Irradiance of a receiver with the unit normal `n`.
    pub fn irradiance_of(&self, at: DVec2, n: DVec3) -> f64 {
        let of = |polygon: &[DVec3]| irradiance(&above(polygon, n), n);
        let square = self.occluder(at);
        let hidden = |polygon: &[DVec3]| square.as_ref().map_or(0.0, |square| of(&behind(square, polygon)));
        self.polygons(at).iter().map(|(polygon, radiance)| radiance * (of(polygon) - hidden(polygon))).sum()
    }

    /// Gradient and Hessian of the irradiance by central differences: x, y, xx, xy, yy.
    pub fn derivatives(&self, at: DVec2) -> [f64; 5] {
        const H: f64 = 1e-3;
        let e = |i: f64, j: f64| self.irradiance(at + H * DVec2::new(i, j));
        [
            (e(1.0, 0.0) - e(-1.0, 0.0)) / (2.0 * H),
            (e(0.0, 1.0) - e(0.0, -1.0)) / (2.0 * H),
            (e(1.0, 0.0) - 2.0 * e(0.0, 0.0) + e(-1.0, 0.0)) / (H * H),
            (e(1.0, 1.0) - e(1.0, -1.0) - e(-1.0, 1.0) + e(-1.0, -1.0)) / (4.0 * H * H),
            (e(0.0, 1.0) - 2.0 * e(0.0, 0.0) + e(0.0, -1.0)) / (H * H),
        ]
    }

    /// Surface that the ray from `at` on the floor along the unit vector `w` meets.
    pub fn hit(&self, at: DVec2, w: DVec3) -> Hit {
        if let Some(FloatingSquare { centre, side }) = self.square {
            let t = centre.z / w.z;
            let from_centre = DVec2::from_angle(-SKEW).rotate(at + t * w.truncate() - centre.truncate());
            if from_centre.abs().max_element() < 0.5 * side {
                return Hit { radiance: 0.0, inverse: 1.0 / t, normal: DVec3::NEG_Z };
            }
        }
        let [west, east, south, north, ceiling] = self.walls;
        let along = |x: f64, d: f64, low: f64, high: f64| match d < 0.0 {
            true => (-x / d, low),
            false => ((1.0 - x) / d, high),
        };
        let (tx, of_x) = along(at.x, w.x, west, east);
        let (ty, of_y) = along(at.y, w.y, south, north);
        let tz = 1.0 / w.z;
        let (t, radiance, normal) = if tz <= tx.min(ty) {
            let is_inside = |patch: &CeilingPatch| {
                let from_corner = at + tz * w.truncate() - patch.corner;
                from_corner.min_element() >= 0.0 && from_corner.max_element() < patch.side
            };
            let patch = self.patch.filter(is_inside);
            (tz, patch.map_or(ceiling, |patch| patch.radiance), DVec3::NEG_Z)
        } else if tx < ty {
            (tx, of_x, DVec3::NEG_X * w.x.signum())
        } else {
            (ty, of_y, DVec3::NEG_Y * w.y.signum())
        };
        Hit { radiance, inverse: if self.is_sky { 0.0 } else { 1.0 / t }, normal }
    }
}

/// Corners of a square at the height `z`.
fn flat(corner: DVec2, side: f64, z: f64) -> [DVec3; 4] {
    [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y].map(|at| (corner + side * at).extend(z))
}

/// Corners from `at` on the floor, counter-clockwise as seen from there.
fn seen(corners: [DVec3; 4], at: DVec2) -> Polygon {
    let mut corners = corners.map(|corner| corner - at.extend(0.0)).to_vec();
    if normal(&corners).dot(corners[0]) < 0.0 {
        corners.reverse();
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polygon::distance;
    use core::f64::consts::PI;

    const ROOM: Room = Room {
        walls: [1.0, 0.2, 0.5, 0.8, 0.3],
        patch: Some(CeilingPatch { corner: DVec2::new(0.6, 0.55), side: 0.2, radiance: 10.0 }),
        square: Some(FloatingSquare { centre: DVec3::new(0.45, 0.5, 0.4), side: 0.3 }),
        is_sky: false,
    };

    #[test]
    fn a_room_of_one_radiance_has_pi_times_the_radiance() {
        let room = Room { walls: [0.7; 5], patch: None, square: None, is_sky: false };
        for at in [DVec2::new(0.2, 0.3), DVec2::new(0.9, 0.5)] {
            assert!((room.irradiance(at) - 0.7 * PI).abs() < 1e-12);
            assert!(room.derivatives(at).iter().all(|derivative| derivative.abs() < 1e-8));
        }
    }

    /// 400 × 400 rays by Malley's method; the noise of their strata is below a thousandth.
    #[test]
    fn irradiance_is_the_mean_radiance_of_cosine_distributed_rays() {
        const SIDE: usize = 400;
        for (at, room) in [(DVec2::new(0.3, 0.4), ROOM), (DVec2::new(0.8, 0.7), ROOM)] {
            let mut sum = 0.0;
            for ray in 0..SIDE * SIDE {
                let [u, v] = [ray % SIDE, ray / SIDE].map(|k| (k as f64 + 0.5) / SIDE as f64);
                let (sin, cos) = (2.0 * PI * v).sin_cos();
                let r = u.sqrt();
                sum += room.hit(at, DVec3::new(r * cos, r * sin, (1.0 - u).sqrt())).radiance;
            }
            let (found, exact) = (PI * sum / (SIDE * SIDE) as f64, room.irradiance(at));
            assert!((found / exact - 1.0).abs() < 2e-3, "{at}: {found} {exact}");
        }
    }

    #[test]
    fn rays_meet_the_nearest_polygon() {
        let at = DVec2::new(0.35, 0.6);
        for ray in 0..500 {
            let (z, angle) = ((f64::from(ray) + 0.5) / 500.0, 2.4 * f64::from(ray));
            let w = (DVec2::from_angle(angle) * (1.0 - z * z).sqrt()).extend(z);
            let all = ROOM.polygons(at).into_iter().chain(ROOM.occluder(at).map(|square| (square, 0.0)));
            let nearest = all.filter_map(|(polygon, _)| distance(&polygon, w)).fold(f64::INFINITY, f64::min);
            assert!((ROOM.hit(at, w).inverse * nearest - 1.0).abs() < 1e-9, "{w}");
        }
    }
}
