//! Paths joined with photons of caustics: vertex merging (Georgiev et al. 2012) for light that comes to a rough surface
//! by mirrors and glass, and multiple importance sampling over all that finds such light.
//!
//! Let x₀ be on a light, x₁ … x₍ⱼ₋₁₎ on surfaces that are not rough, x = xⱼ the first rough one, behind which the path
//! goes on to the eye in whatever way. It can be found
//! 1. by the path tracer, which goes from x by chance to x₀;
//! 2. by the path tracer, which goes to x₁ and chooses x₀, where x₁ reflects into more than one direction;
//! 3. by a photon that comes from x₀ by way of x, where it has its weight from, and lies within a disc around the first
//!    rough surface on the way from the eye, x, or one that x lights; or the first whose disc is wide enough.
//!
//! Every other path is found by the path tracer alone. So a path has one vertex at most at which it can be merged. Where the
//! eye sees x, it has three densities, which have all that lies behind x in common. Else the third is reckoned as if photons
//! were gathered at x: with discs of one size it is the same, as a diffuse surface leaves the ratio of both as it is, and
//! weights are right as long as all agree on them. But gathered they are not at x, which paths from the eye may meet so rarely
//! that each that does would be a spike (`docs/decisions/0042-photons-past-the-first-receiver.md`). Nor is light gathered on a disc much
//! smaller than that where it comes from, as right before the eye: there each photon would be one. Both ends know these two
//! discs, and so where the one vertex is (`docs/decisions/0045-kernel-radii.md`). With étendue in place of areas
//! (`light/emission/pdf.rs`) distances cancel, and the third over the first is
//!
//!   R = N π r² cos θⱼ / p(xⱼ → x₍ⱼ₋₁₎) · Π ρᵢ · p(x₀) p(ω₀) / cos θ₀
//!   ρᵢ = p(x₍ᵢ₋₁₎ → xᵢ → x₍ᵢ₊₁₎) cos θ(x₍ᵢ₋₁₎) / (p(x₍ᵢ₊₁₎ → xᵢ → x₍ᵢ₋₁₎) cos θ(x₍ᵢ₊₁₎))
//!
//! of N light paths and discs of radius r. At a mirror ρ = 1; where light is refracted, the squared ratio of the
//! indices; elsewhere densities of both ways. Both ends know all of it when they meet: nobody needs to be traced back.
//!
//! Weights are those of the power heuristic. For them p(xⱼ → x₍ⱼ₋₁₎) is that of a diffuse surface, cos θⱼ / π, whatever
//! else x reflects, and r is that of the place of the photon, or of the point. So R = π² r² N ..., the weight of a
//! photon is known when it is left, its power is multiplied with it, and a map needs no more than power. Photons that
//! paths find more easily are hardly ever left. Ends of paths by roulette count for none of the densities.
//!
//! A diffuse surface under a narrow coat is two: its base is rough, its coat a link of the chain like rough metal. Paths and light
//! paths choose one of them at each such surface (`docs/decisions/0069-coats-as-layers.md`).
//!
//! Beside an irradiance cache photons have less to do: a record knows all that something rough, be it metal, sent to a point,
//! and photons only what came there straight from a mirror or smooth glass. A light path that meets two rough surfaces after
//! each other ends, as its light is the record's. A path from the eye asks photons at each rough surface, but for those to
//! which mirrors and glass lead from one whose photons know them.

use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::light::EmissionSampler;
use crate::photon::{Kernel, PhotonMap, QueryDisc, Uniform};
use crate::scene::SurfacePoint;
use crate::transport::path::state::{MergeState, PathState};
use crate::transport::photon_mapping::density::{Gathered, Light, reflected};
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::walk::context::SceneContext;
use glam::Vec3;

/// The least that the radius of a disc may be, times that of the disc from where something rough throws the light.
const SMALLEST: f32 = 0.5;

/// Whether light is merged on a disc of `radius` that comes from a rough surface with discs of radius `from`, or, where that is
/// zero, by mirrors and glass alone. If not, it is merged there, or still before.
#[inline]
pub(in crate::transport) fn is_wide_enough(radius: f32, from: f32) -> bool {
    radius >= SMALLEST * from
}

/// Photons of caustics as paths from the eye use them.
#[derive(Clone, Copy)]
pub struct CausticMerging<'a> {
    /// Of even and of odd samples.
    maps: [&'a PhotonMap<'a>; 2],
    pub(in crate::transport) emission: &'a EmissionSampler<'a>,
    discs: RadiusSchedule,
    /// Light paths of each map.
    paths: f32,
    /// Whether records have the light that something rough sent.
    beside_records: bool,
}

