//! Spots: small places that are far brighter than what is around them, as where a spotlight meets a wall. Rays that gather
//! for a record meet one by chance, and the record is far too bright, or miss it, and it is too dark. Which spots there
//! are is learnt from such rays; the records that follow look at each by rays of its own.
//!
//! A spot is known by its glints: rays that bring a large part of all light that a record has. A closer look tells it
//! from a path that was lucky later on its way. What is bright around it is a spot of its own, which holds the other.
//!
//! What a hemisphere holds is divided, so that nothing is found twice and nothing is lost: directions into the cone of
//! a spot are sampled there, evenly in solid angle, all others by strata; where cones overlap, the first spot has them.
//! Paths that go on from what gather rays meet aim at spots every other time, by one-sample multiple importance sampling
//! (Veach 1997, §9.2.4).

use super::estimator::{Counters, dimension};
use super::gather::{NO_PIXEL, Place, Strata};
use super::path::PathTracer;
use super::reuse::Exchange;
use super::wave::Wave;
use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::bvh::Coherence;
use crate::cache::irradiance::second_differences;
use crate::geometry::{Frame, Ray};
use crate::light::luminance;
use crate::memory::{Arena, OutOfMemory};
use crate::sampling::Sampler;
use crate::sampling::warp::{concentric_square, uniform_cone, uniform_cone_pdf};
use core::f32::consts::{FRAC_1_PI, PI};
use glam::Vec3;

/// A spot that fills a wider cone than of this sine, squared, is met by many rays anyway.
const WIDEST: f32 = 0.25;

/// Share of the directions that aim at spots where paths go on.
const AIMED: f32 = 0.5;

/// Rays along a side of a closer look at a glint.
pub(super) const LOOK: usize = 8;

/// Sines of the half-angles of closer looks, times the strata along a side: from a hundredth of a stratum to four.
const NARROW: [f32; 3] = [0.125, 0.5, 2.0];

/// A ray of a closer look is bright where it has this share of what the glint had.
const BRIGHT: f32 = 0.25;

/// The fewest bright rays that show how large a spot is.
const CLEAR: usize = 8;

/// Its rim lies beyond the outermost of them, by this factor.
const MARGIN: f32 = 2.0;

/// The most rays along a side into the cone of a spot: a wave has room for them.
const LARGEST: usize = 32;

/// A bright end of a gather ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Glint {
    /// Where it is.
    pub position: [f32; 3],
    /// Luminance of what came from there; 0: there is none.
    pub light: f32,
    /// The gathering.
    pub number: u32,
}

/// A sphere in which a spot lies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spot {
    /// Its middle.
    pub center: [f32; 3],
    /// Its radius, m.
    pub radius: f32,
}

impl Spot {
    /// Whether `position` lies in it.
    pub fn holds(&self, position: Vec3) -> bool {
        position.distance_squared(self.center.into()) < self.radius * self.radius
    }

    /// The cone that holds it, from `position` on a surface of that normal; `None` where it is wide, or below the surface.
    pub(super) fn cone(&self, position: Vec3, normal: Vec3) -> Option<Cone> {
        let offset = Vec3::from(self.center) - position;
        let square = offset.length_squared();
        let sine = self.radius * self.radius / square;
        let is_aimed_at = sine < WIDEST && offset.dot(normal) > -self.radius;
        is_aimed_at.then(|| Cone::new(offset / libm::sqrtf(square), sine))
    }
}

/// The cones of those spots that are to be aimed at from `position` on a surface of that normal.
fn cones(spots: &[Spot], position: Vec3, normal: Vec3) -> impl Iterator<Item = Cone> {
    spots.iter().filter_map(move |spot| spot.cone(position, normal))
}

/// Directions around an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    frame: Frame,
    one_minus_cos: f32,
}

impl Cone {
    /// Around unit `axis`, by the square of the sine of its half-angle.
    pub(super) fn new(axis: Vec3, sine: f32) -> Self {
        Self { frame: Frame::from_normal(axis), one_minus_cos: sine / (1.0 + libm::sqrtf(1.0 - sine)) }
    }

    pub(super) fn solid_angle(&self) -> f32 {
        2.0 * PI * self.one_minus_cos
    }

