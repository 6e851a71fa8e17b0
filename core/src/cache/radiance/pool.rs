//! Coefficients of many records as half floats in the caller's memory, and the light that a lobe reflects
//! from them.
//!
//! A record has coefficients over its irradiance, and their gradients over the irradiance times a unit of
//! length, both of which are of the order of 1 in every scene. Gradients stop two degrees below the values:
//! higher ones add noise and no precision. Degree 6 takes 384 bytes, degree 8 takes 672.

use super::coefficients::{Coefficients, GROUPS_MAX};
use super::derivatives::Gradients;
use super::strata::groups;
use super::zernike::{COUNT_MAX, DEGREE_MAX, count};
use crate::Level;
use crate::Rgb;
use crate::memory::{Arena, Footprint, OutOfMemory};
use bytemuck::{Pod, Zeroable};
use glam::Vec2;
use halflight_simd::half::from_f32;
use halflight_simd::kernels::dots::Dots;

/// Least and greatest ratio of extrapolated light to that at the record.
const EXTRAPOLATION: [f32; 2] = [0.05, 20.0];

/// Record in a pool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PooledRecord {
    /// Irradiance, W/m².
    pub irradiance: [f32; 3],
    /// Unit of length of the gradients, m.
    pub unit: f32,
    /// First register of sixteen half floats.
    offset: u32,
    /// Degree of the values.
    degree: u32,
}

/// Degree of the gradients of a representation.
const fn gradient_degree(degree: usize) -> usize {
    match degree {
        0..=2 => degree,
        _ => {
            if degree > 4 {
                degree - 2
            } else {
                2
            }
        }
    }
}

/// Registers of a record: values of three channels, then gradients along x and y of each.
const fn registers(degree: usize) -> usize {
    3 * groups(degree) + 6 * groups(gradient_degree(degree))
}

/// Weights of the coefficients, in registers of sixteen; zero beyond a degree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights([[f32; 16]; GROUPS_MAX]);

impl Weights {
    /// Weights up to `degree`.
    pub fn new(weights: &[f32; COUNT_MAX], degree: usize) -> Self {
        let mut registers = [[0.0; 16]; GROUPS_MAX];
        let entries = registers.as_flattened_mut().iter_mut().zip(weights);
        entries.take(count(degree.min(DEGREE_MAX))).for_each(|(entry, weight)| *entry = *weight);
        Self(registers)
    }
}

/// Coefficients of many records.
///
/// ```
/// use glam::Vec2;
/// use halflight_core::Level;
/// use halflight_core::cache::radiance::{Coefficients, CoefficientPool, Weights};
/// use halflight_core::memory::{Arena, Line};
/// let mut lines = vec![Line([0; 64]); CoefficientPool::footprint(10, 2).bytes() / 64];
/// let mut pool = CoefficientPool::new(10, 2, &mut Arena::new(bytemuck::cast_slice_mut(&mut lines)))?;
/// let mut light = Coefficients { degree: 2, values: [[0.0; 45]; 3] };
/// light.values = light.values.map(|mut values| { values[0] = 2.0; values });
/// let record = pool.push(&light, &[[[0.0; 2]; 45]; 3], 0.1).unwrap();
/// let mut lobe = [0.0; 45];
/// lobe[0] = 0.5;
/// let reflected = pool.reflected(Level::detect(), &record, &Weights::new(&lobe, 2), Vec2::ZERO);
/// assert!((reflected.x - 1.0).abs() < 1e-3);
/// # Ok::<(), halflight_core::memory::OutOfMemory>(())
/// ```
#[derive(Debug)]
pub struct CoefficientPool<'m> {
    registers: &'m mut [[u16; 16]],
    used: usize,
}

impl<'m> CoefficientPool<'m> {
    /// Footprint of `records` records of `degree`.
    pub fn footprint(records: usize, degree: usize) -> Footprint {
        Footprint::default().slice::<[u16; 16]>(records.saturating_mul(registers(degree.min(DEGREE_MAX))))
    }

    /// Empty pool with memory for `records` records of `degree`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than the footprint.
    pub fn new(records: usize, degree: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let count = records.saturating_mul(registers(degree.min(DEGREE_MAX)));
        Ok(Self { registers: arena.slice(count)?, used: 0 })
    }