/// A surface of a chain: where light goes from `far`, the side of the light, to `near`, the side of the eye.
pub(in crate::transport) struct ChainLink<'p> {
    pub(in crate::transport) point: &'p SurfacePoint<'p>,
    /// As seen from one of the two.
    pub(in crate::transport) bsdf: &'p Bsdf,
    /// The one from which it is seen; local, as `far`.
    pub(in crate::transport) near: Vec3,
    pub(in crate::transport) far: Vec3,
    /// By its coat alone.
    pub(in crate::transport) coat_alone: bool,
}

impl ChainLink<'_> {
    /// The density with which who comes from `far` goes on to `near`, times the ratio of the cosines of `far` and of
    /// `near`. Over the density of the other way it is ρ.
    pub(in crate::transport) fn reverse<F: Features>(&self, context: &SceneContext<F>) -> f32 {
        self.density(context) * (self.far.z / self.near.z).abs()
    }

    /// The density alone.
    pub(in crate::transport) fn density<F: Features>(&self, context: &SceneContext<F>) -> f32 {
        let Self { point, bsdf, near, far, coat_alone } = *self;
        if F::GLOSSY && coat_alone {
            return bsdf.evaluate_apart::<F>(far, near)[1].1;
        }
        if far.z > 0.0 {
            return bsdf.evaluate::<F>(far, near).1;
        }
        let turned = |way: Vec3| Vec3::new(way.x, way.y, -way.z);
        let behind = Bsdf::at::<F>(context.scene, point.material, point.uv, !point.front);
        behind.evaluate::<F>(turned(far), turned(near)).1
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

    /// The same, where an irradiance cache may have the light that something rough sent to a point. Photons are then of what
    /// comes straight from a mirror or smooth glass.
    pub fn beside_records(self, beside_records: bool) -> Self {
        Self { beside_records, ..self }
    }

    /// What becomes of the one vertex at which `path` can be merged, now that it meets the rough surface at `place` in its
    /// segment number `segments`: `None` where photons are to be asked there. Beside records they may know what comes
    /// straight from a mirror, and of that all that came to the surfaces before it.
    ///
    /// Where depth `is_limited` that is the first surface alone, for photons do not know how far they are from their light.
    #[inline]
    pub(in crate::transport) fn met(
        &self,
        path: &PathState,
        place: Vec3,
        segments: u32,
        is_limited: bool,
    ) -> Option<MergeState> {
        let is_first = path.disc == 0.0;
        let is_known = || {
            is_limited || path.merged == MergeState::KNOWN || is_wide_enough(path.disc, self.radius(place))
        };
        if !is_first && (!self.beside_records || path.chain > 0.0) && is_known() {
            return Some(if self.beside_records { MergeState::KNOWN } else { MergeState::DONE });
        }
        (segments > 1 && is_limited).then_some(MergeState::NEVER)
    }

    /// Whether photons may come by `bsdf` to where a path has its `chain` from.
    #[inline]
    pub(in crate::transport) fn may_come_by(&self, bsdf: &Bsdf, chain: f32) -> bool {
        !self.beside_records || chain >= 0.0 || bsdf.is_delta()
    }

    /// The radius of discs around `place`.
    #[inline]
    pub(in crate::transport) fn radius(&self, place: Vec3) -> f32 {
        self.discs.radius(place)
    }

    /// R as far as a path knows it that begins its chain at `place`.
    #[inline]
    pub(in crate::transport) fn begun(&self, place: Vec3) -> f32 {
        self.discs.reach(place, self.paths)
    }

    /// The `weight` of what the path tracer found, where photons might have found it as well: R is `chain` times what
    /// the light has to do with it. No chain, no photons.
    #[inline]
    pub(in crate::transport) fn beside_photons(
        &self,
        weight: f32,
        chain: f32,
        of_light: impl FnOnce() -> f32,
    ) -> f32 {
        if chain <= 0.0 || chain.is_nan() {
            return weight;
        }
        let ratio = chain * of_light();
        weight / (1.0 + weight * ratio * ratio)
    }

    /// What `point` sends to `wo` of the light of photons around it, at the end of a path that has come so far from the eye, or
    /// zero where something rough has thrown it on. `turns` turns the probes for walls.
    #[inline]
    pub(in crate::transport) fn reflected<F: Features>(
        &self,
        context: &SceneContext<F>,
        sample: u32,
        (point, bsdf): (&SurfacePoint, &Bsdf),
        (wo, travelled): (Vec3, f32),
        turns: impl FnOnce() -> f32,
    ) -> Gathered {
        let map = self.maps[sample as usize & 1];
        if map.is_empty() || !bsdf.is_receiver() {
            return Gathered::default();
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
            return Gathered::default();
        }
        let light = Light { map, is_caustic: true, enough: f32::INFINITY };
        reflected(light, context, (&disc, Some(density)), (point, bsdf), wo, turns())
    }
}
