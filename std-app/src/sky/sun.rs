//! Irradiance of the sun through a clear atmosphere (Preetham, Shirley and Smits 1999, appendix A.1, by the
//! data of Iqbal 1983), as linear sRGB by the colour matching functions of Wyman, Sloan and Shirley (2013).

use super::UNITS;

/// Mean angular radius of the sun, degrees.
pub const RADIUS_DEGREES: f64 = 0.2665;

/// First wavelength of the tables and their step, nm.
const WAVELENGTHS: [f64; 2] = [380.0, 10.0];

/// Radiance of the sun outside the atmosphere, W/(cm² µm sr).
const RADIANCE: [f64; 38] = [
    1655.9, 1623.37, 2112.75, 2588.82, 2582.91, 2423.23, 2676.05, 2965.83, 3054.54, 3005.75, 3066.37,
    2883.04, 2871.21, 2782.5, 2710.06, 2723.36, 2636.13, 2550.38, 2506.02, 2531.16, 2535.59, 2513.42,
    2463.15, 2417.32, 2368.37, 2321.21, 2282.77, 2233.98, 2197.02, 2152.67, 2109.79, 2072.83, 2024.05,
    1987.16, 1942.71, 1907.24, 1862.89, 1825.92,
];

/// Absorption by ozone, 1/cm, from 450 nm on.
const OZONE: [f64; 31] = [
    0.003, 0.006, 0.009, 0.014, 0.021, 0.03, 0.04, 0.048, 0.063, 0.075, 0.085, 0.103, 0.12, 0.12, 0.115,
    0.125, 0.12, 0.105, 0.09, 0.079, 0.067, 0.057, 0.048, 0.036, 0.028, 0.023, 0.018, 0.014, 0.011, 0.01,
    0.009,
];

/// Absorption by water vapour, 1/cm, from 690 nm on.
const WATER: [f64; 7] = [0.016, 0.024, 0.0125, 1.0, 0.87, 0.061, 0.001];

/// Depth of the ozone layer and of precipitable water, cm.
const LAYERS: [f64; 2] = [0.35, 2.0];

/// Irradiance of the sun at so many degrees above the horizon on a surface that faces it, in the units of
/// the [module](super), at the mean distance of the sun. `turbidity` is 1 (pure air) to 10 (haze).
pub fn irradiance(elevation: f64, turbidity: f64) -> [f64; 3] {
    let zenith = (90.0 - elevation).clamp(0.0, 90.0);
    let mass = 1.0 / (zenith.to_radians().cos() + 0.15 * (93.885 - zenith).powf(-1.253));
    let beta = (0.04608365822050 * turbidity - 0.04586025928522).max(0.0);
    let [ozone_depth, water_depth] = LAYERS;
    let sin = RADIUS_DEGREES.to_radians().sin();
    let mut xyz = [0.0; 3];
    for (i, radiance) in RADIANCE.into_iter().enumerate() {
        let wavelength = WAVELENGTHS[0] + WAVELENGTHS[1] * i as f64;
        let micrometres = wavelength / 1000.0;
        let ozone = i.checked_sub(7).and_then(|i| OZONE.get(i)).copied().unwrap_or(0.0);
        let water = i.checked_sub(31).and_then(|i| WATER.get(i)).copied().unwrap_or(0.0) * water_depth * mass;
        let depth = 0.008735 * micrometres.powf(-4.08) * mass
            + beta * micrometres.powf(-1.3) * mass
            + ozone * ozone_depth * mass
            + 0.2385 * water / (1.0 + 20.07 * water).powf(0.45);
        // W/(cm² µm) are 10 W/(m² nm).
        let spectral = 10.0 * radiance * core::f64::consts::PI * sin * sin * (-depth).exp();
        for (sum, weight) in xyz.iter_mut().zip(colour_matching(wavelength)) {
            *sum += spectral * weight * WAVELENGTHS[1] * UNITS;
        }
    }
    // The matrix makes a negative blue of a sun on the horizon.
    to_srgb(xyz).map(|channel| channel.max(0.0))
}

/// Linear sRGB (IEC 61966-2-1) of XYZ.
fn to_srgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
        -0.969266 * x + 1.8760108 * y + 0.041556 * z,
        0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
    ]
}

/// Colour matching functions of the CIE 1931 observer at a wavelength, nm.
fn colour_matching(wavelength: f64) -> [f64; 3] {
    let lobe = |height: f64, mean: f64, below: f64, above: f64| {
        let t = (wavelength - mean) / if wavelength < mean { below } else { above };
        height * (-0.5 * t * t).exp()
    };
    [
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) - lobe(0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn irradiance_outside_of_the_atmosphere_is_that_of_measurements() {
        // Thekaekara 1973, at 500 nm: 1.942 W/(m² nm).
        let sin = RADIUS_DEGREES.to_radians().sin();
        let spectral = 10.0 * RADIANCE[12] * core::f64::consts::PI * sin * sin;
        assert!((spectral / 1.942 - 1.0).abs() < 0.01, "{spectral}");
    }

    #[test]
    fn the_observer_has_the_integrals_of_the_standard() {
        let sum = |i: usize| (360..=830).map(|nm| colour_matching(f64::from(nm))[i]).sum::<f64>();
        // CIE 1931: 106.857 each.
        assert!((0..3).all(|i| (sum(i) / 106.857 - 1.0).abs() < 0.01), "{} {} {}", sum(0), sum(1), sum(2));
    }

    #[test]
    fn the_sun_reddens_and_darkens_towards_the_horizon_and_in_haze() {
        let lux = |[r, g, b]: [f64; 3]| 179.0 * (0.2126 * r + 0.7152 * g + 0.0722 * b);
        let noon = irradiance(60.0, 3.0);
        // Direct normal illuminance of a clear day: about 90 klx.
        assert!((80e3..100e3).contains(&lux(noon)), "{}", lux(noon));
        let mut last = irradiance(90.0, 3.0);
        for elevation in [60.0, 30.0, 15.0, 5.0, 1.0] {
            let next = irradiance(elevation, 3.0);
            assert!(lux(next) < lux(last) && next[2] / next[0] < last[2] / last[0]);
            last = next;
        }
        assert!(lux(irradiance(60.0, 6.0)) < lux(noon) && irradiance(0.0, 10.0).iter().all(|x| *x >= 0.0));
    }
}
