//! Light sampler: chooses one of all lights of a scene, samples it, and evaluates the density of both.
//!
//! There are three kinds: lights at finite places (emissive triangles, points, spots), chosen by a light
//! tree; the environment; directional lights. The kind is chosen by estimates of its irradiance, with a
//! minimum for each kind, since occlusion is unknown.

use super::area::Emitter;
use super::border::Edges;
use super::emitted::emitted_at;
use super::environment::EnvironmentSampler;
use super::environment_visibility::{EnvironmentVisibility, VisibilityTable, WarpedSample};
use super::tree::Tree;
use crate::sampling::AliasTable;
use crate::scene::{Mesh, PointLight, Scene};
use crate::{Level, Rgb};
use glam::Vec3;

/// Least probability of each kind of light that exists.
const MIN_PROBABILITY: f32 = 0.1;

/// Sample of a light: a direction from which light may come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Distance to the light; infinite for the environment and directional lights.
    pub distance: f32,
    /// Point on an area light, for the end of the shadow ray.
    pub target: Option<LightPoint>,
    /// Unoccluded radiance; for a delta light the irradiance of a surface that faces it.
    pub radiance: Rgb,
    /// Density in solid angle, including the choice of the light; for a delta light the probability of the
    /// choice.
    pub pdf: f32,
    /// True for a light without surface, which no ray can hit.
    pub delta: bool,
    /// Index of the light in the order of emission: emitters, points and spots, directional lights, the
    /// environment.
    pub(crate) light: u32,
}

impl LightSample {
    #[inline]
    pub(super) fn far(direction: Vec3, radiance: Rgb, pdf: f32, light: u32) -> Self {
        Self { direction, distance: f32::INFINITY, target: None, radiance, pdf, delta: false, light }
    }
}

/// Point on an area light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPoint {
    /// Position.
    pub position: Vec3,
    /// Unit normal of the side from which the point is seen.
    pub normal: Vec3,
    /// Bound of the rounding error in each coordinate of `position`.
    pub error: f32,
}

/// Lights of a scene, ready for sampling.
#[derive(Clone, Copy, Debug)]
pub struct LightSampler<'m> {
    /// Emissive triangles and parallelograms in the order of the mesh. They are the first lights of the tree;
    /// points and spots follow.
    pub(super) emitters: &'m [Emitter],
    /// Indices of points and spots in the scene's lights.
    pub(super) points: &'m [u32],
    pub(super) tree: Tree<'m>,
    pub(super) environment: Option<EnvironmentSampler<'m>>,
    /// Visible part of the environment at each place, if learned.
    pub(super) visibility: Option<EnvironmentVisibility<'m>>,
    /// Indices of directional lights in the scene's lights.
    pub(super) distant: &'m [u32],
    pub(super) distant_table: AliasTable<'m>,
    /// Irradiance of the environment and of directional lights, in the unit of the tree's powers.
    pub(super) environment_weight: f32,
    pub(super) distant_weight: f32,
    /// True if delta lights are left out ([`LightSampler::without_delta_lights`]).
    pub(super) leaves_out_delta: bool,
}

/// Probability of each kind of light.
pub(super) struct KindProbabilities {
    pub(super) tree: f32,
    pub(super) environment: f32,
    pub(super) distant: f32,
}

impl<'m> LightSampler<'m> {
    /// Sampler of the same lights that chooses with the instructions of `level`.
    pub fn with_level(&self, level: Level) -> Self {
        Self { tree: self.tree.with_level(level), ..*self }
    }

    /// Sampler of the same lights that samples the environment by its `visibility`.
    pub fn with_visibility(&self, visibility: Option<EnvironmentVisibility<'m>>) -> Self {
        Self { visibility, ..*self }
    }

    /// True if the environment has constant radiance; `None` without an environment that shines.
    pub fn environment_is_constant(&self) -> Option<bool> {
        self.environment.as_ref().map(EnvironmentSampler::is_constant)
    }

    /// Unit direction towards the environment, sampled at `u` by its radiance alone, without any surface.
    pub fn sample_environment(&self, scene: &Scene, u: [f32; 2]) -> Option<Vec3> {
        let sample = self.environment?.sample(scene.environment.as_ref()?, Vec3::ZERO, u)?;
        Some(sample.0)
    }

    /// True if the environment is sampled by its visibility.
    #[inline]
    pub fn has_visibility(&self) -> bool {
        self.visibility.is_some()
    }

