//! Speed of the kernels on one thread of this machine. Rival libraries are measured in the same run.

pub mod eigen;
pub mod knn;
pub mod rays;
pub mod shade;

use core::fmt;
use halflight_core::memory::OutOfMemory;

/// Number of measurements, of which the median is reported.
pub const REPETITIONS: usize = 7;

/// Reason why a measurement failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BenchError {
    /// The system refuses the memory.
    Memory(OutOfMemory),
    /// The rival does not start or refuses the data.
    Rival(String),
}

impl fmt::Display for BenchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Memory(error) => error.fmt(f),
            Self::Rival(why) => f.write_str(why),
        }
    }
}

impl core::error::Error for BenchError {}

impl From<OutOfMemory> for BenchError {
    fn from(error: OutOfMemory) -> Self {
        Self::Memory(error)
    }
}

/// Median of `values`, NaN if empty.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = |i: usize| values.get(i).copied().unwrap_or(f64::NAN);
    let half = values.len() / 2;
    if values.len() % 2 == 1 { middle(half) } else { 0.5 * (middle(half) + middle(half.wrapping_sub(1))) }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn median_of_even_and_odd_counts() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(vec![]).is_nan());
    }
}
