//! Hierarchy and lights of a scene, which all of its views use.

use super::RenderError;
use super::memory::{Memory, MemoryUse};
use super::threads::Pool;
use crate::pages::Pages;
use halflight_core::Level;
use halflight_core::bvh::Bvh;
use halflight_core::light::LightSampler;
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::scene::Scene;
use self_cell::MutBorrow;
use std::time::Instant;

/// Owner of the memory of one [`Built`].
pub(crate) struct BuiltMemory {
    bvh: MutBorrow<Pages>,
    lights: MutBorrow<Vec<Line>>,
}

impl Default for BuiltMemory {
    fn default() -> Self {
        Self { bvh: MutBorrow::new(Pages::default()), lights: MutBorrow::new(Vec::new()) }
    }
}

/// Structures that do not depend on a camera.
pub(crate) struct Built<'a> {
    pub(super) bvh: Bvh<'a>,
    pub(super) lights: LightSampler<'a>,
    /// Seconds of building.
    seconds: f64,
    /// Bytes of the structures, the scene included.
    uses: Vec<MemoryUse>,
    /// Peak of memory while they were built.
    peak: usize,
}

impl<'a> Built<'a> {
    /// Builds the structures of `scene`, whose camera is of no matter, within `limit` bytes.
    ///
    /// # Errors
    /// Insufficient memory.
    pub(crate) fn new(
        scene: &Scene,
        (level, limit): (Level, Option<usize>),
        pool: &Pool,
        owner: &'a BuiltMemory,
    ) -> Result<Self, RenderError> {
        let start = Instant::now();
        let bank = super::memory::Bank::new();
        let mut memory = Memory::of_scene(scene, limit, &bank);
        // The BVH comes first: its build needs working memory that later structures reuse.
        let mut working = memory.take_pages("bvh build", Bvh::footprint_of(&scene.mesh))?;
        let built = pool.build_bvh(&scene.mesh, level, &mut Arena::over(&mut working))?;
        let pages = owner.bvh.borrow_mut();
        *pages = memory.take_pages("bvh", built.used())?;
        let bvh = built.copied(&mut Arena::over(pages))?;
        drop(working);
        memory.give_back("bvh build");
        let footprint = LightSampler::footprint(scene).and(LightSampler::scratch(scene));
        let lines = owner.lights.borrow_mut();
        *lines = memory.take("lights", footprint)?;
        let lights = LightSampler::build(scene, &mut Arena::over(lines))?;
        let seconds = start.elapsed().as_secs_f64();
        Ok(Self { bvh, lights, seconds, uses: memory.uses(), peak: memory.peak() })
    }

    /// Counts the structures in `memory`, which has the scene already.
    ///
    /// # Errors
    /// Insufficient memory.
    pub(super) fn count_in(&self, memory: &mut Memory) -> Result<(), RenderError> {
        for of_built in self.uses.iter().filter(|of_built| of_built.structure != "scene") {
            memory.set_aside(of_built.structure, Footprint::default().slice::<u8>(of_built.bytes))?;
        }
        memory.raise_peak(self.peak);
        Ok(())
    }

    /// The hierarchy.
    pub(crate) fn bvh(&self) -> &Bvh<'a> {
        &self.bvh
    }

    /// Seconds of building.
    pub(crate) fn seconds(&self) -> f64 {
        self.seconds
    }
}
