//! Environment visibility: importance sampling of the part of the environment that is visible from each place
//! of the scene, learned in a prepass (portals, Bitterli 2015, solve this for given windows).
//!
//! The unit square that samples the environment is divided into bins of equal power. Each place, a cell of a
//! grid and the axis that its surface faces most, has a table of the probabilities of the bins. The table
//! warps the square monotonically in both coordinates, which preserves stratification.
//! [`crate::transport::VisibilityPrepass`] learns the tables. Estimates are unbiased with any table.

use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bins along the azimuth: most of the light of a sky comes from a few rows, and windows are upright.
const COLUMNS: usize = 64;
const ROWS: usize = 32;

/// A number for each bin, row by row.
pub type Bins = [f32; COLUMNS * ROWS];

/// Share of samples that is uniform over all bins, because the prepass may have missed light.
const DEFENSIVE_SHARE: f32 = 0.1;

/// Density over the unit square for one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct VisibilityTable {
    /// Last unit of each row, of 65536.
    rows: [u16; ROWS],
    /// Last unit of each cell in its row, of 65536.
    cells: [[u16; COLUMNS]; ROWS],
}

/// Sample of a visibility table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpedSample {
    /// Point in the unit square of the environment.
    pub place: [f32; 2],
    /// Density relative to sampling without the table.
    pub density: f32,
}

impl VisibilityTable {
    /// Table for the mean importance of each bin, over whole bins or parts. The root mean square of the
    /// incident radiance gives the least variance. NaN counts as zero.
    pub fn new(bins: &Bins) -> Self {
        let probabilities = Self::probabilities(bins);
        let mut table = Self { rows: [0; ROWS], cells: [[0; COLUMNS]; ROWS] };
        let mut rows = [0.0; ROWS];
        for (y, row) in probabilities.chunks_exact(COLUMNS).enumerate() {
            rows[y] = row.iter().sum();
            table.cells[y] = ends(row);
        }
        table.rows = ends(&rows);
        table
    }

    /// Probabilities of samples in each bin; their sum is one.
    pub fn probabilities(bins: &Bins) -> Bins {
        let count = bins.len() as f32;
        let finite = |x: f32| if x > 0.0 && x < f32::INFINITY { x } else { 0.0 };
        let sum: f32 = bins.iter().map(|&x| finite(x)).sum();
        let share = if sum > 0.0 && sum < f32::INFINITY { (1.0 - DEFENSIVE_SHARE) / sum } else { 0.0 };
        let rest = if share > 0.0 { DEFENSIVE_SHARE / count } else { 1.0 / count };
        bins.map(|x| rest + share * finite(x))
    }

    /// Point of the environment's square for a point of the unit square, and its relative density.
    #[inline]
    pub fn warp(&self, [u, v]: [f32; 2]) -> WarpedSample {
        let (y, v, share) = pick(&self.rows, v);
        let (x, u, cell) = pick(self.cells.get(y).unwrap_or(&self.cells[0]), u);
        let place = [(x as f32 + u) / COLUMNS as f32, (y as f32 + v) / ROWS as f32];
        let density = share * cell * (COLUMNS * ROWS) as f32;
        WarpedSample { place: place.map(|u| u.min(crate::sampling::ONE_MINUS_EPSILON)), density }
    }

    /// Density at a point of the environment's square relative to sampling without the table.
    #[inline]
    pub fn density(&self, [u, v]: [f32; 2]) -> f32 {
        let y = ((v * ROWS as f32) as usize).min(ROWS - 1);
        let x = ((u * COLUMNS as f32) as usize).min(COLUMNS - 1);
        let cell = |ends: &[u16], i: usize| (1 + last(ends, i) - start(ends, i)) as f32 / WHOLE;
        cell(&self.rows, y) * cell(&self.cells[y], x) * (COLUMNS * ROWS) as f32
    }

    /// True if `bin` is a black square of a chessboard.
    pub fn is_black(bin: usize) -> bool {
        (bin % COLUMNS + bin / COLUMNS).is_multiple_of(2)
    }

    /// Point of the environment's square in `bin`, at `offset` of the bin's unit square.
    pub fn place(bin: usize, offset: [f32; 2]) -> [f32; 2] {
        let (x, y) = (bin % COLUMNS, bin / COLUMNS);
        [(x as f32 + offset[0]) / COLUMNS as f32, (y as f32 + offset[1]) / ROWS as f32]
    }

