//! The light of photon maps for final gathering (Jensen 1996): a gather ray that meets a surface with a diffuse part
//! ends there, with the light that the global map says is reflected. Of every [`STRIDE`]th photon the irradiance is
//! worked out beforehand, from the photons nearest to it; a gather ray then takes what the nearest such photons say
//! (Christensen 1999, "Faster Photon Map Global Illumination").
//!
//! Departures:
//! 1. A gather ray ends in the map only where that is sure. It goes on, as a path does, where it is shorter than the
//!    blur of the map at its end is wide (Jensen's secondary gathering, by a measured distance), where there are few
//!    photons, where none lies on a surface like that of the point, or where a wall is in between.
//! 2. A photon knows whether there is a wall within the disc of its estimate. If not, it need not be asked for again.
//! 3. The ray takes the harmonic mean of the nearest irradiances that its end sees, not the nearest one. Photons lie where light is: of the
//!    nearest to a place in the shade most are of the light beside it, more than their share of the area. As many lie on an
//!    area as it is bright, so that weights of one over brightness give each area its share.

use crate::bsdf::{Bsdf, Features};
use crate::bvh::Bvh;
use crate::geometry::Ray;
use crate::light::luminance;
use crate::memory::{Arena, Footprint, Line, OutOfMemory};
use crate::photon::{ALIKE, FLATNESS, Kernel, Neighbours, Photon, PhotonMap, QueryDisc, Uniform};
use crate::sampling::mix;
use crate::scene::{Material, Scene, SurfacePoint};
use crate::transport::PhotonLight;
use crate::transport::estimator::Counters;
use crate::transport::path::state::Components;
use crate::transport::photon_mapping::density::{Gathered, Light, fence, reflected};
use crate::transport::walk::context::SceneContext;
use crate::{Level, Rgb};
use core::f32::consts::{FRAC_1_PI, SQRT_2};
use glam::Vec3;

/// Of so many photons one gets an irradiance.
pub const STRIDE: usize = 4;

/// Irradiances of one task.
pub const IRRADIANCES: usize = 256;

/// Photons that an irradiance is estimated from.
const NEAREST: usize = 64;

/// Irradiances that a gather ray chooses from, and whose distance tells how wide the blur of the map is: the photons of
/// an estimate reach [`BLUR`] times as far.
const CHOICE: usize = 8;

/// sqrt(NEAREST / (CHOICE · STRIDE)), as photons lie on surfaces.
const BLUR: f32 = SQRT_2;

/// The least length of a gather ray that ends in the map, in radii of the discs there.
const SHORTEST: f32 = 1.5;

/// How far from the middle of a disc the centroid of the irradiances that a gather ray chooses from may be, and that of
/// the light of the photons of an estimate, in radii. Chance puts one in thirteen of the first farther off where all is
/// even, one in a hundred of the second; on a straight edge of light both are at 0.42.
const EVEN_CHOICE: f32 = 0.4;
const EVEN_LIGHT: f32 = 0.2;

/// Working memory for a choice, on the stack: [`Neighbours::footprint`] of [`CHOICE`].
const LINES: usize = 32;

/// The least share of a disc that must be seen: in a slit a few photons would tell of all of it.
const LEAST_SEEN: f32 = 0.1;

/// How far above its surface a photon looks for walls, in radii of its disc: what is lower is no wall.
const ABOVE: f32 = 1e-3;

/// Works out the irradiance of photons: a pass over tasks of [`IRRADIANCES`].
#[derive(Clone, Copy)]
pub struct PrecomputedIrradiance<'a> {
    bvh: &'a Bvh<'a>,
    global: &'a PhotonMap<'a>,
    /// Largest radius of a disc.
    farthest: f32,
    kernel: Kernel,
    level: Level,
}

impl<'a> PrecomputedIrradiance<'a> {
    /// For a map of all photons; discs of at most `farthest`.
    pub fn new(
        bvh: &'a Bvh<'a>,
        global: &'a PhotonMap<'a>,
        farthest: f32,
        kernel: Kernel,
        level: Level,
    ) -> Self {
        Self { bvh, global, farthest, kernel, level }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.global.len().div_ceil(STRIDE)
    }

