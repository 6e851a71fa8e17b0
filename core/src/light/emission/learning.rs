//! Learning of the emission guide. The unit square of random numbers that determine the direction of a photon
//! is divided into cells for each light. Cells are chosen by the benefit of earlier photons from them (guided
//! emission in primary sample space, as in Grittmann et al. 2018). Every cell keeps some probability, so that
//! every light that shines emits photons.
//!
//! Photons of caustics prefer cells that lead to casters from the start. Photons of all light have no target:
//! their cells are fewer, and the benefit is only learned.

use super::EmissionSampler;
use super::guide::EmissionGuide;
use crate::light::sampler::LightSampler;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::{AliasTable, Sampler};
use crate::scene::{Material, Scene};
use glam::Vec3;

/// Largest number of cells along a side of a light's square, and of all cells together with many lights.
const MAX_SIDE: usize = 64;
const MAX_CELLS: usize = 1 << 16;

/// Shares of emission: by power over all cells, and towards casters. The rest follows the learned benefit.
const DEFENSIVE: f32 = 0.1;
const AIMED: f32 = 0.2;

/// Shares of emission for photons of all light: by power, so that no photon has more than four times the mean
/// power; and evenly over the cells of each light by its total benefit.
const DEFENSIVE_OF_ALL: f32 = 0.25;
const UNIFORM_OF_ALL: f32 = 0.25;

/// Largest number of cells for photons of all light: few, so that each is learned from many photons.
const CELLS_OF_ALL: usize = 1 << 10;

/// Weight of the benefit of each neighbouring cell.
const NEIGHBOUR_WEIGHT: f32 = 0.125;

/// Target points on casters: over all lights together, at most for each light, and at least for each of its
/// cells. With thousands of lights each has only a few cells.
const TARGETS: usize = 1 << 17;
const MAX_TARGETS: usize = 1 << 14;
const MIN_TARGETS: usize = 2;

/// Cells around the cell of a target point that count as aimed at.
const TARGET_MARGIN: isize = 1;

/// Benefit of the cells of all lights, while it is being learned.
pub struct GuideStats<'m> {
    /// 1 for cells that lead to casters; with [`GuideStats::average_per_light`] the total benefit of the
    /// light over its power.
    aimed: &'m mut [f32],
    /// Sum of the benefit of photons.
    learned: &'m mut [f32],
    side: usize,
    /// Shares of emission: by power, and by `aimed`.
    shares: [f32; 2],
}

impl<'m> GuideStats<'m> {
    /// Number of cells of [`GuideStats::of_all`].
    fn cells_of_all(lights: usize) -> usize {
        let side = side(lights, CELLS_OF_ALL);
        lights * side * side
    }

    /// Bytes of [`GuideStats::of_all`] together with [`GuideStats::guide`].
    pub fn footprint_of_all(lights: usize) -> Footprint {
        let cells = Self::cells_of_all(lights);
        let stats = Footprint::default().slice::<f32>(cells).slice::<f32>(cells);
        stats.and(AliasTable::footprint(cells))
    }

    /// Statistics for photons of all light. The guide follows power until something is learned.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`GuideStats::footprint_of_all`].
    pub fn of_all(lights: &LightSampler, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let cells = Self::cells_of_all(lights.count());
        let (aimed, learned) = (arena.slice::<f32>(cells)?, arena.slice::<f32>(cells)?);
        aimed.fill(0.0);
        learned.fill(0.0);
        let side = side(lights.count(), CELLS_OF_ALL);
        Ok(Self { aimed, learned, side, shares: [DEFENSIVE_OF_ALL, UNIFORM_OF_ALL] })
    }

    /// Sends a share of the photons of all light evenly over the cells of each light, by the light's total
    /// benefit. The benefit of a single cell rests on few photons.
    pub fn average_per_light(&mut self, emission: &EmissionSampler) {
        let of_light = (self.side * self.side).max(1);
        let lights = self.aimed.chunks_mut(of_light).zip(self.learned.chunks(of_light));
        for (light, (aimed, learned)) in lights.enumerate() {
            // [`GuideStats::guide`] multiplies by power again.
            let benefit = learned.iter().sum::<f32>() / emission.table.pdf(light);
            aimed.fill(if benefit.is_finite() { benefit } else { 0.0 });
        }
    }

