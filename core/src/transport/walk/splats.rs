//! Splats of a task: shadow rays to the lens, and the list of those that reach it.

use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Splat, StripOffsets, Tile, sort_by_strip};
use crate::geometry::Ray;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::history::Rest;
use crate::transport::walk::shadow_tag::ShadowTag;
use crate::transport::walk::techniques::LensSample;
use crate::transport::walk::visibility::ShadowRays;
use bytemuck::{Pod, Zeroable};

/// Outcome of a task of light paths beside its vertices and splats.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct TaskOutput {
    /// Vertices stored.
    pub vertices: u32,
    pub(crate) offsets: StripOffsets,
}

impl TaskOutput {
    /// The splats of each strip in the task's list.
    pub fn offsets(&self) -> &StripOffsets {
        &self.offsets
    }
}

/// Splats of a task, until they are sorted by strips of the film.
pub(crate) struct SplatQueue<'w> {
    splats: &'w mut [Splat],
    count: usize,
    shadows: ShadowRays<'w>,
}

impl<'w> SplatQueue<'w> {
    /// Memory of a queue of so many splats, of which so many shadow rays are traced together.
    pub(crate) fn footprint(splats: usize, rays: usize) -> Footprint {
        Footprint::default().slice::<Splat>(splats).and(ShadowRays::footprint(rays))
    }

    /// An empty queue.
    pub(crate) fn new((splats, rays): (usize, usize), arena: &mut Arena<'w>) -> Result<Self, OutOfMemory> {
        Ok(Self { splats: arena.slice(splats)?, count: 0, shadows: ShadowRays::new(rays, arena)? })
    }

    /// Adds a splat of light of a `rest`. Traces the others before if there is no room.
    #[inline]
    pub(crate) fn push<F: Features>(
        &mut self,
        sample: LensSample,
        rest: Rest,
        context: &SceneContext<F>,
        counters: &mut Counters,
    ) {
        if self.shadows.count == self.shadows.rays.len() {
            self.trace(context, counters);
        }
        let ShadowTag(tag) = ShadowTag::of_splat(sample.position, rest);
        self.shadows.push(Ray { tag, ..sample.ray }, sample.light.radiance);
    }

    fn trace<F: Features>(&mut self, context: &SceneContext<F>, counters: &mut Counters) {
        let Self { splats, count, shadows } = self;
        let mut overflow = 0;
        shadows.trace(context, counters, |ray, light| match splats.get_mut(*count) {
            Some(slot) => {
                *slot = Splat { pixel: ray.tag, radiance: light.to_array() };
                *count += 1;
            }
            None => overflow += 1,
        });
        counters.dropped.unfinished += overflow;
    }

    /// Traces the last shadow rays, and sorts the splats by strips of a film of `size` into `sorted`.
    pub(crate) fn finish<F: Features>(
        mut self,
        (context, [width, height]): (&SceneContext<F>, [u32; 2]),
        sorted: &mut [Splat],
        counters: &mut Counters,
    ) -> StripOffsets {
        self.trace(context, counters);
        let pixels = Tile::count(width, height) * PIXELS_PER_TILE;
        sort_by_strip(&self.splats[..self.count], pixels, sorted)
    }
}
