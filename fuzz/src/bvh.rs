//! BVH over any triangles, traced with any rays through every entry point at every level: hits agree with
//! brute force, and all entry points with each other to the bit.

use crate::numbers::traceable_point as point;
use arbitrary::{Result, Unstructured};
use glam::{DVec3, Vec3};
use halflight_core::Level;
use halflight_core::bvh::{Bvh, Coherence, brute};
use halflight_core::geometry::{Hit, Ray};
use halflight_core::memory::{Arena, Line};
use halflight_core::scene::{Mesh, Triangle};

const MAX_TRIANGLES: usize = 128;
/// One packet of sixteen and a remainder.
const MAX_RAYS: usize = 20;

/// Relative difference of distances below which any hit may be the nearest: the box of one triangle may be
/// entered a rounding behind the hit of another.
const TIE: f32 = 1e-6;

/// Largest relative difference between a distance and its f64 value for a hit to be judged.
const NOISE: f64 = 1e-5;

/// One input.
pub fn run(data: &[u8]) {
    // Inputs that are too short end in an error, which is ignored.
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let [vertices, triangles] = input.arbitrary::<[u8; 2]>()?;
    let positions = (0..1 + vertices % 64).map(|_| point(input)).collect::<Result<Vec<_>>>()?;
    let mut indices = |_| -> Result<Triangle> {
        let corner = |v: u8| u32::from(v) % positions.len() as u32;
        Ok(Triangle { vertices: input.arbitrary::<[u8; 3]>()?.map(corner), material: 0 })
    };
    let mut triangles = (0..triangles % 64).map(&mut indices).collect::<Result<Vec<_>>>()?;
    // Many copies: duplicates in one place stop the builder from splitting.
    let copies = 1 + usize::from(input.arbitrary::<u8>()? % 8);
    triangles = triangles.repeat(copies);
    triangles.truncate(MAX_TRIANGLES);
    let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
    let (mut rays, mut expected) = (Vec::new(), Vec::new());
    while rays.len() < MAX_RAYS && !input.is_empty() {
        let ray = ray(input, &mesh)?;
        if well_conditioned(&mesh, &ray) {
            rays.push(ray);
            expected.push(brute::nearest(&mesh, &ray));
        }
    }

    let mut lines = vec![Line([0; 64]); Bvh::footprint(triangles.len()).bytes().div_ceil(64)];
    let mut arena = Arena::over(&mut lines);
    let bvh = Bvh::build(&mesh, &mut arena).expect("the footprint was granted");
    for level in Level::detect().and_below() {
        trace(&bvh, &mesh, level, &rays, &expected);
    }
    Ok(())
}

/// A ray from anywhere, or one towards a corner, an edge or the inside of a triangle.
fn ray(input: &mut Unstructured, mesh: &Mesh) -> Result<Ray> {
    let origin = Vec3::from(point(input)?);
    let [kind, triangle, u, v, end] = input.arbitrary::<[u8; 5]>()?;
    let direction = match kind % 4 {
        0 => Vec3::from(point(input)?),
        1 => [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_X][usize::from(u % 4)],
        _ if mesh.triangles.is_empty() => Vec3::Z,
        _ => {
            let [a, b, c] = mesh.corners(u32::from(triangle) % mesh.triangles.len() as u32);
            let (u, v) = (f32::from(u % 5) / 4.0, f32::from(v % 5) / 4.0);
            a + u * (b - a) + v * (c - a) - origin
        }
    };
    let t_max = match end {
        0..200 => f32::INFINITY,
        200..220 => 1.0,
        220..240 => f32::from(end - 219) * 0.25,
        240..250 => f32::NAN,
        _ => -1.0,
    };
    Ok(Ray::segment(origin, direction, t_max))
}

fn trace(bvh: &Bvh, mesh: &Mesh, level: Level, rays: &[Ray], expected: &[Hit]) {
    let singles: Vec<Hit> = rays.iter().map(|ray| bvh.nearest(level, ray)).collect();
    for ((ray, hit), expected) in rays.iter().zip(&singles).zip(expected) {
        against_brute_force(mesh, level, ray, hit, expected);
        assert_eq!(bvh.occluded(level, ray), hit.is_some(), "{level:?} occluded {ray:?}");
    }
    for coherence in [Coherence::Coherent, Coherence::Incoherent] {
        let mut hits = vec![Hit::NONE; rays.len()];
        bvh.nearest_batch(level, rays, coherence, &mut hits);
        let mut hidden = vec![7; rays.len()];
        bvh.occluded_batch(level, rays, &mut hidden);
        for (((ray, single), hit), hidden) in rays.iter().zip(&singles).zip(&hits).zip(&hidden) {
            assert_eq!(single, hit, "{level:?} {coherence:?} {ray:?}");
            assert_eq!(hidden, &u8::from(single.is_some()), "{level:?} {coherence:?} {ray:?}");
        }
    }
}

fn against_brute_force(mesh: &Mesh, level: Level, ray: &Ray, hit: &Hit, best: &Hit) {
    if best == hit {
        return;
    }
    let context = || format!("{level:?} {ray:?}: {hit:?}, brute force {best:?}");
    if !hit.is_some() {
        // Boxes are as tight as their triangles: a ray through a corner or an edge may miss them by a
        // rounding.
        let on_edge = best.u == 0.0 || best.v == 0.0 || best.u + best.v >= 1.0 - TIE;
        return assert!(best.is_some() && on_edge, "{}", context());
    }
    assert!(best.is_some(), "{}", context());
    // Brute force hits this triangle at the same distance, which is no farther than its nearest.
    let corners = mesh.corners(hit.triangle).map(|corner| corner.to_array());
    assert_eq!(brute::intersect(ray, corners), Some((hit.t, hit.u, hit.v)), "{}", context());
    assert!((hit.t - best.t).abs() <= TIE * best.t, "{}", context());
}

/// Whether the reference's distances are more than rounding: the areas of a needle seen edge-on are noise,
/// and so are distances derived from them.
fn well_conditioned(mesh: &Mesh, ray: &Ray) -> bool {
    (0..mesh.triangles.len() as u32).all(|triangle| {
        let corners = mesh.corners(triangle);
        let Some((t, ..)) = brute::intersect(ray, corners.map(|corner| corner.to_array())) else {
            return true;
        };
        let [a, b, c] = corners.map(|p| p.to_array().map(f64::from));
        let from = |p: [f64; 3]| DVec3::from_array(core::array::from_fn(|i| p[i] - f64::from(ray.origin[i])));
        let [a, b, c] = [from(a), from(b), from(c)];
        let normal = (b - a).cross(c - a);
        let direction = DVec3::from_array(ray.direction.map(f64::from));
        let exact = normal.dot(a) / normal.dot(direction);
        (exact - f64::from(t)).abs() <= NOISE * exact.abs()
    })
}
