//! Pixel: precise sums of its even and odd samples, and rejection of invalid samples.
//!
//! Each half keeps its own even and odd samples apart. The halves give the error of their mean;
//! [`crate::estimate`] describes the use of the quarters.

use crate::Rgb;
use bytemuck::{Pod, Zeroable};

/// 2^96. Larger radiance counts as infinite, so that sums of 2^31 samples are finite.
const MAX_RADIANCE: f32 = 79_228_162_514_264_337_593_543_950_336.0;

/// Sum of half of the samples, in two parts. Each addition keeps its rounding error (Neumaier 1974), so that
/// a million samples in f32 are as precise as with twice the bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Half {
    sums: [[f32; 3]; 2],
    lost: [f32; 3],
    blur: f32,
    counts: [u32; 2],
}

impl Half {
    #[inline]
    fn add(&mut self, part: usize, sample: Rgb) {
        let part = part & 1;
        for ((sum, lost), x) in self.sums[part].iter_mut().zip(&mut self.lost).zip(sample.to_array()) {
            // Knuth's two-sum: exact whichever operand is larger.
            let total = *sum + x;
            let back = total - *sum;
            *lost += (*sum - (total - back)) + (x - back);
            *sum = total;
        }
        self.counts[part] += 1;
    }

    /// Number of samples.
    pub fn count(&self) -> u32 {
        self.counts[0] + self.counts[1]
    }

    /// Sum of the samples.
    pub fn sum(&self) -> Rgb {
        Rgb::from(self.sums[0]) + Rgb::from(self.sums[1]) + Rgb::from(self.lost)
    }

    /// Mean of the samples; black without samples.
    pub fn mean(&self) -> Rgb {
        if self.count() == 0 { Rgb::ZERO } else { self.sum() / self.count() as f32 }
    }

    /// Mean density bias by the samples that estimate it, averaged over the channels; negative if too dark.
    pub fn blur(&self) -> f32 {
        if self.count() == 0 { 0.0 } else { self.blur / self.count() as f32 }
    }

    /// Means of its own even and odd samples; `None` if either is empty.
    #[inline]
    pub fn parts(&self) -> Option<[Rgb; 2]> {
        if self.counts.contains(&0) {
            return None;
        }
        Some([0, 1].map(|i| Rgb::from(self.sums[i]) / self.counts[i] as f32))
    }
}

/// The two halves of a pixel. They are independent, so that their difference estimates the error of their
/// mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pixel {
    /// Samples 0, 2, 4, …
    pub even: Half,
    /// Samples 1, 3, 5, …
    pub odd: Half,
}

impl Pixel {
    /// Adds the radiance of sample number `index`. Values that are not non-negative and below 2^96, the limit
    /// of the sums, are counted in `dropped` and left out of the picture. Returns true if the sample was
    /// added.
    #[inline]
    pub fn add(&mut self, index: u32, radiance: Rgb, dropped: &mut Dropped) -> bool {
        // False for NaN as well.
        let is_light = radiance.cmpge(Rgb::ZERO).all() && radiance.cmplt(Rgb::splat(MAX_RADIANCE)).all();
        if is_light {
            let half = if index & 1 == 0 { &mut self.even } else { &mut self.odd };
            half.add((index >> 1) as usize, radiance);
        } else {
            dropped.record(radiance);
        }
        is_light
    }

    /// Adds the estimated density bias of sample number `index`, which has been added before. Values that are
    /// not finite are ignored.
    #[inline]
    pub fn add_blur(&mut self, index: u32, blur: Rgb) {
        let blur = blur.element_sum() / 3.0;
        if blur.abs() < MAX_RADIANCE {
            let half = if index & 1 == 0 { &mut self.even } else { &mut self.odd };
            half.blur += blur;
        }
    }

    /// Number of samples.
    pub fn count(&self) -> u32 {
        self.even.count() + self.odd.count()
    }

    /// Mean of all samples; black without samples.
    pub fn mean(&self) -> Rgb {
        let count = self.count();
        if count == 0 { Rgb::ZERO } else { (self.even.sum() + self.odd.sum()) / count as f32 }
    }

    /// Estimated variance of [`Pixel::mean`] from the difference of the halves, with one degree of freedom. 0
    /// if a half is empty.
    ///
    /// With independent halves A and B of n_A and n_B samples and variance σ² of one sample, (A − B)² has the
    /// expectation σ² (1/n_A + 1/n_B), and their common mean has the variance σ² / (n_A + n_B).
    pub fn variance(&self) -> Rgb {
        self.scaled_variance(1.0)
    }

    /// [`Pixel::variance`] of a picture that is `scale` times as bright. The unscaled variance may overflow.
    pub(crate) fn scaled_variance(&self, scale: f32) -> Rgb {
        let (even, odd) = (self.even.count() as f32, self.odd.count() as f32);
        if even == 0.0 || odd == 0.0 {
            return Rgb::ZERO;
        }
        let share = (even / (even + odd)) * (odd / (even + odd));
        let difference = (self.even.mean() - self.odd.mean()) * scale;
        share * difference * difference
    }
}

/// Rejected samples by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Dropped {
    /// A channel was NaN.
    pub nan: u64,
    /// A channel was infinite, or at least 2^96.
    pub infinite: u64,
    /// A channel was negative.
    pub negative: u64,
    /// Paths cut at the technical limit of their length. Their contribution up to the limit is in the
    /// picture.
    pub unfinished: u64,
}

impl Dropped {
    #[cold]
    fn record(&mut self, radiance: Rgb) {
        if radiance.is_nan() {
            self.nan += 1;
        } else if radiance.cmpge(Rgb::splat(MAX_RADIANCE)).any() || !radiance.is_finite() {
            self.infinite += 1;
        } else {
            self.negative += 1;
        }
    }

    /// Number of rejected samples of all causes.
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
    fn the_halves_tell_the_variance() {
        let mut pixel = Pixel::default();
        for (index, sample) in [1.0, 4.0, 3.0].into_iter().enumerate() {
            pixel.add(index as u32, Rgb::splat(sample), &mut Dropped::default());
            assert_eq!(index > 0, pixel.variance() != Rgb::ZERO);
        }
        // Halves of means 2 and 4: (2 − 4)² times 2/3 · 1/3.
        assert!((pixel.variance().x - 8.0 / 9.0).abs() < 1e-6);
    }

    #[test]
    fn what_is_no_light_is_counted_and_kept_out() {
        let mut pixel = Pixel::default();
        let mut dropped = Dropped::default();
        for (i, bad) in [f32::NAN, f32::INFINITY, -1.0, f32::NEG_INFINITY, f32::MAX].into_iter().enumerate() {
            pixel.add(i as u32, Rgb::new(1.0, bad, 1.0), &mut dropped);
        }
        pixel.add(5, Rgb::ONE, &mut dropped);
        assert_eq!(pixel.mean(), Rgb::ONE);
        assert_eq!(dropped, Dropped { nan: 1, infinite: 3, negative: 1, unfinished: 0 });
    }
}
