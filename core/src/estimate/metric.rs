//! Error metrics of a picture against a reference, in linear radiance: MSE, RMSE and relMSE.
//!
//! Sums are in f64 and in pixel order, so that equal pictures give equal bits.

use crate::Rgb;

/// Fraction of the squared mean that keeps relMSE finite where the reference is dark.
pub(crate) const RELMSE_OFFSET: f64 = 0.01;

/// Relative difference of pictures that sum the same light in different orders.
pub(super) const ROUNDING: f64 = 1e-6;

/// Differences of a picture from a reference of equal size, over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Mean of (I − R)².
    pub mse: f64,
    /// Mean of (I − R)² / (R² + 0.01 m²), m the mean of R. Independent of the unit of light.
    pub relmse: f64,
    /// Mean of I.
    pub mean: f64,
    /// Mean of R, the m of relMSE.
    pub reference_mean: f64,
    /// Number of pixels compared. All means are NaN if there are none.
    pub pixels: u64,
    /// Number of pixels skipped because the picture is not finite.
    pub non_finite: u64,
    /// Number of pixels skipped because the reference is not finite.
    pub reference_non_finite: u64,
}

impl Difference {
    /// Compares pixel by pixel, up to the end of the shorter one.
    pub fn between<I, R>(image: I, reference: R) -> Self
    where
        I: Iterator<Item = Rgb> + Clone,
        R: Iterator<Item = Rgb> + Clone,
    {
        let mut sum = Self::default();
        for (i, r) in image.clone().zip(reference.clone()) {
            sum.non_finite += u64::from(!i.is_finite());
            sum.reference_non_finite += u64::from(!r.is_finite());
            if i.is_finite() && r.is_finite() {
                sum.pixels += 1;
                sum.mean += channels(i).iter().sum::<f64>();
                sum.reference_mean += channels(r).iter().sum::<f64>();
            }
        }
        let values = sum.pixels as f64 * 3.0;
        sum.mean /= values;
        sum.reference_mean /= values;

        let floor = RELMSE_OFFSET * sum.reference_mean * sum.reference_mean;
        let finite = image.zip(reference).filter(|(i, r)| i.is_finite() && r.is_finite());
        for (i, r) in finite {
            for (i, r) in channels(i).into_iter().zip(channels(r)) {
                let squared = (i - r) * (i - r);
                sum.mse += squared;
                // A black pixel of a black reference, 0 / 0, is no error.
                sum.relmse += if squared == 0.0 { 0.0 } else { squared / (r * r + floor) };
            }
        }
        Self { mse: sum.mse / values, relmse: sum.relmse / values, ..sum }
    }

    /// Root of the mean squared error.
    pub fn rmse(&self) -> f64 {
        libm::sqrt(self.mse)
    }
}

fn channels(colour: Rgb) -> [f64; 3] {
    [colour.x.into(), colour.y.into(), colour.z.into()]
}

/// [`Difference::mse`] of two pictures.
pub fn mse(image: impl Iterator<Item = Rgb> + Clone, reference: impl Iterator<Item = Rgb> + Clone) -> f64 {
    Difference::between(image, reference).mse
}

/// [`Difference::rmse`] of two pictures.
pub fn rmse(image: impl Iterator<Item = Rgb> + Clone, reference: impl Iterator<Item = Rgb> + Clone) -> f64 {
    Difference::between(image, reference).rmse()
}

/// [`Difference::relmse`] of two pictures.
pub fn relmse(image: impl Iterator<Item = Rgb> + Clone, reference: impl Iterator<Item = Rgb> + Clone) -> f64 {
    Difference::between(image, reference).relmse
}

#[cfg(test)]
mod tests {
    use super::*;

    fn between(image: &[Rgb], reference: &[Rgb]) -> Difference {
        Difference::between(image.iter().copied(), reference.iter().copied())
    }

    #[test]
    fn a_worked_example() {
        // R = 1 and 3, m = 2, floor 0.04; I − R = 1 and −1.
        let difference = between(&[Rgb::splat(2.0), Rgb::splat(2.0)], &[Rgb::splat(1.0), Rgb::splat(3.0)]);
        assert_eq!(difference.mse, 1.0);
        assert_eq!(difference.rmse(), 1.0);
        assert_eq!((difference.mean, difference.reference_mean), (2.0, 2.0));
        let expected = (1.0 / 1.04 + 1.0 / 9.04) / 2.0;
        assert!((difference.relmse - expected).abs() < 1e-15);
    }

    #[test]
    fn relmse_does_not_depend_on_the_unit_of_light() {
        let image = [Rgb::new(0.1, 0.7, 2.0), Rgb::new(0.0, 5.0, 1.0)];
        let reference = [Rgb::new(0.2, 0.6, 2.5), Rgb::new(0.1, 4.0, 1.0)];
        let brighter = |p: &[Rgb; 2]| p.map(|c| c * 1024.0);
        let (plain, bright) =
            (between(&image, &reference), between(&brighter(&image), &brighter(&reference)));
        assert_eq!(plain.relmse, bright.relmse);
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_and_left_out() {
        let image = [Rgb::new(f32::NAN, 0.0, 0.0), Rgb::ONE, Rgb::ONE];
        let reference = [Rgb::ONE, Rgb::new(0.0, f32::INFINITY, 0.0), Rgb::ONE];
        let difference = between(&image, &reference);
        assert_eq!((difference.non_finite, difference.reference_non_finite, difference.pixels), (1, 1, 1));
        assert_eq!((difference.mse, difference.relmse), (0.0, 0.0));
    }

    #[test]
    fn black_and_empty_references() {
        assert_eq!(between(&[Rgb::ZERO], &[Rgb::ZERO]).relmse, 0.0);
        assert_eq!(between(&[Rgb::ONE], &[Rgb::ZERO]).relmse, f64::INFINITY);
    }

    #[test]
    fn pictures_without_a_finite_pixel_have_no_error() {
        let (nan, grey) = ([Rgb::splat(f32::NAN), Rgb::splat(f32::INFINITY)], [Rgb::ONE; 2]);
        for (image, reference) in [(&nan[..], &grey[..]), (&grey, &nan), (&nan, &nan), (&[], &[])] {
            let Difference { relmse, mse, mean, reference_mean, pixels, .. } = between(image, reference);
            assert_eq!(pixels, 0);
            assert!([relmse, mse, mean, reference_mean].iter().all(|value| value.is_nan()));
        }
    }
}
