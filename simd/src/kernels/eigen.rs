//! Eigen decompositions of symmetric 2×2 and 3×3 matrices, a register of them at a time.
//!
//! Plainly, of [a b; b c]: with m = (a + c)/2, d = (a - c)/2, r = √(d² + b²) the values are m ± r. Departures:
//! 1. The value of larger magnitude, m + sign(m) r, has no cancellation; the other is det/larger (Vieta), and
//!    det = ac - b² from exact products (after Kahan). The plain formula loses the smaller of values 1 : 10⁷ whole.
//! 2. All is scaled by a power of two first, so nothing overflows or is lost on the way, denormals included.
//! 3. The vector of m + r is (d + r, b) or (b, r - d), whichever has no cancellation.
//!
//! Of 3×3: cyclic Jacobi, four sweeps (Golub, Van Loan). The closed formula by angles and cross products is
//! faster and returns nonsense where two values meet.
//!
//! The price: no branch at all, so no matrix is cheaper than another; two square roots and three divisions a 2×2.
//! The smaller value of a 2×2 is to be trusted down to 1e-30 of the larger; both have at most 4 units in the last
//! place of error, values near the end of f32's range included.

use crate::lanes::{Lanes, Simd};
use crate::level::{Kernel, Level};

/// Values and vectors of a symmetric 2×2 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eigen2<L> {
    /// The eigenvalues, the one of larger magnitude first.
    pub values: [L; 2],
    /// Unit eigenvector (x, y) of the first; (-y, x) is the second's.
    pub axis: [L; 2],
}

/// Values and vectors of a symmetric 3×3 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eigen3<L> {
    /// The eigenvalues, from largest to smallest magnitude.
    pub values: [L; 3],
    /// Their unit eigenvectors.
    pub vectors: [[L; 3]; 3],
}

/// What the largest entry is scaled to: its square fits, and the squares of all that matter beside it.
const SCALED: f32 = (1u64 << 60) as f32;
/// 2⁻⁶⁰, the end of what is scaled in one step.
const SMALL: f32 = 1.0 / SCALED;
/// 2⁹⁰: makes numbers of ordinary size of those below [`SMALL`], denormals included.
const LIFT: f32 = SCALED * (1u64 << 30) as f32;
/// Off-diagonal entries below this, scaled, count as zero: less than 2⁻¹¹⁰ of the largest. What is left has
/// squares of which f32 holds every bit.
const NEGLIGIBLE: f32 = 1.0 / (1u64 << 50) as f32;

/// Powers of two that bring entries to the order of [`SCALED`], to be multiplied one after the other, and those
/// that bring them back.
#[inline(always)]
fn scales<L: Lanes>(all: impl Fn(f32) -> L, largest: L) -> ([L; 2], [L; 2]) {
    let small = largest.lt(all(SMALL));
    let lift = all(LIFT).select(small, all(1.0));
    let power = (largest * lift).max(all(SMALL)).power_of_two();
    ([lift, all(SCALED) / power], [power * all(SMALL), all(1.0 / LIFT).select(small, all(1.0))])
}

/// Decomposes [xx xy; xy yy]; `all` makes lanes of a constant. Values and axes of matrices that are not finite
/// are anything.
#[inline(always)]
pub fn symmetric2<L: Lanes>(all: impl Fn(f32) -> L + Copy, [xx, xy, yy]: [L; 3]) -> Eigen2<L> {
    let [zero, half, one] = [all(0.0), all(0.5), all(1.0)];
    let ([lift, scale], [unscale, lower]) = scales(all, xx.abs().max(xy.abs()).max(yy.abs()));
    let [a, b, c] = [xx * lift * scale, xy * lift * scale, yy * lift * scale];
    let diagonal = b.abs().lt(all(NEGLIGIBLE));
    let b = zero.select(diagonal, b);

    let (mean, difference) = (half * (a + c), half * (a - c));
    let radius = (difference * difference + b * b).sqrt();
    let negative = mean.lt(zero);
    let large = mean + (-radius).select(negative, radius);
    let ((ac, ac_rest), (bb, bb_rest)) = (a.product(c), b.product(b));
    let determinant = (ac - bb) + (ac_rest - bb_rest);
    let small = determinant / one.select(large.eq(zero), large);
    // The vector of mean + radius; where the mean is negative that is the small value's, a right angle off.
    let wide = zero.le(difference);
    let reach = difference.abs() + radius;
    let (x, y) = (reach.select(wide, b), b.select(wide, reach));
    let (x, y) = ((-y).select(negative, x), x.select(negative, y));
    let isotropic = reach.eq(zero);
    let (x, y) = (one.select(isotropic, x), zero.select(isotropic, y));
    let inverse = one / (x * x + y * y).sqrt();
    // Of a diagonal matrix the values stand there, and may be too far apart to have passed through the scale.
    let swapped = xx.abs().lt(yy.abs());
    let large = yy.select(swapped, xx).select(diagonal, large * unscale * lower);
    let small = xx.select(swapped, yy).select(diagonal, small * unscale * lower);
    Eigen2 { values: [large, small], axis: [x * inverse, y * inverse] }
}

