//! The lane trait: only the operations that the kernels use, and the token that makes lanes.
//!
//! No operation here fuses or reduces: each lane does what the scalar operation does, to the bit, on
//! every level. What a kernel does with them is therefore the same everywhere.

use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// One truth value per lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// Bit `i` is lane `i`.
    fn bits(self) -> u32;

    /// Whether any lane is set.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

/// A register of f32 lanes.
pub trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// `[f32; N]`.
    type Array: Copy;
    /// What comparisons give.
    type Mask: Mask;
    /// How many lanes.
    const N: usize;

    /// Lane by lane the smaller; unspecified which where a lane is NaN.
    fn min(self, other: Self) -> Self;
    /// Lane by lane the larger; unspecified which where a lane is NaN.
    fn max(self, other: Self) -> Self;
    /// Lane by lane without sign.
    fn abs(self) -> Self;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `self == other`.
    fn eq(self, other: Self) -> Self::Mask;
    /// `self` where `mask` is set, `other` elsewhere.
    fn select(self, mask: Self::Mask, other: Self) -> Self;
    /// The lanes as an array.
    fn to_array(self) -> Self::Array;
}

/// Proof that the processor has a level, and the only maker of its lanes.
pub trait Simd: Copy {
    /// Eight lanes.
    type F8: Lanes<Array = [f32; 8]>;
    /// Sixteen lanes.
    type F16: Lanes<Array = [f32; 16]>;

    /// All lanes the same.
    fn splat8(self, value: f32) -> Self::F8;
    /// All lanes the same.
    fn splat16(self, value: f32) -> Self::F16;
    /// Lanes from memory.
    fn load8(self, values: &[f32; 8]) -> Self::F8;
    /// Lanes from memory.
    fn load16(self, values: &[f32; 16]) -> Self::F16;
    /// Lanes `i < n` set.
    fn first8(self, n: u32) -> <Self::F8 as Lanes>::Mask;
    /// A mask from its bits.
    fn mask16(self, bits: u32) -> <Self::F16 as Lanes>::Mask;

    /// Nine registers from `values[start + k * stride ..][.. 8]`, k = 0 … 8: the leaf layout of triangles.
    /// `None` where that leaves the slice.
    fn load8x9(self, values: &[f32], start: usize, stride: usize) -> Option<[Self::F8; 9]>;
}
