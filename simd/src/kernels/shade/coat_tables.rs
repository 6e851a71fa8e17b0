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
pub type CoatTables = [i16; (AMPLITUDES + 2) * ROUGHNESSES * COSINES];

/// Entries of one table.
const TABLE: f32 = (COSINES * ROUGHNESSES) as f32;

/// `x` clamped to 0 … 1; NaN becomes 0.
#[inline(always)]
pub fn unit<L: Lanes>(x: L) -> L {
    x.max(x.all(0.0)).min(x.all(1.0))
}

/// a + (b - a) t.
#[inline(always)]
pub fn lerp<L: Lanes>(a: L, b: L, t: L) -> L {
    a + (b - a) * t
}

/// Position of `x` in 0 … 1 among `nodes` nodes: the node below, and the fraction of the distance to the
/// next.
#[inline(always)]
fn place<L: Lanes>(x: L, nodes: usize) -> [L; 2] {
    let at = unit(x) * x.all((nodes - 1) as f32);
    // Rounded to an integer by the steps of f32 between 2^23 and 2^24.
    let large = x.all(8_388_608.0);
    let rounded = (at + large) - large;
    let floor = (rounded - x.all(1.0)).select(at.lt(rounded), rounded);
    let below = floor.min(x.all((nodes - 2) as f32));
    [below, at - below]
}

/// Position of `alpha` among the roughnesses. The differences grow as alpha², the fourth power of the axis,
/// and so does the interpolation between the smooth coat and the first node.
#[inline(always)]
pub fn roughness<L: Lanes>(alpha: L) -> [L; 2] {
    let [row, t] = place(alpha.sqrt(), ROUGHNESSES);
    [row, (t * t * t * t).select(row.eq(alpha.all(0.0)), t)]
}

/// Position of the amplitude of an index of refraction among the tables.
#[inline(always)]
pub fn amplitude<L: Lanes>(eta: L) -> [L; 2] {
    let one = eta.all(1.0);
    place((eta - one) / (eta + one) / eta.all(LAST_AMPLITUDE), AMPLITUDES)
}

/// Interpolated value between entries `i` and `i + 1` of `table`, in units of [`STEP`].
#[inline(always)]
pub fn along<L: Lanes>(table: &[i16], i: L, t: L) -> L {
    let [a, b] = i.neighbours(table);
    lerp(a, b, t)
}

/// Position of a cosine and an alpha in the tables.
pub(super) struct TablePlace<L> {
    cell: L,
    across: L,
    along: L,
}

impl<L: Lanes> TablePlace<L> {
    #[inline(always)]
    pub(super) fn new(c: L, alpha: L) -> Self {
        let [row, across] = roughness(alpha);
        let [column, along] = place(c.sqrt(), COSINES);
        Self { cell: row * row.all(COSINES as f32) + column, across, along }
    }

    /// Interpolated value of table `which`, in units of [`STEP`].
    #[inline(always)]
    pub(super) fn value(&self, tables: &CoatTables, which: L) -> L {
        let first = which * which.all(TABLE) + self.cell;
        let [[a, b], [c, d]] = first.cell(tables, COSINES);
        lerp(lerp(a, b, self.along), lerp(c, d, self.along), self.across)
    }
}
