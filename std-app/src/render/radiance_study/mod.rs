//! Studies of radiance caching in rooms of known light: bases of incident radiance by the error of reflected
//! light, derivatives of coefficients against exact ones, error metrics at equal numbers of records, and
//! times.

mod bases;
mod degrees;
mod gradients;
mod metrics;
mod picture;
mod polygons;
mod rooms;
mod times;

pub use bases::{ALPHAS, BasisError};
pub use degrees::{ANGLES as STUDY_ANGLES, LobeDegrees};
pub use gradients::GradientError;
pub use metrics::{RECORDS as STUDY_RECORDS, RadianceMetricError};
pub use times::RadianceTimes;

use super::RenderError;
use crate::save::Image;

/// Errors of bases of incident radiance, by the number of coefficients.
pub fn study_bases() -> Result<Vec<BasisError>, RenderError> {
    Ok(bases::errors()?)
}

/// Errors of derivatives in every room with each number of strata along a side; calls `report` after each.
pub fn study_gradients(strata: &[usize], report: &mut dyn FnMut(&GradientError)) -> Result<(), RenderError> {
    for room in &gradients::ROOMS {
        for &strata in strata {
            report(&gradients::errors(room, strata)?);
        }
    }
    Ok(())
}

/// Errors between records by error metrics at equal numbers of records; calls `report` after each.
pub fn study_radiance_metrics(report: &mut dyn FnMut(&RadianceMetricError)) -> Result<(), RenderError> {
    Ok(metrics::errors(report)?)
}

/// Floor of the box between 150 records: errors by split-sphere on the left, by the larger Hessian on the
/// right.
pub fn picture_of_radiance_metrics() -> Result<Image, RenderError> {
    Ok(picture::picture()?)
}

/// Degrees of lobes within tolerances.
pub fn study_lobe_degrees() -> Result<Vec<LobeDegrees>, RenderError> {
    Ok(degrees::degrees()?)
}

/// Times of look-ups and of the coefficients of a record.
pub fn study_radiance_times() -> Result<Vec<RadianceTimes>, RenderError> {
    Ok(times::times()?)
}

/// xorshift64*.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }
}
