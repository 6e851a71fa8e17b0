//! Stages of a block of vertices: BSDFs, coats as their viewers see them, random numbers.

use crate::Level;
use crate::bsdf::{Bsdf, COATS, Features};
use crate::scene::Scene;
use crate::transport::walk::block::Block;
use crate::transport::walk::dimension;
use crate::transport::walk::points::Set;
use crate::transport::walk::termination::TRAPPED_FROM;
use halflight_simd::kernels::shade::specular::SpecularBlock;
use halflight_simd::kernels::shade::{BLOCK, put};

/// First stage of a block: BSDFs are put in.
///
/// A stage is the proof that a block has passed those before. Functions of a block borrow the stage that they
/// need, or take it if they end it, so that another order does not compile: [`Block::clear`], [`Block::put`]
/// for each vertex, [`Block::see`], [`Block::number`], and then samples of lights and BSDFs in any order.
pub(crate) struct Cleared(());

/// Second stage: all BSDFs are known.
pub(crate) struct Filled(());

/// Third stage: the random numbers are known.
pub(crate) struct Numbered(());

impl<'a> Block<'a> {
    /// Puts in the BSDFs of all points whose paths have the number of segments that `enter` gives. Returns
    /// their set.
    #[inline]
    pub(crate) fn fill<F: Features>(
        &mut self,
        scene: &Scene,
        mut enter: impl FnMut(&mut Self, usize) -> Option<u32>,
    ) -> (Cleared, u32) {
        let (stage, mut filled) = (self.clear(), 0);
        for i in Set(self.points.met) {
            let Some(segments) = enter(self, i) else { continue };
            self.segments[i] = segments;
            let bsdf = self.points.bsdf::<F>(scene, i);
            self.put::<F>(&stage, i, &bsdf);
            self.others[i] = bsdf;
            filled |= 1 << i;
        }
        (stage, filled)
    }

    /// Makes `bsdf` that of vertex `i`, whose segments are known.
    #[inline]
    pub(crate) fn put<F: Features>(&mut self, _: &Cleared, i: usize, bsdf: &Bsdf) {
        let segments = self.segments[i & 15];
        let one = 1 << i;
        let (color, eta) = match bsdf {
            Bsdf::Diffuse(b) => {
                put(&mut self.bsdf.reflectance, i, b.reflectance.to_array());
                self.bsdf.diffuse |= one;
                return;
            }
            Bsdf::Conductor(b) if F::GLOSSY && b.alpha > 0.0 => {
                put(&mut self.bsdf.reflectance, i, b.f0.to_array());
                self.bsdf.alpha[i] = b.alpha;
                self.bsdf.metal |= one;
                return;
            }
            Bsdf::Glossy(_) | Bsdf::Plastic(_) if F::GLOSSY => {
                if let Some(coat) = bsdf.coat::<F>() {
                    self.coats.put(i, &coat);
                }
                self.smooth_coats |= u32::from(bsdf.is_delta()) << i;
                self.others[i] = *bsdf;
                return;
            }
            Bsdf::RoughDielectric(b) if F::DIELECTRIC => {
                put(&mut self.rough.tint, i, b.tint.to_array());
                (self.rough.eta[i], self.rough.alpha[i]) = (b.eta, b.alpha);
                self.rough.exists |= one;
                self.others[i] = *bsdf;
                return;
            }
            Bsdf::Mirror(b) if F::GLOSSY => (b.reflectance, 1.0),
            Bsdf::Conductor(b) if F::GLOSSY => {
                self.specular.metal |= one;
                (b.f0, 1.0)
            }
            // Paths that may be trapped by total reflection are counted one by one.
            Bsdf::Dielectric(b) if F::DIELECTRIC && segments < TRAPPED_FROM => {
                self.specular.dielectric |= one;
                (b.tint, b.eta)
            }
            _ => {
                self.others[i] = *bsdf;
                return;
            }
        };
        put(&mut self.specular.color, i, color.to_array());
        self.specular.eta[i] = eta;
        self.specular.exists |= one;
    }

    /// Separates the coat of vertex `i` from its base, which has this weight in the choice of the lobe, and
    /// takes light samples unless it `is_supplied`.
    #[inline]
    pub(crate) fn separate_coat(&mut self, _: &Cleared, i: usize, base_weight: f32, is_supplied: bool) {
        self.coats.base_weight[i & 15] = base_weight;
        self.coats.apart |= self.coats.exists & 1 << i;
        self.supplied |= u32::from(is_supplied) << i;
    }

    /// All BSDFs are in: computes what the coats show to their viewers.
    #[inline]
    pub(crate) fn see(&mut self, level: Level, _: Cleared) -> Filled {
        if self.coats.exists != 0 {
            self.coats.see(level, &self.points.surface, &COATS);
        }
        Filled(())
    }

    /// Random numbers of the vertices; those of the choice of a light only if it `chooses`.
    #[inline]
    pub(crate) fn number(&mut self, level: Level, _: Filled, chooses: bool) -> Numbered {
        for (first, segments) in self.samples.dimension.iter_mut().zip(self.segments) {
            *first = dimension::vertex(segments);
        }
        self.samples.vertices(level, dimension::OFFSETS, chooses, &mut self.numbers);
        Numbered(())
    }

    /// The numbers are those that the block has.
    #[inline]
    pub(crate) fn keep_numbers(_: Filled) -> Numbered {
        Numbered(())
    }

