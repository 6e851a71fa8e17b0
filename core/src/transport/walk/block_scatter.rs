//! BSDF samples of the vertices of a block, and next rays of paths from the camera.

use crate::Level;
use crate::bsdf::{BsdfSample, COATS, Features};
use crate::transport::walk::block::Block;
use crate::transport::walk::block_stages::{Filled, Numbered};
use crate::transport::walk::dimension;
use crate::transport::walk::points::Set;
use crate::transport::walk::termination::{CERTAIN_BELOW, MAX_VERTICES, is_cut, most_probable};
use glam::Vec3;
use halflight_simd::kernels::shade::coat::{CoatSamples, CoatSets};
use halflight_simd::kernels::shade::numbers::Offsets;
use halflight_simd::kernels::shade::rough::Rough;
use halflight_simd::kernels::shade::scatter::Scatter;
use halflight_simd::kernels::shade::specular::SpecularSamples;
use halflight_simd::kernels::shade::{BLOCK, Row, at, put};

/// Sets of vertices for [`Scatter`], and for the paths that go on.
#[derive(Default)]
pub(crate) struct Sets {
    pub(crate) active: u32,
    /// Paths that must survive.
    pub(crate) certain: u32,
    /// Paths that are too long.
    pub(crate) cut: u32,
    pub(crate) delta: u32,
    /// Samples of coats apart from their bases.
    pub(crate) coat: u32,
    pub(crate) transmits: u32,
}

