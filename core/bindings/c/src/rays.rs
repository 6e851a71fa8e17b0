//! Ray traversal: hierarchy over triangles, nearest and any hits.

use crate::memory::{array, array_mut, bytes_of, place, shared};
use crate::mesh::HalflightMesh;
use crate::status::{HalflightStatus, of};
use core::ffi::c_void;
use halflight_core::Level;
use halflight_core::glam::Vec3;
use halflight_core::parts::rays::{Bvh, Coherence, Hit, Ray};

/// Rays that are converted at a time.
const CHUNK: usize = 256;

/// `triangle` of a ray that hits nothing.
pub const HALFLIGHT_MISS: u32 = u32::MAX;

/// Half-line from `origin` along `direction`, which need not be a unit vector.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightRay {
    /// Origin.
    pub origin: [f32; 3],
    /// Largest `t` of a hit, in lengths of `direction`; infinite for an unbounded ray.
    pub t_max: f32,
    /// Direction.
    pub direction: [f32; 3],
}

/// Hit of a ray.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightHit {
    /// Distance in lengths of the ray's direction; infinite without a hit.
    pub t: f32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
    /// Index of the triangle, or `HALFLIGHT_MISS`.
    pub triangle: u32,
}

/// Hierarchy over the triangles of a mesh.
pub struct HalflightBvh {
    bvh: Bvh<'static>,
    level: Level,
}

/// Bytes of the hierarchy of `mesh`, of which only the numbers of vertices and triangles matter; 0 of null.
///
/// # Safety
/// `mesh` is null or a mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_bvh_memory(mesh: *const HalflightMesh) -> usize {
    // SAFETY: by the caller.
    let Ok(mesh) = (unsafe { shared(mesh) }) else { return 0 };
    bytes_of::<HalflightBvh>(mesh.positions_alone().footprint().and(Bvh::footprint(mesh.triangles)))
}

/// Builds the hierarchy of `mesh` in `bytes` bytes at `memory`. It keeps nothing of the mesh: its arrays may
/// be freed.
///
/// # Safety
/// Pointers are null or of arrays as large as they say; `memory` belongs to the hierarchy from now on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_bvh_build(
    mesh: *const HalflightMesh,
    memory: *mut c_void,
    bytes: usize,
    bvh: *mut *mut HalflightBvh,
) -> HalflightStatus {
    let make = |arena: &mut halflight_core::Arena<'static>| {
        // SAFETY: by the caller.
        let mesh = unsafe { shared(mesh)?.positions_alone().copied(arena) }?;
        mesh.validate(usize::MAX).map_err(|_| HalflightStatus::Triangle)?;
        let level = Level::detect();
        Ok(HalflightBvh {
            bvh: Bvh::build_with(&mesh, arena, level, &halflight_core::parts::rays::Serial)?,
            level,
        })
    };
    // SAFETY: by the caller.
    of(unsafe { place((memory, bytes), bvh, make) })
}

/// Nearest hit of each of `count` rays. Rays that lie near each other in position and direction, such as
/// those of a camera tile by tile, are faster with `coherent`.
///
/// # Safety
/// `bvh` is a hierarchy; `rays` and `hits` have `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_bvh_nearest(
    bvh: *const HalflightBvh,
    rays: *const HalflightRay,
    count: usize,
    coherent: bool,
    hits: *mut HalflightHit,
) -> HalflightStatus {
    // SAFETY: by the caller.
    let arrays = unsafe { (|| Ok((shared(bvh)?, array(rays, count)?, array_mut(hits, count)?)))() };
    of(arrays.map(|(bvh, rays, hits)| {
        let coherence = if coherent { Coherence::Coherent } else { Coherence::Incoherent };
        for (rays, hits) in rays.chunks(CHUNK).zip(hits.chunks_mut(CHUNK)) {
            let mut found = [Hit::NONE; CHUNK];
            let found = &mut found[..rays.len()];
            bvh.nearest(rays, coherence, found);
            for (hit, found) in hits.iter_mut().zip(&*found) {
                let Hit { t, u, v, triangle } = *found;
                *hit = HalflightHit { t, u, v, triangle };
            }
        }
    }))
}

/// 1 in `occluded` for each of `count` rays that hits anything, otherwise 0.
///
/// # Safety
/// `bvh` is a hierarchy; `rays` and `occluded` have `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_bvh_occluded(
    bvh: *const HalflightBvh,
    rays: *const HalflightRay,
    count: usize,
    occluded: *mut u8,
) -> HalflightStatus {
    // SAFETY: by the caller.
    let arrays = unsafe { (|| Ok((shared(bvh)?, array(rays, count)?, array_mut(occluded, count)?)))() };
    of(arrays.map(|(HalflightBvh { bvh, level }, rays, occluded)| {
        for (rays, occluded) in rays.chunks(CHUNK).zip(occluded.chunks_mut(CHUNK)) {
            match rays {
                [ray] => occluded.fill(u8::from(bvh.occluded(*level, &of_core(ray)))),
                rays => bvh.occluded_batch(*level, &converted(rays)[..rays.len()], occluded),
            }
        }
    }))
}

impl HalflightBvh {
    fn nearest(&self, rays: &[HalflightRay], coherence: Coherence, hits: &mut [Hit]) {
        match (rays, &mut *hits) {
            ([ray], [hit]) => *hit = self.bvh.nearest(self.level, &of_core(ray)),
            _ => self.bvh.nearest_batch(self.level, &converted(rays)[..rays.len()], coherence, hits),
        }
    }
}

fn of_core(ray: &HalflightRay) -> Ray {
    Ray::segment(Vec3::from(ray.origin), Vec3::from(ray.direction), ray.t_max)
}

/// At most [`CHUNK`] rays in the layout of the core.
fn converted(rays: &[HalflightRay]) -> [Ray; CHUNK] {
    let mut converted = [Ray::segment(Vec3::ZERO, Vec3::X, -1.0); CHUNK];
    for (to, ray) in converted.iter_mut().zip(rays) {
        *to = of_core(ray);
    }
    converted
}
