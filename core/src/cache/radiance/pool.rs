//! Coefficients of many records as half floats in the caller's memory, and the light that a lobe reflects
//! from them.
//!
//! A record has coefficients over E/√π, which is the coefficient of degree 0, and their gradients over E/√π
//! times a unit of length, both of which are of the order of 1 in every scene. Gradients stop two degrees
//! below the values: higher ones add noise and no precision. Degree 6 takes 384 bytes, degree 8 takes 672.

use super::coefficients::{Coefficients, GROUPS_MAX};
use super::derivatives::Gradients;
use super::strata::groups;
use super::zernike::{COUNT_MAX, DEGREE_MAX, count};
use crate::Level;
use crate::Rgb;
use crate::memory::{Arena, Footprint, OutOfMemory};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::PI;
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

impl PooledRecord {
    /// True if this is a record with coefficients, of a pool or of registers of its own.
    pub fn is_some(&self) -> bool {
        self.unit > 0.0
    }

    /// True if it is none, or a record whose coefficients are among `registers`.
    pub fn is_sound(&self, registers: usize) -> bool {
        let finite = self.irradiance.iter().all(|value| value.is_finite() && *value >= 0.0);
        let is_inside = self.degree as usize <= DEGREE_MAX && self.range().end <= registers;
        *self == Self::default() || finite && self.unit.is_finite() && self.unit > 0.0 && is_inside
    }

    /// Range of its registers.
    fn range(&self) -> core::ops::Range<usize> {
        let first = self.offset as usize;
        first..first.saturating_add(registers((self.degree as usize).min(DEGREE_MAX)))
    }
}

/// Number of registers of a record of `degree`.
pub(crate) const fn registers_of(degree: usize) -> usize {
    registers(if degree > DEGREE_MAX { DEGREE_MAX } else { degree })
}

/// Writes coefficients and gradients, the latter in the unit of length `unit`, above 0, to the registers of
/// one record. `None` if there are fewer than [`registers_of`].
pub(crate) fn write(
    out: &mut [[u16; 16]],
    coefficients: &Coefficients,
    gradients: &Gradients,
    unit: f32,
) -> Option<PooledRecord> {
    let degree = coefficients.degree.min(DEGREE_MAX);
    let (values, slopes) = (groups(degree), groups(gradient_degree(degree)));
    let free = out.get_mut(..registers(degree))?;
    let irradiance = coefficients.irradiance().to_array();
    let irradiance = irradiance.map(|value| if value > 0.0 && value.is_finite() { value } else { 0.0 });
    let (free_values, free_slopes) = free.split_at_mut(3 * values);
    let rows = free_values.chunks_exact_mut(values).zip(free_slopes.chunks_exact_mut(2 * slopes));
    for (channel, (row, pair)) in rows.enumerate() {
        // A black or invalid channel stores zeros.
        let scale = libm::sqrtf(PI) / irradiance[channel];
        let scale = if scale > 0.0 && scale.is_finite() { scale } else { 0.0 };
        store(row, degree, |k| scale * coefficients.values[channel][k]);
        for (axis, row) in pair.chunks_exact_mut(slopes).enumerate() {
            store(row, gradient_degree(degree), |k| scale * unit * gradients[channel][k][axis]);
        }
    }
    Some(PooledRecord { irradiance, unit, offset: 0, degree: degree as u32 })
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
        let offset = u32::try_from(self.used).ok()?;
        let record = write(self.registers.get_mut(self.used..)?, coefficients, gradients, unit)?;
        self.used += record.range().len();
        Some(PooledRecord { offset, ..record })
    }

    /// Copies `record` from its `registers`. `None` without memory.
    pub fn append(&mut self, record: &PooledRecord, registers: &[[u16; 16]]) -> Option<PooledRecord> {
        let offset = u32::try_from(self.used).ok()?;
        let from = registers.get(record.range())?;
        let free = self.registers.get_mut(self.used..self.used + from.len())?;
        free.copy_from_slice(from);
        self.used += from.len();
        Some(PooledRecord { offset, ..*record })
    }

    /// Empties the pool, so that records can be kept in it with [`CoefficientPool::keep`].
    pub fn clear(&mut self) {
        self.used = 0;
    }

    /// Keeps `record` of the pool before [`CoefficientPool::clear`]; records come in the order of their
    /// insertion. `None` for a record of another pool.
    pub fn keep(&mut self, record: &PooledRecord) -> Option<PooledRecord> {
        let range = record.range();
        if range.start < self.used || range.end > self.registers.len() {
            return None;
        }
        let (offset, count) = (self.used, range.len());
        self.registers.copy_within(range, offset);
        self.used += count;
        Some(PooledRecord { offset: offset as u32, ..*record })
    }

    /// Registers in use, in the order of insertion.
    pub fn registers(&self) -> &[[u16; 16]] {
        self.registers.get(..self.used).unwrap_or_default()
    }

    /// Σ w_k (λ_k + ∇λ_k · Δ) of each channel for a lobe, at the distance `delta` in m along the tangent axes
    /// of the record: at least 0.05 and at most 20 times the light at the record, and not negative. Zero for
    /// a record of another pool.
    pub fn reflected(&self, level: Level, record: &PooledRecord, weights: &Weights, delta: Vec2) -> Rgb {
        self.reflected_by(level, record, [weights; 3], delta)
    }

    /// [`CoefficientPool::reflected`] with other weights for each channel: the lobe of a coloured surface.
    pub fn reflected_by(
        &self,
        level: Level,
        record: &PooledRecord,
        weights: [&Weights; 3],
        delta: Vec2,
    ) -> Rgb {
        let degree = (record.degree as usize).min(DEGREE_MAX);
        let (values, slopes) = (groups(degree), groups(gradient_degree(degree)));
        let Some(rows) = self.registers.get(record.range()) else { return Rgb::ZERO };
        let (of_values, of_slopes) = rows.split_at(3 * values);
        let step = if record.unit > 0.0 { delta / record.unit } else { Vec2::ZERO };
        let mut reflected = [0.0; 3];
        let rows = of_values.chunks_exact(values).zip(of_slopes.chunks_exact(2 * slopes));
        for (channel, ((reflected, weights), (of_values, of_slopes))) in
            reflected.iter_mut().zip(weights).zip(rows).enumerate()
        {
            let (mut own, mut slope) = ([0.0], [0.0; 2]);
            Dots { rows: of_values, weights: weights.0.get(..values).unwrap_or_default(), out: &mut own }
                .compute(level);
            Dots { rows: of_slopes, weights: weights.0.get(..slopes).unwrap_or_default(), out: &mut slope }
                .compute(level);
            let here = own[0].max(0.0);
            let there = own[0] + step.dot(Vec2::from(slope));
            let within = there.max(EXTRAPOLATION[0] * here).min(EXTRAPOLATION[1] * here);
            *reflected = record.irradiance[channel] * (1.0 / libm::sqrtf(PI)) * within;
        }
        Rgb::from_array(reflected)
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
