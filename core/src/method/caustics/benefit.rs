//! The benefit of caustic photons, from the light paths of a prepass.
//!
//! Photons pay in two cases: they carry much of the light; or they carry a little of it that path tracing
//! finds so rarely that it would be most of the noise, such as the caustic of a small glass in a large room.
//! Light that path tracing cannot find, of a point light through glass, needs them however little it is.

use crate::method::tuned::{
    GATHERING, HIDDEN_LIGHT, LEAST_HITS, MISSING_LIGHT, PHOTON_DOUBT, PHOTON_GAIN, PHOTON_NOISE,
    PHOTON_SHARE, PHOTONS_VISIBLE,
};
use crate::transport::Pilot;
use crate::transport::caustics::tracer::{BLOCKS, GuideSample};
use core::f64::consts::PI;

/// Samples of a picture.
const SAMPLES: f64 = 64.0;

/// Samples of a pilot. It does not see light that is found less often.
const PILOT_SAMPLES: f64 = 4.0 * 16.0 * 1024.0;

/// Largest photon budget, relative to the usual one; and the ratio of the photons' light to all other from
/// which on the budget grows.
const MOST_BUDGET: f64 = 4.0;
const BUDGET_RATIO: f64 = 0.4;

/// Light paths of a map for each pixel of the picture and each sample that the map serves, with the usual
/// photon budget.
pub(super) const PATHS_PER_SAMPLE: f64 = 0.5;

const ALL: usize = (BLOCKS * BLOCKS) as usize;

/// A block of the picture: means over its pixels.
#[derive(Clone, Copy, Default)]
struct Block {
    /// Radiance of photons.
    light: f64,
    /// Its part that path tracing never finds.
    missing: f64,
    /// Part of that which no number of samples finds.
    hidden: f64,
    /// Mean square of a sample of the other part by path tracing alone.
    square: f64,
    /// Its part that is too rare for a pilot.
    rare: f64,
}

/// Benefit of caustic photons for a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Benefit {
    /// Their fraction of the mean radiance.
    pub(super) share: f64,
    /// Fraction of the light paths that the camera sees.
    pub(super) visible: f64,
    /// Relative variance of a sample of their light by path tracing alone.
    noise: f64,
    /// The same by photons.
    noise_of_photons: f64,
    /// Its part that is too rare for a pilot.
    rare: f64,
    /// Fraction of the light that path tracing never finds.
    missing: f64,
    /// Its part that no number of samples finds.
    hidden: f64,
    /// Mean radiance of all other light.
    pub(super) mean: f64,
}

/// The fraction of light paths that the camera sees.
pub(super) fn visible(found: &[GuideSample]) -> f64 {
    let is_visible = |path: &&GuideSample| path.light > 0.0 && (path.block as usize) < ALL;
    found.iter().filter(is_visible).count() as f64 / found.len().max(1) as f64
}

/// Mean radiance that the light paths `found` bring to a picture of `pixels` pixels, in discs of `radius`
/// pixels, and that path tracing with `samples` of each pixel finds less often than `least` times in all.
/// Sorts `found`.
pub(super) fn missing(
    found: &mut [GuideSample],
    radius: f64,
    pixels: f64,
    (samples, least): (f64, f64),
) -> f64 {
    let disc = PI * radius * radius;
    let (mut hits, mut missing) = (0.0, 0.0);
    for path in brightest_first(found) {
        hits += samples * disc * f64::from(path.hits);
        if hits >= least {
            break;
        }
        missing += disc * f64::from(path.light) / pixels;
    }
    missing
}

/// Sorts `found` by the radiance of a hit; those that the camera sees. The order does not depend on that of
/// `found`.
fn brightest_first(found: &mut [GuideSample]) -> impl Iterator<Item = &GuideSample> {
    found.sort_unstable_by(|a, b| {
        let flash = b.flash.total_cmp(&a.flash).then(b.light.total_cmp(&a.light));
        flash.then(b.hits.total_cmp(&a.hits)).then(a.block.cmp(&b.block))
    });
    found.iter().filter(|path| path.light > 0.0)
}

