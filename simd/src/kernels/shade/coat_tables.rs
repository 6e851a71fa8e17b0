//! Look-ups in the albedo tables of rough coats, over lanes: linear interpolation between the nodes.

use crate::lanes::Lanes;

/// Number of nodes of the tables over sqrt(cos θ), 0 … 1.
pub const COSINES: usize = 16;
/// Number of nodes over sqrt(alpha), 0 … 1.
pub const ROUGHNESSES: usize = 12;
/// Number of nodes over the amplitude r = (η - 1)/(η + 1), 0 … [`LAST_AMPLITUDE`].
pub const AMPLITUDES: usize = 9;
/// Largest r, at η = 9. Coats beyond use its difference.
pub const LAST_AMPLITUDE: f32 = 0.8;
/// Unit of the tables.
pub const STEP: f32 = 1e-4;

/// Differences of rough coats from smooth ones: transmittances of dielectric coats by amplitudes, then the
/// albedos of coats of Schlick with F = 1 and with F = (1 - c)^5.
pub type CoatTables = [[[i16; COSINES]; ROUGHNESSES]; AMPLITUDES + 2];

/// Entries of one table.
const TABLE: f32 = (COSINES * ROUGHNESSES) as f32;

/// `x` clamped to 0 … 1; NaN becomes 0.
#[inline(always)]
pub(super) fn unit<L: Lanes>(x: L) -> L {
    x.max(x.all(0.0)).min(x.all(1.0))
}

#[inline(always)]
pub(super) fn lerp<L: Lanes>(a: L, b: L, t: L) -> L {
    a + (b - a) * t
}

/// Position of `x` in 0 … 1 among `nodes` nodes: the node below, and the fraction of the distance to the
/// next.
#[inline(always)]
pub(super) fn place<L: Lanes>(x: L, nodes: usize) -> [L; 2] {
    let at = unit(x) * x.all((nodes - 1) as f32);
    // Rounded to an integer by the steps of f32 between 2^23 and 2^24.
    let large = x.all(8_388_608.0);
    let rounded = (at + large) - large;
    let floor = (rounded - x.all(1.0)).select(at.lt(rounded), rounded);
    let below = floor.min(x.all((nodes - 2) as f32));
    [below, at - below]
}

/// Position of a cosine and an alpha in the tables.
pub(super) struct TablePlace<L> {
    row: L,
    across: L,
    column: L,
    along: L,
}

impl<L: Lanes> TablePlace<L> {
    #[inline(always)]
    pub(super) fn new(c: L, alpha: L) -> Self {
        let [row, across] = place(alpha.sqrt(), ROUGHNESSES);
        // The differences grow as alpha², and so does the interpolation from the smooth coat on.
        let first = across * across * across * across;
        let across = first.select(row.eq(c.all(0.0)), across);
        let [column, along] = place(c.sqrt(), COSINES);
        Self { row, across, column, along }
    }

    /// Interpolated value of table `which`, in units of [`STEP`].
    #[inline(always)]
    pub(super) fn value(&self, tables: &CoatTables, which: L) -> L {
        let table = tables.as_flattened().as_flattened();
        let (columns, entries) = (which.all(COSINES as f32), which.all(TABLE));
        let first = which * entries + self.row * columns + self.column;
        let [a, b] = first.neighbours(table);
        let [c, d] = (first + columns).neighbours(table);
        lerp(lerp(a, b, self.along), lerp(c, d, self.along), self.across)
    }
}
