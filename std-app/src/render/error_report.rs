//! Error of a picture: noise from its half-films, plus bias by an audit or by photon blur.

use super::audit::{Audit, Audited};
use super::hidden_light;
use super::threads::Workers;
use halflight_core::estimate::{
    BiasEstimate, BrightnessClasses, ErrorEstimate, TileBlur, TileError, TileLight,
};
use halflight_core::film::{Film, PIXELS_PER_TILE, Pixel, Tile};
use halflight_core::method::RenderState;
use halflight_core::method::hidden_light::{HiddenLight, LackingLight};
use rayon::prelude::*;

/// Error of a picture in its parts.
pub(super) struct ErrorReport {
    /// Noise alone.
    pub(super) noise: Option<ErrorEstimate>,
    /// Noise and bias, if there is an audit.
    pub(super) audited: Option<Audited>,
    /// Noise and blur, if there are photons and no audit.
    pub(super) noise_and_blur: Option<NoiseAndBlur>,
    /// Light that the method cannot find.
    pub(super) lacking: Option<LackingLight>,
}

impl ErrorReport {
    /// Report with the result of `audit`.
    pub(super) fn new(workers: &Workers, state: &RenderState, audit: Option<&Audit>) -> Self {
        Self::with(workers, state, |noise| audit?.verdict(workers, &state.film, noise))
    }

    /// Report with the result of calling `audit` on the noise.
    pub(super) fn with(
        workers: &Workers,
        state: &RenderState,
        audit: impl FnOnce(ErrorEstimate) -> Option<Audited>,
    ) -> Self {
        Self::of_noise(workers.estimate(&state.film, state.is_correlated), workers, state, audit)
    }

    /// Report of a picture whose `noise` is known.
    pub(super) fn of_noise(
        noise: Option<ErrorEstimate>,
        workers: &Workers,
        state: &RenderState,
        audit: impl FnOnce(ErrorEstimate) -> Option<Audited>,
    ) -> Self {
        let mut audited = noise.and_then(audit);
        // An audit without photons measures the blur as well, unless it is blind.
        let is_seen = audited.as_ref().is_some_and(|audited| !audited.has_photons && !audited.is_blind);
        let mut noise_and_blur = if is_seen { None } else { NoiseAndBlur::of(workers, &state.film, noise) };
        if let Some(audited) = &mut audited
            && let Some(noise_and_blur) = noise_and_blur.take()
        {
            audited.total = audited.total.with_bias(noise_and_blur.blur);
        }
        Self { noise, audited, noise_and_blur, lacking: None }
    }

    /// Estimate with all parts.
    pub(super) fn error(&self) -> Option<ErrorEstimate> {
        let audited = self.audited.as_ref().map(|audited| audited.total);
        let found = audited.or(self.noise_and_blur.map(|noise_and_blur| noise_and_blur.total)).or(self.noise);
        self.lacking.map_or(found, |lacking| Some(lacking.beside(found)))
    }

    /// This report of a picture `film` that lacks `hidden` light.
    pub(super) fn lacking(self, hidden: Option<&HiddenLight>, film: &Film) -> Self {
        Self { lacking: hidden.map(|hidden| hidden_light::lacking(hidden, film)), ..self }
    }
}

/// Noise and blur of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseAndBlur {
    /// Noise of the picture, from its half-films.
    pub noise: ErrorEstimate,
    /// Squared bias by photon blur, estimated from the samples.
    pub blur: BiasEstimate,
    /// Sum of both.
    pub total: ErrorEstimate,
}

impl NoiseAndBlur {
    /// Error of `film` with known noise; `None` without blur.
    pub(super) fn of(workers: &Workers, film: &Film, noise: Option<ErrorEstimate>) -> Option<Self> {
        let (noise, blur) = noise.zip(workers.blur(film))?;
        Some(Self { noise, blur, total: noise.with_bias(blur) })
    }
}

impl Workers<'_> {
    /// Error of `film`; `None` with fewer than four samples or for a black picture.
    pub(super) fn estimate(&self, film: &Film, shares: bool) -> Option<ErrorEstimate> {
        ErrorEstimate::of_picture(&self.errors(film)?, film.width(), shares)
    }

    /// Error sums of the tiles of `film`; `None` for a black picture.
    fn errors(&self, film: &Film) -> Option<Vec<TileError>> {
        let mean = self.mean(film)?;
        let tiles = film.pixels().par_chunks(PIXELS_PER_TILE);
        let tile = |index: usize| Tile::new(film.width(), film.height(), index);
        let learn = |mut known: BrightnessClasses, (index, pixels): (usize, &[Pixel])| {
            known.add(tile(index), pixels, mean);
            known
        };
        let both = |mut one: BrightnessClasses, other: BrightnessClasses| {
            one += &other;
            one
        };
        let count = tiles.len();
        Some(self.install(|| {
            let asked =
                tiles.clone().enumerate().filter(|(tile, _)| BrightnessClasses::uses_tile(*tile, count));
            let alike =
                asked.fold(BrightnessClasses::default, learn).reduce(BrightnessClasses::default, both);
            let shrinkage = alike.shrinkage();
            let error = |(index, pixels)| TileError::of(tile(index), pixels, mean, &shrinkage);
            tiles.enumerate().map(error).collect()
        }))
    }

    /// Bias of `film` by photon blur; `None` without photons.
    pub(super) fn blur(&self, film: &Film) -> Option<BiasEstimate> {
        let mean = self.mean(film)?;
        let tiles = film.pixels().par_chunks(PIXELS_PER_TILE);
        let tiles: Vec<_> = self.install(|| tiles.map(|tile| TileBlur::of(tile, mean)).collect());
        BiasEstimate::of_blur(tiles.into_iter())
    }

    /// Mean radiance of `film`; `None` if black.
    pub(super) fn mean(&self, film: &Film) -> Option<f64> {
        let tiles = film.pixels().par_chunks(PIXELS_PER_TILE);
        let mut light = TileLight::default();
        let sums: Vec<_> = self.install(|| tiles.map(TileLight::of).collect());
        sums.into_iter().for_each(|tile| light += tile);
        Some(light.mean()).filter(|mean| *mean > 0.0)
    }
}
