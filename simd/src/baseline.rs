//! Lanes of the build target, through `wide`: SSE2, AVX (if the build enables it), NEON, simd128 or scalar
//! code. Sixteen lanes are two registers of eight.

use crate::kernels::push::{keep, push};
use crate::lanes::{EXPONENT, Lanes, Mask, Simd};
use crate::stack::Stack;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};
use wide::f32x8;

/// Token of the baseline level, which every processor of the build target has.
#[derive(Clone, Copy, Debug)]
pub struct Baseline;

/// Eight lanes of the build target.
#[derive(Clone, Copy)]
pub struct F8(f32x8);

/// Mask of [`F8`]: all bits of a lane, or none.
#[derive(Clone, Copy)]
pub struct M8(f32x8);

/// Two registers as one of twice the lanes.
#[derive(Clone, Copy)]
pub struct Pair<T>(pub(crate) T, pub(crate) T);

macro_rules! lane_operators {
    ($type:ident, $($trait:ident $method:ident $op:tt),*) => {
        $(impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0 $op other.0)
            }
        })*
    };
}
lane_operators!(F8, Add add +, Sub sub -, Mul mul *, Div div /);
lane_operators!(M8, BitAnd bitand &, BitOr bitor |);

impl Neg for F8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Not for M8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for M8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.0.to_bitmask()
    }
}

impl Lanes for F8 {
    type Array = [f32; 8];
    type Mask = M8;
    const N: usize = 8;

    #[inline(always)]
    fn all(self, value: f32) -> Self {
        Self(f32x8::splat(value))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.fast_min(other.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.fast_max(other.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let minus = f32x8::splat(-0.0);
        Self((self.0 & !minus) | (sign.0 & minus))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self(self.0 & f32x8::splat(f32::from_bits(EXPONENT)))
    }
    #[inline(always)]
    fn product(self, other: Self) -> (Self, Self) {
        // Dekker 1971: halves of twelve bits, whose products are exact.
        let split = |x: Self| {
            let shifted = x * F8(f32x8::splat(4097.0));
            let high = shifted - (shifted - x);
            (high, x - high)
        };
        let product = self * other;
        let ((a, b), (c, d)) = (split(self), split(other));
        (product, ((a * c - product) + a * d + b * c) + b * d)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M8 {
        M8(self.0.simd_lt(other.0))
    }
    #[inline(always)]
    fn le(self, other: Self) -> M8 {
        M8(self.0.simd_le(other.0))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M8 {
        M8(self.0.simd_eq(other.0))
    }
    #[inline(always)]
    fn signs(self) -> u32 {
        self.0.to_bitmask()
    }
    #[inline(always)]
    fn select(self, mask: M8, other: Self) -> Self {
        Self(mask.0.select(self.0, other.0))
    }
    #[inline(always)]
    fn neighbours(self, table: &[i16]) -> [Self; 2] {
        let (mut first, mut second) = ([0.0; 8], [0.0; 8]);
        for (i, lane) in self.to_array().into_iter().enumerate() {
            [first[i], second[i]] = lane.neighbours(table);
        }
        [Self(f32x8::new(first)), Self(f32x8::new(second))]
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.0.to_array();
        a.max(b).max(c.max(d)).max(e.max(f).max(g.max(h)))
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        self.0.to_array()
    }
}

macro_rules! pair_operators {
    ($($trait:ident $method:ident),*) => {
        $(impl<T: $trait<Output = T>> $trait for Pair<T> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        })*
    };
}
pair_operators!(Add add, Sub sub, Mul mul, Div div, BitAnd bitand, BitOr bitor);

impl<T: Neg<Output = T>> Neg for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<T: Not<Output = T>> Not for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}

impl<M: Mask> Mask for Pair<M> {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.0.bits() | self.1.bits() << 8
    }
}

impl<L: Lanes<Array = [f32; 8]>> Lanes for Pair<L> {
    type Array = [f32; 16];
    type Mask = Pair<L::Mask>;
    const N: usize = 16;

