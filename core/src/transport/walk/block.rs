//! Block of sixteen vertices of subpaths in structures of arrays: inputs and results of the shading kernels.

use crate::Rgb;
use crate::bsdf::{Bsdf, Diffuse, Features};
use crate::transport::walk::points::PointBlock;
use crate::transport::walk::termination::TRAPPED_FROM;
use halflight_simd::kernels::shade::bsdf::BsdfBlock;
use halflight_simd::kernels::shade::coat::CoatBlock;
use halflight_simd::kernels::shade::coat_apart::ApartBlock;
use halflight_simd::kernels::shade::direct::{LightBlock, ShadowBlock};
use halflight_simd::kernels::shade::emitter::EmitterBlock;
use halflight_simd::kernels::shade::numbers::{SampleBlock, VertexNumbers};
use halflight_simd::kernels::shade::rough::RoughBlock;
use halflight_simd::kernels::shade::scatter::{NextBlock, ScatterBlock};
use halflight_simd::kernels::shade::sky::SkyBlock;
use halflight_simd::kernels::shade::specular::SpecularBlock;
use halflight_simd::kernels::shade::{BLOCK, Row, Row3, put};

/// Inputs and results of the kernels, and parts of the vertices that only loops use. Rows of vertices that a
/// stage does not use keep old values.
pub(in crate::transport) struct Block<'a> {
    pub(in crate::transport) points: PointBlock<'a>,
    pub(in crate::transport) bsdf: BsdfBlock,
    pub(in crate::transport) coats: CoatBlock,
    pub(in crate::transport) apart: ApartBlock,
    /// Set of coats apart from bases that take no light sample.
    pub(in crate::transport) supplied: u32,
    pub(in crate::transport) specular: SpecularBlock,
    pub(in crate::transport) rough: RoughBlock,
    /// Set of coats without a base and without a rough lobe.
    pub(in crate::transport) smooth_coats: u32,
    pub(in crate::transport) samples: SampleBlock,
    pub(in crate::transport) numbers: VertexNumbers,
    pub(in crate::transport) emitters: EmitterBlock,
    pub(in crate::transport) probability: Row,
    pub(in crate::transport) sky: SkyBlock,
    pub(in crate::transport) light: LightBlock,
    pub(in crate::transport) value: Row3,
    pub(in crate::transport) pdf: Row,
    pub(in crate::transport) given: ScatterBlock,
    pub(in crate::transport) shadows: ShadowBlock,
    pub(in crate::transport) next: NextBlock,
    pub(in crate::transport) throughput: Row3,
    /// Factors from the light of the paths to that of their pixels.
    pub(in crate::transport) factor: Row3,
    pub(in crate::transport) eta_squared: Row,
    pub(in crate::transport) most: Row,
    /// Numbers of light samples, and one over them.
    pub(in crate::transport) light_samples: [u32; BLOCK],
    pub(in crate::transport) each: Row,
    /// Normals for light sampling; zero if the surface transmits.
    pub(in crate::transport) side: Row3,
    pub(in crate::transport) path: [u32; BLOCK],
    pub(in crate::transport) segments: [u32; BLOCK],
    /// BSDFs that lanes do not sample, and coats; all BSDFs on subpaths of bidirectional methods.
    pub(in crate::transport) others: [Bsdf; BLOCK],
    /// First triangles of the sampled area lights.
    pub(in crate::transport) lamp: [u32; BLOCK],
    /// Numbers of the sampled lights, in the order of emission, and distances to those at finite places.
    pub(in crate::transport) sampled: [u32; BLOCK],
    pub(in crate::transport) distance: Row,
    /// Set of light samples whose radiance is still to be multiplied by that of the environment.
    pub(in crate::transport) environment: u32,
    /// True if the only light is in `emitters`, at every vertex.
    pub(in crate::transport) is_lone: bool,
}

