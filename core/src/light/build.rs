//! Build of the light sampler: collects the lights of a scene and builds the light tree by their power.

use super::area::Emitter;
use super::emitted::{mean_luminance, strength};
use super::environment::EnvironmentSampler;
use super::sampler::LightSampler;
use super::tree::{Item, Tree};
use crate::geometry::{Bounds, Cone};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::AliasTable;
use crate::scene::{PointLight, Scene};

/// Least weight of a light relative to the strongest: no light that emits is ever left out.
const MIN_POWER: f64 = 1e-30;

/// Numbers of lights in [`LightSampler::build`].
#[derive(Clone, Copy, Default)]
struct Counts {
    emitters: usize,
    points: usize,
    distant: usize,
}

impl Counts {
    fn of(scene: &Scene) -> Self {
        let shines = |light: &&PointLight| strength(light) > 0.0;
        let all = scene.lights.iter().filter(shines);
        let distant = all.clone().filter(|l| matches!(l, PointLight::Directional { .. })).count();
        Self { emitters: emitters(scene).count(), points: all.count() - distant, distant }
    }

    fn in_tree(&self) -> usize {
        self.emitters + self.points
    }
}

impl<'m> LightSampler<'m> {
    /// Number of lights of all kinds of `scene`, before its sampler is built.
    pub fn count_in(scene: &Scene) -> usize {
        let counts = Counts::of(scene);
        counts.in_tree() + counts.distant + usize::from(scene.environment.is_some())
    }

    /// Bytes that [`LightSampler::build`] takes and keeps.
    pub fn footprint(scene: &Scene) -> Footprint {
        let counts = Counts::of(scene);
        Footprint::default()
            .slice::<Emitter>(counts.emitters)
            .slice::<u32>(counts.points)
            .slice::<u32>(counts.distant)
            .and(Tree::footprint(counts.in_tree()))
            .and(AliasTable::footprint(counts.distant))
            .and(EnvironmentSampler::footprint(scene))
    }

    /// Bytes beyond the footprint that must be free in the arena during [`LightSampler::build`].
    pub fn scratch(scene: &Scene) -> Footprint {
        Footprint::default().slice::<Item>(Counts::of(scene).in_tree())
    }

    /// Collects and orders the lights of `scene`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`LightSampler::footprint`] and [`LightSampler::scratch`].
    pub fn build(scene: &Scene, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let counts = Counts::of(scene);
        let kept: &mut [Emitter] = arena.slice(counts.emitters)?;
        for (slot, emitter) in kept.iter_mut().zip(emitters(scene)) {
            *slot = emitter;
        }
        let points: &mut [u32] = arena.slice(counts.points)?;
        let distant: &mut [u32] = arena.slice(counts.distant)?;
        fill(points, scene, |light| !matches!(light, PointLight::Directional { .. }));
        fill(distant, scene, |light| matches!(light, PointLight::Directional { .. }));
        let (nodes, trails) = Tree::memory(counts.in_tree(), arena)?;
        let distant_strength = |i: usize| distant.get(i).map_or(0.0, |&light| strength_of(scene, light));
        let distant_table = AliasTable::build(distant.len(), |i| distant_strength(i) as f32, arena)?;
        let environment = EnvironmentSampler::build(scene, arena)?;

        let mut scratch = arena.scratch();
        let items: &mut [Item] = scratch.slice(counts.in_tree())?;
        let sides = |e: &Emitter| if e.is_two_sided() { 2.0 } else { 1.0 };
        let area_powers = kept.iter().map(|e| mean_luminance(scene, e) * f64::from(e.area) * sides(e));
        // A light that emits in all directions counts as a ball, which shows a quarter of its area.
        let all_around = |light| if bounds_of(scene, light).1.is_all() { 4.0 } else { 1.0 };
        let point_powers = points.iter().map(|&light| strength_of(scene, light) * all_around(light));
        let unit = area_powers.clone().chain(point_powers.clone()).fold(0.0, f64::max);
        let unit = if unit > 0.0 { unit } else { 1.0 };
        let relative = |power: f64| (power / unit).max(MIN_POWER) as f32;
        let emitters = kept.iter().map(|e| (Bounds::around(e.corners()), e.cone()));
        let without_surface = points.iter().map(|&light| bounds_of(scene, light));
        for (i, ((slot, (bounds, cone)), power)) in items
            .iter_mut()
            .zip(emitters.chain(without_surface))
            .zip(area_powers.chain(point_powers))
            .enumerate()
        {
            *slot = Item::new(&bounds, cone, relative(power), i as u32);
        }
        let tree = Tree::build(items, nodes, trails);

        let sky = environment.map_or(0.0, |e| f64::from(e.mean) * core::f64::consts::PI);
        let sun = (0..distant.len()).map(distant_strength).sum::<f64>();
        let finite = |weight: f64| relative(weight).min(f32::MAX);
        Ok(Self {
            emitters: kept,
            points,
            tree,
            environment,
            visibility: None,
            distant,
            distant_table,
            environment_weight: if environment.is_some() { finite(sky) } else { 0.0 },
            distant_weight: if distant.is_empty() { 0.0 } else { finite(sun) },
            leaves_out_delta: false,
        })
    }
}

/// Emissive triangles of `scene`; two that make a parallelogram count as one.
fn emitters(scene: &Scene) -> impl Iterator<Item = Emitter> {
    let mut next = 0u32;
    core::iter::from_fn(move || {
        while let Some(triangle) = scene.mesh.triangles.get(next as usize) {
            let index = next;
            next += 1;
            let Some(material) = scene.materials.get(triangle.material as usize).filter(|m| m.emits()) else {
                continue;
            };
            let same =
                scene.mesh.triangles.get(next as usize).is_some_and(|t| t.material == triangle.material);
            let textured = material.emission.varies() || material.has_cutout();
            if let Some(emitter) = Emitter::new(&scene.mesh, index, same, material.two_sided, textured) {
                next += u32::from(emitter.is_pair());
                return Some(emitter);
            }
        }
        None
    })
}

fn fill(indices: &mut [u32], scene: &Scene, which: impl Fn(&PointLight) -> bool) {
    let chosen = scene.lights.iter().enumerate().filter(|(_, light)| strength(light) > 0.0 && which(light));
    for (slot, (index, _)) in indices.iter_mut().zip(chosen) {
        *slot = index as u32;
    }
}

fn strength_of(scene: &Scene, light: u32) -> f64 {
    scene.lights.get(light as usize).map_or(0.0, strength)
}

fn bounds_of(scene: &Scene, light: u32) -> (Bounds, Cone) {
    match scene.lights.get(light as usize) {
        Some(PointLight::Point { position, .. }) => (Bounds::around([*position]), Cone::ALL),
        Some(PointLight::Spot { position, direction, cos_outer, .. }) => (
            Bounds::around([*position]),
            Cone { axis: direction.to_array(), cos: cos_outer.clamp(-1.0, 1.0) },
        ),
        _ => (Bounds::EMPTY, Cone::ALL),
    }
}
