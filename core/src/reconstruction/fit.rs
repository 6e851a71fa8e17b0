//! Weighted least squares of the clusters of one block: a polynomial of each half and channel, times the
//! albedo where that varies within the cluster (as the block-wise regressions of Koskela et al. 2019).
//!
//! The plain algorithm: for each cluster sum the products of all terms over its whole pixels, and those of
//! terms and values, then solve. Departures:
//! 1. Products of terms are products of powers of x and y. Along a run of pixels of one row, y is constant
//!    and the sums of powers of x are differences of a table.
//! 2. A ridge on all terms but the constant keeps masks of few pixels, or of pixels in a line, solvable.

use super::surfaces::{NO_CLUSTER, PixelSurfaces};
use super::window::{EXPONENTS, MOST_TERMS, POWERS, Window, terms};
use super::{Both, VALUES};

/// Ridge in units of the mean diagonal.
const RIDGE: f64 = 1e-5;

/// Range of the albedo in units of its maximum above which the fit is of light over albedo.
const TEXTURED: f32 = 0.02;

/// Added to the albedo, for the light that a dark surface reflects without its colour.
const ALBEDO_OFFSET: f32 = 0.02;

/// Least part of the window that a cluster fills.
const LEAST_FILL: f64 = 0.02;

/// A fit needs at least this number of pixels for each term.
const PIXELS_PER_TERM: u32 = 2;

/// Sums of products of powers of x and y.
type Gram = [[f64; POWERS]; POWERS];

/// Values, features and size of a picture, row by row.
#[derive(Clone, Copy)]
pub(super) struct View<'p> {
    pub width: usize,
    pub height: usize,
    /// Both halves.
    pub values: &'p [Both],
    pub surfaces: &'p [PixelSurfaces],
    /// Cluster of whole pixels, [`NO_CLUSTER`] of mixed ones.
    pub whole: &'p [u32],
}

/// Pixels on each side of [`View::around`].
const AROUND: usize = 2;

/// Most pixels of [`View::around`].
pub(super) const MOST_AROUND: usize = (2 * AROUND + 1) * (2 * AROUND + 1) - 1;

impl View<'_> {
    /// Indices of the pixels of the 5 × 5 around a pixel, without itself.
    pub(super) fn around(&self, [x, y]: [usize; 2]) -> impl Iterator<Item = usize> {
        let (width, own) = (self.width, y * self.width + x);
        let columns = x.saturating_sub(AROUND)..(x + AROUND + 1).min(width);
        let rows = y.saturating_sub(AROUND)..(y + AROUND + 1).min(self.height);
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
            .filter(move |other| *other != own)
    }
}

/// Polynomial of a cluster in a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub coefficients: [Both; MOST_TERMS],
    /// Mean albedo where the fit is of light over albedo, else zero.
    pub albedo: [f32; 3],
    /// Range of the light of its pixels.
    pub range: [Both; 2],
}

/// Albedo by which light of a textured cluster is divided.
#[inline]
pub(super) fn divisor(albedo: [f32; 3]) -> [f32; 3] {
    albedo.map(|albedo| albedo.max(0.0) + ALBEDO_OFFSET)
}

/// Sums over the pixels of a cluster.
#[derive(Clone, Copy)]
struct Moments {
    cluster: u32,
    pixels: u32,
    squares: f64,
    gram: Gram,
    sums: [Both; MOST_TERMS],
    low: [f32; 3],
    high: [f32; 3],
    range: [Both; 2],
}

impl Moments {
    const EMPTY: Self = Self {
        cluster: NO_CLUSTER,
        pixels: 0,
        squares: 0.0,
        gram: [[0.0; POWERS]; POWERS],
        sums: [[0.0; VALUES]; MOST_TERMS],
        low: [f32::INFINITY; 3],
        high: [0.0; 3],
        range: [[f32::INFINITY; VALUES], [0.0; VALUES]],
    };

    /// True if the pixels determine `terms` terms.
    fn suffice(&self, terms: usize, window: &Window) -> bool {
        let total = self.gram[0][0];
        self.pixels >= PIXELS_PER_TERM * terms as u32
            && total * total >= (terms + 1) as f64 * self.squares
            && total > LEAST_FILL * window.total()
    }

    fn is_textured(&self) -> bool {
        (0..3).any(|c| self.high[c] - self.low[c] > TEXTURED * self.high[c])
    }
}

/// Block number `block` across and down, and its window.
#[derive(Clone, Copy)]
pub(super) struct Block<'w> {
    pub window: &'w Window,
    pub block: [usize; 2],
}

/// Pixels of one cluster in a row: row, columns within the picture, row and first column in the block.
#[derive(Clone, Copy)]
struct Run {
    y: usize,
    columns: [usize; 2],
    row: usize,
    column: usize,
    cluster: u32,
}

