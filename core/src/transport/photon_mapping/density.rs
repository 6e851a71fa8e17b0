//! Path tracing with photon maps: reflected light by density estimation, direct light by shadow rays.

use crate::bsdf::{Bsdf, Features};
use crate::bvh::Bvh;
use crate::bvh::clearance::{Clearance, ClearanceQuery};
use crate::geometry::Ray;
use crate::photon::{
    DensityEstimate, FLATNESS, Kernel, KernelBoundary, MOST_REMAINING, PROBES, PhotonMap, QueryDisc, Uniform,
};
use crate::scene::SurfacePoint;
use crate::transport::path::PathIntegrator;
use crate::transport::path::estimator::{KnownLight, LightEstimator, PathVertex, RemainingLight};
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::settings::PathSettings;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::path_classes::PathClasses;
use crate::{Level, Rgb};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Minimum cosine of a photon's direction, whose precision is no better.
pub(in crate::transport) const GRAZING: f32 = 0.01;

/// Slope of the probes for walls. Lower obstacles are steps, not walls, and a surface that bends less is no
/// wall either.
const PROBE_SLOPE: f32 = 0.1;

/// Directions of probes for overhangs: up, and at 45 degrees to four sides.
const OVERHANG_DIRECTIONS: [Vec3; 5] = {
    const D: f32 = core::f32::consts::FRAC_1_SQRT_2;
    let way = Vec3::new;
    [Vec3::Z, way(D, 0.0, D), way(0.0, D, D), way(-D, 0.0, D), way(0.0, -D, D)]
};

/// Minimum radius of a disc under an overhang, as a fraction of its radius; with less, a photon would be a
/// firefly.
const MIN_OVERHANG_RADIUS: f32 = 0.125;

/// Fraction of the way to a wall at which the surface is tested.
const EDGE_TEST_FRACTION: f32 = 0.99;

/// Bisection steps to the edge of a surface: precision is a sixteenth of the radius.
const BISECTIONS: u32 = 4;

/// Photon map as an estimator of camera paths.
#[derive(Clone, Copy)]
pub struct PhotonLight<'a> {
    map: &'a PhotonMap<'a>,
    discs: RadiusSchedule,
    kernel: Kernel,
    /// True if most discs hold no photon, so that a disc is first tested for photons.
    is_sparse: bool,
    /// Number of photons that a disc needs.
    min_photons: f32,
}

impl<'a> PhotonLight<'a> {
    /// Photon map with density estimates over `discs`.
    pub fn new(map: &'a PhotonMap<'a>, discs: RadiusSchedule) -> Self {
        Self { map, discs, kernel: Kernel::default(), is_sparse: false, min_photons: f32::INFINITY }
    }

    /// This map with another `kernel`.
    pub fn with_kernel(self, kernel: Kernel) -> Self {
        Self { kernel, ..self }
    }

    /// This map with discs no wider than `min_photons` evenly spread photons require; an eighth of the radius
    /// may do where photons are dense.
    pub fn with_min_photons(self, min_photons: f32) -> Self {
        Self { min_photons, ..self }
    }

    /// This map for caustics, which lie on few surfaces.
    pub fn of_caustics(self) -> Self {
        Self { is_sparse: true, ..self }
    }

    /// Radiance of reflected light from `point` to `wo`, at the end of a path of length `travelled` from the
    /// camera; `None` if surfaces like `bsdf` store no photons. `remaining` segments are those that the path
    /// of a photon has left at least. `rotation`, from 0 to 1, rotates the probes for walls, which are not
    /// counted as rays.
    #[inline]
    pub(in crate::transport) fn reflected<F: Features>(
        &self,
        context: &SceneContext<F>,
        (point, bsdf): (&SurfacePoint, &Bsdf),
        (wo, travelled): (Vec3, f32),
        remaining: u32,
        rotation: f32,
    ) -> Option<RadianceEstimate> {
        if !bsdf.gathers_photons(context.separates_coats()) {
            return None;
        }
        let disc = QueryDisc {
            place: point.position,
            normal: point.geometric_normal,
            radius: self.discs.radius_after(travelled, point.position),
            kernel: self.kernel,
        };
        let map = &self.map.with_remaining(remaining);
        let density = self.is_sparse.then(|| map.gather(context.level, &disc, &Uniform(Rgb::ONE)));
        if density.is_some_and(|density| density.photons == 0) {
            return Some(RadianceEstimate::default());
        }
        let light = Light { map, is_caustic: self.is_sparse, min_photons: self.min_photons };
        Some(reflected(light, context, (&disc, density), (point, bsdf), wo, rotation))
    }
}

