//! Emission of photons from all lights of a scene. A light is chosen by its power, then a point on it and a
//! direction by its emission. The power of a photon is the emitted power over the density of all choices, so
//! that the powers of photons sum to the power of the lights.
//!
//! Infinite light enters through the disc that the scene's bounding sphere presents to it; in a very large
//! scene, more of it near the surfaces that the camera sees.

mod focus;
mod guide;
mod learning;
mod pdf;
mod power;

pub use focus::Focus;
pub use learning::GuideStats;
pub(crate) use pdf::LightType;

use super::area::Emitter;
use super::emitted::{emitted_at, spot_falloff};
use super::sampler::LightSampler;
use crate::Rgb;
use crate::geometry::{Bounds, Frame, MISS, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::warp::{
    UNIFORM_SPHERE_PDF, concentric_disk, concentric_square, cosine_hemisphere, uniform_cone,
    uniform_cone_pdf, uniform_sphere, uniform_sphere_square, uniform_triangle,
};
use crate::sampling::{AliasTable, Numbers, Sampler};
use crate::scene::{PointLight, Scene};
use core::f32::consts::{PI, TAU};
use focus::Entrance;
use glam::Vec3;
use guide::{EmissionGuide, GuideSample};
use power::power;

/// Dimensions of a photon's sampler that emission uses, from 0 on.
pub const DIMENSIONS: u32 = 3;
const CHOICE: u32 = 0;
const PLACE: u32 = 1;
const DIRECTION: u32 = 2;

/// Factor on the radius of the bounding sphere, so that rounding leaves nothing outside.
const SPHERE_MARGIN: f32 = 1.0 + 1e-5;

/// Photon that leaves a light.
#[derive(Clone, Copy, Debug)]
pub struct EmissionSample {
    /// Ray from the light.
    pub ray: Ray,
    /// Power in W if the photon is the only one.
    pub power: Rgb,
    /// Triangle that the photon leaves; [`MISS`] without one.
    pub triangle: u32,
    /// Light that the photon leaves, in the order of emission.
    pub(crate) light: u32,
    /// Cell of the guide that chose the photon, if there is a guide.
    pub(crate) cell: u32,
}

/// Lights of a scene as a source of photons.
#[derive(Clone, Copy, Debug)]
pub struct EmissionSampler<'m> {
    /// Emitters, points and spots, directional lights, the environment, by their power: the order of
    /// emission.
    pub(super) table: AliasTable<'m>,
    /// Disc of infinite light.
    entrance: Entrance,
    /// Learned distribution of useful photons.
    guide: Option<EmissionGuide<'m>>,
}

impl<'m> EmissionSampler<'m> {
    /// Bytes that [`EmissionSampler::build`] takes for so many lights.
    pub fn footprint(lights: usize) -> Footprint {
        AliasTable::footprint(lights)
    }

    /// Sampler for the lights of a scene within `bounds`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`EmissionSampler::footprint`].
    pub fn build(
        scene: &Scene,
        lights: &LightSampler,
        bounds: &Bounds,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        Self::build_around(scene, lights, (bounds, None), arena)
    }

    /// Sampler for the lights of a scene within bounds, which sends more light from infinity to the `focus`
    /// if the scene is much larger.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`EmissionSampler::footprint`].
    pub fn build_around(
        scene: &Scene,
        lights: &LightSampler,
        (bounds, focus): (&Bounds, Option<Focus>),
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let empty = bounds.is_empty();
        let (center, diagonal) = if empty { (Vec3::ZERO, 0.0) } else { (bounds.center(), bounds.diagonal()) };
        let radius = 0.5 * diagonal * SPHERE_MARGIN;
        let entrance = Entrance::new(center, radius, bounds, focus);
        let power = |i| power(scene, lights, entrance.area(), i);
        let largest = (0..lights.count()).map(power).fold(0.0, f64::max);
        // Relative to the largest, to fit into f32.
        let relative = |i| if largest > 0.0 { (power(i) / largest) as f32 } else { 0.0 };
        Ok(Self { table: AliasTable::build(lights.count(), relative, arena)?, entrance, guide: None })
    }

    /// True if more light from infinity is sent to the focus than to the rest of the scene.
    pub(crate) fn is_focused(&self) -> bool {
        self.entrance.is_focused()
    }

