//! Rooms that are hard for caches: thin bars, a sheet between light and dark, black walls, and a small bright
//! spot; with floors of any surface.

use crate::scenes::{SceneBuffers, emitter};
use glam::Vec3;
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Material, Surface};

/// Triangles of the floor of [`room`].
const FLOOR: core::ops::Range<usize> = 4..6;

/// A surface that reflects all directions alike.
pub fn diffuse(reflectance: f32) -> Material {
    Material::diffuse(Rgb::splat(reflectance))
}

/// A closed unit room seen from a corner.
pub fn room(reflectance: f32) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.9, 0.8, 0.95), Vec3::new(0.3, 0.25, 0.0), Vec3::Y, 70.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(diffuse(reflectance));
    buffers.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    buffers
}

/// Adds a square lamp of side `size`.
pub fn lamp(buffers: &mut SceneBuffers, center: Vec3, normal: Vec3, size: f32, radiance: f32) {
    let lamp = buffers.material(emitter(0.0, radiance));
    buffers.square(center, normal, size, lamp);
}

/// Light passes over a wall that is one sheet: records of both sides lie in the same place.
pub fn sheet() -> SceneBuffers {
    let mut buffers = room(0.5);
    let sheet = buffers.material(diffuse(0.5));
    let corner = |x, y| Vec3::new(x, y, 0.5);
    buffers.quad([corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 0.7), corner(0.0, 0.7)], sheet);
    lamp(&mut buffers, Vec3::new(0.5, 0.4, 0.02), Vec3::Z, 0.3, 10.0);
    buffers
}

/// A black room under a lamp.
pub fn black() -> SceneBuffers {
    let mut buffers = room(0.0);
    lamp(&mut buffers, Vec3::new(0.5, 0.99, 0.5), Vec3::NEG_Y, 0.2, 10.0);
    buffers
}

/// White boxes between black walls.
pub fn boxes_in_black() -> SceneBuffers {
    let mut buffers = black();
    let white = buffers.material(diffuse(0.8));
    buffers.cuboid(Vec3::new(0.2, 0.0, 0.2), Vec3::new(0.5, 0.3, 0.5), false, white);
    buffers.cuboid(Vec3::new(0.6, 0.0, 0.1), Vec3::new(0.8, 0.5, 0.3), false, white);
    buffers
}

/// The spot fills a hundredth of the hemisphere: few of a record's 256 gather rays hit it.
pub fn spot() -> SceneBuffers {
    let mut buffers = room(0.5);
    lamp(&mut buffers, Vec3::new(0.1, 0.6, 0.6), Vec3::NEG_X, 0.05, 1e3);
    buffers
}

/// Thin dark bars, one of them standing on the floor.
pub fn needles() -> SceneBuffers {
    let mut buffers = room(0.5);
    let needle = buffers.material(diffuse(0.1));
    buffers.cuboid(Vec3::new(0.4, 0.0, 0.3), Vec3::new(0.403, 0.9, 0.303), false, needle);
    buffers.cuboid(Vec3::new(0.2, 0.3, 0.2), Vec3::new(0.8, 0.302, 0.202), false, needle);
    lamp(&mut buffers, Vec3::new(0.5, 0.99, 0.5), Vec3::NEG_Y, 0.2, 10.0);
    buffers
}

/// The room with a floor of `surface`.
pub fn with_floor(mut buffers: SceneBuffers, surface: Surface) -> SceneBuffers {
    let floor = buffers.material(Material { surface, ..Material::GREY });
    buffers.triangles[FLOOR].iter_mut().for_each(|triangle| triangle.material = floor);
    buffers
}
