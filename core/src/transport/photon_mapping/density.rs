//! Paths that end where photons lie: reflected light by the density of photons, direct light by shadow rays.

use crate::bsdf::{Bsdf, Features};
use crate::bvh::Bvh;
use crate::bvh::clearance::{Clearance, ClearanceQuery};
use crate::geometry::Ray;
use crate::photon::{Density, FLATNESS, Fence, Kernel, PROBES, PhotonMap, QueryDisc, Uniform};
use crate::scene::SurfacePoint;
use crate::transport::path::PathIntegrator;
use crate::transport::path::estimator::{Estimator, KnownLight, Rest};
use crate::transport::path::vertex::PathVertex;
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::settings::PathSettings;
use crate::transport::walk::component::Components;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::{Level, Rgb};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Cosine below which that of a photon counts as this: its direction is not known better.
pub(in crate::transport) const GRAZING: f32 = 0.01;

/// How steeply probes for walls rise from the surface: what is lower than that is a step, not a wall, and
/// what the surface bends less is none either.
const LIFT: f32 = 0.1;

/// Ways to look for what hangs over a disc: upwards, and at half a right angle to all sides.
const UPWARDS: [Vec3; 5] = {
    const D: f32 = core::f32::consts::FRAC_1_SQRT_2;
    let way = Vec3::new;
    [Vec3::Z, way(D, 0.0, D), way(0.0, D, D), way(-D, 0.0, D), way(0.0, -D, D)]
};

/// Less is not left of a disc for what hangs over it, as a share of its radius: a photon would be a spike.
const LOWEST: f32 = 0.125;

/// How far of the way to a wall its foot is looked for.
const BEFORE: f32 = 0.99;

/// Steps by which the edge of a surface is found: to a sixteenth of the radius.
const HALVINGS: u32 = 4;

/// A photon map as paths from the eye use it.
#[derive(Clone, Copy)]
pub struct PhotonLight<'a> {
    map: &'a PhotonMap<'a>,
    discs: RadiusSchedule,
    kernel: Kernel,
    /// Most discs have no photon, so that to look for one first is worth it.
    is_sparse: bool,
    /// Photons that a disc needs.
    enough: f32,
}

impl<'a> PhotonLight<'a> {
    /// The photons of `map`, gathered from `discs`.
    pub fn new(map: &'a PhotonMap<'a>, discs: RadiusSchedule) -> Self {
        Self { map, discs, kernel: Kernel::default(), is_sparse: false, enough: f32::INFINITY }
    }

    /// The same, with photons weighed by `kernel`.
    pub fn with_kernel(self, kernel: Kernel) -> Self {
        Self { kernel, ..self }
    }

    /// The same, where discs are no wider than it takes for `enough` photons, if those lie evenly: where they
    /// crowd, an eighth of the radius may do.
    pub fn with_enough(self, enough: f32) -> Self {
        Self { enough, ..self }
    }

    /// The same for a map of caustics, which are on few surfaces.
    pub fn of_caustics(self) -> Self {
        Self { is_sparse: true, ..self }
    }

    /// The reflected light that `point` sends to `wo`, itself reflected, at the end of a path that has come
    /// so far from the eye; `None` where no photons are left on such a surface. `turns`, from 0 to 1, turns
    /// the probes for walls. Those are not counted as rays.
    #[inline]
    pub(in crate::transport) fn reflected<F: Features>(
        &self,
        context: &SceneContext<F>,
        (point, bsdf): (&SurfacePoint, &Bsdf),
        (wo, travelled): (Vec3, f32),
        turns: f32,
    ) -> Option<Gathered> {
        if !bsdf.gathers_photons(context.separates_coats()) {
            return None;
        }
        let disc = QueryDisc {
            place: point.position,
            normal: point.geometric_normal,
            radius: self.discs.radius_after(travelled, point.position),
            kernel: self.kernel,
        };
        let density = self.is_sparse.then(|| self.map.gather(context.level, &disc, &Uniform(Rgb::ONE)));
        if density.is_some_and(|density| density.photons == 0) {
            return Some(Gathered::default());
        }
        let light = Light { map: self.map, is_caustic: self.is_sparse, enough: self.enough };
        Some(reflected(light, context, (&disc, density), (point, bsdf), wo, turns))
    }
}

impl<F: Features> Estimator<F> for PhotonLight<'_> {
    type State = ();
    type Found = ();
    const SEPARATES_COATS: bool = true;

    /// Surfaces with a diffuse part have all reflected light from photons. Where depth is limited only the
    /// first point of a path has, as photons do not know their distance from the light.
    #[inline]
    fn at_vertex(
        &self,
        (context, settings): (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        _: &mut (),
        _: (),
        add: &mut impl FnMut(KnownLight),
    ) -> Rest {
        let mut rest = Rest::all(vertex);
        if vertex.segments > 1 && settings.is_limited() {
            return rest;
        }
        let turns = vertex.sampler.single(dimension::PROBES + vertex.segments);
        let from = (vertex.wo, vertex.travelled);
        let reflected = self.reflected(context, (vertex.point, &vertex.bsdf), from, turns);
        add(reflected.unwrap_or_default().known(vertex));
        if reflected.is_some() {
            rest.wide = Some(Components::EMITTED);
        }
        rest
    }
}

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// The same, where surfaces with a diffuse part have reflected light from photons. Where depth is limited
    /// only the first point of a path has.
    pub fn with_photons(&self, photons: PhotonLight<'a>) -> PathIntegrator<'a, F, PhotonLight<'a>> {
        self.with_estimator(photons)
    }
}

