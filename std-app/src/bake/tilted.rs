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

#[cfg(test)]
mod tests {
    use super::*;

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
