//! Search for the error of a metric that gives a number of records.

/// Relative tolerance of the number of records.
const TOLERANCE: f64 = 0.02;

/// Most attempts. Near the end chance decides about single records, which are some hundredths of a few
/// hundred.
const ATTEMPTS: usize = 20;

/// Longest step of an attempt in the logarithm of the error: a factor of a hundred.
const FARTHEST: f64 = 4.605;

/// Search for the error that gives the wanted number of records: linear interpolation on logarithmic axes
/// between the last errors with too many and with too few records.
pub(super) struct Search {
    wanted: f64,
    /// Error of the next attempt.
    pub(super) error: f32,
    attempts: usize,
    /// Logarithms of error and number of records for the last attempts with too many and too few records.
    too_many: Option<[f64; 2]>,
    too_few: Option<[f64; 2]>,
}

impl Search {
    pub(super) fn new(wanted: u64, error: f32) -> Self {
        Self { wanted: wanted.max(1) as f64, error, attempts: 0, too_many: None, too_few: None }
    }

    /// Records that the error gave this number of records; returns whether the search is over.
    pub(super) fn is_done(&mut self, records: u64) -> bool {
        self.attempts += 1;
        let records = records.max(1) as f64;
        if (records / self.wanted - 1.0).abs() <= TOLERANCE || self.attempts >= ATTEMPTS {
            return true;
        }
        let here = [f64::from(self.error).ln(), records.ln()];
        if records > self.wanted {
            self.too_many = Some(here)
        } else {
            self.too_few = Some(here)
        }
        let wanted = self.wanted.ln();
        let next = match (self.too_many, self.too_few) {
            (Some([a, many]), Some([b, few])) => {
                let part = ((many - wanted) / (many - few)).clamp(0.1, 0.9);
                a + part * (b - a)
            }
            // Areas of records grow with the squared radius, or with the square root of the error; far away
            // this may fail.
            _ => here[0] + (2.0 * (here[1] - wanted)).clamp(-FARTHEST, FARTHEST),
        };
        self.error = next.exp() as f32;
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_finds_the_error_for_any_power() {
        for power in [-0.4, -0.5, -1.0, -2.0] {
            for wanted in [100, 1700, 50_000] {
                let mut search = Search::new(wanted, 1e-4);
                let mut records = 0;
                for _ in 0..ATTEMPTS {
                    records = (20.0 * f64::from(search.error).powf(power)) as u64;
                    if search.is_done(records) {
                        break;
                    }
                }
                let off = (records as f64 / wanted as f64 - 1.0).abs();
                assert!(off <= TOLERANCE, "{power} {wanted}: {records}");
            }
        }
    }
}
