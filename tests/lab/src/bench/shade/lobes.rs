//! Kernels of coats, smooth surfaces and rough dielectrics.

use super::data::{Block, LOBE, TABLES};
use core::hint::black_box;
use halflight_core::Level;
use halflight_simd::kernels::shade::coat::{CoatLight, CoatSamples};
use halflight_simd::kernels::shade::coat_apart::{ApartBlock, ApartLight};
use halflight_simd::kernels::shade::rough::{Rough, RoughBlock};
use halflight_simd::kernels::shade::scatter::ScatterBlock;
use halflight_simd::kernels::shade::specular::SpecularSamples;

impl Block {
    pub(super) fn see(&self, level: Level) {
        let mut coats = black_box(&self.coats).clone();
        coats.see(level, &self.surface, &TABLES);
        black_box(&coats);
    }

    pub(super) fn light_coats(&self, level: Level) {
        let Self { surface, coats, light, .. } = self;
        let light = CoatLight { surface, coats, tables: &TABLES, direction: &light.direction };
        let (mut value, mut pdf) = (self.ones, self.ones[0]);
        light.compute(level, &mut value, &mut pdf);
        black_box((&value, &pdf));
    }

    pub(super) fn sample_coats(&self, level: Level) {
        let Self { surface, coats, numbers, .. } = self;
        let (u, lobe) = (&numbers.scatter, &numbers.choice);
        let samples = CoatSamples { surface, coats, tables: &TABLES, u, lobe };
        let mut out = ScatterBlock::EMPTY;
        black_box(samples.compute(level, &mut out));
        black_box(&out);
    }

    pub(super) fn light_apart(&self, level: Level) {
        let Self { surface, coats, light, ones, .. } = self;
        let (each, throughput, supplied) = (&ones[0], ones, 0);
        let light = ApartLight { surface, coats, tables: &TABLES, light, each, throughput, supplied };
        let mut out = ApartBlock::EMPTY;
        light.compute(level, &mut out);
        black_box(&out);
    }

    pub(super) fn sample_apart(&self, level: Level) {
        let Self { surface, coats, numbers, .. } = self;
        let (u, lobe) = (&numbers.scatter, &numbers.choice);
        let samples = CoatSamples { surface, coats, tables: &TABLES, u, lobe };
        let mut out = ScatterBlock::EMPTY;
        black_box(samples.compute_apart(level, &mut out));
        black_box(&out);
    }

    pub(super) fn refract(&self, level: Level) {
        let Self { surface, glass, numbers, .. } = self;
        let samples = SpecularSamples { surface, specular: glass, lobe: &numbers.choice };
        let mut out = ScatterBlock::EMPTY;
        black_box(samples.compute(level, &mut out));
        black_box(&out);
    }

    pub(super) fn lobes(&self, level: Level) {
        black_box(self.samples.singles(level, LOBE));
    }

    fn rough(&self) -> RoughBlock {
        RoughBlock { alpha: [0.3; 16], exists: 0xffff, ..RoughBlock::EMPTY }
    }

    pub(super) fn light_rough(&self, level: Level) {
        let rough = self.rough();
        let rough = Rough { surface: &self.surface, rough: &rough };
        let (mut value, mut pdf) = (self.ones, self.ones[0]);
        rough.light(level, &self.light.direction, &mut value, &mut pdf);
        black_box((&value, &pdf));
    }

    pub(super) fn sample_rough(&self, level: Level) {
        let (rough, u) = (self.rough(), (&self.numbers.scatter, &self.numbers.choice));
        let rough = Rough { surface: &self.surface, rough: &rough };
        let mut out = ScatterBlock::EMPTY;
        black_box(rough.sample(level, u, &mut out));
        black_box(&out);
    }
}
