//! Filling of pixels without samples in a picture that ended early: each gets the mean of its surroundings.
//! If there is no sample at all, some pixels are path traced first for a short time.

use super::deadline::End;
use super::threads::{Threads, Workers};
use crate::save::Image;
use core::time::Duration;
use halflight_core::bsdf::Features;
use halflight_core::film::Pixel;
use halflight_core::memory::Line;
use halflight_core::method::Executor;
use halflight_core::transport::PathIntegrator;
use std::time::Instant;

/// Time for path tracing if there is no sample.
const SKETCH_TIME: Duration = Duration::from_secs(1);

/// Paths per wave of a thread, each of another pixel.
const WAVE: usize = 64;

/// Column and row of a pixel, and its radiance.
pub(super) type Sketched = ([u32; 2], [f32; 3]);

/// Path tracing of single pixels.
pub(super) type Sketch<'a> = dyn Fn(&Workers) -> Vec<Sketched> + 'a;

/// Path-traced pixels on a grid that is refined until time is over.
pub(super) fn sketch<F: Features>(
    tracer: &PathIntegrator<F>,
    size: [u32; 2],
    workers: &Workers,
) -> Vec<([u32; 2], [f32; 3])> {
    let end = Instant::now() + SKETCH_TIME;
    let count = PathIntegrator::<F>::scratch(WAVE).bytes().div_ceil(size_of::<Line>());
    let mut scratch = vec![vec![Line([0; 64]); count]; workers.count()];
    let mut executor = Threads::new(workers, &mut scratch).until(End::Sketch(end));
    let mut all = Vec::new();
    let mut step = size[0].max(size[1]).next_power_of_two();
    while step > 0 && Instant::now() < end {
        // Points that coarser grids do not have.
        let is_new = |x: u32, y: u32| all.is_empty() || ((x / step) | (y / step)) & 1 == 1;
        let middle = |at: u32, size: u32| (at + step / 2).min(size - 1);
        let rows = (0..size[1]).step_by(step as usize);
        let places = rows.flat_map(|y| (0..size[0]).step_by(step as usize).map(move |x| [x, y]));
        let places = places.filter(|[x, y]| is_new(*x, *y));
        let places: Vec<[u32; 2]> = places.map(|[x, y]| [middle(x, size[0]), middle(y, size[1])]).collect();
        for places in places.chunks(WAVE * workers.count()) {
            let mut found = vec![Pixel::default(); places.len()];
            let pieces = places.chunks(WAVE).zip(found.chunks_mut(WAVE));
            let passed = executor.pass(pieces, |_, (places, out), worker| {
                tracer.sample_pixels(places, 0..1, WAVE, &mut worker.scratch, out)
            });
            if !passed.is_ok_and(|passed| passed.is_complete) {
                return all;
            }
            all.extend(places.iter().zip(&found).map(|(place, pixel)| (*place, pixel.mean().to_array())));
        }
        step /= 2;
    }
    all
}

/// Sets pixels of `image` that are not `known` (row by row) to the mean over the smallest aligned square that
/// has known pixels. Squares have sides of powers of two.
pub(super) fn fill(image: &mut Image, known: &[bool]) {
    let [width, height] = [image.width, image.height].map(|side| side as usize);
    if width.max(height) < 2 {
        return;
    }
    let mut levels = vec![Sums::of(width, height, |i| (image.pixels[i], f32::from(known[i])))];
    while let Some(last) = levels.last().filter(|last| last.means.len() > 1) {
        levels.push(Sums::of(last.width, last.height, |i| last.means[i]));
    }
    for level in (1..levels.len()).rev() {
        let (finer, coarser) = levels.split_at_mut(level);
        if let (Some(finer), Some(coarser)) = (finer.last_mut(), coarser.first()) {
            let width = finer.width;
            for (i, mean) in finer.means.iter_mut().enumerate().filter(|(_, (_, count))| *count == 0.0) {
                *mean = coarser.above(i % width, i / width);
            }
        }
    }
    let Some(finest) = levels.first() else { return };
    for (i, pixel) in image.pixels.iter_mut().enumerate().filter(|(i, _)| !known[*i]) {
        *pixel = finest.above(i % width, i / width).0;
    }
}

/// Means over squares of 2 x 2, each with its number of known values.
struct Sums {
    width: usize,
    height: usize,
    means: Vec<([f32; 3], f32)>,
}

impl Sums {
    /// Means of a raster of `width` x `height` values.
    fn of(width: usize, height: usize, value: impl Fn(usize) -> ([f32; 3], f32)) -> Self {
        let halves = [width, height].map(|side| side.div_ceil(2));
        let mean = |i: usize| {
            let (x, y) = (2 * (i % halves[0]), 2 * (i / halves[0]));
            let inside = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
            let inside = inside.into_iter().filter(|(x, y)| *x < width && *y < height);
            let (mut sum, mut all) = ([0.0; 3], 0.0);
            for (mean, count) in inside.map(|(x, y)| value(y * width + x)).filter(|(_, count)| *count > 0.0) {
                sum.iter_mut().zip(mean).for_each(|(sum, mean)| *sum += count * mean);
                all += count;
            }
            (if all > 0.0 { sum.map(|sum| sum / all) } else { sum }, all)
        };
        Self { width: halves[0], height: halves[1], means: (0..halves[0] * halves[1]).map(mean).collect() }
    }

    /// Mean of the square that holds the value in this column and row.
    fn above(&self, x: usize, y: usize) -> ([f32; 3], f32) {
        self.means.get(y / 2 * self.width + x / 2).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_show_the_nearest_square_that_is_known() {
        let mut image = Image::black(5, 3);
        let mut known = vec![false; 15];
        for (i, value) in [(0, 1.0), (6, 3.0), (14, 8.0)] {
            (image.pixels[i], known[i]) = ([value; 3], true);
        }
        fill(&mut image, &known);
        let shown: Vec<f32> = image.pixels.iter().map(|pixel| pixel[0]).collect();
        assert_eq!(shown, [1., 2., 2., 2., 8., 2., 3., 2., 2., 8., 2., 2., 2., 2., 8.]);
        // A picture without known pixels stays black.
        let mut black = Image::black(3, 2);
        fill(&mut black, &[false; 6]);
        assert_eq!(black, Image::black(3, 2));
    }
}
