//! Cache of the radiance that narrow lobes reflect to the camera.

use crate::Rgb;
use crate::cache::irradiance::{IrradianceCache, QueryPoint, Record};
use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Difference of alpha within which lobes are alike, relative to alpha.
const ALIKE: f32 = 0.1;

/// Largest angle between the normals of a point and of a valid record, over alpha.
const TILT: f32 = 0.25;

/// Material and alpha of a lobe; records serve lobes of their own kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LobeKind {
    /// Number of the material.
    pub material: u32,
    /// GGX alpha.
    pub alpha: f32,
}

impl LobeKind {
    fn is_like(&self, other: &Self) -> bool {
        self.material == other.material && (self.alpha - other.alpha).abs() <= ALIKE * self.alpha
    }

    /// True if unit vectors differ by so little that lobes of this alpha do not see it.
    pub fn is_aligned(&self, one: Vec3, other: Vec3) -> bool {
        one.distance_squared(other) <= TILT * TILT * self.alpha * self.alpha
    }
}

/// Records of reflected radiance over the reflectance of the mirror direction, in place of irradiance, and
/// the kinds of their lobes.
#[derive(Debug)]
pub struct ViewRecords<'m> {
    cache: IrradianceCache<'m>,
    kinds: &'m mut [LobeKind],
}

impl<'m> ViewRecords<'m> {
    /// Footprint of `capacity` records.
    pub fn footprint(capacity: usize) -> Footprint {
        IrradianceCache::footprint(capacity).slice::<LobeKind>(capacity)
    }

    /// Memory for `capacity` records of a scene within `bounds`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`ViewRecords::footprint`].
    pub fn new(bounds: &Bounds, capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        Ok(Self { cache: IrradianceCache::new(bounds, capacity, arena)?, kinds: arena.slice(capacity)? })
    }

    /// Records in order of insertion.
    pub fn records(&self) -> &[Record] {
        self.cache.records()
    }

    /// True if there is no memory for another record.
    pub fn is_full(&self) -> bool {
        self.cache.is_full()
    }

    fn serves(&self, number: u32, record: &Record, point: &QueryPoint, kind: &LobeKind) -> bool {
        is_alike(self.kinds, (number, record), point.normal, kind)
    }

    /// True if a record of the same kind covers the point.
    pub fn covers(&self, point: &QueryPoint, kind: &LobeKind) -> bool {
        self.cache.covers_by(point, |number, record| self.serves(number, record, point, kind))
    }

    /// Interpolated radiance at `point`; `None` without a valid record of the same kind.
    pub fn at(&self, point: &QueryPoint, kind: &LobeKind) -> Option<Rgb> {
        let (mut sum, mut weights) = (Rgb::ZERO, 0.0);
        self.cache.visit_extrapolated(point, |number, record, (radiance, weight)| {
            if self.serves(number, record, point, kind) {
                sum += weight * radiance;
                weights += weight;
            }
        });
        (weights > 0.0).then(|| sum / weights)
    }

    /// Inserts a record, compared with its neighbours of the same kind and clamped by them. Returns whether
    /// there was memory.
    pub fn insert(&mut self, record: Record, kind: LobeKind) -> bool {
        let number = self.cache.records().len();
        let (kinds, normal) = (&*self.kinds, Vec3::from(record.normal));
        let is_neighbour = |number, other: &Record| is_alike(kinds, (number, other), normal, &kind);
        let is_inserted = self.cache.insert_among(record, None, is_neighbour);
        if let Some(slot) = self.kinds.get_mut(number).filter(|_| is_inserted) {
            *slot = kind;
        }
        is_inserted
    }

    /// Links all records anew by their present supports.
    pub fn rebuild(&mut self) {
        self.cache.rebuild();
    }
}

/// True if record `number` has light of lobes of `kind` on surfaces of this `normal`.
fn is_alike(kinds: &[LobeKind], (number, record): (u32, &Record), normal: Vec3, kind: &LobeKind) -> bool {
    kind.is_aligned(normal, record.normal.into())
        && kinds.get(number as usize).is_some_and(|of_record| kind.is_like(of_record))
}