    /// Whether unit `direction` lies in it. 1 - cos is half of the square between the tips.
    pub(super) fn holds(&self, direction: Vec3) -> bool {
        0.5 * direction.distance_squared(self.frame.normal) < self.one_minus_cos
    }

    /// A direction of it, evenly in solid angle.
    pub(super) fn sample(&self, u: [f32; 2]) -> Vec3 {
        self.frame.to_world(uniform_cone(u, self.one_minus_cos))
    }
}

/// Cones of the spots around a vertex at which a path goes on.
pub(super) struct Cones<'s> {
    spots: &'s [Spot],
    position: Vec3,
    normal: Vec3,
    count: u32,
}

impl<'s> Cones<'s> {
    /// `None` where none is to be aimed at.
    pub(super) fn around(spots: &'s [Spot], position: Vec3, normal: Vec3) -> Option<Self> {
        let count = cones(spots, position, normal).count() as u32;
        (count > 0).then_some(Self { spots, position, normal, count })
    }

    fn all(&self) -> impl Iterator<Item = Cone> {
        cones(self.spots, self.position, self.normal)
    }

    /// Whether unit `direction` leads to a spot.
    pub(super) fn hold(&self, direction: Vec3) -> bool {
        self.all().any(|cone| cone.holds(direction))
    }

    /// The density of unit `direction`, which has density `pdf` where nothing is aimed at.
    pub(super) fn density(&self, direction: Vec3, pdf: f32) -> f32 {
        let inside = self.all().filter(|cone| cone.holds(direction));
        let aimed: f32 = inside.map(|cone| uniform_cone_pdf(cone.one_minus_cos)).sum();
        (1.0 - AIMED) * pdf + AIMED * aimed / self.count as f32
    }

    /// Chooses where light that leaves a diffuse `bsdf` came from: from a spot, or as the surface would.
    pub(super) fn sample<F: Features>(
        &self,
        bsdf: &Bsdf,
        frame: &Frame,
        [u, v]: [f32; 2],
        choice: f32,
    ) -> Option<BsdfSample> {
        let direction = match self.aim([u, v], choice) {
            Some(direction) => frame.to_local(direction),
            None => bsdf.sample::<F>(Vec3::Z, [u, v, 0.0])?.direction,
        };
        let (f, pdf) = bsdf.evaluate::<F>(Vec3::Z, direction);
        let pdf = self.density(frame.to_world(direction), pdf);
        (f != Rgb::ZERO).then(|| BsdfSample::reflection(direction, f / pdf, pdf))
    }

    /// The direction that is aimed at, by `u` and by `choice` in 0 .. 1; `None` where the surface is to choose.
    fn aim(&self, u: [f32; 2], choice: f32) -> Option<Vec3> {
        let index = (choice / AIMED * self.count as f32) as usize;
        self.all().nth(index).map(|cone| cone.sample(u))
    }
}

/// Rays into a cone, evenly in solid angle: `side`² of them, with random numbers of their own.
struct Look {
    cone: Cone,
    pixel: u32,
    first: u32,
    side: usize,
}

impl Look {
    fn count(&self) -> usize {
        self.side * self.side
    }

    fn direction(&self, seed: u32, i: usize) -> Vec3 {
        let u = Sampler::new(seed, self.pixel, self.first + i as u32).pair(dimension::PIXEL);
        let cell = [i % self.side, i / self.side];
        self.cone.sample([0, 1].map(|k| (cell[k] as f32 + u[k]) / self.side as f32))
    }
}

impl Strata<'_> {
    /// What was brightest, in falling order.
    pub(super) fn glints(&self, place: &Place, frame: &Frame, number: u32, glints: &mut [Glint]) {
        for (stratum, radiance) in self.radiance.iter().enumerate() {
            let light = luminance(Rgb::from(*radiance));
            let Some(place_of) = glints.iter().position(|glint| glint.light < light) else { continue };
            let (Some(inverse), Some(direction)) =
                (self.inverse_distance.get(stratum), self.directions.get(stratum))
            else {
                continue;
            };
            if *inverse > 0.0 {
                let offset = frame.to_world(Vec3::from(*direction)) / *inverse;
                glints[place_of..].rotate_right(1);
                glints[place_of] = Glint { position: (place.position() + offset).to_array(), light, number };
            }
        }
    }
}

