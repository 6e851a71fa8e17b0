//! Piecewise constant density over the unit square, by weights on a grid: a row is chosen by its sum, then a
//! cell of the row. Cumulative sums are 32-bit integers, so that the density is exactly that of the samples.
//! A coarse index into each (Chen and Asau 1974) gives the start of the search, so that a sample reads two or
//! three cache lines at any size of the grid.

use crate::memory::{Arena, Footprint, OutOfMemory};

/// Probabilities of cells, in memory of the arena.
#[derive(Clone, Copy, Debug)]
pub struct Distribution2d<'m> {
    width: usize,
    height: usize,
    /// Ends of the cells of each row, in 2^-32 of the row; the last end is `u32::MAX`.
    cells: &'m [u32],
    /// Ends of the rows.
    rows: &'m [u32],
    /// For each row an index of its cells: see [`index`].
    cell_index: &'m [u32],
    /// Index of the rows.
    row_index: &'m [u32],
}

/// Bins per entry of an index.
const BINS_PER_ENTRY: usize = 8;

/// Sampled cell and position in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// Position in the cell, [0, 1)².
    pub offset: [f32; 2],
    /// Density over the unit square; its integral is 1.
    pub pdf: f32,
}

impl<'m> Distribution2d<'m> {
    /// Bytes that [`Distribution2d::build`] takes.
    pub fn footprint(width: usize, height: usize) -> Footprint {
        Footprint::default()
            .slice::<u32>(width.saturating_mul(height))
            .slice::<u32>(height)
            .slice::<u32>(entries(width).saturating_mul(height))
            .slice::<u32>(entries(height))
    }

    /// Distribution by `weight(x, y)`, called once for each cell. Weights that are negative or not finite
    /// count as zero; if all are zero, the distribution is uniform.
    pub fn build(
        width: usize,
        height: usize,
        mut weight: impl FnMut(usize, usize) -> f32,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let cells: &mut [u32] = arena.slice(width.saturating_mul(height))?;
        let rows: &mut [u32] = arena.slice(height)?;
        if width > 0 {
            for (y, (row, sum)) in cells.chunks_exact_mut(width).zip(rows.iter_mut()).enumerate() {
                for (x, cell) in row.iter_mut().enumerate() {
                    let w = weight(x, y);
                    *cell = if w > 0.0 && w.is_finite() { w } else { 0.0 }.to_bits();
                }
                *sum = ((accumulate(row) / width as f64) as f32).to_bits();
            }
        }
        accumulate(rows);
        let cell_index: &mut [u32] = arena.slice(entries(width).saturating_mul(height))?;
        let row_index: &mut [u32] = arena.slice(entries(height))?;
        if width > 0 {
            for (row, places) in cells.chunks_exact(width).zip(cell_index.chunks_exact_mut(entries(width))) {
                index(row, places);
            }
        }
        index(rows, row_index);
        Ok(Self { width, height, cells, rows, cell_index, row_index })
    }

    /// Samples the cell at `u`, monotonically in both coordinates. `None` without cells.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<Cell> {
        let (y, v, row_probability) = pick(self.rows, self.row_index, u[1])?;
        let first = y * entries(self.width);
        let cell_index = self.cell_index.get(first..first + entries(self.width))?;
        let (x, u, cell_probability) = pick(self.row(y), cell_index, u[0])?;
        let pdf = row_probability * cell_probability * (self.width as f32 * self.height as f32);
        Some(Cell { x: x as u32, y: y as u32, offset: [u, v], pdf })
    }

    /// Density over the unit square in cell (x, y); zero outside.
    #[inline]
    pub fn pdf(&self, x: usize, y: usize) -> f32 {
        let probability = probability(self.rows, y) * probability(self.row(y), x);
        probability * (self.width as f32 * self.height as f32)
    }

    /// Density over the unit square at a point of [0, 1]².
    #[inline]
    pub fn pdf_at(&self, [u, v]: [f32; 2]) -> f32 {
        let cell = |x: f32, count: usize| ((x * count as f32) as usize).min(count.saturating_sub(1));
        self.pdf(cell(u, self.width), cell(v, self.height))
    }

    /// Inverse of [`Distribution2d::sample`]: the `u` of a point of [0, 1]², and the density there. `None` if
    /// the density is zero.
    #[inline]
    pub fn invert(&self, [x, y]: [f32; 2]) -> Option<([f32; 2], f32)> {
        let (y, v, row_probability) = unpick(self.rows, y * self.height as f32)?;
        let (_, u, cell_probability) = unpick(self.row(y), x * self.width as f32)?;
        Some(([u, v], row_probability * cell_probability * (self.width as f32 * self.height as f32)))
    }

    /// Edge lengths of a cell in the unit square.
    #[inline]
    pub fn cell_size(&self) -> [f32; 2] {
        [1.0 / self.width as f32, 1.0 / self.height as f32]
    }

    #[inline]
    fn row(&self, y: usize) -> &[u32] {
        let start = y * self.width;
        self.cells.get(start..start + self.width).unwrap_or(&[])
    }
}

