//! Images of a film.

use super::Layers;
use super::gaps::{self, Sketch};
use super::threads::Workers;
use crate::save::Image;
use halflight_core::film::{Film, Half, Pixel};
use halflight_core::method::{RenderState, Shard};
use halflight_core::reconstruction::FilmReconstruction;
use rayon::prelude::*;

/// `image` of a film with these `samples` of each pixel, with filled gaps, and the number of pixels in tiles
/// without samples.
pub(super) fn without_gaps(
    mut image: Image,
    samples: &[u32],
    (state, sketch, workers): (&RenderState, &Sketch, &Workers),
) -> (Image, u64) {
    // Other shards fill the gaps of a shard.
    if state.shard != Shard::WHOLE || !state.samples.contains(&0) {
        return (image, 0);
    }
    let mut known: Vec<bool> = samples.iter().map(|&count| count > 0).collect();
    let gaps = known.iter().filter(|known| !**known).count() as u64;
    if known.iter().all(|known| !known) {
        for ([x, y], light) in sketch(workers) {
            let index = y as usize * image.width as usize + x as usize;
            (image.pixels[index], known[index]) = (light, true);
        }
    }
    gaps::fill(&mut image, &known);
    (image, gaps)
}

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
