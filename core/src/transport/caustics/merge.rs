//! Paths joined with photons of caustics: vertex merging (Georgiev et al. 2012) for light that comes to a
//! rough surface by mirrors and glass, and multiple importance sampling over all that finds such light.
//!
//! Let x₀ be on a light, x₁ … x₍ⱼ₋₁₎ on surfaces that are not rough, x = xⱼ the first rough one, behind which
//! the path goes on to the eye in whatever way. It can be found
//! 1. by the path tracer, which goes from x by chance to x₀;
//! 2. by the path tracer, which goes to x₁ and chooses x₀, where x₁ reflects into more than one direction;
//! 3. by a photon that comes from x₀ by way of x, where it has its weight from, and lies within a disc around
//!    the first rough surface on the way from the eye, x, or one that x lights; or the first whose disc is
//!    wide enough.
//!
//! Every other path is found by the path tracer alone. So a path has one vertex at most at which it can be
//! merged. Where the eye sees x, it has three densities, which have all that lies behind x in common. Else
//! the third is reckoned as if photons were gathered at x: with discs of one size it is the same, as a
//! diffuse surface leaves the ratio of both as it is, and weights are right as long as all agree on them. But
//! gathered they are not at x, which paths from the eye may meet so rarely that each that does would be a
//! spike (`docs/decisions/0042-photons-past-the-first-receiver.md`). Nor is light gathered on a disc much
//! smaller than that where it comes from, as right before the eye: there each photon would be one. Both ends
//! know these two discs, and so where the one vertex is (`docs/decisions/0045-kernel-radii.md`). With étendue
//! in place of areas (`light/emission/pdf.rs`) distances cancel, and the third over the first is
//!
//!   R = N π r² cos θⱼ / p(xⱼ → x₍ⱼ₋₁₎) · Π ρᵢ · p(x₀) p(ω₀) / cos θ₀
//!   ρᵢ = p(x₍ᵢ₋₁₎ → xᵢ → x₍ᵢ₊₁₎) cos θ(x₍ᵢ₋₁₎) / (p(x₍ᵢ₊₁₎ → xᵢ → x₍ᵢ₋₁₎) cos θ(x₍ᵢ₊₁₎))
//!
//! of N light paths and discs of radius r. At a mirror ρ = 1; where light is refracted, the squared ratio of
//! the indices; elsewhere densities of both ways. Both ends know all of it when they meet: nobody needs to be
//! traced back.
//!
//! Weights are those of the power heuristic. For them p(xⱼ → x₍ⱼ₋₁₎) is that of a diffuse surface, cos θⱼ /
//! π, whatever else x reflects, and r is that of the place of the photon, or of the point. So R = π² r² N
//! ..., the weight of a photon is known when it is left, its power is multiplied with it, and a map needs no
//! more than power. Photons that paths find more easily are hardly ever left. Ends of paths by roulette count
//! for none of the densities.
//!
//! A diffuse surface under a narrow coat is two: its base is rough, its coat a link of the chain like rough
//! metal. Paths and light paths choose one of them at each such surface
//! (`docs/decisions/0069-coats-as-layers.md`).
//!
//! Beside an irradiance cache photons have less to do: a record knows all that something rough, be it metal,
//! sent to a point, and photons only what came there straight from a mirror or smooth glass. A light path
//! that meets two rough surfaces after each other ends, as its light is the record's. A path from the eye
//! asks photons at each rough surface, but for those to which mirrors and glass lead from one whose photons
//! know them.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::light::{EmissionSampler, LightSample};
use crate::photon::{Kernel, PhotonMap, QueryDisc, Uniform};
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

/// The least that the radius of a disc may be, times that of the disc from where something rough throws the
/// light.
const SMALLEST: f32 = 0.5;

/// Whether light is merged on a disc of `radius` that comes from a rough surface with discs of radius `from`,
/// or, where that is zero, by mirrors and glass alone. If not, it is merged there, or still before.
#[inline]
pub(in crate::transport) fn is_wide_enough(radius: f32, from: f32) -> bool {
    radius >= SMALLEST * from
}

/// Photons of caustics as paths from the eye use them.
#[derive(Clone, Copy)]
pub struct CausticMerging<'a> {
    /// Of even and of odd samples.
    maps: [&'a PhotonMap<'a>; 2],
    emission: &'a EmissionSampler<'a>,
    discs: RadiusSchedule,
    /// Light paths of each map.
    paths: f32,
    /// Whether records have the light that something rough sent.
    beside_records: bool,
}

/// What became of the one vertex of a path at which it can be merged with photons of caustics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
struct Progress(u16);

impl Progress {
    /// It may be still to come.
    const LATER: Self = Self(0);
    /// It is behind the path.
    const DONE: Self = Self(1);
    /// There is none: light was not merged where it might have been.
    const NEVER: Self = Self(2);
    /// Photons at a surface before know the light straight from a mirror; of other light the vertex may be
    /// still to come.
    const KNOWN: Self = Self(3);

    /// Whether it may be still to come.
    #[inline]
    fn may_come(self) -> bool {
        self == Self::LATER || self == Self::KNOWN
    }
}

