//! Irradiance as a linear function of the normal, from a normal and three tilted ones (HL2 basis, McTaggart
//! 2004).

use glam::Vec3;
use halflight_core::geometry::Frame;

/// A normal and three of 54.7° from it, which are orthogonal.
pub(super) fn with_tilted(normal: Vec3) -> [Vec3; 4] {
    let frame = Frame::from_normal(normal);
    let (up, out) = (1.0 / 3f32.sqrt(), (2.0 / 3f32).sqrt());
    let tilted =
        |cos: f32, sin: f32| (up * normal + out * (cos * frame.tangent + sin * frame.bitangent)).normalize();
    let half = 0.5 * 3f32.sqrt();
    [normal, tilted(1.0, 0.0), tilted(-0.5, half), tilted(-0.5, -half)]
}

/// The constant and the gradient of the linear function with `values` at the normals of [`with_tilted`].
pub(super) fn linear(normals: [Vec3; 4], values: [f32; 4]) -> (f32, Vec3) {
    let [value, tilted @ ..] = values;
    let root = 3f32.sqrt();
    let constant = (tilted.iter().sum::<f32>() / root - value) / (root - 1.0);
    let slope = |i: usize| (tilted[i] - constant) * normals[i + 1];
    (constant, slope(0) + slope(1) + slope(2))
}

/// The linear function with this `value` at a `normal` and with the direction of `slope`, whose slope is at
/// most twice its constant, as for light from any directions (degree 1 of spherical harmonics).
pub(super) fn bounded(normal: Vec3, value: f32, slope: Vec3) -> (f32, Vec3) {
    let value = value.max(0.0);
    let (along, half) = (slope.dot(normal), 0.5 * slope.length());
    let kept = if value - along < half { value / (along + half) } else { 1.0 };
    (value - kept * along, kept * slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_is_bounded_and_the_value_at_the_normal_is_kept() {
        let normal = Vec3::new(0.6, -0.48, 0.64);
        for (value, slope) in [
            (1.0, Vec3::ZERO),
            (1.0, 0.5 * normal),
            (1.0, normal),
            (1.0, Vec3::new(3.0, 1.0, -2.0)),
            (1e-3, -normal),
            (0.0, normal),
            (-0.1, Vec3::X),
        ] {
            let (constant, bent) = bounded(normal, value, slope);
            let at_normal = constant + bent.dot(normal);
            assert!((at_normal - value.max(0.0)).abs() < 1e-6, "{value} {slope}: {at_normal}");
            assert!(bent.length() <= 2.0 * constant + 1e-6 && bent.dot(slope) >= 0.0, "{constant} {bent}");
        }
        // A slope within the bound is kept.
        assert_eq!(bounded(normal, 1.0, 0.5 * normal), (1.0 - 0.5 * normal.dot(normal), 0.5 * normal));
    }

    #[test]
    fn a_linear_function_has_its_values_back() {
        for normal in [Vec3::Y, Vec3::new(0.6, -0.48, 0.64), Vec3::NEG_Z] {
            let normals = with_tilted(normal);
            let (constant, slope) = (0.7, Vec3::new(0.3, -0.2, 0.1));
            let (a, b) = linear(normals, normals.map(|n| constant + slope.dot(n)));
            assert!((a - constant).abs() < 1e-5 && b.distance(slope) < 1e-5, "{a} {b}");
            assert!((1..4).all(|i| (normals[i].dot(normal) - 1.0 / 3f32.sqrt()).abs() < 1e-6));
        }
    }
}
