//! Radiance that one lobe reflects to the camera, and its derivatives with the position on the surface.
//!
//! The strata are those of u in the unit square, which the sampling of visible normals maps to directions
//! w(u; x) for the viewer of the place x, with the weight g(u; x):
//!
//!   R(x) = ∫ L(x, w(u; x)) g(u; x) du.
//!
//! Reflectance is relative to that of the mirror direction, so that a texture of it does not show in R.
//! Strata move with the viewer by ∂w, and their content by the inverse distance u_e of the nearer side of a
//! border:
//!
//!   ∂_f R = ∫ L ∂_f g du + Σ dL ∫ K (u_e ν·f + ν·∂_f w) ds,
//!
//! K is the density of the lobe, ν points from the first stratum to the second, and dL is the second radiance
//! minus the first. Borders wrap around in the azimuth. The Hessian takes the lobe as rigid, so that the
//! scene is unfolded to the inverse distance u_e + 1/d, d the distance to the camera:
//!
//!   H = Σ dL (u_e + 1/d)² Sym ∫ ν ⊗ (3 K w - ∇K) ds.
//!
//! That is right up to a factor of about two, which is enough for radii.

use crate::Rgb;
use crate::bsdf::Bsdf;
use crate::bsdf::ggx::Ggx;
use crate::cache::hemisphere::second_differences;
use crate::cache::hessian::Hessian;
use crate::cache::irradiance::{Derivatives, GRADIENT_VARIANCE};
use crate::light::luminance;
use glam::{Vec2, Vec3};
use halflight_simd::kernels::cells::between;

/// Maximum number of strata along a side.
pub const SIDE_MAX: usize = 32;

/// Change of the viewer's direction for differences, and of a direction over alpha for ∇K.
const VIEWER_STEP: f32 = 1e-3;
const LOBE_STEP: f32 = 0.05;

/// Lobe of a surface, seen from the camera, in the local frame.
#[derive(Clone, Copy, Debug)]
pub struct ViewedLobe {
    bsdf: Bsdf,
    ggx: Ggx<f32>,
    alpha: f32,
    wo: Vec3,
    /// 1/d, d the distance to the camera.
    inverse_distance: f32,
}

/// Light of the strata of a lobe, stratum (i, j) at i N + j: i along the azimuth, j across the lobe.
#[derive(Clone, Copy, Debug)]
pub struct LobeSamples<'s> {
    /// Strata along a side, at most [`SIDE_MAX`].
    pub n: usize,
    /// Point of the unit square of each stratum.
    pub points: &'s [[f32; 2]],
    /// Radiance from its direction.
    pub radiance: &'s [[f32; 3]],
    /// 1/distance of its hit, 0 without a hit.
    pub inverse_distance: &'s [f32],
}

/// Radiance that a lobe reflects, over the reflectance of the mirror direction.
#[derive(Clone, Copy, Debug)]
pub struct ReflectedRadiance {
    /// Radiance in place of irradiance, and its derivatives.
    pub derivatives: Derivatives,
    /// Variance of its luminance by the noise of the samples.
    pub variance: f32,
    /// Variance of the gradient of its luminance, both axes together.
    pub gradient_variance: f32,
}

impl ReflectedRadiance {
    /// Derivatives with gradients scaled by the part of their square that is not noise.
    pub fn trusted(&self) -> Derivatives {
        let square = self.derivatives.luminance_gradient().length_squared();
        let share = if square > 0.0 { (1.0 - self.gradient_variance / square).max(0.0) } else { 0.0 };
        let gradient = self.derivatives.gradient.map(|gradient| share * gradient);
        Derivatives { gradient, ..self.derivatives }
    }

    /// Variance of the gradient over that of the radiance and a constant, 1/m²: see
    /// [`crate::cache::irradiance::Record::mean_square_inverse_distance`].
    pub fn gradient_spread(&self) -> f32 {
        let spread = self.gradient_variance / (GRADIENT_VARIANCE * self.variance);
        if spread.is_finite() { spread } else { 0.0 }
    }
}

/// Corner of strata: direction, its change with position along both axes, density and its gradient.
#[derive(Clone, Copy, Default)]
struct Corner {
    direction: Vec3,
    moved: [Vec3; 2],
    density: Rgb,
    slope: Vec3,
}

type Corners = [Corner; SIDE_MAX + 1];

/// Sums over the borders.
struct Sums<'s> {
    samples: LobeSamples<'s>,
    unfolded: f32,
    gradient: [Vec2; 3],
    hessian: Hessian,
    /// Gradient of the luminance with the radiance of each stratum.
    weights: [Vec2; SIDE_MAX * SIDE_MAX],
}

