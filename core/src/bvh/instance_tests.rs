//! Traversal of instances against brute force, and against copies of the prototypes.

use super::clearance::{ClearanceQuery, POINTS};
use super::tests::{POINTS_ASIDE, Soup, lines, random_rays, random_soup, sheet};
use super::*;
use crate::geometry::Frame;
use crate::scene::{Instance, Instances, Prototype, Triangle};
use glam::Vec3;
use halflight_test_support::Random;
use std::vec::Vec;

/// Prototypes in one list of vertices and triangles, and their instances.
struct Forest {
    world: Soup,
    positions: Vec<[f32; 3]>,
    triangles: Vec<Triangle>,
    prototypes: Vec<Prototype>,
    placed: Vec<Instance>,
}

impl Forest {
    /// `count` random placements of `parts` around `world`: turned, scaled, sheared, every other mirrored.
    fn new(world: Soup, parts: &[Soup], count: usize, spread: f32) -> Self {
        let (mut positions, mut triangles, mut prototypes) = (Vec::new(), Vec::new(), Vec::new());
        for part in parts {
            let from = [positions.len(), triangles.len()].map(|n| n as u32);
            positions.extend(part.positions.iter().copied());
            triangles.extend(part.triangles.iter().copied());
            let to = [positions.len(), triangles.len()].map(|n| n as u32);
            prototypes.push(Prototype::new(&positions, [from[0], to[0]], [from[1], to[1]], [0, 0]));
        }
        let mut random = Random(count as u64);
        let mut placed: Vec<Instance> = (0..count)
            .map(|i| {
                let mut column = || (2.0 * random.point() - 1.0).to_array();
                let (mut linear, at) = ([column(), column(), column()], column());
                if (Vec3::from(linear[0]).cross(linear[1].into()).dot(linear[2].into()) < 0.0) != (i % 2 == 0)
                {
                    linear.swap(0, 1);
                }
                Instance::new((i % parts.len()) as u32, linear, at.map(|x| spread * x)).expect("an inverse")
            })
            .collect();
        Instances::number(world.triangles.len(), &prototypes, &mut placed).expect("32 bits suffice");
        Self { world, positions, triangles, prototypes, placed }
    }

    fn mesh(&self) -> Mesh<'_> {
        let instances = Instances {
            positions: &self.positions,
            triangles: &self.triangles,
            prototypes: &self.prototypes,
            placed: &self.placed,
            ..Instances::default()
        };
        let mesh = Mesh { instances, ..self.world.mesh() };
        assert_eq!(mesh.validate(1), Ok(()));
        mesh
    }

    /// All triangles in world space, in the order of their indices.
    fn copies(&self) -> Soup {
        let mesh = self.mesh();
        Soup::of((0..mesh.triangle_count() as u32).map(|index| mesh.corners(index)))
    }
}

fn forests() -> Vec<Forest> {
    let part = |count: usize| random_soup(count, 1.0, Vec3::ZERO);
    std::vec![
        Forest::new(random_soup(0, 1.0, Vec3::ZERO), &[part(1)], 1, 0.0),
        Forest::new(random_soup(50, 3.0, Vec3::ZERO), &[part(40), sheet(6)], 9, 4.0),
        Forest::new(sheet(9), &[part(200), sheet(3), part(7)], 100, 10.0),
        Forest::new(random_soup(3, 3.0, Vec3::splat(900.0)), &[part(30)], 20, 1000.0),
    ]
}

fn rays(mesh: &Mesh) -> Vec<Ray> {
    let bounds = mesh.bounds();
    let scale = bounds.extent().max_element() / 10.0;
    let mut rays = random_rays(600, Vec3::ZERO);
    let mut random = Random(5);
    for (i, ray) in rays.iter_mut().enumerate() {
        ray.origin = (scale * Vec3::from(ray.origin) + bounds.center()).to_array();
        ray.t_max *= scale;
        if i % 4 != 0 {
            let [a, b, c] = mesh.corners(random.below(mesh.triangle_count() as usize) as u32);
            let to = 0.5 * a + 0.3 * b + 0.2 * c;
            ray.direction = (to - Vec3::from(ray.origin)).to_array();
        }
    }
    rays
}

