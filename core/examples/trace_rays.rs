//! Ray tracing alone: a hierarchy over a mesh, and nearest hits of a batch of rays. No heap.
use halflight_core::glam::Vec3;
use halflight_core::memory::OutOfMemory;
use halflight_core::parts::rays::{Bvh, Coherence, Hit, Mesh, Ray, Triangle};
use halflight_core::{Arena, Level, Line};

fn main() -> Result<(), OutOfMemory> {
    let positions = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.6, 0.4], [0.0, 0.0, -1.5]];
    let triangles = [[0, 1, 2], [1, 3, 2], [3, 0, 2]].map(|vertices| Triangle { vertices, material: 0 });
    let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
    let mut memory = [Line::ZERO; 64];
    let bvh = Bvh::build(&mesh, &mut Arena::over(&mut memory))?;
    let rays: [Ray; 24 * 12] = core::array::from_fn(|i| {
        let [x, y] = [(i % 24) as f32 / 10.0 - 1.2, 1.8 - (i / 24) as f32 / 6.0];
        Ray::new(Vec3::new(x, y, 5.0), Vec3::NEG_Z)
    });
    let mut hits = rays.map(|_| Hit::NONE);
    bvh.nearest_batch(Level::detect(), &rays, Coherence::Coherent, &mut hits);
    for row in hits.chunks(24) {
        let letter = |hit: &Hit| if hit.is_some() { char::from(b"/\\|"[hit.triangle as usize]) } else { ' ' };
        println!("{}", row.iter().map(letter).collect::<String>());
    }
    Ok(())
}