impl Benefit {
    /// Benefit by the light paths `found`, with kernels of `radius` pixels, for a picture of `pixels` pixels
    /// in which all other light has a `mean` radiance. Sorts `found`.
    pub(super) fn new(found: &mut [GuideSample], radius: f64, pixels: f64, mean: f64) -> Self {
        // Power over the area of a disc, on a diffuse surface of albedo 0.5.
        let benefit = found.iter().map(|path| f64::from(path.benefit)).sum::<f64>();
        let radiance = 0.5 / PI * benefit * radius * radius / pixels;
        let share = if radiance > 0.0 { radiance / (mean + radiance) } else { 0.0 };
        let visible = visible(found);

        let mut blocks = [Block::default(); ALL];
        let disc = PI * radius * radius;
        let of_block = disc * ALL as f64 / pixels;
        let mut hits = 0.0;
        for path in brightest_first(found) {
            // Light of invisible surfaces is spread over all blocks.
            let Some(block) = blocks.get_mut(path.block as usize % ALL) else { continue };
            let light = of_block * f64::from(path.light);
            hits += SAMPLES * disc * f64::from(path.hits);
            block.light += light;
            block.hidden += if path.hits > 0.0 { 0.0 } else { light };
            if hits < LEAST_HITS {
                block.missing += light;
                continue;
            }
            let flash = f64::from(path.flash);
            let square = of_block * f64::from(path.hits) * (flash * flash);
            block.square += square;
            if hits * PILOT_SAMPLES < LEAST_HITS * SAMPLES * pixels {
                block.rare += square;
            }
        }
        let relative = |square: f64, block: &Block| {
            let square = square + SAMPLES * (block.missing * block.missing);
            let light = mean + block.light;
            if square > 0.0 { square / (light * light) } else { 0.0 }
        };
        let over_blocks = |of: &dyn Fn(&Block) -> f64| blocks.iter().map(of).sum::<f64>() / ALL as f64;
        let noise = over_blocks(&|block| relative(block.square, block));
        let rare = over_blocks(&|block| relative(block.rare, block));
        let fraction = |light: f64| if light > 0.0 { light / (mean + radiance) } else { 0.0 };
        let missing = fraction(over_blocks(&|block| block.missing));
        let hidden = fraction(over_blocks(&|block| block.hidden));
        // The light of a pixel is that of the photons in its disc.
        let photons = visible * PATHS_PER_SAMPLE * disc;
        let noise_of_photons = if photons > 0.0 { share * share / photons } else { 0.0 };
        Self { share, visible, noise, noise_of_photons, rare, missing, hidden, mean }
    }

    /// The photon budget, relative to the usual one. The relative variance of photons is that of the few
    /// photons of a disc, and counts by the square of their share: the best number of light paths grows with
    /// the ratio of their light to the other.
    pub(super) fn photon_budget(&self) -> f64 {
        (self.share / (BUDGET_RATIO * (1.0 - self.share))).clamp(1.0, MOST_BUDGET)
    }

    /// True if more light paths may find that photons pay.
    pub(super) fn may_pay(&self) -> bool {
        self.is_needed() || self.share >= PHOTON_DOUBT * PHOTON_SHARE || self.visible >= PHOTONS_VISIBLE
    }

    /// True if photons may pay by their share of the light alone.
    pub(super) fn pays(&self) -> bool {
        self.is_needed() || self.share >= PHOTON_SHARE
    }

    /// True if photons carry light that path tracing finds with no number of samples. A picture without
    /// them would be wrong, not noisy.
    pub(super) fn is_needed(&self) -> bool {
        self.hidden >= HIDDEN_LIGHT
    }

    /// True if photons may pay in a picture whose samples have the relative variance `noise`.
    pub(super) fn pays_beside(&self, noise: f64) -> bool {
        let least = (PHOTON_NOISE * noise).max(PHOTON_GAIN * self.noise_of_photons);
        self.visible >= PHOTONS_VISIBLE && self.noise >= least
    }

    /// Variance and work of path tracing alone, whose `pilot` ran with path reuse or not, for a comparison
    /// with photons.
    pub(super) fn path_tracing(&self, pilot: &Pilot, has_reuse: bool) -> PathTracingCost {
        // Light that is never found is not noise: without photons the picture would lack it.
        let is_missing = self.is_needed() || self.missing >= MISSING_LIGHT;
        let rare = if is_missing { f64::INFINITY } else { self.rare };
        PathTracingCost { scatter: pilot.scatter(has_reuse) + rare, work: pilot.work(has_reuse) }
    }
}

/// Variance and work of a sample of a pixel by path tracing alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathTracingCost {
    /// Variance, relative to the light of a block.
    scatter: f64,
    /// Rays.
    work: f64,
}

