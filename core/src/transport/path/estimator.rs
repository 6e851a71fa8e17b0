//! Interface between the path tracer and the methods that build on it: a [`LightEstimator`] supplies part of
//! the light at a vertex from a data structure, and the path finds the rest.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::geometry::Ray;
use crate::light::LightSample;
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::path_classes::PathClasses;
use crate::transport::wavefront::Wavefront;
use bytemuck::Pod;
use core::ops::Range;
use glam::Vec3;
use halflight_simd::kernels::shade::BLOCK;

/// Surface point of a path, its BSDF, and the quantities of the path so far.
pub struct PathVertex<'v, 'a> {
    /// Index of the path in its wave.
    pub(in crate::transport) path: usize,
    /// Index of the pixel in the picture, and number of the sample.
    pub(in crate::transport) pixel: u32,
    pub(in crate::transport) sample: u32,
    pub(in crate::transport) point: &'v SurfacePoint<'a>,
    pub(in crate::transport) bsdf: Bsdf,
    /// Random numbers of the path, and first dimension of this vertex.
    pub(in crate::transport) sampler: Sampler,
    pub(in crate::transport) first: u32,
    /// Number of segments of the path so far.
    pub(in crate::transport) segments: u32,
    /// Local direction to the previous vertex.
    pub(in crate::transport) wo: Vec3,
    /// Normal for light sampling; zero if the surface transmits.
    pub(in crate::transport) normal: Vec3,
    /// Length of the last segment, and of the path from the camera.
    pub(in crate::transport) distance: f32,
    pub(in crate::transport) travelled: f32,
    /// β, the throughput of the path so far.
    pub(in crate::transport) throughput: Rgb,
    /// True if an estimator supplies light of the base only, so that the coat is sampled separately.
    pub(in crate::transport) apart: bool,
    /// Classes of light that the path had to find on its last segment.
    pub(in crate::transport) came: PathClasses,
    /// Classes to find from here without an estimator.
    pub(in crate::transport) rest: PathClasses,
}

/// Light that an estimator supplies at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub struct KnownLight {
    /// Contribution to the pixel: radiance times the throughput of the path.
    pub contribution: Rgb,
    /// Expected error of the radiance due to the kernel width of a density estimate.
    pub blur: Rgb,
}

/// Light that the path still has to find behind a vertex.
#[derive(Clone, Copy, Debug)]
pub struct RemainingLight {
    /// Classes behind the wide lobes of the surface; `None` if the estimator supplies all of them.
    pub(in crate::transport) wide: Option<PathClasses>,
    /// Classes behind a mirror, or a coat that is sampled separately.
    pub(in crate::transport) narrow: PathClasses,
    /// True if the estimator supplies direct light, except through a narrow coat.
    pub(in crate::transport) is_lit: bool,
    /// Number of light samples of next-event estimation.
    pub(in crate::transport) light_samples: u32,
    /// True if next-event estimation finds all of the rest, so that the path ends, or goes on by the coat
    /// alone.
    pub(in crate::transport) ends: bool,
    /// Weight of the base in the choice between a coat and its base, if they are sampled separately.
    pub(in crate::transport) base_weight: f32,
}

impl RemainingLight {
    /// All light that the path of `vertex` still has to find.
    #[inline]
    pub(in crate::transport) fn all(vertex: &PathVertex) -> Self {
        Self::of(vertex.rest)
    }

    /// Light of `classes`.
    #[inline]
    pub(in crate::transport) fn of(classes: PathClasses) -> Self {
        Self {
            wide: Some(classes),
            narrow: classes,
            is_lit: false,
            light_samples: 1,
            ends: false,
            base_weight: 1.0,
        }
    }

    /// Light in both, as that which neither of two estimators supplies.
    #[inline]
    pub(in crate::transport) fn and(self, other: Self) -> Self {
        Self {
            wide: self.wide.zip(other.wide).map(|(a, b)| a.and(b)),
            narrow: self.narrow.and(other.narrow),
            is_lit: self.is_lit || other.is_lit,
            light_samples: self.light_samples.max(other.light_samples),
            ends: self.ends || other.ends,
            base_weight: self.base_weight.min(other.base_weight),
        }
    }
}

