//! Final gathering (Jensen 1996): a gather ray ends at the next surface with a diffuse part, with reflected
//! light of the global map. The ray takes irradiance precomputed at the photons nearest to its hit
//! (`irradiance.rs`).
//!
//! Departures:
//! 1. A gather ray ends in the map only if the map is reliable. It continues as a path if it is shorter than
//!    the blur of the map at its hit (Jensen's secondary gathering, by a measured distance), if photons are
//!    few, if no photon lies on a surface like that of the hit, or if a wall is in between.
//! 2. A photon stores whether there is a wall within the disc of its estimate. Without a wall, the ray needs
//!    no visibility test.
//! 3. The ray takes the harmonic mean of the nearest visible irradiances, not the nearest one. Photons lie
//!    where light is: most of the photons nearest to a point in shadow belong to the light beside it, beyond
//!    their share of the area. The number of photons on an area is proportional to its brightness, so that
//!    weights of 1 / brightness give each area its share.

use crate::bsdf::{Bsdf, Features};
use crate::bvh::Bvh;
use crate::geometry::{Frame, Ray};
use crate::light::luminance;
use crate::memory::{Arena, Line};
use crate::photon::{
    FLATNESS, Kernel, MIN_NORMAL_COSINE, MOST_REMAINING, Neighbours, Photon, PhotonMap, QueryDisc,
};
use crate::scene::{Material, Scene, SurfacePoint};
use crate::transport::path::PathIntegrator;
use crate::transport::path::estimator::{KnownLight, LightEstimator, PathVertex, RemainingLight};
use crate::transport::photon_mapping::density::{Light, PhotonLight, RadianceEstimate, reflected};
use crate::transport::photon_mapping::irradiance::TEST_HEIGHT;
pub use crate::transport::photon_mapping::irradiance::{IRRADIANCES, PrecomputedIrradiance, STRIDE};
use crate::transport::settings::PathSettings;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::path_classes::PathClasses;
use crate::{Level, Rgb};
use core::f32::consts::{FRAC_1_PI, SQRT_2};
use glam::Vec3;

/// Number of nearest irradiances. Their distance measures the blur of the map: the photons of an estimate
/// reach [`BLUR_RADIUS_FACTOR`] times as far.
const NEAREST_IRRADIANCES: usize = 8;

/// sqrt(NEAREST / (NEAREST_IRRADIANCES · STRIDE)), since photons lie on surfaces.
const BLUR_RADIUS_FACTOR: f32 = SQRT_2;

/// Minimum length of a gather ray that ends in the map, in radii of the discs at its hit.
const MIN_RAY_LENGTH: f32 = 1.5;

/// Maximum distance of the centroid of these irradiances from the centre of their disc, in radii. In even
/// light one of thirteen exceeds it by chance; at a straight edge of light it is 0.42.
const MAX_CENTROID_OFFSET: f32 = 0.4;

/// Stack memory of a lookup, in lines: [`Neighbours::footprint`] of [`NEAREST_IRRADIANCES`].
const LOOKUP_LINES: usize = 32;

/// Global photon map for gather rays.
#[derive(Clone, Copy)]
pub struct GlobalMapLookup<'a> {
    global: &'a PhotonMap<'a>,
    irradiances: &'a PhotonMap<'a>,
    farthest: f32,
    kernel: Kernel,
}

impl<'a> GlobalMapLookup<'a> {
    /// Lookup in the map `irradiances`, the [`PrecomputedIrradiance`] of `global`, with the radius limit and
    /// kernel of their computation.
    pub fn new(
        global: &'a PhotonMap<'a>,
        irradiances: &'a PhotonMap<'a>,
        farthest: f32,
        kernel: Kernel,
    ) -> Self {
        Self { global, irradiances, farthest, kernel }
    }