    /// Visibility of the environment from a surface, if known.
    #[inline]
    pub(crate) fn visibility(&self, position: Vec3, normal: Vec3) -> Option<&'m VisibilityTable> {
        self.visibility.as_ref()?.at(position, normal)
    }

    /// Sample of the visibility table of a surface at `u`.
    #[inline]
    pub(crate) fn warp(&self, position: Vec3, normal: Vec3, [u, v, _]: [f32; 3]) -> Option<WarpedSample> {
        Some(self.visibility(position, normal)?.warp([u, v]))
    }

    /// True without lights.
    #[inline]
    pub fn is_empty(&self) -> bool {
        let has_delta = self.has_delta_lights() && !self.leaves_out_delta;
        self.emitters.is_empty() && self.environment.is_none() && !has_delta
    }

    /// Samples a direction from which light may reach `position`. On a surface only the side of `normal`
    /// counts, unless it is zero. `u[2]` chooses the light. `None` is a sample without light.
    #[inline]
    pub fn sample(&self, scene: &Scene, position: Vec3, normal: Vec3, u: [f32; 3]) -> Option<LightSample> {
        let (sample, later) =
            self.sample_deferred(scene, position, normal, u, self.warp(position, normal, u))?;
        let environment = scene.environment.as_ref().filter(|_| later);
        let radiance = environment.map_or(Rgb::ONE, |e| e.radiance(scene, sample.direction));
        Some(LightSample { radiance: sample.radiance * radiance, ..sample })
    }

    /// [`LightSampler::sample`] with `warped` from [`LightSampler::warp`]. If the flag is set, the radiance
    /// is still to be multiplied by that of the environment. Its lookup waits until the shadow ray is known
    /// to be unoccluded.
    #[inline]
    pub fn sample_deferred(
        &self,
        scene: &Scene,
        position: Vec3,
        normal: Vec3,
        u: [f32; 3],
        warped: Option<WarpedSample>,
    ) -> Option<(LightSample, bool)> {
        let [u0, u1, choice] = u;
        let chosen = self.choose(position, normal, choice)?;
        self.sample_chosen(scene, position, normal, [u0, u1], chosen, warped)
    }

    /// Density of [`LightSampler::sample`] at a point of emissive `triangle`, in unit `direction` at
    /// `hit_distance` from `position`. Zero if the triangle does not emit this way.
    #[inline]
    pub fn pdf_hit(
        &self,
        _scene: &Scene,
        position: Vec3,
        normal: Vec3,
        triangle: u32,
        hit_distance: f32,
        direction: Vec3,
    ) -> f32 {
        let Some((index, emitter)) = self.emitter_of(triangle) else { return 0.0 };
        let pdf = emitter.pdf(position, direction, hit_distance);
        if pdf <= 0.0 || !faces(normal, direction) {
            return 0.0;
        }
        let share = self.kind_probabilities(position, normal).tree;
        pdf * share * self.tree.pdf(position, normal, index as u32)
    }

    /// Index and emitter of `triangle`.
    #[inline]
    pub(super) fn emitter_of(&self, triangle: u32) -> Option<(usize, &Emitter)> {
        let index = self.emitters.partition_point(|e| e.triangle <= triangle).checked_sub(1)?;
        let emitter = self.emitters.get(index)?;
        (triangle - emitter.triangle <= u32::from(emitter.is_pair())).then_some((index, emitter))
    }

    /// Calls `draw` with the border edges of emitters that emit towards `eye`. `meets` rejects groups by the
    /// centre and the radius of their bounding sphere. Draws nothing if more than `most` triangles and
    /// parallelograms are left.
    pub(crate) fn borders(
        &self,
        mesh: &Mesh,
        eye: Vec3,
        most: usize,
        meets: impl Fn(Vec3, f32) -> bool,
        mut draw: impl FnMut([Vec3; 2]),
    ) {
        let visit = |each: &mut dyn FnMut(&Emitter, bool)| {
            self.tree.visit(&meets, |light| {
                let emitter = self.emitters.get(light as usize);
                if let Some((emitter, front)) = emitter.and_then(|e| Some((e, e.faces(eye)?))) {
                    each(emitter, front);
                }
            });
        };
        let mut count = 0;
        visit(&mut |_, _| count += 1);
        if count == 0 || count > most {
            return;
        }
        let side = |emitter: &Emitter, front| {
            let material = mesh.triangles.get(emitter.triangle as usize).map_or(0, |t| t.material);
            u64::from(material) << 1 | u64::from(front)
        };
        let mut edges = Edges::new();
        visit(&mut |emitter, front| {
            emitter.border(mesh).for_each(|edge| edges.add(edge, side(emitter, front)));
        });
        visit(&mut |emitter, front| {
            let borders = emitter.border(mesh).filter(|edge| edges.is_border(*edge, side(emitter, front)));
            borders.for_each(&mut draw);
        });
    }

    /// Triangle of emitter `light`.
    pub(crate) fn triangle_of(&self, light: u32) -> Option<u32> {
        self.emitters.get(light as usize).map(|emitter| emitter.triangle)
    }

    /// Triangles of emitter `light`; none for other kinds.
    #[inline]
    pub(crate) fn triangles_of(&self, light: u32) -> core::ops::Range<u32> {
        self.emitters
            .get(light as usize)
            .map_or(0..0, |emitter| emitter.triangle..emitter.triangle + 1 + u32::from(emitter.is_pair()))
    }

    /// Delta light number `light` in the order of emission; `None` for other kinds.
    #[inline]
    pub(super) fn without_surface<'s>(&self, scene: &Scene<'s>, light: usize) -> Option<&'s PointLight> {
        let mut all = self.points.iter().chain(self.distant);
        let index = light.checked_sub(self.emitters.len()).and_then(|own| all.nth(own))?;
        scene.lights.get(*index as usize)
    }

    /// Probability that [`LightSampler::sample`] chooses the delta light `light`, in the order of emission.
    pub(crate) fn probability(&self, light: u32, position: Vec3, normal: Vec3) -> f32 {
        let index = light as usize;
        let shares = self.kind_probabilities(position, normal);
        match index.checked_sub(self.in_tree()) {
            None => shares.tree * self.tree.pdf(position, normal, light),
            Some(distant) => shares.distant * self.distant_table.pdf(distant),
        }
    }

    /// Density of [`LightSampler::sample`] for the environment in unit `direction`.
    #[inline]
    pub fn pdf_escape(&self, scene: &Scene, position: Vec3, normal: Vec3, direction: Vec3) -> f32 {
        match (&self.environment, &scene.environment) {
            (Some(sampler), Some(environment)) => {
                let pdf = match self.visibility(position, normal) {
                    Some(table) => sampler.pdf_through(environment, table, direction),
                    None => sampler.pdf(environment, normal, direction),
                };
                self.kind_probabilities(position, normal).environment * pdf
            }
            _ => 0.0,
        }
    }

    /// True with more than one light; otherwise `u[2]` of [`LightSampler::sample`] is unused.
    #[inline]
    pub fn has_many_lights(&self) -> bool {
        self.count() > 1
    }

    /// Number of lights of all kinds, in the order of emission.
    #[inline]
    pub fn count(&self) -> usize {
        self.finite_count() + self.distant.len() + usize::from(self.environment.is_some())
    }

    /// Number of lights at finite places.
    #[inline]
    pub(super) fn finite_count(&self) -> usize {
        self.in_tree()
    }

    #[inline]
    pub(super) fn in_tree(&self) -> usize {
        self.emitters.len() + self.points.len()
    }

    /// Probabilities of the kinds at a point. With a single kind nothing is computed.
    #[inline]
    pub(super) fn kind_probabilities(&self, position: Vec3, normal: Vec3) -> KindProbabilities {
        let (sky, sun) = (self.environment_weight, self.distant_weight);
        if sky + sun == 0.0 {
            return KindProbabilities { tree: 1.0, environment: 0.0, distant: 0.0 };
        }
        let near = if self.in_tree() == 0 { 0.0 } else { self.tree.importance(position, normal) };
        let kinds = [near, sky, sun].map(|weight| if weight > 0.0 { 1.0 } else { 0.0 });
        let count = kinds[0] + kinds[1] + kinds[2];
        // Divided before the sum, because three large floats may overflow.
        let largest = near.max(sky).max(sun);
        let relative = [near, sky, sun].map(|weight| weight / largest);
        let by_weight = (1.0 - MIN_PROBABILITY * count) / (relative[0] + relative[1] + relative[2]);
        let share = |i: usize| {
            if count == 1.0 { kinds[i] } else { kinds[i] * MIN_PROBABILITY + by_weight * relative[i] }
        };
        KindProbabilities { tree: share(0), environment: share(1), distant: share(2) }
    }
}

