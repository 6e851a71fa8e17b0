//! Sums of the pilot over blocks of pixels: noise and work of all candidates.

use super::{BLOCK, Block, CONNECTIONS, Found, LIST, Pilot, RESTS, SAMPLE, WEIGHTINGS, Weighting};
use crate::Rgb;
use crate::bsdf::Features;
use crate::film::PIXELS_PER_TILE;
use crate::method::counts::prediction::{CANDIDATES, Candidate, Reweighted, Weighed, Work};
use crate::method::counts::rarity::{Rarity, is_often};
use crate::method::tuned::LEAST_VARIANCE;
use crate::transport::Counters;
use crate::transport::bidirectional::contribution::{Class, Contribution, Rest};
use crate::transport::bidirectional::light_pass::{PATHS_PER_TASK, marked};

impl<F: Features> Pilot<'_, '_, F> {
    /// Counts of each of the [`super::WAYS`], and the light that it finds.
    fn ways(&self) -> impl Iterator<Item = (Candidate, fn(Rest) -> bool)> {
        let all: fn(Rest) -> bool = |_| true;
        let candidates = self.candidates.iter().map(move |candidate| (*candidate, all));
        let rests: [fn(Rest) -> bool; RESTS] = match self.has_photons {
            false => [|rest| !rest.is_seen(), Rest::is_beside_irradiance, Rest::is_beside_lobes],
            true => [
                |rest| !rest.is_seen() && !rest.is_of_photons(false),
                |rest| rest.is_beside_irradiance() && !rest.is_of_photons(true),
                |rest| rest.is_beside_lobes() && !rest.is_of_photons(true),
            ],
        };
        let paths = rests.into_iter().chain([Rest::is_seen as fn(Rest) -> bool]);
        candidates.chain(paths.map(|is_found| (Candidate::PATHS, is_found)))
    }

    /// Adds camera paths of a sample to the `blocks` and sums of their tile. The variance is that of pairs
    /// of samples, except that the squares of contributions are those expected. Those of merges stay as
    /// they are: the photons of a disc are no independent samples.
    pub(super) fn add_camera_paths(
        &self,
        weighed: &[Weighed],
        (sample, sums): (u32, &mut [f32]),
        blocks: &mut [Block],
    ) {
        let sign = if sample == 0 { 1.0 } else { -1.0 };
        for weighed in weighed {
            let block = &mut blocks[weighed.place() / BLOCK];
            block.light += SAMPLE * weighed.value();
            block.merged += if weighed.is_merge() { SAMPLE * weighed.value() } else { 0.0 };
        }
        for (i, ((candidate, is_found), sums)) in
            self.ways().zip(sums.chunks_mut(PIXELS_PER_TILE)).enumerate()
        {
            let ratios = candidate.ratios(&self.counts);
            for weighed in weighed.iter().filter(|weighed| is_found(weighed.rest())) {
                let Reweighted { value, square, likelihood } = weighed.with(&ratios);
                let block = &mut blocks[weighed.place() / BLOCK];
                let is_sum = weighed.is_merge() && candidate.merging;
                // A rare sample that the pilot has by chance is no measure of the variance.
                let is_often = is_often(likelihood);
                let variance = match is_sum {
                    true => 0.0,
                    false => square - if is_often { value * value } else { 0.0 },
                };
                block.ways[i].add(likelihood, SAMPLE, weighed.value(), variance);
                block.square[i] += SAMPLE * square;
                if is_sum || is_often {
                    sums[weighed.place()] += sign * value;
                }
            }
        }
    }

    /// Adds splat number `index` of all weightings, if it is in `tile`.
    pub(super) fn add_splat(
        &self,
        tile: usize,
        weightings: &[Weighting; WEIGHTINGS],
        index: usize,
        blocks: &mut [Block],
    ) {
        let splat = weightings[0].splats[index];
        let (pixel, rest) = marked(splat.pixel);
        let place = (pixel as usize).wrapping_sub(tile * PIXELS_PER_TILE);
        if place >= PIXELS_PER_TILE {
            return;
        }
        let value = |weighting: usize| {
            let other = weightings[weighting].splats[index];
            let is_same = other.pixel == splat.pixel;
            is_same.then(|| Rgb::from(other.radiance).element_sum() / 3.0)
        };
        let (Some(base), Some(a), Some(b), Some(c)) = (value(0), value(1), value(2), value(3)) else {
            return;
        };
        let contribution = Contribution::new(Class::Splats, place as u32, base).with_rest(rest);
        let weighed = Weighed::new(contribution, [a, b, c]);
        let block = &mut blocks[place / BLOCK];
        block.light += SAMPLE * base;
        for (i, (candidate, _)) in self.ways().enumerate().filter(|(_, (_, is_found))| is_found(rest)) {
            let Reweighted { square, likelihood, .. } = weighed.with(&candidate.ratios(&self.counts));
            block.ways[i].add(likelihood, SAMPLE, base, square);
            block.square[i] += SAMPLE * square;
        }
    }

    pub(super) fn sum(&self, blocks: &[Block], light: &Counters, camera: &Counters) -> Found {
        let of = |value: &dyn Fn(&Block) -> f32| blocks.iter().map(value).sum::<f32>();
        let pixels = of(&|block| block.pixels);
        let mean = of(&|block| block.light) / pixels;
        let scale = |block: &Block| {
            let level = block.light / block.pixels;
            level * level + 0.01 * mean * mean
        };
        let rarity = |way: usize| {
            let (mut rarity, mut square) = (Rarity::default(), 0.0);
            for block in blocks.iter().filter(|block| block.pixels > 0.0 && scale(block) > 0.0) {
                rarity.add(&block.ways[way], block.pixels, scale(block));
                square += block.square[way] / scale(block);
            }
            rarity.over(pixels, LEAST_VARIANCE * square / pixels)
        };
        let candidates = core::array::from_fn(rarity);
        let rests = core::array::from_fn(|rest| rarity(CANDIDATES + rest));
        let edges = rarity(CANDIDATES + RESTS).noise();
        let samples = pixels / SAMPLE;
        let connections = of(&|block| block.connections);
        let light_paths = (self.tasks * PATHS_PER_TASK) as f32 / SAMPLE;
        let work = Work {
            camera_rays: camera.rays as f32 / samples,
            light_samples: (camera.shadow_rays as f32 - connections).max(0.0) / samples,
            connections: connections / (CONNECTIONS as f32 * samples),
            light_rays: light.rays as f32 / light_paths,
            splats: light.shadow_rays as f32 / light_paths,
        };
        let merged = of(&|block| block.merged) / of(&|block| block.light).max(f32::MIN_POSITIVE);
        Found { candidates, rests, edges, work, merged }
    }
}

/// The first `count` contributions of all lists, with shares.
pub(super) fn weigh<'w>(lists: &[Contribution], count: usize, weighed: &'w mut [Weighed]) -> &'w [Weighed] {
    let mut same = 0;
    for (i, out) in weighed.iter_mut().enumerate().take(count) {
        let base = lists[i];
        let doubled = [1, 2, 3].map(|weighting| lists[weighting * LIST + i]);
        // A weight that is rounded to zero shifts the rest of its list.
        if doubled.iter().any(|other| !other.is_same(&base)) {
            break;
        }
        *out = Weighed::new(base, doubled.map(|other| other.value));
        same = i + 1;
    }
    &weighed[..same]
}
