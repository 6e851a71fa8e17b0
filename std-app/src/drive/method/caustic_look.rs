//! The first look for caustics: what photons find out about the picture, and whether it is worth to go on with them. It is
//! where they bring much of the light; and where they bring little of it that paths find so rarely that it would be most
//! of the noise: a small glass in a large lit room.

use super::Stage;
use super::path::Paths;
use crate::drive::RenderError;
use core::f64::consts::PI;
use halflight_core::bsdf::Features;
use halflight_core::transport::Pilot;
use halflight_core::transport::caustics::tracer::{BLOCKS, GuideSample};

/// The share of the picture's light that photons must bring, of what paths find badly,
const LEAST_SHARE: f64 = 3.5e-2;

/// or by how much the relative variance that this light has by paths alone must be that of all other, if so many of the
/// light paths show in the picture: few photons are noise as well.
const LEAST_NOISE: f64 = 0.5;
const LEAST_USEFUL: f64 = 0.2;

/// The parts of them from which on a glance leaves it open: it finds between a half and twice the share, and a tenth of what is
/// useful where it has not learned which of many lamps matters; half of it once more, for it sees few.
const DOUBT_SHARE: f64 = 0.25;
const DOUBT_USEFUL: f64 = 0.0625;

/// Samples of a picture, and how often paths must find light in all of it to be noise: what they find more rarely is
/// missing.
const SAMPLES: f64 = 64.0;
const LEAST_HITS: f64 = 4.0;

/// The share of the picture's light from which on photons stay because paths never find it: no pilot knows of it.
const MOST_MISSING: f64 = 5e-3;

/// Samples that a pilot takes: what it meets less often than that, it does not know.
const PILOT: f64 = 4.0 * 16.0 * 1024.0;

/// The work of a path that asks photons, relative to one that does not, for the same rays.
const ASKING: f64 = 1.3;

/// By how much there are more and wider discs, at most, than where photons are not what is noisy; and the light that photons bring,
/// over all other, from which on there are.
const MOST_PLENTY: f64 = 4.0;
const MUCH: f64 = 0.4;

const ALL: usize = (BLOCKS * BLOCKS) as usize;

/// A block of the picture: means over its pixels.
#[derive(Clone, Copy, Default)]
struct Block {
    /// The radiance that photons bring,
    light: f64,
    /// that part which paths alone never find,
    missing: f64,
    /// and the square of the other in a sample by paths alone;
    square: f64,
    /// that part of it which a pilot is too short for.
    rare: f64,
}

/// What a look has found.
pub(super) struct Looked {
    /// Of the mean radiance of the picture.
    pub(super) share: f64,
    /// Light paths that show in it, as a share of all.
    pub(super) useful: f64,
    /// The relative variance of one sample that their light has by paths alone.
    noise: f64,
    /// The same of what a pilot of these paths does not know.
    rare: f64,
    /// The share of the light that paths never find.
    missing: f64,
    /// The mean radiance without them.
    pub(super) mean: f64,
}

/// The share of light paths that show in the picture.
pub(super) fn useful(finds: &[GuideSample]) -> f64 {
    finds.iter().filter(|find| find.light > 0.0).count() as f64 / finds.len().max(1) as f64
}

/// The mean radiance that `finds` bring to a picture of so many `pixels`, in discs of `radius` pixels, where paths that take
/// so many `samples` of each pixel as good as never find it: less often than `least` times in all.
pub(super) fn missing(finds: &[GuideSample], radius: f64, pixels: f64, (samples, least): (f64, f64)) -> f64 {
    let disc = PI * radius * radius;
    // What flashes brightest first.
    let mut shown: Vec<_> = finds.iter().filter(|find| find.light > 0.0).collect();
    shown.sort_by(|a, b| b.flash.total_cmp(&a.flash));
    let mut hits = 0.0;
    let mut missing = 0.0;
    for find in shown {
        hits += samples * disc * f64::from(find.hits);
        if hits >= least {
            break;
        }
        missing += disc * f64::from(find.light) / pixels;
    }
    missing
}

