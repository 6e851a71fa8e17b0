//! Nearest points: a kd-tree over points (the photon search of the core), and their nearest neighbours.

use crate::memory::{Strided, array, array_mut, bytes_of, place, shared};
use crate::status::{HalflightStatus, of};
use core::ffi::c_void;
use halflight_core::Level;
use halflight_core::glam::Vec3;
use halflight_core::memory::Arena;
use halflight_core::parts::photons::{Neighbours, Photon, PhotonMap, Photons};

/// Most neighbours of a search.
pub const HALFLIGHT_MOST_NEIGHBOURS: usize = 1024;

/// Index of the rest of a row with fewer neighbours than were asked for.
pub const HALFLIGHT_NO_POINT: u32 = u32::MAX;

/// A kd-tree over points.
pub struct HalflightPoints {
    map: PhotonMap<'static>,
}

/// Bytes of a tree over `count` points.
#[unsafe(no_mangle)]
pub extern "C" fn halflight_points_memory(count: usize) -> usize {
    bytes_of::<HalflightPoints>(Photons::footprint(count))
}

/// Builds a tree over `count` points x, y, z, `stride` bytes apart (0: they follow each other), in `bytes`
/// bytes at `memory`. It keeps a copy of the points. Points that are not finite are never found.
///
/// # Safety
/// `positions` has `count` points; `memory` belongs to the tree from now on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_points_build(
    positions: *const f32,
    count: usize,
    stride: usize,
    memory: *mut c_void,
    bytes: usize,
    points: *mut *mut HalflightPoints,
) -> HalflightStatus {
    let make = |arena: &mut Arena<'static>| {
        if count >= HALFLIGHT_NO_POINT as usize {
            return Err(HalflightStatus::Size);
        }
        let positions = Strided::<[f32; 3]>::new(positions, count, stride)?;
        let mut photons = Photons::new(count, arena)?;
        for (index, photon) in photons.as_mut_slice().iter_mut().enumerate() {
            // SAFETY: `index` is below `count`, of which the caller has points.
            let position = unsafe { positions.get(index) };
            *photon = Photon::tagged(Vec3::from(position), Vec3::Z, Vec3::Z, index as u32);
        }
        Ok(HalflightPoints { map: photons.build(count) })
    };
    // SAFETY: by the caller.
    of(unsafe { place((memory, bytes), points, make) })
}

/// Bytes of the working memory of searches for `k` neighbours.
#[unsafe(no_mangle)]
pub extern "C" fn halflight_nearest_memory(k: usize) -> usize {
    bytes_of::<()>(Neighbours::footprint(k))
}

/// For each of `count` places x, y, z the at most `k` points nearest to it within `radius`, which may be
/// infinite: a row of `k` indices of points, and squared distances, nearest first. The rest of a row has
/// `HALFLIGHT_NO_POINT` and infinity. `work` has `work_bytes` bytes of working memory of this call alone.
///
/// # Safety
/// `points` is a tree; `places` has 3 numbers for each of `count`, `indices` and `squared_distances` have
/// `k`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn halflight_points_nearest(
    points: *const HalflightPoints,
    places: *const f32,
    count: usize,
    k: usize,
    radius: f32,
    work: *mut c_void,
    work_bytes: usize,
    indices: *mut u32,
    squared_distances: *mut f32,
) -> HalflightStatus {
    if k == 0 || k > HALFLIGHT_MOST_NEIGHBOURS {
        return HalflightStatus::Setting;
    }
    let Some(all) = count.checked_mul(k) else { return HalflightStatus::Size };
    // SAFETY: by the caller; arrays of floats have the alignment of their elements.
    let search = || unsafe {
        let (map, places) = (&shared(points)?.map, array(places.cast::<[f32; 3]>(), count)?);
        let (indices, distances) = (array_mut(indices, all)?, array_mut(squared_distances, all)?);
        let mut work = Arena::new(array_mut(work.cast::<u8>(), work_bytes)?);
        let mut neighbours = Neighbours::new(k, &mut work)?;
        let rows = indices.chunks_mut(k).zip(distances.chunks_mut(k));
        for (place, (indices, distances)) in places.iter().zip(rows) {
            map.nearest(Level::detect(), Vec3::from(*place), radius, &mut neighbours);
            write_row(map, &neighbours, indices, distances);
        }
        Ok(())
    };
    of(search())
}

/// Writes the neighbours of a place into its row, nearest first; of equal distances the lower index.
fn write_row(map: &PhotonMap, neighbours: &Neighbours, indices: &mut [u32], distances: &mut [f32]) {
    indices.fill(HALFLIGHT_NO_POINT);
    distances.fill(f32::INFINITY);
    for (filled, (index, distance)) in neighbours.iter().enumerate() {
        let tag = map.get(index).map_or(HALFLIGHT_NO_POINT, |photon| photon.tag());
        // Insertion into the sorted part of the row.
        let mut at = filled.min(indices.len() - 1);
        while at > 0 && (distance, tag) < (distances[at - 1], indices[at - 1]) {
            (distances[at], indices[at]) = (distances[at - 1], indices[at - 1]);
            at -= 1;
        }
        (distances[at], indices[at]) = (distance, tag);
    }
}
