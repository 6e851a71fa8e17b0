//! Irradiance caches as paths ask them: what a block of vertices has of reflected light is asked for at once, before
//! they are shaded. Where caches do not know it, photons may.

use super::path::{BLOCK, Met, PathTracer};
use super::wave::{Path, Share, Wave};
use crate::bsdf::Features;
use crate::cache::irradiance::{Indirect, IrradianceCache, Points};
use crate::geometry::Ray;
use crate::scene::SurfacePoint;
use core::f32::consts::FRAC_1_PI;
use core::ops::Range;
use glam::Vec3;

/// The greatest density, per steradian, by which a direction is drawn where its ray may end in photons: what looks into
/// all directions sees the mean of what they blur.
const DIFFUSE: f32 = 1.001 * FRAC_1_PI;

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
        for (i, (ray, met)) in wave.rays[range.clone()].iter().zip(block.iter()).enumerate() {
            if let Some((Met { point, .. }, path)) = self.asks(wave, ray, met)
                && (path.segments == 1 || !self.is_limited())
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
        for ((ray, met), known) in wave.rays[range].iter().zip(block.iter_mut()).zip(&mut known) {
            if known.is_none()
                && let Some((Met { point, .. }, path)) = self.asks(wave, ray, met)
            {
                *known = self.bounced(ray, point, path);
            }
            if let Some(met) = met {
                met.indirect = *known;
            }
        }
    }

    /// The vertex that a ray has met and its path, where they may ask.
    fn asks<'b>(
        &self,
        wave: &'b Wave,
        ray: &Ray,
        met: &'b Option<Met<'a>>,
    ) -> Option<(&'b Met<'a>, &'b Path)> {
        met.as_ref().zip(wave.paths.get(ray.tag as usize)).filter(|(met, path)| {
            met.point.material.surface.may_be_diffuse()
                && path.share.goes_on_from_rough()
                && u32::from(path.segments) < self.settings.max_depth
        })
    }

    /// What photons say of light that was reflected before, where a ray comes from a diffuse surface.
    fn bounced(&self, ray: &Ray, point: &SurfacePoint, path: &Path) -> Option<Indirect> {
        let photons = self.bounced?;
        let gathers = path.share == Share::REFLECTED;
        if !(gathers || path.pdf <= DIFFUSE) || self.is_limited() && path.segments != 2 {
            return None;
        }
        let distance = Vec3::from(ray.origin).distance(point.position);
        let which = &photons[if gathers { 0 } else { path.sample as usize & 1 }];
        let (irradiance, _) = which.irradiance((self.bvh, self.level), point, distance)?;
        // One of many rays: shadow rays will do.
        Some(Indirect { irradiance, shining: 0.0 })
    }
}
