//! Sine and cosine of an angle within one turn: polynomials in f32, with the same bits on every target and
//! several times faster than a general routine.

use core::f32::consts::FRAC_PI_2;

/// (sin x, cos x) for |x| <= π/4, within 1 unit in the last place (minimax polynomials of Cephes).
#[inline]
pub(super) fn sin_cos_octant(x: f32) -> (f32, f32) {
    let z = x * x;
    let sin = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * x + x;
    let cos = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    (sin, cos)
}

/// (sin 2πu, cos 2πu) for u in [0, 1].
#[inline]
pub fn sin_cos_turns(u: f32) -> (f32, f32) {
    let quarters = 4.0 * u;
    let quadrant = (quarters + 0.5) as u32;
    let (sin, cos) = sin_cos_octant((quarters - quadrant as f32) * FRAC_PI_2);
    match quadrant & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two roundings of numbers up to 1, and one of the angle.
    const TOLERANCE: f64 = 2e-7;

    #[test]
    fn agrees_with_the_standard_library() {
        for i in 0..=100_000 {
            let u = i as f32 / 100_000.0;
            let (sin, cos) = sin_cos_turns(u);
            let angle = f64::from(u) * core::f64::consts::TAU;
            assert!((f64::from(sin) - angle.sin()).abs() < TOLERANCE, "{u}");
            assert!((f64::from(cos) - angle.cos()).abs() < TOLERANCE, "{u}");
        }
    }
}
