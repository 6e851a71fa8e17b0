//! Every way of tracing against brute force, on scenes that are hard for a BVH.

use super::clearance::{Clearance, ClearanceQuery, POINTS};
use super::*;
use crate::geometry::Frame;
use crate::memory::Line;
use crate::scene::Triangle;
use glam::Vec3;
use halflight_test_support::Random;
use std::vec::Vec;

pub(super) struct Soup {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<Triangle>,
}

impl Soup {
    pub(super) fn of(corners: impl IntoIterator<Item = [Vec3; 3]>) -> Self {
        let mut soup = Soup { positions: Vec::new(), triangles: Vec::new() };
        for triangle in corners {
            let first = soup.positions.len() as u32;
            soup.positions.extend(triangle.map(|p| p.to_array()));
            soup.triangles.push(Triangle { vertices: [first, first + 1, first + 2], material: 0 });
        }
        soup
    }
    pub(super) fn mesh(&self) -> Mesh<'_> {
        Mesh { positions: &self.positions, triangles: &self.triangles, ..Mesh::default() }
    }
}

pub(super) fn lines(bytes: usize) -> Vec<Line> {
    std::vec![Line([0xa5; 64]); bytes.div_ceil(64)]
}

pub(super) fn random_soup(count: usize, size: f32, offset: Vec3) -> Soup {
    let mut random = Random(count as u64);
    Soup::of((0..count).map(|_| {
        let middle = (random.point() - 0.5) * 10.0;
        [(); 3].map(|()| offset + middle + (random.point() - 0.5) * size)
    }))
}

/// Wavy sheet of triangles that share edges, so that every ray through it must hit.
pub(super) fn sheet(n: usize) -> Soup {
    let at = |x: usize, z: usize| {
        let (x, z) = (x as f32 / n as f32 * 2.0 - 1.0, z as f32 / n as f32 * 2.0 - 1.0);
        Vec3::new(x, 0.1 * (x * x - z * z), z)
    };
    Soup::of((0..n * n).flat_map(|i| {
        let (x, z) = (i % n, i / n);
        let [a, b, c, d] = [at(x, z), at(x + 1, z), at(x + 1, z + 1), at(x, z + 1)];
        [[a, b, c], [a, c, d]]
    }))
}

/// Traces rays in all ways at all levels and compares with brute force, to the bit.
fn agrees(soup: &Soup, rays: &[Ray]) {
    let mesh = soup.mesh();
    let mut memory = lines(Bvh::footprint(mesh.triangles.len()).bytes());
    let bvh = Bvh::build(&mesh, &mut Arena::over(&mut memory)).expect("exact footprint");
    let truth: Vec<Hit> = rays.iter().map(|ray| brute::nearest(&mesh, ray)).collect();
    for level in Level::detect().and_below() {
        for coherence in [Coherence::Coherent, Coherence::Incoherent] {
            let mut hits = std::vec![Hit::NONE; rays.len()];
            bvh.nearest_batch(level, rays, coherence, &mut hits);
            let mut hidden = std::vec![7u8; rays.len()];
            bvh.occluded_batch(level, rays, &mut hidden);
            for (i, ray) in rays.iter().enumerate() {
                assert_eq!(hits[i], truth[i], "{} {coherence:?} ray {i} {ray:?}", level.name());
                assert_eq!(
                    hidden[i],
                    truth[i].is_some() as u8,
                    "{} {coherence:?} any {i} {ray:?}",
                    level.name()
                );
            }
        }
        for (ray, truth) in rays.iter().zip(&truth) {
            assert_eq!(bvh.nearest(level, ray), *truth);
            assert_eq!(bvh.occluded(level, ray), truth.is_some());
        }
    }
}

pub(super) fn random_rays(count: usize, offset: Vec3) -> Vec<Ray> {
    let mut random = Random(99);
    (0..count)
        .map(|i| {
            let (origin, direction) = (offset + (random.point() - 0.5) * 12.0, (random.point() - 0.5) * 2.0);
            let t_max = if i % 3 == 0 { 3.0 * random.unit_f32() } else { f32::INFINITY };
            Ray::segment(origin, direction, t_max)
        })
        .collect()
}

