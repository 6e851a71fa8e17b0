//! Vertices of paths and subpaths in lanes: light samples and BSDF samples of a block, by the numbers of
//! points, before its vertices are visited one by one.

use super::numbers::VertexNumbers;
use crate::bsdf::{Bsdf, BsdfSample, COATS, Features};
use crate::geometry::{Hit, Ray};
use crate::scene::Scene;
use crate::transport::bidirectional::shaded::{Lit, Shaded};
use crate::transport::walk::block::Block;
use crate::transport::walk::block_scatter::Sets;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::points::{Met, Set};
use crate::transport::walk::termination::TRAPPED_FROM;
use halflight_simd::kernels::shade::{BLOCK, Row};

/// Block of vertices, with their light samples and BSDF samples.
pub(super) struct Shading<'a> {
    block: Block<'a>,
    sets: Sets,
    /// Set of vertices in lanes.
    has: u32,
}

/// Hit of a block, with its samples if it was shaded in lanes.
#[derive(Clone, Copy)]
pub(super) struct ShadedHit<'s> {
    pub(super) met: Met<'s, 's>,
    shaded: Option<Shaded<'s>>,
}

impl ShadedHit<'_> {
    /// BSDF at the point.
    #[inline]
    pub(super) fn bsdf<F: Features>(&self, scene: &Scene) -> Bsdf {
        self.shaded.map_or_else(|| self.met.bsdf::<F>(scene), |shaded| *shaded.bsdf())
    }

    /// Light sample of the vertex; `sample` takes it without lanes.
    #[inline]
    pub(super) fn lit<F: Features>(
        &self,
        context: &SceneContext<F>,
        sample: impl FnOnce() -> Option<Lit>,
    ) -> Option<Lit> {
        self.shaded.map_or_else(sample, |shaded| shaded.lit(context))
    }

    /// BSDF sample of the vertex; `sample` takes it without lanes.
    #[inline]
    pub(super) fn scattered(&self, sample: impl FnOnce() -> Option<BsdfSample>) -> Option<BsdfSample> {
        self.shaded.map_or_else(sample, |Shaded { block, sets, i }| block.sample(sets, i))
    }
}

impl<'a> Shading<'a> {
    /// Without vertices.
    pub(super) fn new() -> Self {
        Self { block: Block::new(), sets: Sets::default(), has: 0 }
    }

    /// Hit `i` of `rays`, for one `i` after the other from 0 on. The first of a block shades all, so that the
    /// rays up to `i` may be replaced. `numbers` gives the segments of the path of a tag, and the numbers of
    /// its vertex.
    #[inline]
    pub(super) fn hit<'s, F: Features>(
        &'s mut self,
        context: &SceneContext<'a, F>,
        (rays, hits): (&[Ray], &[Hit]),
        i: usize,
        numbers: impl Fn(u32) -> Option<(u32, VertexNumbers)>,
    ) -> ShadedHit<'s> {
        if i.is_multiple_of(BLOCK) {
            let end = rays.len().min(i + BLOCK);
            let traced = (&rays[i..end], &hits[i..end]);
            self.block.points.meet(context, traced);
            self.has = 0;
            if context.has_lanes() {
                self.shade(context, traced.0, numbers);
            }
        }
        let i = i % BLOCK;
        let shaded = Shaded { block: &self.block, sets: &self.sets, i };
        let is_shaded = self.has >> i & 1 == 1;
        ShadedHit { met: self.block.points.at(i), shaded: is_shaded.then_some(shaded) }
    }

    fn shade<F: Features>(
        &mut self,
        context: &SceneContext<'a, F>,
        rays: &[Ray],
        numbers: impl Fn(u32) -> Option<(u32, VertexNumbers)>,
    ) {
        let Self { block, sets, has } = self;
        let (level, lights) = (context.level, &context.lights);
        let (mut lit, mut onward, mut drawn, mut lobe): (u32, u32, u32, Row) = (0, 0, 0, [0.0; BLOCK]);
        block.clear_bsdfs();
        for i in Set(block.points.met) {
            let Some((segments, numbers)) = rays.get(i).and_then(|ray| numbers(ray.tag)) else { continue };
            // Paths that may be trapped by total reflection are shaded one by one.
            if segments >= TRAPPED_FROM {
                continue;
            }
            let one = 1 << i;
            match numbers {
                VertexNumbers::Sequence(place) => {
                    (block.samples.place[i], block.samples.index[i]) = place;
                    (lit, onward, drawn) = (lit | one, onward | one, drawn | one);
                }
                VertexNumbers::Given { light, scattering } => {
                    if let Some([u, v, choice]) = light {
                        (block.numbers.light[0][i], block.numbers.light[1][i]) = (u, v);
                        block.numbers.choice[i] = choice;
                        lit |= one;
                    }
                    if let Some([u, v, number]) = scattering {
                        (block.numbers.scatter[0][i], block.numbers.scatter[1][i]) = (u, v);
                        lobe[i] = number;
                        onward |= one;
                    }
                }
            }
            block.segments[i] = segments;
            let bsdf = block.points.bsdf::<F>(context.scene, i);
            block.put_bsdf::<F>(i, &bsdf, segments);
            block.others[i] = bsdf;
        }
        *has = lit | onward;
        if *has == 0 {
            return;
        }
        if block.coats.exists != 0 {
            block.coats.see(level, &block.points.surface, &COATS);
        }
        if drawn != 0 {
            block.number(level, lights.has_many_lights());
        }
        block.reach_lights(context, lit);
        *sets = if drawn == 0 {
            block.sample_by_numbers::<F>(level, &lobe, onward)
        } else {
            let mut sets = block.sample_bsdfs::<F>(level, onward);
            block.sample_all(level, &mut sets);
            sets
        };
    }
}
