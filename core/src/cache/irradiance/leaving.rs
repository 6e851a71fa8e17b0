//! Radiance that leaves a surface towards one viewer, with its derivatives: the sum of a lobe, whose weights
//! are those of the coefficients of incident radiance, and of a base in proportion to the irradiance.
//!
//! A lobe gathers light, so that its radiance changes faster than the irradiance: L_o = Σ w_k λ_k has the
//! gradient Σ w_k ∇λ_k and the Hessian Σ w_k Hess λ_k.

use super::Derivatives;
use crate::Rgb;
use crate::cache::radiance::{Projection, Weights, zernike::COUNT_MAX};
use crate::light::luminance;

/// Radiance in place of irradiance. `base` is the radiance of the base, in proportion to the irradiance of
/// these derivatives. `None` in a basis without Hessians.
pub(crate) fn leaving_light(
    light: &Projection,
    weights: &[Weights; 3],
    (base, irradiance): (Rgb, &Derivatives),
) -> Option<Derivatives> {
    let (light, change) = light.change()?;
    let of_channel = weights.each_ref().map(Weights::all);
    let radiance = |channel: usize| {
        let products =
            light.values[channel].iter().zip(of_channel[channel]).map(|(value, weight)| value * weight);
        products.sum::<f32>().max(0.0)
    };
    let of_luminance: [f32; COUNT_MAX] =
        core::array::from_fn(|k| luminance(Rgb::from_array(of_channel.map(|weights| weights[k]))));
    let part = luminance(base) / irradiance.luminance();
    let part = if part.is_finite() { part } else { 0.0 };
    Some(Derivatives {
        irradiance: Rgb::from_array(core::array::from_fn(radiance)) + base,
        gradient: core::array::from_fn(|channel| {
            change.gradient(channel, of_channel[channel]) + part * irradiance.gradient[channel]
        }),
        hessian: change.hessian(&of_luminance) + irradiance.hessian * part,
        ..*irradiance
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Level;
    use crate::cache::irradiance::CellFlux;
    use crate::cache::radiance::{Basis, GatherTables, Representation};
    use crate::cache::skies::Sky;
    use crate::memory::{Arena, Line};
    use core::f32::consts::PI;
    use std::vec;

    /// A lobe with the weight √π at degree 0 reflects E with its derivatives; a base of E/4 adds a quarter.
    #[test]
    fn light_of_lobe_and_base_has_the_derivatives_of_both() {
        const N: usize = 16;
        /// Tables of borders in eight and in four pieces.
        const PIECES: f32 = 0.01;
        let sky = Sky::with_hits(N, |[x, y, z]| (if x > 0.3 { 2.0 } else { 1.0 }, 0.5 + y * z, [0.0; 3]));
        let of = Representation { basis: Basis::Zernike, degree: 4 };
        let mut lines = vec![Line([0; 64]); GatherTables::footprint(N, of).bytes() / 64];
        let tables = GatherTables::build(N, of, &mut Arena::over(&mut lines)).unwrap();
        let mut lines = vec![Line([0; 64]); CellFlux::footprint(N).bytes() / 64];
        let flux = CellFlux::build(N, &mut Arena::over(&mut lines)).unwrap();
        let (level, hemisphere) = (Level::detect(), sky.hemisphere());
        let own = flux.derivatives(level, &hemisphere).unwrap();
        let weights = [Weights::new(&[libm::sqrtf(PI)]); 3];
        let base = own.irradiance * 0.25;
        let light = tables.project(level, &hemisphere).unwrap();
        let found = leaving_light(&light, &weights, (base, &own)).unwrap();
        let size = own.hessian.xx.abs() + own.hessian.xy.abs() + own.hessian.yy.abs();
        assert!(size > 0.1 && own.gradient[0].length() > 0.1, "{own:?}");
        assert!((found.irradiance / own.irradiance - 1.25).abs().max_element() < 1e-5);
        assert!((found.gradient[1] - 1.25 * own.gradient[1]).length() < PIECES * own.gradient[1].length());
        let (h, wanted) = (found.hessian, own.hessian * 1.25);
        for (found, wanted) in [(h.xx, wanted.xx), (h.xy, wanted.xy), (h.yy, wanted.yy)] {
            assert!((found - wanted).abs() < PIECES * size, "{found} {wanted}");
        }
    }
}