impl Block<'_> {
    /// First pixel and end along an axis of `size` pixels, and position of that pixel in the block.
    fn extent(&self, axis: usize, size: usize) -> (usize, usize, usize) {
        let step = self.window.step();
        let first = self.block[axis] * step;
        let (begin, skipped) = if first >= step { (first - step, 0) } else { (0, step - first) };
        (begin, (first + step).min(size), skipped)
    }

    /// Runs of whole pixels of one cluster.
    fn for_runs(&self, view: &View, mut work: impl FnMut(Run)) {
        let (top, bottom, above) = self.extent(1, view.height);
        let (left, right, before) = self.extent(0, view.width);
        for y in top..bottom {
            let row = &view.whole[y * view.width..(y + 1) * view.width];
            let mut x = left;
            while x < right {
                let cluster = row[x];
                let end = (x + 1..right).find(|x| row[*x] != cluster).unwrap_or(right);
                if cluster != NO_CLUSTER {
                    work(Run {
                        y,
                        columns: [x, end],
                        row: y - top + above,
                        column: x - left + before,
                        cluster,
                    });
                }
                x = end;
            }
        }
    }

    /// Fits the clusters of the block, as many as `clusters` has room for; [`NO_CLUSTER`] in those without a
    /// fit.
    pub(super) fn fit(&self, view: &View, clusters: &mut [u32], write: impl FnMut(usize, Fit)) {
        match self.window.degree {
            0 => self.fit_degree::<1>(view, clusters, write),
            1 => self.fit_degree::<3>(view, clusters, write),
            _ => self.fit_degree::<6>(view, clusters, write),
        }
    }

    fn fit_degree<const TERMS: usize>(
        &self,
        view: &View,
        clusters: &mut [u32],
        mut write: impl FnMut(usize, Fit),
    ) {
        const MOST_CLUSTERS: usize = 8;
        let mut found = [Moments::EMPTY; MOST_CLUSTERS];
        let found = &mut found[..clusters.len().min(MOST_CLUSTERS)];
        self.for_runs(view, |run| {
            let slot = found.iter_mut().find(|m| m.cluster == run.cluster || m.cluster == NO_CLUSTER);
            if let Some(moments) = slot {
                moments.cluster = run.cluster;
                self.add::<TERMS>(view, run, moments);
            }
        });
        for (slot, (cluster, moments)) in clusters.iter_mut().zip(&*found).enumerate() {
            *cluster = NO_CLUSTER;
            if moments.cluster == NO_CLUSTER || !moments.suffice(TERMS, self.window) {
                continue;
            }
            let fit = match TERMS > 1 && moments.is_textured() {
                true => self.fit_textured::<TERMS>(view, moments),
                false => {
                    let coefficients = solve::<TERMS, VALUES>(&moments.gram, &moments.sums);
                    coefficients.map(|coefficients| Fit {
                        coefficients,
                        albedo: [0.0; 3],
                        range: moments.range,
                    })
                }
            };
            let Some(fit) = fit else { continue };
            *cluster = moments.cluster;
            write(slot, fit);
        }
    }

    fn add<const TERMS: usize>(&self, view: &View, run: Run, moments: &mut Moments) {
        let Window { weights, coordinates, moments: table, squares, .. } = self.window;
        let [first, end] = run.columns;
        let of_row = run.y * view.width;
        // Sums over the row of the values times powers of x.
        let mut sums = [[0.0f32; VALUES]; 3];
        let [mut low, mut high] = moments.range;
        let values = &view.values[of_row + first..of_row + end];
        let window = weights[run.column..].iter().zip(&coordinates[run.column..]);
        for (value, (weight, x)) in values.iter().zip(window) {
            for c in 0..VALUES {
                low[c] = low[c].min(value[c]);
                high[c] = high[c].max(value[c]);
                let z = weight * value[c];
                sums[0][c] += z;
                if TERMS > 1 {
                    sums[1][c] += x * z;
                }
                if TERMS > 3 {
                    sums[2][c] += x * (x * z);
                }
            }
        }
        if TERMS > 1 {
            for surfaces in &view.surfaces[of_row + first..of_row + end] {
                for c in 0..3 {
                    moments.low[c] = moments.low[c].min(surfaces.albedo[c]);
                    moments.high[c] = moments.high[c].max(surfaces.albedo[c]);
                }
            }
        }
        moments.range = [low, high];
        let last = run.column + end - first;
        let powers: [f64; POWERS] = core::array::from_fn(|k| table[last][k] - table[run.column][k]);
        let weight = weights[run.row];
        moments.pixels += (end - first) as u32;
        moments.squares += f64::from(weight * weight) * (squares[last] - squares[run.column]);
        add_row::<TERMS>((weight, coordinates[run.row]), &powers, &mut moments.gram);
        add_values::<TERMS, VALUES>((weight, coordinates[run.row]), &sums, &mut moments.sums);
    }

    /// Fit of light over albedo: the least squares of light on the terms times the albedo.
    fn fit_textured<const TERMS: usize>(&self, view: &View, moments: &Moments) -> Option<Fit> {
        let Window { weights, coordinates, .. } = self.window;
        let mut gram = [[[0.0; POWERS]; POWERS]; 3];
        let mut sums = [[[0.0f32; 2]; MOST_TERMS]; 3];
        let (mut total, mut mean) = (0.0, [0.0f32; 3]);
        self.for_runs(view, |run| {
            if run.cluster != moments.cluster {
                return;
            }
            let row = (weights[run.row], coordinates[run.row]);
            let mut powers = [[0.0f64; POWERS]; 3];
            let mut of_row = [[[0.0f32; 2]; 3]; 3];
            for (i, x) in (run.columns[0]..run.columns[1]).enumerate() {
                let (weight, u) = (weights[run.column + i], coordinates[run.column + i]);
                let pixel = run.y * view.width + x;
                let albedo = view.surfaces[pixel].albedo;
                let by = divisor(albedo);
                total += row.0 * weight;
                for c in 0..3 {
                    mean[c] += row.0 * weight * albedo[c];
                    let (light, square) = (weight * by[c], weight * by[c] * by[c]);
                    let mut power = f64::from(square);
                    powers[c].iter_mut().for_each(|sum| {
                        *sum += power;
                        power *= f64::from(u);
                    });
                    let [constant, linear, square] = &mut of_row[c];
                    for half in 0..2 {
                        let z = light * view.values[pixel][3 * half + c];
                        constant[half] += z;
                        linear[half] += u * z;
                        square[half] += u * u * z;
                    }
                }
            }
            for c in 0..3 {
                add_row::<TERMS>(row, &powers[c], &mut gram[c]);
                add_values::<TERMS, 2>(row, &of_row[c], &mut sums[c]);
            }
        });
        let mut coefficients = [[0.0; VALUES]; MOST_TERMS];
        for c in 0..3 {
            let solved = solve::<TERMS, 2>(&gram[c], &sums[c])?;
            for (coefficient, solved) in coefficients.iter_mut().zip(solved) {
                (coefficient[c], coefficient[3 + c]) = (solved[0], solved[1]);
            }
        }
        let albedo = mean.map(|sum| (sum / total).max(f32::MIN_POSITIVE));
        Some(Fit { coefficients, albedo, range: moments.range })
    }
}