#[test]
fn random_triangles_from_one_to_a_thousand() {
    for count in [1, 2, 3, 8, 9, 17, 100, 1000] {
        agrees(&random_soup(count, 1.5, Vec3::ZERO), &random_rays(300, Vec3::ZERO));
    }
}

#[test]
fn far_from_the_origin() {
    let offset = Vec3::new(148_376.0, 1_234.0, -223_423.0);
    agrees(&random_soup(200, 2.0, offset), &random_rays(300, offset));
}

#[test]
fn tiles_of_a_pinhole_and_of_a_lens() {
    let soup = random_soup(400, 3.0, Vec3::ZERO);
    for lens in [0.0, 0.5] {
        let mut random = Random(3);
        let mut rays: Vec<Ray> = (0..640)
            .map(|i| {
                // Most tiles lie on one side of the axes, some across them.
                let (x, y) = ((i / 64 % 5 * 8 + i % 8) as f32, (i / 320 * 8 + i % 64 / 8) as f32);
                let origin = Vec3::new(0.0, 0.0, 9.0) + (random.point() - 0.5) * lens;
                Ray::new(origin, Vec3::new(x / 20.0 - 0.7, y / 10.0 - 0.6, -1.0))
            })
            .collect();
        agrees(&soup, &rays);
        // A ray that cannot be traced, one with a negative t_max, one that ends early and one without a
        // direction.
        rays[3].origin[1] = f32::NAN;
        rays[70].t_max = -1.0;
        rays[200].t_max = 8.0;
        rays[300].direction = [0.0, -0.0, 0.0];
        agrees(&soup, &rays[..600]);
    }
}

#[test]
fn no_triangles() {
    agrees(&Soup::of([]), &random_rays(10, Vec3::ZERO));
}

#[test]
fn duplicates_slivers_and_points() {
    let mut random = Random(5);
    let mut corners = Vec::new();
    for i in 0..300 {
        let (a, b) = ((random.point() - 0.5) * 4.0, (random.point() - 0.5) * 4.0);
        corners.push(match i % 4 {
            0 => [a, b, a.lerp(b, 0.5) + (random.point() - 0.5) * 1e-5],
            1 => [a, a, b],
            2 => [a, a, a],
            _ => [Vec3::ZERO, Vec3::X * 3.0, Vec3::Y * 3.0],
        });
    }
    agrees(&Soup::of(corners), &random_rays(300, Vec3::ZERO));
}

#[test]
fn what_is_not_finite_is_never_hit() {
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX];
    let mut corners: Vec<[Vec3; 3]> = Vec::new();
    for x in bad {
        corners.push([Vec3::ZERO, Vec3::X, Vec3::new(0.0, x, 0.0)]);
    }
    corners.push([Vec3::ZERO, Vec3::X, Vec3::Y]);
    let soup = Soup::of(corners);
    let mut rays = random_rays(50, Vec3::ZERO);
    for x in bad {
        rays.push(Ray::new(Vec3::new(x, 0.0, 1.0), Vec3::NEG_Z));
        rays.push(Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::new(x, 0.0, -1.0)));
        rays.push(Ray::segment(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z, x));
    }
    rays.push(Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::ZERO));
    rays.push(Ray::segment(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z, -1.0));
    agrees(&soup, &rays);
}

#[test]
fn a_sheet_has_no_holes() {
    let (n, offset) = (24, Vec3::Y * 2.0);
    let soup = sheet(n);
    let mut rays = Vec::new();
    // Through every vertex and the middle of every edge, straight down and slanted.
    for i in 1..2 * n {
        for k in 1..2 * n {
            let target = Vec3::new(i as f32 / n as f32 - 1.0, 0.0, k as f32 / n as f32 - 1.0);
            let target = target + Vec3::Y * 0.1 * (target.x * target.x - target.z * target.z);
            rays.push(Ray::new(target + offset, Vec3::NEG_Y));
            rays.push(Ray::new(target * 0.5 + offset, target * 0.5 - offset));
        }
    }
    agrees(&soup, &rays);
    let mesh = soup.mesh();
    for ray in &rays {
        assert!(brute::nearest(&mesh, ray).is_some(), "a ray slips through at {ray:?}");
    }
}

