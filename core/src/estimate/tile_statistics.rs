//! Quarters of the pixels of a tile, and the light around each pixel: input of
//! [`BrightnessClasses`](super::BrightnessClasses).

use crate::film::{PIXELS_PER_TILE, Pixel, SPAN, Tile};
use glam::Vec4;

/// Offset of the light of the neighbours in denominators, in units of the picture's mean.
pub(super) const DARK_OFFSET: f32 = 0.01;

/// Ratio to the brightest quarter of a pixel. A neighbour with all quarters brighter lies beyond an edge, and
/// is no evidence for the pixel.
const EDGE_RATIO: f32 = 2.0;

/// Side in pixels of the square around a tile that holds all of its pixels.
pub(super) const SIDE: usize = SPAN as usize;

/// Number of places of this square.
pub(super) const SQUARE_PIXELS: usize = SIDE * SIDE;

/// Square around a tile, row by row, of a picture times a scale. Pixels of other tiles are missing.
pub(super) struct TileStatistics {
    /// Quarters A₁, A₂, B₁, B₂ of each pixel; `None` if one is empty or the pixel is missing.
    pub(super) quarters: [Option<[Vec4; 4]>; SQUARE_PIXELS],
    /// Mean light of those of the eight neighbours that lie in the tile and not beyond an edge; the pixel's
    /// own light if there are none.
    pub(super) around: [Vec4; SQUARE_PIXELS],
}

impl TileStatistics {
    /// Statistics of the `pixels` of `tile`, times `scale`.
    pub(super) fn new(tile: Tile, pixels: &[Pixel], scale: f32) -> Self {
        let mut quarters = [None; SQUARE_PIXELS];
        let [mut picture, mut around] = [[Vec4::ZERO; SQUARE_PIXELS]; 2];
        // Darkest and brightest quarter of each pixel.
        let [mut darkest, mut brightest] = [[0.0f32; SQUARE_PIXELS]; 2];
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE) {
            let (Some([a1, a2]), Some([b1, b2])) = (pixel.even.parts(), pixel.odd.parts()) else { continue };
            let place = tile.index_in_square(i);
            let parts = [a1, a2, b1, b2].map(|mean| scale * mean.extend(0.0));
            quarters[place] = Some(parts);
            let [a1, a2, b1, b2] = parts;
            picture[place] = (0.25 * (a1 + a2 + b1 + b2)).with_w(1.0);
            let [a1, a2, b1, b2] = parts.map(brightness);
            darkest[place] = a1.min(a2).min(b1.min(b2));
            brightest[place] = EDGE_RATIO * (a1.max(a2).max(b1.max(b2)) + 3.0 * DARK_OFFSET);
        }
        let near = |c: usize| c.saturating_sub(1)..(c + 2).min(SIDE);
        for (place, around) in around.iter_mut().enumerate() {
            if quarters[place].is_none() {
                continue;
            }
            let (x, y) = (place % SIDE, place / SIDE);
            let mut others = Vec4::ZERO;
            for other in near(y).flat_map(|row| near(x).map(move |x| row * SIDE + x)) {
                let counts = other != place && darkest[other] <= brightest[place];
                others += if counts { picture[other] } else { Vec4::ZERO };
            }
            *around = if others.w > 0.0 { others / others.w } else { picture[place] }.with_w(0.0);
        }
        Self { quarters, around }
    }
}

/// Sum of the channels.
pub(super) fn brightness(colour: Vec4) -> f32 {
    colour.x + colour.y + colour.z
}
