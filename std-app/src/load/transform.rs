//! Transform from file coordinates to core coordinates: centred on the scene and scaled by a
//! power of two, so that coordinates are about 1. The factor is exact: a scene scaled by a power of two gives
//! the same bits.

use glam::{DVec3, Vec3};
use halflight_core::scene::Camera;

/// `core = (user - offset) / 2^exponent`, computed in f64 and rounded last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneTransform {
    /// The point of the file that becomes the origin.
    pub offset: [f64; 3],
    /// A length of 2^exponent in the file is 1 in the core.
    pub exponent: i32,
}

impl SceneTransform {
    /// The identity.
    pub const IDENTITY: Self = Self { offset: [0.0; 3], exponent: 0 };

    /// Moves the centre of a bounding box to the origin and scales its longest side to 1 ... 2. The identity
    /// for an empty box, a translation for a box without extent.
    pub fn fitting(min: [f64; 3], max: [f64; 3]) -> Self {
        if !(0..3).all(|i| min[i] <= max[i]) {
            return Self::IDENTITY;
        }
        let offset = core::array::from_fn(|i| 0.5 * min[i] + 0.5 * max[i]);
        let longest = (0..3).map(|i| max[i] - min[i]).fold(0.0, f64::max);
        Self { offset, exponent: exponent(longest) }
    }

    /// Transforms a point.
    pub fn point(&self, user: [f64; 3]) -> Vec3 {
        self.point_f64(user).map(|x| x as f32).into()
    }

    /// Transforms a point, without rounding to f32.
    pub fn point_f64(&self, user: [f64; 3]) -> [f64; 3] {
        let factor = self.factor();
        core::array::from_fn(|i| (user[i] - self.offset[i]) * factor)
    }

    /// A pinhole camera given in the coordinates of the files.
    pub fn camera(&self, eye: [f64; 3], look_at: [f64; 3], up: [f64; 3], fov_degrees: f64) -> Camera {
        let along = direction(eye, look_at).unwrap_or(DVec3::NEG_Z);
        let up = direction([0.0; 3], up).unwrap_or(DVec3::Y);
        Camera::towards(self.point(eye), along.as_vec3(), up.as_vec3(), fov_degrees as f32)
    }

    /// Transforms a length.
    pub fn length(&self, user: f64) -> f64 {
        user * self.factor()
    }

    /// Factor on radiant intensities (W/sr) that keeps irradiances: the squared factor on lengths.
    pub fn intensity_factor(&self) -> f64 {
        self.factor() * self.factor()
    }

    /// Transforms a point back to the coordinates of the files.
    pub fn to_user(&self, core: Vec3) -> [f64; 3] {
        let core = core.to_array();
        core::array::from_fn(|i| f64::from(core[i]) / self.factor() + self.offset[i])
    }

    /// 2^-exponent, exactly.
    fn factor(&self) -> f64 {
        f64::from_bits(((1023 - i64::from(self.exponent.clamp(-1000, 1000))) as u64) << 52)
    }
}

/// The unit vector from one point to another; `None` if they are equal.
pub fn direction(from: [f64; 3], to: [f64; 3]) -> Option<DVec3> {
    let along = DVec3::from(to) - DVec3::from(from);
    (along / along.abs().max_element()).try_normalize()
}

/// The exponent e of x = m 2^e with 1 <= m < 2; 0 for zero, subnormal and infinite numbers.
fn exponent(x: f64) -> i32 {
    match (x.to_bits() >> 52) & 0x7ff {
        0 | 0x7ff => 0,
        biased => (biased as i32 - 1023).clamp(-500, 500),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_by_a_power_of_two_keeps_bits() {
        let min = [0.1, -2.7, 1e-3];
        let max = [55.3, 0.4, 0.7];
        let point = [17.31, -0.333, 0.0123];
        let plain = SceneTransform::fitting(min, max);
        for k in [-300, -20, -1, 1, 20, 300] {
            let by = |p: [f64; 3]| p.map(|x| x * 2f64.powi(k));
            let scaled = SceneTransform::fitting(by(min), by(max));
            assert_eq!(scaled.exponent, plain.exponent + k);
            assert_eq!(scaled.point(by(point)), plain.point(point));
            assert_eq!(scaled.length(2f64.powi(k)), plain.length(1.0));
        }
        assert!(plain.point(max).max_element() <= 1.0);
    }

    #[test]
    fn empty_and_point_boxes() {
        assert_eq!(
            SceneTransform::fitting([f64::INFINITY; 3], [-f64::INFINITY; 3]),
            SceneTransform::IDENTITY
        );
        let dot = SceneTransform::fitting([3.0; 3], [3.0; 3]);
        assert_eq!((dot.exponent, dot.point([3.0; 3])), (0, Vec3::ZERO));
        let there_and_back = SceneTransform { offset: [1.0, 2.0, 3.0], exponent: 3 };
        assert_eq!(there_and_back.to_user(there_and_back.point([5.0, 6.0, 7.0])), [5.0, 6.0, 7.0]);
    }
}
