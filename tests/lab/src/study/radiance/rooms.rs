//! Rooms of cuboids with diffuse surfaces, and the light that they reflect: from lamps, which rays do not
//! see, and from patches of sun, which are seen. The light of a surface is computed from sixteen points of
//! each light, so that it has no noise.

use glam::{DVec2, DVec3};
use halflight_test_support::{self as support, Random};

/// Cuboid on or above the floor, turned about the vertical through its centre.
struct Cuboid {
    centre: DVec3,
    half: DVec3,
    turn: DVec2,
    albedo: f64,
}

/// Rectangle that shines to one side.
struct Light {
    corner: DVec3,
    sides: [DVec3; 2],
    normal: DVec3,
    radiance: f64,
    /// False for a lamp, whose light the path of a gather ray finds elsewhere.
    is_seen: bool,
}

/// Room between the origin and `size`, seen from its floor z = 0.
pub(super) struct Room {
    size: DVec3,
    cuboids: Vec<Cuboid>,
    lights: Vec<Light>,
}

/// Albedo of the walls.
const ALBEDO: f64 = 0.7;
/// Irradiance of every surface from light that is not followed.
const AMBIENT: f64 = 0.05;
/// Points of a light along a side.
const POINTS: usize = 4;

/// Nearest surface along a ray.
struct Hit {
    t: f64,
    normal: DVec3,
    albedo: f64,
}

impl Cuboid {
    fn new(low: [f64; 3], high: [f64; 3], turn: f64, albedo: f64) -> Self {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        Self { centre: 0.5 * (low + high), half: 0.5 * (high - low), turn: DVec2::from_angle(turn), albedo }
    }

    /// Vector in the frame of the cuboid.
    fn local(&self, v: DVec3) -> DVec3 {
        let back = DVec2::new(self.turn.x, -self.turn.y);
        back.rotate(v.truncate()).extend(v.z)
    }

    /// True if a point is inside.
    fn holds(&self, point: DVec3) -> bool {
        self.local(point - self.centre).abs().cmple(self.half + 0.002).all()
    }

    /// Nearest hit from outside, and its normal.
    fn hit(&self, from: DVec3, w: DVec3) -> Option<(f64, DVec3)> {
        let (from, w) = (self.local(from - self.centre), self.local(w));
        let (a, b) = ((-self.half - from) / w, (self.half - from) / w);
        let (near, far) = (a.min(b), a.max(b));
        let t = near.max_element();
        if !(t > 0.0 && t < far.min_element()) {
            return None;
        }
        let axis = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().find(|axis| near.dot(*axis) == t)?;
        let normal = -axis * w.dot(axis).signum();
        Some((t, self.turn.rotate(normal.truncate()).extend(normal.z)))
    }
}

impl Light {
    fn new(corner: [f64; 3], sides: [[f64; 3]; 2], radiance: f64, is_seen: bool) -> Self {
        let sides = sides.map(DVec3::from);
        let normal = sides[0].cross(sides[1]).normalize();
        Self { corner: corner.into(), sides, normal, radiance, is_seen }
    }

    /// True if a point of its plane is on the rectangle.
    fn holds(&self, point: DVec3) -> bool {
        let from = point - self.corner;
        let [u, v] = self.sides.map(|side| from.dot(side) / side.length_squared());
        from.dot(self.normal).abs() < 1e-6 && (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)
    }
}

impl Room {
    /// The rooms of the study.
    pub(super) fn all() -> [Room; 3] {
        let lamp = Light::new([0.35, 0.35, 0.999], [[0.0, 0.3, 0.0], [0.3, 0.0, 0.0]], 15.0, false);
        // A box with two blocks.
        let cornell = Room {
            size: DVec3::ONE,
            cuboids: vec![
                Cuboid::new([0.15, 0.5, 0.0], [0.45, 0.8, 0.6], 0.3, 0.7),
                Cuboid::new([0.55, 0.2, 0.0], [0.85, 0.5, 0.3], -0.3, 0.3),
            ],
            lights: vec![lamp],
        };
        let leg = |x: f64, y: f64| Cuboid::new([x, y, 0.0], [x + 0.03, y + 0.03, 0.35], 0.0, 0.3);
        // A table between patches of sun on the floor and on a wall.
        let sun = Room {
            size: DVec3::new(1.6, 1.2, 0.8),
            cuboids: vec![
                Cuboid::new([0.7, 0.5, 0.35], [1.2, 0.9, 0.38], 0.0, 0.3),
                leg(0.72, 0.52),
                leg(1.15, 0.52),
                leg(0.72, 0.85),
                leg(1.15, 0.85),
            ],
            lights: vec![
                Light::new([0.25, 0.25, 0.0], [[0.4, 0.1, 0.0], [-0.05, 0.3, 0.0]], 4.0, true),
                Light::new([1.6, 0.2, 0.15], [[0.0, 0.0, 0.4], [0.0, 0.3, 0.0]], 4.0, true),
            ],
        };
        let column = |i: u16| {
            let x = 0.4 + 0.5 * f64::from(i);
            Cuboid::new([x, 0.35, 0.0], [x + 0.12, 0.47, 1.0], 0.0, 0.5)
        };
        // Columns before a lit wall.
        let colonnade = Room {
            size: DVec3::new(2.8, 1.0, 1.0),
            cuboids: (0..5).map(column).collect(),
            lights: vec![Light::new([0.2, 0.75, 0.999], [[0.0, 0.2, 0.0], [2.4, 0.0, 0.0]], 6.0, false)],
        };
        [cornell, sun, colonnade]
    }

