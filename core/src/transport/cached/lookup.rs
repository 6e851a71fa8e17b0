//! Irradiance caches as paths ask them: what a block of vertices has of reflected light is asked for at once, before
//! they are shaded.

use crate::Level;
use crate::bsdf::Features;
use crate::cache::irradiance::{CachedIrradiance, IrradianceCache, Points, QueryPoint};
use crate::geometry::Ray;
use crate::scene::SurfacePoint;
use crate::transport::estimator::Counters;
use crate::transport::path::state::{PathState, Wavefront};
use crate::transport::path::{BLOCK, PathIntegrator, SurfaceInteraction};
use core::ops::Range;

/// Irradiance caches, frozen.
#[derive(Clone, Copy)]
pub(in crate::transport) enum CacheView<'a> {
    /// Of even and of odd samples.
    Pair([&'a IrradianceCache<'a>; 2]),
    /// What there is of one so far: one record is enough for rays that are averaged.
    UnderConstruction(&'a IrradianceCache<'a>),
}

impl CacheView<'_> {
    /// What is `known` of those of `askers` that there are, each with its sample, and how far each is
    /// `exposed` ([`IrradianceCache::at_all`]).
    fn ask(
        &self,
        level: Level,
        askers: &[Option<(QueryPoint, u32)>; BLOCK],
        known: &mut [Option<CachedIrradiance>; BLOCK],
        exposed: &mut [f32; BLOCK],
    ) {
        let askers = askers.iter().enumerate().filter_map(|(i, asker)| Some((i, asker.as_ref()?)));
        match self {
            CacheView::Pair(caches) => {
                let mut points = [Points::NONE; 2];
                askers.for_each(|(i, (asker, sample))| points[*sample as usize & 1].set(i, asker));
                for (cache, points) in caches.iter().zip(&points) {
                    let found = cache.at_all(level, points, known);
                    exposed.iter_mut().zip(found).for_each(|(exposed, found)| *exposed = exposed.max(found));
                }
            }
            CacheView::UnderConstruction(cache) => {
                for (i, (asker, _)) in askers {
                    let found = cache.first_valid(asker);
                    known[i] = found.map(|(indirect, _)| indirect);
                    exposed[i] = found.map_or(0.0, |(_, exposed)| exposed);
                }
            }
        }
    }
}

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// Asks `caches` for the light that is reflected onto those of `block`, at the ends of rays of `range`, that may be
    /// diffuse.
    pub(in crate::transport) fn ask(
        &self,
        caches: CacheView,
        wave: &Wavefront,
        range: Range<usize>,
        block: &mut [Option<SurfaceInteraction<'a>>; BLOCK],
        counters: &mut Counters,
    ) {
        let (mut known, mut exposed) = ([None; BLOCK], [0.0; BLOCK]);
        let rays = &wave.rays[range.clone()];
        let askers: [Option<(&SurfacePoint, u32)>; BLOCK] = core::array::from_fn(|i| {
            let (SurfaceInteraction { point, .. }, path) = self.asks(wave, rays.get(i)?, block.get(i)?)?;
            (path.segments == 1 || !self.is_limited()).then_some((point, path.sample))
        });
        let open = |(point, sample): (&SurfacePoint, u32)| {
            (QueryPoint::open(point.position, point.frame.normal), sample)
        };
        caches.ask(self.context.level, &askers.map(|asker| asker.map(open)), &mut known, &mut exposed);
        if exposed != [0.0; BLOCK] {
            // Those that something hangs close over ask once more.
            let points = askers.map(|asker| asker.map(|(point, _)| point));
            let within = self.within(&points, &exposed, counters);
            let again = core::array::from_fn(|i| {
                let (asker, sample) = askers[i].map(open).filter(|_| within[i] < exposed[i])?;
                Some((QueryPoint { within: within[i], ..asker }, sample))
            });
            caches.ask(self.context.level, &again, &mut known, &mut exposed);
        }
        for (met, known) in block.iter_mut().zip(known).take(range.len()) {
            if let Some(met) = met {
                met.indirect = known;
            }
        }
    }

    /// The vertex that a ray has met and its path, where they may ask.
    fn asks<'b>(
        &self,
        wave: &'b Wavefront,
        ray: &Ray,
        met: &'b Option<SurfaceInteraction<'a>>,
    ) -> Option<(&'b SurfaceInteraction<'a>, &'b PathState)> {
        met.as_ref().zip(wave.paths.get(ray.tag as usize)).filter(|(met, path)| {
            met.point.material.surface.may_be_diffuse()
                && path.share.goes_on_from_rough()
                && u32::from(path.segments) < self.settings.max_depth
        })
    }
}