#[test]
fn rays_meet_instances_in_every_way_of_tracing_as_by_brute_force() {
    let mut met = 0;
    for forest in forests() {
        let mesh = forest.mesh();
        let mut memory = lines(Bvh::footprint_of(&mesh).bytes());
        let bvh = Bvh::build(&mesh, &mut Arena::over(&mut memory)).expect("exact footprint");
        let rays = rays(&mesh);
        let truth: Vec<Hit> = rays.iter().map(|ray| brute::nearest(&mesh, ray)).collect();
        met += truth.iter().filter(|hit| hit.is_some()).count();
        for level in Level::detect().and_below() {
            for coherence in [Coherence::Coherent, Coherence::Incoherent] {
                let mut hits = std::vec![Hit::NONE; rays.len()];
                bvh.nearest_batch(level, &rays, coherence, &mut hits);
                assert_eq!(hits, truth, "{}", level.name());
            }
            let mut hidden = std::vec![7u8; rays.len()];
            bvh.occluded_batch(level, &rays, &mut hidden);
            for (i, ray) in rays.iter().enumerate() {
                assert_eq!(hidden[i] == 1, truth[i].is_some(), "{}", level.name());
                assert_eq!(bvh.nearest(level, ray), truth[i], "{}", level.name());
                assert_eq!(bvh.occluded(level, ray), truth[i].is_some());
            }
        }
    }
    assert!(met > 500, "{met}");
}

#[test]
fn tiles_of_camera_rays_meet_instances_as_single_rays_do() {
    for forest in forests() {
        let mesh = forest.mesh();
        let mut memory = lines(Bvh::footprint_of(&mesh).bytes());
        let bvh = Bvh::build(&mesh, &mut Arena::over(&mut memory)).expect("exact footprint");
        let bounds = bvh.bounds();
        let eye = bounds.center() + bounds.extent() * Vec3::new(0.1, 0.3, 1.2);
        let rays: Vec<Ray> = (0..64 * 50)
            .map(|i| {
                let (x, y) = (i / 64 % 10 * 8 + i % 8, i / 640 * 8 + i % 64 / 8);
                let corner = Vec3::new(x as f32 / 80.0 - 0.5, y as f32 / 40.0 - 0.5, 0.0);
                Ray::new(eye, bounds.center() + corner * bounds.extent() - eye)
            })
            .collect();
        for level in Level::detect().and_below() {
            let mut hits = std::vec![Hit::NONE; rays.len()];
            bvh.nearest_batch(level, &rays, Coherence::Coherent, &mut hits);
            for (ray, hit) in rays.iter().zip(&hits) {
                assert_eq!(bvh.nearest(level, ray), *hit, "{} {ray:?}", level.name());
            }
        }
    }
}

/// Distance of the hits of instances and copies, relative to coordinates and lengths: roundings of the
/// transforms, times the condition of random matrices.
const TOLERANCE: f32 = 3e-4;

#[test]
fn hits_of_instances_are_those_of_copies_within_rounding() {
    let (mut same, mut all) = (0, 0);
    for forest in forests() {
        let (mesh, copies) = (forest.mesh(), forest.copies());
        for ray in rays(&mesh) {
            let [hit, copy] = [brute::nearest(&mesh, &ray), brute::nearest(&copies.mesh(), &ray)];
            all += 1;
            same += u32::from(hit.triangle == copy.triangle);
            if hit.triangle == copy.triangle && hit.is_some() {
                let size =
                    Vec3::from(ray.origin).abs().max_element() + Vec3::from(ray.direction).length() * hit.t;
                let difference = ray.at(hit.t).distance(ray.at(copy.t));
                assert!(difference <= TOLERANCE * size, "{hit:?} {copy:?} {ray:?}");
                // Barycentric weights belong to the corners in world space.
                let [a, b, c] = mesh.corners(hit.triangle);
                let point = (1.0 - hit.u - hit.v) * a + hit.u * b + hit.v * c;
                assert!(point.distance(ray.at(hit.t)) <= TOLERANCE * size, "{hit:?} {ray:?}");
            }
        }
    }
    assert!(all - same <= all / 500, "{same} of {all}");
}

