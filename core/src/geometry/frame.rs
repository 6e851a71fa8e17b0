//! Orthonormal frame around a normal.

use glam::Vec3;

/// Right-handed orthonormal frame; local `z` is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x in world coordinates.
    pub tangent: Vec3,
    /// Local y in world coordinates.
    pub bitangent: Vec3,
    /// Local z in world coordinates.
    pub normal: Vec3,
}

impl Frame {
    /// Frame around a unit `normal`, continuous except across `normal.z` = 0 (Duff et al. 2017, "Building an
    /// Orthonormal Basis, Revisited").
    #[inline]
    pub fn from_normal(normal: Vec3) -> Self {
        let sign = 1f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// World direction of local `v`.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        v.x * self.tangent + v.y * self.bitangent + v.z * self.normal
    }

    /// Local direction of world `v`.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.tangent), v.dot(self.bitangent), v.dot(self.normal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for normal in [Vec3::X, Vec3::NEG_Z, Vec3::Z, Vec3::new(1e-20, 0.6, -0.8), Vec3::new(0.6, 0.0, -0.8)]
        {
            let f = Frame::from_normal(normal);
            assert!(f.tangent.dot(f.bitangent).abs() < 1e-6 && f.tangent.dot(normal).abs() < 1e-6);
            assert!(f.tangent.cross(f.bitangent).distance(normal) < 1e-6);
            assert!(
                f.to_world(f.to_local(Vec3::new(1.0, 2.0, 3.0))).distance(Vec3::new(1.0, 2.0, 3.0)) < 1e-5
            );
        }
    }
}
