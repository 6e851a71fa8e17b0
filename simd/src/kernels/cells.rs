//! Derivatives of irradiance from the borders between the strata of a hemisphere (stratum-border
//! derivatives).
//!
//! A border between two neighbours of radiance L₁ and L₂ at inverse distance u contributes (L₁ - L₂) times
//! its derivatives at distance 1, with a factor u for the gradient and u² for the Hessian. Tables hold the
//! derivatives at distance 1, so that sixteen borders are a load and a few products; the sums are those of
//! [`super::jumps`]. The cost: a copy of each row of strata, channel by channel.

use super::edge::Flux;
use super::jumps::{Lanes16, Row, SIDE_MAX, Sums, sixteen};
use crate::lanes::{Lanes, Simd};
use crate::level::{Kernel, Level};

/// Derivatives of sixteen borders at distance 1: gradient x and y, rotation x and y, Hessian xx, xy, yy.
pub type Borders = [[f32; 16]; 7];

/// Two inverse distances that differ by less than this factor belong to one surface, and their border lies
/// between them. Otherwise the nearer surface ends at the border.
pub const SAME_SURFACE: f32 = 1.6;

/// Inverse distance of the border between two strata.
#[inline(always)]
pub fn between<L: Lanes>(all: impl Fn(f32) -> L, u: L, v: L) -> L {
    let (near, far) = (u.max(v), u.min(v));
    (all(0.5) * (near + far)).select(near.lt(all(SAME_SURFACE) * far), near)
}

/// Strata of n × n, row by row, with the tables of their borders. For each row and each sixteen of its
/// columns there are two tables, of the borders to the next column and of those to the next row. Entries
/// without a neighbour are zero.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a> {
    /// Strata along a side, at most [`SIDE_MAX`].
    pub n: usize,
    /// Radiance.
    pub radiance: &'a [[f32; 3]],
    /// 1/distance.
    pub inverse_distance: &'a [f32],
    /// 2 n ⌈n/16⌉ tables.
    pub borders: &'a [Borders],
}

impl Cells<'_> {
    /// Sums of derivatives; data missing from short slices contributes zero.
    pub fn sums(self, level: Level) -> Sums {
        level.dispatch(self)
    }

    /// Scalar reference, border by border. Equals [`Cells::sums`] except for the order of the sums.
    pub fn reference(self) -> Sums {
        let (n, mut sums) = (self.n.min(SIDE_MAX), Sums::default());
        for (chunk, tables) in self.borders.chunks_exact(2).enumerate() {
            let (i, first) = (chunk / n.div_ceil(16), 16 * (chunk % n.div_ceil(16)));
            for lane in 0..16.min(n.saturating_sub(first)) {
                let at = i * n + first + lane;
                for (table, next) in tables.iter().zip([at + 1, at + n]) {
                    let cell = |at: usize| Some((*self.radiance.get(at)?, *self.inverse_distance.get(at)?));
                    let (Some((here, u)), Some((there, v))) = (cell(at), cell(next)) else { continue };
                    let u = between(|x| x, u, v);
                    let [gx, gy, rx, ry, xx, xy, yy] = table.map(|row| row[lane]);
                    let flux = Flux {
                        gradient: [u * gx, u * gy],
                        rotation: [rx, ry],
                        hessian: [u * u * xx, u * u * xy, u * u * yy],
                    };
                    sums.add([here[0] - there[0], here[1] - there[1], here[2] - there[2]], &flux);
                }
            }
        }
        sums
    }

    /// Copies row `i`, channel by channel: red, green, blue, inverse distance.
    #[inline(always)]
    fn row(&self, i: usize, row: &mut [Row; 4]) {
        let [r, g, b, u] = row;
        let strata = self.radiance.iter().zip(self.inverse_distance).skip(i * self.n).take(self.n);
        for (j, (radiance, inverse)) in (1..=SIDE_MAX).zip(strata) {
            [r[j], g[j], b[j]] = *radiance;
            u[j] = *inverse;
        }
    }
}

impl Kernel for Cells<'_> {
    type Out = Sums;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Sums {
        let mut sums = Lanes16::new(simd.splat16(0.0));
        let n = self.n.min(SIDE_MAX);
        let chunks = n.div_ceil(16);
        let (mut here, mut next) = ([[0.0; SIDE_MAX + 32]; 4], [[0.0; SIDE_MAX + 32]; 4]);
        self.row(0, &mut here);
        for (i, tables) in self.borders.chunks_exact((2 * chunks).max(1)).take(n).enumerate() {
            self.row(i + 1, &mut next);
            for (chunk, pair) in tables.chunks_exact(2).enumerate() {
                let [right, below] = pair else { continue };
                let at = 1 + 16 * chunk;
                border(simd, &mut sums, right, [&here, &here], [at, at + 1]);
                border(simd, &mut sums, below, [&here, &next], [at, at]);
            }
            core::mem::swap(&mut here, &mut next);
        }
        sums.total()
    }
}

/// Adds sixteen borders between strata of two rows.
#[inline(always)]
fn border<S: Simd>(
    simd: S,
    sums: &mut Lanes16<S::F16>,
    table: &Borders,
    [here, there]: [&[Row; 4]; 2],
    [first, second]: [usize; 2],
) {
    let all = |value: f32| simd.splat16(value);
    let [r, g, b, u] = strata(simd, here, first);
    let [s, h, c, v] = strata(simd, there, second);
    let u = between(all, u, v);
    let uu = u * u;
    let flux = Flux {
        gradient: [u * simd.load16(&table[0]), u * simd.load16(&table[1])],
        rotation: [simd.load16(&table[2]), simd.load16(&table[3])],
        hessian: [uu * simd.load16(&table[4]), uu * simd.load16(&table[5]), uu * simd.load16(&table[6])],
    };
    sums.add(all, [r - s, g - h, b - c], &flux);
}

/// Sixteen strata of a row.
#[inline(always)]
fn strata<S: Simd>(simd: S, [r, g, b, u]: &[Row; 4], start: usize) -> [S::F16; 4] {
    [
        simd.load16(sixteen(r, start)),
        simd.load16(sixteen(g, start)),
        simd.load16(sixteen(b, start)),
        simd.load16(sixteen(u, start)),
    ]
}
