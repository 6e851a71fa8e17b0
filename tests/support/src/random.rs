//! Random numbers of tests: xorshift64* (Vigna, 2016).

use glam::Vec3;

/// Generator with a state that is not 0.
pub struct Random(pub u64);

impl Random {
    /// 64 random bits, of which the highest are the best.
    pub fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [0, 1), in single precision.
    pub fn unit_f32(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Uniform in the unit cube.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit_f32(), self.unit_f32(), self.unit_f32())
    }

    /// Uniform in [`low`, `high`).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0 … `bound` − 1; 0 if the bound is 0.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.bits() % bound.max(1) as u64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_uniform() {
        let (mut random, count) = (Random(1), 100_000);
        let (mut sum, mut squares, mut single) = (0.0, 0.0, 0.0);
        for _ in 0..count {
            let x = random.unit();
            assert!((0.0..1.0).contains(&x));
            (sum, squares) = (sum + x, squares + x * x);
            single += f64::from(random.unit_f32());
        }
        // Five standard deviations of the means of x and of x².
        let n = f64::from(count);
        let most = 5.0 / (12.0 * n).sqrt();
        assert!((sum / n - 0.5).abs() < most && (single / n - 0.5).abs() < most);
        assert!((squares / n - 1.0 / 3.0).abs() < 5.0 * (4.0 / 45.0 / n).sqrt());
        assert!((0..1000).all(|_| random.below(7) < 7) && random.below(0) == 0);
    }
}
