//! Table of candidates: methods with their predictions, and the choice among them.

use super::super::MethodKind;
use super::super::cache_resolution::CachedPicture;
use crate::findings::Decision::Used;
use crate::findings::{Finding, Value};

/// A candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The method.
    pub kind: MethodKind,
    /// Predicted relMSE of the picture; infinite where the method is no choice.
    pub error: f64,
    /// Predicted rays of a sample of a pixel.
    pub work: f64,
    /// Ratio of its error to that of a later row from which on the later one takes its place.
    pub least_gain: f64,
    /// Origin of the prediction, or the reason for which there is none.
    pub reason: &'static str,
    /// Picture for which a cache is to be filled.
    pub picture: Option<CachedPicture>,
}

impl Row {
    /// A method that is no choice for a `reason`.
    pub fn without(kind: MethodKind, reason: &'static str) -> Self {
        Self { kind, error: f64::INFINITY, work: 0.0, least_gain: 1.0, reason, picture: None }
    }
}

/// Candidates; of two with about the same error the first one is chosen.
#[derive(Clone, Copy, Debug)]
pub struct Table<const ROWS: usize>(pub [Row; ROWS]);

impl<const ROWS: usize> Table<ROWS> {
    /// The first row whose error no other undercuts by more than its least gain.
    pub fn best(&self) -> &Row {
        let least = self.0.iter().map(|row| row.error).fold(f64::INFINITY, f64::min);
        self.0.iter().find(|row| row.error <= row.least_gain * least).unwrap_or(&self.0[0])
    }

    /// All rows, and the reason of the choice.
    pub fn finding(&self) -> Finding {
        let best = self.best();
        let reason = match self.0.iter().all(|row| row.error >= best.error) {
            true => "it has the least predicted error",
            false => "others have less predicted error, but gain too little",
        };
        self.0.iter().fold(Finding::new("method", Used, reason), |finding, row| {
            let Row { kind, error, work, reason, .. } = *row;
            finding.with(kind.name(), Value::Prediction { error, work, reason })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(errors: [f64; 3]) -> MethodKind {
        use MethodKind::{Bidirectional, IrradianceCache, Path};
        let row = |(kind, least_gain), error| Row { error, least_gain, ..Row::without(kind, "") };
        let [path, cache, light_paths] = errors;
        let rows = [
            row((Path, 1.5), path),
            row((IrradianceCache, 1.2), cache),
            row((Bidirectional, 1.0), light_paths),
        ];
        Table(rows).best().kind
    }

    #[test]
    fn a_later_row_is_chosen_if_it_gains_enough_over_each_before() {
        use MethodKind::{Bidirectional, IrradianceCache, Path};
        assert_eq!(chosen([1.4, 1.0, f64::INFINITY]), Path);
        assert_eq!(chosen([1.6, 1.0, f64::INFINITY]), IrradianceCache);
        assert_eq!(chosen([1.6, 1.1, 1.0]), IrradianceCache);
        assert_eq!(chosen([1.6, 1.3, 1.0]), Bidirectional);
        assert_eq!(chosen([f64::INFINITY; 3]), Path);
    }
}
