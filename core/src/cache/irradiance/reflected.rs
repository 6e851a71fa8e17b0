//! Interpolation of the radiance that a lobe reflects, from the valid records with coefficients of a cache.
//!
//! Coefficients are extrapolated to first order, so that their error grows with the square of the distance.
//! Only records that cover a point supply it, whatever their overlap; where neighbours have shrunk all of
//! these, the records with a support there do.

use super::{IrradianceCache, QueryPoint, Record};
use crate::cache::radiance::{PooledRecord, RecordCoefficients, ServedLobe, Weights};
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

/// Supports of the records that supply a lobe, in radii, until one record is found.
const SUPPORTS: [f32; 2] = [1.0, f32::INFINITY];

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
        SUPPORTS.into_iter().find_map(|support| {
            let (mut sum, mut weights, mut turned) = (Rgb::ZERO, 0.0, None);
            self.visit_lobes(point, support, |(record, pooled), weight| {
                if let Some(radiance) =
                    of_record(level, coefficients, (record, pooled), (point, viewer), &mut turned)
                {
                    sum += weight * radiance;
                    weights += weight;
                }
                !(first_alone && weights > 0.0)
            });
            (weights > 0.0).then(|| sum / weights)
        })
    }
}

/// Radiance that a record extrapolates for the lobe of `viewer` at `point`.
fn of_record(
    level: Level,
    coefficients: &RecordCoefficients,
    (record, pooled): (&Record, &PooledRecord),
    (point, viewer): (&QueryPoint, &Viewer),
    turned: &mut Option<Turned>,
) -> Option<Rgb> {
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