#[inline]
pub(super) fn sample_emitter(
    scene: &Scene,
    emitter: &Emitter,
    from: Vec3,
    normal: Vec3,
    u: [f32; 2],
    probability: f32,
) -> Option<LightSample> {
    let (place, density) = emitter.sample(from, u)?;
    let to_light = place.position - from;
    let distance = to_light.length();
    let direction = to_light / distance;
    if !(distance > 0.0 && faces(normal, direction)) {
        return None;
    }
    let plane = Vec3::from(emitter.normal);
    let front = plane.dot(direction) < 0.0;
    let pdf = probability * density.unwrap_or_else(|| emitter.area_pdf(direction, distance));
    let radiance = emitted_at(scene, emitter, &place, front);
    if !(pdf > 0.0 && pdf < f32::INFINITY && radiance.max_element() > 0.0) {
        return None;
    }
    let target = LightPoint {
        position: place.position,
        normal: if front { plane } else { -plane },
        error: emitter.error(place.position, from),
    };
    Some(LightSample { distance, target: Some(target), ..LightSample::far(direction, radiance, pdf, 0) })
}

/// True if light from `direction` reaches the front of a surface with `normal`, or if `normal` is zero.
#[inline]
fn faces(normal: Vec3, direction: Vec3) -> bool {
    normal == Vec3::ZERO || normal.dot(direction) > 0.0
}