#[test]
fn axis_parallel_rays_in_the_planes_of_boxes() {
    let soup = Soup::of((0..60).map(|i| {
        let o = Vec3::new((i % 4) as f32, (i / 4 % 4) as f32, (i / 16) as f32);
        [o, o + Vec3::X, o + Vec3::Y]
    }));
    let mut rays = Vec::new();
    for x in 0..9 {
        for y in 0..9 {
            let o = Vec3::new(x as f32 * 0.5, y as f32 * 0.5, -1.0);
            rays.push(Ray::new(o, Vec3::Z));
            rays.push(Ray::new(Vec3::new(o.z, o.x, o.y), Vec3::X));
            rays.push(Ray::new(Vec3::new(o.x, 9.0, o.y), Vec3::NEG_Y));
        }
    }
    agrees(&soup, &rays);
}

#[test]
fn identical_centroids_are_halved() {
    let soup = Soup::of((0..5000).map(|_| [Vec3::ZERO, Vec3::X, Vec3::Y]));
    agrees(&soup, &[Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z), Ray::new(Vec3::ONE, Vec3::X)]);
}

#[test]
fn exact_memory_suffices_and_one_byte_less_is_an_error() {
    for count in [0, 1, 7, 100, 1000] {
        let soup = random_soup(count, 1.0, Vec3::ZERO);
        let bytes = Bvh::footprint(count).bytes();
        let mut memory = lines(bytes);
        let memory: &mut [u8] = bytemuck::cast_slice_mut(&mut memory);
        let bvh = Bvh::build(&soup.mesh(), &mut Arena::new(&mut memory[..bytes]));
        let used = bvh.expect("exact footprint").used().bytes();
        assert!(used <= Bvh::kept_footprint(count).bytes());
        if bytes > 0 {
            let short = Bvh::build(&soup.mesh(), &mut Arena::new(&mut memory[..bytes - 1]));
            assert!(short.is_err(), "{count} triangles");
        }
    }
}

#[test]
fn every_level_builds_the_same_tree() {
    let soup = random_soup(3000, 1.0, Vec3::ZERO);
    let bytes = Bvh::footprint(3000).bytes();
    let build = |level: Level| {
        let mut memory = lines(bytes);
        let mut arena = Arena::over(&mut memory);
        let bvh = Bvh::build_with(&soup.mesh(), &mut arena, level, &Serial).expect("exact footprint");
        (bytemuck::cast_slice(bvh.nodes).to_vec() as std::vec::Vec<u8>, bvh.triangles.to_vec())
    };
    let plain = build(Level::BASELINE);
    for level in Level::detect().and_below() {
        assert!(build(level) == plain, "{}", level.name());
    }
}

#[test]
fn a_copy_takes_exactly_what_it_says() {
    let soup = random_soup(500, 1.0, Vec3::ZERO);
    let mut memory = lines(Bvh::footprint(500).bytes());
    let bvh = Bvh::build(&soup.mesh(), &mut Arena::over(&mut memory)).expect("fits");
    let bytes = bvh.used().bytes();
    let mut copy = lines(bytes);
    let copy: &mut [u8] = bytemuck::cast_slice_mut(&mut copy);
    assert!(bvh.copied(&mut Arena::new(&mut copy[..bytes - 1])).is_err());
    let copy = bvh.copied(&mut Arena::new(&mut copy[..bytes])).expect("exact");
    for ray in random_rays(100, Vec3::ZERO) {
        assert_eq!(bvh.nearest(Level::BASELINE, &ray), copy.nearest(Level::BASELINE, &ray));
    }
}

/// Points of a clearance query, in radii.
pub(super) const POINTS_ASIDE: [[f32; POINTS]; 2] =
    [[0.6, 0.0, -0.6, 0.0, 0.4, -0.4, 0.3, -0.1], [0.0, 0.6, 0.0, -0.6, 0.4, 0.4, -0.5, 0.0]];

