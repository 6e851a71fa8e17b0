//! Tables of the basis for the strata of a hemisphere and for the borders between them.
//!
//! The strata of the concentric map have equal shares of the disk, so that a coefficient of N × N radiances
//! is
//!
//!   λ_k = ∫ L Z_k cos θ dω ≈ π/N² Σ_c L_c Z̄_kc
//!
//! with Z̄_kc the mean of Z_k over stratum c. A mean has less noise than the value at the traced direction;
//! its cost is that the highest degrees are damped: by 3 % at degree 6 and N = 64, by a tenth at N = 32.

use super::zernike::{DEGREE_MAX, count, values_higher};
use crate::cache::hemisphere::SIDE_MAX;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::warp::concentric_disk;

/// Points along a side of a stratum for its mean.
const POINTS: usize = 8;

/// Pieces of a border.
const PIECES: usize = 8;

/// Tables for N × N strata and functions up to a degree.
#[derive(Clone, Copy, Debug)]
pub struct StrataTables<'m> {
    n: usize,
    degree: usize,
    /// Means over each stratum of the functions up to the degree.
    means: &'m [[f32; 16]],
    /// For each row of strata the borders to the next column, then those to the next row: means along the
    /// border of the functions up to one degree more.
    border_means: &'m [[f32; 16]],
    /// Integral ∮ z ν ds along the border, ν the normal towards the stratum with the smaller number.
    border_normals: &'m [[f32; 2]],
}

/// Registers of sixteen that hold all functions up to `degree`.
pub(super) const fn groups(degree: usize) -> usize {
    count(degree).div_ceil(16)
}

/// Number of borders between n × n strata.
const fn borders(n: usize) -> usize {
    2 * n * n.saturating_sub(1)
}

impl<'m> StrataTables<'m> {
    /// Footprint of the tables for n × n strata and functions up to `degree`.
    pub fn footprint(n: usize, degree: usize) -> Footprint {
        let (n, degree) = (n.min(SIDE_MAX), degree.min(DEGREE_MAX));
        Footprint::default()
            .slice::<[f32; 16]>(n * n * groups(degree))
            .slice::<[f32; 16]>(borders(n) * groups(degree + 1))
            .slice::<[f32; 2]>(borders(n))
    }

    /// Builds the tables.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than the footprint, n is not in 1 ..= [`SIDE_MAX`], or the
    /// degree exceeds [`DEGREE_MAX`].
    pub fn build(n: usize, degree: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        if !(1..=SIDE_MAX).contains(&n) || degree > DEGREE_MAX {
            return Err(OutOfMemory { needed: usize::MAX, available: arena.available() });
        }
        let means: &mut [[f32; 16]] = arena.slice(n * n * groups(degree))?;
        let border_means: &mut [[f32; 16]] = arena.slice(borders(n) * groups(degree + 1))?;
        let border_normals: &mut [[f32; 2]] = arena.slice(borders(n))?;
        let side = 1.0 / (n * POINTS) as f32;
        for (c, row) in means.chunks_exact_mut(groups(degree)).enumerate() {
            let (first, second) = (POINTS * (c % n), POINTS * (c / n));
            let points = (0..POINTS * POINTS).map(|p| {
                let at = [(first, p % POINTS), (second, p / POINTS)];
                concentric_disk(at.map(|(start, p)| ((start + p) as f32 + 0.5) * side)).to_array()
            });
            mean(degree, points, row);
        }
        let tables = border_means.chunks_exact_mut(groups(degree + 1)).zip(border_normals.iter_mut());
        for (ends, (row, normal)) in border_ends(n).zip(tables) {
            let along = |piece: f32| {
                let at = |k: usize| {
                    let (from, to) = (ends[0][k] as f32, ends[1][k] as f32);
                    (from + (to - from) * piece) / n as f32
                };
                [at(0), at(1)]
            };
            let points =
                (0..PIECES).map(|p| concentric_disk(along((p as f32 + 0.5) / PIECES as f32)).to_array());
            mean(degree + 1, points, row);
            *normal = [0.0; 2];
            for p in 0..PIECES {
                let [a, b, q] = [p as f32, p as f32 + 1.0, p as f32 + 0.5]
                    .map(|p| concentric_disk(along(p / PIECES as f32)));
                // z ν ds = z (w × dw), a polynomial in q since z dz = -q·dq.
                let (step, z2) = (b - a, 1.0 - q.length_squared());
                let inwards = q.dot(step);
                normal[0] -= q.y * inwards + z2 * step.y;
                normal[1] += q.x * inwards + z2 * step.x;
            }
        }
        Ok(Self { n, degree, means, border_means, border_normals })
    }

