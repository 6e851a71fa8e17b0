//! Traits of lanes: the operations that the kernels use, and the token that makes lanes.
//!
//! The arithmetic neither fuses nor reduces: each lane computes the scalar operation, to the bit, on every
//! level, so that a kernel gives the same result everywhere. A single f32 also implements lanes, by which
//! the core shades single vertices.

use crate::half;
use crate::stack::Stack;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// One truth value per lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// Bit `i` is lane `i`.
    fn bits(self) -> u32;

    /// True if any lane is set.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

/// A register of f32 lanes.
pub trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
where
    Self: Div<Output = Self> + Neg<Output = Self>,
{
    /// `[f32; N]`.
    type Array: Copy;
    /// Result of comparisons.
    type Mask: Mask;
    /// Number of lanes.
    const N: usize;

    /// `value` in all lanes of the same level.
    fn all(self, value: f32) -> Self;
    /// Smaller value of each lane; either if one is NaN.
    fn min(self, other: Self) -> Self;
    /// Larger value of each lane; either if one is NaN.
    fn max(self, other: Self) -> Self;
    /// Magnitude of each lane.
    fn abs(self) -> Self;
    /// Magnitude of each lane with the sign of `sign`, zeros and NaN included.
    fn copysign(self, sign: Self) -> Self;
    /// Correctly rounded square root of each lane.
    fn sqrt(self) -> Self;
    /// Largest power of two not above the magnitude of each lane; zero for denormals.
    fn power_of_two(self) -> Self;
    /// Rounded product and its rounding error. Their sum is exact if the magnitudes of both factors are zero
    /// or 1e-14 to 1e30, and that of the product 1e-30 to 1e38.
    fn product(self, other: Self) -> (Self, Self);
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `self == other`.
    fn eq(self, other: Self) -> Self::Mask;
    /// Mask of the lanes with a minus sign, zeros and NaN included.
    fn signs(self) -> u32;
    /// `self` in lanes where `mask` is set, `other` elsewhere.
    fn select(self, mask: Self::Mask, other: Self) -> Self;
    /// Entries `i` and `i + 1` of `table`; the lanes are integers `i` of at least 0 and below 2^23. Beyond
    /// the end these are the last two entries; zeros if there are fewer.
    fn neighbours(self, table: &[i16]) -> [Self; 2];
    /// Entries `i` and `i + 1` of `table`, and those `columns` behind them; indices as for
    /// [`Lanes::neighbours`].
    #[inline(always)]
    fn cell(self, table: &[i16], columns: usize) -> [[Self; 2]; 2] {
        [self.neighbours(table), (self + self.all(columns as f32)).neighbours(table)]
    }
    /// Largest lane; unspecified with NaN.
    fn largest(self) -> f32;
    /// Smallest lane; unspecified with NaN.
    #[inline(always)]
    fn smallest(self) -> f32 {
        -(-self).largest()
    }
    /// The lanes as an array.
    fn to_array(self) -> Self::Array;
}

/// a · b, lane by lane.
#[inline(always)]
pub fn dot<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> L {
    (a * x + b * y) + c * z
}

impl Mask for bool {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.into()
    }
}

impl Lanes for f32 {
    type Array = [f32; 1];
    type Mask = bool;
    const N: usize = 1;

    #[inline(always)]
    fn all(self, value: f32) -> Self {
        value
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // The second value if either is NaN, as the instructions of x86 do.
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f32::copysign(self, sign)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        libm::sqrtf(self)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        f32::from_bits(self.to_bits() & EXPONENT)
    }
    #[inline(always)]
    fn product(self, other: Self) -> (Self, Self) {
        let product = self * other;
        (product, (f64::from(self) * f64::from(other) - f64::from(product)) as f32)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn signs(self) -> u32 {
        self.is_sign_negative().into()
    }
    #[inline(always)]
    fn select(self, mask: bool, other: Self) -> Self {
        if mask { self } else { other }
    }
    #[inline(always)]
    fn neighbours(self, table: &[i16]) -> [Self; 2] {
        pair(table, index(self).min(table.len().saturating_sub(2)))
    }
    #[inline(always)]
    fn cell(self, table: &[i16], columns: usize) -> [[Self; 2]; 2] {
        let i = index(self).min(table.len().saturating_sub(columns + 2));
        [pair(table, i), pair(table, i + columns)]
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        self
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 1] {
        [self]
    }
}

/// Integer value of a lane below 2^23. From 2^23 to 2^24 the last bit of a float is 1: its bits count.
#[inline(always)]
fn index(lane: f32) -> usize {
    ((lane + 8_388_608.0).to_bits() & 0x7f_ffff) as usize
}

/// Entries `i` and `i + 1`; zeros beyond the end.
#[inline(always)]
fn pair(table: &[i16], i: usize) -> [f32; 2] {
    match table.get(i..) {
        Some([first, second, ..]) => [f32::from(*first), f32::from(*second)],
        _ => [0.0; 2],
    }
}

/// Bits of the exponent.
pub(crate) const EXPONENT: u32 = 0x7f80_0000;

/// Token that proves the level of the processor and is the only way to make its lanes.
pub trait Simd: Copy {
    /// Eight lanes.
    type F8: Lanes<Array = [f32; 8]>;
    /// Sixteen lanes.
    type F16: Lanes<Array = [f32; 16]>;

