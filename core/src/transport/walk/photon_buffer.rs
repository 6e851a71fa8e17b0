//! Photons of a task: a list that is long enough, and one of any number of photons.

use crate::photon::Photon;
use crate::sampling::mix;
use crate::transport::settings::Counters;

/// Photon memory of a task.
pub(crate) struct PhotonBuffer<'p> {
    photons: &'p mut [Photon],
    count: usize,
}

impl<'p> PhotonBuffer<'p> {
    pub(crate) fn new(photons: &'p mut [Photon]) -> Self {
        Self { photons, count: 0 }
    }

    pub(crate) fn push(&mut self, photon: Photon, counters: &mut Counters) {
        match self.photons.get_mut(self.count) {
            Some(slot) => {
                *slot = photon;
                self.count += 1;
            }
            None => counters.dropped.unfinished += 1,
        }
    }

    /// Keeps the photons for which `is_kept` is true, in their order.
    fn retain(&mut self, is_kept: impl Fn(&Photon) -> bool) {
        let mut kept = 0;
        for i in 0..self.count {
            if is_kept(&self.photons[i]) {
                self.photons[kept] = self.photons[i];
                kept += 1;
            }
        }
        self.count = kept;
    }

    /// Fills the rest with photons without position, which a map rejects.
    pub(crate) fn finish(self) {
        let Self { photons, count } = self;
        if let Some(rest) = photons.get_mut(count..) {
            rest.fill(Photon::NONE);
        }
    }
}

/// Fraction of the memory that the expected number of photons fills. The rest is eight standard deviations.
const FULL: f32 = 0.9;

/// Factor of the fraction of photons that are kept, when these become too many.
const STEP: f32 = 0.875;

/// A random sample of all photons of a task, as large as its memory: each is kept with the same probability,
/// and its power is divided by it. The probability depends on the number of photons alone, so that the
/// sample has no bias; photons of long paths have the power of others.
pub(crate) struct PhotonSample<'p> {
    buffer: PhotonBuffer<'p>,
    /// Photons so far, and the fraction that is kept.
    count: u32,
    fraction: f32,
    /// True if photons know the length of their paths.
    is_limited: bool,
}

impl<'p> PhotonSample<'p> {
    /// Sample in the memory `photons`, which know the length of their paths if it `is_limited`.
    pub(crate) fn new(photons: &'p mut [Photon], is_limited: bool) -> Self {
        Self { buffer: PhotonBuffer::new(photons), count: 0, fraction: 1.0, is_limited }
    }

    pub(crate) fn push(&mut self, photon: Photon, counters: &mut Counters) {
        self.count += 1;
        let most = FULL * self.buffer.photons.len() as f32;
        if self.count as f32 * self.fraction > most {
            self.fraction *= STEP;
            let fraction = self.fraction;
            self.buffer.retain(|photon| number(photon) < fraction);
        }
        if number(&photon) < self.fraction {
            self.buffer.push(photon, counters);
        }
    }

    /// Divides powers, and fills the rest with photons without position.
    pub(crate) fn finish(mut self) {
        if self.fraction < 1.0 {
            let PhotonBuffer { photons, count } = &mut self.buffer;
            for photon in photons.iter_mut().take(*count) {
                let scaled = photon.with_power(photon.power() / self.fraction);
                let remaining = photon.remaining();
                *photon = if self.is_limited { scaled.with_remaining(remaining) } else { scaled };
            }
        }
        self.buffer.finish();
    }
}

/// Random number of a photon in [0, 1), by its place and the direction of its light.
fn number(photon: &Photon) -> f32 {
    let [x, y, z, light] = photon.key().map(u64::from);
    (mix(mix(x | y << 32) ^ (z | light << 32)) >> 40) as f32 / (1u64 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use glam::Vec3;
    use std::vec;

    #[test]
    fn a_sample_of_many_photons_has_their_power_and_few_are_kept_as_they_are() {
        const ROOM: usize = 6144;
        let photon = |i: u32| {
            let place = Vec3::new((0.37 * i as f32).sin(), (0.11 * i as f32).cos(), 1e-3 * i as f32);
            Photon::new(place, Vec3::new(0.3, 0.4, 0.8), Vec3::Z, Rgb::new(1.0, 0.5, 0.25))
        };
        for count in [10, 5529, 6144, 30_000, 300_000] {
            let mut memory = vec![Photon::NONE; ROOM];
            let mut sample = PhotonSample::new(&mut memory, false);
            let mut counters = Counters::default();
            (0..count).for_each(|i| sample.push(photon(i), &mut counters));
            sample.finish();
            assert_eq!(counters.dropped.unfinished, 0);
            let kept = memory.iter().filter(|photon| !photon.position().is_nan());
            let power: f64 = kept.clone().map(|photon| f64::from(photon.power().x)).sum();
            if count as f32 <= FULL * ROOM as f32 {
                assert_eq!((kept.count() as u32, power), (count, f64::from(count)));
                continue;
            }
            // Four standard deviations of the number of kept photons.
            let kept = kept.count() as f64;
            assert!(kept > 0.7 * ROOM as f64 && (power / f64::from(count) - 1.0).abs() < 4.0 / kept.sqrt());
        }
    }
}