/// Decomposes the symmetric matrix of the entries xx, xy, xz, yy, yz, zz, to 5e-7 of its largest value.
#[inline(always)]
pub fn symmetric3<L: Lanes>(all: impl Fn(f32) -> L + Copy, entries: [L; 6]) -> Eigen3<L> {
    let [xx, xy, xz, yy, yz, zz] = entries;
    let largest = xx.abs().max(yy.abs()).max(zz.abs()).max(xy.abs()).max(xz.abs()).max(yz.abs());
    let ([lift, scale], [unscale, lower]) = scales(all, largest);
    let mut d = [xx * lift * scale, yy * lift * scale, zz * lift * scale];
    // Entry k stands in row and column k + 1 and k + 2.
    let mut off = [yz * lift * scale, xz * lift * scale, xy * lift * scale];
    let (zero, one) = (all(0.0), all(1.0));
    let mut vectors = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    for _ in 0..4 {
        for (p, q, r) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
            rotate(all, &mut d, &mut off, &mut vectors, [p, q, r]);
        }
    }
    for (p, q) in [(0, 1), (0, 2), (1, 2)] {
        let swap = d[p].abs().lt(d[q].abs());
        (d[p], d[q]) = (d[q].select(swap, d[p]), d[p].select(swap, d[q]));
        let ([a, b, c], [d, e, f]) = (vectors[p], vectors[q]);
        vectors[p] = [d.select(swap, a), e.select(swap, b), f.select(swap, c)];
        vectors[q] = [a.select(swap, d), b.select(swap, e), c.select(swap, f)];
    }
    let [x, y, z] = d;
    Eigen3 { values: [x * unscale * lower, y * unscale * lower, z * unscale * lower], vectors }
}

/// One Jacobi rotation in the plane of axes p and q: makes the entry pq zero.
#[inline(always)]
fn rotate<L: Lanes>(
    all: impl Fn(f32) -> L + Copy,
    d: &mut [L; 3],
    off: &mut [L; 3],
    vectors: &mut [[L; 3]; 3],
    [p, q, r]: [usize; 3],
) {
    let (zero, one) = (all(0.0), all(1.0));
    let twice = off[r] + off[r];
    // t = tan of the smaller angle: 2 pq / (difference ± √(difference² + 4 pq²)).
    let difference = d[q] - d[p];
    let root = (difference * difference + twice * twice).sqrt();
    let denominator = difference + (-root).select(difference.lt(zero), root);
    let t = twice / one.select(denominator.eq(zero), denominator);
    let cos = one / (one + t * t).sqrt();
    let sin = t * cos;
    d[p] = d[p] - t * off[r];
    d[q] = d[q] + t * off[r];
    off[r] = zero;
    // Entry pr stands in off[q], entry qr in off[p].
    (off[q], off[p]) = (cos * off[q] - sin * off[p], sin * off[q] + cos * off[p]);
    let ([a, b, c], [d, e, f]) = (vectors[p], vectors[q]);
    vectors[p] = [cos * a - sin * d, cos * b - sin * e, cos * c - sin * f];
    vectors[q] = [sin * a + cos * d, sin * b + cos * e, sin * c + cos * f];
}

/// Sixteen 2×2 matrices: entries xx, xy, yy of each.
pub type Matrices2 = [[f32; 16]; 3];
/// Their decompositions: larger and smaller value, axis x and y of the larger.
pub type Decomposed2 = [[f32; 16]; 4];
/// Sixteen 3×3 matrices: entries xx, xy, xz, yy, yz, zz of each.
pub type Matrices3 = [[f32; 16]; 6];
/// Their decompositions: the three values, then the vectors of each, coordinate by coordinate.
pub type Decomposed3 = [[f32; 16]; 12];

/// Decomposes as many batches of 2×2 matrices as both slices hold, by [`symmetric2`].
pub fn decompose2(level: Level, matrices: &[Matrices2], results: &mut [Decomposed2]) {
    level.dispatch(Batch2(matrices, results));
}

/// Decomposes as many batches of 3×3 matrices as both slices hold, by [`symmetric3`].
pub fn decompose3(level: Level, matrices: &[Matrices3], results: &mut [Decomposed3]) {
    level.dispatch(Batch3(matrices, results));
}

struct Batch2<'a>(&'a [Matrices2], &'a mut [Decomposed2]);

impl Kernel for Batch2<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for (matrices, result) in self.0.iter().zip(self.1) {
            let [xx, xy, yy] = matrices;
            let entries = [simd.load16(xx), simd.load16(xy), simd.load16(yy)];
            let Eigen2 { values: [large, small], axis: [x, y] } =
                symmetric2(|value| simd.splat16(value), entries);
            *result = [large.to_array(), small.to_array(), x.to_array(), y.to_array()];
        }
    }
}

struct Batch3<'a>(&'a [Matrices3], &'a mut [Decomposed3]);

impl Kernel for Batch3<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for (matrices, result) in self.0.iter().zip(self.1) {
            let [xx, xy, xz, yy, yz, zz] = matrices;
            let entries = [
                simd.load16(xx),
                simd.load16(xy),
                simd.load16(xz),
                simd.load16(yy),
                simd.load16(yz),
                simd.load16(zz),
            ];
            let Eigen3 { values, vectors } = symmetric3(|value| simd.splat16(value), entries);
            let columns = values.iter().chain(vectors.as_flattened());
            for (row, lanes) in result.iter_mut().zip(columns) {
                *row = lanes.to_array();
            }
        }
    }
}

#[cfg(test)]
mod tests;
