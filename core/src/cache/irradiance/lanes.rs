//! Query points, one or sixteen at a time. The evaluation of a record is written once for both, so the scalar
//! form is the reference of the lanes, and the bits are equal.

use glam::Vec3;
use halflight_simd::{Lanes, Simd};

/// Points, and the unit normals of their surfaces, coordinate by coordinate.
#[derive(Clone, Copy)]
pub(super) struct Query<L> {
    pub(super) position: [L; 3],
    pub(super) normal: [L; 3],
    /// Records that are farther along the surface are not heard.
    pub(super) within: L,
}

/// A point that asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueryPoint {
    /// Where it is.
    pub position: Vec3,
    /// Unit normal of its surface.
    pub normal: Vec3,
    /// Records that are farther than this along the surface are not heard, for something hangs close over it:
    /// [`super::CLOSE`] times as far as that is high. Infinite where nobody has looked up from there.
    pub within: f32,
}

impl QueryPoint {
    /// Of which nobody knows what hangs over it.
    pub fn open(position: Vec3, normal: Vec3) -> Self {
        Self { position, normal, within: f32::INFINITY }
    }
}

impl Query<f32> {
    #[inline(always)]
    pub(super) fn of(point: &QueryPoint) -> Self {
        let QueryPoint { position, normal, within } = *point;
        Self { position: position.to_array(), normal: normal.to_array(), within }
    }
}

/// What a record needs to know of points that are in its support.
#[derive(Clone, Copy)]
pub(super) struct RecordWeight<L> {
    /// Where they lie along its axes.
    pub(super) place: [L; 2],
    /// Its normal times theirs, along its axes.
    pub(super) turned: [L; 2],
    /// w_i.
    pub(super) weight: L,
}

/// How many points there are, and what makes lanes for them.
pub(super) trait Width: Copy {
    type L: Lanes;
    /// All lanes the same.
    fn all(self, value: f32) -> Self::L;
    /// Of `table` the bytes that whole parts name, as numbers.
    fn pick(self, table: &[u8; 16], which: Self::L) -> Self::L;
}

/// One point.
#[derive(Clone, Copy)]
pub(super) struct One;

impl Width for One {
    type L = f32;

    #[inline(always)]
    fn all(self, value: f32) -> f32 {
        value
    }

    #[inline(always)]
    fn pick(self, table: &[u8; 16], which: f32) -> f32 {
        f32::from(table[which as usize & 15])
    }
}

/// Sixteen points.
#[derive(Clone, Copy)]
pub(super) struct Sixteen<S>(pub(super) S);

impl<S: Simd> Width for Sixteen<S> {
    type L = S::F16;

    #[inline(always)]
    fn all(self, value: f32) -> S::F16 {
        self.0.splat16(value)
    }

    #[inline(always)]
    fn pick(self, table: &[u8; 16], which: S::F16) -> S::F16 {
        self.0.pick16(self.0.bytes16(table), which)
    }
}