/// Converts weights (as bits of floats) to cumulative sums in units of 2^-32 of their total. Returns the
/// total.
fn accumulate(weights: &mut [u32]) -> f64 {
    let total: f64 = weights.iter().map(|&w| f64::from(f32::from_bits(w))).sum();
    let scale = if total > 0.0 { 4_294_967_296.0 / total } else { 4_294_967_296.0 / weights.len() as f64 };
    let mut sum = 0.0;
    let mut last_with_weight = weights.len().saturating_sub(1);
    for (i, w) in weights.iter_mut().enumerate() {
        let weight = if total > 0.0 { f64::from(f32::from_bits(*w)) } else { 1.0 };
        if weight > 0.0 {
            last_with_weight = i;
        }
        sum += weight;
        *w = (sum * scale + 0.5) as u32;
    }
    // The last cell with weight takes the remainder of rounding. Casts have saturated the other ends.
    for w in weights.iter_mut().skip(last_with_weight) {
        *w = u32::MAX;
    }
    total
}

/// Number of entries of an index of `bins` bins.
const fn entries(bins: usize) -> usize {
    bins.div_ceil(BINS_PER_ENTRY)
}

/// Fills `places`: entry e of n is the first bin whose end is beyond e/n of the total.
fn index(ends: &[u32], places: &mut [u32]) {
    let mut bin = 0;
    let count = places.len() as u64;
    for (entry, place) in places.iter_mut().enumerate() {
        let start = ((entry as u64) << 32).div_ceil(count);
        while ends.get(bin).is_some_and(|&end| u64::from(end) <= start) && bin + 1 < ends.len() {
            bin += 1;
        }
        *place = bin as u32;
    }
}

/// Start and end of bin `i`; the end of the last bin is 2^32.
#[inline]
fn interval(ends: &[u32], i: usize) -> Option<(u64, u64)> {
    let end = *ends.get(i)?;
    let start = if i == 0 { 0 } else { ends[i - 1] };
    let whole = |end: u32| if end == u32::MAX { 1 << 32 } else { u64::from(end) };
    Some((whole(start), whole(end)))
}

#[inline]
fn probability(ends: &[u32], i: usize) -> f32 {
    interval(ends, i).map_or(0.0, |(start, end)| (end - start) as f32 / 4_294_967_296.0)
}

/// Bin at position `x` in units of bins, the `u` of [`pick`] for that position, and the probability of the
/// bin.
#[inline]
fn unpick(ends: &[u32], x: f32) -> Option<(usize, f32, f32)> {
    let i = (x as usize).min(ends.len().saturating_sub(1));
    let (start, end) = interval(ends, i)?;
    let width = (end - start) as f32;
    let u = (start as f32 + (x - i as f32) * width) / 4_294_967_296.0;
    (width > 0.0).then_some((i, u.min(super::ONE_MINUS_EPSILON), width / 4_294_967_296.0))
}

/// Bin at `u`, position in it, and its probability.
#[inline]
fn pick(ends: &[u32], places: &[u32], u: f32) -> Option<(usize, f32, f32)> {
    // 24 bits of u: at most 2^32 - 256, below the last end.
    let target = (u.clamp(0.0, super::ONE_MINUS_EPSILON) * 4_294_967_296.0) as u32;
    let entry = ((u64::from(target) * places.len() as u64) >> 32) as usize;
    let first = *places.get(entry)? as usize;
    let last = places.get(entry + 1).map_or(ends.len(), |&place| place as usize + 1);
    let i = first + ends.get(first..last)?.partition_point(|&end| end <= target);
    let (start, end) = interval(ends, i)?;
    let width = (end - start) as f32;
    let offset = (u64::from(target) - start) as f32 / width;
    Some((i, offset.min(super::ONE_MINUS_EPSILON), width / 4_294_967_296.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Line;
    use crate::sampling::Random;

    #[test]
    fn inverting_undoes_sampling() {
        let (width, height) = (13, 7);
        let bytes = Distribution2d::footprint(width, height).bytes();
        let mut lines = std::vec![Line([0; 64]); bytes / 64];
        let mut arena = Arena::over(&mut lines);
        // A row of zeros, and cells of zero in the other rows.
        let weight = |x: usize, y: usize| if y == 3 { 0.0 } else { (x * y % 5) as f32 };
        let distribution =
            Distribution2d::build(width, height, weight, &mut arena).expect("it is the footprint");
        let random = Random::new(3, 0);
        for i in 0..1000 {
            let u = [random.single(2 * i), random.single(2 * i + 1)];
            let cell = distribution.sample(u).expect("there are cells");
            let at = [(cell.x as f32 + cell.offset[0]) / 13.0, (cell.y as f32 + cell.offset[1]) / 7.0];
            let (back, pdf) = distribution.invert(at).expect("it was sampled");
            let near = |a: f32, b: f32| (a - b).abs() < 1e-4;
            // At a border rounding may lead to the neighbouring cell, which has another density.
            let inside = cell.offset.iter().all(|x| (0.001..0.999).contains(x));
            assert!(!inside || near(back[0], u[0]) && near(back[1], u[1]), "{u:?} {back:?}");
            assert!(!inside || near(pdf, cell.pdf), "{u:?} {pdf} {}", cell.pdf);
        }
        assert!(distribution.invert([0.5, 3.5 / 7.0]).is_none(), "a row of nothing");
    }
}
