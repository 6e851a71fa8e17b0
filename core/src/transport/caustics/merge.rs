//! Paths merged with caustic photons: vertex merging (Georgiev et al. 2012) of light that casters send to a
//! receiver, with multiple importance sampling over all techniques that sample such light.
//!
//! Let x₀ be on a light, x₁ … x₍ⱼ₋₁₎ on casters and x = xⱼ on the first receiver, from which the path
//! continues to the camera in any way. Three techniques sample it:
//! 1. BSDF sampling of the path tracer from x to x₀;
//! 2. next-event estimation of the path tracer at x₁, if x₁ reflects into more than one direction;
//! 3. a photon from x₀, weighted at x, in the kernel at the merging vertex. This vertex is the first receiver
//!    from the camera whose kernel is wide enough: x, or a receiver that x lights.
//!
//! The path tracer alone samples all other paths, so a path has at most one merging vertex. If the camera
//! sees x, the three densities share all factors of the path behind x. Otherwise the third is computed as if
//! photons were gathered at x. A diffuse surface keeps the ratio of densities for kernels of equal size, and
//! weights are right as long as all techniques use the same. Photons are not gathered at x itself: a camera
//! path that meets x by chance would be a firefly (`docs/decisions/caustic-photons.md`).
//! A kernel much smaller than the one where their light was scattered last, as close to the camera, gathers
//! none either: each photon would be a firefly. Camera and light paths both know the two kernels, and
//! hence the merging vertex (`docs/decisions/caustic-photons.md`). With étendue instead of areas
//! (`light/emission/pdf.rs`) distances cancel, and the third density over the first is
//!
//!   R = N π r² cos θⱼ / p(xⱼ → x₍ⱼ₋₁₎) · Π ρᵢ · p(x₀) p(ω₀) / cos θ₀
//!   ρᵢ = p(x₍ᵢ₋₁₎ → xᵢ → x₍ᵢ₊₁₎) cos θ(x₍ᵢ₋₁₎) / (p(x₍ᵢ₊₁₎ → xᵢ → x₍ᵢ₋₁₎) cos θ(x₍ᵢ₊₁₎))
//!
//! for N light paths and kernels of radius r. ρ is 1 at a mirror, the squared ratio of the indices at a
//! refraction, and a ratio of densities at other casters. Both paths know all factors when they meet, so
//! neither is traced back.
//!
//! Weights follow the power heuristic. They use p(xⱼ → x₍ⱼ₋₁₎) of a diffuse surface, cos θⱼ / π, for any
//! receiver, and the radius at the photon or the point. Then R = π² r² N ..., the weight of a photon is known
//! when it is stored, its power is multiplied by the weight, and the map holds nothing but power. Photons
//! that camera paths find more easily are rarely stored. No density includes Russian roulette.
//!
//! A diffuse surface under a narrow coat counts as two: its base is a receiver, its coat a caster like rough
//! metal. Camera and light paths choose one of them at each such surface
//! (`docs/decisions/bsdfs.md`).
//!
//! With an irradiance cache, records supply light that a rough surface, metal included, sent to a point.
//! Photons supply light that came straight from a mirror or smooth glass. A light path that meets two rough
//! surfaces in succession ends, because records supply its light. A camera path gathers photons at each
//! receiver, except behind mirrors and glass at a receiver whose photons include that light.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::light::{EmissionSampler, LightSample};
use crate::photon::{Kernel, MOST_REMAINING, PhotonMap, QueryDisc, Uniform};
use crate::scene::SurfacePoint;
use crate::transport::path::PathIntegrator;
use crate::transport::path::estimator::{
    EmissionHit, KnownLight, LightEstimator, PathVertex, RemainingLight,
};
use crate::transport::path::sharing::Sharing;
use crate::transport::photon_mapping::density::{Light, RadianceEstimate, reflected};
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::settings::PathSettings;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::mis::{ChainLink, ratio_behind, weight_beside_merging};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Least radius of a kernel over the radius at the previous receiver.
const SMALLEST: f32 = 0.5;

/// True if a kernel of `radius` merges light from a receiver with kernels of radius `from`; `from` is zero
/// for light through casters alone. Otherwise a receiver closer to the light merges it.
#[inline]
pub(in crate::transport) fn is_wide_enough(radius: f32, from: f32) -> bool {
    radius >= SMALLEST * from
}

/// Caustic photons that camera paths merge with.
#[derive(Clone, Copy)]
pub struct CausticMerging<'a> {
    /// Maps of even and of odd samples.
    maps: [&'a PhotonMap<'a>; 2],
    emission: &'a EmissionSampler<'a>,
    radii: RadiusSchedule,
    /// Light paths of each map.
    paths: f32,
    /// True if records supply light that rough surfaces sent.
    beside_records: bool,
}