    /// Bytes of [`GuideStats::aimed`].
    pub fn footprint(lights: usize) -> Footprint {
        let cells = cells(lights);
        Footprint::default().slice::<f32>(cells).slice::<f32>(cells)
    }

    /// Statistics that aim at all casters. `None` without casters or lights.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`GuideStats::footprint`].
    pub fn aimed(
        scene: &Scene,
        lights: &LightSampler,
        emission: &EmissionSampler,
        arena: &mut Arena<'m>,
    ) -> Result<Option<Self>, OutOfMemory> {
        let side = side(lights.count(), MAX_CELLS);
        let cells = cells(lights.count());
        let (aimed, learned) = (arena.slice::<f32>(cells)?, arena.slice::<f32>(cells)?);
        aimed.fill(0.0);
        learned.fill(0.0);
        let light_count = lights.count().max(1);
        let points = (TARGETS / light_count).clamp(MIN_TARGETS * side * side, MAX_TARGETS);
        let mut any = false;
        for_each_caster_point(scene, points, |number, point| {
            for light in 0..lights.count() {
                let sampler = Sampler::new(0x6775_6964, light as u32, number);
                let Some([u, v]) = emission.aim(scene, lights, light, point, &sampler) else { continue };
                any = true;
                let middle = [u, v].map(|u| (u * side as f32) as isize);
                for y in middle[1] - TARGET_MARGIN..=middle[1] + TARGET_MARGIN {
                    for x in middle[0] - TARGET_MARGIN..=middle[0] + TARGET_MARGIN {
                        let inside = (0..side as isize).contains(&x) && (0..side as isize).contains(&y);
                        let index = light * side * side + (y * side as isize + x).unsigned_abs();
                        if let Some(cell) = aimed.get_mut(index).filter(|_| inside) {
                            *cell = 1.0;
                        }
                    }
                }
            }
        });
        Ok(any.then_some(Self { aimed, learned, side, shares: [DEFENSIVE, AIMED] }))
    }

    /// Statistics for photons that alone carry their light, without other paths: the share by power is that
    /// of photons of all light, so that no photon has more than four times the mean power.
    pub fn with_bounded_power(self) -> Self {
        Self { shares: [DEFENSIVE_OF_ALL, AIMED], ..self }
    }

    /// Adds the `benefit` of a photon from `cell`.
    pub fn learn(&mut self, cell: u32, benefit: f32) {
        if let Some(slot) = self.learned.get_mut(cell as usize).filter(|_| benefit.is_finite()) {
            *slot += benefit;
        }
    }