impl ViewedLobe {
    /// Lobe of `bsdf` for a viewer in the local direction `wo`, at `distance`. `None` without a rough
    /// reflection, or for a viewer on the horizon.
    pub fn new(bsdf: &Bsdf, wo: Vec3, distance: f32) -> Option<Self> {
        let alpha = bsdf.reflection_alpha()?;
        let is_seen = wo.z > 0.0 && distance > 0.0;
        let (bsdf, ggx, inverse_distance) = (*bsdf, Ggx::new(alpha), 1.0 / distance);
        is_seen.then_some(Self { bsdf, ggx, alpha, wo, inverse_distance })
    }

    /// GGX alpha.
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    /// Local direction to the camera.
    pub fn viewer(&self) -> Vec3 {
        self.wo
    }

    /// Reflectance of the mirror direction, the factor of all radiance here.
    pub fn reflectance(&self) -> Rgb {
        self.bsdf.facet_reflectance(self.wo.z)
    }

    /// Local direction of the point `u` of the unit square; it may point below the surface.
    pub fn direction(&self, u: [f32; 2]) -> Vec3 {
        self.reflected_at(self.wo, u)
    }

    /// [`ViewedLobe::direction`] for another viewer.
    fn reflected_at(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        self.ggx.sample_reflection(wo.into(), u).into()
    }

    /// Reflectance at the half-vector of `wo` and `wi` over that at the mirror direction.
    fn tint(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let half = wo + wi;
        let (there, here) =
            (self.bsdf.facet_reflectance(wo.dot(half) / half.length()), self.bsdf.facet_reflectance(wo.z));
        Rgb::select(here.cmpgt(Rgb::ZERO), there / here, Rgb::ONE)
    }

    /// g of the direction `wi`.
    fn weight(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let weight = || self.ggx.reflection_weight(wo.into(), wi.into());
        if wi.z > 0.0 { self.tint(wo, wi) * weight() } else { Rgb::ZERO }
    }

    /// g of the direction `wi` for the viewer.
    #[cfg(test)]
    pub(super) fn weight_of(&self, wi: Vec3) -> Rgb {
        self.weight(self.wo, wi)
    }

    /// K of the direction `wi`.
    fn density(&self, wi: Vec3) -> Rgb {
        let (density, visibility) =
            (self.ggx.density((self.wo + wi).into()), self.ggx.visibility(self.wo.into(), wi.into()));
        let lobe = || density * visibility * wi.z;
        if wi.z > 0.0 { self.tint(self.wo, wi) * lobe() } else { Rgb::ZERO }
    }

    /// Viewers of places a step ahead and a step back along both axes.
    fn moved_viewers(&self) -> [[Vec3; 2]; 2] {
        [Vec3::X, Vec3::Y]
            .map(|axis| [-VIEWER_STEP, VIEWER_STEP].map(|step| (self.wo + step * axis).normalize()))
    }

    fn corner(&self, viewers: &[[Vec3; 2]; 2], u: [f32; 2]) -> Corner {
        let direction = self.direction(u);
        let per_step = 0.5 * self.inverse_distance / VIEWER_STEP;
        let moved = viewers
            .map(|[ahead, back]| (self.reflected_at(ahead, u) - self.reflected_at(back, u)) * per_step);
        let step = LOBE_STEP * self.alpha;
        let across = direction.any_orthonormal_pair();
        let slope = |along: Vec3| {
            let [ahead, back] =
                [step, -step].map(|step| luminance(self.density((direction + step * along).normalize())));
            along * ((ahead - back) / (2.0 * step))
        };
        Corner {
            direction,
            moved,
            density: self.density(direction),
            slope: slope(across.0) + slope(across.1),
        }
    }

    /// Corners of all strata at the azimuth of number `i`.
    fn corners(&self, viewers: &[[Vec3; 2]; 2], n: usize, i: usize, out: &mut Corners) {
        let turn = (i % n) as f32 / n as f32;
        for (j, corner) in out.iter_mut().enumerate().take(n + 1) {
            *corner = self.corner(viewers, [turn, j as f32 / n as f32]);
        }
    }

    /// Reflected radiance of the light in `samples`. `None` if slices have other lengths.
    pub fn reflected(&self, samples: LobeSamples) -> Option<ReflectedRadiance> {
        let LobeSamples { n, points, radiance, inverse_distance } = samples;
        let strata = n * n;
        if !(1..=SIDE_MAX).contains(&n)
            || [points.len(), radiance.len(), inverse_distance.len()] != [strata; 3]
        {
            return None;
        }
        let viewers = self.moved_viewers();
        let mut sums = Sums::new(samples, self.inverse_distance);
        let mut reflected = Rgb::ZERO;
        let share = 1.0 / strata as f32;
        for (stratum, (&u, &light)) in points.iter().zip(radiance).enumerate() {
            let light = Rgb::from(light);
            reflected += light * self.weight(self.wo, self.direction(u)) * share;
            let change = viewers.map(|[ahead, back]| {
                let [ahead, back] = [ahead, back].map(|wo| self.weight(wo, self.reflected_at(wo, u)));
                (ahead - back) * (0.5 * share * self.inverse_distance / VIEWER_STEP)
            });
            sums.add_weight(stratum, light, change);
        }
        let (mut here, mut next) = ([Corner::default(); SIDE_MAX + 1], [Corner::default(); SIDE_MAX + 1]);
        self.corners(&viewers, n, 0, &mut here);
        for i in 0..n {
            self.corners(&viewers, n, i + 1, &mut next);
            sums.add_row(i, &here, &next);
            here = next;
        }
        Some(sums.finish(reflected))
    }
}

