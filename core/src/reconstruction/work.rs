//! Steps of a reconstruction, in the caller's memory.

use super::error::{ReconstructionError, SQUARE, SquareError, of_pixel, sum_squares, total};
use super::fit::View;
use super::passes::{for_both, for_pieces};
use super::scale::{Scale, Shape};
use super::strength::{
    self, CELL, CellStrengths, CellSums, Judges, KINDS, Step, cells, kind, mixed, strengths,
};
use super::surfaces::PixelSurfaces;
use super::weights::{mean, weights};
use super::{Both, VALUES, alike, despike};
use crate::Rgb;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::Executor;

/// Blocks of the four scales, from the largest: polynomials of the second degree where blocks are large.
const SHAPES: [Shape; 4] = [
    Shape { side: 48, degree: 2, slots: 8 },
    Shape { side: 24, degree: 2, slots: 8 },
    Shape { side: 12, degree: 1, slots: 8 },
    Shape { side: 6, degree: 1, slots: 4 },
];

/// Blocks over which fireflies are spread.
const WIDE: Shape = Shape { side: 24, degree: 0, slots: 8 };

/// Scale of the weights of errors.
const MIDDLE: usize = 2;

/// Steps: to the three finer scales, to single pixels without fireflies, and to single pixels.
const STEPS: usize = SHAPES.len() + 1;

/// Steps of large blocks, whose bias is measured against the finest fits in place of single pixels.
const BY_FITS: usize = 2;

/// Half widths in pixels of the sums for strengths of whole pixels and mixed ones, by step.
const RADII: [[f32; 2]; STEPS] = [[24.0, 43.0], [15.0, 22.0], [11.0, 22.0], [8.0, 16.0], [28.0, 56.0]];

/// Standard errors within which the finer picture wins: weights of errors see little of the bias of coarser
/// ones. None in the last step, where few highlights that were spread have large ones.
const DOUBTS: [f64; STEPS] = [0.5, 0.5, 0.5, 0.5, 0.0];

/// The same where pixels further away judge, which say less of the bias of a place.
const DOUBTS_OF_DISTANT: [f64; STEPS] = [1.0, 1.0, 1.0, 1.0, 0.0];

/// Pixels with errors in common: cells along the longer side of the picture, cells on each side that do not
/// judge, and half widths of the sums in cells. Supports of records are a part of the picture.
const CELLS: usize = 24;
const HOLE: usize = 4;
const REACH: [usize; 2] = [12, 15];

/// Fractions of a picture by origin: the scales from the largest, and single pixels.
pub const FRACTIONS: usize = STEPS;

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
    fn cell(&self) -> usize {
        let [width, height] = self.size;
        if self.is_shared { (width.max(height) / CELLS).max(CELL) } else { CELL }
    }

    /// Pixels that choose the strengths of a step.
    fn judges(&self, step: usize) -> Judges {
        let cell = self.cell();
        let radii = REACH.map(|reach| (reach * cell) as f32);
        match self.is_shared {
            true => Judges { radii, cell, hole: Some(HOLE), doubt: DOUBTS_OF_DISTANT[step] },
            false => Judges { radii: RADII[step], cell, hole: None, doubt: DOUBTS[step] },
        }
    }

    fn is_whole(&self) -> bool {
        let pixels = self.size[0] * self.size[1];
        let lengths = [self.values.len(), self.groups.len(), self.surfaces.len()];
        pixels > 0 && lengths.iter().all(|length| *length == pixels)
    }
}

/// Memory and result of a reconstruction.
pub struct Reconstruction<'m> {
    size: [usize; 2],
    whole: &'m mut [u32],
    /// Light without fireflies.
    even: &'m mut [Both],
    /// The picture so far.
    picture: &'m mut [Both],
    /// The finer picture of a step.
    fine: &'m mut [Both],
    /// The finest fits.
    finest: &'m mut [Both],
    weights: &'m mut [[f32; 3]],
    wide: Scale<'m>,
    scales: [Scale<'m>; SHAPES.len()],
    sums: &'m mut [CellSums],
    rows: &'m mut [CellSums],
    holed: &'m mut [CellSums],
    strengths: &'m mut [CellStrengths],
    squares: &'m mut [SquareError],
}