impl Block<'_> {
    /// Samples the BSDFs of the vertices `onward`, except for those that [`Scatter`] samples.
    #[inline]
    pub(crate) fn sample_bsdfs<F: Features>(&mut self, level: Level, _: &Numbered, onward: u32) -> Sets {
        let starts = onward & Set::of(&self.segments, |segments| segments == 1);
        if starts != 0 {
            let pairs = self.samples.second_pairs(level, dimension::PIXEL);
            let [u, v] = &mut self.numbers.scatter;
            for i in Set(starts) {
                (u[i], v[i]) = (pairs[0][i], pairs[1][i]);
            }
        }
        let mut sets = Sets { active: onward, ..Sets::default() };
        let long = onward & Set::of(&self.segments, |segments| segments >= CERTAIN_BELOW);
        self.most = [1.0; BLOCK];
        for i in Set(long) {
            self.most[i] = most_probable(self.segments[i]);
            sets.cut |= u32::from(self.segments[i] >= MAX_VERTICES) << i;
        }
        self.sample_given::<F>(level, dimension::LOBE, onward, &mut sets);
        sets
    }

    /// Samples the BSDFs of the vertices `onward` that are neither diffuse nor rough metals; the dimension of
    /// their lobes is at `offset` from the first of the vertex.
    #[inline]
    fn sample_given<F: Features>(&mut self, level: Level, offset: u32, onward: u32, sets: &mut Sets) {
        self.given.eta = [1.0; BLOCK];
        let others = onward & !self.in_lanes();
        let lobes = others | (self.coats.exists | self.rough.exists) & onward;
        if lobes | self.specular.exists & onward == 0 {
            return;
        }
        let lobe = match lobes | self.specular.dielectric {
            0 => [0.0; BLOCK],
            _ => self.samples.singles(level, offset),
        };
        self.sample_by_lobes::<F>(level, &lobe, onward, sets);
    }

    /// [`Block::sample_given`] by known numbers of the lobes.
    #[inline]
    fn sample_by_lobes<F: Features>(&mut self, level: Level, lobe: &Row, onward: u32, sets: &mut Sets) {
        for i in Set(onward & !self.in_lanes()) {
            self.sample_other::<F>(i, lobe[i], sets);
        }
        self.sample_lobes(level, lobe, onward, sets);
    }

    /// Samples the BSDF of vertex `i`, which lanes do not sample.
    #[inline]
    fn sample_other<F: Features>(&mut self, i: usize, lobe: f32, sets: &mut Sets) {
        let u = [self.numbers.scatter[0][i], self.numbers.scatter[1][i], lobe];
        let bsdf = &self.others[i];
        let Some(sample) = bsdf.sample::<F>(at(&self.points.surface.wo, i).into(), u) else {
            sets.active &= !(1 << i);
            return;
        };
        put(&mut self.given.direction, i, sample.direction.to_array());
        put(&mut self.given.weight, i, sample.weight.to_array());
        self.given.pdf[i] = if sample.delta { f32::INFINITY } else { sample.pdf };
        self.given.eta[i] = sample.eta;
        sets.cut |= u32::from(is_cut(self.segments[i], bsdf, &sample)) << i;
        sets.delta |= u32::from(sample.delta) << i;
        sets.transmits |= u32::from(bsdf.transmits()) << i;
    }

    /// Samples the coats, the rough dielectrics and the smooth surfaces among the vertices `onward`.
    #[inline]
    fn sample_lobes(&mut self, level: Level, lobe: &Row, onward: u32, sets: &mut Sets) {
        let Block { points, coats, specular, rough, numbers, given, .. } = self;
        let surface = &points.surface;
        if coats.exists & !coats.apart & onward != 0 {
            let samples = CoatSamples { surface, coats, tables: &COATS, u: &numbers.scatter, lobe };
            let CoatSets { exists, delta, .. } = samples.compute(level, given);
            sets.active &= exists | !coats.exists | coats.apart;
            sets.delta |= delta & !coats.apart;
        }
        if coats.apart & onward != 0 {
            let samples = CoatSamples { surface, coats, tables: &COATS, u: &numbers.scatter, lobe };
            let of_lobes = samples.compute_apart(level, given);
            sets.active &= of_lobes.exists | !coats.apart;
            sets.delta |= of_lobes.delta;
            sets.coat = of_lobes.coat;
        }
        if rough.exists & onward != 0 {
            let exists = Rough { surface, rough }.sample(level, (&numbers.scatter, lobe), given);
            sets.active &= exists | !rough.exists;
            sets.transmits |= rough.exists;
        }
        if specular.exists & onward != 0 {
            let exists = SpecularSamples { surface, specular, lobe }.compute(level, given);
            sets.active &= exists | !specular.exists;
            sets.delta |= specular.exists;
            sets.transmits |= specular.dielectric;
        }
    }

    /// Plays roulette and computes the next rays, after [`Block::sample_bsdfs`].
    #[inline]
    pub(crate) fn scatter(&mut self, level: Level, sets: &Sets) {
        let Block { points, bsdf, given, numbers, most, throughput, factor, eta_squared, next, .. } = self;
        let (surface, u, roulette) = (&points.surface, &numbers.scatter, &numbers.roulette);
        let Sets { active, certain, .. } = *sets;
        Scatter { surface, bsdf, given, u, roulette, most, throughput, factor, eta_squared, active, certain }
            .compute(level, next);
    }

    /// Samples the BSDFs of the vertices `onward` of light subpaths, with random numbers at `offsets` from
    /// the first dimensions of the vertices. They go into the given samples.
    #[inline]
    pub(crate) fn sample_from_lights<F: Features>(
        &mut self,
        level: Level,
        _: Filled,
        (offsets, lobe): (Offsets, u32),
        onward: u32,
    ) -> Sets {
        self.samples.scattering(level, offsets, &mut self.numbers);
        let mut sets = Sets { active: onward, ..Sets::default() };
        self.sample_given::<F>(level, lobe, onward, &mut sets);
        self.sample_all(level, &mut sets);
        sets
    }

    /// Samples the BSDFs of the vertices `onward` by the numbers of the block and those of the lobes. They go
    /// into the given samples.
    #[inline]
    pub(crate) fn sample_by_numbers<F: Features>(
        &mut self,
        level: Level,
        _: &Numbered,
        lobe: &Row,
        onward: u32,
    ) -> Sets {
        let mut sets = Sets { active: onward, ..Sets::default() };
        self.given.eta = [1.0; BLOCK];
        self.sample_by_lobes::<F>(level, lobe, onward, &mut sets);
        self.sample_all(level, &mut sets);
        sets
    }

    /// Adds the samples of the BSDFs that [`Scatter`] samples to those given.
    #[inline]
    pub(crate) fn sample_all(&mut self, level: Level, sets: &mut Sets) {
        let Block { points, bsdf, given, numbers, most, throughput, factor, eta_squared, .. } = &*self;
        let (surface, u, roulette) = (&points.surface, &numbers.scatter, &numbers.roulette);
        let Sets { active, certain, .. } = *sets;
        let scatter = Scatter {
            surface,
            bsdf,
            given,
            u,
            roulette,
            most,
            throughput,
            factor,
            eta_squared,
            active,
            certain,
        };
        (self.given, sets.active) = scatter.samples(level);
    }

    /// The given sample of vertex `i`, with the `sets` of its block. The density of a delta lobe is infinite.
    #[inline]
    pub(crate) fn sample(&self, sets: &Sets, i: usize) -> Option<BsdfSample> {
        let i = i & 15;
        let direction = Vec3::from(at(&self.given.direction, i));
        (sets.active >> i & 1 == 1).then(|| BsdfSample {
            direction,
            weight: at(&self.given.weight, i).into(),
            pdf: self.given.pdf[i],
            delta: sets.delta >> i & 1 == 1,
            transmitted: direction.z < 0.0,
            eta: self.given.eta[i],
        })
    }
}
