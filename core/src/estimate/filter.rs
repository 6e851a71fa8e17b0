//! Filter of Lee (1980, "Digital image enhancement and noise filtering by use of local statistics") over one
//! tile: estimates of pixels from themselves and their neighbours. If noise explains all variation around a
//! pixel, the neighbours replace it; if the variation is larger, the pixel keeps its value. Between both the
//! filter interpolates square roots, so that a neighbour a hundred times as bright does not drown a dark
//! pixel.

use super::tile_statistics::{SIDE, SQUARE_PIXELS};
use crate::Rgb;
use crate::film::{PIXELS_PER_TILE, Pixel, Tile};
use glam::Vec4;

/// Neighbours on each side: windows of 5 x 5 pixels, clipped to the tile.
const RADIUS: usize = 2;

/// Multiple of the estimated variance up to which variation counts as noise, since the variance is as
/// uncertain itself; 1.5 leaves too much noise.
const NOISE_FACTOR: f32 = 2.0;

/// Filtered `pixels` of `tile` in a picture of mean `mean`, in the order of the tile's pixels.
pub fn filtered(tile: Tile, pixels: &[Pixel], mean: f64) -> [Rgb; PIXELS_PER_TILE] {
    let square = Square::new(tile, pixels, mean);
    core::array::from_fn(|i| square.filtered(tile.index_in_square(i)))
}

/// Filtered value of pixel `i` alone.
pub fn filtered_pixel(tile: Tile, pixels: &[Pixel], mean: f64, i: usize) -> Rgb {
    Square::new(tile, pixels, mean).filtered(tile.index_in_square(i))
}

/// Square around a tile, row by row: values of pixels and their variances.
struct Square {
    places: [(Vec4, Vec4); SQUARE_PIXELS],
    scale: f32,
}

impl Square {
    fn new(tile: Tile, pixels: &[Pixel], mean: f64) -> Self {
        let scale = (1.0 / mean) as f32;
        let mut places = [(Vec4::ZERO, Vec4::ZERO); SQUARE_PIXELS];
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE) {
            places[tile.index_in_square(i)] = value_and_variance(pixel, scale);
        }
        Self { places, scale }
    }

    fn filtered(&self, place: usize) -> Rgb {
        lee(|place| self.places[place], place).truncate() / self.scale
    }
}

/// Value of a pixel and its variance: a colour with 1 in the fourth component, or all zero without a pixel.
fn value_and_variance(pixel: &Pixel, scale: f32) -> (Vec4, Vec4) {
    if pixel.count() == 0 {
        return (Vec4::ZERO, Vec4::ZERO);
    }
    ((scale * pixel.mean()).extend(1.0), pixel.scaled_variance(scale).extend(0.0))
}

/// Filters the pixel at `place`; `at` gives the value and variance of each place. The pixel's own value
/// enters by its weight only.
fn lee(at: impl Fn(usize) -> (Vec4, Vec4), place: usize) -> Vec4 {
    let (x, y) = (place % SIDE, place / SIDE);
    let (own, own_noise) = at(place);
    // Summed without the pixel itself: subtraction would leave mere rounding beside a firefly.
    let (mut others, mut square, mut noise) = (Vec4::ZERO, own * own, own_noise);
    for other in (low(y)..high(y)).flat_map(|row| (low(x)..high(x)).map(move |column| row * SIDE + column)) {
        if other != place {
            let (colour, variance) = at(other);
            others += colour;
            square += colour * colour;
            noise += variance;
        }
    }
    let (count, neighbours) = (others.w + own.w, others.w);
    if own.w == 0.0 || neighbours == 0.0 {
        return own;
    }
    let mean = (others + own) / count;
    let spread = (square / count - mean * mean).max(Vec4::ZERO);
    let structure = (spread - NOISE_FACTOR * noise / count).max(Vec4::ZERO);
    // Without variation both are equal.
    let weight = structure / spread.max(Vec4::splat(f32::MIN_POSITIVE));
    let (others, own) = (square_root(others / neighbours), square_root(own));
    let between = others + weight * (own - others);
    between * between
}

fn square_root(v: Vec4) -> Vec4 {
    Vec4::from_array(v.to_array().map(libm::sqrtf))
}

fn low(x: usize) -> usize {
    x.saturating_sub(RADIUS)
}

fn high(x: usize) -> usize {
    (x + RADIUS + 1).min(SIDE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Dropped;

    fn filter(value: impl Fn(usize, usize) -> f32, variance: f32) -> [Vec4; SQUARE_PIXELS] {
        let picture = |place| Vec4::new(value(place % SIDE, place / SIDE), 0.5, 0.0, 1.0);
        core::array::from_fn(|place| lee(|place| (picture(place), Vec4::splat(variance)), place))
    }

    #[test]
    fn edges_stay_where_there_is_no_noise() {
        let edge = |x: usize, _| if x < 7 { 0.2 } else { 3.0 };
        for (place, pixel) in filter(edge, 0.0).iter().enumerate() {
            assert!((pixel.x - edge(place % SIDE, 0)).abs() < 1e-5 && (pixel.y - 0.5).abs() < 1e-6);
        }
    }

    #[test]
    fn noise_gives_way_to_the_neighbours() {
        // A chessboard of 0 and 2 has the variance 1 around a mean of 1.
        let board = |x: usize, y: usize| 2.0 * ((x + y) % 2) as f32;
        for pixel in filter(board, 1.0) {
            assert!((pixel.x - 1.0).abs() < 0.26, "{pixel}");
        }
    }

    #[test]
    fn a_firefly_does_not_speak_for_itself() {
        let firefly = |x, y| if (x, y) == (8, 5) { 1e6 } else { 0.1 };
        let out = filter(firefly, 1e12 / 25.0);
        assert!((out[5 * SIDE + 8].x - 0.1).abs() < 1e-6, "{}", out[5 * SIDE + 8]);
    }

    #[test]
    fn neighbours_are_neighbours_in_the_picture() {
        // Noisy stripes: a pixel that took another's neighbours would become bright or dark.
        let (width, height) = (48, 41);
        for task in 0..Tile::count(width, height) {
            let tile = Tile::new(width, height, task);
            let light = |x: u32| if (x / 6).is_multiple_of(2) { 8.0 } else { 1.0 };
            let pixels: [Pixel; PIXELS_PER_TILE] = core::array::from_fn(|i| {
                let mut pixel = Pixel::default();
                for sample in 0..if tile.pixel(i).is_some() { 8 } else { 0 } {
                    let noise = if sample % 4 < 2 { 0.9 } else { 1.1 };
                    let light = light(tile.pixel(i).unwrap().0) * noise;
                    pixel.add(sample, Rgb::splat(light), &mut Dropped::default());
                }
                pixel
            });
            let all = filtered(tile, &pixels, 2.5);
            for (i, colour) in all.into_iter().enumerate() {
                assert_eq!(filtered_pixel(tile, &pixels, 2.5, i), colour, "{i}");
                let Some((x, _)) = tile.pixel(i) else { continue };
                assert!((colour.x / light(x) - 1.0).abs() < 0.05, "{x}: {colour}");
            }
        }
    }
}
