//! The halves of a picture, and the pixels that judge the steps of its reconstruction.

use super::Both;
use super::strength::{CELL, Judges};
use super::surfaces::PixelSurfaces;
use super::weights::mean;

/// Steps: to the three finer scales, to guided means, to single pixels without fireflies, and to all of their
/// light.
pub(super) const STEPS: usize = 6;

/// Half widths in pixels of the sums for strengths of whole pixels and mixed ones, by step.
const RADII: [[f32; 2]; STEPS] =
    [[24.0, 43.0], [15.0, 22.0], [11.0, 22.0], [48.0, 72.0], [8.0, 16.0], [28.0, 56.0]];

/// Standard errors within which the finer picture wins: weights of errors see little of the bias of coarser
/// ones. Guided means follow noise that pixels nearby share, so that they win only by a standard error.
/// None in the last step, where few highlights that were spread have large ones.
const DOUBTS: [f64; STEPS] = [0.6, 0.6, 0.6, -1.0, 0.5, 0.0];

/// The same where pixels further away judge, which say less of the bias of a place.
const DOUBTS_OF_DISTANT: [f64; STEPS] = [1.0, 1.0, 1.0, 1.0, 1.0, 0.0];

/// Pixels with errors in common: cells along the longer side of the picture, cells on each side that do not
/// judge, and half widths of the sums in cells. Supports of records are a part of the picture.
const CELLS: usize = 24;
const HOLE: usize = 4;
const REACH: [usize; 2] = [12, 15];

/// The halves of a picture, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct Halves<'p> {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// Means of the halves of each pixel; the mean over pixels is about one.
    pub values: &'p [Both],
    /// Fractions of the samples that the halves have.
    pub parts: [f32; 2],
    /// Group of each pixel, 0 or 1: groups share no noise, unless `is_shared`.
    pub groups: &'p [u8],
    /// Surfaces that each pixel sees.
    pub surfaces: &'p [PixelSurfaces],
    /// True if pixels nearby have errors in common: then those further away of the same group choose the
    /// strengths.
    pub is_shared: bool,
}

impl Halves<'_> {
    /// Side in pixels of the cells of strengths.
    pub(super) fn cell(&self) -> usize {
        let [width, height] = self.size;
        if self.is_shared { (width.max(height) / CELLS).max(CELL) } else { CELL }
    }

    /// Pixels that choose the strengths of a step.
    pub(super) fn judges(&self, step: usize) -> Judges {
        let cell = self.cell();
        let radii = REACH.map(|reach| (reach * cell) as f32);
        match self.is_shared {
            true => Judges { radii, cell, hole: Some(HOLE), doubt: DOUBTS_OF_DISTANT[step] },
            false => Judges { radii: RADII[step], cell, hole: None, doubt: DOUBTS[step] },
        }
    }

    pub(super) fn is_whole(&self) -> bool {
        let pixels = self.size[0] * self.size[1];
        let lengths = [self.values.len(), self.groups.len(), self.surfaces.len()];
        pixels > 0 && lengths.iter().all(|length| *length == pixels)
    }
}

/// Mean of a picture over pixels and channels.
pub(super) fn level(halves: &Halves) -> f32 {
    let of_pixel = |value: &Both| f64::from(mean(value, halves.parts).iter().sum::<f32>());
    let sum: f64 = halves.values.iter().map(of_pixel).sum();
    (sum / (3 * halves.values.len()) as f64) as f32
}