    #[inline(always)]
    fn all(self, value: f32) -> Self {
        Self(self.0.all(value), self.1.all(value))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self(self.0.copysign(sign.0), self.1.copysign(sign.1))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self(self.0.power_of_two(), self.1.power_of_two())
    }
    #[inline(always)]
    fn product(self, other: Self) -> (Self, Self) {
        let ((low, low_rest), (high, high_rest)) = (self.0.product(other.0), self.1.product(other.1));
        (Self(low, high), Self(low_rest, high_rest))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        Pair(self.0.lt(other.0), self.1.lt(other.1))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        Pair(self.0.le(other.0), self.1.le(other.1))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Self::Mask {
        Pair(self.0.eq(other.0), self.1.eq(other.1))
    }
    #[inline(always)]
    fn signs(self) -> u32 {
        self.0.signs() | self.1.signs() << 8
    }
    #[inline(always)]
    fn select(self, mask: Self::Mask, other: Self) -> Self {
        Self(self.0.select(mask.0, other.0), self.1.select(mask.1, other.1))
    }
    #[inline(always)]
    fn neighbours(self, table: &[i16]) -> [Self; 2] {
        let ([a, b], [c, d]) = (self.0.neighbours(table), self.1.neighbours(table));
        [Self(a, c), Self(b, d)]
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        self.0.max(self.1).largest()
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 16] {
        let mut both = [0.0; 16];
        let (low, high) = both.split_at_mut(8);
        low.copy_from_slice(&self.0.to_array());
        high.copy_from_slice(&self.1.to_array());
        both
    }
}

/// Both halves of sixteen values.
#[inline(always)]
pub(crate) fn halves(values: &[f32; 16]) -> (&[f32; 8], &[f32; 8]) {
    let (low, high) = values.split_at(8);
    // Both are eight long; the fallback is never taken.
    (low.first_chunk().unwrap_or(&[0.0; 8]), high.first_chunk().unwrap_or(&[0.0; 8]))
}

/// True if `load8x9` with these arguments stays within `length` values.
#[inline(always)]
pub(crate) fn fits8x9(length: usize, start: usize, stride: usize) -> bool {
    stride <= 8 && start <= length && length - start >= 9 * stride + 8
}

impl Simd for Baseline {
    type F8 = F8;
    type F16 = Pair<F8>;