/// Vertices of a block by the stages that they pass.
#[derive(Clone, Copy, Default)]
pub(in crate::transport) struct Stages {
    /// Those that scatter in lanes.
    pub(in crate::transport) met: u32,
    /// Those among `met` that take light samples.
    pub(in crate::transport) lit: u32,
    /// Those among `met` whose paths go on.
    pub(in crate::transport) onward: u32,
    /// Those that are shaded one by one.
    pub(in crate::transport) single: u32,
}

impl<'a> Block<'a> {
    /// Without vertices.
    pub(in crate::transport) fn new() -> Self {
        Self {
            points: PointBlock::new(),
            bsdf: BsdfBlock::EMPTY,
            coats: CoatBlock::EMPTY,
            apart: ApartBlock::EMPTY,
            supplied: 0,
            specular: SpecularBlock::EMPTY,
            rough: RoughBlock::EMPTY,
            smooth_coats: 0,
            samples: SampleBlock::EMPTY,
            numbers: VertexNumbers::EMPTY,
            emitters: EmitterBlock::EMPTY,
            probability: [0.0; BLOCK],
            sky: SkyBlock::EMPTY,
            light: LightBlock::EMPTY,
            value: [[0.0; BLOCK]; 3],
            pdf: [0.0; BLOCK],
            given: ScatterBlock::EMPTY,
            shadows: ShadowBlock::EMPTY,
            next: NextBlock::EMPTY,
            throughput: [[0.0; BLOCK]; 3],
            factor: [[1.0; BLOCK]; 3],
            eta_squared: [0.0; BLOCK],
            most: [1.0; BLOCK],
            light_samples: [1; BLOCK],
            each: [1.0; BLOCK],
            side: [[0.0; BLOCK]; 3],
            path: [0; BLOCK],
            segments: [1; BLOCK],
            others: [Bsdf::Diffuse(Diffuse { reflectance: Rgb::ZERO }); BLOCK],
            lamp: [0; BLOCK],
            sampled: [0; BLOCK],
            distance: [0.0; BLOCK],
            environment: 0,
            is_lone: false,
        }
    }

    /// Set of the vertices whose BSDFs lanes sample.
    #[inline]
    pub(in crate::transport) fn in_lanes(&self) -> u32 {
        self.bsdf.diffuse | self.bsdf.metal | self.coats.exists | self.specular.exists | self.rough.exists
    }

    /// Set that has the vertices that are neither diffuse nor rough metals.
    #[inline]
    pub(in crate::transport) fn has_others(&self) -> u32 {
        !(self.bsdf.diffuse | self.bsdf.metal)
    }

    /// Makes `bsdf` that of vertex `i`, which ends segment `segments` of its path.
    #[inline]
    pub(in crate::transport) fn put_bsdf<F: Features>(&mut self, i: usize, bsdf: &Bsdf, segments: u32) {
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
    pub(in crate::transport) fn separate_coat(&mut self, i: usize, base_weight: f32, is_supplied: bool) {
        self.coats.base_weight[i & 15] = base_weight;
        self.coats.apart |= self.coats.exists & 1 << i;
        self.supplied |= u32::from(is_supplied) << i;
    }

    /// Removes the BSDFs of all vertices.
    #[inline]
    pub(in crate::transport) fn clear_bsdfs(&mut self) {
        (self.bsdf.diffuse, self.bsdf.metal, self.rough.exists) = (0, 0, 0);
        (self.coats.exists, self.coats.dielectric, self.smooth_coats) = (0, 0, 0);
        (self.coats.apart, self.supplied, self.coats.base_weight) = (0, 0, [1.0; BLOCK]);
        let SpecularBlock { exists, metal, dielectric, .. } = &mut self.specular;
        (*exists, *metal, *dielectric) = (0, 0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Level;
    use crate::bsdf::{All, COATS, Conductor, Dielectric, Glossy, Mirror, Plastic, RoughDielectric};
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
            block.clear_bsdfs();
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
                block.put_bsdf::<All>(i, &all[i], 1);
            }
            block.coats.see(level, &block.points.surface, &COATS);
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