    /// Weighted mean of each bin and its neighbours. Columns wrap around the horizon.
    pub fn smoothed(bins: &Bins) -> Bins {
        const WEIGHTS: [f32; 3] = [0.25, 0.5, 0.25];
        core::array::from_fn(|bin| {
            let (x, y) = (bin % COLUMNS, bin / COLUMNS);
            let mut sum = 0.0;
            for (dy, wy) in WEIGHTS.into_iter().enumerate() {
                let y = (y + dy).saturating_sub(1).min(ROWS - 1);
                for (dx, wx) in WEIGHTS.into_iter().enumerate() {
                    sum += wy * wx * bins[y * COLUMNS + (x + dx + COLUMNS - 1) % COLUMNS];
                }
            }
            sum
        })
    }
}

const WHOLE: f32 = 65536.0;

/// Shares converted to the last unit of each bin; every bin gets at least one unit.
fn ends<const N: usize>(shares: &[f32]) -> [u16; N]
where
{
    let total: f32 = shares.iter().sum();
    let scale = (WHOLE - N as f32) / total;
    let mut sum = 0.0;
    let mut ends = core::array::from_fn(|i| {
        sum += shares.get(i).copied().unwrap_or(0.0);
        ((sum * scale) as u32 + i as u32).min(65535) as u16
    });
    ends[N - 1] = u16::MAX;
    ends
}

#[inline]
fn last(ends: &[u16], i: usize) -> u32 {
    u32::from(ends[i])
}

#[inline]
fn start(ends: &[u16], i: usize) -> u32 {
    if i == 0 { 0 } else { last(ends, i - 1) + 1 }
}

/// Bin at `u`, position in it, and its probability. Counting all bins takes only a few vector instructions.
#[inline]
fn pick<const N: usize>(ends: &[u16; N], u: f32) -> (usize, f32, f32) {
    let at = u.clamp(0.0, crate::sampling::ONE_MINUS_EPSILON) * WHOLE;
    let unit = at as u16;
    let before: u16 = ends.iter().map(|&end| u16::from(end < unit)).sum();
    let bin = usize::from(before).min(N - 1);
    let (start, last) = (start(ends, bin), last(ends, bin));
    let width = (1 + last - start) as f32;
    (bin, (at - start as f32) / width, width / WHOLE)
}

/// Grid of equal cells over the places that matter.
#[derive(Clone, Copy, Debug, Default)]
pub struct VisibilityGrid {
    origin: Vec3,
    /// Cells per unit of length.
    per_length: f32,
    counts: [u32; 3],
}

/// Cells along the longest side, unless the grid exceeds `CELLS`.
const CELLS_ALONG_LONGEST: f32 = 24.0;
const CELLS: usize = 4096;
/// Sides ±x, ±y, ±z that a surface may face.
const SIDES: usize = 6;

impl VisibilityGrid {
    /// Grid over `bounds`; `None` if they are empty or not finite.
    pub fn over(bounds: &Bounds) -> Option<Self> {
        let (origin, size) = (bounds.min, bounds.max - bounds.min);
        let longest = size.max_element();
        if !(longest > 0.0 && longest < f32::INFINITY && origin.is_finite()) {
            return None;
        }
        let mut along = CELLS_ALONG_LONGEST;
        loop {
            let counts = (size / longest * along).to_array().map(|n| n as u32 + 1);
            let cells: u32 = counts.iter().product();
            let per_length = along / longest;
            if cells as usize <= CELLS {
                return per_length.is_finite().then_some(Self { origin, per_length, counts });
            }
            along *= 0.95;
        }
    }

    /// Index of the place of a surface; `None` outside the grid.
    #[inline]
    pub fn place(&self, position: Vec3, normal: Vec3) -> Option<usize> {
        let at = (position - self.origin) * self.per_length;
        let [nx, ny, nz] = self.counts.map(|count| count as f32);
        // NaN counts as outside.
        if !(at.min_element() >= 0.0 && at.x < nx && at.y < ny && at.z < nz) {
            return None;
        }
        let cell = (at.z as usize * self.counts[1] as usize + at.y as usize) * self.counts[0] as usize
            + at.x as usize;
        let size = normal.abs();
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        Some(SIDES * cell + 2 * axis + usize::from(normal[axis] < 0.0))
    }
}

/// Visibility tables of all places.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentVisibility<'m> {
    grid: VisibilityGrid,
    /// Number of the table of each place, from 1; 0 without a table.
    slots: &'m [u16],
    visibility: &'m [VisibilityTable],
}

impl<'m> EnvironmentVisibility<'m> {
    /// Largest number of tables.
    pub const MAX_TABLES: usize = 2048;

    /// Bytes of all tables and their indices.
    pub fn footprint() -> Footprint {
        Footprint::default().slice::<u16>(CELLS * SIDES).slice::<VisibilityTable>(Self::MAX_TABLES)
    }

