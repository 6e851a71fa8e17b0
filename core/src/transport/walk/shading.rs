//! Segments of camera and light subpaths, all of a batch together, with light samples and BSDF samples of
//! their vertices in lanes, a block of sixteen at a time.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::bvh::Coherence;
use crate::geometry::{Hit, Ray};
use crate::light::LightSample;
use crate::scene::Scene;
use crate::transport::settings::Counters;
use crate::transport::walk::block::Block;
use crate::transport::walk::block_scatter::Sets;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::points::Met;
use crate::transport::walk::subpath::Next;
use crate::transport::walk::techniques::Lit;
use crate::transport::walk::termination::TRAPPED_FROM;
use glam::Vec3;
use halflight_simd::kernels::shade::{BLOCK, Row, at, put};

/// Random numbers of a vertex in lanes.
pub(crate) enum VertexNumbers {
    /// Those of a sequence, by its place and the index of its point: of a light sample and of scattering.
    Sequence((u64, u32)),
    /// The same for a path of this throughput and this product of squared relative indices of refraction,
    /// whose next ray is computed in lanes, too.
    Path((u64, u32), [f32; 3], f32),
    /// Numbers of a light sample, and of scattering, if the vertex takes them.
    Given {
        /// Point on a light and choice of the light.
        light: Option<[f32; 3]>,
        /// Direction and lobe.
        scattering: Option<[f32; 3]>,
    },
}

/// Block of vertices, with their light samples and BSDF samples.
pub(crate) struct Shading<'a> {
    block: Block<'a>,
    sets: Sets,
    /// Set of vertices in lanes.
    has: u32,
}

/// Hit of a block, with its samples if it was shaded in lanes.
#[derive(Clone, Copy)]
pub(crate) struct ShadedHit<'s> {
    pub met: Met<'s, 's>,
    shaded: Option<(&'s Block<'s>, &'s Sets)>,
    i: usize,
}

impl ShadedHit<'_> {
    /// BSDF at the point.
    #[inline]
    pub(crate) fn bsdf<F: Features>(&self, scene: &Scene) -> Bsdf {
        self.shaded.map_or_else(|| self.met.bsdf::<F>(scene), |(block, _)| block.others[self.i & 15])
    }

    /// Light sample of the vertex in the scene of `context`; `sample` takes it without lanes.
    #[inline]
    pub(crate) fn lit<F: Features>(
        &self,
        context: &SceneContext<F>,
        sample: impl FnOnce() -> Option<Lit>,
    ) -> Option<Lit> {
        let Some((block, _)) = self.shaded else { return sample() };
        let (scene, light, i) = (context.scene, &block.light, self.i & 15);
        let is_in = |set: u32| set >> i & 1 == 1;
        if !is_in(block.shadows.exists) {
            return None;
        }
        let [r, g, b, pdf] = block.shadows.contribution[i];
        let direction = Vec3::from(at(&light.direction, i));
        let environment = scene.environment.as_ref().filter(|_| is_in(block.environment));
        let factor = environment.map_or(Rgb::ONE, |e| e.radiance(scene, direction));
        Some(Lit {
            light: LightSample {
                direction,
                distance: block.distance[i],
                target: None,
                radiance: Rgb::from(at(&light.radiance, i)) * factor,
                pdf: light.pdf[i],
                delta: is_in(light.alone),
                light: block.sampled[i],
            },
            value: Rgb::new(r, g, b),
            pdf,
            ray: block.shadow_ray(context, i),
        })
    }

    /// Continuation of the path of [`VertexNumbers::Path`]; `next` computes it without lanes.
    #[inline]
    pub(crate) fn next(&self, next: impl FnOnce() -> Option<Next>) -> Option<Next> {
        let Some((block, sets)) = self.shaded else { return next() };
        let i = self.i & 15;
        let is_in = |set: u32| set >> i & 1 == 1;
        if !is_in(block.next.exists) {
            return None;
        }
        let ([r, g, b, pdf, .., eta_squared], [.., x, y, z, _]) = (block.next.states[i], block.next.rays[i]);
        let direction = Vec3::from(at(&block.next.local, i));
        let sample = BsdfSample {
            direction,
            weight: Rgb::ONE,
            pdf,
            delta: is_in(sets.delta),
            transmitted: direction.z < 0.0,
            eta: block.given.eta[i],
        };
        let (towards, throughput) = (Vec3::new(x, y, z), Rgb::new(r, g, b));
        Some(Next { sample, towards, throughput, eta_squared, is_cut: is_in(sets.cut) })
    }

    /// BSDF sample of the vertex; `sample` takes it without lanes.
    #[inline]
    pub(crate) fn scattered(&self, sample: impl FnOnce() -> Option<BsdfSample>) -> Option<BsdfSample> {
        self.shaded.map_or_else(sample, |(block, sets)| block.sample(sets, self.i))
    }
}

