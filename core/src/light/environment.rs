//! Environment light: radiance of a ray that leaves the scene, and importance sampling of it.

use super::disc::{DiscSampler, Part};
use super::environment_visibility::{VisibilityTable, WarpedSample};
use crate::Rgb;
use crate::geometry::Frame;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::warp::{
    UNIFORM_SPHERE_PDF, cosine_hemisphere, cosine_hemisphere_pdf, uniform_sphere, uniform_sphere_square,
};
use crate::sampling::{Cell, Distribution2d, sin_cos_turns};
use crate::scene::{DistantDisc, Environment, Scene, Texture};
use core::f32::consts::{PI, TAU};
use glam::{Vec2, Vec3};
use halflight_simd::kernels::shade::sky::SkyBlock;

impl Environment {
    /// Radiance from unit `direction`, which points away from the scene.
    #[inline]
    pub fn radiance(&self, scene: &Scene, direction: Vec3) -> Rgb {
        let behind = match self.texture(scene) {
            Some(texture) => self.lookup(texture, square(self.to_map * direction)),
            None => self.radiance,
        };
        match self.disc {
            Some(disc) if disc.contains(direction) => behind + disc.radiance,
            _ => behind,
        }
    }

    fn texture<'s>(&self, scene: &'s Scene) -> Option<&'s Texture<'s>> {
        self.map
            .and_then(|id| scene.textures.get(id.0 as usize))
            .filter(|texture| texture.width > 0 && texture.height > 0)
    }

    /// Radiance at (azimuth, polar angle) as fractions of the map. Between a pole and the centres of its
    /// nearest row the value of that row is kept, because interpolation would mix in the other pole.
    #[inline]
    fn lookup(&self, texture: &Texture, at: Vec2) -> Rgb {
        let half_row = 0.5 / texture.height as f32;
        let texel = texture.lookup(Vec2::new(at.x, 1.0 - at.y.clamp(half_row, 1.0 - half_row)));
        self.radiance * Rgb::new(texel[0], texel[1], texel[2])
    }
}

/// Position of a direction on the map, both coordinates in 0 … 1.
#[inline]
fn square(d: Vec3) -> Vec2 {
    let azimuth = libm::atan2f(d.z, d.x) * (1.0 / TAU);
    let polar = libm::atan2f(libm::sqrtf(d.x * d.x + d.z * d.z), d.y) * (1.0 / PI);
    Vec2::new(if azimuth < 0.0 { azimuth + 1.0 } else { azimuth }, polar)
}

/// Number of cells beyond which the density does not fit into the second-level cache.
const MAX_CACHED_CELLS: usize = 1 << 16;

/// Largest increase of the light's second moment by larger cells.
const MAX_LOSS: f64 = 0.02;

/// Texels along a side of a cell of the density: as many as lose next to nothing. A density that stays in the
/// cache is several times as fast. A sky may have large cells, a sky with a sun may not.
fn block(texture: &Texture) -> usize {
    let (width, height) = (texture.width as usize, texture.height as usize);
    let mut block = 1;
    while width * height / (block * block) > MAX_CACHED_CELLS {
        let next = 2 * block;
        if !width.is_multiple_of(next) || !height.is_multiple_of(next) || loss(texture, next) > MAX_LOSS {
            break;
        }
        block = next;
    }
    block
}

/// Relative increase of the light's second moment if cells of `block`² texels are sampled by their means.
fn loss(texture: &Texture, block: usize) -> f64 {
    let (width, height) = (texture.width as usize, texture.height as usize);
    let (mut by_texels, mut by_cells) = (0.0, 0.0);
    for y in (0..height).step_by(block) {
        let sine = f64::from(sin_cos_turns(0.5 * (y as f32 + 0.5 * block as f32) / height as f32).0);
        for x in (0..width).step_by(block) {
            let (mut sum, mut squares) = (0.0, 0.0);
            for i in 0..block * block {
                let [r, g, b, _] = texture.texel_at(x + i % block, y + i / block);
                let light = f64::from(super::luminance(Rgb::new(r, g, b)));
                if light > 0.0 && light.is_finite() {
                    sum += light;
                    squares += light * light;
                }
            }
            if sum > 0.0 {
                by_texels += sine * sum;
                by_cells += sine * squares / sum * (block * block) as f64;
            }
        }
    }
    if by_texels > 0.0 { by_cells / by_texels - 1.0 } else { 0.0 }
}

/// Cells of the density of a constant environment with a disc.
const CONSTANT_CELLS: [usize; 2] = [64, 32];

/// Sampler of an environment: a map by its luminance, constant radiance by the cosine at the receiver, and a
/// disc by its solid angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnvironmentSampler<'m> {
    /// `None` for constant radiance without a disc.
    map: Option<Distribution2d<'m>>,
    disc: Option<DiscSampler>,
    /// Mean luminance over the sphere.
    pub(super) mean: f32,
}