    /// Removes the BSDFs of all vertices.
    #[inline]
    pub(crate) fn clear(&mut self) -> Cleared {
        (self.bsdf.diffuse, self.bsdf.metal, self.rough.exists) = (0, 0, 0);
        (self.coats.exists, self.coats.dielectric, self.smooth_coats) = (0, 0, 0);
        (self.coats.apart, self.supplied, self.coats.base_weight) = (0, 0, [1.0; BLOCK]);
        let SpecularBlock { exists, metal, dielectric, .. } = &mut self.specular;
        (*exists, *metal, *dielectric) = (0, 0, 0);
        Cleared(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::bsdf::{All, Conductor, Dielectric, Glossy, Mirror, Plastic, RoughDielectric};
    use crate::sampling::Random;
    use crate::sampling::warp::uniform_sphere;
    use glam::Vec3;
    use halflight_simd::kernels::shade::at;
    use halflight_simd::kernels::shade::coat::{CoatLight, CoatSamples};
    use halflight_simd::kernels::shade::rough::Rough;
    use halflight_simd::kernels::shade::specular::SpecularSamples;

    /// Coats and smooth surfaces of all kinds.
    fn surfaces(random: &Random, i: u32) -> Bsdf {
        let [r, g, b, alpha, metallic, eta] = [0, 1, 2, 3, 4, 5].map(|k| random.single(20 * i + k));
        let (color, coat) = (Rgb::new(r, g, b), Rgb::new(b, r, g));
        let alpha = if i.is_multiple_of(3) { 0.0 } else { alpha.max(1e-3) };
        let base = if i.is_multiple_of(7) { Rgb::ZERO } else { color };
        match i % 6 {
            5 => Bsdf::RoughDielectric(RoughDielectric {
                eta: if metallic < 0.5 { 0.4 + 0.5 * eta } else { 1.1 + eta },
                alpha: alpha.max(1e-3),
                tint: color,
            }),
            0 => Bsdf::Glossy(Glossy::new(base, coat, alpha, metallic)),
            1 => Bsdf::Mirror(Mirror { reflectance: color }),
            2 => Bsdf::Conductor(Conductor { f0: color, alpha: 0.0 }),
            3 => Bsdf::Dielectric(Dielectric { eta: 0.4 + 2.0 * eta, tint: color }),
            _ => Bsdf::Plastic(Plastic::new(base, coat * 0.05, alpha, (metallic - 0.5).max(0.0), 1.0 + eta)),
        }
    }

    #[test]
    fn lanes_have_the_bits_of_single_bsdfs() {
        let random = Random::new(5, 0);
        let (mut block, level) = (Block::new(), Level::detect());
        for round in 0..200 {
            // Coats of the block before were apart from their bases.
            block.coats.base_weight = [0.3; BLOCK];
            let stage = block.clear();
            block.points.surface.frame = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
                .map(|axis| axis.map(|coordinate| [coordinate; BLOCK]));
            let (mut lobe, mut all) = ([0.0; BLOCK], [Bsdf::Mirror(Mirror { reflectance: Rgb::ONE }); BLOCK]);
            for i in 0..BLOCK {
                let n = 16 * round + i as u32;
                let number = |k: u32| random.single(20 * n + k);
                let wo = uniform_sphere([number(6), number(7)]);
                put(
                    &mut block.points.surface.wo,
                    i,
                    [wo.x, wo.y, if n.is_multiple_of(9) { 0.0 } else { wo.z.abs() }],
                );
                put(&mut block.light.direction, i, uniform_sphere([number(8), number(9)]).to_array());
                (block.numbers.scatter[0][i], block.numbers.scatter[1][i]) = (number(10), number(11));
                (lobe[i], all[i]) = (number(12), surfaces(&random, n));
                block.put::<All>(&stage, i, &all[i]);
            }
            block.see(level, stage);
            let Block { points, coats, specular, rough, light, numbers, value, pdf, given, .. } = &mut block;
            let surface = &points.surface;
            CoatLight { surface, coats, tables: &COATS, direction: &light.direction }
                .compute(level, value, pdf);
            let u = &numbers.scatter;
            let sampled =
                CoatSamples { surface, coats, tables: &COATS, u, lobe: &lobe }.compute(level, given);
            let smooth = SpecularSamples { surface, specular, lobe: &lobe }.compute(level, given);
            let rough = Rough { surface, rough };
            rough.light(level, &light.direction, value, pdf);
            let refracted = rough.sample(level, (u, &lobe), given);
            let has_value = coats.exists | rough.rough.exists;
            for (i, bsdf) in all.iter().enumerate() {
                let bit = |set: u32| set >> i & 1 == 1;
                let wo = Vec3::from(at(&surface.wo, i));
                let (f, density) = bsdf.evaluate::<All>(wo, at(&light.direction, i).into());
                if bit(has_value) {
                    assert_eq!((Rgb::from(at(value, i)), pdf[i]), (f, density), "{bsdf:?}");
                }
                let sample = bsdf.sample::<All>(wo, [u[0][i], u[1][i], lobe[i]]);
                let is_sampled = bit(sampled.exists & coats.exists | smooth | refracted);
                assert_eq!(is_sampled, sample.is_some(), "{bsdf:?}");
                let Some(sample) = sample else { continue };
                assert_eq!(bit(sampled.delta | specular.exists), sample.delta, "{bsdf:?}");
                let found = (at(&given.direction, i), at(&given.weight, i), given.eta[i]);
                let wanted = (sample.direction.to_array(), sample.weight.to_array(), sample.eta);
                assert_eq!(found, wanted, "{bsdf:?}");
                assert_eq!(given.pdf[i], if sample.delta { f32::INFINITY } else { sample.pdf }, "{bsdf:?}");
            }
        }
    }
}
