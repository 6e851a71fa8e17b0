//! Query points, one or sixteen at a time. The evaluation of a record is generic over both, so that the
//! scalar form is the reference of the lanes and gives equal bits.

use glam::Vec3;
use halflight_simd::{Lanes, Simd};

/// Positions and unit surface normals of points, by coordinate.
#[derive(Clone, Copy)]
pub(super) struct Query<L> {
    pub(super) position: [L; 3],
    pub(super) normal: [L; 3],
    /// Maximum distance along the surface of valid records.
    pub(super) within: L,
}

/// Point of a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueryPoint {
    /// Position of the point.
    pub position: Vec3,
    /// Unit surface normal.
    pub normal: Vec3,
    /// Maximum distance along the surface of valid records, due to an overhang:
    /// [`super::OVERHANG_DISTANCE_FACTOR`] times its height. Infinite if the height is unknown.
    pub within: f32,
}

impl QueryPoint {
    /// Point below an overhang of unknown height.
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

/// Evaluation of a record at points in its support.
#[derive(Clone, Copy)]
pub(super) struct RecordWeight<L> {
    /// Positions along the axes of the record.
    pub(super) place: [L; 2],
    /// Cross product of its normal and theirs, along its axes.
    pub(super) turned: [L; 2],
    /// Weight w_i.
    pub(super) weight: L,
}

/// Number of points, and constructors of their lanes.
pub(super) trait Width: Copy {
    type L: Lanes;
    /// All lanes set to `value`.
    fn all(self, value: f32) -> Self::L;
    /// Bytes of `table` at the whole parts of `which`, as numbers.
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