/// Density of a map by its luminance, and the mean luminance over the sphere.
fn of_map<'m>(
    environment: &Environment,
    texture: &Texture,
    arena: &mut Arena<'m>,
) -> Result<(Distribution2d<'m>, f32), OutOfMemory> {
    let (width, height) = (texture.width as usize, texture.height as usize);
    let texel = Vec2::new(1.0 / width as f32, 1.0 / height as f32);
    let (mut sum, mut sines) = (0.0, 0.0);
    let mut weight = |x: usize, y: usize| {
        // The mean of the bilinear map over the texel is the mean of its values at the centres of the
        // four quarters.
        let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let quarters = [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)];
        let value = |(dx, dy)| {
            let at = (center + Vec2::new(dx, dy)) * texel;
            super::luminance(environment.lookup(texture, at))
        };
        let mean = 0.25 * quarters.into_iter().map(value).sum::<f32>();
        let sine = sin_cos_turns(0.5 * center.y * texel.y).0;
        if mean > 0.0 && mean.is_finite() {
            sum += f64::from(mean * sine);
        }
        sines += f64::from(sine);
        mean * sine
    };
    let block = block(texture);
    let weight = |x: usize, y: usize| {
        let texels = (0..block * block).map(|i| (block * x + i % block, block * y + i / block));
        // A NaN texel darkens its cell by no more than itself.
        texels.map(|(x, y)| weight(x, y)).filter(|weight| weight.is_finite()).sum()
    };
    let map = Distribution2d::build(width / block, height / block, weight, arena)?;
    Ok((map, (sum / sines) as f32))
}

impl<'m> EnvironmentSampler<'m> {
    pub(super) fn footprint(scene: &Scene) -> Footprint {
        let Some(environment) = &scene.environment else { return Footprint::default() };
        match environment.texture(scene) {
            Some(texture) => {
                let block = block(texture);
                Distribution2d::footprint(texture.width as usize / block, texture.height as usize / block)
            }
            None if environment.disc.is_some() => {
                Distribution2d::footprint(CONSTANT_CELLS[0], CONSTANT_CELLS[1])
            }
            None => Footprint::default(),
        }
    }

    /// `None` if the environment is black.
    pub(super) fn build(scene: &Scene, arena: &mut Arena<'m>) -> Result<Option<Self>, OutOfMemory> {
        let Some(environment) = &scene.environment else { return Ok(None) };
        let (map, behind) = match environment.texture(scene) {
            Some(texture) => {
                let (map, mean) = of_map(environment, texture, arena)?;
                (Some(map), mean)
            }
            None if environment.disc.is_some() => {
                let [width, height] = CONSTANT_CELLS;
                let sine = |_, y: usize| sin_cos_turns(0.5 * (y as f32 + 0.5) / height as f32).0;
                let map = Distribution2d::build(width, height, sine, arena)?;
                (Some(map), super::luminance(environment.radiance))
            }
            None => (None, super::luminance(environment.radiance)),
        };
        // The disc covers this part of the sphere.
        let of_disc = |disc: &DistantDisc| super::luminance(disc.radiance) * 0.25 * disc.chord * disc.chord;
        let light = environment.disc.as_ref().map_or(0.0, of_disc);
        let mean = behind + light;
        let disc = environment.disc.as_ref().filter(|_| light > 0.0);
        let disc = disc.map(|disc| DiscSampler::new(disc, environment.to_map, light / mean));
        Ok((mean > 0.0).then_some(Self { map, disc, mean }))
    }

    /// Direction and density in solid angle for a sample of a visibility table.
    #[inline]
    pub(super) fn sample_at(&self, environment: &Environment, warped: WarpedSample) -> Option<(Vec3, f32)> {
        let (direction, pdf) = self.sample(environment, Vec3::ZERO, warped.place)?;
        Some((direction, pdf * warped.density))
    }

    /// Density of [`EnvironmentSampler::sample_at`] in unit `direction`, with samples of `table`.
    #[inline]
    pub(super) fn pdf_through(
        &self,
        environment: &Environment,
        table: &VisibilityTable,
        direction: Vec3,
    ) -> f32 {
        let Some(map) = &self.map else {
            return UNIFORM_SPHERE_PDF * table.density(uniform_sphere_square(direction));
        };
        let d = environment.to_map * direction;
        if let Some(disc) = self.disc.filter(|disc| disc.contains(d)) {
            return disc.pdf() * table.density(disc.square(d));
        }
        match map.invert(square(d).to_array()) {
            Some((u, pdf)) => {
                let (share, u) = self.disc.map_or((1.0, u), |d| (d.share_of_map(), d.square_of_map(u)));
                share * solid_angle_pdf(pdf, libm::sqrtf(d.x * d.x + d.z * d.z)) * table.density(u)
            }
            None => 0.0,
        }
    }

