//! Light from infinitely far: what a ray sees that leaves the scene, and how to find its bright parts.

use super::Environment;
use crate::Rgb;
use crate::geometry::Frame;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::warp::{UNIFORM_SPHERE_PDF, cosine_hemisphere, cosine_hemisphere_pdf, uniform_sphere};
use crate::sampling::{Distribution2d, sin_cos_turns};
use crate::scene::{Scene, Texture};
use core::f32::consts::{PI, TAU};
use glam::{Vec2, Vec3};

impl Environment {
    /// The radiance from unit `direction`, which points away from the scene.
    #[inline]
    pub fn radiance(&self, scene: &Scene, direction: Vec3) -> Rgb {
        match self.texture(scene) {
            Some(texture) => self.looked_up(texture, square(self.to_map * direction)),
            None => self.radiance,
        }
    }

    fn texture<'s>(&self, scene: &'s Scene) -> Option<&'s Texture<'s>> {
        self.map
            .and_then(|id| scene.textures.get(id.0 as usize))
            .filter(|texture| texture.width > 0 && texture.height > 0)
    }

    /// At (azimuth, polar angle) as fractions of the map. Between a pole and the centres of the row next to
    /// it that row is held: the other pole must not be mixed in.
    #[inline]
    fn looked_up(&self, texture: &Texture, at: Vec2) -> Rgb {
        let half_row = 0.5 / texture.height as f32;
        let texel = texture.lookup(Vec2::new(at.x, 1.0 - at.y.clamp(half_row, 1.0 - half_row)));
        self.radiance * Rgb::new(texel[0], texel[1], texel[2])
    }
}

/// The place of a direction on the map, both coordinates in 0 … 1.
#[inline]
fn square(d: Vec3) -> Vec2 {
    let azimuth = libm::atan2f(d.z, d.x) * (1.0 / TAU);
    let polar = libm::atan2f(libm::sqrtf(d.x * d.x + d.z * d.z), d.y) * (1.0 / PI);
    Vec2::new(if azimuth < 0.0 { azimuth + 1.0 } else { azimuth }, polar)
}

/// Samples an environment: a map by its luminance, a constant one by the cosine of the receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnvironmentSampler<'m> {
    /// `None` where radiance is constant.
    map: Option<Distribution2d<'m>>,
    /// Mean luminance over the sphere.
    pub(super) mean: f32,
}

impl<'m> EnvironmentSampler<'m> {
    pub(super) fn footprint(scene: &Scene) -> Footprint {
        match scene.environment.as_ref().and_then(|e| e.texture(scene)) {
            Some(t) => Distribution2d::footprint(t.width as usize, t.height as usize),
            None => Footprint::default(),
        }
    }

    /// `None` where the environment is black.
    pub(super) fn build(scene: &Scene, arena: &mut Arena<'m>) -> Result<Option<Self>, OutOfMemory> {
        let Some(environment) = &scene.environment else { return Ok(None) };
        let Some(texture) = environment.texture(scene) else {
            let mean = super::luminance(environment.radiance);
            return Ok((mean > 0.0).then_some(Self { map: None, mean }));
        };
        let (width, height) = (texture.width as usize, texture.height as usize);
        let texel = Vec2::new(1.0 / width as f32, 1.0 / height as f32);
        let (mut sum, mut sines) = (0.0, 0.0);
        let weight = |x: usize, y: usize| {
            // The mean over the texel's square of the bilinear map is the mean of its values at the
            // middles of the four quarters.
            let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let quarters = [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)];
            let value = |(dx, dy)| {
                let at = (center + Vec2::new(dx, dy)) * texel;
                super::luminance(environment.looked_up(texture, at))
            };
            let mean = 0.25 * quarters.into_iter().map(value).sum::<f32>();
            let sine = sin_cos_turns(0.5 * center.y * texel.y).0;
            if mean > 0.0 && mean.is_finite() {
                sum += f64::from(mean * sine);
            }
            sines += f64::from(sine);
            mean * sine
        };
        let map = Distribution2d::build(width, height, weight, arena)?;
        let mean = (sum / sines) as f32;
        Ok((mean > 0.0).then_some(Self { map: Some(map), mean }))
    }

    /// A direction and its density in solid angle.
    #[inline]
    pub(super) fn sample(&self, environment: &Environment, normal: Vec3, u: [f32; 2]) -> Option<(Vec3, f32)> {
        let Some(map) = &self.map else {
            if normal == Vec3::ZERO {
                return Some((uniform_sphere(u), UNIFORM_SPHERE_PDF));
            }
            let local = cosine_hemisphere(u);
            return Some((Frame::from_normal(normal).to_world(local), cosine_hemisphere_pdf(local.z)));
        };
        let cell = map.sample(u)?;
        let texel = map.cell_size();
        let (sin_phi, cos_phi) = sin_cos_turns((cell.x as f32 + cell.offset[0]) * texel[0]);
        let (sin, cos) = sin_cos_turns(0.5 * (cell.y as f32 + cell.offset[1]) * texel[1]);
        let direction = Vec3::new(sin * cos_phi, cos, sin * sin_phi);
        let pdf = solid_angle_pdf(cell.pdf, sin);
        (pdf > 0.0).then(|| (environment.to_map.transpose() * direction, pdf))
    }

    /// The density of [`EnvironmentSampler::sample`] for unit `direction`.
    #[inline]
    pub(super) fn pdf(&self, environment: &Environment, normal: Vec3, direction: Vec3) -> f32 {
        let Some(map) = &self.map else {
            if normal == Vec3::ZERO {
                return UNIFORM_SPHERE_PDF;
            }
            return cosine_hemisphere_pdf(normal.dot(direction));
        };
        let d = environment.to_map * direction;
        solid_angle_pdf(map.pdf_at(square(d).to_array()), libm::sqrtf(d.x * d.x + d.z * d.z))
    }
}

/// From density over the map's unit square to solid angle: dω = 2π² sin θ du dv.
#[inline]
fn solid_angle_pdf(pdf: f32, sin: f32) -> f32 {
    if sin > 0.0 { pdf / (TAU * PI * sin) } else { 0.0 }
}
