//! The look for lamps in mirrors and through glass, before the first sample: see [`halflight_core::transport::Images`].

use super::memory::Memory;
use super::workers::Workers;
use super::{RenderError, Settings};
use halflight_core::bsdf::Features;
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::transport::{Counters, Image, Images, MOST_IMAGES, PathTracer};

/// Finds the images of lamps in the tiles of `tracer`'s picture that are to be rendered, and keeps them in `lines`. They are for
/// speed alone: where there is no memory for them, the picture is made without.
pub(super) fn find<'m, F: Features>(
    tracer: &PathTracer<F>,
    settings: &Settings,
    workers: &Workers,
    memory: &mut Memory,
    lines: &'m mut Vec<Line>,
) -> Result<Images<'m>, RenderError> {
    if !tracer.may_have_images() {
        return Ok(Images::default());
    }
    let mut found: Vec<Vec<Image>> = vec![Vec::new(); tracer.tasks()];
    let find = |task: usize, _: &mut Arena, out: &mut [Vec<Image>]| -> Result<Counters, OutOfMemory> {
        let mut counters = Counters::default();
        if settings.shard.owns(task) {
            let mut images = [Image::default(); MOST_IMAGES];
            let count = tracer.find_images(task, &mut images, &mut counters);
            out.iter_mut().for_each(|out| *out = images[..count].to_vec());
        }
        Ok(counters)
    };
    let mut scratch = vec![Vec::new(); workers.count()];
    // Tiles that were not looked at see lamps as others do.
    workers.look(&mut found, 1, &mut scratch, &find)?;
    let count = found.iter().map(Vec::len).sum();
    let footprint = Images::footprint(found.len(), count);
    if count == 0 || !memory.has(footprint.bytes()) {
        return Ok(Images::default());
    }
    *lines = memory.take("images of lamps", footprint)?;
    let tiles = found.iter().map(Vec::as_slice);
    Ok(Images::new(tiles, &mut Arena::new(bytemuck::cast_slice_mut(lines)))?)
}
