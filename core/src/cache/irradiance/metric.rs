//! How far a record of irradiance may be used: from its derivatives to the two radii of an ellipse in its
//! tangent plane, by any of the rules of the literature and by ours.
//!
//! First-order extrapolation over an ellipse A misses half of ∫ |dxᵀ H dx| over A; of values l₁, l₂ of H that
//! is at most (π/8)(|l₁| R₁³ R₂ + |l₂| R₁ R₂³), and R = (4 ε/π|l|)^¼ along each axis makes it ε where both
//! are equal (Schwarzhaupt, Jensen, Jarosz 2012). ε is an integral over an area: we measure it in the square
//! of the scene's extent, so that a scene in millimetres is cached as the same in kilometres.

use super::derivatives::{CellFlux, Derivatives, triangulated, unoccluded};
use super::hemisphere::Hemisphere;
use crate::Level;

/// A rule for the radii.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Metric {
    /// Harmonic mean of the distances (Ward 1988).
    SplitSphere,
    /// The same, or E/|∇E| where that is less (Ward, Heckbert 1992; Křivánek et al. 2006).
    BoundedSplitSphere,
    /// The least distance (Tabellion, Lamorlette 2004).
    MinDistance,
    /// The Hessian without occlusion (Jarosz et al. 2012), divided by the irradiance.
    RadiometricHessian,
    /// The same of an environment of radiance 1: the sum of its magnitudes.
    GeometricHessian,
    /// The Hessian of the triangulated environment with the two rules of the paper for black surroundings
    /// (Schwarzhaupt, Jensen, Jarosz 2012).
    OcclusionHessian,
    /// The Hessian with a floor by the distances, a bound by the gradient, and a way out of black
    /// surroundings.
    Halflight,
}

impl Metric {
    /// All of them.
    pub const ALL: [Metric; 7] = [
        Metric::SplitSphere,
        Metric::BoundedSplitSphere,
        Metric::MinDistance,
        Metric::RadiometricHessian,
        Metric::GeometricHessian,
        Metric::OcclusionHessian,
        Metric::Halflight,
    ];

    /// Its name on the command line.
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

    /// The metric of that name.
    pub fn named(name: &str) -> Option<Metric> {
        Metric::ALL.into_iter().find(|metric| metric.name() == name)
    }

    /// Whether its error is the radius over a distance.
    pub const fn takes_distances(self) -> bool {
        matches!(self, Metric::SplitSphere | Metric::BoundedSplitSphere | Metric::MinDistance)
    }

    /// Whether it needs the normals of what the hemisphere sees.
    pub const fn takes_normals(self) -> bool {
        matches!(self, Metric::RadiometricHessian | Metric::GeometricHessian)
    }

    /// The derivatives that it is made for: those of the borders of strata (so that all metrics extrapolate
    /// by the same gradients) with its own Hessian; of [`Metric::OcclusionHessian`] all as in the paper.
    /// `None` where the tables are of another number of strata, or normals are missing.
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

/// What the radii are to hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The rule.
    pub metric: Metric,
    /// Error allowed, above 0. With a Hessian: ε in units of `extent`², relative to the irradiance of the
    /// record (or to `against`). Otherwise: the radius in units of the distance that the rule takes.
    pub error: f32,
    /// Size of the scene (radius of its bounding sphere), m, or of the part of it that matters.
    pub extent: f32,
    /// The irradiance (luminance) that errors are relative to, where it is not each record's own: a constant
    /// is an absolute error.
    pub against: Option<f32>,
    /// Most that the longer radius may be of the shorter, at least 1; 1 makes circles.
    pub aspect: f32,
    /// Least radius, m: the projected size of a pixel.
    pub least: f32,
    /// Largest radius, m.
    pub most: f32,
    /// Of [`Metric::Halflight`]: what is added to both curvatures, in units of the mean of 1/distance².
    pub floor: f32,
}

/// Largest radius of a record, in extents.
const MOST: f32 = 0.2;

impl Settings {
    /// `metric` with its usual settings in a scene of that extent: axes up to 2 : 1, radii from 0 to a fifth
    /// of the extent.
    pub fn new(metric: Metric, extent: f32) -> Self {
        let error = if metric.takes_distances() { 0.3 } else { 1e-4 };
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

    /// The same where no more than `size`, m, of the scene is seen: a room in a wide landscape is to have the
    /// records that it has without.
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
