//! Coefficients of many records as half floats in the caller's memory, and the light that a lobe reflects
//! from them.
//!
//! A record has coefficients over E/√π, which is the coefficient of degree 0 of Zernike polynomials, and
//! their gradients over E/√π times a unit of length, both of which are of the order of 1 in every scene.
//! Zernike polynomials of degree 6 take 384 bytes, of degree 8 672; spherical harmonics of order 9 take 2016.

use super::basis::{Basis, COUNT_MAX, Representation};
use super::coefficients::Coefficients;
use super::derivatives::Gradients;
use super::sh::{ShCoefficients, ShGradients};
use crate::Level;
use crate::Rgb;
use crate::memory::{Arena, Footprint, OutOfMemory};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::PI;
use glam::Vec2;
use halflight_simd::half::from_f32;
use halflight_simd::kernels::dots::dot;
use halflight_simd::{Kernel, Simd};

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
    /// Registers of the values of a channel, and of a component of their gradients.
    groups: [u16; 2],
}

/// Registers of the values of a channel, at most.
const GROUPS_MAX: usize = COUNT_MAX.div_ceil(16);

/// Weights of the coefficients, in registers of sixteen; zero beyond a degree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    registers: [[f32; 16]; GROUPS_MAX],
    /// Registers in use.
    groups: usize,
}

impl Weights {
    /// Weights of the first coefficients; those of all others are zero.
    pub fn new(weights: &[f32]) -> Self {
        Self::of(weights.len(), weights.iter().copied())
    }

    /// Weights of the first `count` coefficients.
    #[inline]
    pub(super) fn of(count: usize, weights: impl Iterator<Item = f32>) -> Self {
        let mut registers = [[0.0; 16]; GROUPS_MAX];
        let entries = registers.as_flattened_mut().iter_mut().take(count);
        entries.zip(weights).for_each(|(entry, weight)| *entry = weight);
        Self { registers, groups: count.div_ceil(16).min(GROUPS_MAX) }
    }

    /// Adds to the weight of coefficient `k`, if it is one of those in use.
    pub(super) fn add(&mut self, k: usize, weight: f32) {
        if let Some(entry) = self.registers.as_flattened_mut().get_mut(k) {
            *entry += weight;
        }
    }

    /// Weights of all coefficients.
    pub(crate) fn all(&self) -> &[f32; COUNT_MAX] {
        self.registers.as_flattened().first_chunk().unwrap_or(&[0.0; COUNT_MAX])
    }
}

/// Dot products of the weights of each channel with its values, and with both components of its gradients.
struct OfRecord<'a> {
    rows: &'a [[u16; 16]],
    /// Registers of a channel's values, and of a component of their gradients.
    groups: [usize; 2],
    weights: [&'a Weights; 3],
}

impl Kernel for OfRecord<'_> {
    type Out = [[f32; 3]; 3];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Out {
        let [values, slopes] = self.groups;
        let mut products = [[0.0; 3]; 3];
        for (channel, (products, weights)) in products.iter_mut().zip(self.weights).enumerate() {
            let slope = 3 * values + 2 * channel * slopes;
            let rows = [(channel * values, values), (slope, slopes), (slope + slopes, slopes)];
            for (product, (first, count)) in products.iter_mut().zip(rows) {
                // Registers beyond those of the weights add nothing.
                let groups = weights.groups.min(count);
                let row = self.rows.get(first..first + groups).unwrap_or_default();
                *product = dot(simd, row, &weights.registers);
            }
        }
        products
    }
}

/// Coefficients of incident radiance and their gradients, to be stored.
#[derive(Clone, Copy, Debug)]
pub struct Expansion<'a> {
    /// Basis and degree.
    pub representation: Representation,
    /// Irradiance, W/m².
    pub irradiance: Rgb,
    /// Coefficients of each channel.
    pub values: [&'a [f32]; 3],
    /// Their gradients, per m.
    pub gradients: [&'a [[f32; 2]]; 3],
}

impl<'a> Expansion<'a> {
    /// Zernike polynomials.
    pub fn zernike(light: &'a Coefficients, gradients: &'a Gradients) -> Self {
        Self {
            representation: Representation { basis: Basis::Zernike, degree: light.degree },
            irradiance: light.irradiance(),
            values: light.values.each_ref().map(|values| &values[..]),
            gradients: gradients.each_ref().map(|gradients| &gradients[..]),
        }
    }

    /// Spherical harmonics.
    pub fn spherical_harmonics(light: &'a ShCoefficients, gradients: &'a ShGradients) -> Self {
        Self {
            representation: Representation { basis: Basis::SphericalHarmonics, degree: light.order },
            irradiance: light.irradiance,
            values: light.values.each_ref().map(|values| &values[..]),
            gradients: gradients.each_ref().map(|gradients| &gradients[..]),
        }
    }
}

/// Coefficients of many records.
///
/// ```
/// use glam::Vec2;
/// use halflight_core::Level;
/// use halflight_core::cache::radiance::{Basis, CoefficientPool, Coefficients, Expansion, Representation};
/// use halflight_core::cache::radiance::Weights;
/// use halflight_core::memory::{Arena, Line};
/// let of = Representation { basis: Basis::Zernike, degree: 2 };
/// let mut lines = vec![Line([0; 64]); CoefficientPool::footprint(10, of).bytes() / 64];
/// let mut pool = CoefficientPool::new(10, of, &mut Arena::new(bytemuck::cast_slice_mut(&mut lines)))?;
/// let mut light = Coefficients { degree: 2, values: [[0.0; 45]; 3] };
/// light.values = light.values.map(|mut values| { values[0] = 2.0; values });
/// let record = pool.push(&Expansion::zernike(&light, &[[[0.0; 2]; 45]; 3]), 0.1).unwrap();
/// let reflected = pool.reflected(Level::detect(), &record, &Weights::new(&[0.5]), Vec2::ZERO);
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
        let is_inside = self.groups != [0; 2] && self.range().end <= registers;
        *self == Self::default() || finite && self.unit.is_finite() && self.unit > 0.0 && is_inside
    }

    /// Range of its registers.
    fn range(&self) -> core::ops::Range<usize> {
        let first = self.offset as usize;
        let [values, slopes] = self.counts();
        first..first.saturating_add(3 * values + 6 * slopes)
    }

    /// Registers of the values and of the gradients, within those of any representation.
    fn counts(&self) -> [usize; 2] {
        self.groups.map(|count| usize::from(count).min(GROUPS_MAX))
    }
}