impl<F: Features> LightEstimator<F> for PhotonLight<'_> {
    type State = ();
    type Found = ();

    #[inline]
    fn separates_coat(&self, context: &SceneContext<F>, bsdf: &Bsdf, _: &()) -> bool {
        bsdf.gathers_photons_on_base(context.separates_coats())
    }

    /// Surfaces with a diffuse part take all reflected light from photons. With a limit of depth vertices do
    /// up to [`MOST_REMAINING`] segments behind the first, the largest length that photons tell.
    #[inline]
    fn at_vertex(
        &self,
        (context, settings): (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        _: &mut (),
        _: (),
        add: &mut impl FnMut(KnownLight),
    ) -> RemainingLight {
        let mut rest = RemainingLight::all(vertex);
        let remaining = settings.extra_segments(vertex.segments);
        if remaining > MOST_REMAINING {
            return rest;
        }
        let rotation = vertex.sampler.single(dimension::PROBES + vertex.segments);
        let from = (vertex.wo, vertex.travelled);
        let surface = (vertex.point, &vertex.bsdf);
        let reflected = self.reflected(context, surface, from, remaining, rotation);
        add(reflected.unwrap_or_default().known(vertex));
        if reflected.is_some() {
            rest.wide = Some(PathClasses::EMITTED);
        }
        rest
    }
}

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// This path tracer with photons: surfaces with a diffuse part take reflected light from photons. With a
    /// limit of depth vertices do up to [`MOST_REMAINING`] segments behind the first.
    pub fn with_photons(&self, photons: PhotonLight<'a>) -> PathIntegrator<'a, F, PhotonLight<'a>> {
        self.with_estimator(photons)
    }
}

/// Radiance of a density estimate.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::transport) struct RadianceEstimate {
    pub(in crate::transport) light: Rgb,
    /// Expected blur: the difference to a disc of half the radius, times 4/3, since in smooth light the finer
    /// disc has a quarter of the blur.
    pub(in crate::transport) blur: Rgb,
}

impl RadianceEstimate {
    /// Light for the estimator at `vertex`.
    #[inline]
    pub(in crate::transport) fn known(self, vertex: &PathVertex) -> KnownLight {
        KnownLight { contribution: vertex.throughput * self.light, blur: self.blur }
    }

    /// Density estimate over the smallest disc of `min_photons` photons.
    fn of(density: DensityEstimate, min_photons: f32, response: Rgb) -> Self {
        let [chosen, finer] = density.of_finest_disc(min_photons);
        Self { light: chosen * response, blur: (chosen - finer) * (4.0 / 3.0) * response }
    }
}

/// Photons of a density estimate. An overhang does not narrow the disc of caustics, since it may be their
/// caster.
#[derive(Clone, Copy)]
pub(in crate::transport) struct Light<'a> {
    pub(in crate::transport) map: &'a PhotonMap<'a>,
    pub(in crate::transport) is_caustic: bool,
    /// Number of photons above which discs are narrowed.
    pub(in crate::transport) min_photons: f32,
}

