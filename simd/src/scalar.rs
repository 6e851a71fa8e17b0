//! Level of single f32 lanes, for tests: every kernel by the scalar operations that the core calls.

use crate::baseline::{Baseline, F8, M8, gather9};
use crate::lanes::{Lanes, Mask, Simd};
use crate::stack::Stack;
use core::array::from_fn;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Token of the level of single lanes; eight lanes are those of the baseline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalar;

/// Sixteen lanes of one f32 each.
#[derive(Clone, Copy)]
pub(crate) struct Singles([f32; 16]);

/// Truth values of sixteen lanes.
#[derive(Clone, Copy)]
pub(crate) struct Truths([bool; 16]);

impl Singles {
    fn zip(self, other: Self, operation: impl Fn(f32, f32) -> f32) -> Self {
        Self(from_fn(|i| operation(self.0[i], other.0[i])))
    }

    fn compare(self, other: Self, holds: impl Fn(f32, f32) -> bool) -> Truths {
        Truths(from_fn(|i| holds(self.0[i], other.0[i])))
    }
}

macro_rules! operators {
    ($($trait:ident $method:ident),*) => {
        $(impl $trait for Singles {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                self.zip(other, f32::$method)
            }
        })*
    };
}
operators!(Add add, Sub sub, Mul mul, Div div);

impl Neg for Singles {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(f32::neg))
    }
}

impl BitAnd for Truths {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self(from_fn(|i| self.0[i] & other.0[i]))
    }
}

impl BitOr for Truths {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(from_fn(|i| self.0[i] | other.0[i]))
    }
}

impl Not for Truths {
    type Output = Self;
    fn not(self) -> Self {
        Self(self.0.map(bool::not))
    }
}

impl Mask for Truths {
    fn bits(self) -> u32 {
        (0..16).map(|i| u32::from(self.0[i]) << i).sum()
    }
}

impl Lanes for Singles {
    type Array = [f32; 16];
    type Mask = Truths;
    const N: usize = 16;

    fn all(self, value: f32) -> Self {
        Self([value; 16])
    }
    fn min(self, other: Self) -> Self {
        self.zip(other, Lanes::min)
    }
    fn max(self, other: Self) -> Self {
        self.zip(other, Lanes::max)
    }
    fn abs(self) -> Self {
        Self(self.0.map(Lanes::abs))
    }
    fn copysign(self, sign: Self) -> Self {
        self.zip(sign, Lanes::copysign)
    }
    fn sqrt(self) -> Self {
        Self(self.0.map(Lanes::sqrt))
    }
    fn power_of_two(self) -> Self {
        Self(self.0.map(Lanes::power_of_two))
    }
    fn product(self, other: Self) -> (Self, Self) {
        (self.zip(other, |a, b| a.product(b).0), self.zip(other, |a, b| a.product(b).1))
    }
    fn lt(self, other: Self) -> Truths {
        self.compare(other, |a, b| a < b)
    }
    fn le(self, other: Self) -> Truths {
        self.compare(other, |a, b| a <= b)
    }
    fn eq(self, other: Self) -> Truths {
        self.compare(other, |a, b| a == b)
    }
    fn signs(self) -> u32 {
        (0..16).map(|i| self.0[i].signs() << i).sum()
    }
    fn select(self, mask: Truths, other: Self) -> Self {
        Self(from_fn(|i| self.0[i].select(mask.0[i], other.0[i])))
    }
    fn neighbours(self, table: &[i16]) -> [Self; 2] {
        [0, 1].map(|k| Self(self.0.map(|lane| lane.neighbours(table)[k])))
    }
    fn largest(self) -> f32 {
        self.0.into_iter().fold(f32::NEG_INFINITY, Lanes::max)
    }
    fn to_array(self) -> [f32; 16] {
        self.0
    }
}

/// Sixteen lanes by the method of the baseline.
macro_rules! by_baseline {
    ($($method:ident($($argument:ident: $type:ty),*)),*) => {
        $(fn $method(self, $($argument: $type),*) -> Singles {
            Singles(Baseline.$method($($argument),*).to_array())
        })*
    };
}

impl Simd for Scalar {
    type F8 = F8;
    type F16 = Singles;

    by_baseline!(
        splat16(value: f32), load16(values: &[f32; 16]), numbers16(first: u32),
        field16(words: &[u32; 16], from: u32, width: u32), bytes16(bytes: &[u8; 16]),
        powers16(words: &[u32; 16])
    );

    fn splat8(self, value: f32) -> F8 {
        Baseline.splat8(value)
    }
    fn load8(self, values: &[f32; 8]) -> F8 {
        Baseline.load8(values)
    }
    fn first8(self, n: u32) -> M8 {
        Baseline.first8(n)
    }
    fn mask16(self, bits: u32) -> Truths {
        Truths(from_fn(|i| bits >> i & 1 == 1))
    }
    fn push8(self, order: u32, entry: F8, exit: F8, items: &[f32; 8], stack: &mut Stack) {
        Baseline.push8(order, entry, exit, items, stack);
    }
    fn push8_unordered(self, entry: F8, exit: F8, items: &[f32; 8], stack: &mut Stack) {
        Baseline.push8_unordered(entry, exit, items, stack);
    }
    fn keep(self, limit: f32, stack: &mut Stack) {
        Baseline.keep(limit, stack);
    }
    fn pack16(self, wanted: Truths, lanes: Singles, out: &mut [f32; 16]) {
        Baseline.pack16(Baseline.mask16(wanted.bits()), Baseline.load16(&lanes.0), out);
    }
    fn pick16(self, table: Singles, which: Singles) -> Singles {
        Singles(which.0.map(|which| table.0[which as usize & 15]))
    }
    fn prefetch<T>(self, _: &[T], _: &[f32], _: bool, _: usize) {}
    fn splat16x9(
        self,
        values: &[f32],
        start: usize,
        stride: usize,
        axes: [usize; 3],
    ) -> Option<[[Singles; 3]; 3]> {
        let corners = gather9(values, start, stride, axes)?;
        Some(corners.map(|corner| corner.map(|value| Singles([value; 16]))))
    }
    fn load8x9(self, values: &[f32], start: usize, stride: usize, axes: [usize; 3]) -> Option<[[F8; 3]; 3]> {
        Baseline.load8x9(values, start, stride, axes)
    }
}