    /// Memory for [`EnvironmentVisibility::new`], to be filled: table numbers by place, all zero, and tables.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`EnvironmentVisibility::footprint`].
    pub fn memory(arena: &mut Arena<'m>) -> Result<(&'m mut [u16], &'m mut [VisibilityTable]), OutOfMemory> {
        let slots: &mut [u16] = arena.slice(CELLS * SIDES)?;
        slots.fill(0);
        Ok((slots, arena.slice(Self::MAX_TABLES)?))
    }

    /// Tables in memory of [`EnvironmentVisibility::memory`].
    pub fn new(grid: VisibilityGrid, slots: &'m [u16], visibility: &'m [VisibilityTable]) -> Self {
        Self { grid, slots, visibility }
    }

    /// Table of a surface with unit `normal`; `None` without one.
    #[inline]
    pub fn at(&self, position: Vec3, normal: Vec3) -> Option<&'m VisibilityTable> {
        if normal == Vec3::ZERO {
            return None;
        }
        let slot = *self.slots.get(self.grid.place(position, normal)?)?;
        self.visibility.get(usize::from(slot).wrapping_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    /// Table with a bright corner, a bin of zero and a bin of NaN.
    fn table() -> VisibilityTable {
        let mut bins: Bins =
            core::array::from_fn(|i| if i % COLUMNS < 5 && i < 128 { i as f32 } else { 0.1 });
        (bins[7], bins[300]) = (f32::NAN, 0.0);
        VisibilityTable::new(&bins)
    }

    #[test]
    fn samples_have_the_density_that_is_said() {
        let table = table();
        let (mut counts, count) = ([0.0f32; COLUMNS * ROWS], 1 << 18);
        for i in 0..count {
            let WarpedSample { place: at, density } = table.warp(Sampler::new(7, 0, i).pair(0));
            assert!(at.iter().all(|x| (0.0..1.0).contains(x)), "{at:?}");
            assert!((density / table.density(at) - 1.0).abs() < 1e-6, "{at:?}");
            counts[(at[1] * ROWS as f32) as usize * COLUMNS + (at[0] * COLUMNS as f32) as usize] += 1.0;
        }
        for (bin, found) in counts.into_iter().enumerate() {
            let expected =
                table.density(VisibilityTable::place(bin, [0.5; 2])) * count as f32 / counts.len() as f32;
            // The sequence fills bins evenly, except for a few points at the borders.
            assert!((found - expected).abs() < 4.0 + 0.05 * expected, "bin {bin}: {found}, {expected}");
        }
    }

    #[test]
    fn the_density_is_one_in_the_mean_and_nowhere_zero() {
        let table = table();
        let all = (0..COLUMNS * ROWS).map(|bin| table.density(VisibilityTable::place(bin, [0.5; 2])));
        assert!((all.clone().sum::<f32>() / (COLUMNS * ROWS) as f32 - 1.0).abs() < 1e-5);
        assert!(all.fold(f32::INFINITY, f32::min) > 0.5 * DEFENSIVE_SHARE);
    }

    #[test]
    fn nothing_known_is_the_square_as_it_is() {
        let plain = VisibilityTable::new(&[0.0; COLUMNS * ROWS]);
        for u in [[0.0; 2], [0.3, 0.8], [crate::sampling::ONE_MINUS_EPSILON; 2]] {
            let WarpedSample { place: at, density } = plain.warp(u);
            assert!((density - 1.0).abs() < 1e-2, "{density}");
            assert!((at[0] - u[0]).abs() < 1e-3 && (at[1] - u[1]).abs() < 1e-3, "{at:?}");
        }
    }

    #[test]
    fn exact_bytes_suffice_and_one_less_is_an_error() {
        let bytes = EnvironmentVisibility::footprint().bytes();
        let mut lines = std::vec![crate::memory::Line([0; 64]); bytes / 64];
        let memory: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
        assert!(EnvironmentVisibility::memory(&mut Arena::new(&mut memory[..bytes - 1])).is_err());
        assert!(EnvironmentVisibility::memory(&mut Arena::new(memory)).is_ok());
    }

    #[test]
    fn places_tell_sides_apart_and_what_is_outside() {
        let grid = VisibilityGrid::over(&Bounds::around([Vec3::ZERO, Vec3::new(4.0, 1.0, 2.0)]))
            .expect("it has a size");
        let at = |p: Vec3, n: Vec3| grid.place(p, n);
        assert_ne!(at(Vec3::ONE, Vec3::Y), at(Vec3::ONE, Vec3::NEG_Y));
        assert_ne!(at(Vec3::ONE, Vec3::X), at(Vec3::new(3.0, 1.0, 1.0), Vec3::X));
        assert!(at(Vec3::splat(-0.1), Vec3::X).is_none() && at(Vec3::NAN, Vec3::X).is_none());
        assert!(VisibilityGrid::over(&Bounds::around([Vec3::ONE])).is_none());
        assert!(VisibilityGrid::over(&Bounds::EMPTY).is_none());
    }
}