    /// Radiance of light from `point`, the hit of a gather ray of length `distance`, to `wo`, except by a
    /// narrow coat. `None` if the map is unreliable. `rotation`, from 0 to 1, rotates the probes for walls.
    pub(in crate::transport) fn reflected<F: Features>(
        &self,
        context: &SceneContext<F>,
        (point, bsdf): (&SurfacePoint, &Bsdf),
        wo: Vec3,
        distance: f32,
        rotation: f32,
    ) -> Option<Rgb> {
        let (irradiance, radius) = self.irradiance((&context.bvh, context.level), point, distance)?;
        let (place, normal) = (point.position, point.geometric_normal);
        let disc = QueryDisc { place, normal, radius: radius.min(self.farthest), kernel: self.kernel };
        let light = Light { map: self.global, is_caustic: false, min_photons: f32::INFINITY };
        let of_photons = |point: &SurfacePoint| {
            reflected(light, context, (&disc, None), (point, bsdf), wo, rotation).light
        };
        let Bsdf::Diffuse(diffuse) = bsdf else { return Some(of_photons(point)) };
        let flat = irradiance * diffuse.reflectance * FRAC_1_PI;
        if point.frame.normal == normal {
            return Some(flat);
        }
        // Irradiances are those of triangles: the photons tell the ratio for a bent normal.
        let [bent, all] = [*point, SurfacePoint { frame: Frame::from_normal(normal), ..*point }]
            .map(|point| of_photons(&point));
        let ratio = |c: usize| if all[c] > 0.0 { flat[c] * bent[c] / all[c] } else { 0.0 };
        Some(Rgb::new(ratio(0), ratio(1), ratio(2)))
    }

    /// Irradiance at `point`, the hit of a gather ray of length `distance`, and the radius of its discs.
    /// `None` if the map is unreliable.
    pub(in crate::transport) fn irradiance(
        &self,
        (bvh, level): (&Bvh, Level),
        point: &SurfacePoint,
        distance: f32,
    ) -> Option<(Rgb, f32)> {
        // Limits the search radius: beyond it the ray would be too short.
        let within = self.farthest.min(distance / (MIN_RAY_LENGTH * BLUR_RADIUS_FACTOR));
        let mut lines = [Line([0; 64]); LOOKUP_LINES];
        let mut neighbours = Neighbours::new(NEAREST_IRRADIANCES, &mut Arena::over(&mut lines)).ok()?;
        self.irradiances.nearest(level, point.position, within, &mut neighbours);
        let squared = neighbours.squared_radius();
        if squared.is_infinite() {
            return None;
        }
        let radius = BLUR_RADIUS_FACTOR * libm::sqrtf(squared);
        let normal = point.geometric_normal;
        let is_seen = |photon: &Photon| {
            let is_open = photon.direction().dot(photon.normal()) >= 0.0;
            is_open || {
                let from = point.position + point.error * normal;
                let above = TEST_HEIGHT * radius + 16.0 * f32::EPSILON * from.abs().max_element();
                let to = photon.position() + above * photon.normal();
                let way = Ray::segment(from + above * normal, to - from - above * normal, 1.0);
                !bvh.occluded(level, &way)
            }
        };
        let mut alike = [None; NEAREST_IRRADIANCES];
        let mut nearest: Option<(Photon, (f32, u32))> = None;
        let (mut count, mut moment) = (0.0, Vec3::ZERO);
        for (slot, (index, squared)) in alike.iter_mut().zip(neighbours.iter()) {
            let Some(photon) = self.irradiances.get(index) else { continue };
            let offset = photon.position() - point.position;
            if photon.normal().dot(normal) < MIN_NORMAL_COSINE || offset.dot(normal).abs() > FLATNESS * radius
            {
                continue;
            }
            count += 1.0;
            moment += offset;
            *slot = Some((photon, index));
            if nearest.is_none_or(|(_, least)| (squared, index) < least) {
                nearest = Some((photon, (squared, index)));
            }
        }
        // Beside a bright spot all irradiances belong to the spot.
        let is_even =
            moment.length_squared() <= MAX_CENTROID_OFFSET * MAX_CENTROID_OFFSET * count * count * squared;
        let (_, (_, nearest)) = nearest.filter(|(photon, _)| is_even && is_seen(photon))?;
        let (mut sum, mut weights) = (Rgb::ZERO, 0.0);
        for (photon, _) in
            alike.iter().flatten().filter(|(photon, index)| *index == nearest || is_seen(photon))
        {
            let brightness = luminance(photon.power());
            if brightness > 0.0 {
                sum += photon.power() / brightness;
                weights += 1.0 / brightness;
            }
        }
        Some((if weights > 0.0 { sum / weights } else { Rgb::ZERO }, radius))
    }
}

