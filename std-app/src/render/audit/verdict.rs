//! What the audited pixels say together: how large the bias is, and where.

use super::choice::Grid;
use crate::render::ErrorEstimate;
use halflight_core::estimate::{BiasEstimate, Deviation, Finding, filtered_pixel};
use halflight_core::film::{Film, PIXELS_PER_TILE, Pixel, Tile};

/// A region is told to be biased where chance alone would say so of any of them in one picture of so many.
const LEVEL: f64 = 0.025;

/// The share of a picture's light that its judge may be without.
const MOST_UNSEEN: f64 = 0.01;

/// What an audit has found.
#[derive(Clone, Debug, PartialEq)]
pub struct Audited {
    /// Its share of the work that was asked for.
    pub share: f64,
    /// Audited pixels.
    pub pixels: u32,
    /// Samples of each of them.
    pub samples: u32,
    /// Rays of the audit; those of the picture do not count them.
    pub rays: u64,
    /// Seconds of the audit; those of rendering have them in.
    pub seconds: f64,
    /// Whether its paths were joined with the photons of the picture: their blur is not in the bias.
    pub has_photons: bool,
    /// The error that the picture's own noise tells of.
    pub noise: ErrorEstimate,
    /// The squared bias.
    pub bias: BiasEstimate,
    /// How much noisier pixels are in the audit than in the picture: the quotient of their variances, in the root mean square.
    pub imbalance: f64,
    /// The sum of both, and of what photons blur that the audit does not see.
    pub total: ErrorEstimate,
    /// By how much the whole picture is too bright.
    pub whole: Deviation,
    /// By how much its parts are, row by row.
    pub regions: Vec<Region>,
    /// The share of the picture's light that its paths cannot find, by a first look with photons.
    pub unseen: f64,
    /// Whether it can tell a bias from light that its paths do not find: if not, `total` is without bias.
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
    /// By how much it is too bright.
    pub deviation: Deviation,
    /// Whether chance can be ruled out, at a level of 2.5 % for all regions and the whole together.
    pub is_biased: bool,
}

impl Audited {
    /// Whether there is a bias. Where there is none, this says so in 5 % of all pictures at most.
    pub fn is_biased(&self) -> bool {
        let is_found = self.bias.is_found()
            || self.whole_is_biased()
            || self.regions.iter().any(|region| region.is_biased);
        is_found && !self.is_blind
    }

    /// The same by a judge whose paths do not find a share `unseen` of the picture's light. Where that is more than next to
    /// nothing, a picture that is brighter than the judge's may be right; one that is darker is wrong all the same.
    pub(super) fn by_a_judge_without(self, unseen: f64) -> Self {
        let Deviation { mean, error, .. } = self.whole;
        let is_blind = unseen >= MOST_UNSEEN && mean > -2.0 * error;
        let total = if is_blind { self.noise } else { self.total };
        Self { unseen, is_blind, total, ..self }
    }

    /// Whether the whole picture is too bright or too dark.
    pub fn whole_is_biased(&self) -> bool {
        self.whole.chance() < LEVEL / (self.regions.len() + 1) as f64
    }
}

/// What each audited pixel says, with its number.
pub(super) fn findings(
    film: &Film,
    mean: f64,
    places: &[[u32; 2]],
    truth: &[Pixel],
) -> Vec<(usize, Finding)> {
    let finding = |(index, (place, truth)): (usize, (&[u32; 2], &Pixel))| {
        let position = Tile::position([film.width(), film.height()], place[0], place[1]);
        let (task, number) = (position / PIXELS_PER_TILE, position % PIXELS_PER_TILE);
        let tile = Tile::new(film.width(), film.height(), task);
        let pixels = film.pixels().chunks(PIXELS_PER_TILE).nth(task)?;
        let colour = filtered_pixel(tile, pixels, mean, number);
        Some((index, Finding::of(pixels.get(number)?, truth, colour, mean)?))
    };
    places.iter().zip(truth).enumerate().filter_map(finding).collect()
}

/// All but what the audit has cost. `None` for fewer findings than say anything.
pub(super) fn verdict(
    findings: &[(usize, Finding)],
    shares: &[f32],
    places: &[[u32; 2]],
    grid: Grid,
    noise: ErrorEstimate,
) -> Option<Audited> {
    let bias = BiasEstimate::of(findings.iter().map(|(i, finding)| (*finding, f64::from(shares[*i]))))?;
    let count = (grid.side * grid.side) as usize;
    // The noise of a product is the product of those of both halves, each of picture and audit.
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
        // 0.03, less twice the square of the standard error over 0.02; the distance to the upper end of both, and to the bias
        // that is certain by four standard errors.
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
        let finding = |bias: f64| (Finding { bias, deviation: 0.0, variances: [0.0; 2] }, 1.0);
        let others = (0..255).map(|i| finding(if i % 2 == 0 { 0.01 } else { -0.01 }));
        let bias = BiasEstimate::of(others.chain([finding(200.0)])).unwrap();
        assert!(bias.relmse > 0.7, "{bias:?}");
        let sum = noise.with_bias(bias);
        assert_eq!((sum.relmse, sum.lower), (0.01, 0.008));
        assert!(sum.upper > 2.0 * bias.relmse, "{sum:?}");
    }
}
