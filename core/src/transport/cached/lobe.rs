//! Gathering of coefficients beside the irradiance, and the light that leaves a gather point with a lobe
//! towards its viewer.

use crate::Rgb;
use crate::bsdf::Features;
use crate::cache::irradiance::{Derivatives, leaving_light};
use crate::cache::radiance::{GatherTables, Projection, ServedLobes};
use crate::geometry::{Frame, Hit, Ray};
use crate::transport::cached::gather_point::GatherPoint;
use crate::transport::path::{LightEstimator, PathIntegrator};
use glam::Vec3;

/// Gathering of coefficients beside the irradiance.
pub struct CoefficientGathering<'g> {
    /// Tables of the basis for the number of strata to gather.
    pub tables: &'g GatherTables<'g>,
    /// Lobes that the records serve.
    pub lobes: &'g ServedLobes<'g>,
    /// Registers of the record, beside those of its tables.
    pub registers: &'g mut [[u16; 16]],
}

impl<F: Features, E: LightEstimator<F>> PathIntegrator<'_, F, E> {
    /// Radiance that leaves `place` towards its viewer by lobe and base, with derivatives, from `light` in
    /// the frame of the point, its M₅ and the derivatives of its irradiance. `None` without a served lobe,
    /// or in a basis without second derivatives.
    pub(super) fn leaving_light(
        &self,
        place: &GatherPoint,
        (frame, of): (&Frame, &CoefficientGathering),
        light: &Projection,
        (edge_moment, irradiance): (Rgb, &Derivatives),
    ) -> Option<Derivatives> {
        let (viewer, [u, v]) = (Vec3::from(place.viewer), place.barycentrics);
        let ray = Ray::new(place.position() + viewer, -viewer);
        let point = self.context.surface_at(&ray, &Hit { t: 1.0, u, v, triangle: place.triangle })?;
        let bsdf = self.context.bsdf_at(&point);
        let lobe = of.lobes.find(&bsdf, viewer.dot(place.normal()))?;
        let weights = lobe.weights(frame, place.normal(), viewer)?;
        let base = match bsdf.has_coated_base() {
            true => {
                let wo = frame.to_local(viewer);
                bsdf.base_radiance(wo, irradiance.irradiance, edge_moment)
            }
            false => Rgb::ZERO,
        };
        leaving_light(light, &weights, (base, irradiance))
    }
}
