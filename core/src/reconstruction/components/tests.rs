//! Components of meshes with known creases.

use super::SurfaceComponents;
use crate::memory::{Arena, Line};
use crate::scene::{Mesh, Triangle};
use glam::Vec3;
use std::collections::BTreeSet;
use std::vec;
use std::vec::Vec;

fn components(mesh: &Mesh) -> Vec<u32> {
    let mut memory = vec![Line::ZERO; SurfaceComponents::footprint(mesh).bytes() / 64];
    let found = SurfaceComponents::build(mesh, &mut Arena::over(&mut memory)).unwrap();
    (0..mesh.triangles.len() as u32).map(|i| found.of(i)).collect()
}

/// Prism of `sides` quads around the z axis, each with corners of its own, and its normals at the corners.
fn prism(sides: u32) -> (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<Triangle>) {
    let (mut positions, mut normals, mut triangles) = (vec![], vec![], vec![]);
    for side in 0..sides {
        let first = positions.len() as u32;
        for (step, z) in [(0, 0.0), (1, 0.0), (1, 1.0), (0, 1.0)] {
            let angle = ((side + step) % sides) as f32 / sides as f32 * core::f32::consts::TAU;
            let normal = Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0);
            positions.push((normal + z * Vec3::Z).to_array());
            normals.push(normal.to_array());
        }
        for vertices in [[0, 1, 2], [0, 2, 3]] {
            triangles.push(Triangle { vertices: vertices.map(|i| first + i), material: 0 });
        }
    }
    (positions, normals, triangles)
}

fn count(components: &[u32]) -> usize {
    components.iter().collect::<BTreeSet<_>>().len()
}

#[test]
fn a_round_prism_is_one_component_and_a_sharp_one_has_its_sides() {
    for (sides, expected) in [(36, 1), (20, 1), (16, 16), (6, 6)] {
        let (positions, _, triangles) = prism(sides);
        let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
        let found = components(&mesh);
        assert_eq!(count(&found), expected, "{sides} sides");
        assert!(
            found
                .iter()
                .zip(0..)
                .all(|(&component, i)| component <= i && found[component as usize] == component)
        );
    }
}

#[test]
fn shading_normals_make_a_coarse_prism_smooth() {
    let (positions, normals, triangles) = prism(8);
    let smooth = Mesh { positions: &positions, normals: &normals, triangles: &triangles, ..Mesh::default() };
    assert_eq!(count(&components(&smooth)), 1);
    let flat = vec![[0.0; 3]; normals.len()];
    assert_eq!(count(&components(&Mesh { normals: &flat, ..smooth })), 8);
}

#[test]
fn materials_part_a_surface() {
    let (positions, _, mut triangles) = prism(36);
    triangles.iter_mut().skip(40).for_each(|triangle| triangle.material = 1);
    let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
    assert_eq!(count(&components(&mesh)), 2);
}

#[test]
fn pieces_of_one_plane_are_one_component() {
    // Two tiles with a gap, one turned around, one a step above, and one of another plane.
    let tile = |x: f32, z: f32, slope: f32| {
        [[x, 0.0, z], [x + 1.0, 0.0, z + slope], [x + 1.0, 1.0, z + slope], [x, 1.0, z]]
    };
    let tiles = [
        tile(0.0, 0.0, 0.0),
        tile(2.0, 0.0, 0.0),
        tile(4.0, 0.0, 0.0),
        tile(0.0, 0.1, 0.0),
        tile(6.0, 0.0, 0.2),
    ];
    let positions = tiles.concat();
    let triangles: Vec<Triangle> = (0..20)
        .step_by(4)
        .flat_map(|first| {
            let turned = if first == 4 { [[0, 2, 1], [0, 3, 2]] } else { [[0, 1, 2], [0, 2, 3]] };
            turned.map(|vertices| Triangle { vertices: vertices.map(|i| first + i), material: 0 })
        })
        .collect();
    let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
    assert_eq!(components(&mesh), [0, 0, 0, 0, 0, 0, 6, 6, 8, 8]);
}

#[test]
fn broken_triangles_stay_alone() {
    let positions = [[0.0; 3], [1.0, 0.0, 0.0], [f32::NAN; 3], [f32::INFINITY, 0.0, 1.0]];
    let triangles = [[0, 1, 9], [0, 0, 0], [0, 1, 2], [0, 1, 3], [u32::MAX; 3]]
        .map(|vertices| Triangle { vertices, material: 0 });
    let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
    assert_eq!(components(&mesh), [0, 1, 2, 3, 4]);
    assert!(components(&Mesh::default()).is_empty());
}