/// Result of a reconstruction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reconstructed {
    /// Error of the result.
    pub error: ReconstructionError,
    /// Fractions of the picture that come from blocks of 48, 24, 12 and 6 pixels, and from single pixels.
    pub fractions: [f64; FRACTIONS],
}

impl<'m> Reconstruction<'m> {
    /// Bytes that [`Reconstruction::new`] takes for a picture of `size`.
    pub fn footprint(size: [usize; 2]) -> Footprint {
        let pixels = size[0].saturating_mul(size[1]);
        let [grid, squares] = grids(size);
        let planes = Footprint::default()
            .slice::<u32>(pixels)
            .slice::<Both>(pixels)
            .slice::<Both>(pixels)
            .slice::<Both>(pixels)
            .slice::<Both>(pixels)
            .slice::<[f32; 3]>(pixels);
        let sums = Footprint::default()
            .slice::<CellSums>(grid)
            .slice::<CellSums>(grid)
            .slice::<CellSums>(grid)
            .slice::<CellStrengths>(grid.saturating_mul(STEPS))
            .slice::<SquareError>(squares);
        let scales = SHAPES.map(|shape| Scale::footprint(size, shape));
        let scales = scales.into_iter().fold(Scale::footprint(size, WIDE), Footprint::and);
        planes.and(scales).and(sums)
    }

    /// Memory for pictures of `size`.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`Reconstruction::footprint`].
    pub fn new(size: [usize; 2], arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let pixels = size[0].saturating_mul(size[1]);
        let [grid, squares] = grids(size);
        let whole = arena.slice(pixels)?;
        let (even, picture) = (arena.slice(pixels)?, arena.slice(pixels)?);
        let (fine, finest) = (arena.slice(pixels)?, arena.slice(pixels)?);
        let weights = arena.slice(pixels)?;
        let wide = Scale::new(size, WIDE, arena)?;
        let [a, b, c, d] = SHAPES;
        let mut scale = |shape| Scale::new(size, shape, arena);
        let scales = [scale(a)?, scale(b)?, scale(c)?, scale(d)?];
        Ok(Self {
            size,
            whole,
            even,
            picture,
            fine,
            finest,
            weights,
            wide,
            scales,
            sums: arena.slice(grid)?,
            rows: arena.slice(grid)?,
            holed: arena.slice(grid)?,
            strengths: arena.slice(grid.saturating_mul(STEPS))?,
            squares: arena.slice(squares)?,
        })
    }

    /// Reconstructs a picture; `None` where its parts do not have the size of the memory.
    pub fn run(&mut self, halves: &Halves, executor: &mut impl Executor) -> Option<Reconstructed> {
        if !halves.is_whole() || halves.size != self.size {
            return None;
        }
        let level = level(halves);
        for (whole, surfaces) in self.whole.iter_mut().zip(halves.surfaces) {
            *whole = surfaces.whole();
        }
        self.spread_fireflies(halves, executor);
        self.fit(halves, executor);
        self.weigh(halves, level, executor);
        self.begin(halves, executor);
        for step in 0..STEPS {
            self.step(halves, step, executor);
        }
        let [width, height] = self.size;
        let Self { picture, weights, squares, .. } = self;
        // Polynomials of great light overflow, and those near darkness are negative.
        for_pieces(executor, picture, width, |y, row| {
            for (light, raw) in row.iter_mut().flatten().zip(halves.values[y * width..].iter().flatten()) {
                *light = if light.is_finite() { light.max(0.0) } else { *raw };
            }
        });
        let product = halves.parts[0] * halves.parts[1];
        let of_pixel = |i: usize| of_pixel(&picture[i], &halves.values[i], &weights[i], product);
        sum_squares([width, height], squares, of_pixel, executor);
        let error = total([width, height], squares, halves.is_shared);
        Some(Reconstructed { error, fractions: self.fractions(halves) })
    }

