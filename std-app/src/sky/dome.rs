//! Radiance of a clear sky (Hosek and Wilkie 2012, the RGB data of the authors) above, and of a diffuse ground
//! that sky and sun light below the horizon.

use super::UNITS;
use core::f64::consts::PI;
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};

/// Rows of the integral of the sky over the hemisphere.
const ROWS: usize = 64;

/// A sky with its ground.
#[derive(Clone, Copy, Debug)]
pub struct Dome {
    state: SkyState,
    ground: [f64; 3],
    irradiance: [f64; 3],
}

/// Parameters outside of the model: the sun is below the horizon, turbidity outside 1 to 10, or albedo
/// outside 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkyError;

impl Dome {
    /// The sky of a sun at so many degrees above the horizon, 0 to 90, for a `turbidity` of 1 (pure air) to 10
    /// (haze) and an `albedo` of the ground of 0 to 1, on which the sun shines with `of_sun`, the irradiance of
    /// a surface that faces it.
    ///
    /// # Errors
    /// Parameters outside of these ranges.
    pub fn new(elevation: f64, turbidity: f64, albedo: [f64; 3], of_sun: [f64; 3]) -> Result<Self, SkyError> {
        let parameters = SkyParams {
            elevation: elevation.to_radians() as f32,
            turbidity: turbidity as f32,
            albedo: albedo.map(|channel| channel as f32),
        };
        let state = SkyState::new(&parameters).map_err(|_| SkyError)?;
        let mut dome = Self { state, ground: [0.0; 3], irradiance: [0.0; 3] };
        dome.irradiance = dome.horizontal_irradiance(elevation.to_radians());
        let sine = elevation.to_radians().sin();
        dome.ground = core::array::from_fn(|i| albedo[i] / PI * (dome.irradiance[i] + sine * of_sun[i]));
        Ok(dome)
    }

    /// Radiance at an angle `theta` from the zenith and `gamma` from the sun, radians.
    pub fn radiance(&self, theta: f64, gamma: f64) -> [f64; 3] {
        if theta > 0.5 * PI {
            return self.ground;
        }
        let (theta, gamma) = (theta as f32, gamma as f32);
        [Channel::R, Channel::G, Channel::B]
            .map(|channel| UNITS * f64::from(self.state.radiance(theta, gamma, channel)).max(0.0))
    }

    /// Irradiance of a horizontal surface by the sky alone.
    pub fn irradiance(&self) -> [f64; 3] {
        self.irradiance
    }

    /// The midpoint rule in the squared sine of the polar angle and in the azimuth.
    fn horizontal_irradiance(&self, elevation: f64) -> [f64; 3] {
        let (sun_sin, sun_cos) = elevation.sin_cos();
        let mut sum = [0.0; 3];
        for row in 0..ROWS {
            let squared_sine = (row as f64 + 0.5) / ROWS as f64;
            let (sin, cos) = (squared_sine.sqrt(), (1.0 - squared_sine).sqrt());
            for column in 0..2 * ROWS {
                let azimuth = PI * (column as f64 + 0.5) / ROWS as f64;
                let cos_gamma = cos * sun_sin + sin * sun_cos * azimuth.cos();
                let radiance = self.radiance(cos.acos(), cos_gamma.clamp(-1.0, 1.0).acos());
                sum.iter_mut().zip(radiance).for_each(|(sum, radiance)| *sum += radiance);
            }
        }
        sum.map(|sum| sum * PI / (2 * ROWS * ROWS) as f64)
    }
}
