//! Steps of a reconstruction, in the caller's memory.

use super::error::{ReconstructionError, SQUARE, SquareError, of_pixel, sum_squares, total};
use super::fit::View;
use super::halves::{Halves, STEPS, level};
use super::passes::{for_both, for_pieces};
use super::scale::{Scale, Shape};
use super::strength::{
    self, CELL, CellStrengths, CellSums, KINDS, Step, cells, kind, limited, mixed, strengths,
};
use super::surfaces::PixelSurfaces;
use super::weights::{mean, weights};
use super::{Both, VALUES, alike, despike, guided};
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

/// Steps of large blocks, whose bias is measured against the finest fits in place of single pixels.
const BY_FITS: usize = 2;

/// Fractions of a picture by origin: the scales from the largest, guided means, and single pixels.
pub const FRACTIONS: usize = SHAPES.len() + 2;
const _: () = assert!(FRACTIONS == STEPS);

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
    /// Noise of both halves around each pixel.
    noise: &'m mut [[f32; 2]],
    weights: &'m mut [[f32; 3]],
    wide: Scale<'m>,
    scales: [Scale<'m>; SHAPES.len()],
    sums: &'m mut [CellSums],
    rows: &'m mut [CellSums],
    holed: &'m mut [CellSums],
    strengths: &'m mut [CellStrengths],
    squares: &'m mut [SquareError],
    /// Sums of rows of the fractions by origin.
    fractions: &'m mut [[f64; FRACTIONS]],
}

/// Result of a reconstruction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reconstructed {
    /// Error of the result.
    pub error: ReconstructionError,
    /// Fractions of the picture that come from blocks of 48, 24, 12 and 6 pixels, from guided means, and from
    /// single pixels.
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
            .slice::<[f32; 2]>(pixels)
            .slice::<[f32; 3]>(pixels);
        let sums = Footprint::default()
            .slice::<CellSums>(grid)
            .slice::<CellSums>(grid)
            .slice::<CellSums>(grid)
            .slice::<CellStrengths>(grid.saturating_mul(STEPS))
            .slice::<SquareError>(squares)
            .slice::<[f64; FRACTIONS]>(size[1]);
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
        let (noise, weights) = (arena.slice(pixels)?, arena.slice(pixels)?);
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
            noise,
            weights,
            wide,
            scales,
            sums: arena.slice(grid)?,
            rows: arena.slice(grid)?,
            holed: arena.slice(grid)?,
            strengths: arena.slice(grid.saturating_mul(STEPS))?,
            squares: arena.slice(squares)?,
            fractions: arena.slice(size[1])?,
        })
    }

    /// Reconstructs a picture; `None` where its parts do not have the size of the memory.
    pub fn run(&mut self, halves: &Halves, executor: &mut impl Executor) -> Option<Reconstructed> {
        if !halves.is_whole() || halves.size != self.size {
            return None;
        }
        let level = level(halves);
        for_pieces(executor, self.whole, self.size[0], |y, row| {
            let surfaces = halves.surfaces[y * halves.size[0]..].iter();
            row.iter_mut().zip(surfaces).for_each(|(whole, surfaces)| *whole = surfaces.whole());
        });
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
        Some(Reconstructed { error, fractions: self.fractions(halves, executor) })
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

    /// Fits of all scales, the finest picture, and the noise around it.
    fn fit(&mut self, halves: &Halves, executor: &mut impl Executor) {
        let Self { size: [width, height], whole, even, finest, noise, scales, .. } = self;
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
        let finest = &**finest;
        for_pieces(executor, noise, width, |y, row| {
            row.iter_mut().enumerate().for_each(|(x, out)| *out = guided::noise(&view, finest, [x, y]));
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
        let Self {
            size: [width, height], whole, even, picture, fine, finest, noise, weights, scales, ..
        } = self;
        let (width, height, cell) = (*width, *height, halves.cell());
        let grid = [cells(width, cell), cells(height, cell)];
        let view = View { width, height, values: even, surfaces: halves.surfaces, whole };
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
                    FINEST => finest[i],
                    next if next < FINEST => light(&scales[next..], surfaces, [x, y], &finest[i]),
                    GUIDED => guided::light(&view, finest, noise, [x, y]),
                    SINGLE => even[i],
                    _ => core::array::from_fn(|c| coarse[i][c] + raw[c] - even[i][c]),
                };
                let reference = if step < BY_FITS { &finest[i] } else { raw };
                let weights = match step + 1 {
                    STEPS => weights[i],
                    _ => limited(weights[i], mean(raw, halves.parts)),
                };
                let step = Step { coarse: &coarse[i], fine, reference, weights: &weights };
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

    /// Mean fractions by origin.
    fn fractions(&mut self, halves: &Halves, executor: &mut impl Executor) -> [f64; FRACTIONS] {
        let Self { size: [width, height], strengths, fractions, .. } = self;
        let (width, height, cell) = (*width, *height, halves.cell());
        let (grid, strengths) = ([cells(width, cell), cells(height, cell)], &**strengths);
        for_pieces(executor, fractions, 1, |y, row| {
            let mut sums = [0.0; FRACTIONS];
            for (x, i) in (0..width).zip(y * width..) {
                let kind = kind(halves.groups[i], halves.surfaces[i].is_whole());
                let of_pixel: [f32; FRACTIONS] = strength::origins((strengths, cell), grid, [x, y], kind);
                (0..FRACTIONS).for_each(|origin| sums[origin] += f64::from(of_pixel[origin]));
            }
            row.fill(sums);
        });
        core::array::from_fn(|origin| {
            fractions.iter().map(|row| row[origin]).sum::<f64>() / (width * height) as f64
        })
    }
}

/// Numbers of the steps to the finest fits, guided means and single pixels without fireflies, plus one.
const FINEST: usize = SHAPES.len() - 1;
const GUIDED: usize = FINEST + 1;
const SINGLE: usize = GUIDED + 1;

/// Cells of strengths, and squares of errors.
fn grids([width, height]: [usize; 2]) -> [usize; 2] {
    [
        cells(width, CELL).saturating_mul(cells(height, CELL)),
        width.div_ceil(SQUARE).saturating_mul(height.div_ceil(SQUARE)),
    ]
}

/// Light of a pixel by the first of `scales` that has it, else `finest`.
fn light(scales: &[Scale], surfaces: &PixelSurfaces, at: [usize; 2], finest: &Both) -> Both {
    scales.iter().find_map(|scale| scale.light(surfaces, at)).unwrap_or(*finest)
}
