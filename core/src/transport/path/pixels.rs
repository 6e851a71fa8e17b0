//! Path tracing of scattered single pixels for an audit ([`crate::estimate`]).

use super::PathIntegrator;
use super::estimator::LightEstimator;
use super::sharing::PathWave;
use super::silhouette::is_on_silhouette;
use crate::Rgb;
use crate::bsdf::Features;
use crate::film::Pixel;
use crate::memory::{Arena, OutOfMemory};
use crate::transport::settings::Counters;
use core::ops::Range;

impl<F: Features, E: LightEstimator<F>> PathIntegrator<'_, F, E> {
    /// Traces `samples` of the pixels in these columns and rows, and adds them to `out`, in the order of
    /// `pixels`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PathIntegrator::scratch_with`] bytes.
    #[inline(never)]
    pub fn sample_pixels(
        &self,
        pixels: &[[u32; 2]],
        samples: Range<u32>,
        wave: usize,
        scratch: &mut Arena,
        out: &mut [Pixel],
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut wave = PathWave::<E::State, ()>::new(wave, &mut arena)?;
        let mut counters = Counters::default();
        let all = pixels
            .iter()
            .enumerate()
            .flat_map(|(place, pixel)| samples.clone().map(move |sample| (place as u32, *pixel, sample)));
        let mut all = all.peekable();
        // One bit for each of the first 64 pixels; the others take no extra rays for lamps.
        let silhouette_pixels =
            pixels.iter().take(u64::BITS as usize).enumerate().fold(0, |bits, (place, pixel)| {
                let is = is_on_silhouette(self.context.scene, &self.context.lights, &self.settings, *pixel);
                bits | u64::from(is) << place
            });
        let on_silhouette = |place: u32| u64::checked_shr(silhouette_pixels, place).unwrap_or(0) & 1 == 1;
        while all.peek().is_some() {
            let mut count = 0;
            for (place, pixel, sample) in all.by_ref().take(wave.wave.paths.len()) {
                self.begin_path(&mut wave, count, (pixel, place, sample), on_silhouette(place), 0);
                count += 1;
            }
            self.aim(&mut wave.wave, count);
            counters.paths += count as u64;
            self.advance(&mut wave, count, &mut counters);
            self.trace_silhouettes(on_silhouette, &mut wave.wave, count, &mut counters);
            for i in 0..count {
                let path = wave.wave.paths[i];
                if let Some(pixel) = out.get_mut(path.place as usize) {
                    let radiance = wave.radiance(i) + Rgb::from(wave.wave.shadows.light[i]);
                    pixel.add(path.sample, radiance, &mut counters.dropped);
                }
            }
        }
        Ok(counters)
    }
}
