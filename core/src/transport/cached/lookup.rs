//! Irradiance cache as an estimator of the path tracer: reflected light at diffuse vertices, at the bases of
//! coats and of served lobes, looked up for a block of vertices at once.

use crate::bsdf::{Bsdf, Features};
use crate::cache::irradiance::Viewer;
use crate::cache::irradiance::{CachedIrradiance, IrradianceCache, POINTS, Points, QueryPoint};
use crate::cache::radiance::{RecordCoefficients, ServedLobes};
use crate::cache::view::ViewRecords;
use crate::scene::SurfacePoint;
use crate::transport::cached::{overhang, view};
use crate::transport::path::PathIntegrator;
use crate::transport::path::estimator::{KnownLight, LightEstimator, PathVertex, RemainingLight};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::path_classes::PathClasses;
use crate::transport::wavefront::Wavefront;
use crate::{Level, Rgb};
use core::f32::consts::FRAC_1_PI;
use core::ops::Range;
use glam::Vec3;
use halflight_simd::kernels::shade::BLOCK;

const _: () = assert!(BLOCK == POINTS, "a block of vertices is looked up at once");

/// Number of light samples at a vertex whose indirect light comes from the cache.
const LIGHT_SAMPLES: u32 = 4;

/// Cosine-weighted fraction of the hemisphere below which light samples alone find the lights as well as with
/// BSDF sampling.
const SMALL: f32 = 0.1;

/// Weight of a base with a record beside its coat: the record has the base's indirect light, and light
/// samples find most of the rest.
const BASE_WEIGHT: f32 = 0.6;

/// Light that records supply at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub struct CachedLight {
    /// Irradiance and moments, with a valid record.
    irradiance: Option<CachedIrradiance>,
    /// Radiance that the lobe of the surface reflects, if a valid record serves it.
    lobe: Option<Rgb>,
    /// The same of a narrow lobe that the camera sees, by view-bound records.
    view: Option<Rgb>,
}

/// Lobes whose light records supply beside the irradiance.
#[derive(Clone, Copy, Default)]
pub struct SuppliedLobes<'a> {
    /// Lobes of records with coefficients.
    pub wide: Option<&'a ServedLobes<'a>>,
    /// True if view-bound records serve narrow lobes that the camera sees.
    pub narrow: bool,
}

/// Irradiance caches that paths look up.
#[derive(Clone, Copy)]
pub enum CacheView<'a> {
    /// Frozen caches of even and of odd samples.
    Pair([&'a IrradianceCache<'a>; 2]),
    /// The same, with view-bound records of even and of odd samples.
    WithViews([&'a IrradianceCache<'a>; 2], [&'a ViewRecords<'a>; 2]),
    /// Records that are valid at every point and return zero: paths then find the light that no record
    /// supplies.
    Everywhere(SuppliedLobes<'a>),
    /// One cache with its present records. The first valid record is enough for gather rays, which are
    /// averaged.
    UnderConstruction(&'a IrradianceCache<'a>),
}