impl PathTracingCost {
    /// True if the variance times the work is larger than that of paths with photons, by their `pilot`, whose
    /// light paths take `light_rays` for each sample of a pixel.
    pub(super) fn exceeds(&self, pilot: &Pilot, has_reuse: bool, light_rays: f64) -> bool {
        let work = GATHERING * pilot.work(has_reuse) + light_rays;
        pilot.scatter(has_reuse) * work < self.scatter * self.work
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: f64 = 1024.0;

    fn path(light: f32, hits: f32, flash: f32) -> GuideSample {
        GuideSample { benefit: light, light, hits, flash, ..GuideSample::default() }
    }

    #[test]
    fn the_photon_budget_grows_with_their_share_of_the_light() {
        let budget = |share| {
            Benefit {
                share,
                visible: 1.0,
                noise: 0.0,
                noise_of_photons: 0.0,
                rare: 0.0,
                missing: 0.0,
                hidden: 0.0,
                mean: 1.0,
            }
            .photon_budget()
        };
        // A caustic beside a lamp, as many as ever; a room behind glass; and a lamp in a bulb.
        assert_eq!([0.0, 0.05, 0.28].map(budget), [1.0; 3]);
        assert!((2.0..4.0).contains(&budget(0.5)), "{}", budget(0.5));
        assert_eq!([0.7, 0.96, 1.0].map(budget), [4.0; 3]);
    }

    #[test]
    fn light_is_missing_that_is_found_less_often_than_the_limit() {
        // Discs of area one: each path is hit once in two samples of its pixel.
        let radius = libm::sqrt(1.0 / PI);
        let mut found = [path(1.0, 0.5, 3.0), path(2.0, 0.5, 2.0), path(4.0, 0.5, 1.0), path(0.0, 9.0, 9.0)];
        let lacking =
            |samples, found: &mut [GuideSample]| PIXELS * missing(found, radius, PIXELS, (samples, 4.0));
        for (samples, expected) in [(2.0, 7.0), (3.0, 3.0), (5.0, 1.0), (9.0, 0.0)] {
            let missing = lacking(samples, &mut found);
            assert!((missing - expected).abs() < 1e-9, "{samples}: {missing}");
        }
        // Light that no path finds is always missing.
        assert!((lacking(1e9, &mut [path(1.0, 0.0, f32::INFINITY)]) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_share_is_that_of_a_diffuse_surface_and_does_not_depend_on_the_order() {
        let mut found = [path(3.0, 0.1, 7.0), path(0.0, 0.0, 0.0), path(5.0, 0.0, 7.0), path(5.0, 0.2, 7.0)];
        let one = Benefit::new(&mut found, 1.0, PIXELS, 0.01);
        let radiance = 0.5 / PI * 13.0 / PIXELS;
        assert!((one.share / (radiance / (0.01 + radiance)) - 1.0).abs() < 1e-12);
        assert_eq!(one.visible, 0.75);
        found.reverse();
        let other = Benefit::new(&mut found, 1.0, PIXELS, 0.01);
        assert_eq!([one.noise, one.rare, one.missing], [other.noise, other.rare, other.missing]);
    }

    #[test]
    fn photons_pay_for_much_light_or_for_noise_that_they_reduce() {
        let benefit = |share, noise, noise_of_photons| Benefit {
            share,
            visible: 1.0,
            noise,
            noise_of_photons,
            rare: 0.0,
            missing: 0.0,
            hidden: 0.0,
            mean: 1.0,
        };
        assert!(benefit(0.04, 1.0, 1.0).pays() && !benefit(0.03, 1.0, 0.0).pays());
        assert!(benefit(0.03, 1.0, 0.4).pays_beside(1.9));
        assert!(!benefit(0.03, 1.0, 0.4).pays_beside(2.1));
        assert!(!benefit(0.03, 1.0, 0.6).pays_beside(1.9));
        let may_pay = |share, visible| Benefit { visible, ..benefit(share, 0.0, 0.0) }.may_pay();
        assert!(may_pay(0.01, 0.0) && may_pay(0.0, 0.02) && !may_pay(0.001, 0.01));
    }

    #[test]
    fn photons_are_needed_for_any_light_that_paths_cannot_find() {
        let needed = |hits: f32, mean: f64| {
            let benefit = Benefit::new(&mut [path(3e-3, hits, 7.0)], 1.0, PIXELS, mean);
            assert_eq!(benefit.may_pay() && benefit.pays(), benefit.is_needed() || benefit.share > 0.1);
            benefit.is_needed()
        };
        assert!(needed(0.0, 1e-6) && needed(0.0, 0.1) && needed(0.0, 1.0));
        assert!(!needed(1e-3, 1.0) && !needed(0.0, 1e6));
    }

    #[test]
    fn noise_of_photons_falls_with_their_number() {
        let noise = |hidden: usize| {
            let mut found = std::vec![path(0.0, 0.0, 0.0); hidden];
            found.push(path(3.0, 0.1, 7.0));
            let benefit = Benefit::new(&mut found, 1.0, PIXELS, 0.01);
            benefit.noise_of_photons / (benefit.share * benefit.share)
        };
        assert!((noise(0) - 2.0 / PI).abs() < 1e-9);
        assert!((noise(9) - 20.0 / PI).abs() < 1e-9);
    }
}
