//! The scene of the examples: a pyramid in a room under a lamp.
use halflight_core::Rgb;
use halflight_core::glam::Vec3;
use halflight_core::scene::{Camera, ColorInput, Material, Mesh, ScalarInput, Scene, Surface, Triangle};

#[rustfmt::skip]
const POSITIONS: [[f32; 3]; 15] = [
    [-2.0, 0.0, -2.0], [2.0, 0.0, -2.0], [2.0, 0.0, 2.0], [-2.0, 0.0, 2.0],
    [-2.0, 3.0, -2.0], [2.0, 3.0, -2.0], [2.0, 3.0, 2.0], [-2.0, 3.0, 2.0],
    [-1.0, 0.0, 0.9], [1.0, 0.0, 0.9], [0.0, 0.0, -0.8], [0.0, 1.6, 0.3],
    [-0.6, 2.9, -0.6], [0.6, 2.9, -0.6], [0.0, 2.9, 0.6],
];
/// Floor, back, left and right wall, ceiling, pyramid, lamp.
#[rustfmt::skip]
const TRIANGLES: [Triangle; 14] = [
    face(0, 2, 1, 0), face(0, 3, 2, 0), face(0, 1, 5, 0), face(0, 5, 4, 0), face(0, 4, 7, 1),
    face(0, 7, 3, 1), face(1, 2, 6, 2), face(1, 6, 5, 2), face(4, 5, 6, 0), face(4, 6, 7, 0),
    face(8, 9, 11, 0), face(9, 10, 11, 0), face(10, 8, 11, 0), face(12, 13, 14, 3),
];

const fn face(a: u32, b: u32, c: u32, material: u32) -> Triangle {
    Triangle { vertices: [a, b, c], material }
}

/// White, red, green, lamp.
const MATERIALS: [Material; 4] = [
    Material::diffuse(Rgb::splat(0.7)),
    Material::diffuse(Rgb::new(0.7, 0.1, 0.1)),
    Material::diffuse(Rgb::new(0.1, 0.6, 0.1)),
    Material { emission: ColorInput::constant(Rgb::splat(20.0)), ..Material::diffuse(Rgb::splat(0.7)) },
];

/// The materials with rough metal in place of red.
const WITH_METAL: [Material; 4] = {
    let mut materials = MATERIALS;
    let reflectance = ColorInput::constant(Rgb::splat(0.9));
    materials[1].surface = Surface::Conductor { reflectance, roughness: ScalarInput::constant(0.85) };
    materials
};

/// The room, seen through its open front.
pub(super) fn scene() -> Scene<'static> {
    Scene {
        mesh: Mesh { positions: &POSITIONS, triangles: &TRIANGLES, ..Mesh::default() },
        materials: &MATERIALS,
        textures: &[],
        lights: &[],
        environment: None,
        camera: Camera::look_at(Vec3::new(0.0, 1.5, 6.5), Vec3::new(0.0, 1.4, 0.0), Vec3::Y, 40.0),
    }
}

/// The room with a wall of rough metal.
#[allow(dead_code, reason = "not all examples need it")]
pub(super) fn with_metal_wall() -> Scene<'static> {
    Scene { materials: &WITH_METAL, ..scene() }
}

/// FNV-1a over the bits of a picture.
#[allow(dead_code, unreachable_pub, reason = "one example needs it, and others see it")]
pub fn fingerprint(pixels: &[Rgb]) -> u64 {
    let bytes = pixels.iter().flat_map(|p| p.to_array()).flat_map(|v| v.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}