    /// Photon of the random `numbers`. `None` without light, or without power.
    pub fn emit<N: Numbers>(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        numbers: &N,
    ) -> Option<EmissionSample> {
        let choice = numbers.single(CHOICE);
        let (mut place, mut direction) = (numbers.pair(PLACE), numbers.pair(DIRECTION));
        let GuideSample { light, cell, square } = match &self.guide {
            None => GuideSample { light: self.table.sample(choice)?.0, ..GuideSample::default() },
            Some(guide) => guide.sample(choice)?,
        };
        // The guide controls the direction of light from finite places, and the entry point of light from
        // infinity.
        let aiming = if light < lights.finite_count() { &mut direction } else { &mut place };
        *aiming = square.map_or(*aiming, |square| square.at(*aiming));
        let square = square.map(|_| *aiming);
        let emitted = if let Some(emitter) = lights.emitters.get(light) {
            from_surface(scene, emitter, place, direction)
        } else if light < lights.finite_count() + lights.distant.len() {
            self.without_surface(lights.without_surface(scene, light)?, place, direction)
        } else {
            let (environment, sky) = (scene.environment.as_ref()?, lights.environment.as_ref()?);
            let (towards, pdf) = sky.sample(environment, Vec3::ZERO, direction)?;
            let radiance = environment.radiance(scene, towards).max(Rgb::ZERO);
            self.parallel(-towards, radiance / pdf, place)
        }?;
        let (way, on) = (Vec3::from(emitted.ray.direction), Vec3::from(emitted.ray.origin));
        let power = emitted.power / self.density_with(scene, lights, light, (way, on), square);
        (power.is_finite() && power.max_element() > 0.0).then_some(EmissionSample {
            power,
            light: light as u32,
            cell: cell as u32,
            ..emitted
        })
    }

    /// Probability of `light`, in the order of emission, times the density of the random numbers that direct
    /// its photon. Factors such as 1 / area are left out. The photon leaves the point `on` of the light along
    /// unit `way`, or enters through `on` from infinity.
    pub(super) fn density(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        light: usize,
        way: Vec3,
        on: Vec3,
    ) -> f32 {
        self.density_with(scene, lights, light, (way, on), None)
    }

    /// As [`EmissionSampler::density`], with the random numbers if they are `known`.
    fn density_with(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        light: usize,
        line: (Vec3, Vec3),
        known: Option<[f32; 2]>,
    ) -> f32 {
        let Some(guide) = &self.guide else { return self.table.pdf(light) };
        let square = known.or_else(|| self.square(scene, lights, light, line.0, line.1));
        square.map_or(0.0, |square| guide.density(light, square))
    }

    /// Random numbers that direct a photon of `light` along unit `way` through `to`.
    fn square(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        light: usize,
        way: Vec3,
        to: Vec3,
    ) -> Option<[f32; 2]> {
        if let Some(emitter) = lights.emitters.get(light) {
            let plane = Vec3::from(emitter.normal);
            let normal = if way.dot(plane) > 0.0 || !emitter.is_two_sided() { plane } else { -plane };
            let local = Frame::from_normal(normal).to_local(way);
            return (local.z > 0.0).then(|| concentric_square(local.truncate()));
        }
        let through = || {
            let local = Frame::from_normal(way).to_local(to - self.entrance.center);
            self.entrance.unit(local.truncate()).map(concentric_square)
        };
        match lights.without_surface(scene, light) {
            Some(PointLight::Point { .. }) => Some(uniform_sphere_square(way)),
            Some(PointLight::Spot { direction, cos_outer, .. }) => {
                let local = Frame::from_normal(*direction).to_local(way);
                let turns = libm::atan2f(local.y, local.x) / TAU;
                let square =
                    [(1.0 - local.z) / (1.0 - cos_outer), if turns < 0.0 { turns + 1.0 } else { turns }];
                (square[0] < 1.0).then_some(square)
            }
            Some(PointLight::Directional { .. }) | None => through(),
        }
    }