/// Photon maps of a picture.
#[derive(Clone, Copy)]
pub struct PhotonMaps<'a> {
    /// Caustic map; `None` if paths find caustics themselves, or there are none.
    pub caustic: Option<PhotonLight<'a>>,
    /// Global map of all light.
    pub global: GlobalMapLookup<'a>,
}

impl PhotonMaps<'_> {
    /// Light of both maps at `vertex`, and the light that the path still has to find.
    #[inline]
    fn at<F: Features>(
        &self,
        (context, settings): (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
    ) -> (RadianceEstimate, RemainingLight) {
        let PathVertex { point, ref bsdf, wo, came, segments, distance, travelled, .. } = *vertex;
        let is_limited = settings.is_limited();
        let rotation = vertex.sampler.single(dimension::PROBES + segments);
        // A path that may end in the map still may after this vertex.
        let all = RemainingLight::of(if came.may_end_in_photon_map() {
            PathClasses::GATHERED
        } else {
            PathClasses::ALL
        });
        if !bsdf.gathers_photons(context.separates_coats()) {
            if came.excludes_caustics() && bsdf.is_caustic_caster() {
                let rest = RemainingLight { is_lit: true, ..RemainingLight::of(PathClasses::BEHIND_MIRROR) };
                return (RadianceEstimate::default(), rest);
            }
            return (RadianceEstimate::default(), all);
        }
        if came.may_end_in_photon_map()
            && (!is_limited || segments == 2)
            && let Some(light) = self.global.reflected(context, (point, bsdf), wo, distance, rotation)
        {
            let rest = RemainingLight { wide: None, is_lit: true, ..all };
            return (RadianceEstimate { light, ..RadianceEstimate::default() }, rest);
        }
        let remaining = settings.extra_segments(segments);
        if remaining > MOST_REMAINING {
            return (RadianceEstimate::default(), RemainingLight::of(PathClasses::ALL));
        }
        match &self.caustic {
            Some(caustic) => {
                let travelled = if came.may_end_in_photon_map() { 0.0 } else { travelled };
                let gathered =
                    caustic.reflected(context, (point, bsdf), (wo, travelled), remaining, rotation);
                let rest = RemainingLight { wide: Some(PathClasses::NO_CAUSTIC), ..all };
                (gathered.unwrap_or_default(), rest)
            }
            None => {
                (RadianceEstimate::default(), RemainingLight { wide: Some(PathClasses::GATHERED), ..all })
            }
        }
    }
}

/// Photon maps of even and of odd samples.
impl<F: Features> LightEstimator<F> for &[PhotonMaps<'_>; 2] {
    type State = ();
    type Found = ();

    #[inline]
    fn separates_coat(&self, context: &SceneContext<F>, bsdf: &Bsdf, _: &()) -> bool {
        bsdf.gathers_photons_on_base(context.separates_coats())
    }

    #[inline]
    fn at_vertex(
        &self,
        scene: (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        _: &mut (),
        _: (),
        add: &mut impl FnMut(KnownLight),
    ) -> RemainingLight {
        let (gathered, rest) = self[vertex.sample as usize & 1].at(scene, vertex);
        add(gathered.known(vertex));
        rest
    }
}

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// This path tracer with photon maps: surfaces with a diffuse part take caustics from photons, and gather
    /// rays from them end in a photon map: even samples in the first, odd samples in the second. With a limit
    /// of depth only gather rays from the first vertex of a path end in a map.
    pub fn with_maps(&self, maps: &'a [PhotonMaps<'a>; 2]) -> PathIntegrator<'a, F, &'a [PhotonMaps<'a>; 2]> {
        self.with_estimator(maps)
    }
}

