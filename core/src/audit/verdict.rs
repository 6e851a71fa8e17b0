//! Size and place of a bias, estimated from the audited pixels.

use super::region::{Grid, Region, Regions};
use crate::estimate::{BiasEstimate, Deviation, ErrorEstimate, PixelBias};
use libm::sqrt;

/// Significance level of regions and whole picture together: one false alarm in 40 pictures.
const LEVEL: f64 = 0.025;

/// Fraction of the picture's light below which audit paths may miss light and still judge it.
const MAX_UNSEEN: f64 = 0.01;

/// Work of an audit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AuditWork {
    /// Requested fraction of the total work of picture and audit.
    pub fraction: f64,
    /// Samples per audited pixel.
    pub samples: u32,
    /// Rays of the audit, not included in the rays of the picture.
    pub rays: u64,
    /// Seconds of the audit, included in the seconds of rendering; 0 without a clock.
    pub seconds: f64,
    /// True if audit paths were merged with the picture's photons: their blur is not in the bias.
    pub has_photons: bool,
    /// Fraction of the picture's light that audit paths practically never find, by a prepass with photons.
    pub unseen: f64,
}

/// Result of an audit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Audited {
    /// Its work.
    pub work: AuditWork,
    /// Audited pixels.
    pub pixels: u32,
    /// Noise of the picture, from its half-films.
    pub noise: ErrorEstimate,
    /// Squared bias.
    pub bias: BiasEstimate,
    /// Root mean square ratio of pixel variances, audit over picture.
    pub imbalance: f64,
    /// Noise plus squared bias, plus photon blur that the audit does not see.
    pub total: ErrorEstimate,
    /// Relative excess of the whole picture's brightness.
    pub whole: Deviation,
    /// Relative excess of each region, row by row.
    pub regions: Regions,
    /// True if the audit cannot separate bias from light that its paths miss; `total` is then noise alone.
    pub is_blind: bool,
}

/// An audited pixel, its weight, and its result; none for a pixel with too few samples.
pub(super) type Finding = ([u32; 2], f64, PixelBias);

impl Audited {
    /// Result of an audit with this `work` and these `findings`, in the order of strata, of a picture with
    /// this `noise`; `None` with too few findings.
    pub(super) fn new<I: Iterator<Item = Finding>>(
        work: AuditWork,
        findings: impl Fn() -> I,
        grid: Grid,
        noise: ErrorEstimate,
    ) -> Option<Self> {
        let bias = BiasEstimate::of(findings().map(|(_, weight, finding)| (finding, weight)))?;
        // Noise of a product: the product of the noise of both halves, each for picture and audit.
        let squares = |of: usize| {
            findings().map(|(_, _, finding)| finding.variances[of] * finding.variances[of]).sum::<f64>()
        };
        let region = |index: usize| {
            let inside = || findings().filter(|(pixel, ..)| grid.region(*pixel) == index);
            let mean = inside().map(|(_, weight, _)| weight).sum::<f64>() / inside().count().max(1) as f64;
            let deviation =
                Deviation::of(inside().map(|(_, weight, finding)| finding.deviation * weight / mean));
            let [[x, right], [y, bottom]] = grid.bounds(index);
            let is_biased = deviation.chance() < LEVEL / (grid.count() + 1) as f64;
            Region { x, y, width: right - x, height: bottom - y, deviation, is_biased }
        };
        let audited = Self {
            work,
            pixels: findings().count() as u32,
            noise,
            bias,
            imbalance: sqrt(squares(1) / squares(0)),
            total: noise.with_bias(bias),
            whole: Deviation::of(findings().map(|(_, weight, finding)| finding.deviation * weight)),
            regions: Regions::of(grid, region),
            is_blind: false,
        };
        Some(audited.without_bias_if_unseen())
    }

