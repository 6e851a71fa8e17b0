//! Path tracing of single pixels, far apart: what an audit asks ([`crate::estimate`]).

use crate::Rgb;
use crate::bsdf::Features;
use crate::film::Pixel;
use crate::geometry::{MISS, Ray};
use crate::memory::{Arena, OutOfMemory};
use crate::sampling::Sampler;
use crate::transport::estimator::Counters;
use crate::transport::path::PathIntegrator;
use crate::transport::path::reuse::ReuseState;
use crate::transport::path::silhouette::is_outlined;
use crate::transport::path::state::{Components, PathState, Wavefront};
use core::ops::Range;

impl<F: Features> PathIntegrator<'_, F> {
    /// Traces `samples` of the pixels in these columns and rows, and adds them to `out`, one for one. Pixels share
    /// nothing, whatever the settings say.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`PathIntegrator::scratch`] bytes.
    pub fn probe(
        &self,
        pixels: &[[u32; 2]],
        samples: Range<u32>,
        wave: usize,
        scratch: &mut Arena,
        out: &mut [Pixel],
    ) -> Result<Counters, OutOfMemory> {
        let alone = self.with_reuse(false);
        let mut arena = scratch.scratch();
        let mut wave = Wavefront::new(wave, &mut arena)?;
        let mut counters = Counters::default();
        let all = pixels
            .iter()
            .enumerate()
            .flat_map(|(place, pixel)| samples.clone().map(move |sample| (place as u32, *pixel, sample)));
        let mut all = all.peekable();
        // A bit for each of the first pixels; others are path traced alone.
        let outlined = pixels.iter().take(u64::BITS as usize).enumerate().fold(0, |bits, (place, pixel)| {
            bits | u64::from(is_outlined(self.context.scene, self.context.lights, &self.settings, *pixel))
                << place
        });
        let outlined = |place: u32| u64::checked_shr(outlined, place).unwrap_or(0) & 1 == 1;
        while all.peek().is_some() {
            let mut count = 0;
            let slots = wave.paths.iter_mut().zip(wave.rays.iter_mut()).zip(wave.exchanges.iter_mut());
            for (((path, ray), exchange), (place, [x, y], sample)) in slots.zip(&mut all) {
                let pixel = y * self.settings.width + x;
                let sampler = Sampler::new(self.settings.seed, pixel, sample);
                *ray = Ray { tag: count as u32, ..self.camera_ray([x, y], &sampler) };
                *path = PathState {
                    throughput: [1.0; 3],
                    pdf: f32::INFINITY,
                    pixel,
                    place,
                    sample,
                    segments: 1,
                    share: if outlined(place) { Components::BESIDE_LAMP } else { Components::ALL },
                    triangle: MISS,
                    eta_squared: 1.0,
                    ..PathState::default()
                };
                *exchange = ReuseState::new(0);
                count += 1;
            }
            counters.paths += count as u64;
            alone.advance(&mut wave, count, &mut counters);
            self.look_at_lamps(outlined, &mut wave, count, &mut counters);
            let ends = wave.paths.iter().zip(&*wave.exchanges).zip(&*wave.shadow_light);
            for ((path, exchange), lamps) in ends.take(count) {
                if let Some(pixel) = out.get_mut(path.place as usize) {
                    let light = exchange.seen(path) + Rgb::from(*lamps);
                    pixel.add(path.sample, light, &mut counters.dropped);
                }
            }
        }
        Ok(counters)
    }
}