impl<'a> Shading<'a> {
    /// Without vertices.
    pub(crate) fn new() -> Self {
        Self { block: Block::new(), sets: Sets::default(), has: 0 }
    }

    /// Advances all subpaths of `rays` by a segment. `numbers` gives the segments of the subpath of a tag,
    /// and the numbers of its vertex if it scatters or takes a light sample; `step` handles ray number i at
    /// its end, and gives the next ray. Returns the number of next rays, which replace the first ones.
    pub(crate) fn advance<F: Features, S: ?Sized>(
        &mut self,
        context: &SceneContext<'a, F>,
        (rays, hits, coherence): (&mut [Ray], &mut [Hit], Coherence),
        counters: &mut Counters,
        subpaths: &mut S,
        numbers: impl Fn(&S, u32) -> Option<(u32, VertexNumbers)>,
        mut step: impl FnMut(&mut S, usize, (&Ray, &Hit, ShadedHit), &mut Counters) -> Option<Ray>,
    ) -> usize {
        counters.rays += rays.len() as u64;
        context.nearest_batch(rays, coherence, hits);
        let mut left = 0;
        for i in 0..rays.len() {
            if i.is_multiple_of(BLOCK) {
                let end = rays.len().min(i + BLOCK);
                self.block.points.meet(context, (&rays[i..end], &hits[i..end]));
                self.has = 0;
                if context.has_lanes() {
                    self.shade(context, &rays[i..end], |tag| numbers(subpaths, tag));
                }
            }
            let (ray, hit, of_block) = (rays[i], hits[i], i % BLOCK);
            let is_shaded = self.has >> of_block & 1 == 1;
            let shaded = is_shaded.then_some((&self.block, &self.sets));
            let shaded = ShadedHit { met: self.block.points.at(of_block), shaded, i: of_block };
            if let Some(next) = step(subpaths, i, (&ray, &hit, shaded), counters) {
                rays[left] = Ray { tag: ray.tag, ..next };
                left += 1;
            }
        }
        left
    }

    /// Samples lights and BSDFs at the vertices of `rays`, at most sixteen, whose points are in the block.
    fn shade<F: Features>(
        &mut self,
        context: &SceneContext<'a, F>,
        rays: &[Ray],
        numbers: impl Fn(u32) -> Option<(u32, VertexNumbers)>,
    ) {
        let Self { block, sets, has } = self;
        let (level, lights) = (context.level, &context.lights);
        let (mut lit, mut onward, mut drawn, mut lobe): (u32, u32, u32, Row) = (0, 0, 0, [0.0; BLOCK]);
        let mut has_next = false;
        let (stage, filled) = block.fill::<F>(context.scene, |block, i| {
            let (segments, numbers) = rays.get(i).and_then(|ray| numbers(ray.tag))?;
            // Paths that may be trapped by total reflection are shaded one by one.
            if segments >= TRAPPED_FROM {
                return None;
            }
            let one = 1 << i;
            match numbers {
                VertexNumbers::Sequence(place) => {
                    (block.samples.place[i], block.samples.index[i]) = place;
                    (lit, onward, drawn) = (lit | one, onward | one, drawn | one);
                }
                VertexNumbers::Path(place, throughput, eta_squared) => {
                    (block.samples.place[i], block.samples.index[i]) = place;
                    put(&mut block.throughput, i, throughput);
                    block.eta_squared[i] = eta_squared;
                    has_next = true;
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
            Some(segments)
        });
        *has = filled;
        if filled == 0 {
            return;
        }
        let stage = block.see(level, stage);
        let stage = match drawn {
            0 => Block::keep_numbers(stage),
            _ => block.number(level, stage, lights.has_many_lights()),
        };
        block.reach_lights(context, &stage, lit);
        *sets = if drawn == 0 {
            block.sample_by_numbers::<F>(level, &stage, &lobe, onward)
        } else {
            let mut sets = block.sample_bsdfs::<F>(level, &stage, onward);
            if has_next {
                block.scatter(level, &sets);
            } else {
                block.sample_all(level, &mut sets);
            }
            sets
        };
    }
}