/// Writes coefficients and gradients, the latter times `gradient_scale` and in the unit of length `unit`,
/// above 0, to the registers of one record. `None` if there are fewer than [`Representation::registers`].
pub(super) fn write(
    out: &mut [[u16; 16]],
    light: &Expansion,
    (gradient_scale, unit): (f32, f32),
) -> Option<PooledRecord> {
    let representation = light.representation;
    let [values, slopes] = representation.groups();
    let count = [representation, representation.of_gradients()].map(Representation::count);
    let free = out.get_mut(..representation.registers())?;
    let irradiance = light.irradiance.to_array();
    let irradiance = irradiance.map(|value| if value > 0.0 && value.is_finite() { value } else { 0.0 });
    let (free_values, free_slopes) = free.split_at_mut(3 * values);
    let rows = free_values.chunks_exact_mut(values).zip(free_slopes.chunks_exact_mut(2 * slopes));
    for (channel, (row, pair)) in rows.enumerate() {
        // A black or invalid channel stores zeros.
        let scale = libm::sqrtf(PI) / irradiance[channel];
        let scale = if scale > 0.0 && scale.is_finite() { scale } else { 0.0 };
        let own = light.values[channel].iter().map(|value| scale * value);
        store(row, own.take(count[0]));
        for (axis, row) in pair.chunks_exact_mut(slopes).enumerate() {
            let own =
                light.gradients[channel].iter().map(|slope| scale * unit * (gradient_scale * slope[axis]));
            store(row, own.take(count[1]));
        }
    }
    Some(PooledRecord { irradiance, unit, offset: 0, groups: [values as u16, slopes as u16] })
}

impl<'m> CoefficientPool<'m> {
    /// Footprint of `records` records of `representation`.
    pub fn footprint(records: usize, representation: Representation) -> Footprint {
        Footprint::default().slice::<[u16; 16]>(records.saturating_mul(representation.registers()))
    }

    /// Empty pool with memory for `records` records of `representation`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than the footprint.
    pub fn new(
        records: usize,
        representation: Representation,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let count = records.saturating_mul(representation.registers());
        Ok(Self { registers: arena.slice(count)?, used: 0 })
    }

    /// Stores coefficients and gradients, the latter in the unit of length `unit`, above 0: the radius of the
    /// record. `None` without memory.
    pub fn push(&mut self, light: &Expansion, unit: f32) -> Option<PooledRecord> {
        let offset = u32::try_from(self.used).ok()?;
        let record = write(self.registers.get_mut(self.used..)?, light, (1.0, unit))?;
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
        let [values, slopes] = record.counts();
        let Some(rows) = self.registers.get(record.range()) else { return Rgb::ZERO };
        let products = level.dispatch(OfRecord { rows, groups: [values, slopes], weights });
        let step = if record.unit > 0.0 { delta / record.unit } else { Vec2::ZERO };
        let mut reflected = [0.0; 3];
        for ((reflected, [own, x, y]), irradiance) in
            reflected.iter_mut().zip(products).zip(record.irradiance)
        {
            let here = own.max(0.0);
            let there = own + step.dot(Vec2::new(x, y));
            let within = there.max(EXTRAPOLATION[0] * here).min(EXTRAPOLATION[1] * here);
            *reflected = irradiance * (1.0 / libm::sqrtf(PI)) * within;
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

/// Stores the numbers as finite half floats, then zeros.
fn store(row: &mut [[u16; 16]], mut numbers: impl Iterator<Item = f32>) {
    const GREATEST: f32 = 65504.0;
    for entry in row.as_flattened_mut() {
        let number = numbers.next().unwrap_or(0.0);
        let finite = if number.is_nan() { 0.0 } else { number.clamp(-GREATEST, GREATEST) };
        *entry = from_f32(finite);
    }
}

#[cfg(test)]
mod tests;
