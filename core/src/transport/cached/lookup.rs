//! Irradiance cache as an estimator of the path tracer: reflected light at diffuse vertices and at the bases
//! of coats, looked up for a block of vertices at once.

use crate::bsdf::{Bsdf, Features};
use crate::cache::irradiance::{CachedIrradiance, IrradianceCache, POINTS, Points, QueryPoint};
use crate::scene::SurfacePoint;
use crate::transport::cached::overhang;
use crate::transport::path::PathIntegrator;
use crate::transport::path::estimator::{KnownLight, LightEstimator, PathVertex, RemainingLight};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::path_classes::PathClasses;
use crate::transport::wavefront::{BLOCK, Wavefront};
use crate::{Level, Rgb};
use core::f32::consts::FRAC_1_PI;
use core::ops::Range;

const _: () = assert!(BLOCK == POINTS, "a block of vertices is looked up at once");

/// Number of light samples at a vertex whose indirect light comes from the cache.
const LIGHT_SAMPLES: u32 = 4;

/// Cosine-weighted fraction of the hemisphere below which light samples alone find the lights as well as with
/// BSDF sampling.
const SMALL: f32 = 0.1;

/// Weight of a base with a record beside its coat: the record has the base's indirect light, and light
/// samples find most of the rest.
const BASE_WEIGHT: f32 = 0.6;

/// Irradiance caches that paths look up.
#[derive(Clone, Copy)]
pub enum CacheView<'a> {
    /// Frozen caches of even and of odd samples.
    Pair([&'a IrradianceCache<'a>; 2]),
    /// A cache that is valid at every point and returns zero: paths then find the light that no cache
    /// supplies.
    Everywhere,
    /// One cache with its present records. The first valid record is enough for gather rays, which are
    /// averaged.
    UnderConstruction(&'a IrradianceCache<'a>),
}

impl CacheView<'_> {
    /// Looks up all `queries`, each with its sample number. Writes the distance up to which each is `exposed`
    /// ([`IrradianceCache::at_all`]).
    fn find<F: Features>(
        &self,
        level: Level,
        queries: &[Option<(QueryPoint, u32)>; BLOCK],
        found: &mut [Option<CachedIrradiance>; BLOCK],
        exposed: &mut [f32; BLOCK],
    ) {
        let queries = queries.iter().enumerate().filter_map(|(i, query)| Some((i, query.as_ref()?)));
        match self {
            CacheView::Pair(caches) => {
                let mut points = [Points::NONE; 2];
                queries.for_each(|(i, (query, sample))| points[*sample as usize & 1].set(i, query));
                for (cache, points) in caches.iter().zip(&points) {
                    let reach = match F::GLOSSY {
                        true => cache.at_all(level, points, found),
                        false => cache.at_all_without_coats(level, points, found),
                    };
                    exposed.iter_mut().zip(reach).for_each(|(exposed, reach)| *exposed = exposed.max(reach));
                }
            }
            CacheView::Everywhere => {
                let known = CachedIrradiance { irradiance: Rgb::ZERO, edge_moment: Rgb::ZERO, shining: 0.0 };
                queries.for_each(|(i, _)| found[i] = Some(known));
            }
            CacheView::UnderConstruction(cache) => {
                for (i, (query, _)) in queries {
                    let first = cache.first_valid(query);
                    found[i] = first.map(|(indirect, _)| indirect);
                    exposed[i] = first.map_or(0.0, |(_, exposed)| exposed);
                }
            }
        }
    }
}

/// Sample number of a path, if the path looks up the cache at `point`, the hit of its ray.
fn sample_of(wave: &Wavefront, ray: usize, point: &SurfacePoint, settings: &PathSettings) -> Option<u32> {
    let path = wave.paths.get(wave.rays.get(ray)?.tag as usize)?;
    let asks = point.material.surface.may_have_base()
        && path.classes.has_rough()
        && u32::from(path.segments) < settings.max_depth
        // Records do not store their distance from the camera.
        && (path.segments == 1 || !settings.is_limited());
    asks.then_some(path.sample)
}