    /// Random numbers that direct a photon of `light` at `target`, from a random point on the light; `None`
    /// if it does not emit towards it.
    pub(super) fn aim(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        light: usize,
        target: Vec3,
        sampler: &Sampler,
    ) -> Option<[f32; 2]> {
        if let Some(emitter) = lights.emitters.get(light) {
            let u = sampler.pair(PLACE);
            let from = emitter.place(if emitter.is_pair() { u } else { uniform_triangle(u).into() });
            return self.square(scene, lights, light, (target - from.position).try_normalize()?, target);
        }
        let way = match lights.without_surface(scene, light) {
            Some(PointLight::Point { position, .. } | PointLight::Spot { position, .. }) => {
                (target - *position).try_normalize()?
            }
            Some(PointLight::Directional { direction, .. }) => *direction,
            None => {
                let sky = lights.environment.as_ref()?;
                -sky.sample(scene.environment.as_ref()?, Vec3::ZERO, sampler.pair(DIRECTION))?.0
            }
        };
        self.square(scene, lights, light, way, target)
    }

    fn without_surface(
        &self,
        light: &PointLight,
        place: [f32; 2],
        direction: [f32; 2],
    ) -> Option<EmissionSample> {
        let from = |position, way, power| EmissionSample {
            ray: Ray::new(position, way),
            power,
            triangle: MISS,
            light: 0,
            cell: 0,
        };
        match *light {
            PointLight::Point { position, intensity } => {
                Some(from(position, uniform_sphere(direction), intensity / UNIFORM_SPHERE_PDF))
            }
            PointLight::Spot { position, direction: axis, intensity, cos_inner, cos_outer } => {
                let way = Frame::from_normal(axis).to_world(uniform_cone(direction, 1.0 - cos_outer));
                let falloff = spot_falloff(way.dot(axis), cos_inner, cos_outer);
                let power = intensity * falloff / uniform_cone_pdf(1.0 - cos_outer);
                Some(from(position, way, power))
            }
            PointLight::Directional { direction, irradiance } => self.parallel(direction, irradiance, place),
        }
    }

    /// Parallel light of `irradiance`, through a point of the disc of infinite light; `None` if it misses the
    /// scene.
    fn parallel(&self, direction: Vec3, irradiance: Rgb, place: [f32; 2]) -> Option<EmissionSample> {
        let point = self.entrance.point(concentric_disk(place));
        let start = self.entrance.start(direction, point)?;
        let power = irradiance * self.entrance.area_of(point);
        Some(EmissionSample { ray: Ray::new(start, direction), power, triangle: MISS, light: 0, cell: 0 })
    }
}

