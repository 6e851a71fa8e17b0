//! What a pixel probably is, from itself and its neighbours: the filter of Lee (1980, "Digital image enhancement and
//! noise filtering by use of local statistics"), over one tile. Where the noise explains all that differs around a
//! pixel its neighbours speak for it; where more differs than noise explains it speaks for itself. Between both the
//! filter goes by roots, so that what is a hundred times as bright next door does not drown a dark pixel.

use super::seen::raster;
use crate::Rgb;
use crate::film::{PIXELS_PER_TILE, Pixel, TILE};
use glam::Vec4;

/// Neighbours on each side: windows of 5 x 5 pixels, cut at the border of the tile.
const REACH: usize = 2;

/// What differs around a pixel is taken for noise up to this many times the estimated variance, which is as uncertain
/// itself: with 1.5 it leaves too much noise.
const NOISE: f32 = 2.0;

const SIDE: usize = TILE as usize;

/// One tile, row by row: colours with a 1 in the fourth place, or all zero where there is no pixel.
type Raster = [Vec4; PIXELS_PER_TILE];

/// What the pixels of a tile of a picture of mean `mean` probably are: filtered, in the order of the tile's pixels.
pub fn filtered(pixels: &[Pixel], mean: f64) -> [Rgb; PIXELS_PER_TILE] {
    let scale = (1.0 / mean) as f32;
    let [mut picture, mut noise, mut out] = [[Vec4::ZERO; PIXELS_PER_TILE]; 3];
    for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE).filter(|(_, pixel)| pixel.count() > 0) {
        picture[raster(i)] = (scale * pixel.mean()).extend(1.0);
        noise[raster(i)] = pixel.scaled_variance(scale).extend(0.0);
    }
    lee(&picture, &noise, &mut out);
    core::array::from_fn(|i| out[raster(i)].truncate() / scale)
}

/// Filters `picture` of variance `variance` into `out`. A pixel's own value has its weight only there.
fn lee(picture: &Raster, variance: &Raster, out: &mut Raster) {
    let [mut sums, mut squares, mut variances] = [[Vec4::ZERO; PIXELS_PER_TILE]; 3];
    for (place, ((sum, square), noise)) in
        sums.iter_mut().zip(squares.iter_mut()).zip(variances.iter_mut()).enumerate()
    {
        let row = place / SIDE * SIDE;
        for other in row + low(place % SIDE)..row + high(place % SIDE) {
            *sum += picture[other];
            *square += picture[other] * picture[other];
            *noise += variance[other];
        }
    }
    for (place, out) in out.iter_mut().enumerate() {
        let (x, y) = (place % SIDE, place / SIDE);
        // The sum without the pixel itself: subtracting it would leave nothing but rounding beside a firefly.
        let (mut others, mut square, mut noise) = (Vec4::ZERO, Vec4::ZERO, Vec4::ZERO);
        for row in low(y)..high(y) {
            let at = row * SIDE + x;
            square += squares[at];
            noise += variances[at];
            if row != y {
                others += sums[at];
            }
        }
        for column in low(x)..high(x) {
            if column != x {
                others += picture[y * SIDE + column];
            }
        }
        let own = picture[place];
        let (count, neighbours) = (others.w + own.w, others.w);
        if own.w == 0.0 || neighbours == 0.0 {
            *out = own;
            continue;
        }
        let mean = (others + own) / count;
        let spread = (square / count - mean * mean).max(Vec4::ZERO);
        let structure = (spread - NOISE * noise / count).max(Vec4::ZERO);
        // Where nothing differs both are the same.
        let weight = structure / spread.max(Vec4::splat(f32::MIN_POSITIVE));
        let (others, own) = (root(others / neighbours), root(own));
        let between = others + weight * (own - others);
        *out = between * between;
    }
}

fn root(v: Vec4) -> Vec4 {
    Vec4::from_array(v.to_array().map(libm::sqrtf))
}

fn low(x: usize) -> usize {
    x.saturating_sub(REACH)
}

fn high(x: usize) -> usize {
    (x + REACH + 1).min(SIDE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filtered(value: impl Fn(usize, usize) -> f32, variance: f32) -> Raster {
        let pixel = |place| value(place % SIDE, place / SIDE);
        let picture = core::array::from_fn(|place| Vec4::new(pixel(place), 0.5, 0.0, 1.0));
        let mut out = [Vec4::ZERO; PIXELS_PER_TILE];
        lee(&picture, &[Vec4::splat(variance); PIXELS_PER_TILE], &mut out);
        out
    }

    #[test]
    fn edges_stay_where_there_is_no_noise() {
        let edge = |x: usize, _| if x < 7 { 0.2 } else { 3.0 };
        for (place, pixel) in filtered(edge, 0.0).iter().enumerate() {
            assert!((pixel.x - edge(place % SIDE, 0)).abs() < 1e-5 && (pixel.y - 0.5).abs() < 1e-6);
        }
    }

    #[test]
    fn noise_gives_way_to_the_neighbours() {
        // A chessboard of 0 and 2 has the variance 1 around a mean of 1.
        let board = |x: usize, y: usize| 2.0 * ((x + y) % 2) as f32;
        for pixel in filtered(board, 1.0) {
            assert!((pixel.x - 1.0).abs() < 0.26, "{pixel}");
        }
    }

    #[test]
    fn a_firefly_does_not_speak_for_itself() {
        let firefly = |x, y| if (x, y) == (8, 5) { 1e6 } else { 0.1 };
        let out = filtered(firefly, 1e12 / 25.0);
        assert!((out[5 * SIDE + 8].x - 0.1).abs() < 1e-6, "{}", out[5 * SIDE + 8]);
    }
}