    #[inline(always)]
    fn splat8(self, value: f32) -> F8 {
        F8(f32x8::splat(value))
    }
    #[inline(always)]
    fn splat16(self, value: f32) -> Pair<F8> {
        Pair(self.splat8(value), self.splat8(value))
    }
    #[inline(always)]
    fn load8(self, values: &[f32; 8]) -> F8 {
        F8(f32x8::from(*values))
    }
    #[inline(always)]
    fn load16(self, values: &[f32; 16]) -> Pair<F8> {
        let (low, high) = halves(values);
        Pair(self.load8(low), self.load8(high))
    }
    #[inline(always)]
    fn first8(self, n: u32) -> M8 {
        self.mask8(if n >= 8 { 0xff } else { (1 << n) - 1 })
    }
    #[inline(always)]
    fn mask16(self, bits: u32) -> Pair<M8> {
        Pair(self.mask8(bits), self.mask8(bits >> 8))
    }
    #[inline(always)]
    fn push8(self, order: u32, entry: F8, exit: F8, items: &[f32; 8], stack: &mut Stack) {
        push(order, &entry.to_array(), &exit.to_array(), items, stack);
    }
    #[inline(always)]
    fn push8_unordered(self, entry: F8, exit: F8, items: &[f32; 8], stack: &mut Stack) {
        push(0x7654_3210, &entry.to_array(), &exit.to_array(), items, stack);
    }
    #[inline(always)]
    fn keep(self, limit: f32, stack: &mut Stack) {
        keep(limit, stack);
    }
    #[inline(always)]
    fn pack16(self, wanted: Pair<M8>, lanes: Pair<F8>, out: &mut [f32; 16]) {
        let (lanes, mut bits) = (lanes.to_array(), wanted.bits());
        for slot in out {
            if bits == 0 {
                return;
            }
            *slot = lanes[bits.trailing_zeros() as usize & 15];
            bits &= bits - 1;
        }
    }
    #[inline(always)]
    fn numbers16(self, first: u32) -> Pair<F8> {
        self.load16(&core::array::from_fn(|i| f32::from_bits(first.wrapping_add(i as u32))))
    }
    #[inline(always)]
    fn field16(self, words: &[u32; 16], from: u32, width: u32) -> Pair<F8> {
        // Signed, because SSE2 converts signed integers only.
        self.load16(&words.map(|word| ((word >> from) & ((1 << width) - 1)) as i32 as f32))
    }
    #[inline(always)]
    fn pick16(self, table: Pair<F8>, which: Pair<F8>) -> Pair<F8> {
        let (table, which) = (table.to_array(), which.to_array());
        self.load16(&which.map(|which| table[which as usize & 15]))
    }
    #[inline(always)]
    fn bytes16(self, bytes: &[u8; 16]) -> Pair<F8> {
        self.load16(&bytes.map(|byte| i32::from(byte) as f32))
    }
    #[inline(always)]
    fn powers16(self, words: &[u32; 16]) -> Pair<F8> {
        self.load16(&words.map(|word| f32::from_bits(word >> 24 << 23)))
    }
    #[inline(always)]
    fn prefetch<T>(self, _items: &[T], _values: &[f32], _second: bool, _index: usize) {}
    #[inline(always)]
    fn splat16x9(
        self,
        values: &[f32],
        start: usize,
        stride: usize,
        axes: [usize; 3],
    ) -> Option<[[Pair<F8>; 3]; 3]> {
        splat_corners!(self, gather9(values, start, stride, axes)?)
    }
    #[inline(always)]
    fn load8x9(self, values: &[f32], start: usize, stride: usize, axes: [usize; 3]) -> Option<[[F8; 3]; 3]> {
        if !fits8x9(values.len(), start, stride) {
            return None;
        }
        let at = |run: usize| values.get(start + run * stride..).and_then(|rest| rest.first_chunk::<8>());
        let mut corners = [[self.splat8(0.0); 3]; 3];
        for (c, corner) in corners.iter_mut().enumerate() {
            for (lanes, axis) in corner.iter_mut().zip(axes) {
                *lanes = self.load8(at(3 * c + axis.min(2))?);
            }
        }
        Some(corners)
    }
}

/// First floats of nine runs, coordinates in the order of `axes`; `None` if they do not all exist.
#[inline(always)]
pub(crate) fn gather9(
    values: &[f32],
    start: usize,
    stride: usize,
    axes: [usize; 3],
) -> Option<[[f32; 3]; 3]> {
    let runs = values.get(start..)?;
    if stride > 8 || runs.len() < 8 * stride + 1 {
        return None;
    }
    let [kx, ky, kz] = [axes[0].min(2), axes[1].min(2), axes[2].min(2)];
    let (mut corners, mut run) = ([[0.0; 3]; 3], 0);
    for corner in &mut corners {
        *corner =
            [*runs.get(run + kx * stride)?, *runs.get(run + ky * stride)?, *runs.get(run + kz * stride)?];
        run += 3 * stride;
    }
    Some(corners)
}

/// Nine values, each in all lanes.
macro_rules! splat_corners {
    ($simd:expr, $corners:expr) => {{
        let [a, b, c] = $corners;
        Some([
            [$simd.splat16(a[0]), $simd.splat16(a[1]), $simd.splat16(a[2])],
            [$simd.splat16(b[0]), $simd.splat16(b[1]), $simd.splat16(b[2])],
            [$simd.splat16(c[0]), $simd.splat16(c[1]), $simd.splat16(c[2])],
        ])
    }};
}
pub(crate) use splat_corners;

impl Baseline {
    #[inline(always)]
    fn mask8(self, bits: u32) -> M8 {
        let lane = |i: u32| f32::from_bits(0u32.wrapping_sub(bits >> i & 1));
        M8(f32x8::from(core::array::from_fn(|i| lane(i as u32))))
    }
}
