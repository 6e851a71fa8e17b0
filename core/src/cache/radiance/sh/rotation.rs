//! Exact rotation of coefficients of real spherical harmonics, by the recurrence of Ivanic and Ruedenberg
//! (1996, with the correction of 1998).
//!
//! The functions of one order turn among themselves: order l is a matrix of (2l + 1)² entries, each a sum of
//! products of the rotation matrix and entries of order l - 1. No angles are needed, and there is no
//! singular axis. A rotation costs Σ (2l + 1)² products for each channel: 455 up to order 6, 969 up to 8.

use super::{COUNT_MAX, ORDER_MAX, index};
use glam::Mat3;

/// Entries of all matrices.
const ENTRIES: usize = (ORDER_MAX + 1) * (2 * ORDER_MAX + 1) * (2 * ORDER_MAX + 3) / 3;

/// Rotation of coefficients up to some order.
#[derive(Clone, Copy, Debug)]
pub struct ShRotation {
    order: usize,
    entries: [f32; ENTRIES],
}

impl ShRotation {
    /// Rotation of functions up to `order` by the matrix `by`: a function g becomes g(by⁻¹ w).
    pub fn new(by: &Mat3, order: usize) -> Self {
        let order = order.min(ORDER_MAX);
        let mut rotation = Self { order, entries: [0.0; ENTRIES] };
        rotation.entries[0] = 1.0;
        // Order 1 is (y, z, x).
        const AXES: [usize; 3] = [1, 2, 0];
        for (m, &row) in (-1..).zip(&AXES) {
            for (n, &column) in (-1..).zip(&AXES) {
                rotation.set(1, m, n, by.col(column)[row]);
            }
        }
        for l in 2..=order as isize {
            for m in -l..=l {
                for n in -l..=l {
                    let entry = rotation.next(l, m, n);
                    rotation.set(l, m, n, entry);
                }
            }
        }
        rotation
    }

    /// Turned coefficients; zeros beyond the order.
    pub fn apply(&self, coefficients: &[f32; COUNT_MAX]) -> [f32; COUNT_MAX] {
        let mut turned = [0.0; COUNT_MAX];
        for l in 0..=self.order as isize {
            for m in -l..=l {
                let products = (-l..=l).map(|n| self.at(l, m, n) * coefficients[index(l as usize, n)]);
                turned[index(l as usize, m)] = products.sum();
            }
        }
        turned
    }

    /// Position of the entry m, n of order l.
    fn entry(l: isize, m: isize, n: isize) -> usize {
        (l * (2 * l - 1) * (2 * l + 1) / 3 + (m + l) * (2 * l + 1) + n + l) as usize
    }

    fn at(&self, l: isize, m: isize, n: isize) -> f32 {
        self.entries.get(Self::entry(l, m, n)).copied().unwrap_or(0.0)
    }

    fn set(&mut self, l: isize, m: isize, n: isize, value: f32) {
        if let Some(entry) = self.entries.get_mut(Self::entry(l, m, n)) {
            *entry = value;
        }
    }

    /// P of the paper: row `i` of order 1 times entries of order l - 1.
    fn p(&self, i: isize, l: isize, m: isize, n: isize) -> f32 {
        let (high, low) = (l - 1, 1 - l);
        match n {
            n if n == l => {
                self.at(1, i, 1) * self.at(l - 1, m, high) - self.at(1, i, -1) * self.at(l - 1, m, low)
            }
            n if n == -l => {
                self.at(1, i, 1) * self.at(l - 1, m, low) + self.at(1, i, -1) * self.at(l - 1, m, high)
            }
            n => self.at(1, i, 0) * self.at(l - 1, m, n),
        }
    }

    /// Entry m, n of order l from those of order l - 1.
    fn next(&self, l: isize, m: isize, n: isize) -> f32 {
        let below = if n.abs() == l { 2 * l * (2 * l - 1) } else { (l + n) * (l - n) };
        let root = |above: isize| libm::sqrtf(above as f32 / below as f32);
        let size = m.abs();
        let mut sum = 0.0;
        if size < l {
            sum += root((l + m) * (l - m)) * self.p(0, l, m, n);
        }
        let v = root((l + size - 1) * (l + size));
        sum += if m == 0 { -libm::sqrtf(0.5) * v } else { 0.5 * v } * self.v(l, m, n);
        if m != 0 && size < l - 1 {
            let w = -0.5 * root((l - size - 1) * (l - size));
            let (a, b) = (self.p(1, l, m + m.signum(), n), self.p(-1, l, -m - m.signum(), n));
            sum += w * if m > 0 { a + b } else { a - b };
        }
        sum
    }

    /// V of the paper.
    fn v(&self, l: isize, m: isize, n: isize) -> f32 {
        let twice = libm::sqrtf(2.0);
        match m {
            0 => self.p(1, l, 1, n) + self.p(-1, l, -1, n),
            1 => twice * self.p(1, l, 0, n),
            -1 => twice * self.p(-1, l, 0, n),
            m if m > 0 => self.p(1, l, m - 1, n) - self.p(-1, l, 1 - m, n),
            m => self.p(1, l, m + 1, n) + self.p(-1, l, -m - 1, n),
        }
    }
}