/// Emission that a path hits by BSDF sampling.
#[derive(Clone, Copy, Debug)]
pub enum EmissionHit {
    /// Emission of the environment along `direction`, seen from `position`.
    Environment { direction: Vec3, position: Vec3 },
    /// Emission of a triangle from `position` along `direction`.
    Surface { triangle: u32, position: Vec3, direction: Vec3 },
}

/// Extension of path tracing by a method, at the vertices where light enters a path. The defaults add
/// nothing: with `()` the integrator is the plain path tracer.
pub trait LightEstimator<F: Features>: Copy + Send + Sync {
    /// State per path beside the state of the path tracer; zero at the start.
    type State: Pod;
    /// Result of the lookup for a vertex.
    type Found: Copy + Default;
    /// True if the estimator adds nothing.
    const ADDS_NOTHING: bool = false;
    /// True if the estimator looks up points whose irradiance is estimated, on surfaces and in space. Others
    /// have the light of surfaces alone, and need no look-up there.
    const LOOKS_UP_POINTS: bool = false;

    /// Maximum number of light samples per vertex.
    #[inline]
    fn light_samples(&self, _context: &SceneContext<F>) -> u32 {
        1
    }

    /// True if the coat of `bsdf` is sampled separately from its base, since the estimator supplies light of
    /// the base alone.
    #[inline]
    fn separates_coat(&self, _context: &SceneContext<F>, _bsdf: &Bsdf, _found: &Self::Found) -> bool {
        false
    }

    /// True if [`Self::weight_light`] and [`Self::scattered`] depend on the samples of `bsdf`. At other BSDFs
    /// all weights are those of plain path tracing, and vertices are shaded in lanes.
    #[inline]
    fn weighs_samples(&self, _bsdf: &Bsdf) -> bool {
        false
    }

    /// Light added to a sample of the pixel `place` of the tile, independent of the sample's path.
    #[inline]
    fn splat(&self, _place: u32) -> Rgb {
        Rgb::ZERO
    }

    /// Maximum number of shadow rays per vertex beside those of light samples.
    #[inline]
    fn connections(&self) -> u32 {
        0
    }

    /// Factor on the light that `point` reflects to the path, whose last vertex is at `from`.
    #[inline]
    fn share_left(&self, _state: &Self::State, _from: Vec3, (_point, _bsdf): (&SurfacePoint, &Bsdf)) -> f32 {
        1.0
    }

    /// Calls `push` with shadow rays from `vertex` and their unoccluded contributions to the pixel.
    #[inline]
    fn connect(
        &self,
        (_context, _settings): (&SceneContext<F>, &PathSettings),
        _vertex: &PathVertex,
        _state: &mut Self::State,
        _push: &mut impl FnMut(Ray, Rgb),
    ) {
    }

    /// Looks up the data structure for a block of surface points, the hits of the rays in `range`, before
    /// they are shaded.
    #[inline]
    fn look_up(
        &self,
        (_context, _settings): (&SceneContext<F>, &PathSettings),
        (_wave, _range): (&Wavefront, Range<usize>),
        _points: &[Option<SurfacePoint>; BLOCK],
        _found: &mut [Self::Found; BLOCK],
        _counters: &mut Counters,
    ) {
    }

