//! Noise and blur of a film: sums over its tiles by passes of an executor, in the order of tiles.

use crate::estimate::{BiasEstimate, BrightnessClasses, ErrorEstimate, ErrorSums};
use crate::estimate::{TileBlur, TileError, TileLight};
use crate::film::{Film, PIXELS_PER_TILE, Pixel, Tile};
use crate::method::{Executor, Worker};
use crate::transport::Counters;

/// Tiles of a pass: many for its threads, few for the stack.
const TILES_PER_PASS: usize = 128;

/// Parts in which the tiles that teach brightness classes are learned from.
const PARTS: usize = 4;

impl Film<'_> {
    /// Mean over pixels and channels; `None` of a black picture.
    pub fn mean_radiance(&self, executor: &mut impl Executor) -> Option<f64> {
        let mut light = TileLight::default();
        let of_tile = |_: Tile, pixels: &[Pixel]| TileLight::of(pixels);
        for_tiles(self, executor, of_tile, |_, tile| light += tile);
        Some(light.mean()).filter(|mean| *mean > 0.0)
    }
}

impl ErrorEstimate {
    /// Noise of `film`, whose mean is `mean`; `None` if no pixel has four samples. `is_correlated`: errors of
    /// distant pixels correlate, because the method shares structures.
    pub fn of_film(
        film: &Film,
        mean: f64,
        is_correlated: bool,
        executor: &mut impl Executor,
    ) -> Option<Self> {
        let count = Tile::count(film.width(), film.height());
        let learned = |part: usize| {
            let mut classes = BrightnessClasses::default();
            let own = (0..count).filter(|tile| BrightnessClasses::uses_tile(*tile, count));
            for number in own.skip(part).step_by(PARTS) {
                let (tile, pixels) = tile(film, number);
                classes.add(tile, pixels, mean);
            }
            classes
        };
        // Sums of integers do not depend on the order of tiles.
        let mut parts: [_; PARTS] = core::array::from_fn(|_| BrightnessClasses::default());
        fill(executor, &mut parts, learned);
        let [mut classes, others @ ..] = parts;
        others.iter().for_each(|part| classes += part);
        let shrinkage = classes.shrinkage();
        let mut sums = ErrorSums::new([film.width(), film.height()], is_correlated);
        let of_tile = |tile: Tile, pixels: &[Pixel]| TileError::of(tile, pixels, mean, &shrinkage);
        for_tiles(film, executor, of_tile, |number, tile| sums.add(number, tile));
        sums.estimate()
    }
}

impl BiasEstimate {
    /// Blur of `film`, whose mean is `mean`, by photons; `None` without photons.
    pub fn of_film(film: &Film, mean: f64, executor: &mut impl Executor) -> Option<Self> {
        let mut blur = TileBlur::default();
        for_tiles(film, executor, |_, pixels| TileBlur::of(pixels, mean), |_, tile| blur += tile);
        Self::of_blur(core::iter::once(blur))
    }
}

/// Tile of this number, and its pixels.
fn tile<'f>(film: &'f Film, number: usize) -> (Tile, &'f [Pixel]) {
    let first = (number * PIXELS_PER_TILE).min(film.pixels().len());
    let end = (first + PIXELS_PER_TILE).min(film.pixels().len());
    (Tile::new(film.width(), film.height(), number), &film.pixels()[first..end])
}

/// Calls `then` with the number and the value of each tile, in their order.
fn for_tiles<T: Copy + Default + Send>(
    film: &Film,
    executor: &mut impl Executor,
    value: impl Fn(Tile, &[Pixel]) -> T + Sync,
    mut then: impl FnMut(usize, T),
) {
    let count = Tile::count(film.width(), film.height());
    let mut values = [T::default(); TILES_PER_PASS];
    for first in (0..count).step_by(TILES_PER_PASS) {
        let values = &mut values[..TILES_PER_PASS.min(count - first)];
        fill(executor, values, |i| {
            let (tile, pixels) = tile(film, first + i);
            value(tile, pixels)
        });
        values.iter().enumerate().for_each(|(i, value)| then(first + i, *value));
    }
}

/// Fills `out` with the values of its numbers by a pass, or by a loop where the executor is over: an estimate
/// of the error is short, and needs all of its parts.
pub(super) fn fill<T: Send>(executor: &mut impl Executor, out: &mut [T], value: impl Fn(usize) -> T + Sync) {
    let task = |_: usize, (number, out): (usize, &mut T), _: &mut Worker| {
        *out = value(number);
        Ok(Counters::default())
    };
    let passed = executor.pass(out.iter_mut().enumerate(), task);
    if !passed.is_ok_and(|passed| passed.is_complete) {
        out.iter_mut().enumerate().for_each(|(number, out)| *out = value(number));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::film::Dropped;
    use crate::memory::{Arena, Line};
    use crate::method::Loop;
    use std::vec;

    #[test]
    fn an_executor_that_is_over_gives_the_same_error() {
        let size = [210, 180];
        let mut lines = vec![Line::ZERO; Film::footprint(size[0], size[1]).bytes() / 64];
        let mut film = Film::new(size[0], size[1], &mut Arena::over(&mut lines)).unwrap();
        for (i, pixel) in film.pixels_mut().iter_mut().enumerate() {
            for sample in 0..8u32 {
                let light = 1.0 + (i as u32 * 31 + sample * 17) as f32 % 5.0;
                pixel.add(sample, Rgb::splat(light), &mut Dropped::default());
                pixel.add_blur(sample, Rgb::splat(0.1 * light));
            }
        }
        for is_correlated in [false, true] {
            let [all, late] = [false, true].map(|is_over| {
                let is_over = || is_over;
                let mut executor = Loop::new(&mut []).until(&is_over);
                let mean = film.mean_radiance(&mut executor).unwrap();
                let noise = ErrorEstimate::of_film(&film, mean, is_correlated, &mut executor).unwrap();
                let blur = BiasEstimate::of_film(&film, mean, &mut executor).unwrap();
                assert!((2.5..3.5).contains(&mean) && noise.relmse > 0.0 && blur.relmse > 0.0);
                (mean, noise, blur)
            });
            assert_eq!(all, late);
        }
    }
}
