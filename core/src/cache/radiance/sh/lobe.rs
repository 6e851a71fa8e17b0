//! Coefficients of a lobe for one direction of the viewer, and the lowest order within a tolerance (Křivánek
//! et al. 2005).
//!
//! The viewer is in the plane of x and z, so that functions with a sine have no coefficient. The error of an
//! order is the norm of the part of f cos θ beyond it, over the norm of f cos θ.

use super::{COUNT_MAX, ORDER_MAX, index, values};
use core::f32::consts::{FRAC_PI_2, PI};
use glam::{Vec2, Vec3};

/// Midpoints over the angle of the light, and over half of its azimuth.
const POINTS: usize = 96;
/// Functions with m >= 0.
const ROWS: usize = 45;

/// Lobe f cos θ for one angle of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShLobe {
    /// Coefficients for m >= 0, by order and m.
    rows: [f32; ROWS],
    /// ∫ (f cos θ)² dω.
    square: f32,
}

/// Order and m of each row.
fn rows() -> impl Iterator<Item = (usize, usize)> {
    (0..=ORDER_MAX).flat_map(|l| (0..=l).map(move |m| (l, m)))
}

impl ShLobe {
    /// Projects f cos θ, a function of the unit direction of the light with z >= 0 that is even in y.
    pub fn project(f_cos: impl Fn(Vec3) -> f32) -> Self {
        let mut lobe = Self { rows: [0.0; ROWS], square: 0.0 };
        for at in 0..POINTS * POINTS {
            let [theta, phi] = [(at / POINTS, FRAC_PI_2), (at % POINTS, PI)]
                .map(|(i, end)| (i as f32 + 0.5) * end / POINTS as f32);
            let sin = libm::sinf(theta);
            let w = Vec3::new(sin * libm::cosf(phi), sin * libm::sinf(phi), libm::cosf(theta));
            // Both halves of the azimuth.
            let weight = 2.0 * sin * FRAC_PI_2 * PI / (POINTS * POINTS) as f32;
            let (f, values) = (f_cos(w), values(ORDER_MAX, w.to_array()));
            for (row, (l, m)) in lobe.rows.iter_mut().zip(rows()) {
                *row += weight * f * values[index(l, m as isize)];
            }
            lobe.square += weight * f * f;
        }
        lobe
    }

    /// Lowest order whose error is within `tolerance`. `None` if it exceeds `most`: the lobe is then to be
    /// sampled.
    pub fn order(&self, tolerance: f32, most: usize) -> Option<usize> {
        let mut rest = self.square;
        let mut rows = self.rows.iter();
        (0..=most.min(ORDER_MAX)).find(|l| {
            rows.by_ref().take(l + 1).for_each(|row| rest -= row * row);
            rest <= tolerance * tolerance * self.square
        })
    }

    /// Coefficients for a viewer at the azimuth of `towards`; at azimuth 0 if it is zero.
    pub fn turned(&self, towards: Vec2) -> [f32; COUNT_MAX] {
        let unit = towards.normalize_or(Vec2::X);
        let mut turns = [Vec2::X; ORDER_MAX + 1];
        for m in 1..turns.len() {
            turns[m] = unit.rotate(turns[m - 1]);
        }
        let mut found = [0.0; COUNT_MAX];
        for (row, (l, m)) in self.rows.iter().zip(rows()) {
            found[index(l, -(m as isize))] = row * turns[m].y;
            found[index(l, m as isize)] = row * turns[m].x;
        }
        found
    }
}