    /// Calls `add` with the light supplied at `vertex`. Returns the light that the path still has to find.
    #[inline]
    fn at_vertex(
        &self,
        (_context, _settings): (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        _state: &mut Self::State,
        _found: Self::Found,
        _add: &mut impl FnMut(KnownLight),
    ) -> RemainingLight {
        RemainingLight::all(vertex)
    }

    /// MIS weight of emission hit by BSDF sampling, given its `weight` in plain path tracing.
    #[inline]
    fn weight_hit(
        &self,
        _context: &SceneContext<F>,
        _state: &Self::State,
        _hit: EmissionHit,
        weight: f32,
    ) -> f32 {
        weight
    }

    /// MIS weight of a light sample in the local direction `wi`, given its `weight` in plain path tracing.
    #[inline]
    fn weight_light(
        &self,
        _context: &SceneContext<F>,
        _vertex: &PathVertex,
        _state: &Self::State,
        (_sample, _wi): (&LightSample, Vec3),
        weight: f32,
    ) -> f32 {
        weight
    }

    /// Called when the path leaves `vertex` by `sample`, whose weight is unspecified. The flag is true for a
    /// delta lobe, and for a coat that is sampled separately.
    #[inline]
    fn scattered(
        &self,
        _context: &SceneContext<F>,
        _vertex: &PathVertex,
        _state: &mut Self::State,
        (_sample, _is_coat): (&BsdfSample, bool),
    ) {
    }
}

impl<F: Features> LightEstimator<F> for () {
    type State = ();
    type Found = ();
    const ADDS_NOTHING: bool = true;
}

/// Pair of estimators, the first of them stateless: a cache, and merging beside it.
impl<F: Features, A: LightEstimator<F, State = ()>, B: LightEstimator<F>> LightEstimator<F> for (A, B) {
    type State = B::State;
    type Found = (A::Found, B::Found);

    #[inline]
    fn light_samples(&self, context: &SceneContext<F>) -> u32 {
        self.0.light_samples(context).max(self.1.light_samples(context))
    }

    #[inline]
    fn separates_coat(&self, context: &SceneContext<F>, bsdf: &Bsdf, found: &Self::Found) -> bool {
        self.0.separates_coat(context, bsdf, &found.0) || self.1.separates_coat(context, bsdf, &found.1)
    }

    #[inline]
    fn weighs_samples(&self, bsdf: &Bsdf) -> bool {
        self.0.weighs_samples(bsdf) || self.1.weighs_samples(bsdf)
    }

    #[inline]
    fn look_up(
        &self,
        scene: (&SceneContext<F>, &PathSettings),
        (wave, range): (&Wavefront, Range<usize>),
        points: &[Option<SurfacePoint>; BLOCK],
        found: &mut [Self::Found; BLOCK],
        counters: &mut Counters,
    ) {
        let (mut first, mut second) = ([A::Found::default(); BLOCK], [B::Found::default(); BLOCK]);
        self.0.look_up(scene, (wave, range.clone()), points, &mut first, counters);
        self.1.look_up(scene, (wave, range), points, &mut second, counters);
        found.iter_mut().zip(first.into_iter().zip(second)).for_each(|(found, both)| *found = both);
    }

    #[inline]
    fn at_vertex(
        &self,
        scene: (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        state: &mut Self::State,
        found: Self::Found,
        add: &mut impl FnMut(KnownLight),
    ) -> RemainingLight {
        let rest = self.0.at_vertex(scene, vertex, &mut (), found.0, add);
        if rest.ends {
            return rest;
        }
        rest.and(self.1.at_vertex(scene, vertex, state, found.1, add))
    }

    #[inline]
    fn weight_hit(
        &self,
        context: &SceneContext<F>,
        state: &Self::State,
        hit: EmissionHit,
        weight: f32,
    ) -> f32 {
        self.1.weight_hit(context, state, hit, self.0.weight_hit(context, &(), hit, weight))
    }

    #[inline]
    fn weight_light(
        &self,
        context: &SceneContext<F>,
        vertex: &PathVertex,
        state: &Self::State,
        sample: (&LightSample, Vec3),
        weight: f32,
    ) -> f32 {
        let weight = self.0.weight_light(context, vertex, &(), sample, weight);
        self.1.weight_light(context, vertex, state, sample, weight)
    }

    #[inline]
    fn scattered(
        &self,
        context: &SceneContext<F>,
        vertex: &PathVertex,
        state: &mut Self::State,
        sample: (&BsdfSample, bool),
    ) {
        self.0.scattered(context, vertex, &mut (), sample);
        self.1.scattered(context, vertex, state, sample);
    }
}