    /// True if a bias is significant. Unbiased pictures are reported biased in at most 5 % of cases.
    pub fn is_biased(&self) -> bool {
        let is_significant = self.bias.is_significant()
            || self.whole_is_biased()
            || self.regions.iter().any(|region| region.is_biased);
        is_significant && !self.is_blind
    }

    /// The same, blind if audit paths miss a fraction of the picture's light. If that fraction is not
    /// negligible, a picture brighter than the audit may be right, whereas a darker one is certainly wrong.
    fn without_bias_if_unseen(self) -> Self {
        let Deviation { mean, error, .. } = self.whole;
        let is_blind = self.work.unseen >= MAX_UNSEEN && mean > -2.0 * error;
        let total = if is_blind { self.noise } else { self.total };
        Self { is_blind, total, ..self }
    }

    /// True if the deviation of the whole picture is significant.
    pub fn whole_is_biased(&self) -> bool {
        self.whole.chance() < LEVEL / (self.regions.len() + 1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_bias_add_up() {
        let noise = ErrorEstimate { relmse: 0.01, lower: 0.008, upper: 0.013 };
        let bias = BiasEstimate {
            relmse: 0.02,
            lower: 0.016,
            upper: 0.024,
            detectable: 0.004,
            error: 0.004 / 1.959964,
        };
        let sum = noise.with_bias(bias);
        // 0.03, less twice the squared standard error over 0.02. Distances to the upper ends, and to the bias
        // that is certain by four standard errors, add in quadrature.
        let less = 2.0 * (0.004f64 / 1.96).powi(2) / 0.02;
        assert!((sum.relmse - (0.03 - less)).abs() < 1e-7, "{sum:?}");
        assert!((sum.relmse - sum.lower - 0.002f64.hypot(0.008 - less)).abs() < 1e-7, "{sum:?}");
        assert!((sum.upper - sum.relmse - 0.003f64.hypot(0.004 + less)).abs() < 1e-7, "{sum:?}");
        let none =
            BiasEstimate { relmse: -0.001, lower: 0.0, upper: 0.002, detectable: 0.003, error: 0.0015 };
        let sum = noise.with_bias(none);
        assert_eq!((sum.relmse, sum.lower), (0.01, 0.008));
        assert!(sum.upper > 0.0135 && sum.upper < 0.014);
    }

    #[test]
    fn one_firefly_of_an_audit_is_doubted() {
        let noise = ErrorEstimate { relmse: 0.01, lower: 0.008, upper: 0.013 };
        let finding = |bias: f64| (PixelBias { bias, deviation: 0.0, variances: [0.0; 2] }, 1.0);
        let others = (0..255).map(|i| finding(if i % 2 == 0 { 0.01 } else { -0.01 }));
        let bias = BiasEstimate::of(others.chain([finding(200.0)])).unwrap();
        assert!(bias.relmse > 0.7, "{bias:?}");
        let sum = noise.with_bias(bias);
        assert_eq!((sum.relmse, sum.lower), (0.01, 0.008));
        assert!(sum.upper > 2.0 * bias.relmse, "{sum:?}");
    }

    #[test]
    fn a_bright_picture_is_not_judged_by_paths_that_miss_light() {
        let noise = ErrorEstimate { relmse: 0.01, lower: 0.008, upper: 0.013 };
        let audited = |unseen, deviation| {
            let bias = PixelBias { bias: 0.01, deviation, variances: [1e-3; 2] };
            let findings = || (0..256u32).map(|i| ([i % 16, i / 16], 1.0, bias));
            let work = AuditWork { unseen, ..AuditWork::default() };
            Audited::new(work, findings, Grid::new([16, 16], 256), noise).unwrap()
        };
        assert!(audited(0.0, 0.1).is_biased() && audited(0.5, -0.1).is_biased());
        let blind = audited(0.5, 0.1);
        assert!(blind.is_blind && !blind.is_biased() && blind.total == noise);
        assert_eq!((blind.pixels, blind.regions.len(), blind.imbalance), (256, 16, 1.0));
    }
}
