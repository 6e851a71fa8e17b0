//! One pixel: precise sums of its even and odd samples, and what is done with samples that are no light.

use crate::Rgb;
use bytemuck::{Pod, Zeroable};

/// The sum of half of the samples. Each addition keeps its rounding error (Neumaier 1974), so that a
/// million samples in f32 are as good as in twice its precision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Half {
    sum: [f32; 3],
    lost: [f32; 3],
    count: u32,
}

impl Half {
    #[inline]
    fn add(&mut self, sample: Rgb) {
        for ((sum, lost), x) in self.sum.iter_mut().zip(&mut self.lost).zip(sample.to_array()) {
            // Knuth's two-sum: exact whichever is larger.
            let total = *sum + x;
            let back = total - *sum;
            *lost += (*sum - (total - back)) + (x - back);
            *sum = total;
        }
        self.count += 1;
    }

    /// Number of samples.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Their sum.
    pub fn sum(&self) -> Rgb {
        Rgb::from(self.sum) + Rgb::from(self.lost)
    }

    /// Their mean; black where there are none.
    pub fn mean(&self) -> Rgb {
        if self.count == 0 { Rgb::ZERO } else { self.sum() / self.count as f32 }
    }
}

/// The two halves of a pixel: independent pictures, whose difference tells of the error of their mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pixel {
    /// Samples 0, 2, 4, …
    pub even: Half,
    /// Samples 1, 3, 5, …
    pub odd: Half,
}

impl Pixel {
    /// Adds the radiance that sample number `index` saw. What is not a finite, non-negative number is
    /// counted in `dropped` and does not reach the picture.
    #[inline]
    pub fn add(&mut self, index: u32, radiance: Rgb, dropped: &mut Dropped) {
        // False for NaN as well.
        if radiance.cmpge(Rgb::ZERO).all() && radiance.cmplt(Rgb::INFINITY).all() {
            let half = if index & 1 == 0 { &mut self.even } else { &mut self.odd };
            half.add(radiance);
        } else {
            dropped.record(radiance);
        }
    }

    /// Number of samples.
    pub fn count(&self) -> u32 {
        self.even.count + self.odd.count
    }

    /// The mean of all samples; black where there are none.
    pub fn mean(&self) -> Rgb {
        let count = self.count();
        if count == 0 { Rgb::ZERO } else { (self.even.sum() + self.odd.sum()) / count as f32 }
    }
}

/// Samples that did not reach the picture, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// A channel was not a number.
    pub nan: u64,
    /// A channel was infinite.
    pub infinite: u64,
    /// A channel was negative.
    pub negative: u64,
    /// Paths cut at the technical limit of their length; what they saw up to there is in the picture.
    pub unfinished: u64,
}

impl Dropped {
    #[cold]
    fn record(&mut self, radiance: Rgb) {
        if radiance.is_nan() {
            self.nan += 1;
        } else if !radiance.is_finite() {
            self.infinite += 1;
        } else {
            self.negative += 1;
        }
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.nan + self.infinite + self.negative + self.unfinished
    }
}

impl core::ops::AddAssign for Dropped {
    fn add_assign(&mut self, other: Self) {
        self.nan += other.nan;
        self.infinite += other.infinite;
        self.negative += other.negative;
        self.unfinished += other.unfinished;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_samples_lose_nothing() {
        let mut pixel = Pixel::default();
        let mut dropped = Dropped::default();
        let mut exact = 0.0f64;
        for i in 0..1_000_000u32 {
            let x = if i % 1000 == 0 { 1e4 } else { 1e-3 * (i % 7) as f32 };
            exact += f64::from(x);
            pixel.add(i, Rgb::splat(x), &mut dropped);
        }
        let mean = f64::from(pixel.mean().y);
        assert!((mean * 1e6 / exact - 1.0).abs() < 1.5e-7, "{mean} {exact}");
        assert_eq!((pixel.count(), dropped.total()), (1_000_000, 0));
    }

    #[test]
    fn what_is_no_light_is_counted_and_kept_out() {
        let mut pixel = Pixel::default();
        let mut dropped = Dropped::default();
        for (i, bad) in [f32::NAN, f32::INFINITY, -1.0, f32::NEG_INFINITY].into_iter().enumerate() {
            pixel.add(i as u32, Rgb::new(1.0, bad, 1.0), &mut dropped);
        }
        pixel.add(4, Rgb::ONE, &mut dropped);
        assert_eq!(pixel.mean(), Rgb::ONE);
        assert_eq!(dropped, Dropped { nan: 1, infinite: 2, negative: 1, unfinished: 0 });
    }
}
