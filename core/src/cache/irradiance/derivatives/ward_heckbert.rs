//! Gradients of Ward and Heckbert (1992), transferred from polar strata to those of the concentric map: a
//! border between strata moves with the nearer of both, and has the length and height of its midpoint. First
//! order only. For comparison.

use super::{Derivatives, rotation_by_samples};
use crate::Rgb;
use crate::cache::hemisphere::Hemisphere;
use crate::sampling::warp::cosine_hemisphere;
use glam::{Vec2, Vec3};
use halflight_simd::kernels::jumps::Sums;

/// Irradiance and its gradients.
pub fn ward_heckbert(hemisphere: &Hemisphere) -> Derivatives {
    let n = hemisphere.n();
    let corner = |j: usize, i: usize| cosine_hemisphere([j as f32 / n as f32, i as f32 / n as f32]);
    let stratum = |i: usize, j: usize| {
        let at = i * n + j;
        let radiance = hemisphere.radiance().get(at).copied().map(Rgb::from)?;
        Some((radiance, hemisphere.inverse_distance().get(at).copied()?))
    };
    let mut gradient = [Vec2::ZERO; 3];
    let mut add = |here: (usize, usize), there: (usize, usize), a: Vec3, b: Vec3| {
        let (Some((l, u)), Some((m, v))) = (stratum(here.0, here.1), stratum(there.0, there.1)) else {
            return;
        };
        // Cosine of the midpoint, times length, times normal.
        let border = 0.5 * (a.z + b.z) * a.cross(b).truncate();
        for (sum, jump) in gradient.iter_mut().zip((l - m).to_array()) {
            *sum += jump * u.max(v) * border;
        }
    };
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        // Counter-clockwise around the stratum (i, j).
        let across = corner(j + 1, i + 1);
        if j + 1 < n {
            add((i, j), (i, j + 1), corner(j + 1, i), across);
        }
        if i + 1 < n {
            add((i, j), (i + 1, j), across, corner(j, i + 1));
        }
    }
    let still = Derivatives::of(hemisphere, &Sums::default());
    Derivatives { gradient, rotation: rotation_by_samples(hemisphere), ..still }
}
