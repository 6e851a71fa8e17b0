//! Interpolation of the radiance that a lobe reflects, from the valid records with coefficients of a cache.

use super::{IrradianceCache, QueryPoint, Record};
use crate::cache::radiance::{RecordCoefficients, ServedLobe, Weights};
use crate::geometry::Frame;
use crate::{Level, Rgb};
use glam::Vec3;

/// Viewer of a lobe at a point.
pub(crate) struct Viewer<'l, 'm> {
    /// Lobe of the surface.
    pub(crate) lobe: &'l ServedLobe<'m>,
    /// Unit direction to the viewer, in world space.
    pub(crate) direction: Vec3,
}

/// Weights for the normal of the last record. Records of a flat surface have equal ones.
struct Turned {
    frame: Frame,
    weights: Option<[Weights; 3]>,
}

impl Turned {
    fn new(point: &QueryPoint, viewer: &Viewer, normal: Vec3) -> Self {
        let frame = Frame::from_normal(normal);
        let weights = viewer.lobe.weights(&frame, point.normal, viewer.direction);
        Self { frame, weights }
    }
}

impl IrradianceCache<'_> {
    /// Radiance that the lobe of `viewer` reflects at `point`, weighted as the irradiance is. With
    /// `first_alone` the first valid record is enough. `None` if no valid record has coefficients.
    pub(crate) fn reflected(
        &self,
        level: Level,
        point: &QueryPoint,
        viewer: &Viewer,
        first_alone: bool,
    ) -> Option<Rgb> {
        let coefficients = self.coefficients()?;
        let (mut sum, mut weights, mut turned) = (Rgb::ZERO, 0.0, None);
        self.visit_numbered(point, |number, record, weight| {
            if let Some(radiance) =
                of_record(level, coefficients, (number, record), (point, viewer), &mut turned)
            {
                sum += weight * radiance;
                weights += weight;
            }
            !(first_alone && weights > 0.0)
        });
        (weights > 0.0).then(|| sum / weights)
    }
}

/// Radiance that a record extrapolates for the lobe of `viewer` at `point`.
fn of_record(
    level: Level,
    coefficients: &RecordCoefficients,
    (number, record): (u32, &Record),
    (point, viewer): (&QueryPoint, &Viewer),
    turned: &mut Option<Turned>,
) -> Option<Rgb> {
    let pooled = coefficients.of(number)?;
    let normal = Vec3::from(record.normal);
    let known = match turned.take() {
        Some(known) if known.frame.normal == normal => known,
        _ => Turned::new(point, viewer, normal),
    };
    let known = turned.insert(known);
    let [red, green, blue] = known.weights.as_ref()?;
    let delta = known.frame.to_local(point.position - Vec3::from(record.position)).truncate();
    Some(coefficients.pool().reflected_by(level, pooled, [red, green, blue], delta))
}

#[cfg(test)]
mod tests;
