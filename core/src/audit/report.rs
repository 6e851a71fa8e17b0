//! Error of a picture: noise from its half-films, plus bias by an audit or by photon blur.

use super::run::Audit;
use super::verdict::Audited;
use crate::bsdf::Features;
use crate::estimate::{BiasEstimate, ErrorEstimate};
use crate::film::Film;
use crate::method::hidden_light::{HiddenLight, LackingLight};
use crate::method::{Executor, RenderState};
use crate::reconstruction::{FilmReconstruction, ReconstructionError};

/// Error of a picture in its parts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorReport {
    /// Noise alone; `None` with fewer than four samples or for a black picture.
    pub noise: Option<ErrorEstimate>,
    /// Noise and bias, if there is an audit.
    pub audited: Option<Audited>,
    /// Noise and blur, if there are photons and no audit.
    pub noise_and_blur: Option<NoiseAndBlur>,
    /// Light that the method cannot find.
    pub lacking: Option<LackingLight>,
    /// Error of the reconstructed picture without the bias of the method, if it is reconstructed. The parts
    /// with bias are then those of the reconstructed picture; `noise` is that of the samples.
    pub reconstructed: Option<ReconstructionError>,
}

impl ErrorReport {
    /// Report of a picture, or of its `reconstruction`, which is made anew, with the result of its `audit` if
    /// it has one.
    #[doc(hidden)]
    pub fn new<F: Features, E: Executor>(
        state: &RenderState,
        reconstruction: Option<&mut FilmReconstruction>,
        audit: Option<&mut Audit<F>>,
        executor: &mut E,
    ) -> Self {
        let judge = |mean, noise, made: Option<&FilmReconstruction>, executor: &mut E| {
            let audit = audit?;
            audit.compare(&state.film, made, mean, executor);
            audit.verdict(noise)
        };
        Self::judged_by(state, reconstruction, judge, executor)
    }

    /// Report of a picture, or of its `reconstruction`, which is made anew. `audit` judges it by its mean,
    /// its noise and that reconstruction.
    #[doc(hidden)]
    pub fn judged_by<E: Executor>(
        state: &RenderState,
        reconstruction: Option<&mut FilmReconstruction>,
        audit: impl FnOnce(f64, ErrorEstimate, Option<&FilmReconstruction>, &mut E) -> Option<Audited>,
        executor: &mut E,
    ) -> Self {
        let film = &state.film;
        let mean = film.mean_radiance(executor);
        let noise = mean.and_then(|mean| ErrorEstimate::of_film(film, mean, state.is_correlated, executor));
        let reconstruction = reconstruction.map(|made| {
            made.update(film, noise, executor);
            &*made
        });
        let Some(mean) = mean else { return Self::default() };
        let reconstructed = reconstruction.and_then(FilmReconstruction::error);
        let judge = |mean, noise, executor: &mut E| audit(mean, noise, reconstruction, executor);
        Self { noise, reconstructed, ..Self::default() }.audited_by(film, mean, judge, executor)
    }

    /// Report of `film`, whose errors are correlated between distant pixels or not, or of its reconstruction
    /// with this error. `audit` judges it by its mean and its noise.
    pub fn of_film<E: Executor>(
        film: &Film,
        (is_correlated, reconstructed): (bool, Option<ReconstructionError>),
        audit: impl FnOnce(f64, ErrorEstimate, &mut E) -> Option<Audited>,
        executor: &mut E,
    ) -> Self {
        let Some(mean) = film.mean_radiance(executor) else { return Self::default() };
        let noise = ErrorEstimate::of_film(film, mean, is_correlated, executor);
        let noise = Self { noise, reconstructed, ..Self::default() };
        noise.audited_by(film, mean, audit, executor)
    }

    /// Report of `film` or its `reconstruction` with the same noise, and the newest result of its `audit`.
    #[doc(hidden)]
    pub fn judged_anew<F: Features, E: Executor>(
        self,
        film: &Film,
        reconstruction: Option<&FilmReconstruction>,
        audit: &mut Audit<F>,
        executor: &mut E,
    ) -> Self {
        let Some(mean) = film.mean_radiance(executor) else { return self };
        self.audited_by(
            film,
            mean,
            |mean, noise, executor| {
                audit.compare(film, reconstruction, mean, executor);
                audit.verdict(noise)
            },
            executor,
        )
    }

    fn audited_by<E: Executor>(
        self,
        film: &Film,
        mean: f64,
        audit: impl FnOnce(f64, ErrorEstimate, &mut E) -> Option<Audited>,
        executor: &mut E,
    ) -> Self {
        let Some(raw) = self.noise else { return self };
        // An audit of the reconstructed picture measures the bias of the reconstruction as well.
        let noise = self.reconstructed.map_or(raw, |error| error.variance());
        let without_audit = self.reconstructed.map_or(raw, |error| error.total);
        let mut audited = audit(mean, noise, executor);
        // An audit without photons measures the blur as well, unless it is blind.
        let sees_blur = |audited: &Audited| !audited.work.has_photons && !audited.is_blind;
        let blur = match audited.as_ref().is_some_and(sees_blur) {
            true => None,
            false => BiasEstimate::of_film(film, mean, executor),
        };
        let mut noise_and_blur = None;
        match (&mut audited, blur) {
            (_, None) => {}
            (Some(audited), Some(blur)) => audited.total = audited.total.with_bias(blur),
            (None, Some(blur)) => {
                let noise = without_audit;
                noise_and_blur = Some(NoiseAndBlur { noise, blur, total: noise.with_bias(blur) });
            }
        }
        // All pixels know the bias of the reconstruction better than the few of an audit do.
        if let (Some(audited), Some(error)) = (&mut audited, self.reconstructed) {
            audited.total = audited.total.larger(error.total);
        }
        Self { noise: self.noise, audited, noise_and_blur, ..self }
    }

    /// Estimate with all parts.
    pub fn error(&self) -> Option<ErrorEstimate> {
        let audited = self.audited.as_ref().map(|audited| audited.total);
        let sampled = self.reconstructed.map(|error| error.total).or(self.noise);
        let found = audited.or(self.noise_and_blur.map(|noise_and_blur| noise_and_blur.total)).or(sampled);
        self.lacking.map_or(found, |lacking| Some(lacking.beside(found)))
    }

    /// This report of a picture `film` that lacks `hidden` light.
    #[doc(hidden)]
    pub fn lacking(self, hidden: Option<&HiddenLight>, film: &Film) -> Self {
        Self { lacking: hidden.map(|hidden| hidden.lacking_in(film)), ..self }
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
