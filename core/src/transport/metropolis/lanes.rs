//! Working memory of evaluations: a batch of points, each in a lane.

use super::light_subpath::LightSubpath;
use super::paths::Path;
use crate::geometry::{Hit, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::walk::subpath::Subpath;
use crate::transport::walk::visibility::ShadowRays;

/// Points that are evaluated together.
pub const LANES: usize = 128;

/// Subpaths, rays and shadow rays of all lanes.
pub(super) struct Lanes<'w> {
    pub(super) lights: &'w mut [LightSubpath],
    /// The last ray of each light subpath, and its hit.
    pub(super) end_rays: &'w mut [Ray],
    pub(super) end_hits: &'w mut [Hit],
    pub(super) cameras: &'w mut [Subpath],
    pub(super) paths: &'w mut [Path],
    pub(super) rays: &'w mut [Ray],
    pub(super) hits: &'w mut [Hit],
    pub(super) shadows: ShadowRays<'w>,
}

impl<'w> Lanes<'w> {
    pub(super) fn footprint() -> Footprint {
        Footprint::default()
            .slice::<LightSubpath>(LANES)
            .slice::<Ray>(LANES)
            .slice::<Hit>(LANES)
            .slice::<Subpath>(LANES)
            .slice::<Path>(LANES)
            .slice::<Ray>(LANES)
            .slice::<Hit>(LANES)
            .and(ShadowRays::footprint(LANES))
    }

    pub(super) fn new(arena: &mut Arena<'w>) -> Result<Self, OutOfMemory> {
        Ok(Self {
            lights: arena.slice(LANES)?,
            end_rays: arena.slice(LANES)?,
            end_hits: arena.slice(LANES)?,
            cameras: arena.slice(LANES)?,
            paths: arena.slice(LANES)?,
            rays: arena.slice(LANES)?,
            hits: arena.slice(LANES)?,
            shadows: ShadowRays::new(LANES, arena)?,
        })
    }
}