#[test]
fn a_build_takes_its_footprint_and_a_copy_its_used_bytes() {
    for forest in forests() {
        let mesh = forest.mesh();
        let bytes = Bvh::footprint_of(&mesh).bytes();
        let mut memory = lines(bytes);
        assert!(
            Bvh::build(&mesh, &mut Arena::new(&mut bytemuck::cast_slice_mut(&mut memory)[..bytes - 1]))
                .is_err()
        );
        let bvh = Bvh::build(&mesh, &mut Arena::over(&mut memory)).expect("exact footprint");
        let mut kept = lines(bvh.used().bytes());
        let copy = bvh.copied(&mut Arena::over(&mut kept)).expect("exact footprint");
        for ray in rays(&mesh) {
            assert_eq!(copy.nearest(Level::BASELINE, &ray), bvh.nearest(Level::BASELINE, &ray));
        }
    }
}

/// Rounding of a point of a frame and of a ray from it, relative to the largest coordinate: four operations
/// each.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

#[test]
fn rays_find_what_the_surroundings_of_instances_are_sure_of() {
    let mut random = Random(7);
    let (mut sure, mut sure_of_copies) = (0, 0);
    for forest in forests() {
        let (mesh, copies) = (forest.mesh(), forest.copies());
        let [mut memory, mut other] = [&mesh, &copies.mesh()].map(|m| lines(Bvh::footprint_of(m).bytes()));
        let bvh = Bvh::build(&mesh, &mut Arena::over(&mut memory)).unwrap();
        let of_copies = Bvh::build(&copies.mesh(), &mut Arena::over(&mut other)).unwrap();
        for _ in 0..400 {
            let [a, b, c] = mesh.corners(random.below(mesh.triangle_count() as usize) as u32);
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            let reach = (0.02 + 0.3 * random.unit_f32()) * (b - a).length();
            let place = 0.5 * a + 0.3 * b + 0.2 * c + 0.01 * reach * normal;
            let points = POINTS_ASIDE.map(|axis| axis.map(|at| at * reach));
            let frame = Frame::from_normal(normal);
            let query = ClearanceQuery { place, frame, reach, points, depth: 0.3 * reach };
            let [clearance, of_copies] = [bvh.clearance(&query), of_copies.clearance(&query)];
            // Both are conservative, each by the boxes of its tree.
            sure += u32::from(!clearance.has_wall);
            sure_of_copies += u32::from(!of_copies.has_wall);
            for _ in 0..if clearance.has_wall { 0 } else { 16 } {
                let local = (2.0 * random.point() - 1.0).with_z(random.unit_f32());
                let way = reach / 3f32.sqrt() * frame.to_world(local.normalize());
                let ray = Ray::segment(place, way, 1.0);
                assert!(!brute::nearest(&mesh, &ray).is_some(), "{query:?} {way}");
            }
            for i in (0..POINTS).filter(|i| clearance.surface >> i & 1 != 0) {
                let [x, y] = points.map(|axis| axis[i]);
                let from = place + frame.to_world(Vec3::new(x, y, 1.001 * query.depth));
                // Beside the border of a triangle rounding decides: of the point, and of its ray.
                let rounding = ROUNDING * place.abs().max_element();
                let hits = [[0.0; 2], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].map(|[x, y]| {
                    let aside = frame.to_world(Vec3::new(x, y, 0.0) * rounding);
                    let down = Ray::segment(from + aside, -frame.normal, 2.002 * query.depth);
                    bvh.occluded(Level::BASELINE, &down)
                });
                assert!(hits.contains(&true), "{query:?} {i}");
            }
        }
    }
    assert!(sure > 800 && 10 * sure >= 9 * sure_of_copies, "{sure} {sure_of_copies}");
}

#[test]
fn transforms_without_an_inverse_place_nothing() {
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert!(Instance::new(0, [x, y, z], [0.0; 3]).is_some());
    assert!(Instance::new(0, [x, y, x], [0.0; 3]).is_none());
    assert!(Instance::new(0, [x, y, [0.0, 0.0, f32::INFINITY]], [0.0; 3]).is_none());
    assert!(Instance::new(0, [x, y, z], [f32::NAN, 0.0, 0.0]).is_none());
    let one = Prototype::new(&[[0.0; 3]; 3], [0, 3], [0, u32::MAX / 2], [0, 0]);
    let mut placed = [Instance::new(0, [x, y, z], [0.0; 3]).unwrap(); 2];
    assert_eq!(Instances::number(0, &[one], &mut placed[..1]), Ok(()));
    assert_eq!(Instances::number(2, &[one], &mut placed), Err(1));
    assert_eq!(Instances::number(0, &[], &mut placed), Err(0));
}
