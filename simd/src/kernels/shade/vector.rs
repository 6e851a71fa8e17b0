//! Vectors of three lanes, with the order of operations of scalar vectors.

use crate::lanes::{Lanes, dot};

/// a + b.
#[inline(always)]
pub fn add<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> [L; 3] {
    [a + x, b + y, c + z]
}

/// a - b.
#[inline(always)]
pub fn sub<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> [L; 3] {
    [a - x, b - y, c - z]
}

/// Product of the components.
#[inline(always)]
pub fn mul<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> [L; 3] {
    [a * x, b * y, c * z]
}

/// Vector times number.
#[inline(always)]
pub fn scale<L: Lanes>([a, b, c]: [L; 3], factor: L) -> [L; 3] {
    [a * factor, b * factor, c * factor]
}

/// Vector over number.
#[inline(always)]
pub fn divide<L: Lanes>([a, b, c]: [L; 3], divisor: L) -> [L; 3] {
    [a / divisor, b / divisor, c / divisor]
}

/// -a.
#[inline(always)]
pub fn negate<L: Lanes>([a, b, c]: [L; 3]) -> [L; 3] {
    [-a, -b, -c]
}

/// |a|, component by component.
#[inline(always)]
pub fn abs<L: Lanes>([a, b, c]: [L; 3]) -> [L; 3] {
    [a.abs(), b.abs(), c.abs()]
}

/// Larger of the components.
#[inline(always)]
pub fn max<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> [L; 3] {
    [a.max(x), b.max(y), c.max(z)]
}

/// Largest component.
#[inline(always)]
pub fn largest<L: Lanes>([a, b, c]: [L; 3]) -> L {
    a.max(b.max(c))
}

/// a × b.
#[inline(always)]
pub fn cross<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> [L; 3] {
    [b * z - y * c, c * x - z * a, a * y - x * b]
}

/// |a|².
#[inline(always)]
pub fn square<L: Lanes>(a: [L; 3]) -> L {
    dot(a, a)
}

/// |a|.
#[inline(always)]
pub fn length<L: Lanes>(a: [L; 3]) -> L {
    square(a).sqrt()
}

/// `a` in lanes where `mask` is set, `b` elsewhere.
#[inline(always)]
pub fn select<L: Lanes>(mask: L::Mask, [a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> [L; 3] {
    [a.select(mask, x), b.select(mask, y), c.select(mask, z)]
}

/// The lanes as arrays.
#[inline(always)]
pub fn to_arrays<L: Lanes>([a, b, c]: [L; 3]) -> [L::Array; 3] {
    [a.to_array(), b.to_array(), c.to_array()]
}