    /// A point of the floor outside of all cuboids.
    pub(super) fn receiver(&self, random: &mut Random) -> DVec3 {
        loop {
            let at = DVec3::new(random.unit(), random.unit(), 0.0) * (self.size - 0.04)
                + DVec3::new(0.02, 0.02, 0.0);
            if self.is_free(at) {
                return at.with_z(0.0);
            }
        }
    }

    /// True for a point outside of all cuboids.
    pub(super) fn is_free(&self, at: DVec3) -> bool {
        !self.cuboids.iter().any(|cuboid| cuboid.holds(at))
    }

    /// Radiance reflected towards `from` along the unit vector `w`, and the distance.
    pub(super) fn radiance(&self, from: DVec3, w: DVec3) -> (f64, f64) {
        let Hit { t, normal, albedo } = self.nearest(from, w);
        let point = from + t * w;
        let patch = self.lights.iter().find(|light| light.is_seen && light.holds(point));
        if let Some(light) = patch.filter(|light| light.normal.dot(w) < 0.0) {
            return (light.radiance, t);
        }
        let mut irradiance = AMBIENT;
        for light in &self.lights {
            let [u, v] = light.sides;
            let area = u.cross(v).length() / (POINTS * POINTS) as f64;
            for at in 0..POINTS * POINTS {
                let [s, t] = [at % POINTS, at / POINTS].map(|k| (k as f64 + 0.5) / POINTS as f64);
                let to_light = light.corner + s * u + t * v - point;
                let (squared, towards) = (to_light.length_squared(), to_light.normalize());
                let cosines = normal.dot(towards).max(0.0) * (-light.normal.dot(towards)).max(0.0);
                if cosines > 0.0 && !self.is_hidden(point + 1e-6 * normal, to_light) {
                    irradiance += light.radiance * cosines * area / squared.max(1e-4);
                }
            }
        }
        (albedo * irradiance / core::f64::consts::PI, t)
    }

    /// Surface that the ray along the unit vector `w` meets.
    pub(super) fn hit(&self, from: DVec3, w: DVec3) -> support::Hit {
        let (radiance, distance) = self.radiance(from, w);
        support::Hit { radiance, inverse: 1.0 / distance, normal: self.nearest(from, w).normal }
    }

    /// Length along x.
    pub(super) fn width(&self) -> f64 {
        self.size.x
    }

    /// Half of the diagonal.
    pub(super) fn extent(&self) -> f64 {
        0.5 * self.size.length()
    }

    /// True if a cuboid hides the end of `segment`.
    fn is_hidden(&self, from: DVec3, segment: DVec3) -> bool {
        self.cuboids.iter().any(|cuboid| cuboid.hit(from, segment).is_some_and(|(t, _)| t < 1.0 - 1e-6))
    }

    fn nearest(&self, from: DVec3, w: DVec3) -> Hit {
        // Walls, from inside.
        let exits = (-from / w).max((self.size - from) / w);
        let t = exits.min_element();
        let axis = if exits.x == t {
            DVec3::X
        } else if exits.y == t {
            DVec3::Y
        } else {
            DVec3::Z
        };
        let walls = Hit { t, normal: -axis * w.dot(axis).signum(), albedo: ALBEDO };
        self.cuboids.iter().fold(walls, |nearest, cuboid| match cuboid.hit(from, w) {
            Some((t, normal)) if t < nearest.t => Hit { t, normal, albedo: cuboid.albedo },
            _ => nearest,
        })
    }
}
