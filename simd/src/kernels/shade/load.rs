//! Reading of blocks: all sixteen vertices as lanes, or one vertex for its scalar reference.

use super::{Row, Row3};
use crate::lanes::{Lanes, Simd};

/// Vertices that are read from the rows of a block.
pub(super) trait Load: Copy {
    /// One lane for each vertex.
    type Lanes: Lanes;

    /// Numbers of the vertices.
    fn row(self, row: &Row) -> Self::Lanes;

    /// Set of the vertices, by bits.
    fn set(self, bits: u32) -> <Self::Lanes as Lanes>::Mask;

    /// Vectors of the vertices.
    #[inline(always)]
    fn row3(self, [x, y, z]: &Row3) -> [Self::Lanes; 3] {
        [self.row(x), self.row(y), self.row(z)]
    }
}

/// All vertices of a block.
#[derive(Clone, Copy)]
pub(super) struct All<S>(pub(super) S);

impl<S: Simd> Load for All<S> {
    type Lanes = S::F16;

    #[inline(always)]
    fn row(self, row: &Row) -> S::F16 {
        self.0.load16(row)
    }

    #[inline(always)]
    fn set(self, bits: u32) -> <S::F16 as Lanes>::Mask {
        self.0.mask16(bits)
    }
}

/// One vertex, below 16.
#[derive(Clone, Copy)]
pub(super) struct One(pub(super) usize);

impl Load for One {
    type Lanes = f32;

    #[inline(always)]
    fn row(self, row: &Row) -> f32 {
        row[self.0 & 15]
    }

    #[inline(always)]
    fn set(self, bits: u32) -> bool {
        bits >> self.0 & 1 == 1
    }
}
