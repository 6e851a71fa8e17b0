//! Eigendecompositions of symmetric 2×2 and 3×3 matrices, a register of them at a time.
//!
//! For [a b; b c] with m = (a + c)/2, d = (a - c)/2, r = √(d² + b²) the eigenvalues are m ± r. Departures:
//! 1. The value of larger magnitude, m + sign(m) r, has no cancellation. The other is det/larger (Vieta),
//!    with det = ac - b² from exact products (after Kahan). The plain formula loses the smaller of two values
//!    1 : 10⁷ completely.
//! 2. Everything is scaled by a power of two first, so that nothing overflows or underflows, denormals
//!    included.
//! 3. The eigenvector of m + r is (d + r, b) or (b, r - d), whichever has no cancellation.
//!
//! For 3×3: cyclic Jacobi, four sweeps (Golub, Van Loan). The closed formula by angles and cross products is
//! faster but wrong where two eigenvalues meet.
//!
//! The cost: there is no branch, so that no matrix is cheaper than another; two square roots and three
//! divisions per 2×2. The smaller value of a 2×2 is accurate down to 1e-30 of the larger. Both have an error
//! of at most 4 units in the last place, also for values near the end of f32's range.

use crate::lanes::{Lanes, Simd};
use crate::level::{Kernel, Level};

/// Eigenvalues and eigenvectors of a symmetric 2×2 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eigen2<L> {
    /// Eigenvalues, that of larger magnitude first.
    pub values: [L; 2],
    /// Unit eigenvector (x, y) of the first; that of the second is (-y, x).
    pub axis: [L; 2],
}

/// Eigenvalues and eigenvectors of a symmetric 3×3 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eigen3<L> {
    /// Eigenvalues, from largest to smallest magnitude.
    pub values: [L; 3],
    /// Unit eigenvectors, in the order of the values.
    pub vectors: [[L; 3]; 3],
}

/// Scale of the largest entry: its square is finite, and the squares of all entries that matter are not
/// denormal.
const SCALED: f32 = (1u64 << 60) as f32;
/// 2⁻⁶⁰, the lower end of the range that is scaled in one step.
const SMALL: f32 = 1.0 / SCALED;
/// 2⁹⁰: brings numbers below [`SMALL`], denormals included, to ordinary size.
const LIFT: f32 = SCALED * (1u64 << 30) as f32;
/// Off-diagonal entries below this, after scaling, count as zero: less than 2⁻¹¹⁰ of the largest. f32 holds
/// every bit of the squares of the others.
const NEGLIGIBLE: f32 = 1.0 / (1u64 << 50) as f32;

/// Powers of two that scale entries to the order of [`SCALED`], to be multiplied one after the other, and
/// those that undo the scaling.
#[inline(always)]
fn scales<L: Lanes>(all: impl Fn(f32) -> L, largest: L) -> ([L; 2], [L; 2]) {
    let small = largest.lt(all(SMALL));
    let lift = all(LIFT).select(small, all(1.0));
    let power = (largest * lift).max(all(SMALL)).power_of_two();
    ([lift, all(SCALED) / power], [power * all(SMALL), all(1.0 / LIFT).select(small, all(1.0))])
}

/// Decomposes [xx xy; xy yy]; `all` converts a constant to lanes. The result for matrices that are not finite
/// is unspecified.
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
    // Eigenvector of mean + radius. If the mean is negative that is the smaller value, and the larger is at a
    // right angle.
    let wide = zero.le(difference);
    let reach = difference.abs() + radius;
    let (x, y) = (reach.select(wide, b), b.select(wide, reach));
    let (x, y) = ((-y).select(negative, x), x.select(negative, y));
    let isotropic = reach.eq(zero);
    let (x, y) = (one.select(isotropic, x), zero.select(isotropic, y));
    let inverse = one / (x * x + y * y).sqrt();
    // The values of a diagonal matrix are its entries, whose ratio may exceed the range of the scaling.
    let (low, high) = (xx.min(yy), xx.max(yy));
    let large = low.select(negative, high).select(diagonal, large * unscale * lower);
    let small = high.select(negative, low).select(diagonal, small * unscale * lower);
    Eigen2 { values: [large, small], axis: [x * inverse, y * inverse] }
}