impl<F: Features> PathTracer<'_, F> {
    /// Looks closely at a glint that `place` has seen among so many strata along a side: the spot that it belongs to, unless
    /// it is as large as strata, or no more than the luck of a path, whose neighbours are dark. Looks widen until most of
    /// what they see is not bright.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`PathTracer::gather_scratch`].
    pub fn spot_of(
        &self,
        glint: &Glint,
        place: &Place,
        strata: usize,
        scratch: &mut Arena,
        counters: &mut Counters,
    ) -> Result<Option<Spot>, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut wave = Wave::new(LOOK * LOOK, &mut arena)?;
        let axis = (Vec3::from(glint.position) - place.position()).normalize_or_zero();
        let pixel = NO_PIXEL | glint.number;
        let mut spot = None;
        for (look, narrow) in NARROW.into_iter().enumerate() {
            let (sine, first) = (narrow / strata as f32, (1 << 24) + (look * LOOK * LOOK) as u32);
            let look = Look { cone: Cone::new(axis, sine * sine), pixel, first, side: LOOK };
            let mut ends = [Vec3::ZERO; LOOK * LOOK];
            self.send_into(&look, place, &mut wave, counters);
            for (end, (ray, hit)) in ends.iter_mut().zip(wave.rays.iter().zip(&*wave.hits)) {
                *end = Vec3::from(ray.origin) + hit.t * Vec3::from(ray.direction);
            }
            self.finish(&mut wave, look.count(), counters);
            let lights = wave.paths.iter().map(|path| luminance(Rgb::from(path.radiance)));
            let bright = ends.iter().zip(lights).filter(|(_, light)| *light > BRIGHT * glint.light);
            let bright = bright.map(|(end, _)| *end);
            let count = bright.clone().count();
            let is_full = 2 * count >= look.count();
            if is_full || spot.is_some() && count >= CLEAR {
                let center = bright.clone().sum::<Vec3>() / count as f32;
                let farthest = bright.map(|end| end.distance(center)).fold(0.0, f32::max);
                spot = Some(Spot { center: center.to_array(), radius: MARGIN * farthest });
            }
            if !is_full {
                return Ok(spot.filter(|spot| spot.cone(place.position(), place.normal()).is_some()));
            }
        }
        Ok(None)
    }

    /// Traces the rays of `look` into the first of the wave.
    fn send_into(&self, look: &Look, place: &Place, wave: &mut Wave, counters: &mut Counters) {
        let count = look.count();
        for i in 0..count {
            let direction = look.direction(self.settings.seed, i);
            wave.rays[i] = Ray { tag: i as u32, ..place.ray(direction) };
            wave.paths[i] = place.path(look.pixel, look.first + i as u32, i);
            wave.exchanges[i] = Exchange::new(0);
        }
        counters.paths += count as u64;
        self.trace(wave, count, Coherence::Coherent, counters);
    }

    /// The cones of the spots that rays from `place` aim at.
    fn cones(&self, place: &Place) -> impl Iterator<Item = Cone> {
        cones(self.spots, place.position(), place.normal())
    }

    /// Takes out of the strata what they have of spots.
    pub(super) fn leave_out_spots(&self, place: &Place, frame: &Frame, strata: &mut Strata) {
        for cone in self.cones(place) {
            for (radiance, direction) in strata.radiance.iter_mut().zip(&*strata.directions) {
                if cone.holds(frame.to_world(Vec3::from(*direction))) {
                    *radiance = [0.0; 3];
                }
            }
        }
    }

    /// Adds what is seen in the cones of spots to the strata in which they lie; the variance of the luminance that this
    /// adds to the irradiance. With all spots, it takes at most as many rays as there are strata.
    pub(super) fn look_at_spots(
        &self,
        place: &Place,
        frame: &Frame,
        number: u32,
        wave: &mut Wave,
        strata: &mut Strata,
        counters: &mut Counters,
    ) -> f32 {
        let n = strata.n;
        let share = libm::ceilf(libm::sqrtf(self.spots.len() as f32)) as usize;
        let side = (n / share.max(1)).clamp(1, LARGEST);
        let (mut variance, mut first) = (0.0, n * n);
        for (index, cone) in self.cones(place).enumerate() {
            let look = Look { cone, pixel: NO_PIXEL | number, first: first as u32, side };
            let count = look.count();
            first += count;
            self.send_into(&look, place, wave, counters);
            self.finish(wave, count, counters);
            // What a ray is worth, of the irradiance and of the radiance of a stratum.
            let worth = cone.solid_angle() / count as f32;
            let of_stratum = worth * (n * n) as f32 * FRAC_1_PI;
            for (i, (light, path)) in strata.aimed.iter_mut().zip(&*wave.paths).enumerate().take(count) {
                let world = look.direction(self.settings.seed, i);
                let local = frame.to_local(world);
                let belongs = local.z > 0.0 && !self.cones(place).take(index).any(|cone| cone.holds(world));
                let seen = if belongs { Rgb::from(path.radiance) * local.z } else { Rgb::ZERO };
                *light = seen.to_array();
                let [column, row] = concentric_square(local.truncate()).map(|x| (x * n as f32) as usize);
                if let Some(radiance) = strata.radiance.get_mut(row.min(n - 1) * n + column.min(n - 1)) {
                    *radiance = (Rgb::from(*radiance) + seen * of_stratum).to_array();
                }
            }
            let seen = strata.aimed.get(..count).unwrap_or_default();
            let [squares, differences] = second_differences(seen, side);
            variance += worth * worth * count as f32 * squares / (6.0 * differences);
        }
        variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;
    use crate::sampling::warp::cosine_hemisphere;

    const SPOTS: [Spot; 3] = [
        Spot { center: [0.3, 0.1, 2.0], radius: 0.2 },
        Spot { center: [0.4, 0.1, 2.0], radius: 0.2 },
        Spot { center: [1.0, 0.0, -1.0], radius: 0.5 },
    ];

    /// The integral of cos over the hemisphere is π, whoever aims.
    #[test]
    fn what_is_aimed_keeps_integrals() {
        let cones = Cones::around(&SPOTS, Vec3::ZERO, Vec3::Z).unwrap();
        assert_eq!(cones.count, 2);
        let (random, count) = (Random::new(3, 4), 1 << 16);
        let mut sum = 0.0f64;
        for i in 0..count {
            let [u, v, w] = [0, 1, 2].map(|k| random.single(3 * i + k));
            let aimed = cones.aim([u, v], w);
            let direction = aimed.unwrap_or_else(|| cosine_hemisphere([u, v]));
            let cos = direction.z.max(0.0);
            sum += f64::from(cos / cones.density(direction, cos / PI));
        }
        // Four standard errors: the integrand is at most 2 π.
        assert!((sum / f64::from(count) / f64::from(PI) - 1.0).abs() < 0.02, "{sum}");
    }

    #[test]
    fn cones_hold_what_they_sample() {
        for radius in [1e-4, 0.01, 0.4] {
            let spot = Spot { radius, ..SPOTS[0] };
            let cone = spot.cone(Vec3::ZERO, Vec3::Z).unwrap();
            let (random, axis) = (Random::new(5, 6), Vec3::from(spot.center));
            for i in 0..1000 {
                let direction = cone.sample([0.999 * random.single(2 * i), random.single(2 * i + 1)]);
                let nearest = axis - direction * axis.dot(direction);
                assert!(cone.holds(direction) && nearest.length() < 1.001 * radius, "{radius}");
            }
        }
        assert!(
            spot_from(Vec3::new(0.3, 0.1, 1.7)).is_none() && spot_from(Vec3::new(0.3, 0.1, 2.0)).is_none()
        );
        assert!(SPOTS[2].cone(Vec3::ZERO, Vec3::Z).is_none());
    }

    #[test]
    fn directions_find_their_stratum() {
        let random = Random::new(7, 8);
        for i in 0..1000 {
            let u = [random.single(2 * i), random.single(2 * i + 1)];
            let found = concentric_square(cosine_hemisphere(u).truncate());
            assert!((0..2).all(|k| (found[k] - u[k]).abs() < 1e-5), "{u:?} {found:?}");
        }
        assert_eq!(concentric_square(glam::Vec2::ZERO), [0.5; 2]);
    }

    fn spot_from(position: Vec3) -> Option<Cone> {
        SPOTS[0].cone(position, Vec3::Z)
    }
}
