//! BSDF samples of light subpaths in lanes, a block of vertices at a time.

use crate::Level;
use crate::bsdf::{BsdfSample, Features};
use crate::geometry::Ray;
use crate::light::EMISSION_DIMENSIONS;
use crate::transport::walk::block::Block;
use crate::transport::walk::block_scatter::Sets;
use crate::transport::walk::block_stages::Cleared;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::termination::TRAPPED_FROM;
use halflight_simd::kernels::shade::numbers::Offsets;

/// Dimensions of the sampler at a vertex: scattered direction, lobe, Russian roulette.
pub(super) const SCATTERING: u32 = 0;
pub(super) const LOBE: u32 = 1;
pub(super) const ROULETTE: u32 = 2;

/// Offsets for the numbers of blocks of vertices; lights are not sampled.
const OFFSETS: Offsets = Offsets { light: SCATTERING, choice: LOBE, scatter: SCATTERING, roulette: ROULETTE };

/// Block of vertices of light subpaths. Their BSDFs are sampled together when the first of them scatters;
/// where all paths of the block end, none is.
pub(super) struct Lanes<'a> {
    pub(super) block: Block<'a>,
    /// Set of vertices whose BSDFs are in the block.
    has: u32,
    /// The stage of the block until it is sampled, and then the sets of the samples.
    stage: Option<Cleared>,
    sampled: Sets,
}

impl<'a> Lanes<'a> {
    /// Without vertices.
    pub(super) fn new() -> Self {
        Self { block: Block::new(), has: 0, stage: None, sampled: Sets::default() }
    }

    /// Collects BSDFs at the points of the block and what their random numbers depend on, for `rays` whose
    /// tags give the number and the segments of a path. All paths have numbers of `place`.
    #[inline]
    pub(super) fn gather<F: Features>(
        &mut self,
        context: &SceneContext<'a, F>,
        (rays, of_tag): (&[Ray], impl Fn(u32) -> Option<(u32, u32)>),
        (place, dimensions, max_depth): (u64, u32, u32),
    ) {
        let (stage, has) = self.block.fill::<F>(context.scene, |block, i| {
            let (number, segments) = rays.get(i).and_then(|ray| of_tag(ray.tag))?;
            (block.samples.place[i], block.samples.index[i]) = (place, number);
            block.samples.dimension[i] = EMISSION_DIMENSIONS + dimensions * (segments - 1);
            // Paths that may be trapped by total reflection are sampled one by one.
            (segments < max_depth.min(TRAPPED_FROM)).then_some(segments)
        });
        (self.has, self.stage) = (has, Some(stage));
    }

    /// True if the BSDF of vertex `i` is in the block.
    #[inline]
    pub(super) fn has(&self, i: usize) -> bool {
        self.has >> (i & 15) & 1 == 1
    }

    /// Sample of the BSDF of vertex `i`, and its number for roulette.
    #[inline]
    pub(super) fn sample<F: Features>(&mut self, level: Level, i: usize) -> (Option<BsdfSample>, f32) {
        let Self { block, has, stage, sampled } = self;
        if let Some(stage) = stage.take() {
            let stage = block.see(level, stage);
            *sampled = block.sample_from_lights::<F>(level, stage, (OFFSETS, LOBE), *has);
        }
        (block.sample(sampled, i), block.numbers.roulette[i & 15])
    }
}
