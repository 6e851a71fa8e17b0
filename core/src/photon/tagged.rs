//! Photons of a disc one by one, with tags and kernel weights: for vertex merging, where each has its own MIS
//! weight.

use super::PhotonMap;
use super::gather::{DiscTest, kernel_weight};
use super::kernel::QueryDisc;
use super::kernel_boundary::KernelBoundary;
use super::layout::{HALVES, Leaf};
use super::range::{Visit, leaves_within};
use core::f32::consts::PI;
use halflight_simd::{Kernel, Lanes, Mask, Simd};

/// Kernel that visits the photons of a disc.
pub(super) struct TaggedPhotons<'a, 'm, E> {
    pub map: &'a PhotonMap<'m>,
    pub disc: &'a QueryDisc,
    pub boundary: Option<&'a KernelBoundary>,
    pub each: E,
}

impl<E: FnMut(u32, [f32; 2])> Kernel for TaggedPhotons<'_, '_, E> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { map, disc, boundary, each } = self;
        let Some(test) = DiscTest::new(simd, map, disc, boundary) else { return };
        let place = test.place;
        let squared_radius = test.squared_radius;
        let kernel = |part: f32| {
            let seen = boundary.map_or(1.0, |boundary| boundary.visible_fraction(disc.kernel, part));
            let (radius, squared) = (part * disc.radius, part * part * squared_radius);
            let per_area = if seen > 0.0 { 1.0 / (PI * seen * radius) / radius } else { 0.0 };
            PartOfDisc {
                limit: simd.splat16(squared),
                reciprocal: simd.splat16((1.0 / squared).min(f32::MAX)),
                per_area: simd.splat16(per_area),
            }
        };
        let mut list = List { test, kernel: disc.kernel, parts: [kernel(1.0), kernel(0.5)], each };
        leaves_within(simd, map, &place, squared_radius, &mut list);
    }
}

/// Disc of a part of the radius.
struct PartOfDisc<S: Simd> {
    /// Squared radius.
    limit: S::F16,
    /// One over the squared radius.
    reciprocal: S::F16,
    /// One over the visible area of the disc.
    per_area: S::F16,
}

/// State of a visit, in lanes.
struct List<'a, S: Simd, E> {
    test: DiscTest<'a, S>,
    kernel: super::Kernel,
    parts: [PartOfDisc<S>; 2],
    each: E,
}

impl<S: Simd, E: FnMut(u32, [f32; 2])> Visit<S> for List<'_, S, E> {
    #[inline(always)]
    fn leaf(&mut self, simd: S, _: usize, leaf: &Leaf) {
        for half in 0..HALVES {
            let Some((distance, _, counted)) = self.test.photons(simd, leaf, half) else { continue };
            let [whole, finer] = &self.parts;
            let weight = |part: &PartOfDisc<S>| {
                let weight = kernel_weight(simd, self.kernel, distance * part.reciprocal) * part.per_area;
                weight.select(distance.le(part.limit), simd.splat16(0.0)).to_array()
            };
            let (whole, finer, mut bits) = (weight(whole), weight(finer), counted.bits());
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize % 16;
                (self.each)(leaf.power[half % HALVES][lane], [whole[lane], finer[lane]]);
                bits &= bits - 1;
            }
        }
    }
}