    /// Working memory of one task.
    pub fn scratch() -> Footprint {
        Neighbours::footprint(NEAREST)
    }

    /// Those of task `task`: photons whose power is an irradiance, and which came from where their normal points if no
    /// wall is near, otherwise from the other side. What is not needed of `out` is filled with photons of no place.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`PrecomputedIrradiance::scratch`] bytes.
    pub fn run(&self, task: usize, scratch: &mut Arena, out: &mut [Photon]) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut neighbours = Neighbours::new(NEAREST, &mut arena)?;
        for (i, slot) in out.iter_mut().enumerate() {
            let index = (task * IRRADIANCES + i) * STRIDE;
            let photon = u32::try_from(index).ok().and_then(|index| self.global.get(index));
            *slot = photon.map_or(Photon::NONE, |photon| self.at(&photon, index, &mut neighbours));
        }
        Ok(Counters::default())
    }

    fn at(&self, photon: &Photon, index: usize, neighbours: &mut Neighbours) -> Photon {
        let (place, normal) = (photon.position(), photon.normal());
        let (disc, factor) =
            self.global.disc_of_nearest(self.level, (place, normal), self.farthest, self.kernel, neighbours);
        let above = ABOVE * disc.radius + 16.0 * f32::EPSILON * place.abs().max_element();
        let turns = (mix(index as u64) >> 40) as f32 / (1u64 << 24) as f32;
        let fence = fence(self.bvh, self.level, (place + above * normal, false), &disc, turns);
        if fence.share(self.kernel, 1.0) < LEAST_SEEN {
            return Photon::NONE;
        }
        if fence.is_open() && !self.is_even(&disc, neighbours) {
            return Photon::NONE;
        }
        let response = Uniform(Rgb::splat(factor));
        let density = self.global.gather_within(self.level, &disc, &fence, &response);
        let tells = if fence.is_open() { normal } else { -normal };
        Photon::new(place, tells, normal, density.radiance)
    }

    /// Whether light comes to `disc`, of those nearest photons, on all sides of its middle alike.
    fn is_even(&self, disc: &QueryDisc, neighbours: &Neighbours) -> bool {
        let (mut sum, mut moment) = (0.0, Vec3::ZERO);
        for photon in neighbours.iter().filter_map(|(index, _)| self.global.get(index)) {
            if photon.normal().dot(disc.normal) >= ALIKE {
                let power = luminance(photon.power());
                sum += power;
                moment += power * (photon.position() - disc.place);
            }
        }
        moment.length() <= EVEN_LIGHT * disc.radius * sum
    }
}

/// Photons as gather rays use them.
#[derive(Clone, Copy)]
pub struct GlobalMapLookup<'a> {
    global: &'a PhotonMap<'a>,
    irradiances: &'a PhotonMap<'a>,
    farthest: f32,
    kernel: Kernel,
}

impl<'a> GlobalMapLookup<'a> {
    /// With the map of the [`PrecomputedIrradiance`] of `global`, and what those were made with.
    pub fn new(
        global: &'a PhotonMap<'a>,
        irradiances: &'a PhotonMap<'a>,
        farthest: f32,
        kernel: Kernel,
    ) -> Self {
        Self { global, irradiances, farthest, kernel }
    }

    /// The light that `point`, at the end of a gather ray of length `distance`, reflects to `wo`, except what a narrow
    /// coat does. `None` where the map should not tell. `turns`, from 0 to 1, turns probes for walls.
    pub(in crate::transport) fn reflected<F: Features>(
        &self,
        context: &SceneContext<F>,
        (point, bsdf): (&SurfacePoint, &Bsdf),
        wo: Vec3,
        distance: f32,
        turns: f32,
    ) -> Option<Rgb> {
        let (irradiance, radius) = self.irradiance((context.bvh, context.level), point, distance)?;
        if let Bsdf::Diffuse(diffuse) = bsdf {
            return Some(irradiance * diffuse.reflectance * FRAC_1_PI);
        }
        let (place, normal) = (point.position, point.geometric_normal);
        let disc = QueryDisc { place, normal, radius: radius.min(self.farthest), kernel: self.kernel };
        let light = Light { map: self.global, is_caustic: false, enough: f32::INFINITY };
        Some(reflected(light, context, (&disc, None), (point, bsdf), wo, turns).light)
    }

