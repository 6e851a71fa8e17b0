//! Lookups at normals other than a record's, without a rotation of coefficients.
//!
//! A surface of normal n mirrors the viewer's direction ω_o to r = 2 (ω_o·n) n - ω_o. The lobe that surrounds
//! r belongs, over the record's normal n_i, to a viewer at ω' = 2 (r·n_i) n_i - r. The radiance that leaves
//! towards ω_o is that which the record has for ω', times the ratio of the albedos at both angles: exact if n
//! = n_i, and exact for radiance 1. The lobe stays within the hemisphere that the record saw; light from
//! below its horizon is missing, which costs 1 % at a tenth of a radian.

use glam::Vec3;

/// Minimum cosine of ω' at the record's normal.
const COSINE_MIN: f32 = 0.05;

/// Viewer ω' of the record's normal `recorded` for the viewer `wo` of `normal`, all unit and in one space.
/// `None` if the record cannot serve this lobe.
///
/// ```
/// use glam::Vec3;
/// use halflight_core::cache::radiance::mirrored_viewer;
/// // A surface turned by 0.1 mirrors to 0.2 farther; so does the record for a viewer 0.2 farther.
/// let at = |angle: f32| Vec3::new(angle.sin(), 0.0, angle.cos());
/// let found = mirrored_viewer(at(0.5), at(-0.1), Vec3::Z).unwrap();
/// assert!((found - at(0.7)).length() < 1e-6);
/// ```
pub fn mirrored_viewer(wo: Vec3, normal: Vec3, recorded: Vec3) -> Option<Vec3> {
    if normal == recorded {
        return Some(wo);
    }
    let mirrored = 2.0 * wo.dot(normal) * normal - wo;
    let viewer = 2.0 * mirrored.dot(recorded) * recorded - mirrored;
    (viewer.dot(recorded) >= COSINE_MIN).then_some(viewer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_record_mirrors_its_viewer_where_the_surface_mirrors_its_own() {
        let (n, recorded) = (Vec3::new(0.1, -0.05, 1.0).normalize(), Vec3::new(-0.02, 0.0, 1.0).normalize());
        let wo = Vec3::new(0.3, 0.5, 0.6).normalize();
        let viewer = mirrored_viewer(wo, n, recorded).unwrap();
        let mirror = |w: Vec3, n: Vec3| 2.0 * w.dot(n) * n - w;
        assert!((mirror(viewer, recorded) - mirror(wo, n)).length() < 1e-6);
        assert!((viewer.length() - 1.0).abs() < 1e-6);
        assert_eq!(mirrored_viewer(wo, n, n), Some(wo));
    }

    #[test]
    fn lobes_that_leave_the_hemisphere_have_no_viewer() {
        let wo = Vec3::new(0.99, 0.0, 0.141).normalize();
        assert_eq!(mirrored_viewer(wo, Vec3::new(-0.2, 0.0, 0.98).normalize(), Vec3::Z), None);
        assert_eq!(mirrored_viewer(Vec3::NAN, Vec3::X, Vec3::Z), None);
    }
}
