//! Error metrics: radii of the validity ellipse of a record, in its tangent plane, from its derivatives, by
//! rules of the literature and by our own.
//!
//! First-order extrapolation over an ellipse A has half of ∫ |dxᵀ H dx| over A as error. With eigenvalues l₁,
//! l₂ of H this is at most (π/8)(|l₁| R₁³ R₂ + |l₂| R₁ R₂³), and R = (4 ε/π|l|)^¼ along each axis makes it ε
//! if both are equal (Schwarzhaupt, Jensen, Jarosz 2012). ε is an integral over area, in units of the squared
//! extent of the scene, so that a scene in millimetres is cached as in kilometres.

use super::derivatives::{CellFlux, Derivatives, triangulated, unoccluded};
use crate::Level;
use crate::cache::hemisphere::Hemisphere;

/// Rule for the radii.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Metric {
    /// Harmonic mean of the distances (Ward 1988).
    SplitSphere,
    /// Harmonic mean of the distances, or E/|∇E| if smaller (Ward, Heckbert 1992; Křivánek et al. 2006).
    BoundedSplitSphere,
    /// Minimum distance (Tabellion, Lamorlette 2004).
    MinDistance,
    /// Hessian without occlusion (Jarosz et al. 2012), divided by the irradiance.
    RadiometricHessian,
    /// Sum of the magnitudes of this Hessian, for an environment of radiance 1.
    GeometricHessian,
    /// Hessian of the triangulated environment, with the two rules of the paper for black surroundings
    /// (Schwarzhaupt, Jensen, Jarosz 2012).
    OcclusionHessian,
    /// Hessian with a floor by the distances, a bound by the gradient, and a rule for black surroundings.
    Halflight,
}

/// Usual allowed error of the metrics by Hessians.
pub const HESSIAN_ERROR: f32 = 1e-4;

impl Metric {
    /// All metrics.
    pub const ALL: [Metric; 7] = [
        Metric::SplitSphere,
        Metric::BoundedSplitSphere,
        Metric::MinDistance,
        Metric::RadiometricHessian,
        Metric::GeometricHessian,
        Metric::OcclusionHessian,
        Metric::Halflight,
    ];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Metric::SplitSphere => "split-sphere",
            Metric::BoundedSplitSphere => "bounded-split-sphere",
            Metric::MinDistance => "min-distance",
            Metric::RadiometricHessian => "radiometric-hessian",
            Metric::GeometricHessian => "geometric-hessian",
            Metric::OcclusionHessian => "occlusion-hessian",
            Metric::Halflight => "halflight",
        }
    }

    /// Metric of this name.
    pub fn named(name: &str) -> Option<Metric> {
        Metric::ALL.into_iter().find(|metric| metric.name() == name)
    }

    /// True if the allowed error is a radius over a distance.
    pub const fn takes_distances(self) -> bool {
        matches!(self, Metric::SplitSphere | Metric::BoundedSplitSphere | Metric::MinDistance)
    }

    /// True if the metric needs the normals of the hits.
    pub const fn takes_normals(self) -> bool {
        matches!(self, Metric::RadiometricHessian | Metric::GeometricHessian)
    }

    /// True if the radii are those of limited radiances: a record with more light than others, by a few
    /// bright strata, must not have smaller radii for that.
    pub const fn limits_radiance(self) -> bool {
        matches!(self, Metric::Halflight)
    }

    /// Derivatives for this metric: by strata borders, so that all metrics extrapolate by equal gradients,
    /// with the Hessian of the metric; for [`Metric::OcclusionHessian`] all as in the paper. `None` if the
    /// tables have another number of strata, or normals are missing.
    pub fn derivatives(
        self,
        level: Level,
        tables: &CellFlux,
        hemisphere: &Hemisphere,
    ) -> Option<Derivatives> {
        if self == Metric::OcclusionHessian {
            return Some(triangulated(level, hemisphere));
        }
        let found = tables.derivatives(level, hemisphere)?;
        let hessian = match self {
            Metric::RadiometricHessian => unoccluded(hemisphere)?.radiometric,
            Metric::GeometricHessian => unoccluded(hemisphere)?.geometric,
            _ => found.hessian,
        };
        Some(Derivatives { hessian, ..found })
    }
}

/// Settings of a metric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The rule.
    pub metric: Metric,
    /// Allowed error, above 0. With a Hessian: ε in units of `extent`², relative to the irradiance of the
    /// record (or to `against`). Otherwise: the radius in units of the metric's distance.
    pub error: f32,
    /// Radius of the bounding sphere of the scene, or extent of its relevant part, m.
    pub extent: f32,
    /// Luminance of the irradiance to which errors are relative, if not that of each record; a constant gives
    /// an absolute error.
    pub against: Option<f32>,
    /// Maximum ratio of the longer to the shorter radius, at least 1; 1 makes circles.
    pub aspect: f32,
    /// Minimum radius, m: the projected size of a pixel.
    pub least: f32,
    /// Maximum radius, m.
    pub most: f32,
    /// Offset of both curvatures in units of the mean of 1/distance², for [`Metric::Halflight`].
    pub floor: f32,
}

/// Maximum radius of a record, in extents.
const MOST: f32 = 0.2;

impl Settings {
    /// Usual settings of `metric` in a scene of this `extent`: aspect up to 2 : 1, radii from 0 to a fifth of
    /// the extent.
    pub fn new(metric: Metric, extent: f32) -> Self {
        let error = if metric.takes_distances() { 0.3 } else { HESSIAN_ERROR };
        Self {
            metric,
            error,
            extent,
            against: None,
            aspect: 2.0,
            least: 0.0,
            most: MOST * extent,
            floor: 0.01,
        }
    }

    /// Settings if at most `size`, m, of the scene is visible: a room in a wide landscape gets the records
    /// that it would get without the landscape.
    pub fn within(self, size: f32) -> Self {
        let extent = self.extent.min(size);
        Self { extent, most: self.most.min(MOST * extent), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_name_their_metric() {
        for metric in Metric::ALL {
            assert_eq!(Metric::named(metric.name()), Some(metric));
        }
        assert_eq!(Metric::named("split"), None);
    }
}
