//! Fraction of the rays of a point that first meet the back of a surface: about 1 inside a closed body.

use halflight_core::IrradiancePoint;
use halflight_core::bsdf::All;
use halflight_core::bvh::Coherence;
use halflight_core::geometry::{Hit, Ray};
use halflight_core::memory::OutOfMemory;
use halflight_core::method::Executor;
use halflight_core::sampling::warp::cosine_hemisphere;
use halflight_core::scene::{Mesh, SurfacePoint};
use halflight_core::transport::{Counters, SceneContext};

/// Rays of a point. All points have the same, so that neighbours differ by their surroundings alone.
const RAYS: usize = 64;

/// Points of a task.
const CHUNK: usize = 256;

/// Writes the fraction of back faces of each of `points` to `shares`. A pass that ends early leaves the rest
/// as they are.
pub(super) fn back_faces(
    context: &SceneContext<All>,
    points: &[IrradiancePoint],
    shares: &mut [f32],
    executor: &mut impl Executor,
) -> Result<(), OutOfMemory> {
    let directions = core::array::from_fn::<_, RAYS, _>(|i| {
        cosine_hemisphere([(i as f32 + 0.5) / RAYS as f32, (i as u32).reverse_bits() as f32 / 2f32.powi(32)])
    });
    let pieces = points.chunks(CHUNK).zip(shares.chunks_mut(CHUNK));
    let passed = executor.pass(pieces, |_, (points, shares), _| {
        for (point, share) in points.iter().zip(shares) {
            let point = point.settled(context);
            let surface = point.surface();
            let ray = |direction| surface.spawn(surface.frame.to_world(direction));
            let backs = count_backs(context, &surface, &directions.map(ray));
            *share = backs as f32 / RAYS as f32;
        }
        Ok(Counters::default())
    });
    passed.map(drop)
}

/// Number of `rays` from `surface` that meet the back of a triangle first. Those below the surface do not
/// count.
fn count_backs(context: &SceneContext<All>, surface: &SurfacePoint, rays: &[Ray; RAYS]) -> usize {
    let mut hits = [Hit::NONE; RAYS];
    context.bvh.nearest_batch(context.level, rays, Coherence::Incoherent, &mut hits);
    let is_above = |ray: &Ray| surface.geometric_normal.dot(ray.direction.into()) > 0.0;
    let meets_back = |(ray, hit): (&Ray, &Hit)| is_above(ray) && is_back(&context.scene.mesh, ray, hit);
    rays.iter().zip(&hits).map(meets_back).filter(|meets_back| *meets_back).count()
}

/// True if `ray` meets the back of a triangle at `hit`.
fn is_back(mesh: &Mesh, ray: &Ray, hit: &Hit) -> bool {
    let Some(triangle) = mesh.triangles.get(hit.triangle as usize) else { return false };
    let [a, b, c] = triangle.vertices.map(|vertex| glam::Vec3::from(mesh.positions[vertex as usize]));
    (b - a).cross(c - a).dot(ray.direction.into()) > 0.0
}
