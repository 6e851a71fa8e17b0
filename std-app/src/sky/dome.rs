//! Radiance of a clear sky (Hosek and Wilkie 2012, the RGB data of the authors) above, and of a diffuse
//! ground that sky and sun light below the horizon.

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

impl core::fmt::Display for SkyError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "the sky model has suns above the horizon, turbidities of 1 to 10 and albedos of 0 to 1")
    }
}

impl core::error::Error for SkyError {}

impl Dome {
    /// The sky of a sun at so many degrees above the horizon, 0 to 90, for a `turbidity` of 1 (pure air) to
    /// 10 (haze) and an `albedo` of the ground of 0 to 1. The sun gives a surface that faces it the
    /// irradiance `of_sun`.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Polar angle and azimuth from the sun in degrees, and the radiance there.
    type Sample = ([f64; 2], [f64; 3]);

    /// Elevation of the sun in degrees, turbidity and albedo, with the radiance of the model by Mitsuba 3.9.1
    /// (`sunsky` in RGB, times 106.857 and 683 / 179).
    #[rustfmt::skip]
    const REFERENCE: [([f64; 3], [Sample; 3]); 4] = [
        ([60.0, 3.0, 0.2], [
            ([0.0, 0.0], [14.2289, 21.7879, 41.0323]),
            ([40.0, 90.0], [12.5412, 22.3076, 44.4876]),
            ([85.0, 200.0], [47.575, 70.4063, 101.0878]),
        ]),
        ([35.0, 2.5, 0.0], [
            ([0.0, 0.0], [6.0501, 11.4681, 23.9107]),
            ([70.0, 0.0], [64.8186, 80.6922, 96.9042]),
            ([85.0, 200.0], [45.5778, 68.1783, 85.2]),
        ]),
        ([10.0, 6.0, 0.5], [
            ([0.0, 0.0], [5.2756, 8.5917, 13.2563]),
            ([40.0, 90.0], [8.6705, 12.8672, 17.8312]),
            ([70.0, 0.0], [212.0472, 162.7096, 89.4764]),
        ]),
        ([1.0, 1.0, 1.0], [
            ([0.0, 0.0], [2.0554, 2.8515, 3.1934]),
            ([40.0, 90.0], [3.4699, 4.485, 4.6933]),
            ([70.0, 0.0], [13.8339, 14.129, 10.7942]),
        ]),
    ];

    #[test]
    fn radiance_is_that_of_the_reference() {
        for ([elevation, turbidity, albedo], directions) in REFERENCE {
            let dome = Dome::new(elevation, turbidity, [albedo; 3], [0.0; 3]).unwrap();
            for ([theta, azimuth], expected) in directions {
                let (sun, theta) = (elevation.to_radians(), theta.to_radians());
                let cos = theta.cos() * sun.sin() + theta.sin() * sun.cos() * azimuth.to_radians().cos();
                let radiance = dome.radiance(theta, cos.acos());
                for i in 0..3 {
                    // Mitsuba interpolates in f32 too, in another order.
                    assert!((radiance[i] / expected[i] - 1.0).abs() < 2e-3, "{radiance:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn irradiance_is_that_of_a_fine_integral() {
        let dome = Dome::new(40.0, 4.0, [0.3; 3], [500.0; 3]).unwrap();
        let (sun_sin, sun_cos) = 40f64.to_radians().sin_cos();
        let (rows, mut sum) = (900, [0.0; 3]);
        for i in 0..rows {
            let theta = 0.5 * PI * (f64::from(i) + 0.5) / f64::from(rows);
            for j in 0..rows {
                let phi = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(rows);
                let cos = theta.cos() * sun_sin + theta.sin() * sun_cos * phi.cos();
                let radiance = dome.radiance(theta, cos.acos());
                for (sum, radiance) in sum.iter_mut().zip(radiance) {
                    *sum += radiance * theta.cos() * theta.sin() * (PI / f64::from(rows)).powi(2);
                }
            }
        }
        for (found, expected) in dome.irradiance().into_iter().zip(sum) {
            assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
        }
        let ground = dome.radiance(1.6, 1.0);
        let expected = 0.3 / PI * (dome.irradiance()[0] + 500.0 * sun_sin);
        assert!((ground[0] / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn parameters_outside_of_the_model_are_refused() {
        for [elevation, turbidity, albedo] in
            [[-1.0, 3.0, 0.2], [91.0, 3.0, 0.2], [9.0, 0.5, 0.2], [9.0, 3.0, 2.0]]
        {
            assert_eq!(Dome::new(elevation, turbidity, [albedo; 3], [0.0; 3]).err(), Some(SkyError));
        }
    }
}