    /// The irradiance of the photons at `point`, at the end of a gather ray of length `distance`, and the radius of their
    /// discs. `None` where the map should not tell.
    pub(in crate::transport) fn irradiance(
        &self,
        (bvh, level): (&Bvh, Level),
        point: &SurfacePoint,
        distance: f32,
    ) -> Option<(Rgb, f32)> {
        // A ray that cannot be long enough need not look.
        let within = self.farthest.min(distance / (SHORTEST * BLUR));
        let mut lines = [Line([0; 64]); LINES];
        let mut neighbours =
            Neighbours::new(CHOICE, &mut Arena::new(bytemuck::cast_slice_mut(&mut lines))).ok()?;
        self.irradiances.nearest(level, point.position, within, &mut neighbours);
        let squared = neighbours.squared_radius();
        if squared.is_infinite() {
            return None;
        }
        let radius = BLUR * libm::sqrtf(squared);
        let normal = point.geometric_normal;
        let is_seen = |photon: &Photon| {
            let is_open = photon.direction().dot(photon.normal()) >= 0.0;
            is_open || {
                let from = point.position + point.error * normal;
                let above = ABOVE * radius + 16.0 * f32::EPSILON * from.abs().max_element();
                let to = photon.position() + above * photon.normal();
                let way = Ray::segment(from + above * normal, to - from - above * normal, 1.0);
                !bvh.occluded(level, &way)
            }
        };
        let mut alike = [None; CHOICE];
        let mut nearest: Option<(Photon, (f32, u32))> = None;
        let (mut count, mut moment) = (0.0, Vec3::ZERO);
        for (slot, (index, squared)) in alike.iter_mut().zip(neighbours.iter()) {
            let Some(photon) = self.irradiances.get(index) else { continue };
            let offset = photon.position() - point.position;
            if photon.normal().dot(normal) < ALIKE || offset.dot(normal).abs() > FLATNESS * radius {
                continue;
            }
            count += 1.0;
            moment += offset;
            *slot = Some((photon, index));
            if nearest.is_none_or(|(_, least)| (squared, index) < least) {
                nearest = Some((photon, (squared, index)));
            }
        }
        // Beside a bright spot all irradiances are of the spot.
        let is_even = moment.length_squared() <= EVEN_CHOICE * EVEN_CHOICE * count * count * squared;
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

/// The maps that the samples of a picture share.
#[derive(Clone, Copy)]
pub struct PhotonMaps<'a> {
    /// Light that mirrors and glass throw onto surfaces; `None` where paths find it for themselves, or there is none.
    pub caustic: Option<PhotonLight<'a>>,
    /// All light.
    pub global: GlobalMapLookup<'a>,
}

/// What maps say of a vertex of a path.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::transport) struct MapLookup {
    /// Reflected light.
    pub(in crate::transport) gathered: Gathered,
    /// Whether that is all light but what a narrow coat reflects.
    pub(in crate::transport) is_all: bool,
    /// Whether no light need be asked for by a shadow ray.
    pub(in crate::transport) is_lit: bool,
    /// What a path finds that goes on from here,
    pub(in crate::transport) next: Components,
    /// and what it finds by a narrow coat.
    pub(in crate::transport) mirrored: Components,
}

