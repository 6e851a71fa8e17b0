//! BSDF samples of light subpaths in lanes, a block of vertices at a time.

use crate::Level;
use crate::bsdf::{BsdfSample, COATS, Features};
use crate::geometry::Ray;
use crate::light::EMISSION_DIMENSIONS;
use crate::transport::walk::block::Block;
use crate::transport::walk::block_scatter::Sets;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::points::Set;
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
    /// Sets of the samples, once there are some.
    sampled: Option<Sets>,
}

impl<'a> Lanes<'a> {
    /// Without vertices.
    pub(super) fn new() -> Self {
        Self { block: Block::new(), has: 0, sampled: None }
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
        let Self { block, has, sampled } = self;
        (*has, *sampled) = (0, None);
        block.clear_bsdfs();
        for i in Set(block.points.met) {
            let Some((number, segments)) = rays.get(i).and_then(|ray| of_tag(ray.tag)) else { continue };
            // Paths that may be trapped by total reflection are sampled one by one.
            if segments >= max_depth.min(TRAPPED_FROM) {
                continue;
            }
            (block.samples.place[i], block.samples.index[i]) = (place, number);
            block.samples.dimension[i] = EMISSION_DIMENSIONS + dimensions * (segments - 1);
            block.segments[i] = segments;
            let bsdf = block.points.bsdf::<F>(context.scene, i);
            block.put_bsdf::<F>(i, &bsdf, segments);
            block.others[i] = bsdf;
            *has |= 1 << i;
        }
    }

    /// True if the BSDF of vertex `i` is in the block.
    #[inline]
    pub(super) fn has(&self, i: usize) -> bool {
        self.has >> (i & 15) & 1 == 1
    }

    /// Sample of the BSDF of vertex `i`, and its number for roulette.
    #[inline]
    pub(super) fn sample<F: Features>(&mut self, level: Level, i: usize) -> (Option<BsdfSample>, f32) {
        let Self { block, has, sampled } = self;
        let sets = sampled.get_or_insert_with(|| {
            if block.coats.exists != 0 {
                block.coats.see(level, &block.points.surface, &COATS);
            }
            block.sample_from_lights::<F>(level, (OFFSETS, LOBE), *has)
        });
        (block.sample(sets, i), block.numbers.roulette[i & 15])
    }
}
