//! Projection of a hemisphere of gather rays onto spherical harmonics.
//!
//! The strata have equal shares of cos θ dω, so that the weight dω of a ray is 1/cos θ, whose variance is
//! infinite. The table therefore holds ∫ Y_k dω over each stratum, with the exact solid angle of its parts:
//! at the radius r = max(|x|, |y|) of the concentric map a part dx dy has π/4 dy dr/√(1 - r²).

use super::{COUNT_MAX, ORDER_MAX, count, values};
use crate::cache::hemisphere::{Hemisphere, SIDE_MAX};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::warp::concentric_disk;
use crate::{Level, Rgb};
use core::f32::consts::{FRAC_PI_4, PI};
use halflight_simd::kernels::outer::Outer;

/// Parts along a side of a stratum.
const PARTS: usize = 8;

/// Registers of sixteen for all functions.
const GROUPS_MAX: usize = COUNT_MAX.div_ceil(16);

/// Integrals of all functions over N × N strata.
#[derive(Clone, Copy, Debug)]
pub struct ShTables<'m> {
    n: usize,
    order: usize,
    integrals: &'m [[f32; 16]],
}

impl<'m> ShTables<'m> {
    /// Footprint of the tables for n × n strata and functions up to `order`.
    pub fn footprint(n: usize, order: usize) -> Footprint {
        let (n, order) = (n.min(SIDE_MAX), order.min(ORDER_MAX));
        Footprint::default().slice::<[f32; 16]>(n * n * count(order).div_ceil(16))
    }

    /// Builds the tables.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than the footprint, n is not in 1 ..= [`SIDE_MAX`], or the order
    /// exceeds [`ORDER_MAX`].
    pub fn build(n: usize, order: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        if !(1..=SIDE_MAX).contains(&n) || order > ORDER_MAX {
            return Err(OutOfMemory { needed: usize::MAX, available: arena.available() });
        }
        let groups = count(order).div_ceil(16);
        let integrals: &mut [[f32; 16]] = arena.slice(n * n * groups)?;
        let side = 2.0 / (n * PARTS) as f32;
        for (c, row) in integrals.chunks_exact_mut(groups).enumerate() {
            let entries = row.as_flattened_mut();
            entries.fill(0.0);
            for part in 0..PARTS * PARTS {
                let at = [(c % n, part % PARTS), (c / n, part / PARTS)]
                    .map(|(stratum, part)| ((PARTS * stratum + part) as f32 + 0.5) * side - 1.0);
                let radius = at[0].abs().max(at[1].abs());
                let arc = |radius: f32| libm::asinf(radius.min(1.0));
                let angle = arc(radius + 0.5 * side) - arc(radius - 0.5 * side);
                let solid_angle = FRAC_PI_4 * side * angle;
                let q = concentric_disk(at.map(|at| 0.5 * (at + 1.0)));
                // The mean cosine keeps ∫ cos θ dω exact at the horizon.
                let direction = q.extend(side / angle);
                for (entry, value) in entries.iter_mut().zip(values(order, direction.to_array())) {
                    *entry += solid_angle * value;
                }
            }
        }
        Ok(Self { n, order, integrals })
    }

    /// Number of strata along a side.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Order of the representation.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Solid angle of each stratum.
    pub(super) fn solid_angles(&self) -> impl Iterator<Item = f32> + use<'m> {
        // Y_00 is constant.
        let inverse = libm::sqrtf(4.0 * PI);
        self.integrals.chunks_exact(count(self.order).div_ceil(16)).map(move |row| inverse * row[0][0])
    }

    /// Integrals over each stratum, in registers of sixteen.
    pub fn integrals(&self) -> &'m [[f32; 16]] {
        self.integrals
    }
}

/// Coefficients λ_k = ∫ L Y_k dω of each channel over the hemisphere, W/m²; zero beyond the order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShCoefficients {
    /// Order of the representation.
    pub order: usize,
    /// Irradiance, W/m².
    pub irradiance: Rgb,
    /// Coefficients of red, green and blue.
    pub values: [[f32; COUNT_MAX]; 3],
}

impl ShCoefficients {
    /// Projects the radiances of a hemisphere. `None` if it has another number of strata than the tables.
    pub fn project(level: Level, tables: &ShTables, hemisphere: &Hemisphere) -> Option<Self> {
        if hemisphere.n() != tables.n {
            return None;
        }
        let mut sums = [[[0.0; 16]; 3]; GROUPS_MAX];
        let sums = sums.get_mut(..count(tables.order).div_ceil(16))?;
        Outer { factors: hemisphere.radiance(), table: tables.integrals, sums }.add(level);
        let mut values = [[0.0; COUNT_MAX]; 3];
        for (channel, values) in values.iter_mut().enumerate() {
            let sums = sums.iter().flat_map(|group| group[channel]).take(count(tables.order));
            values.iter_mut().zip(sums).for_each(|(value, sum)| *value = sum);
        }
        Some(Self { order: tables.order, irradiance: hemisphere.irradiance(), values })
    }
}
