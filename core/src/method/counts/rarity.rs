//! Noise by the rarity of light. Light that a picture finds only a few times is missing from it: its error
//! is the square of its radiance, not its variance, which pictures of so few samples seldom show.

use crate::method::tuned::LEAST_HITS;
use bytemuck::{Pod, Zeroable};

/// Classes of rarity, the rarest first; each is found eight times as often as the one before.
const CLASSES: usize = 8;
const OCTAVES: i32 = 3;

/// Sums over the contributions to a block of pixels by one way to find light.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct RaritySums {
    variance: [f32; CLASSES],
    light: [f32; CLASSES],
    hits: [f32; CLASSES],
}

/// Class of light that is found `likelihood` times as often as by a pilot.
fn class(likelihood: f32) -> usize {
    let exponent = (likelihood.to_bits() >> 23) as i32 - 127;
    (CLASSES as i32 - 1 + exponent.div_euclid(OCTAVES)).clamp(0, CLASSES as i32 - 1) as usize
}

/// True if light that is found `likelihood` times as often as by a pilot is not rare: an eighth at least.
pub fn is_often(likelihood: f32) -> bool {
    class(likelihood) >= CLASSES - 2
}

impl RaritySums {
    /// Adds a contribution of `light` with its `variance`, whose paths are found `likelihood` times as often
    /// as by the pilot; `weight` of all three.
    pub fn add(&mut self, likelihood: f32, weight: f32, light: f32, variance: f32) {
        let class = class(likelihood);
        self.variance[class] += weight * variance;
        self.light[class] += weight * light;
        self.hits[class] += weight * likelihood;
    }

    /// Adds variance of light that is found often.
    pub fn add_often(&mut self, variance: f32) {
        self.variance[CLASSES - 1] += variance;
    }
}

/// Noise of a picture by the rarity of its light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rarity {
    /// Relative variance of a sample of a pixel.
    noise: [f32; CLASSES],
    /// relMSE of a picture without the light of this class and all rarer ones.
    missing: [f32; CLASSES],
    /// Paths that find it, for each sample of a pixel.
    hits: [f32; CLASSES],
}

impl Rarity {
    /// Relative variance of a sample of a pixel in the long run.
    pub fn noise(&self) -> f32 {
        self.noise.iter().sum()
    }

    /// Adds a block of that number of `pixels`, whose squared light is relative to `scale`.
    pub fn add(&mut self, sums: &RaritySums, pixels: f32, scale: f32) {
        let mut light = 0.0;
        for class in 0..CLASSES {
            light += sums.light[class];
            self.noise[class] += sums.variance[class] / scale;
            self.missing[class] += light * light / (pixels * scale);
            self.hits[class] += sums.hits[class];
        }
    }

    /// Means of all sums over `pixels`, with a noise of `least_noise` at least.
    pub fn over(mut self, pixels: f32, least_noise: f32) -> Self {
        for of_class in [&mut self.noise, &mut self.missing, &mut self.hits] {
            of_class.iter_mut().for_each(|sum| *sum /= pixels);
        }
        self.noise[CLASSES - 1] += (least_noise - self.noise()).max(0.0);
        self
    }

    /// Without so much noise of light that is found often.
    pub fn without(mut self, noise: f32) -> Self {
        let often = &mut self.noise[CLASSES - 1];
        *often = (*often - noise).max(0.0);
        self
    }

    /// With so much less noise; light that is missing stays so.
    pub fn reduced(mut self, gain: f64) -> Self {
        self.noise.iter_mut().for_each(|noise| *noise /= gain as f32);
        self
    }

    /// relMSE after this number of `samples` of each of the `pixels`.
    pub fn error(&self, samples: f64, pixels: f64) -> f64 {
        let (mut missing, mut hits) = (0.0, 0.0);
        for class in 0..CLASSES {
            hits += samples * pixels * f64::from(self.hits[class]);
            if hits >= LEAST_HITS {
                let noise: f32 = self.noise[class..].iter().sum();
                return missing + f64::from(noise) / samples;
            }
            missing = f64::from(self.missing[class]);
        }
        missing
    }

    /// Light of this `noise` that is found often.
    #[cfg(test)]
    pub fn often(noise: f32) -> Self {
        let mut rarity = Self::default();
        (rarity.noise[CLASSES - 1], rarity.hits[CLASSES - 1]) = (noise, 1.0);
        rarity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_have_three_octaves() {
        let classes = [4.0, 1.0, 0.999, 0.125, 0.124, 1e-6, 0.0].map(class);
        assert_eq!(classes, [7, 7, 6, 6, 5, 0, 0]);
        assert!(is_often(0.125) && !is_often(0.124));
    }

    #[test]
    fn rare_light_is_missing_until_it_is_found() {
        // A hundredth of the light in one path of a million, the rest without noise.
        let (light, likelihood) = (0.01_f32, 1e-6_f32);
        let mut sums = RaritySums::zeroed();
        sums.add(likelihood, 1.0, light, light * light / likelihood);
        sums.add(1.0, 1.0, 1.0 - light, 0.0);
        let mut rarity = Rarity::default();
        rarity.add(&sums, 1.0, 1.0);
        let rarity = rarity.over(1.0, 0.0);
        assert!((rarity.noise() - 100.0).abs() < 0.01);
        let few = rarity.error(100.0, 1000.0);
        assert!((few - 1e-4).abs() < 1e-8, "{few}");
        let many = rarity.error(1e4, 1000.0);
        assert!((many - 100.0 / 1e4).abs() < 1e-6, "{many}");
        // A reconstruction reduces noise, and knows nothing of light that is missing.
        let reduced = rarity.reduced(4.0);
        assert!((reduced.error(100.0, 1000.0) / few - 1.0).abs() < 1e-6);
        assert!((reduced.error(1e4, 1000.0) * 4.0 / many - 1.0).abs() < 1e-6);
        // Without samples all light is missing.
        assert!((rarity.error(1e-9, 1.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn noise_has_a_lower_limit() {
        let rarity = Rarity::often(2.0).over(4.0, 0.75);
        assert_eq!(rarity.noise(), 0.75);
        assert_eq!([0.5, 2.0].map(|edges| rarity.without(edges).noise()), [0.25, 0.0]);
    }
}