impl<F: Features> LightEstimator<F> for CacheView<'_> {
    type State = ();
    type Found = Option<CachedIrradiance>;

    #[inline]
    fn light_samples(&self, context: &SceneContext<F>) -> u32 {
        match self {
            // With cut-outs each path has memory for one shadow ray.
            CacheView::Pair(_) | CacheView::Everywhere if !context.has_cutouts => LIGHT_SAMPLES,
            _ => 1,
        }
    }

    #[inline]
    fn separates_coat(&self, _: &SceneContext<F>, bsdf: &Bsdf, found: &Self::Found) -> bool {
        found.is_some() && bsdf.has_coated_base()
    }

    fn look_up(
        &self,
        (context, settings): (&SceneContext<F>, &PathSettings),
        (wave, range): (&Wavefront, Range<usize>),
        points: &[Option<SurfacePoint>; BLOCK],
        found: &mut [Option<CachedIrradiance>; BLOCK],
        counters: &mut Counters,
    ) {
        let mut exposed = [0.0; BLOCK];
        let asking: [Option<(&SurfacePoint, u32)>; BLOCK] = core::array::from_fn(|i| {
            let point = points[i].as_ref()?;
            Some((point, sample_of(wave, range.start + i, point, settings)?))
        });
        let open = |(point, sample): (&SurfacePoint, u32)| {
            (QueryPoint::open(point.position, point.frame.normal), sample)
        };
        self.find::<F>(context.level, &asking.map(|asking| asking.map(open)), found, &mut exposed);
        if exposed == [0.0; BLOCK] {
            return;
        }
        // Points below a close overhang are looked up again.
        let points = asking.map(|asking| asking.map(|(point, _)| point));
        let within = overhang::within(context, &points, &exposed, counters);
        let again = core::array::from_fn(|i| {
            let (query, sample) = asking[i].map(open).filter(|_| within[i] < exposed[i])?;
            Some((QueryPoint { within: within[i], ..query }, sample))
        });
        self.find::<F>(context.level, &again, found, &mut exposed);
    }

    #[inline]
    fn at_vertex(
        &self,
        (context, _): (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        _: &mut (),
        found: Option<CachedIrradiance>,
        add: &mut impl FnMut(KnownLight),
    ) -> RemainingLight {
        let PathVertex { throughput, ref bsdf, wo, apart, .. } = *vertex;
        let Some(indirect) = found else { return RemainingLight::all(vertex) };
        let contribution = match bsdf {
            Bsdf::Diffuse(diffuse) => throughput * diffuse.reflectance * indirect.irradiance * FRAC_1_PI,
            _ if F::GLOSSY && bsdf.has_coated_base() => {
                throughput * bsdf.base_radiance::<F>(wo, indirect.irradiance, indirect.edge_moment)
            }
            _ => return RemainingLight::all(vertex),
        };
        add(KnownLight { contribution, blur: Rgb::ZERO });
        // Light samples alone estimate direct light if few gather rays saw an emitter and nothing is
        // specular, but not with an environment, which is not sampled where it seemed hidden. Both cases take
        // several light samples.
        let has_environment = context.scene.environment.is_some();
        let ends = indirect.shining < SMALL && !context.has_mirrors && !has_environment;
        let light_samples = if ends || has_environment { self.light_samples(context) } else { 1 };
        let direct = RemainingLight { light_samples, ends, ..RemainingLight::of(PathClasses::DIRECT) };
        if !apart {
            return direct;
        }
        // The coat reflects all light.
        let base_weight = if ends { 0.0 } else { BASE_WEIGHT };
        RemainingLight { narrow: vertex.rest, base_weight, ..direct }
    }
}

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// This path tracer with caches of indirect light at diffuse vertices and bases of coats with a valid
    /// record: even samples use the first, odd samples the second. With a limit of depth only the first
    /// vertex of a path does, since records do not store their distance from the camera.
    pub fn with_caches(&self, caches: [&'a IrradianceCache<'a>; 2]) -> PathIntegrator<'a, F, CacheView<'a>> {
        self.with_estimator(CacheView::Pair(caches))
    }

    /// This path tracer without the light that a complete cache would supply.
    pub fn without_cached_light(&self) -> PathIntegrator<'a, F, CacheView<'a>> {
        self.with_estimator(CacheView::Everywhere)
    }

    /// This path tracer for gather rays, with the records that `cache` has so far.
    pub fn with_growing_cache(&self, cache: &'a IrradianceCache<'a>) -> PathIntegrator<'a, F, CacheView<'a>> {
        self.with_estimator(CacheView::UnderConstruction(cache))
    }
}
