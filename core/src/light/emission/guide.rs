//! Emission guide: a distribution over lights and over cells of the unit square whose random numbers choose
//! the direction of emission.

use crate::sampling::{AliasTable, ONE_MINUS_EPSILON};

/// Distribution over cells by their benefit. The cells of a light are contiguous.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmissionGuide<'m> {
    table: AliasTable<'m>,
    side: usize,
}

/// Light and cell that the guide chose for a photon.
#[derive(Default)]
pub(super) struct GuideSample {
    pub(super) light: usize,
    pub(super) cell: usize,
    /// Cell from which to draw the random numbers; `None` without a guide.
    pub(super) square: Option<Cell>,
}

/// Cell of the unit square of random numbers.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    corner: [f32; 2],
    side: f32,
}

impl Cell {
    /// Random numbers at the point `within` of the cell's own unit square.
    pub(super) fn at(&self, within: [f32; 2]) -> [f32; 2] {
        let Self { corner: [x, y], side } = *self;
        [x + within[0], y + within[1]].map(|u| (u / side).min(ONE_MINUS_EPSILON))
    }
}

impl<'m> EmissionGuide<'m> {
    /// Distribution over `side` × `side` cells for each light.
    pub(super) fn new(table: AliasTable<'m>, side: usize) -> Self {
        Self { table, side }
    }

    /// Samples a light and one of its cells.
    pub(super) fn sample(&self, choice: f32) -> Option<GuideSample> {
        let (cell, _, _) = self.table.sample(choice)?;
        let (light, own) = (cell / self.cells(), cell % self.cells());
        let side = self.side;
        let corner = [(own % side) as f32, (own / side) as f32];
        Some(GuideSample { light, cell, square: Some(Cell { corner, side: side as f32 }) })
    }

    /// Probability of `light` times the density of the random numbers `place` that direct its photon.
    pub(super) fn density(&self, light: usize, place: [f32; 2]) -> f32 {
        let cells = self.cells();
        self.table.pdf(light * cells + cell(self.side, place)) * cells as f32
    }

    fn cells(&self) -> usize {
        self.side * self.side
    }
}

fn cell(side: usize, place: [f32; 2]) -> usize {
    let [x, y] = place.map(|u| ((u * side as f32) as usize).min(side - 1));
    y * side + x
}