impl PhotonMaps<'_> {
    /// Asks the maps about a vertex that a path which was to find `came` reached by a ray of length `distance`, having
    /// `travelled` as far as that from the eye.
    /// `limited` is the number of its segments where depth is limited, otherwise zero.
    #[inline]
    pub(in crate::transport) fn ask<F: Features>(
        &self,
        context: &SceneContext<F>,
        (came, limited, distance): (Components, u32, f32),
        (point, bsdf): (&SurfacePoint, &Bsdf),
        (wo, travelled): (Vec3, f32),
        turns: f32,
    ) -> MapLookup {
        // What was scattered by something with a diffuse part stays so.
        let rest = if came.gathers() { Components::GATHERED } else { Components::ALL };
        let all = MapLookup { next: rest, mirrored: rest, ..MapLookup::default() };
        if !bsdf.gathers_photons(context.separates_coats()) {
            return match came {
                Components::NO_CAUSTIC | Components::BEHIND_MIRROR if bsdf.is_caustic_caster() => MapLookup {
                    is_lit: true,
                    next: Components::BEHIND_MIRROR,
                    mirrored: Components::BEHIND_MIRROR,
                    ..MapLookup::default()
                },
                _ => all,
            };
        }
        if came.gathers()
            && (limited == 0 || limited == 2)
            && let Some(light) = self.global.reflected(context, (point, bsdf), wo, distance, turns)
        {
            let gathered = Gathered { light, ..Gathered::default() };
            return MapLookup { gathered, is_all: true, is_lit: true, ..all };
        }
        if limited > 1 {
            return MapLookup::default();
        }
        match &self.caustic {
            Some(caustic) => {
                let travelled = if came.gathers() { 0.0 } else { travelled };
                let gathered = caustic.reflected(context, (point, bsdf), (wo, travelled), turns);
                MapLookup { gathered: gathered.unwrap_or_default(), next: Components::NO_CAUSTIC, ..all }
            }
            None => MapLookup { next: Components::GATHERED, ..all },
        }
    }
}

/// Whether something in `scene` may make caustics.
pub fn may_have_caustics(scene: &Scene) -> bool {
    scene.materials.iter().any(Material::may_be_caustic_caster)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Frame;
    use crate::photon::{lines, with_map_of};
    use crate::sampling::Random;
    use crate::scene::{Material, Mesh, Triangle};
    use glam::Vec2;
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn an_even_floor_is_even_and_the_dark_stays_behind_its_wall() {
        // Upright in the middle of a floor of 1 × 1.
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
        let mesh = Mesh { positions: &positions, normals: &[], texcoords: &[], triangles: &triangles };
        let mut memory = lines(Bvh::footprint(triangles.len()));
        let bvh = Bvh::build(&mesh, &mut Arena::new(bytemuck::cast_slice_mut(&mut memory))).unwrap();

        // An irradiance of one on its left, of a tenth on its right.
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
                all.run(task, &mut Arena::new(bytemuck::cast_slice_mut(&mut scratch)), out).unwrap();
            }
            with_map_of(&found, |irradiances| {
                check(&GlobalMapLookup::new(global, irradiances, 1.0, kernel), (&bvh, level), random);
            });
        });
    }

    /// Asks `light` on both sides of the wall.
    fn check(light: &GlobalMapLookup, tracer: (&Bvh, Level), random: Random) {
        let material = Material::diffuse(Rgb::ONE);
        let ask = |x: f32, y: f32| {
            let point = SurfacePoint {
                position: Vec3::new(x, y, 0.0),
                error: 1e-7,
                geometric_normal: Vec3::Z,
                frame: Frame::from_normal(Vec3::Z),
                uv: Vec2::ZERO,
                front: true,
                material: &material,
                triangle: 1,
            };
            light.irradiance(tracer, &point, 100.0).map(|(irradiance, _)| irradiance.x)
        };
        let in_light: Vec<_> = (0..4000)
            .filter_map(|i| ask(0.1 + 0.3 * random.single(i), 0.1 + 0.8 * random.single(4000 + i)))
            .collect();
        let count = in_light.len() as f32;
        let mean = in_light.iter().sum::<f32>() / count;
        let scatter = (in_light.iter().map(|e| (e - mean).powi(2)).sum::<f32>() / count).sqrt();
        // The nearest irradiance alone scatters by 0.15.
        assert!(count > 3000.0 && (mean - 1.0).abs() < 0.025 && scatter < 0.13, "{count} {mean} {scatter}");
        let in_shade: Vec<_> = (0..4000)
            .filter_map(|i| ask(0.501 + 0.1 * random.single(i), 0.1 + 0.8 * random.single(4000 + i)))
            .collect();
        let most = in_shade.iter().fold(0.0, |most: f32, &e| most.max(e));
        assert!(in_shade.len() > 1000 && most < 0.25, "{} {most}", in_shade.len());
    }
}