impl CacheView<'_> {
    /// Lobes that the records serve.
    fn lobes(&self) -> Option<&ServedLobes<'_>> {
        match self {
            CacheView::Pair([cache, _])
            | CacheView::WithViews([cache, _], _)
            | CacheView::UnderConstruction(cache) => cache.coefficients().map(RecordCoefficients::lobes),
            CacheView::Everywhere(supplied) => supplied.wide,
        }
    }

    /// True if view-bound records may supply light.
    fn has_views(&self) -> bool {
        matches!(self, CacheView::WithViews(..) | CacheView::Everywhere(SuppliedLobes { narrow: true, .. }))
    }

    /// Radiance that the lobe at `point` reflects in the direction `viewer`, if it is served and a valid
    /// record has coefficients.
    fn reflected<F: Features>(
        &self,
        context: &SceneContext<F>,
        point: &SurfacePoint,
        (query, sample): (&QueryPoint, u32),
        viewer: Vec3,
    ) -> Option<Rgb> {
        let lobes = self.lobes()?;
        let cos = viewer.dot(query.normal);
        let lobe = &lobes.find(&context.bsdf_at(point), cos)?;
        let viewer = Viewer { lobe, direction: viewer };
        match self {
            CacheView::Pair(caches) | CacheView::WithViews(caches, _) => {
                caches[sample as usize & 1].reflected(context.level, query, &viewer, false)
            }
            CacheView::UnderConstruction(cache) => cache.reflected(context.level, query, &viewer, true),
            CacheView::Everywhere(_) => Some(Rgb::ZERO),
        }
    }

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
            CacheView::Pair(caches) | CacheView::WithViews(caches, _) => {
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
            CacheView::Everywhere(_) => {
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
fn sample_of(
    wave: &Wavefront,
    ray: usize,
    point: &SurfacePoint,
    lobes: Option<&ServedLobes>,
    settings: &PathSettings,
) -> Option<u32> {
    let path = wave.paths.get(wave.rays.get(ray)?.tag as usize)?;
    let surface = &point.material.surface;
    let asks = (surface.may_have_base() || lobes.is_some_and(|lobes| lobes.may_serve(surface)))
        && path.classes.has_rough()
        && u32::from(path.segments) < settings.max_depth
        // Records do not store their distance from the camera.
        && (path.segments == 1 || !settings.is_limited());
    asks.then_some(path.sample)
}

impl<F: Features> LightEstimator<F> for CacheView<'_> {
    type State = ();
    type Found = CachedLight;
    const LOOKS_UP_POINTS: bool = true;

    #[inline]
    fn light_samples(&self, context: &SceneContext<F>) -> u32 {
        match self {
            // With cut-outs each path has memory for one shadow ray.
            CacheView::Pair(_) | CacheView::WithViews(..) | CacheView::Everywhere(_)
                if !context.has_cutouts =>
            {
                LIGHT_SAMPLES
            }
            _ => 1,
        }
    }

    #[inline]
    fn separates_coat(&self, _: &SceneContext<F>, bsdf: &Bsdf, found: &Self::Found) -> bool {
        let has_lobe = found.lobe.or(found.view).is_some();
        found.irradiance.is_some() && !has_lobe && bsdf.has_coated_base()
    }

    fn look_up(
        &self,
        (context, settings): (&SceneContext<F>, &PathSettings),
        (wave, range): (&Wavefront, Range<usize>),
        points: &[Option<SurfacePoint>; BLOCK],
        found: &mut [CachedLight; BLOCK],
        counters: &mut Counters,
    ) {
        let lobes = if F::GLOSSY { self.lobes() } else { None };
        let (mut exposed, mut irradiance) = ([0.0; BLOCK], [None; BLOCK]);
        let asking: [Option<(&SurfacePoint, u32)>; BLOCK] = core::array::from_fn(|i| {
            let point = points[i].as_ref()?;
            Some((point, sample_of(wave, range.start + i, point, lobes, settings)?))
        });
        let open = |(point, sample): (&SurfacePoint, u32)| {
            (QueryPoint::open(point.position, point.frame.normal), sample)
        };
        let mut queries = asking.map(|asking| asking.map(open));
        self.find::<F>(context.level, &queries, &mut irradiance, &mut exposed);
        if exposed != [0.0; BLOCK] {
            // Points below a close overhang are looked up again.
            let points = asking.map(|asking| asking.map(|(point, _)| point));
            let within = overhang::within(context, &points, &exposed, counters);
            let again = core::array::from_fn(|i| {
                let (query, sample) = queries[i].filter(|_| within[i] < exposed[i])?;
                Some((QueryPoint { within: within[i], ..query }, sample))
            });
            self.find::<F>(context.level, &again, &mut irradiance, &mut exposed);
            queries = core::array::from_fn(|i| again[i].or(queries[i]));
        }
        found.iter_mut().zip(irradiance).for_each(|(found, known)| found.irradiance = known);
        if lobes.is_some() {
            for (i, query) in queries.iter().enumerate() {
                if let Some((query, sample)) = query
                    && let Some(point) = points[i].as_ref().filter(|_| irradiance[i].is_some())
                    && let Some(ray) = wave.rays.get(range.start + i)
                {
                    let viewer = -Vec3::from(ray.direction);
                    found[i].lobe = self.reflected(context, point, (query, *sample), viewer);
                }
            }
        }
        if F::GLOSSY && self.has_views() {
            for ((found, point), i) in found.iter_mut().zip(points).zip(range) {
                if let Some(point) = point.as_ref().filter(|_| found.lobe.is_none()) {
                    found.view = match self {
                        CacheView::WithViews(_, views) => {
                            view::reflected((context, settings), views, (wave, i), point)
                        }
                        _ => view::is_seen((context, settings), (wave, i), point).then_some(Rgb::ZERO),
                    };
                }
            }
        }
    }

    #[inline]
    fn at_vertex(
        &self,
        (context, _): (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        _: &mut (),
        found: CachedLight,
        add: &mut impl FnMut(KnownLight),
    ) -> RemainingLight {
        let PathVertex { throughput, ref bsdf, wo, apart, .. } = *vertex;
        let has_base = F::GLOSSY && bsdf.has_coated_base();
        if F::GLOSSY
            && let Some(lobe) = found.lobe.or(found.view)
            && (found.irradiance.is_some() || !has_base)
        {
            let base = match found.irradiance {
                Some(CachedIrradiance { irradiance, edge_moment, .. }) if has_base => {
                    bsdf.base_radiance(wo, irradiance, edge_moment)
                }
                _ => Rgb::ZERO,
            };
            add(KnownLight { contribution: throughput * (lobe + base), blur: Rgb::ZERO });
            // One direction of a narrow lobe finds the lamps that it mirrors, light samples seldom.
            let is_narrow = found.view.is_some() && !has_base;
            let light_samples = if is_narrow { 1 } else { self.light_samples(context) };
            return RemainingLight { light_samples, ..RemainingLight::of(PathClasses::DIRECT) };
        }
        let Some(indirect) = found.irradiance else { return RemainingLight::all(vertex) };
        let contribution = match bsdf {
            Bsdf::Diffuse(diffuse) => throughput * diffuse.reflectance * indirect.irradiance * FRAC_1_PI,
            _ if has_base => throughput * bsdf.base_radiance(wo, indirect.irradiance, indirect.edge_moment),
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

    /// [`PathIntegrator::with_caches`] with view-bound records of even and of odd samples.
    pub fn with_views(
        &self,
        caches: [&'a IrradianceCache<'a>; 2],
        views: [&'a ViewRecords<'a>; 2],
    ) -> PathIntegrator<'a, F, CacheView<'a>> {
        self.with_estimator(CacheView::WithViews(caches, views))
    }

    /// This path tracer without the light that complete caches would supply, of irradiance and of `lobes`.
    pub fn without_cached_light<'b>(&self, lobes: SuppliedLobes<'b>) -> PathIntegrator<'a, F, CacheView<'b>> {
        self.with_estimator(CacheView::Everywhere(lobes))
    }

    /// This path tracer for gather rays, with the records that `cache` has so far.
    pub fn with_growing_cache(&self, cache: &'a IrradianceCache<'a>) -> PathIntegrator<'a, F, CacheView<'a>> {
        self.with_estimator(CacheView::UnderConstruction(cache))
    }
}
