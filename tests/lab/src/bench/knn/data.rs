//! Photons and queries of the benchmark: photons on the surfaces of a room, three tenths of them in a
//! caustic, and queries at surface points.

use glam::Vec3;
use halflight_test_support::Random;

/// Fraction of the photons in the caustic.
const CAUSTIC: f32 = 0.3;

/// Radius of the caustic, in sides of the room.
const CAUSTIC_RADIUS: f32 = 0.05;

/// Point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surfel {
    /// Position in sides of the room.
    pub(super) position: Vec3,
    /// Unit normal.
    pub(super) normal: Vec3,
}

/// Photons and queries, the same in every run.
#[derive(Clone, Debug)]
pub(super) struct Data {
    /// Photons in the order of emission.
    pub(super) photons: Vec<Surfel>,
    /// Centres of the searches, in random order.
    pub(super) queries: Vec<Surfel>,
}

impl Data {
    /// Data with these counts.
    pub(super) fn new(photons: usize, queries: usize) -> Self {
        let mut random = Random(1);
        let photon = |random: &mut Random| match random.unit_f32() < CAUSTIC {
            true => caustic(random),
            false => surface(random),
        };
        Self {
            photons: (0..photons).map(|_| photon(&mut random)).collect(),
            queries: (0..queries).map(|_| surface(&mut random)).collect(),
        }
    }
}

/// Uniform point on the five walls of a unit room open towards +z and on a sphere in it.
fn surface(random: &mut Random) -> Surfel {
    const SPHERE: f32 = 0.2;
    let sphere_area = 4.0 * core::f32::consts::PI * SPHERE * SPHERE;
    let (pick, a, b) = (random.unit_f32() * (5.0 + sphere_area), random.unit_f32(), random.unit_f32());
    let (position, normal) = match pick as u32 {
        0 => (Vec3::new(a, 0.0, b), Vec3::Y),
        1 => (Vec3::new(a, 1.0, b), Vec3::NEG_Y),
        2 => (Vec3::new(0.0, a, b), Vec3::X),
        3 => (Vec3::new(1.0, a, b), Vec3::NEG_X),
        4 => (Vec3::new(a, b, 0.0), Vec3::Z),
        _ => {
            let z = 2.0 * a - 1.0;
            let (sin, cos) = (core::f32::consts::TAU * b).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            let normal = Vec3::new(r * cos, r * sin, z);
            (Vec3::new(0.35, SPHERE, 0.4) + SPHERE * normal, normal)
        }
    };
    Surfel { position, normal }
}

/// Point on the floor, denser towards the centre of the caustic.
fn caustic(random: &mut Random) -> Surfel {
    let (sin, cos) = (core::f32::consts::TAU * random.unit_f32()).sin_cos();
    let r = CAUSTIC_RADIUS * random.unit_f32();
    Surfel { position: Vec3::new(0.7 + r * cos, 0.0, 0.6 + r * sin), normal: Vec3::Y }
}
