//! What is searched: photons on the surfaces of a room, three tenths of them in the focus of a caustic, and places on
//! those surfaces from which they are looked for.

use glam::Vec3;

/// Share of the photons in the focus.
const FOCUS: f32 = 0.3;

/// Radius of the focus, in sides of the room.
const FOCUS_RADIUS: f32 = 0.05;

/// A place on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surfel {
    /// Where.
    pub place: Vec3,
    /// Of the surface.
    pub normal: Vec3,
}

/// Photons and queries, the same every time.
#[derive(Clone, Debug)]
pub struct Data {
    /// Where the photons lie, in the order in which they were shot.
    pub photons: Vec<Surfel>,
    /// From where they are looked for, in no order.
    pub queries: Vec<Surfel>,
}

impl Data {
    /// So many of each.
    pub fn new(photons: usize, queries: usize) -> Self {
        let mut random = Random(1);
        let in_focus = |random: &mut Random| random.unit() < FOCUS;
        let photon = |random: &mut Random| if in_focus(random) { focus(random) } else { surface(random) };
        Self {
            photons: (0..photons).map(|_| photon(&mut random)).collect(),
            queries: (0..queries).map(|_| surface(&mut random)).collect(),
        }
    }
}

/// Anywhere on the five walls of a unit room open towards +z, or on a ball in it, by area.
fn surface(random: &mut Random) -> Surfel {
    const BALL: f32 = 0.2;
    let ball_area = 4.0 * core::f32::consts::PI * BALL * BALL;
    let (pick, a, b) = (random.unit() * (5.0 + ball_area), random.unit(), random.unit());
    let (place, normal) = match pick as u32 {
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
            (Vec3::new(0.35, BALL, 0.4) + BALL * normal, normal)
        }
    };
    Surfel { place, normal }
}

/// On the floor, ever denser towards the middle of the focus.
fn focus(random: &mut Random) -> Surfel {
    let (sin, cos) = (core::f32::consts::TAU * random.unit()).sin_cos();
    let r = FOCUS_RADIUS * random.unit();
    Surfel { place: Vec3::new(0.7 + r * cos, 0.0, 0.6 + r * sin), normal: Vec3::Y }
}

/// A linear congruential generator: enough for points, and always the same.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }
}