/// What merging adds to the state of a path.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct MergingState {
    /// R of a path that came by specular surfaces from a rough one, except the factors of the light. Negative
    /// on the way to the first specular surface; zero where photons could not find the path.
    ratio: f32,
    /// Kernel radius at the last rough surface; zero before the first.
    radius: f32,
    /// 1 where the last vertex was a rough coat alone, which photons do not meet straight from a light.
    left_coat: u32,
    /// Whether photons are still to be merged, behind the rough surfaces that the path has left,
    progress: Progress,
    /// and with the vertex that it is about to leave.
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
    /// `maps` for even and odd samples, of `paths` light paths each, which were left for the same `discs`.
    pub fn new(
        maps: [&'a PhotonMap<'a>; 2],
        emission: &'a EmissionSampler<'a>,
        discs: RadiusSchedule,
        paths: u32,
    ) -> Self {
        Self { maps, emission, discs, paths: paths as f32, beside_records: false }
    }

    /// The same, where an irradiance cache may have the light that something rough sent to a point. Photons
    /// are then of what comes straight from a mirror or smooth glass.
    pub fn beside_records(self, beside_records: bool) -> Self {
        Self { beside_records, ..self }
    }

    /// What becomes of the one vertex at which a path can be merged, where it meets the rough surface at
    /// `position` in its segment number `segments`: `None` where photons are to be asked there. Beside
    /// records they may know what comes straight from a mirror, and of that all that came to the surfaces
    /// before it.
    ///
    /// Where depth `is_limited` that is the first surface alone, for photons do not know how far they are
    /// from their light.
    #[inline]
    fn met(&self, state: &MergingState, position: Vec3, segments: u32, is_limited: bool) -> Option<Progress> {
        let is_first = state.radius == 0.0;
        let is_known = || {
            is_limited
                || state.progress == Progress::KNOWN
                || is_wide_enough(state.radius, self.discs.radius(position))
        };
        if !is_first && (!self.beside_records || state.ratio > 0.0) && is_known() {
            return Some(if self.beside_records { Progress::KNOWN } else { Progress::DONE });
        }
        (segments > 1 && is_limited).then_some(Progress::NEVER)
    }

    /// Whether photons may come by `bsdf` to where a path has its `ratio` from.
    #[inline]
    fn may_come_by(&self, bsdf: &Bsdf, ratio: f32) -> bool {
        !self.beside_records || ratio >= 0.0 || bsdf.is_delta()
    }

    /// The `weight` of light that path tracing found, where photons might have found it as well: R is `ratio`
    /// times the factors `of_light`.
    #[inline]
    fn beside_photons(&self, weight: f32, ratio: f32, of_light: impl FnOnce() -> f32) -> f32 {
        if ratio <= 0.0 || ratio.is_nan() {
            return weight;
        }
        weight_beside_merging(weight, ratio * of_light())
    }

    /// What `point` sends to `wo` of the light of photons around it, at the end of a path that has come so
    /// far from the eye, or zero where something rough has thrown it on. `turns` turns the probes for walls.
    #[inline]
    fn reflected<F: Features>(
        &self,
        context: &SceneContext<F>,
        sample: u32,
        (point, bsdf): (&SurfacePoint, &Bsdf),
        (wo, travelled): (Vec3, f32),
        turns: impl FnOnce() -> f32,
    ) -> RadianceEstimate {
        let map = self.maps[sample as usize & 1];
        if map.is_empty() || !bsdf.is_receiver() {
            return RadianceEstimate::default();
        }
        let disc = QueryDisc {
            place: point.position,
            normal: point.geometric_normal,
            radius: self.discs.radius_after(travelled, point.position),
            kernel: Kernel::Epanechnikov,
        };
        // Most places have no photon near them, and need not look for walls.
        let density = map.gather(context.level, &disc, &Uniform(Rgb::ONE));
        if density.photons == 0 {
            return RadianceEstimate::default();
        }
        let light = Light { map, is_caustic: true, min_photons: f32::INFINITY };
        reflected(light, context, (&disc, Some(density)), (point, bsdf), wo, turns())
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
            let met = self.met(state, point.position, segments, settings.is_limited());
            state.here = met.unwrap_or(Progress::LATER);
            if met.is_none() {
                let turns = || vertex.sampler.single(dimension::PROBES + segments);
                let from = (wo, if state.radius == 0.0 { vertex.travelled } else { 0.0 });
                let gathered = self.reflected(context, vertex.sample, (point, bsdf), from, turns);
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
        let SceneContext { scene, lights, .. } = *context;
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
            self.emission.density_of_sample(context.scene, context.lights, sample, point.position)
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
            (state.progress, state.radius) = (state.here, self.discs.radius(point.position));
        }
        state.left_coat = u32::from(coat_alone);
        state.ratio = match state.ratio {
            _ if is_rough && state.here != Progress::NEVER => {
                -self.discs.merge_factor(point.position, self.paths)
            }
            _ if is_rough => 0.0,
            ratio if ratio == 0.0 || !self.may_come_by(bsdf, ratio) => 0.0,
            ratio => {
                let link = ChainLink { point, bsdf, near: wo, far: sample.direction, coat_alone };
                // Light paths know the usual probability of the coat, which both densities have to use.
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
    /// The same, merged with photons of caustics.
    pub fn with_caustics(
        &self,
        merging: CausticMerging<'a>,
    ) -> PathIntegrator<'a, F, (E, CausticMerging<'a>), R> {
        self.with_estimator((self.estimator, merging))
    }
}