impl Looked {
    /// `finds` of discs of `radius` pixels in a picture of so many `pixels`, which is of `mean` radiance without them.
    pub(super) fn new(finds: &[GuideSample], radius: f64, pixels: f64, mean: f64) -> Self {
        // Power over the area of a disc, from a surface that reflects half of it evenly.
        let worth = finds.iter().map(|find| f64::from(find.worth)).sum::<f64>();
        let found = 0.5 / PI * worth * radius * radius / pixels;
        let share = if found > 0.0 { found / (mean + found) } else { 0.0 };

        // What flashes brightest first.
        let mut shown: Vec<_> = finds.iter().filter(|find| find.light > 0.0).collect();
        shown.sort_by(|a, b| b.flash.total_cmp(&a.flash));
        let mut blocks = [Block::default(); ALL];
        let disc = PI * radius * radius;
        let of_block = disc * ALL as f64 / pixels;
        let mut hits = 0.0;
        for find in shown {
            let Some(block) = blocks.get_mut(find.block as usize) else { continue };
            let light = of_block * f64::from(find.light);
            hits += SAMPLES * disc * f64::from(find.hits);
            block.light += light;
            if hits < LEAST_HITS {
                block.missing += light;
                continue;
            }
            let square = of_block * f64::from(find.hits) * f64::from(find.flash).powi(2);
            block.square += square;
            if hits * PILOT < LEAST_HITS * SAMPLES * pixels {
                block.rare += square;
            }
        }
        let relative = |square: f64, block: &Block| {
            let square = square + SAMPLES * block.missing.powi(2);
            if square > 0.0 { square / (mean + block.light).powi(2) } else { 0.0 }
        };
        let noise = blocks.iter().map(|block| relative(block.square, block)).sum::<f64>() / ALL as f64;
        let rare = blocks.iter().map(|block| relative(block.rare, block)).sum::<f64>() / ALL as f64;
        let missing = blocks.iter().map(|block| block.missing).sum::<f64>() / ALL as f64;
        let missing = if missing > 0.0 { missing / (mean + found) } else { 0.0 };
        Self { share, useful: useful(finds), noise, rare, missing, mean }
    }

    /// How much more is to be done for photons than usual. Over the light squared their variance is that of a disc's few photons, and
    /// counts as the square of their share: the light paths that are best grow with the quotient of their light to the other.
    pub(super) fn plenty(&self) -> f64 {
        (self.share / (MUCH * (1.0 - self.share))).clamp(1.0, MOST_PLENTY)
    }

    /// Whether a longer look may find that photons are worth it.
    pub(super) fn may_pay(&self) -> bool {
        self.share >= DOUBT_SHARE * LEAST_SHARE || self.useful >= DOUBT_USEFUL * LEAST_USEFUL
    }

    /// What paths alone leave, by their `pilot`, for photons to be compared with.
    pub(super) fn alone(&self, pilot: &Pilot, shared: bool) -> Alone {
        // Light that paths never find is not noise: without photons the picture would lack it.
        let rare = if self.missing >= MOST_MISSING { f64::INFINITY } else { self.rare };
        Alone { scatter: pilot.scatter(shared) + rare, work: pilot.work(shared), mean: self.mean as f32 }
    }

    /// Whether photons may be worth it.
    pub(super) fn pays<F: Features>(&self, stage: &Stage, paths: &mut Paths<F>) -> Result<bool, RenderError> {
        if self.share >= LEAST_SHARE || self.useful < LEAST_USEFUL {
            return Ok(self.share >= LEAST_SHARE);
        }
        Ok(self.noise >= LEAST_NOISE * paths.noise(stage, self.mean as f32)?)
    }
}

/// What paths alone leave and cost, for each sample of a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Alone {
    /// Variance, relative to the light of a block.
    scatter: f64,
    /// Rays.
    work: f64,
    /// The mean radiance of the picture.
    pub(super) mean: f32,
}

impl Alone {
    /// Whether paths with photons, by their `pilot`, leave less variance for their work, which is so many rays of `light` paths
    /// more.
    pub(super) fn is_worse_than(&self, pilot: &Pilot, shared: bool, light: f64) -> bool {
        let work = ASKING * pilot.work(shared) + light;
        pilot.scatter(shared) * work < self.scatter * self.work
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_more_of_the_light_photons_bring_the_more_is_done_for_them() {
        let plenty =
            |share| Looked { share, useful: 1.0, noise: 0.0, rare: 0.0, missing: 0.0, mean: 1.0 }.plenty();
        // A caustic beside a lamp, as many as ever; a room behind glass; and a lamp in a bulb.
        assert_eq!([0.0, 0.05, 0.28].map(plenty), [1.0; 3]);
        assert!((2.0..4.0).contains(&plenty(0.5)), "{}", plenty(0.5));
        assert_eq!([0.7, 0.96, 1.0].map(plenty), [4.0; 3]);
    }
}
