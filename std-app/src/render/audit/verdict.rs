//! Size and place of a bias, estimated from the audited pixels.

use super::choice::Grid;
use crate::render::ErrorEstimate;
use halflight_core::estimate::{BiasEstimate, Deviation, PixelBias, filtered_pixel};
use halflight_core::film::{Film, PIXELS_PER_TILE, Pixel, Tile};

/// Significance level of regions and whole picture together: one false alarm in 40 pictures.
const LEVEL: f64 = 0.025;

/// Share of the picture's light below which audit paths may miss light and still judge it.
const MAX_UNSEEN: f64 = 0.01;

/// Result of an audit.
#[derive(Clone, Debug, PartialEq)]
pub struct Audited {
    /// Requested share of the work.
    pub share: f64,
    /// Audited pixels.
    pub pixels: u32,
    /// Samples per audited pixel.
    pub samples: u32,
    /// Rays of the audit, not included in the rays of the picture.
    pub rays: u64,
    /// Seconds of the audit, included in the seconds of rendering.
    pub seconds: f64,
    /// True if audit paths were merged with the picture's photons: their blur is not in the bias.
    pub has_photons: bool,
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
    pub regions: Vec<Region>,
    /// Share of the picture's light that audit paths cannot find, by a prepass with photons.
    pub unseen: f64,
    /// True if the audit cannot separate bias from light that its paths miss; `total` is then noise alone.
    pub is_blind: bool,
}

/// A part of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Column of its upper left pixel.
    pub x: u32,
    /// Row of its upper left pixel.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Relative excess of its brightness.
    pub deviation: Deviation,
    /// True if the deviation is significant, at 2.5 % for all regions and the whole picture together.
    pub is_biased: bool,
}

impl Audited {
    /// True if a bias is significant. Unbiased pictures are reported biased in at most 5 % of cases.
    pub fn is_biased(&self) -> bool {
        let is_significant = self.bias.is_significant()
            || self.whole_is_biased()
            || self.regions.iter().any(|region| region.is_biased);
        is_significant && !self.is_blind
    }

    /// Result for audit paths that miss a share `unseen` of the picture's light. If that share is not
    /// negligible, a picture brighter than the audit may be right, whereas a darker one is certainly wrong.
    pub(super) fn without_bias_if_unseen(self, unseen: f64) -> Self {
        let Deviation { mean, error, .. } = self.whole;
        let is_blind = unseen >= MAX_UNSEEN && mean > -2.0 * error;
        let total = if is_blind { self.noise } else { self.total };
        Self { unseen, is_blind, total, ..self }
    }

    /// True if the deviation of the whole picture is significant.
    pub fn whole_is_biased(&self) -> bool {
        self.whole.chance() < LEVEL / (self.regions.len() + 1) as f64
    }
}

/// Differences at the audited pixels, each with the pixel's index.
pub(super) fn findings(
    film: &Film,
    mean: f64,
    places: &[[u32; 2]],
    truth: &[Pixel],
) -> Vec<(usize, PixelBias)> {
    let finding = |(index, (place, truth)): (usize, (&[u32; 2], &Pixel))| {
        let position = Tile::position([film.width(), film.height()], place[0], place[1]);
        let (task, number) = (position / PIXELS_PER_TILE, position % PIXELS_PER_TILE);
        let tile = Tile::new(film.width(), film.height(), task);
        let pixels = film.pixels().chunks(PIXELS_PER_TILE).nth(task)?;
        let colour = filtered_pixel(tile, pixels, mean, number);
        Some((index, PixelBias::of(pixels.get(number)?, truth, colour, mean)?))
    };
    places.iter().zip(truth).enumerate().filter_map(finding).collect()
}

/// Result without the costs of the audit; `None` with too few findings.
pub(super) fn verdict(
    findings: &[(usize, PixelBias)],
    shares: &[f32],
    places: &[[u32; 2]],
    grid: Grid,
    noise: ErrorEstimate,
) -> Option<Audited> {
    let bias = BiasEstimate::of(findings.iter().map(|(i, finding)| (*finding, f64::from(shares[*i]))))?;
    let count = (grid.side * grid.side) as usize;
    // Noise of a product: the product of the noise of both halves, each for picture and audit.
    let squares = |of: usize| findings.iter().map(|(_, finding)| finding.variances[of].powi(2)).sum::<f64>();
    let region = |index: usize| {
        let inside = || findings.iter().filter(|(i, _)| grid.region(places[*i]) == index);
        let mean = inside().map(|(i, _)| f64::from(shares[*i])).sum::<f64>() / inside().count().max(1) as f64;
        let deviation =
            Deviation::of(inside().map(|(i, finding)| finding.deviation * f64::from(shares[*i]) / mean));
        let [[x, right], [y, bottom]] = grid.bounds(index);
        let is_biased = deviation.chance() < LEVEL / (count + 1) as f64;
        Region { x, y, width: right - x, height: bottom - y, deviation, is_biased }
    };
    Some(Audited {
        share: 0.0,
        pixels: findings.len() as u32,
        samples: 0,
        rays: 0,
        seconds: 0.0,
        has_photons: false,
        noise,
        bias,
        imbalance: (squares(1) / squares(0)).sqrt(),
        total: noise.with_bias(bias),
        whole: Deviation::of(findings.iter().map(|(i, finding)| finding.deviation * f64::from(shares[*i]))),
        regions: (0..count).map(region).collect(),
        unseen: 0.0,
        is_blind: false,
    })
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
}
