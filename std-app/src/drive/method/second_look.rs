//! Second looks: few records have most of the picture, and their noise is most of its. When a cache is filled, and radii are
//! what neighbours have made of them, these are gathered again with more rays, which end in the records that there are now.

use super::overture::{Growing, Overture};
use crate::drive::RenderError;
use crate::drive::crew::Crew;
use core::f32::consts::PI;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{Asker, IrradianceCache, Record};
use halflight_core::memory::{Arena, Line};
use halflight_core::transport::Counters;
use halflight_core::transport::gather::{Gathering, Place};

/// No record has more than this share of the picture, however large it is.
const MOST_OF_PICTURE: f32 = 1.0 / 32.0;

/// What the noise of each record is in a picture of so many `pixels`: its variance times those that it covers.
fn worth(growing: &Growing, pixels: f32) -> Vec<f32> {
    let records = growing.cache.records();
    let mean = records.iter().map(|record| record.noise).sum::<f32>() / records.len().max(1) as f32;
    let of = |(record, place): (&Record, &Place)| {
        if !place.is_some() {
            return 0.0;
        }
        let [r1, r2] = record.radii.map(|radius| radius / place.pixel());
        noise_around(&growing.cache, record).unwrap_or(mean) * (PI * r1 * r2).min(MOST_OF_PICTURE * pixels)
    };
    records.iter().zip(&growing.places).map(of).collect()
}

/// The variance of the others that speak where `record` is; `None` where it is alone. Its own is larger where its rays have met too much
/// by chance than where they have missed it: if it looked again for that, pictures would be too dark.
fn noise_around(cache: &IrradianceCache, record: &Record) -> Option<f32> {
    let (mut sum, mut weights) = (0.0, 0.0);
    cache.visit(&Asker::open(record.position.into(), record.normal.into()), |other, weight| {
        if other.position != record.position {
            (sum, weights) = (sum + weight * other.noise, weights + weight);
        }
    });
    (weights > 0.0).then(|| sum / weights)
}

/// Which records are worth which of the numbers of rays that are so many `times` those of first looks, the fewest first: where each
/// ray takes away as much of the noise of the picture as one more for every record would, of a variance that goes with one over rays.
fn choose(worth: &[f32], times: &[f32]) -> Vec<(usize, usize)> {
    let mean = worth.iter().sum::<f32>() / worth.len().max(1) as f32;
    // What is taken from a worth of 1, beside the next fewer rays, for each of those that there are more.
    let fewer = core::iter::once(0.0).chain(times.iter().copied());
    let gains: Vec<f32> =
        fewer.zip(times).map(|(fewer, more)| (1.0 / fewer.max(1.0) - 1.0 / more) / (more - fewer)).collect();
    let of = |worth: f32| gains.iter().rposition(|gain| worth * gain > mean);
    worth.iter().enumerate().filter_map(|(i, worth)| Some((i, of(*worth)?))).collect()
}

impl<F: Features> Overture<'_, '_, F> {
    /// Gathers again with those of its finer strata at the records that are worth it; whether that is done: not where the round is over.
    pub(in crate::drive) fn look_again(
        &self,
        growing: &mut Growing,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<bool, RenderError> {
        if self.finer.is_empty() {
            return Ok(true);
        }
        let pixels = self.size[0] as f32 * self.size[1] as f32;
        let worth = worth(growing, pixels);
        let strata = self.gathering.flux.n() as f32;
        let times: Vec<f32> = self.finer.iter().map(|flux| (flux.n() as f32 / strata).powi(2)).collect();
        let chosen = choose(&worth, &times);
        let tracer = self.tracer.with_growing_cache(&growing.cache);
        let mut found: Vec<Option<Record>> = vec![None; chosen.len()];
        let gather = |task: usize, arena: &mut Arena, out: &mut [Option<Record>]| {
            let mut counters = Counters::default();
            if let (Some(out), Some((index, flux))) = (out.first_mut(), chosen.get(task)) {
                let gathering = Gathering { flux: &self.finer[*flux], ..self.gathering };
                let number = growing.number(task);
                *out = tracer.gather(&growing.places[*index], number, &gathering, arena, &mut counters)?;
            }
            Ok(counters)
        };
        if !crew.pass(&mut found, 1, scratch, &gather)? {
            return Ok(false);
        }
        growing.gathered += chosen.len() as u32;
        for ((index, _), record) in chosen.iter().zip(found) {
            if let Some(record) = record {
                growing.cache.correct(*index, &record);
            }
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_go_where_the_noise_of_the_picture_is() {
        // Four times as many rays take three quarters of what is there: 3/16 for a ray, and 16 times as many 1/64 more.
        let mut worth = vec![1.0; 100];
        assert_eq!(choose(&worth, &[4.0, 16.0]), []);
        (worth[7], worth[9]) = (5.0, 7.0);
        assert_eq!(choose(&worth, &[4.0, 16.0]), [(9, 0)]);
        worth[7] = 400.0;
        assert_eq!(choose(&worth, &[4.0, 16.0]), [(7, 1)]);
        assert_eq!(choose(&worth, &[4.0]), [(7, 0)]);
        assert_eq!(choose(&worth, &[]), []);
        assert!(choose(&[], &[4.0]).is_empty() && choose(&[0.0; 3], &[4.0]).is_empty());
        assert!(choose(&[f32::NAN, 1.0], &[4.0]).is_empty());
    }
}