fn from_surface(
    scene: &Scene,
    emitter: &Emitter,
    [a, b]: [f32; 2],
    direction: [f32; 2],
) -> Option<EmissionSample> {
    // The first half of the numbers belongs to the front of a two-sided light.
    let sides = if emitter.is_two_sided() { 2.0 } else { 1.0 };
    let front = sides * a < 1.0 || sides == 1.0;
    let a = if sides == 1.0 { a } else { 2.0 * a - if front { 0.0 } else { 1.0 } };
    let at = if emitter.is_pair() { [a, b] } else { uniform_triangle([a, b]).into() };
    let place = emitter.place(at);
    let plane = Vec3::from(emitter.normal);
    let radiance = emitted_at(scene, emitter, &place, front);
    let normal = if front { plane } else { -plane };
    let error = emitter.error(place.position, place.position);
    let way = Frame::from_normal(normal).to_world(cosine_hemisphere(direction));
    let ray = Ray::new(place.position + error * normal, way);
    Some(EmissionSample {
        ray,
        power: radiance * (PI * emitter.area * sides),
        triangle: place.triangle,
        light: 0,
        cell: 0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Line;
    use crate::scene::{Camera, Environment, Material, Mesh, Triangle};
    use std::vec;

    /// Unit square light that faces +z, with `material`.
    fn with_square(material: Material, check: impl FnOnce(&Scene)) {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let triangles = [[0, 1, 2], [0, 2, 3]].map(|vertices| Triangle { vertices, material: 0 });
        let materials = [material];
        let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };
        check(&Scene {
            mesh,
            materials: &materials,
            textures: &[],
            lights: &[],
            environment: None,
            camera: Camera::look_at(Vec3::ZERO, Vec3::Z, Vec3::Y, 40.0),
        });
    }

    /// Mean power of photons; calls `look` with each.
    fn mean_power(scene: &Scene, mut visit: impl FnMut(&EmissionSample)) -> Rgb {
        const PHOTONS: u32 = 1 << 16;
        let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::splat(1.0) };
        let bytes = LightSampler::footprint(scene).and(LightSampler::scratch(scene));
        let mut memory = vec![Line([0; 64]); bytes.bytes() / 64];
        let lights = LightSampler::build(scene, &mut Arena::over(&mut memory)).unwrap();
        let mut memory = vec![Line([0; 64]); EmissionSampler::footprint(lights.count()).bytes() / 64];
        let mut arena = Arena::over(&mut memory);
        let emission = EmissionSampler::build(scene, &lights, &bounds, &mut arena).unwrap();
        assert_eq!(arena.available(), 0);
        let mut sum = [0.0f64; 3];
        for photon in 0..PHOTONS {
            let sampler = Sampler::replicate(5, 1, 0, photon);
            if let Some(emitted) = emission.emit(scene, &lights, &sampler) {
                visit(&emitted);
                sum.iter_mut()
                    .zip(emitted.power.to_array())
                    .for_each(|(sum, power)| *sum += f64::from(power));
            }
        }
        Rgb::from_array(sum.map(|sum| (sum / f64::from(PHOTONS)) as f32))
    }

    /// Relative error of the mean of 65 536 stratified photons.
    const NOISE: f32 = 2e-3;

    fn assert_near(power: Rgb, expected: Rgb) {
        assert!((power - expected).abs().cmple(expected * NOISE).all(), "{power}, not {expected}");
    }

    #[test]
    fn a_surface_emits_pi_times_area_to_its_front_or_to_both_sides() {
        let emission = Rgb::new(3.0, 2.0, 1.0);
        let material = Material { emission: emission.into(), ..Material::GREY };
        with_square(material, |scene| {
            let (mut count, mut cosines) = (0, 0.0);
            let power = mean_power(scene, |emitted| {
                assert!(emitted.ray.direction[2] >= 0.0 && emitted.ray.origin[2] > 0.0);
                cosines += emitted.ray.direction[2];
                count += 1;
            });
            assert_near(power, emission * PI);
            assert!((cosines / count as f32 - 2.0 / 3.0).abs() < NOISE, "by the cosine");
        });
        with_square(Material { two_sided: true, ..material }, |scene| {
            let mut backwards = 0;
            let power = mean_power(scene, |emitted| backwards += u32::from(emitted.ray.direction[2] < 0.0));
            assert_near(power, emission * 2.0 * PI);
            assert_eq!(backwards, 1 << 15);
        });
    }

    #[test]
    fn lights_without_surface_emit_their_intensity_and_those_far_away_what_meets_the_sphere() {
        let color = Rgb::new(0.5, 1.0, 2.0);
        let (cos_inner, cos_outer) = (0.9, 0.8);
        let direction = Vec3::new(0.6, 0.0, 0.8);
        // Integral of the linear falloff in angle, by small steps.
        let (inner, outer) = (0.9f32.acos(), 0.8f32.acos());
        let step = (outer - inner) / 4096.0;
        let falling: f32 = (0..4096)
            .map(|i| inner + (i as f32 + 0.5) * step)
            .map(|angle| 2.0 * PI * angle.sin() * (outer - angle) / (outer - inner) * step)
            .sum();
        let disc = PI * 3.0;
        let cases = [
            (PointLight::Point { position: Vec3::ONE, intensity: color }, 4.0 * PI),
            (
                PointLight::Spot { position: Vec3::ONE, direction, intensity: color, cos_inner, cos_outer },
                2.0 * PI * (1.0 - cos_inner) + falling,
            ),
            (PointLight::Directional { direction, irradiance: color }, disc),
        ];
        let mut all = 0.0;
        with_square(Material::GREY, |scene| {
            for (light, expected) in cases {
                let lights = [light];
                assert_near(mean_power(&Scene { lights: &lights, ..*scene }, |_| {}), color * expected);
                all += expected;
            }
            let environment = Environment::uniform(color);
            let scene = Scene { environment: Some(environment), ..*scene };
            let from_sky = 4.0 * PI * disc;
            assert_near(mean_power(&scene, |_| {}), color * from_sky);
            // All lights together, each by its share.
            let lights = cases.map(|(light, _)| light);
            let power = mean_power(&Scene { lights: &lights, ..scene }, |emitted| {
                assert!(emitted.ray.origin.iter().all(|x| x.abs() < 3.0));
            });
            assert_near(power, color * (all + from_sky));
        });
    }
}