    /// Number of strata along a side.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Degree of the representation.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Means of the functions over each stratum, [`groups`] registers each.
    pub(super) fn means(&self) -> &'m [[f32; 16]] {
        self.means
    }

    /// Borders of one row of strata: means of the functions, and normals.
    pub(super) fn borders_of_row(&self, i: usize) -> (&'m [[f32; 16]], &'m [[f32; 2]]) {
        let (groups, each) = (groups(self.degree + 1), 2 * self.n - 1);
        let (first, end) = (i * each, ((i + 1) * each).min(borders(self.n)));
        let means = self.border_means.get(first * groups..end * groups).unwrap_or_default();
        (means, self.border_normals.get(first..end).unwrap_or_default())
    }
}

/// Corners of all borders in the order of the tables, counter-clockwise around the first of both strata.
fn border_ends(n: usize) -> impl Iterator<Item = [[usize; 2]; 2]> {
    (0..n).flat_map(move |i| {
        let to_column = (0..n - 1).map(move |j| [[j + 1, i], [j + 1, i + 1]]);
        let to_row = (0..if i + 1 < n { n } else { 0 }).map(move |j| [[j + 1, i + 1], [j, i + 1]]);
        to_column.chain(to_row)
    })
}

/// Means of the functions up to `degree` over `points`, into the registers of a row.
fn mean(degree: usize, points: impl ExactSizeIterator<Item = [f32; 2]>, row: &mut [[f32; 16]]) {
    let share = 1.0 / points.len() as f32;
    let entries = row.as_flattened_mut();
    entries.fill(0.0);
    for q in points {
        for (entry, value) in entries.iter_mut().zip(values_higher(degree, q)) {
            *entry += value * share;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::skies::with_strata;
    use crate::memory::Line;
    use core::f64::consts::PI;
    use std::vec;

    #[test]
    fn the_footprint_is_exact() {
        for (n, degree) in [(1, 0), (2, 3), (17, 8), (32, 6)] {
            let mut lines = vec![Line([0; 64]); StrataTables::footprint(n, degree).bytes() / 64];
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
            let short = bytes.len() - 1;
            assert!(StrataTables::build(n, degree, &mut Arena::new(bytes)).is_ok());
            assert!(StrataTables::build(n, degree, &mut Arena::new(&mut bytes[..short])).is_err());
        }
        for (n, degree) in [(0, 2), (SIDE_MAX + 1, 2), (4, DEGREE_MAX + 1), (usize::MAX, usize::MAX)] {
            let mut lines = vec![Line([0; 64]); 1024];
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
            assert!(StrataTables::build(n, degree, &mut Arena::new(bytes)).is_err());
        }
    }

    /// Damping of the highest function by its mean over a stratum: .67, .90, .97 of its norm.
    #[test]
    fn means_are_orthonormal_to_the_resolution_of_the_strata() {
        for (n, least) in [(16, 0.66), (32, 0.89), (64, 0.965)] {
            with_strata(n, 6, |tables| {
                let mut norms = [0.0f64; 32];
                for row in tables.means().as_flattened().chunks_exact(32) {
                    for (norm, value) in norms.iter_mut().zip(row) {
                        *norm += f64::from(*value).powi(2) * PI / (n * n) as f64;
                    }
                }
                let worst = norms[..count(6)].iter().copied().fold(f64::INFINITY, f64::min);
                assert!((least..least + 0.03).contains(&worst), "{n}: {worst}");
                assert!((norms[0] - 1.0).abs() < 1e-5 && norms[count(6)..] == [0.0; 4]);
            });
        }
    }

    /// Reynolds' theorem at distance 1: ∮ z ν ds = 3 ∫ q dx dy over a stratum. Its sides on the rim of the
    /// disk lie in the horizon, where z is zero.
    #[test]
    fn borders_around_a_stratum_are_its_first_moment() {
        const N: usize = 32;
        /// Eight chords for a border, relative to the moment.
        const CHORDS: f32 = 3e-3;
        with_strata(N, 2, |tables| {
            let mut sums = [[0.0f32; 2]; N * N];
            for i in 0..N {
                let (_, normals) = tables.borders_of_row(i);
                for (at, normal) in normals.iter().enumerate() {
                    let (here, next) = if at < N - 1 { (at, at + 1) } else { (at + 1 - N, at + 1) };
                    for (stratum, sign) in [(i * N + here, 1.0), (i * N + next, -1.0)] {
                        let sum = &mut sums[stratum];
                        *sum = [sum[0] + sign * normal[0], sum[1] + sign * normal[1]];
                    }
                }
            }
            for (sum, row) in sums.iter().zip(tables.means()) {
                // Z_{1,∓1} = 2/√π {y, x}.
                let moment = [row[2], row[1]].map(|mean| 1.5 * PI.powf(1.5) as f32 / (N * N) as f32 * mean);
                let off = (sum[0] - moment[0]).hypot(sum[1] - moment[1]);
                assert!(off < CHORDS * moment[0].hypot(moment[1]), "{sum:?} {moment:?}");
            }
        });
    }
}
