//! The picture that the splats of a sample make, for methods with light paths or chains.

use super::executor::Executor;
use crate::film::{PIXELS_PER_TILE, Splat, StripOffsets, add_strip, strip_length};
use crate::memory::OutOfMemory;
use crate::transport::Counters;

/// Makes of `picture`, in the order of the film, the sums of the splats of all `tasks`, which are pairs of a
/// list sorted by strips and its offsets. Returns whether all were added before the executor was over.
pub(super) fn add_splats<'s>(
    executor: &mut impl Executor,
    picture: &mut [[f32; 3]],
    tasks: impl Iterator<Item = (&'s [Splat], &'s StripOffsets)> + Clone + Sync,
) -> Result<bool, OutOfMemory> {
    let length = strip_length(picture.len());
    let added = executor.pass(picture.chunks_mut(length), |strip, pixels, _| {
        add_strip(strip, length, tasks.clone(), pixels);
        Ok(Counters::default())
    })?;
    Ok(added.is_complete)
}

/// The part of `picture` for the pixels of `tile`; none of an empty picture.
pub(super) fn splats_of_tile(picture: &[[f32; 3]], tile: usize) -> &[[f32; 3]] {
    let first = tile * PIXELS_PER_TILE;
    picture.get(first..first + PIXELS_PER_TILE).unwrap_or_default()
}
