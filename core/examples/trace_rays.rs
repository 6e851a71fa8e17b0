//! Ray tracing alone: a hierarchy over a mesh, nearest hits of a batch of rays, and rays towards the sun. No
//! heap.
use core::array;
use glam::Vec3;
use halflight_core::bsdf::DiffuseOnly;
use halflight_core::bvh::{Bvh, Coherence};
use halflight_core::geometry::{Hit, Ray};
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::scene::{Camera, Material, Mesh, Scene, SurfacePoint, Triangle};
use halflight_core::{Level, Rgb};

const POSITIONS: [[f32; 3]; 7] = [
    [-4.0, 0.0, -4.0],
    [4.0, 0.0, -4.0],
    [0.0, 0.0, 6.0],
    [-1.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 0.0, 1.5],
    [0.0, 1.5, 0.5],
];
/// The ground, and the three sides of a pyramid on it.
const TRIANGLES: [[u32; 3]; 4] = [[0, 2, 1], [3, 4, 6], [4, 5, 6], [5, 3, 6]];
/// Rays across and down.
const SIZE: u32 = 24;

fn main() -> Result<(), OutOfMemory> {
    let triangles = TRIANGLES.map(|vertices| Triangle { vertices, material: 0 });
    let scene = Scene {
        mesh: Mesh { positions: &POSITIONS, triangles: &triangles, ..Mesh::default() },
        materials: &[Material::diffuse(Rgb::ONE)],
        textures: &[],
        lights: &[],
        environment: None,
        camera: Camera::look_at(Vec3::new(0.0, 2.0, -6.0), Vec3::ZERO, Vec3::Y, 40.0),
    };
    // The memory of the build is known beforehand.
    let mut memory = [Line([0; 64]); 64];
    assert!(Bvh::footprint(triangles.len()).bytes() <= size_of_val(&memory));
    let bvh = Bvh::build(&scene.mesh, &mut Arena::over(&mut memory))?;

    let level = Level::detect();
    let pixel = |i: usize| (i as u32 % SIZE, i as u32 / SIZE);
    let rays: [Ray; (SIZE * SIZE) as usize] = array::from_fn(|i| {
        let (x, y) = pixel(i);
        scene.camera.ray(SIZE, SIZE, x as f32 + 0.5, y as f32 + 0.5, [0.5; 2])
    });
    let mut hits = rays.map(|_| Hit::NONE);
    bvh.nearest_batch(level, &rays, Coherence::Coherent, &mut hits);

    let sun = Vec3::new(-1.0, 1.0, -0.5).normalize();
    for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
        // A ray from a surface starts beyond the rounding error of its point: there is no epsilon to choose.
        let letter = SurfacePoint::at::<DiffuseOnly>(&scene, ray, hit).map_or(' ', |point| {
            let is_lit = point.geometric_normal.dot(sun) > 0.0 && !bvh.occluded(level, &point.spawn(sun));
            if is_lit { char::from(b".:-="[hit.triangle as usize]) } else { '#' }
        });
        print!("{letter}{}", if pixel(i).0 == SIZE - 1 { "\n" } else { "" });
    }
    Ok(())
}