    /// Stores coefficients and gradients, the latter in the unit of length `unit`, above 0: the radius of the
    /// record. `None` without memory.
    pub fn push(
        &mut self,
        coefficients: &Coefficients,
        gradients: &Gradients,
        unit: f32,
    ) -> Option<PooledRecord> {
        let degree = coefficients.degree.min(DEGREE_MAX);
        let (values, slopes) = (groups(degree), groups(gradient_degree(degree)));
        let offset = u32::try_from(self.used).ok()?;
        let free = self.registers.get_mut(self.used..self.used + registers(degree))?;
        let irradiance = coefficients.irradiance().to_array();
        let irradiance = irradiance.map(|value| if value > 0.0 && value.is_finite() { value } else { 0.0 });
        let (free_values, free_slopes) = free.split_at_mut(3 * values);
        let rows = free_values.chunks_exact_mut(values).zip(free_slopes.chunks_exact_mut(2 * slopes));
        for (channel, (row, pair)) in rows.enumerate() {
            // A black or invalid channel stores zeros.
            let scale = 1.0 / irradiance[channel];
            let scale = if scale > 0.0 && scale.is_finite() { scale } else { 0.0 };
            store(row, degree, |k| scale * coefficients.values[channel][k]);
            for (axis, row) in pair.chunks_exact_mut(slopes).enumerate() {
                store(row, gradient_degree(degree), |k| scale * unit * gradients[channel][k][axis]);
            }
        }
        self.used += registers(degree);
        Some(PooledRecord { irradiance, unit, offset, degree: degree as u32 })
    }

    /// Σ w_k (λ_k + ∇λ_k · Δ) of each channel for a lobe, at the distance `delta` in m along the tangent axes
    /// of the record: at least 0.05 and at most 20 times the light at the record, and not negative. Zero for
    /// a record of another pool.
    pub fn reflected(&self, level: Level, record: &PooledRecord, weights: &Weights, delta: Vec2) -> Rgb {
        let degree = (record.degree as usize).min(DEGREE_MAX);
        let (values, slopes) = (groups(degree), groups(gradient_degree(degree)));
        let first = record.offset as usize;
        let Some(rows) = self.registers.get(first..first.saturating_add(registers(degree))) else {
            return Rgb::ZERO;
        };
        let (mut own, mut slope) = ([0.0; 3], [0.0; 6]);
        let (of_values, of_slopes) = rows.split_at(3 * values);
        Dots { rows: of_values, weights: weights.0.get(..values).unwrap_or_default(), out: &mut own }
            .compute(level);
        Dots { rows: of_slopes, weights: weights.0.get(..slopes).unwrap_or_default(), out: &mut slope }
            .compute(level);
        let step = if record.unit > 0.0 { delta / record.unit } else { Vec2::ZERO };
        Rgb::from_array(core::array::from_fn(|channel| {
            let here = own[channel].max(0.0);
            let there = own[channel] + step.dot(Vec2::new(slope[2 * channel], slope[2 * channel + 1]));
            let within = there.max(EXTRAPOLATION[0] * here).min(EXTRAPOLATION[1] * here);
            record.irradiance[channel] * within
        }))
    }

    /// Weighted mean of the light that a lobe reflects at a point, from records with their weights and
    /// distances along their tangent axes. `None` if all weights are zero.
    pub fn interpolated<'r>(
        &self,
        level: Level,
        weights: &Weights,
        records: impl IntoIterator<Item = (f32, &'r PooledRecord, Vec2)>,
    ) -> Option<Rgb> {
        let (mut sum, mut total) = (Rgb::ZERO, 0.0);
        for (weight, record, delta) in records {
            sum += weight * self.reflected(level, record, weights, delta);
            total += weight;
        }
        (total > 0.0).then(|| sum / total)
    }

    /// Registers of sixteen half floats in use.
    pub fn used(&self) -> usize {
        self.used
    }
}

/// Stores the numbers up to `degree` as finite half floats, zeros beyond.
fn store(row: &mut [[u16; 16]], degree: usize, number: impl Fn(usize) -> f32) {
    const GREATEST: f32 = 65504.0;
    for (k, entry) in row.as_flattened_mut().iter_mut().enumerate() {
        let number = if k < count(degree) { number(k) } else { 0.0 };
        let finite = if number.is_nan() { 0.0 } else { number.clamp(-GREATEST, GREATEST) };
        *entry = from_f32(finite);
    }
}

#[cfg(test)]
mod tests;
