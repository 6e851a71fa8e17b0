//! Light vertices of a pass: those of all tasks in a row, and the photon map of them.

use super::PhotonMapStore;
use super::executor::{Executor, Passed};
use crate::bsdf::Features;
use crate::memory::OutOfMemory;
use crate::transport::bidirectional::light_pass::{TaskOutput, VERTICES_PER_TASK};
use crate::transport::bidirectional::vertex::LightVertex;
use crate::transport::{Counters, SceneContext};

/// Photons that a task brings to the map.
const PIECE: usize = 4096;

/// Moves the vertices of all tasks, each with room for [`VERTICES_PER_TASK`], to the front, in task order.
/// Returns their number.
pub(super) fn compact(vertices: &mut [LightVertex], outputs: &[TaskOutput]) -> usize {
    let mut stored = 0;
    for (task, output) in outputs.iter().enumerate() {
        let first = task * VERTICES_PER_TASK;
        let count = output.vertices as usize;
        if count > 0 {
            vertices.copy_within(first..first + count, stored);
        }
        stored += count;
    }
    stored
}

/// Makes the map of the photons of `vertices`, tagged by their index.
///
/// # Errors
/// Those of [`PhotonMapStore::fill`].
pub(super) fn map<F: Features>(
    store: &mut PhotonMapStore,
    executor: &mut impl Executor,
    scene: &SceneContext<F>,
    vertices: &[LightVertex],
) -> Result<Passed, OutOfMemory> {
    store.fill(executor, (vertices.len(), PIECE), |piece, _, photons| {
        let rest = vertices.get(piece * PIECE..).unwrap_or_default();
        for (i, (photon, vertex)) in photons.iter_mut().zip(rest).enumerate() {
            *photon = vertex.photon(scene, (piece * PIECE + i) as u32);
        }
        Ok(Counters::default())
    })
}