impl<'s> Sums<'s> {
    fn new(samples: LobeSamples<'s>, unfolded: f32) -> Self {
        let (gradient, hessian) = ([Vec2::ZERO; 3], Hessian::default());
        Self { samples, unfolded, gradient, hessian, weights: [Vec2::ZERO; SIDE_MAX * SIDE_MAX] }
    }

    /// Adds the `change` of the weight of a stratum along both axes.
    fn add_weight(&mut self, stratum: usize, light: Rgb, change: [Rgb; 2]) {
        let along = |channel: usize| Vec2::new(change[0][channel], change[1][channel]);
        for (channel, gradient) in self.gradient.iter_mut().enumerate() {
            *gradient += light[channel] * along(channel);
        }
        if let Some(weight) = self.weights.get_mut(stratum) {
            *weight += Vec2::from(change.map(luminance));
        }
    }

    /// Adds the borders of the strata between the azimuths of `here` and `next`, number `i`: those to the
    /// strata of the azimuth before, and those within.
    fn add_row(&mut self, i: usize, here: &Corners, next: &Corners) {
        let n = self.samples.n;
        let before = (i + n - 1) % n;
        for j in 0..n {
            let middle =
                next[j].direction + next[j + 1].direction - here[j].direction - here[j + 1].direction;
            self.add_border([before * n + j, i * n + j], [&here[j], &here[j + 1]], middle);
            if j > 0 {
                let outwards = here[j + 1].direction + next[j + 1].direction
                    - here[j - 1].direction
                    - next[j - 1].direction;
                self.add_border([i * n + j - 1, i * n + j], [&here[j], &next[j]], outwards);
            }
        }
    }

    /// Adds the border between two strata with these ends; `towards` points from the first to the second.
    fn add_border(&mut self, strata: [usize; 2], [from, to]: [&Corner; 2], towards: Vec3) {
        let light = strata.map(|at| Rgb::from(self.samples.radiance.get(at).copied().unwrap_or_default()));
        let [u, v] = strata.map(|at| self.samples.inverse_distance.get(at).copied().unwrap_or_default());
        let near = between(|x| x, u, v);
        let jump = light[1] - light[0];
        let direction = 0.5 * (from.direction + to.direction);
        let normal = direction.cross(to.direction - from.direction);
        let normal = if normal.dot(towards) < 0.0 { -normal } else { normal };
        let density = 0.5 * (from.density + to.density);
        let along = |axis: usize| near * normal[axis] + 0.5 * normal.dot(from.moved[axis] + to.moved[axis]);
        let flow = Vec2::new(along(0), along(1));
        for (channel, gradient) in self.gradient.iter_mut().enumerate() {
            *gradient += jump[channel] * density[channel] * flow;
        }
        let weight = luminance(density) * flow;
        for (at, sign) in strata.into_iter().zip([-1.0, 1.0]) {
            if let Some(sum) = self.weights.get_mut(at) {
                *sum += sign * weight;
            }
        }
        let far = near + self.unfolded;
        let bent = 3.0 * luminance(density) * direction - 0.5 * (from.slope + to.slope);
        let factor = luminance(jump) * far * far;
        self.hessian = self.hessian
            + Hessian {
                xx: normal.x * bent.x,
                xy: 0.5 * (normal.x * bent.y + normal.y * bent.x),
                yy: normal.y * bent.y,
            } * factor;
    }

    fn finish(self, reflected: Rgb) -> ReflectedRadiance {
        let Self { samples, unfolded, gradient, hessian, weights } = self;
        let strata = (samples.n * samples.n) as f32;
        let (mut squares, mut sum, mut largest) = (0.0, 0.0, 0.0f32);
        for &inverse in samples.inverse_distance {
            squares += (inverse + unfolded) * (inverse + unfolded);
            sum += inverse;
            largest = largest.max(inverse);
        }
        // The variance of one stratum; a linear change between strata is no noise.
        let [differences, count] = second_differences(samples.radiance, samples.n);
        let noise = differences / (6.0 * count);
        let gradient_variance = noise * weights.iter().map(|weight| weight.length_squared()).sum::<f32>();
        let derivatives = Derivatives {
            irradiance: reflected,
            gradient,
            rotation: [Vec2::ZERO; 3],
            hessian,
            open_hessian: Hessian::default(),
            mean_square_inverse_distance: squares / strata,
            harmonic_mean_distance: strata / sum,
            min_distance: 1.0 / largest,
        };
        ReflectedRadiance { derivatives, variance: noise / strata, gradient_variance }
    }
}