    /// Reconstructed light of both halves.
    pub fn halves(&self) -> &[Both] {
        self.picture
    }

    /// The reconstructed picture, row by row from the top.
    pub fn picture(&self, parts: [f32; 2]) -> impl Iterator<Item = Rgb> + '_ {
        self.picture.iter().map(move |value| Rgb::from(mean(value, parts)))
    }

    /// Weights of squared errors of the channels of each pixel.
    pub fn weights(&self) -> &[[f32; 3]] {
        self.weights
    }

    /// Sums of errors over squares of 16 × 16 pixels, row by row.
    pub fn squares(&self) -> &[SquareError] {
        self.squares
    }

    /// Light without fireflies into `even`, by way of `fine`.
    fn spread_fireflies(&mut self, halves: &Halves, executor: &mut impl Executor) {
        let Self { size: [width, height], whole, even, fine, wide, .. } = self;
        let (width, height) = (*width, *height);
        let raw = View { width, height, values: halves.values, surfaces: halves.surfaces, whole };
        for_pieces(executor, fine, width, |y, row| {
            row.iter_mut().enumerate().for_each(|(x, out)| *out = despike::excess(&raw, [x, y]));
        });
        wide.fit(View { values: fine, ..raw }, executor);
        for_pieces(executor, even, width, |y, row| {
            for (x, out) in row.iter_mut().enumerate() {
                let i = y * width + x;
                let excess = &fine[i];
                let spread = match halves.surfaces[i].is_whole() {
                    true => wide.light(&halves.surfaces[i], [x, y]).unwrap_or(*excess),
                    false => [0.0; VALUES],
                };
                *out = core::array::from_fn(|c| halves.values[i][c] - excess[c] + spread[c]);
            }
        });
    }

    /// Fits of all scales, and the finest picture.
    fn fit(&mut self, halves: &Halves, executor: &mut impl Executor) {
        let Self { size: [width, height], whole, even, finest, scales, .. } = self;
        let (width, height) = (*width, *height);
        let view = View { width, height, values: even, surfaces: halves.surfaces, whole };
        scales.iter_mut().for_each(|scale| scale.fit(view, executor));
        let scales = &*scales;
        for_pieces(executor, finest, width, |y, row| {
            for (x, out) in row.iter_mut().enumerate() {
                let surfaces = &view.surfaces[y * width + x];
                let fitted = scales.iter().rev().find_map(|scale| scale.light(surfaces, [x, y]));
                *out = match (fitted, surfaces.is_whole()) {
                    (Some(light), _) => light,
                    (None, true) => view.values[y * width + x],
                    (None, false) => alike::light(&view, [x, y]),
                };
            }
        });
    }

    fn weigh(&mut self, halves: &Halves, level: f32, executor: &mut impl Executor) {
        let Self { size: [width, height], whole, finest, scales, weights: out, .. } = self;
        let (width, height) = (*width, *height);
        let view = View { width, height, values: halves.values, surfaces: halves.surfaces, whole };
        for_pieces(executor, out, width, |y, row| {
            for (x, out) in row.iter_mut().enumerate() {
                let i = y * width + x;
                let fitted = || {
                    let light = light(&scales[MIDDLE..], &view.surfaces[i], [x, y], &finest[i]);
                    mean(&light, halves.parts)
                };
                *out = weights(&view, [x, y], fitted, halves.parts, level);
            }
        });
    }

    /// The picture of the largest blocks.
    fn begin(&mut self, halves: &Halves, executor: &mut impl Executor) {
        let Self { size: [width, _], picture, finest, scales, .. } = self;
        let width = *width;
        for_pieces(executor, picture, width, |y, row| {
            for (x, out) in row.iter_mut().enumerate() {
                let i = y * width + x;
                *out = light(scales, &halves.surfaces[i], [x, y], &finest[i]);
            }
        });
    }

    /// Moves the picture towards the finer one of this step.
    fn step(&mut self, halves: &Halves, step: usize, executor: &mut impl Executor) {
        let Self { size: [width, height], even, picture, fine, finest, weights, scales, .. } = self;
        let cell = halves.cell();
        let (width, grid) = (*width, [cells(*width, cell), cells(*height, cell)]);
        let Self { sums, rows, holed, strengths: all, .. } = self;
        let product = halves.parts[0] * halves.parts[1];
        let coarse = &**picture;
        let of_step = grid[0] * grid[1];
        let sums = &mut sums[..of_step];
        for_both(executor, (fine, width * cell), (sums, grid[0]), |row, fine, sums| {
            sums.fill([[0.0; 3]; KINDS]);
            for (place, fine) in fine.iter_mut().enumerate() {
                let (x, y) = (place % width, row * cell + place / width);
                let i = y * width + x;
                let surfaces = &halves.surfaces[i];
                let raw = &halves.values[i];
                *fine = match step + 1 {
                    next if next < SHAPES.len() => light(&scales[next..], surfaces, [x, y], &finest[i]),
                    SHAPES_END => even[i],
                    _ => core::array::from_fn(|c| coarse[i][c] + raw[c] - even[i][c]),
                };
                let reference = if step < BY_FITS { &finest[i] } else { raw };
                let step = Step { coarse: &coarse[i], fine, reference, weights: &weights[i] };
                let [linear, square] = step.coefficients(product).map(f64::from);
                let sum = &mut sums[x / cell][kind(halves.groups[i], surfaces.is_whole())];
                sum[0] += linear;
                sum[1] += square;
                sum[2] += linear * linear;
            }
        });
        let working = [rows, holed].map(|rows| &mut rows[..of_step]);
        let of_step = &mut all[step * of_step..][..of_step];
        strengths(grid, halves.judges(step), (sums, working), of_step, executor);
        let (fine, of_step) = (&*fine, &*of_step);
        for_pieces(executor, picture, width, |y, row| {
            for (x, out) in row.iter_mut().enumerate() {
                let i = y * width + x;
                let kind = kind(halves.groups[i], halves.surfaces[i].is_whole());
                *out = mixed(out, &fine[i], strength::at((of_step, cell), grid, [x, y], kind));
            }
        });
    }

    /// Mean fractions by origin. The last step moves fireflies alone.
    fn fractions(&self, halves: &Halves) -> [f64; FRACTIONS] {
        let [width, height] = self.size;
        let cell = halves.cell();
        let grid = [cells(width, cell), cells(height, cell)];
        let of_step = grid[0] * grid[1];
        let mut sums = [0.0; FRACTIONS];
        for (i, surfaces) in halves.surfaces.iter().enumerate() {
            let kind = kind(halves.groups[i], surfaces.is_whole());
            let mut rest = 1.0;
            for step in (1..FRACTIONS).rev() {
                let strengths = &self.strengths[(step - 1) * of_step..][..of_step];
                let strength = strength::at((strengths, cell), grid, [i % width, i / width], kind);
                sums[step] += f64::from(rest * (1.0 - strength));
                rest *= strength;
            }
            sums[0] += f64::from(rest);
        }
        sums.map(|sum| sum / (width * height) as f64)
    }
}

/// Number of the step to single pixels without fireflies, plus one.
const SHAPES_END: usize = SHAPES.len();

/// Cells of strengths, and squares of errors.
fn grids([width, height]: [usize; 2]) -> [usize; 2] {
    [
        cells(width, CELL).saturating_mul(cells(height, CELL)),
        width.div_ceil(SQUARE).saturating_mul(height.div_ceil(SQUARE)),
    ]
}

/// Mean of a picture over pixels and channels.
fn level(halves: &Halves) -> f32 {
    let of_pixel = |value: &Both| f64::from(mean(value, halves.parts).iter().sum::<f32>());
    let sum: f64 = halves.values.iter().map(of_pixel).sum();
    (sum / (3 * halves.values.len()) as f64) as f32
}

/// Light of a pixel by the first of `scales` that has it, else `finest`.
fn light(scales: &[Scale], surfaces: &PixelSurfaces, at: [usize; 2], finest: &Both) -> Both {
    scales.iter().find_map(|scale| scale.light(surfaces, at)).unwrap_or(*finest)
}
