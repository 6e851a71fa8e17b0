//! Irradiance caches as paths ask them: what a block of vertices has of reflected light is asked for at once, before
//! they are shaded.

use super::path::{BLOCK, Met, PathTracer};
use super::wave::Wave;
use crate::bsdf::Features;
use crate::cache::irradiance::{IrradianceCache, Points};
use core::ops::Range;

/// Irradiance caches, frozen.
#[derive(Clone, Copy)]
pub(super) enum Caches<'a> {
    /// Of even and of odd samples.
    Halves([&'a IrradianceCache<'a>; 2]),
    /// What there is of one so far: one record is enough for rays that are averaged.
    Growing(&'a IrradianceCache<'a>),
}

impl<'a, F: Features> PathTracer<'a, F> {
    /// Asks `caches` for the light that is reflected onto those of `block`, at the ends of rays of `range`, that may be
    /// diffuse.
    pub(super) fn ask(
        &self,
        caches: Caches,
        wave: &Wave,
        range: Range<usize>,
        block: &mut [Option<Met<'a>>; BLOCK],
    ) {
        let (mut points, mut known) = ([Points::NONE; 2], [None; BLOCK]);
        for (i, (ray, met)) in wave.rays[range].iter().zip(block.iter()).enumerate() {
            if let (Some(Met { point, .. }), Some(path)) = (met, wave.paths.get(ray.tag as usize))
                && point.material.surface.may_be_diffuse()
                && path.share.goes_on_from_rough()
                && (path.segments == 1 || !self.is_limited())
                && u32::from(path.segments) < self.settings.max_depth
            {
                let (position, normal) = (point.position, point.frame.normal);
                match caches {
                    Caches::Halves(_) => points[path.sample as usize & 1].set(i, position, normal),
                    Caches::Growing(cache) => known[i] = cache.roughly(position, normal),
                }
            }
        }
        if let Caches::Halves(caches) = caches {
            for (cache, points) in caches.into_iter().zip(&points) {
                cache.at_all(self.level, points, &mut known);
            }
        }
        for (met, known) in block.iter_mut().zip(known) {
            if let Some(met) = met {
                met.indirect = known;
            }
        }
    }
}