    /// The value in all lanes.
    fn splat8(self, value: f32) -> Self::F8;
    /// The value in all lanes.
    fn splat16(self, value: f32) -> Self::F16;
    /// Lanes from memory.
    fn load8(self, values: &[f32; 8]) -> Self::F8;
    /// Lanes from memory.
    fn load16(self, values: &[f32; 16]) -> Self::F16;
    /// Lanes from half floats in memory.
    #[inline(always)]
    fn load16_half(self, values: &[u16; 16]) -> Self::F16 {
        self.load16(&values.map(half::to_f32))
    }
    /// Lanes `i < n` set.
    fn first8(self, n: u32) -> <Self::F8 as Lanes>::Mask;
    /// Mask from its bits.
    fn mask16(self, bits: u32) -> <Self::F16 as Lanes>::Mask;

    /// Pushes the lanes with `entry <= exit`, in the order of the nibbles of `order`, lowest nibble first.
    /// The low three bits of a nibble are the lane. Does nothing without room for eight.
    fn push8(self, order: u32, entry: Self::F8, exit: Self::F8, items: &[f32; 8], stack: &mut Stack);

    /// [`Simd::push8`] in the order of the lanes; the entries on the stack are unspecified.
    fn push8_unordered(self, entry: Self::F8, exit: Self::F8, items: &[f32; 8], stack: &mut Stack);

    /// Removes all items whose entry is beyond `limit`.
    fn keep(self, limit: f32, stack: &mut Stack);

    /// Sixteen records of eight floats, as eight registers of sixteen: register `k` holds float `k` of each.
    #[inline(always)]
    fn columns16(self, records: &[[f32; 8]; 16]) -> [Self::F16; 8] {
        let mut columns = [[0.0; 16]; 8];
        for (i, record) in records.iter().enumerate() {
            for (column, value) in columns.iter_mut().zip(record) {
                column[i] = *value;
            }
        }
        let [a, b, c, d, e, f, g, h] = &columns;
        [
            self.load16(a),
            self.load16(b),
            self.load16(c),
            self.load16(d),
            self.load16(e),
            self.load16(f),
            self.load16(g),
            self.load16(h),
        ]
    }

    /// Four registers of sixteen, as sixteen records of four floats.
    #[inline(always)]
    fn records16(self, [a, b, c, d]: [Self::F16; 4]) -> [[f32; 4]; 16] {
        let (a, b, c, d) = (a.to_array(), b.to_array(), c.to_array(), d.to_array());
        let mut records = [[0.0; 4]; 16];
        for (i, record) in records.iter_mut().enumerate() {
            *record = [a[i], b[i], c[i], d[i]];
        }
        records
    }

    /// Eight registers of sixteen into sixteen records of eight floats.
    #[inline(always)]
    fn octets16(self, [a, b, c, d, e, f, g, h]: [Self::F16; 8], records: &mut [[f32; 8]; 16]) {
        let (first, second) = (self.records16([a, b, c, d]), self.records16([e, f, g, h]));
        let mut i = 0;
        while i < 16 {
            let ([a, b, c, d], [e, f, g, h]) = (first[i], second[i]);
            records[i] = [a, b, c, d, e, f, g, h];
            i += 1;
        }
    }

    /// Packs the `wanted` lanes to the start of `out`; the rest of `out` is unspecified.
    fn pack16(self, wanted: <Self::F16 as Lanes>::Mask, lanes: Self::F16, out: &mut [f32; 16]);

    /// `first + i` in lane `i`, as the bits of a float.
    fn numbers16(self, first: u32) -> Self::F16;

    /// Value of the `width` (below 25) bits of each word from bit `from` on.
    fn field16(self, words: &[u32; 16], from: u32, width: u32) -> Self::F16;

    /// Lanes of `table`, indexed by the integer part of `which`, 0 to 15.
    fn pick16(self, table: Self::F16, which: Self::F16) -> Self::F16;

    /// Bytes as numbers.
    fn bytes16(self, bytes: &[u8; 16]) -> Self::F16;

    /// 2^(`e` - 127) with `e` the highest eight bits of each word; zero if they are zero.
    fn powers16(self, words: &[u32; 16]) -> Self::F16;

    /// Prefetches the four cache lines from `items[index]` on, or from `values[index]` on if `second`. Only a
    /// hint: an index beyond the end is harmless. The choice between both costs no branch.
    fn prefetch<T>(self, items: &[T], values: &[f32], second: bool, index: usize);

    /// Three corners by three coordinates from nine runs of `stride` floats at `values[start..]`. Run
    /// `3 c + k` holds coordinate `k` of corner `c`; coordinates in the order of `axes` (each below 3).
    /// `None` if eight floats from the start of a run are not all in the slice.
    fn load8x9(
        self,
        values: &[f32],
        start: usize,
        stride: usize,
        axes: [usize; 3],
    ) -> Option<[[Self::F8; 3]; 3]>;

    /// One triangle of [`Simd::load8x9`] in all of sixteen lanes: the first float of each run.
    fn splat16x9(
        self,
        values: &[f32],
        start: usize,
        stride: usize,
        axes: [usize; 3],
    ) -> Option<[[Self::F16; 3]; 3]>;
}