#[test]
fn what_a_survey_is_sure_of_rays_find() {
    let mut random = Random(7);
    let (mut low, mut unhung, mut there) = (0, 0, 0);
    for soup in [random_soup(300, 3.0, Vec3::ZERO), random_soup(30, 9.0, Vec3::splat(50.0)), sheet(40)] {
        let mesh = soup.mesh();
        let mut memory = lines(Bvh::footprint(mesh.triangles.len()).bytes());
        let bvh = Bvh::build(&mesh, &mut Arena::over(&mut memory)).unwrap();
        for _ in 0..4000 {
            let [a, b, c] = mesh.corners(random.below(mesh.triangles.len()) as u32);
            let (u, v) = (0.5 * random.unit_f32(), 0.5 * random.unit_f32());
            let frame = Frame::from_normal((b - a).cross(c - a).normalize());
            let (radius, above) = (0.01 + random.unit_f32(), 1e-4);
            let place = a + u * (b - a) + v * (c - a) + above * frame.normal;
            let points = POINTS_ASIDE.map(|axis| axis.map(|at| at * radius));
            let query = ClearanceQuery { place, frame, reach: radius, points, depth: 0.3 * radius };
            let clearance = bvh.clearance(&query);
            let level = Level::detect();
            low += u32::from(!clearance.has_wall);
            for _ in 0..if clearance.has_wall { 0 } else { 16 } {
                let local = (2.0 * random.point() - 1.0).with_z(random.unit_f32());
                let way = radius / 3f32.sqrt() * frame.to_world(local.normalize());
                assert!(!bvh.occluded(level, &Ray::segment(place, way, 1.0)), "{query:?} {way}");
            }
            unhung += u32::from(clearance.has_wall && !clearance.has_overhang);
            for _ in 0..if clearance.has_overhang { 0 } else { 16 } {
                let local = (2.0 * random.point() - 1.0).with_z(1.0).normalize();
                let way = radius / 3f32.sqrt() * frame.to_world(local);
                let hit = bvh.nearest(level, &Ray::segment(place, way, 1.0));
                if hit.is_some() {
                    let [a, b, c] = mesh.corners(hit.triangle);
                    let normal = (b - a).cross(c - a).normalize();
                    let slope = normal.dot(frame.normal);
                    let height = normal.dot(a - place) / slope;
                    assert!(slope.abs() < 0.501 || height < 0.011 * radius, "{query:?} {way}");
                }
            }
            for i in (0..POINTS).filter(|i| clearance.surface >> i & 1 != 0) {
                let [x, y] = points.map(|axis| axis[i]);
                let from = place + frame.to_world(Vec3::new(x, y, 1.001 * query.depth));
                let down = Ray::segment(from, -frame.normal, 2.002 * query.depth);
                assert!(bvh.occluded(level, &down), "{query:?} {i}");
                there += 1;
            }
        }
    }
    assert!(low > 1000 && unhung > 500 && there > 10_000, "{low} {unhung} {there}");
}

#[test]
fn on_a_floor_of_many_triangles_a_survey_sees_it_all_but_at_the_edge_and_under_a_wall() {
    let at = |x: i32, z: i32| Vec3::new(x as f32, 0.0, z as f32);
    let squares = (0..64).flat_map(|i| {
        let (x, z) = (i % 8, i / 8);
        [[at(x, z), at(x, z + 1), at(x + 1, z)], [at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)]]
    });
    let wall = [at(2, 0), at(2, 0) + Vec3::Y, at(2, 8)];
    let soup = Soup::of(squares.chain([wall]));
    let mut memory = lines(Bvh::footprint(soup.triangles.len()).bytes());
    let bvh = Bvh::build(&soup.mesh(), &mut Arena::over(&mut memory)).unwrap();
    let frame = Frame { tangent: Vec3::X, bitangent: Vec3::NEG_Z, normal: Vec3::Y };
    let points = [[0.9, -0.9, 0.9, -0.9, 0.9, -0.9, 0.9, -0.9], [0.8; POINTS]];
    let at_x = |x: f32| {
        let place = Vec3::new(x, 1e-3, 4.3);
        bvh.clearance(&ClearanceQuery { place, frame, reach: 1.0, points, depth: 0.1 })
    };
    assert_eq!(at_x(5.3), Clearance::OPEN);
    assert_eq!(at_x(7.3), Clearance { has_wall: false, has_overhang: false, surface: 0xaa });
    assert!([2.7, 1.3].map(at_x).iter().all(|clearance| clearance.has_wall && !clearance.has_overhang));
}