/// State of the search for the merging vertex of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
struct Progress(u16);

impl Progress {
    /// The merging vertex may follow.
    const LATER: Self = Self(0);
    /// The path has passed it.
    const DONE: Self = Self(1);
    /// The path has none, because light was not merged where it could have been.
    const NEVER: Self = Self(2);
    /// Photons at an earlier receiver include the light straight from a mirror. The merging vertex of other
    /// light may follow.
    const KNOWN: Self = Self(3);

    /// True if the merging vertex may follow.
    #[inline]
    fn may_come(self) -> bool {
        self == Self::LATER || self == Self::KNOWN
    }
}

/// State of a path for merging.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct MergingState {
    /// R of a path that came through casters from a receiver, without the factors of the light. Negative
    /// before the first caster; zero if photons cannot sample the path.
    ratio: f32,
    /// Kernel radius at the last receiver; zero before the first.
    radius: f32,
    /// 1 if the last vertex was a rough coat alone, which photons do not meet straight from a light.
    left_coat: u32,
    /// Search before the current vertex.
    progress: Progress,
    /// Search after the current vertex.
    here: Progress,
}

impl MergingState {
    /// R so far, for light at the end of the ray.
    #[inline]
    fn ratio_to_light(&self) -> f32 {
        if self.left_coat == 0 { self.ratio } else { 0.0 }
    }
}

impl<'a> CausticMerging<'a> {
    /// `maps` of even and odd samples from `paths` light paths each, whose photons were stored for the same
    /// kernel `radii`.
    pub fn new(
        maps: [&'a PhotonMap<'a>; 2],
        emission: &'a EmissionSampler<'a>,
        radii: RadiusSchedule,
        paths: u32,
    ) -> Self {
        Self { maps, emission, radii, paths: paths as f32, beside_records: false }
    }

    /// These photons with an irradiance cache, if `beside_records`: they then carry light straight from a
    /// mirror or smooth glass.
    pub fn beside_records(self, beside_records: bool) -> Self {
        Self { beside_records, ..self }
    }

    /// Search after the receiver at `position`, which segment number `segments` hits; `None` if it is the
    /// merging vertex. If depth `is_limited`, photons know how many segments their paths have left, up to
    /// [`MOST_REMAINING`].
    #[inline]
    fn progress_at(
        &self,
        state: &MergingState,
        position: Vec3,
        segments: u32,
        is_limited: bool,
    ) -> Option<Progress> {
        let is_first = state.radius == 0.0;
        let is_known =
            || state.progress == Progress::KNOWN || is_wide_enough(state.radius, self.radii.radius(position));
        if !is_first && (!self.beside_records || state.ratio > 0.0) && is_known() {
            return Some(if self.beside_records { Progress::KNOWN } else { Progress::DONE });
        }
        (is_limited && segments > MOST_REMAINING + 1).then_some(Progress::NEVER)
    }

    /// True if photons may pass `bsdf` to the receiver at which `ratio` starts.
    #[inline]
    fn may_come_by(&self, bsdf: &Bsdf, ratio: f32) -> bool {
        !self.beside_records || ratio >= 0.0 || bsdf.is_delta()
    }

    /// MIS weight of light that the path tracer sampled with `weight` and photons can sample too: R is
    /// `ratio` times the factors `of_light`.
    #[inline]
    fn beside_photons(&self, weight: f32, ratio: f32, of_light: impl FnOnce() -> f32) -> f32 {
        if ratio <= 0.0 || ratio.is_nan() {
            return weight;
        }
        weight_beside_merging(weight, ratio * of_light())
    }

    /// Radiance towards `wo` from the photons around `point`. `travelled` is the length of the path from the
    /// camera, or zero behind a receiver. `remaining` segments are those that the path of a photon has left
    /// at least. `rotation` is that of the boundary rays, in turns.
    #[inline]
    fn reflected<F: Features>(
        &self,
        context: &SceneContext<F>,
        (sample, remaining): (u32, u32),
        (point, bsdf): (&SurfacePoint, &Bsdf),
        (wo, travelled): (Vec3, f32),
        rotation: impl FnOnce() -> f32,
    ) -> RadianceEstimate {
        let map = &self.maps[sample as usize & 1].with_remaining(remaining);
        if map.is_empty() || !bsdf.is_receiver() {
            return RadianceEstimate::default();
        }
        let disc = QueryDisc {
            place: point.position,
            normal: point.geometric_normal,
            radius: self.radii.radius_after(travelled, point.position),
            kernel: Kernel::Epanechnikov,
        };
        // Most points have no photon in their kernel, and need no boundary rays.
        let density = map.gather(context.level, &disc, &Uniform(Rgb::ONE));
        if density.photons == 0 {
            return RadianceEstimate::default();
        }
        let light = Light { map, is_caustic: true, min_photons: f32::INFINITY };
        reflected(light, context, (&disc, Some(density)), (point, bsdf), wo, rotation())
    }
}