/// Decomposes the symmetric matrix of the entries xx, xy, xz, yy, yz, zz, with error 5e-7 of its largest
/// value.
#[inline(always)]
pub fn symmetric3<L: Lanes>(all: impl Fn(f32) -> L + Copy, entries: [L; 6]) -> Eigen3<L> {
    let [xx, xy, xz, yy, yz, zz] = entries;
    let largest = xx.abs().max(yy.abs()).max(zz.abs()).max(xy.abs()).max(xz.abs()).max(yz.abs());
    let ([lift, scale], [unscale, lower]) = scales(all, largest);
    let (mut xx, mut yy, mut zz) = (xx * lift * scale, yy * lift * scale, zz * lift * scale);
    let (mut xy, mut xz, mut yz) = (xy * lift * scale, xz * lift * scale, yz * lift * scale);
    let (zero, one) = (all(0.0), all(1.0));
    let (mut u, mut v, mut w) = ([one, zero, zero], [zero, one, zero], [zero, zero, one]);
    for _ in 0..4 {
        ([xx, yy], [xz, yz], [u, v]) = rotated(all, [xx, yy], xy, [xz, yz], [u, v]);
        ([xx, zz], [xy, yz], [u, w]) = rotated(all, [xx, zz], xz, [zero, yz], [u, w]);
        ([yy, zz], [xy, xz], [v, w]) = rotated(all, [yy, zz], yz, [xy, zero], [v, w]);
        yz = zero;
    }
    ([xx, yy], [u, v]) = sorted([xx, yy], [u, v]);
    ([xx, zz], [u, w]) = sorted([xx, zz], [u, w]);
    ([yy, zz], [v, w]) = sorted([yy, zz], [v, w]);
    Eigen3 { values: [xx * unscale * lower, yy * unscale * lower, zz * unscale * lower], vectors: [u, v, w] }
}

/// Jacobi rotation in the plane of axes p and q: updates the entries pp and qq, those of the third row, rp
/// and rq, and the vectors p and q. The entry pq becomes zero.
#[inline(always)]
fn rotated<L: Lanes>(
    all: impl Fn(f32) -> L,
    [pp, qq]: [L; 2],
    pq: L,
    [rp, rq]: [L; 2],
    [u, v]: [[L; 3]; 2],
) -> ([L; 2], [L; 2], [[L; 3]; 2]) {
    let (zero, one) = (all(0.0), all(1.0));
    // tan of the smaller angle: 2 pq / (difference ± √(difference² + 4 pq²)). If the square of pq underflowed
    // while pq did not, a small difference could give any angle.
    let pq = zero.select(pq.abs().lt(all(NEGLIGIBLE)), pq);
    let (difference, twice) = (qq - pp, pq + pq);
    let root = (difference * difference + twice * twice).sqrt();
    let denominator = difference + (-root).select(difference.lt(zero), root);
    let tan = twice / one.select(denominator.eq(zero), denominator);
    let cos = one / (one + tan * tan).sqrt();
    let sin = tan * cos;
    let ([a, b, c], [d, e, f]) = (u, v);
    (
        [pp - tan * pq, qq + tan * pq],
        [cos * rp - sin * rq, sin * rp + cos * rq],
        [
            [cos * a - sin * d, cos * b - sin * e, cos * c - sin * f],
            [sin * a + cos * d, sin * b + cos * e, sin * c + cos * f],
        ],
    )
}

/// Two values and their vectors, the larger magnitude first.
#[inline(always)]
fn sorted<L: Lanes>([x, y]: [L; 2], [u, v]: [[L; 3]; 2]) -> ([L; 2], [[L; 3]; 2]) {
    let swap = x.abs().lt(y.abs());
    let ([a, b, c], [d, e, f]) = (u, v);
    (
        [y.select(swap, x), x.select(swap, y)],
        [
            [d.select(swap, a), e.select(swap, b), f.select(swap, c)],
            [a.select(swap, d), b.select(swap, e), c.select(swap, f)],
        ],
    )
}

/// Sixteen 2×2 matrices: entries xx, xy, yy of each.
pub type Matrices2 = [[f32; 16]; 3];
/// Decompositions of [`Matrices2`]: larger and smaller value, axis x and y of the larger.
pub type Decomposed2 = [[f32; 16]; 4];
/// Sixteen 3×3 matrices: entries xx, xy, xz, yy, yz, zz of each.
pub type Matrices3 = [[f32; 16]; 6];
/// Decompositions of [`Matrices3`]: the three values, then the vectors of each, coordinate by coordinate.
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