/// What a disc of photons sends to the eye.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::transport) struct Gathered {
    pub(in crate::transport) light: Rgb,
    /// By how much that is too bright for its width, in the mean: what it differs by from a disc of half the
    /// radius, and what that blurs itself, a quarter of it all where light is smooth.
    pub(in crate::transport) blur: Rgb,
}

impl Gathered {
    /// As an estimator knows it at `vertex`.
    #[inline]
    pub(in crate::transport) fn known(self, vertex: &PathVertex) -> KnownLight {
        KnownLight { contribution: vertex.throughput * self.light, blur: self.blur }
    }

    /// By a disc that is no wider than it takes for `enough` photons.
    fn of(density: Density, enough: f32, response: Rgb) -> Self {
        let [chosen, finer] = density.of_enough(enough);
        Self { light: chosen * response, blur: (chosen - finer) * (4.0 / 3.0) * response }
    }
}

/// Photons, and whether they are those of caustics: what hangs over a disc may be what throws them there.
#[derive(Clone, Copy)]
pub(in crate::transport) struct Light<'a> {
    pub(in crate::transport) map: &'a PhotonMap<'a>,
    pub(in crate::transport) is_caustic: bool,
    /// RadiusSchedule are no wider than it takes for so many photons.
    pub(in crate::transport) enough: f32,
}

/// What `point` reflects to `wo` of the light of the photons on `disc`, as far as it is seen from there;
/// `all` is the density of all of them, where it is known. By its base alone where it `is_varnished`.
#[inline]
pub(in crate::transport) fn reflected<F: Features>(
    Light { map, is_caustic, enough }: Light,
    context: &SceneContext<F>,
    (disc, all): (&QueryDisc, Option<Density>),
    (point, bsdf): (&SurfacePoint, &Bsdf),
    wo: Vec3,
    turns: f32,
) -> Gathered {
    let origin = point.position + point.error * point.geometric_normal;
    let fence = fence(context.bvh, context.level, (origin, is_caustic), disc, turns);
    let is_flat = point.frame.normal == point.geometric_normal;
    if let (Bsdf::Diffuse(diffuse), true) = (bsdf, is_flat) {
        let response = diffuse.reflectance * FRAC_1_PI;
        return match all {
            Some(all) if fence.is_open() => Gathered::of(all, enough, response),
            _ => Gathered::of(
                map.gather_within(context.level, disc, &fence, &Uniform(response)),
                enough,
                Rgb::ONE,
            ),
        };
    }
    let seen = bsdf.seen_apart::<F>(wo, bsdf.is_varnished(context.separates_coats()));
    // A photon's power has met the triangle: the cosine is in it already, and that of the triangle's normal.
    let response = |from: Vec3| {
        let wi = point.frame.to_local(from);
        if !point.sides_agree(wi, from) {
            return Rgb::ZERO;
        }
        seen.value::<F>(wi) / from.dot(point.geometric_normal).abs().max(GRAZING)
    };
    Gathered::of(map.gather_within(context.level, disc, &fence, &response), enough, Rgb::ONE)
}

/// Looks for walls on `disc`, and for its edges, by probes from `origin`, just above its middle; and for what
/// hangs over it, but for caustics.
pub(in crate::transport) fn fence(
    bvh: &Bvh,
    level: Level,
    (origin, is_caustic): (Vec3, bool),
    disc: &QueryDisc,
    turns: f32,
) -> Fence {
    let frame = Fence::frame(disc.normal, turns);
    let radius = disc.radius;
    // Where there is no surface within the thickness of the disc, there are no photons, and no area.
    let depth = FLATNESS * radius;
    let reach = Fence::FARTHEST * radius;
    // Most discs lie in the open, which one look around tells.
    let query = ClearanceQuery {
        place: origin,
        frame,
        reach: (1.0 + LIFT) * reach,
        points: [
            Fence::WAYS.map(|way| BEFORE * reach * way.x),
            Fence::WAYS.map(|way| BEFORE * reach * way.y),
        ],
        depth,
    };
    let clearance = bvh.clearance(&query);
    if clearance == Clearance::OPEN {
        return Fence::open(&frame);
    }
    let mut shares = [f32::INFINITY; PROBES];
    for (i, share) in shares.iter_mut().enumerate() {
        let way = frame.to_world(Fence::WAYS[i].extend(0.0));
        if clearance.rises {
            // One by one: the setup of a batch costs more than it gains for eight.
            let hit = bvh.nearest(level, &Ray::segment(origin, way + LIFT * disc.normal, reach));
            if hit.is_some() {
                *share = hit.t / radius;
            }
        }
        if share.is_infinite() && clearance.surface >> i & 1 != 0 {
            continue;
        }
        let is_there = |share: f32| {
            let above = origin + share * radius * way + depth * disc.normal;
            bvh.occluded(level, &Ray::segment(above, -disc.normal, 2.0 * depth))
        };
        let farthest = share.min(Fence::FARTHEST);
        if is_there(BEFORE * farthest) {
            continue;
        }
        let (mut low, mut high) = (0.0, farthest);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if is_there(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        *share = 0.5 * (low + high);
    }
    if clearance.hangs && !is_caustic {
        // Under something that hangs lower than the disc is wide, the light changes over as little.
        for way in UPWARDS {
            let hit = bvh.nearest(level, &Ray::segment(origin, frame.to_world(way), radius / way.z));
            if hit.is_some() {
                let height = (hit.t * way.z / radius).max(LOWEST);
                shares.iter_mut().for_each(|share| *share = share.min(height));
            }
        }
    }
    Fence::new(&frame, shares)
}