    /// `emission` with a guide by the benefit so far. `arena` needs [`GuideStats::guide_footprint`].
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less.
    pub fn guide<'g>(
        &self,
        emission: &EmissionSampler<'g>,
        arena: &mut Arena<'g>,
    ) -> Result<EmissionSampler<'g>, OutOfMemory> {
        let side = self.side;
        let of_light = side * side;
        let power = |i: usize| emission.table.pdf(i / of_light) / of_light as f32;
        let sum = |of: &dyn Fn(usize) -> f32| {
            let total = (0..self.aimed.len()).map(|i| f64::from(of(i))).sum::<f64>();
            if total > 0.0 { (1.0 / total) as f32 } else { 0.0 }
        };
        let aimed = |i: usize| self.aimed.get(i).map_or(0.0, |aimed| aimed * power(i));
        let learned = |i: usize| self.smoothed(i);
        let (per_aimed, per_learned) = (sum(&aimed), sum(&learned));
        let [nowhere, aimed_at] = self.shares;
        let seen = if per_learned > 0.0 { 1.0 - nowhere - aimed_at } else { 0.0 };
        let at = 1.0 - nowhere - seen;
        let weight = |i| nowhere * power(i) + at * (per_aimed * aimed(i)) + seen * per_learned * learned(i);
        let table = AliasTable::build(self.aimed.len(), weight, arena)?;
        Ok(EmissionSampler { guide: Some(EmissionGuide::new(table, side)), ..*emission })
    }

    /// `emission` that chooses half of the paths by power and half evenly among the cells of all lights,
    /// before anything was learned. `arena` needs [`GuideStats::guide_footprint`].
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less.
    pub fn evenly<'g>(
        &self,
        emission: &EmissionSampler<'g>,
        arena: &mut Arena<'g>,
    ) -> Result<EmissionSampler<'g>, OutOfMemory> {
        let (cells, of_light) = (self.learned.len(), self.side * self.side);
        let weight = |i: usize| emission.table.pdf(i / of_light) / of_light as f32 + 1.0 / cells as f32;
        let table = AliasTable::build(cells, weight, arena)?;
        Ok(EmissionSampler { guide: Some(EmissionGuide::new(table, self.side)), ..*emission })
    }

    /// Benefit of cell `i` and part of that of its neighbours: few photons show only part of what is useful.
    fn smoothed(&self, i: usize) -> f32 {
        let side = self.side;
        let of_light = side * side;
        let (first, own) = (i / of_light * of_light, i % of_light);
        let learned = |i: usize| self.learned.get(i).copied().unwrap_or(0.0);
        let (x, y) = (own % side, own / side);
        let mut sum = 0.0;
        for v in y.saturating_sub(1)..(y + 2).min(side) {
            for u in x.saturating_sub(1)..(x + 2).min(side) {
                let own = if (u, v) == (x, y) { 1.0 } else { NEIGHBOUR_WEIGHT };
                sum += own * learned(first + v * side + u);
            }
        }
        sum
    }

    /// Bytes of [`GuideStats::guide`].
    pub fn guide_footprint(lights: usize) -> Footprint {
        AliasTable::footprint(cells(lights))
    }
}

/// Cells along a side for this number of lights, with at most `most` cells in all.
fn side(lights: usize, most: usize) -> usize {
    let mut side = MAX_SIDE;
    while side > 1 && lights.saturating_mul(side * side) > most {
        side /= 2;
    }
    side
}

fn cells(lights: usize) -> usize {
    let side = side(lights, MAX_CELLS);
    lights * side * side
}

/// Calls `visit` with about `count` points, evenly spread over all surfaces that cast caustics.
fn for_each_caster_point(scene: &Scene, count: usize, mut visit: impl FnMut(u32, Vec3)) {
    let area = |index: u32| {
        let [a, b, c] = scene.mesh.corners(index);
        let area = 0.5 * f64::from((b - a).cross(c - a).length());
        if area.is_finite() { area } else { 0.0 }
    };
    let is_caster = |index: &u32| {
        let material = scene.mesh.material(*index);
        material.and_then(|m| scene.materials.get(m as usize)).is_some_and(Material::may_pass_caustics)
    };
    // Instances have more triangles than points are needed.
    let (in_world, all) = (scene.mesh.triangles.len() as u32, scene.mesh.triangle_count() as u32);
    let of_instances = (in_world..all).step_by(((all - in_world) >> 20) as usize + 1);
    let triangles = || (0..in_world).chain(of_instances.clone()).filter(is_caster);
    let step = triangles().map(area).sum::<f64>() / count as f64;
    if step <= 0.0 || step.is_nan() {
        return;
    }
    let (mut passed, mut number) = (0.5 * step, 0);
    for index in triangles() {
        passed += area(index);
        let [a, b, c] = scene.mesh.corners(index);
        while passed >= step && (number as usize) < 2 * count {
            passed -= step;
            let at = Sampler::new(0x6169_6d73, 0, number).pair(0);
            let (u, v) = crate::sampling::warp::uniform_triangle(at);
            visit(number, a + u * (b - a) + v * (c - a));
            number += 1;
        }
    }
}