    /// True if the radiance of `environment` is constant.
    pub(super) fn is_constant(&self) -> bool {
        self.map.is_none()
    }

    /// Puts the sample at `u` into a block, as that of vertex `i`. False without a cell.
    #[inline]
    pub(super) fn put(&self, block: &mut SkyBlock, i: usize, u: [f32; 2]) -> bool {
        let mut at = u;
        if let Some(map) = &self.map {
            let Some((place, density)) = self.place(map, u) else { return false };
            at = place;
            block.density[i & 15] = density;
        }
        [block.at[0][i & 15], block.at[1][i & 15]] = at;
        true
    }

    /// Columns of the rotation from the map to the world; `None` without a map.
    #[inline]
    pub(super) fn map_to_world(&self, environment: &Environment) -> Option<[[f32; 3]; 3]> {
        self.map.map(|_| environment.to_map.transpose().to_cols_array_2d())
    }

    /// Direction and density in solid angle.
    #[inline]
    pub(super) fn sample(&self, environment: &Environment, normal: Vec3, u: [f32; 2]) -> Option<(Vec3, f32)> {
        let Some(map) = &self.map else {
            if normal == Vec3::ZERO {
                return Some((uniform_sphere(u), UNIFORM_SPHERE_PDF));
            }
            let local = cosine_hemisphere(u);
            return Some((Frame::from_normal(normal).to_world(local), cosine_hemisphere_pdf(local.z)));
        };
        let (at, density) = self.place(map, u)?;
        let (direction, sin) = direction_at(at);
        let pdf = solid_angle_pdf(density, sin);
        (pdf > 0.0).then(|| (environment.to_map.transpose() * direction, pdf))
    }

    /// Azimuth and polar angle in turns of the sample at `u`, and its density over the unit square of the
    /// map; `None` for a sample of the map behind the disc.
    #[inline]
    fn place(&self, map: &Distribution2d, u: [f32; 2]) -> Option<([f32; 2], f32)> {
        let of_map = |u| {
            let cell = map.sample(u)?;
            Some((position(&cell, map.cell_size()), cell.pdf))
        };
        let Some(disc) = &self.disc else { return of_map(u) };
        match disc.part(u) {
            Part::Disc(u) => {
                let at = square(disc.direction(u));
                let at = [at.x, 0.5 * at.y];
                Some((at, disc.pdf() * (TAU * PI * sin_cos_turns(at[1]).0)))
            }
            Part::Map(u) => {
                let (at, density) = of_map(u)?;
                (!disc.contains(direction_at(at).0)).then_some((at, disc.share_of_map() * density))
            }
        }
    }

    /// Density of [`EnvironmentSampler::sample`] in unit `direction`.
    #[inline]
    pub(super) fn pdf(&self, environment: &Environment, normal: Vec3, direction: Vec3) -> f32 {
        let Some(map) = &self.map else {
            if normal == Vec3::ZERO {
                return UNIFORM_SPHERE_PDF;
            }
            return cosine_hemisphere_pdf(normal.dot(direction));
        };
        let d = environment.to_map * direction;
        let share = match &self.disc {
            Some(disc) if disc.contains(d) => return disc.pdf(),
            Some(disc) => disc.share_of_map(),
            None => 1.0,
        };
        share * solid_angle_pdf(map.pdf_at(square(d).to_array()), libm::sqrtf(d.x * d.x + d.z * d.z))
    }
}

/// Azimuth and polar angle in turns of a sample of a map whose cells have the edges `texel`.
#[inline]
fn position(cell: &Cell, texel: [f32; 2]) -> [f32; 2] {
    let [u, v] = cell.offset;
    [(cell.x as f32 + u) * texel[0], 0.5 * (cell.y as f32 + v) * texel[1]]
}

/// Direction of the map at an azimuth and a polar angle in turns, and the sine of the polar angle.
#[inline]
fn direction_at([azimuth, polar]: [f32; 2]) -> (Vec3, f32) {
    let ((sin_phi, cos_phi), (sin, cos)) = (sin_cos_turns(azimuth), sin_cos_turns(polar));
    (Vec3::new(sin * cos_phi, cos, sin * sin_phi), sin)
}

/// Density over the map's unit square, converted to solid angle: dω = 2π² sin θ du dv.
#[inline]
fn solid_angle_pdf(pdf: f32, sin: f32) -> f32 {
    if sin > 0.0 { pdf / (TAU * PI * sin) } else { 0.0 }
}
