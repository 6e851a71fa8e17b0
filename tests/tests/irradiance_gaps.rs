//! Records do not leak into gaps: behind a picture, beneath a bench and above a board under the ceiling the
//! cache agrees with path tracing, however narrow the gap is relative to the room.

use glam::Vec3;
use halflight::render::{Method, RenderResult};
use halflight_core::Rgb;
use halflight_core::scene::Camera;
use halflight_core::scene::{Material, Scene};
use halflight_tests::references::reference;
use halflight_tests::render::render;
use halflight_tests::scenes::{SceneBuffers, emitter};

const SIZE: u32 = 48;

/// A room of 4 x 3 x 4 with a lamp, and a board at distance `gap` from one wall.
struct Slot {
    /// Axis of the wall's normal; then its coordinate on that axis, and the sign of the inward direction.
    axis: usize,
    wall: f32,
    inside: f32,
    gap: f32,
    /// Corners of the board along the other two axes.
    low: Vec3,
    high: Vec3,
    eye: Vec3,
    target: Vec3,
}

impl Slot {
    fn buffers(&self) -> SceneBuffers {
        let camera = Camera::look_at(self.eye, self.target, Vec3::Y, 20.0);
        let mut buffers = SceneBuffers::new(camera);
        let white = buffers.material(Material::diffuse(Rgb::new(0.73, 0.7, 0.65)));
        let board = buffers.material(Material::diffuse(Rgb::new(0.5, 0.3, 0.2)));
        let lamp = buffers.material(emitter(0.0, 10.0));
        buffers.cuboid(Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 3.0, 2.0), true, white);
        // The lamp hangs in the middle, away from all walls.
        buffers.square(Vec3::new(0.0, 1.7, 0.8), Vec3::NEG_Y, 0.6, lamp);
        buffers.square(Vec3::new(0.0, 1.701, 0.8), Vec3::Y, 0.6, lamp);
        let (mut low, mut high) = (self.low, self.high);
        let [near, far] = [self.gap, self.gap + 0.02].map(|height| self.wall + self.inside * height);
        (low[self.axis], high[self.axis]) = (near.min(far), near.max(far));
        buffers.cuboid(low, high, false, board);
        buffers
    }

    /// Whether the centre of a pixel shows the wall behind the board.
    fn is_behind(&self, scene: &Scene, [x, y]: [u32; 2]) -> bool {
        let camera = &scene.camera;
        let at = |i: u32| (2.0 * (i as f32 + 0.5) / SIZE as f32 - 1.0) * camera.tan_half_fov;
        let direction = camera.forward + at(x) * camera.right - at(y) * camera.up;
        let covers = |height: f32| {
            let along = (self.wall + self.inside * height - self.eye[self.axis]) / direction[self.axis];
            let place = self.eye + along * direction;
            let holds = |k: usize| k == self.axis || (self.low[k]..self.high[k]).contains(&place[k]);
            along > 0.0 && (0..3).all(holds)
        };
        covers(0.0) && !covers(self.gap) && !covers(self.gap + 0.02)
    }

    /// Mean of green over the pixels of the gap.
    fn light(&self, scene: &Scene, result: &RenderResult) -> f64 {
        let pixels = (0..SIZE * SIZE).zip(&result.image.pixels);
        let behind = pixels.filter(|(i, _)| self.is_behind(scene, [i % SIZE, i / SIZE]));
        let values: Vec<f64> = behind.map(|(_, pixel)| f64::from(pixel[1])).collect();
        assert!(values.len() > 20, "{} pixels of a gap of {}", values.len(), self.gap);
        values.iter().sum::<f64>() / values.len() as f64
    }
}