/// True if a material of `scene` may cast caustics.
pub fn may_have_caustics(scene: &Scene) -> bool {
    scene.materials.iter().any(Material::may_be_caustic_caster)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Frame;
    use crate::photon::{lines, with_map_of};
    use crate::sampling::Random;
    use crate::scene::{Attributes, Material, Mesh, Triangle};
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn an_even_floor_is_even_and_the_dark_stays_behind_its_wall() {
        // Vertical wall in the middle of a floor of 1 × 1.
        let positions = [
            [0.5, -9.0, 0.0],
            [0.5, 9.0, 0.0],
            [0.5, 0.5, 9.0],
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        let triangles = [[0, 1, 2], [3, 4, 5], [3, 5, 6]].map(|vertices| Triangle { vertices, material: 0 });
        let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
        let mut memory = lines(Bvh::footprint(triangles.len()));
        let bvh = Bvh::build(&mesh, &mut Arena::over(&mut memory)).unwrap();

        // Irradiance is 1 on the left, 0.1 on the right.
        const PER_AREA: u32 = 20_000;
        let random = Random::new(1, 0);
        let mut photons = Vec::new();
        for i in 0..PER_AREA {
            let [x, y, chance] = [0, 1, 2].map(|which| random.single(3 * i + which));
            if x < 0.5 || chance < 0.1 {
                let power = Rgb::splat(1.0 / PER_AREA as f32);
                photons.push(Photon::new(Vec3::new(x, y, 0.0), Vec3::Z, Vec3::Z, power));
            }
        }
        let (level, kernel) = (Level::BASELINE, Kernel::default());
        with_map_of(&photons, |global| {
            let all = PrecomputedIrradiance::new(&bvh, global, 1.0, kernel, level);
            let mut found = vec![Photon::NONE; all.count().div_ceil(IRRADIANCES) * IRRADIANCES];
            for (task, out) in found.chunks_mut(IRRADIANCES).enumerate() {
                let mut scratch = lines(PrecomputedIrradiance::scratch());
                all.run(task, &mut Arena::over(&mut scratch), out).unwrap();
            }
            with_map_of(&found, |irradiances| {
                check(&GlobalMapLookup::new(global, irradiances, 1.0, kernel), (&bvh, level), random);
            });
        });
    }

    /// Tests `light` on both sides of the wall.
    fn check(light: &GlobalMapLookup, tracer: (&Bvh, Level), random: Random) {
        let material = Material::diffuse(Rgb::ONE);
        let query = |x: f32, y: f32| {
            let point = SurfacePoint {
                position: Vec3::new(x, y, 0.0),
                error: 1e-7,
                geometric_normal: Vec3::Z,
                frame: Frame::from_normal(Vec3::Z),
                attributes: Attributes::NONE,
                front: true,
                material: &material,
                triangle: 1,
            };
            light.irradiance(tracer, &point, 100.0).map(|(irradiance, _)| irradiance.x)
        };
        let in_light: Vec<_> = (0..4000)
            .filter_map(|i| query(0.1 + 0.3 * random.single(i), 0.1 + 0.8 * random.single(4000 + i)))
            .collect();
        let count = in_light.len() as f32;
        let mean = in_light.iter().sum::<f32>() / count;
        let scatter = (in_light.iter().map(|e| (e - mean).powi(2)).sum::<f32>() / count).sqrt();
        // The nearest irradiance alone scatters by 0.15.
        assert!(count > 3000.0 && (mean - 1.0).abs() < 0.025 && scatter < 0.13, "{count} {mean} {scatter}");
        let in_shade: Vec<_> = (0..4000)
            .filter_map(|i| query(0.501 + 0.1 * random.single(i), 0.1 + 0.8 * random.single(4000 + i)))
            .collect();
        let most = in_shade.iter().fold(0.0, |most: f32, &e| most.max(e));
        assert!(in_shade.len() > 1000 && most < 0.25, "{} {most}", in_shade.len());
    }
}