/// Adds a row of the given weight and y: sums of powers of x.
fn add_row<const TERMS: usize>((weight, y): (f32, f32), powers: &[f64; POWERS], gram: &mut Gram) {
    let most = match TERMS {
        1 => 1,
        3 => 3,
        _ => POWERS,
    };
    let mut power = f64::from(weight);
    for b in 0..most {
        for (column, sum) in gram.iter_mut().zip(powers).take(most - b) {
            column[b] += power * sum;
        }
        power *= f64::from(y);
    }
}

/// Adds a row of the given weight and y: sums of values times powers of x.
fn add_values<const TERMS: usize, const N: usize>(
    (weight, y): (f32, f32),
    sums: &[[f32; N]; 3],
    to: &mut [[f32; N]; MOST_TERMS],
) {
    let powers = [weight, weight * y, weight * y * y];
    for (term, to) in to.iter_mut().enumerate().take(TERMS) {
        let (a, b) = EXPONENTS[term];
        for c in 0..N {
            to[c] += powers[b] * sums[a][c];
        }
    }
}

/// Solution by Cholesky's decomposition; `None` where the matrix is not positive.
fn solve<const TERMS: usize, const N: usize>(
    gram: &Gram,
    sums: &[[f32; N]; MOST_TERMS],
) -> Option<[[f32; N]; MOST_TERMS]> {
    debug_assert!(terms(2) == MOST_TERMS);
    let mut lower = [[0.0f64; TERMS]; TERMS];
    let mut trace = 0.0;
    for i in 0..TERMS {
        for j in 0..=i {
            let ((a, b), (c, d)) = (EXPONENTS[i], EXPONENTS[j]);
            lower[i][j] = gram[a + c][b + d];
        }
        trace += lower[i][i];
    }
    for (i, row) in lower.iter_mut().enumerate().skip(1) {
        row[i] += RIDGE * trace / TERMS as f64;
    }
    for i in 0..TERMS {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            let rest = lower[i][j] - dot;
            if i == j {
                if !(rest > 0.0 && rest.is_finite()) {
                    return None;
                }
                lower[i][i] = libm::sqrt(rest);
            } else {
                lower[i][j] = rest / lower[j][j];
            }
        }
    }
    let mut solved = [[0.0f32; N]; MOST_TERMS];
    for c in 0..N {
        let mut x = [0.0f64; TERMS];
        for i in 0..TERMS {
            let dot: f64 = (0..i).map(|k| lower[i][k] * x[k]).sum();
            x[i] = (f64::from(sums[i][c]) - dot) / lower[i][i];
        }
        for i in (0..TERMS).rev() {
            let dot: f64 = (i + 1..TERMS).map(|k| lower[k][i] * x[k]).sum();
            x[i] = (x[i] - dot) / lower[i][i];
            solved[i][c] = x[i] as f32;
        }
    }
    Some(solved)
}