impl<F: Features> LightEstimator<F> for CausticMerging<'_> {
    type State = MergingState;
    type Found = ();

    #[inline]
    fn separates_coat(&self, context: &SceneContext<F>, bsdf: &Bsdf, _: &()) -> bool {
        bsdf.gathers_photons_on_base(context.separates_coats())
    }

    #[inline]
    fn weighs_samples(&self, bsdf: &Bsdf) -> bool {
        !bsdf.is_receiver()
    }

    #[inline]
    fn at_vertex(
        &self,
        (context, settings): (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        state: &mut MergingState,
        _: (),
        add: &mut impl FnMut(KnownLight),
    ) -> RemainingLight {
        let PathVertex { point, ref bsdf, wo, segments, .. } = *vertex;
        state.here = state.progress;
        if state.progress.may_come() {
            let progress = self.progress_at(state, point.position, segments, settings.is_limited());
            state.here = progress.unwrap_or(Progress::LATER);
            if progress.is_none() {
                let rotation = || vertex.sampler.single(dimension::PROBES + segments);
                let from = (wo, if state.radius == 0.0 { vertex.travelled } else { 0.0 });
                let light = (vertex.sample, settings.extra_segments(segments));
                let gathered = self.reflected(context, light, (point, bsdf), from, rotation);
                add(gathered.known(vertex));
            }
        }
        RemainingLight::all(vertex)
    }

    #[inline]
    fn weight_hit(
        &self,
        context: &SceneContext<F>,
        state: &MergingState,
        hit: EmissionHit,
        weight: f32,
    ) -> f32 {
        let SceneContext { scene, ref lights, .. } = *context;
        self.beside_photons(weight, state.ratio_to_light(), || match hit {
            EmissionHit::Environment { direction, position } => {
                self.emission.density_of_environment(scene, lights, direction, position)
            }
            EmissionHit::Surface { triangle, position, direction } => {
                self.emission.density_of_surface(scene, lights, triangle, (position, direction))
            }
        })
    }

    #[inline]
    fn weight_light(
        &self,
        context: &SceneContext<F>,
        vertex: &PathVertex,
        state: &MergingState,
        (sample, wi): (&LightSample, Vec3),
        weight: f32,
    ) -> f32 {
        let PathVertex { point, ref bsdf, wo, .. } = *vertex;
        if bsdf.is_receiver() || !self.may_come_by(bsdf, state.ratio) {
            return weight;
        }
        let link = ChainLink { point, bsdf, near: wo, far: wi, coat_alone: false };
        let to_light = link.reverse(context) / sample.pdf;
        self.beside_photons(weight, state.ratio.abs() * to_light, || {
            self.emission.density_of_sample(context.scene, &context.lights, sample, point.position)
        })
    }

    #[inline]
    fn scattered(
        &self,
        context: &SceneContext<F>,
        vertex: &PathVertex,
        state: &mut MergingState,
        (sample, is_coat): (&BsdfSample, bool),
    ) {
        let PathVertex { point, ref bsdf, wo, .. } = *vertex;
        // A coat may be sampled separately for records where photons are gathered on the whole surface.
        let coat_alone = is_coat && !sample.delta && bsdf.gathers_photons_on_base(context.separates_coats());
        let is_rough = bsdf.is_receiver() && !sample.delta && !coat_alone;
        if is_rough {
            (state.progress, state.radius) = (state.here, self.radii.radius(point.position));
        }
        state.left_coat = u32::from(coat_alone);
        state.ratio = match state.ratio {
            _ if is_rough && state.here != Progress::NEVER => {
                -self.radii.merge_factor(point.position, self.paths)
            }
            _ if is_rough => 0.0,
            ratio if ratio == 0.0 || !self.may_come_by(bsdf, ratio) => 0.0,
            ratio => {
                let link = ChainLink { point, bsdf, near: wo, far: sample.direction, coat_alone };
                // Light paths use the usual probability of the coat, so both densities do.
                let pdf = match coat_alone {
                    true => bsdf.evaluate_apart::<F>(wo, sample.direction, 1.0)[1].1,
                    false => sample.pdf,
                };
                ratio_behind(ratio.abs(), &link, &BsdfSample { pdf, ..*sample }, context)
            }
        };
    }
}

impl<'a, F: Features, E: LightEstimator<F, State = ()>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// This path tracer, merged with caustic photons.
    pub fn with_caustics(
        &self,
        merging: CausticMerging<'a>,
    ) -> PathIntegrator<'a, F, (E, CausticMerging<'a>), R> {
        self.with_estimator((self.estimator, merging))
    }
}