/// Radiance from `point` to `wo` of the photons on the visible part of `disc`; `all` is their density without
/// regard to visibility, if known. If the BSDF `gathers_photons_on_base`, light of its base alone.
#[inline]
pub(in crate::transport) fn reflected<F: Features>(
    Light { map, is_caustic, min_photons }: Light,
    context: &SceneContext<F>,
    (disc, all): (&QueryDisc, Option<DensityEstimate>),
    (point, bsdf): (&SurfacePoint, &Bsdf),
    wo: Vec3,
    rotation: f32,
) -> RadianceEstimate {
    let origin = point.position + point.error * point.geometric_normal;
    let boundary = kernel_boundary(&context.bvh, context.level, (origin, is_caustic), disc, rotation);
    let is_flat = point.frame.normal == point.geometric_normal;
    if let (Bsdf::Diffuse(diffuse), true) = (bsdf, is_flat) {
        let response = diffuse.reflectance * FRAC_1_PI;
        return match all {
            Some(all) if boundary.is_open() => RadianceEstimate::of(all, min_photons, response),
            _ => RadianceEstimate::of(
                map.gather_within(context.level, disc, &boundary, &Uniform(response)),
                min_photons,
                Rgb::ONE,
            ),
        };
    }
    let seen = bsdf.view_apart::<F>(wo, bsdf.gathers_photons_on_base(context.separates_coats()));
    // The power of a photon includes the cosine to the triangle's normal, hence the division.
    let response = |from: Vec3| {
        let wi = point.frame.to_local(from);
        if !point.sides_agree(wi, from) {
            return Rgb::ZERO;
        }
        seen.value::<F>(wi) / from.dot(point.geometric_normal).abs().max(GRAZING)
    };
    RadianceEstimate::of(map.gather_within(context.level, disc, &boundary, &response), min_photons, Rgb::ONE)
}

/// Kernel boundary on `disc`: walls and edges by probes from `origin`, just above its centre; and overhangs,
/// except for caustics.
pub(in crate::transport) fn kernel_boundary(
    bvh: &Bvh,
    level: Level,
    (origin, is_caustic): (Vec3, bool),
    disc: &QueryDisc,
    rotation: f32,
) -> KernelBoundary {
    let frame = KernelBoundary::frame(disc.normal, rotation);
    let radius = disc.radius;
    // Without a surface within the thickness of the disc there are no photons and no area.
    let depth = FLATNESS * radius;
    let reach = KernelBoundary::PROBE_LENGTH * radius;
    // Most discs are unobstructed, which one clearance query proves.
    let query = ClearanceQuery {
        place: origin,
        frame,
        reach: (1.0 + PROBE_SLOPE) * reach,
        points: [
            KernelBoundary::PROBE_DIRECTIONS.map(|way| EDGE_TEST_FRACTION * reach * way.x),
            KernelBoundary::PROBE_DIRECTIONS.map(|way| EDGE_TEST_FRACTION * reach * way.y),
        ],
        depth,
    };
    let clearance = bvh.clearance(&query);
    if clearance == Clearance::OPEN {
        return KernelBoundary::open(&frame);
    }
    let mut lengths = [f32::INFINITY; PROBES];
    for (i, length) in lengths.iter_mut().enumerate() {
        let way = frame.to_world(KernelBoundary::PROBE_DIRECTIONS[i].extend(0.0));
        if clearance.has_wall {
            // One by one: for eight rays the setup of a batch costs more than it gains.
            let hit = bvh.nearest(level, &Ray::segment(origin, way + PROBE_SLOPE * disc.normal, reach));
            if hit.is_some() {
                *length = hit.t / radius;
            }
        }
        if length.is_infinite() && clearance.surface >> i & 1 != 0 {
            continue;
        }
        let has_surface = |length: f32| {
            let above = origin + length * radius * way + depth * disc.normal;
            bvh.occluded(level, &Ray::segment(above, -disc.normal, 2.0 * depth))
        };
        let farthest = length.min(KernelBoundary::PROBE_LENGTH);
        if has_surface(EDGE_TEST_FRACTION * farthest) {
            continue;
        }
        let (mut low, mut high) = (0.0, farthest);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if has_surface(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        *length = 0.5 * (low + high);
    }
    if clearance.has_overhang && !is_caustic {
        // Under an overhang lower than the disc is wide, light changes over a distance of its height.
        for way in OVERHANG_DIRECTIONS {
            let hit = bvh.nearest(level, &Ray::segment(origin, frame.to_world(way), radius / way.z));
            if hit.is_some() {
                let height = (hit.t * way.z / radius).max(MIN_OVERHANG_RADIUS);
                lengths.iter_mut().for_each(|length| *length = length.min(height));
            }
        }
    }
    KernelBoundary::new(&frame, lengths)
}