/// A picture on the wall seen from the side, a bench on the floor, a board under the ceiling.
fn slots(gap: f32) -> [Slot; 3] {
    let picture = Slot {
        axis: 2,
        wall: -2.0,
        inside: 1.0,
        gap,
        low: Vec3::new(-0.5, 1.0, 0.0),
        high: Vec3::new(0.5, 2.0, 0.0),
        eye: Vec3::new(-1.5, 1.5, -2.0 + 0.3 + gap),
        target: Vec3::new(-0.5, 1.5, -2.0),
    };
    let bench = Slot {
        axis: 1,
        wall: 0.0,
        inside: 1.0,
        gap,
        low: Vec3::new(-0.8, 0.0, -1.0),
        high: Vec3::new(0.8, 0.0, 0.0),
        eye: Vec3::new(0.0, 0.3 + gap, 1.2),
        target: Vec3::ZERO,
    };
    let board = Slot {
        axis: 1,
        wall: 3.0,
        inside: -1.0,
        gap,
        low: Vec3::new(-0.6, 0.0, -1.2),
        high: Vec3::new(0.6, 0.0, -0.2),
        eye: Vec3::new(0.3, 2.6 - gap, 1.0),
        target: Vec3::new(0.0, 3.0, -0.2),
    };
    [picture, bench, board]
}

/// Slots as in [`slots`] and a wardrobe beside a wall, seen along the gap from 0.05 + 4 `gap` away.
fn slots_from_near(gap: f32) -> [Slot; 4] {
    let away = 0.05 + 4.0 * gap;
    let above = |share: f32| 0.5 * gap + share * away;
    let [picture, bench, board] = slots(gap);
    let picture = Slot {
        eye: Vec3::new(-0.5 - away, 1.5, -2.0 + above(0.35)),
        target: Vec3::new(-0.5 + gap, 1.5, -2.0),
        ..picture
    };
    let bench = Slot { eye: Vec3::new(0.0, above(0.35), away), target: Vec3::new(0.0, 0.0, -gap), ..bench };
    let board = Slot {
        eye: Vec3::new(0.0, 3.0 - above(0.35), -0.2 + away),
        target: Vec3::new(0.0, 3.0, -0.2 - gap),
        ..board
    };
    let wardrobe = Slot {
        axis: 0,
        wall: -2.0,
        inside: 1.0,
        gap,
        low: Vec3::new(0.0, 0.0, -1.0),
        high: Vec3::new(0.0, 2.0, 0.2),
        eye: Vec3::new(-2.0 + above(0.25), 1.0, 0.2 + away),
        target: Vec3::new(-2.0, 1.0, 0.2 - gap),
    };
    [picture, bench, board, wardrobe]
}

fn has_the_light_of_paths(kind: &str, slot: &Slot) {
    let buffers = slot.buffers();
    let scene = buffers.scene();
    let light = |method, spp, seed| slot.light(&scene, &render(&scene, method, SIZE, spp, |s| s.seed = seed));
    let name = format!("gap {} {kind}, axis {}, wall {}", slot.gap, slot.axis, slot.wall);
    let pictures = || (0..4).map(|seed| vec![light(Method::Path, 512, seed)]).collect();
    let (path, _) = reference(&name, pictures).moments[0];
    let leak = light(Method::IrradianceCache, 128, 0) / path - 1.0;
    assert!(leak.abs() < 0.05, "{name}: {leak}");
}

#[test]
fn gaps_of_a_hundredth_of_a_room_have_the_light_of_paths() {
    slots(0.03).iter().for_each(|slot| has_the_light_of_paths("from afar", slot));
}

#[test]
fn gaps_of_three_hundredths_of_a_room_have_the_light_of_paths() {
    slots(0.12).iter().for_each(|slot| has_the_light_of_paths("from afar", slot));
}

#[test]
fn gaps_of_a_thousandth_of_a_room_have_the_light_of_paths() {
    slots_from_near(0.004).iter().for_each(|slot| has_the_light_of_paths("from near", slot));
}

#[test]
fn gaps_of_a_twentieth_of_a_room_have_the_light_of_paths() {
    slots_from_near(0.2).iter().for_each(|slot| has_the_light_of_paths("from near", slot));
}
