//! Images of a film.

use super::Layers;
use super::gaps::{self, Sketch};
use super::threads::Workers;
use super::window::{image_in_window, values_in_window};
use crate::save::Image;
use halflight_core::film::{Film, Half, Pixel};
use halflight_core::method::{RenderState, Shard};
use halflight_core::reconstruction::FilmReconstruction;
use rayon::prelude::*;

/// Pictures of a film at the end of a render.
pub(super) struct Pictures {
    pub(super) image: Image,
    pub(super) variance: Image,
    /// Samples of each pixel, row by row.
    pub(super) samples: Vec<u32>,
    /// Layers of samples.
    pub(super) layers: Layers,
}

impl Pictures {
    /// Pictures of `film` and its reconstruction, and its halves if `with_halves`.
    pub(super) fn of(film: &Film, made: Option<&FilmReconstruction>, with_halves: bool) -> Self {
        let half = |of: fn(&Pixel) -> &Half| {
            of_size(film, by_rows(film, |pixel| of(&pixel).mean().to_array()).collect())
        };
        let halves = with_halves.then(|| [half(|pixel| &pixel.even), half(|pixel| &pixel.odd)]);
        Self {
            image: image(film, made),
            variance: variance(film, made),
            samples: by_rows(film, |pixel| pixel.count()).collect(),
            layers: Layers { halves, ..Layers::default() },
        }
    }

    /// The same with filled gaps in its picture, and the number of pixels in tiles without samples.
    pub(super) fn without_gaps(
        mut self,
        (state, sketch, workers): (&RenderState, &Sketch, &Workers),
    ) -> (Self, u64) {
        let Shard { count, window, .. } = state.shard;
        let is_sampled = (0..).zip(&*state.samples).all(|(tile, &n)| n > 0 || !state.shard.owns(tile));
        // Other shards fill the gaps of a shard.
        if count > 1 || is_sampled {
            return (self, 0);
        }
        let image = &mut self.image;
        let mut known: Vec<bool> = self.samples.iter().map(|&count| count > 0).collect();
        let width = image.width;
        let is_shown = |index: u32| window.is_none_or(|w| w.contains([index % width, index / width]));
        let gaps = (0..).zip(&known).filter(|(index, known)| !**known && is_shown(*index)).count() as u64;
        if known.iter().all(|known| !known) {
            for ([x, y], light) in sketch(workers) {
                let index = y as usize * width as usize + x as usize;
                (image.pixels[index], known[index]) = (light, true);
            }
        }
        gaps::fill(image, &known);
        (self, gaps)
    }

    /// Their parts in the window of the render; all without a window.
    pub(super) fn in_window(self, shard: Shard) -> Self {
        let Self { image, variance, samples, layers } = self;
        let halves = layers.halves.map(|halves| halves.map(|half| image_in_window(half, shard)));
        Self {
            samples: values_in_window(samples, image.width, shard),
            image: image_in_window(image, shard),
            variance: image_in_window(variance, shard),
            layers: Layers { halves, ..layers },
        }
    }
}

/// Picture of a film, or its reconstruction if there is one.
pub(super) fn image(film: &Film, made: Option<&FilmReconstruction>) -> Image {
    let reconstructed = made.and_then(FilmReconstruction::picture);
    let pixels = match reconstructed {
        Some(pixels) => pixels.map(|light| light.to_array()).collect(),
        None => by_rows(film, |pixel| pixel.mean().to_array()).collect(),
    };
    of_size(film, pixels)
}

/// Variance of each pixel of that picture.
pub(super) fn variance(film: &Film, made: Option<&FilmReconstruction>) -> Image {
    let reconstructed = made.and_then(FilmReconstruction::variance);
    let pixels = match reconstructed {
        Some(pixels) => pixels.map(|variance| variance.to_array()).collect(),
        None => by_rows(film, |pixel| pixel.variance().to_array()).collect(),
    };
    of_size(film, pixels)
}

fn of_size(film: &Film, pixels: Vec<[f32; 3]>) -> Image {
    Image { width: film.width(), height: film.height(), pixels }
}

/// `value` of all pixels, row by row.
pub(super) fn by_rows<'f, T: Send + 'f>(
    film: &'f Film,
    value: impl Fn(Pixel) -> T + Sync + Send + 'f,
) -> impl IndexedParallelIterator<Item = T> + 'f {
    let width = film.width() as usize;
    let pixels = (0..width * film.height() as usize).into_par_iter();
    pixels.map(move |i| value(film.pixel((i % width) as u32, (i / width) as u32)))
}
