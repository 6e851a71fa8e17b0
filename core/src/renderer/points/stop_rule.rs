//! Stop rule of points: tiles of near points end one by one, as soon as their intervals are within an error.

use super::film::OFFSET;
use super::{IrradianceRenderer, MOST_SAMPLES, PointFilm};
use crate::film::{PIXELS_PER_TILE, Pixel};
use crate::light::luminance;
use crate::memory::OutOfMemory;
use crate::method::Executor;
use libm::{ceil, fmin, sqrt};

/// Samples at which the intervals of a tile are first judged.
pub(super) const FIRST_DECISION: u32 = 64;

/// Fraction of the points of a finished tile whose intervals are within the error.
const WITHIN: f64 = 0.95;

impl IrradianceRenderer<'_> {
    /// Adds samples to all tiles, or to those that have not reached the `error`, until they have or have
    /// `most` samples. Tiles and caches are judged at numbers of samples of their own, so that the steps are
    /// of no matter.
    pub(super) fn advance(
        &mut self,
        (error, most): (Option<f64>, u32),
        executor: &mut impl Executor,
    ) -> Result<(), OutOfMemory> {
        error.into_iter().for_each(|error| self.aim_at(error));
        let is_open = |finished: &[u8], tile: usize| error.is_none() || finished.get(tile) == Some(&0);
        while !executor.is_over() && (error.is_none() || self.has_open_tiles()) {
            let is_judged = error.is_some() || self.audit.is_some();
            let (target, is_decision) = match is_judged {
                true => (most.min(self.decision), self.decision <= most),
                false => (most, false),
            };
            self.sample(executor, target, is_open)?;
            if executor.is_over() || !is_decision {
                break;
            }
            if self.is_cache_useless(target) {
                self.leave_cache();
                continue;
            }
            if let Some(error) = error {
                self.estimate(executor);
                self.finish_tiles(error as f32);
            }
            if target == MOST_SAMPLES {
                break;
            }
            self.decision = next_decision(target);
        }
        self.estimate(executor);
        Ok(())
    }

    /// Opens all tiles where `error` is another than before.
    fn aim_at(&mut self, error: f64) {
        if self.error != error {
            self.finished.fill(0);
            self.error = error;
            let samples = self.film.state.samples.iter().copied().max().unwrap_or_default();
            self.decision = FIRST_DECISION;
            while self.decision < samples {
                self.decision = next_decision(self.decision);
            }
        }
    }

    /// True if a tile of the shard has not reached the error.
    fn has_open_tiles(&self) -> bool {
        let shard = self.film.state.shard;
        self.finished.iter().enumerate().any(|(tile, finished)| *finished == 0 && shard.owns(tile))
    }

    /// Marks the tiles in which enough points are within `error`.
    fn finish_tiles(&mut self, error: f32) {
        let PointFilm { layout, ref state, ref half_widths, .. } = self.film;
        let pixels = &state.film.pixels()[..layout.pixels()];
        let offset = OFFSET * self.film.mean() as f32;
        let tiles = pixels.chunks(PIXELS_PER_TILE).zip(half_widths.chunks(PIXELS_PER_TILE));
        for ((pixels, half_widths), finished) in tiles.zip(self.finished.iter_mut()) {
            // Replicates of a point average their noise.
            let each = libm::sqrtf(layout.replicates as f32);
            let is_within =
                |(pixel, half): (&Pixel, &f32)| *half <= each * error * (luminance(pixel.mean()) + offset);
            let within = pixels.iter().zip(half_widths).filter(|pair| is_within(*pair)).count();
            *finished |= u8::from(within as f64 >= WITHIN * pixels.len() as f64);
        }
    }
}

/// Samples at which tiles are judged after `samples`.
fn next_decision(samples: u32) -> u32 {
    fmin(ceil(f64::from(samples) * sqrt(2.0)), f64::from(MOST_SAMPLES)) as u32
}
