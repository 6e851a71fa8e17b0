//! The emission guide: a distribution over lights and cells of the square of random numbers that choose a
//! direction. Emission samples it; it knows nothing of emission.

use crate::sampling::{AliasTable, ONE_MINUS_EPSILON};

/// Cells by what they are worth. Those of a light follow each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmissionGuide<'m> {
    table: AliasTable<'m>,
    side: usize,
}

/// Where a photon is to come from and to go.
#[derive(Default)]
pub(super) struct GuideSample {
    pub(super) light: usize,
    pub(super) cell: usize,
    /// Numbers from here.
    pub(super) square: Option<Cell>,
}

/// A cell of the square of random numbers.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    corner: [f32; 2],
    side: f32,
}

impl Cell {
    /// The numbers at a place within.
    pub(super) fn at(&self, within: [f32; 2]) -> [f32; 2] {
        let Self { corner: [x, y], side } = *self;
        [x + within[0], y + within[1]].map(|u| (u / side).min(ONE_MINUS_EPSILON))
    }
}

impl<'m> EmissionGuide<'m> {
    /// A distribution over `side` × `side` cells for each light.
    pub(super) fn new(table: AliasTable<'m>, side: usize) -> Self {
        Self { table, side }
    }

    /// A light and one of its cells, by what they are worth.
    pub(super) fn pick(&self, choice: f32) -> Option<GuideSample> {
        let (cell, _, _) = self.table.sample(choice)?;
        let (light, own) = (cell / self.cells(), cell % self.cells());
        let side = self.side;
        let corner = [(own % side) as f32, (own / side) as f32];
        Some(GuideSample { light, cell, square: Some(Cell { corner, side: side as f32 }) })
    }

    /// The density of `light` times that of the numbers of `place`, which aim its photon.
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
