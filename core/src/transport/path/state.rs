//! The working memory of a wavefront: the state of every path of the wave, and queues of rays.

use crate::Rgb;
use crate::bsdf::Bsdf;
use crate::film::CIRCLE;
use crate::geometry::{Hit, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::Sampler;
use crate::transport::estimator::{Counters, MAX_CROSSINGS};
use crate::transport::path::reuse::{Connection, ReuseState};
use crate::transport::photon_mapping::density::Gathered;
use bytemuck::{Pod, Zeroable};

/// A path between two of its vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(in crate::transport) struct PathState {
    /// β: what radiance at the end of the ray is worth in the pixel.
    pub(in crate::transport) throughput: [f32; 3],
    /// Density in solid angle with which the ray was chosen; infinite where no other technique could.
    pub(in crate::transport) pdf: f32,
    /// L: what the path has gathered.
    pub(in crate::transport) radiance: [f32; 3],
    /// What photons blur of it.
    pub(in crate::transport) blur: [f32; 3],
    /// Which pixel of the picture.
    pub(in crate::transport) pixel: u32,
    /// The last vertex at which the path was scattered.
    pub(in crate::transport) position: [f32; 3],
    /// Which pixel of the tile.
    pub(in crate::transport) place: u32,
    /// Which sample of the pixel.
    pub(in crate::transport) sample: u32,
    /// The normal there, as the light sampling knows it.
    pub(in crate::transport) normal: [f32; 3],
    /// Segments traced, the one under way included.
    pub(in crate::transport) segments: u16,
    /// Surfaces passed through by cut-out.
    pub(in crate::transport) crossings: u16,
    /// The triangle that the ray starts on, which it cannot meet again.
    pub(in crate::transport) triangle: u32,
    /// Product of the squared relative indices of refraction passed so far.
    pub(in crate::transport) eta_squared: f32,
    /// What of the light at the end of the ray belongs to the path.
    pub(in crate::transport) share: Components,
    /// Of a path that came by mirrors and glass from a rough surface: how much denser photons come from a light to
    /// there than paths from there to the light, but for what the light has to do with it ([`crate::transport::caustics::merge`]). Negative
    /// on the way to the first mirror or glass; zero where photons could not find the path.
    pub(in crate::transport) chain: f32,
    /// Points of lights that it asks for direct light where a shadow ray alone finds that; 0 stands for one.
    pub(in crate::transport) lights: u16,
    /// Whether photons are still to be asked, behind the rough surfaces that it has left.
    pub(in crate::transport) merged: MergeState,
    /// The radius of discs at the last of them; zero before the first.
    pub(in crate::transport) disc: f32,
    /// How long it is from the eye to its last vertex.
    pub(in crate::transport) travelled: f32,
    /// 1 where that was a rough coat alone, by which photons do not come straight from a light.
    pub(in crate::transport) left_coat: u32,
}

impl PathState {
    /// Its chain, as light at the end of the ray knows it.
    #[inline]
    pub(in crate::transport) fn chain_to_light(&self) -> f32 {
        if self.left_coat == 0 { self.chain } else { 0.0 }
    }

    #[inline]
    pub(in crate::transport) fn add(&mut self, radiance: Rgb) {
        self.radiance = (Rgb::from(self.radiance) + radiance).to_array();
    }

    #[inline]
    pub(in crate::transport) fn gather(
        &mut self,
        throughput: Rgb,
        exchange: &mut ReuseState,
        Gathered { light, blur }: Gathered,
    ) {
        // It is for this path alone: others have asked photons where they are.
        exchange.keep(self, throughput * light);
        self.blur = (Rgb::from(self.blur) + exchange.worth(throughput) * blur).to_array();
    }

    /// Random numbers for one of the points of lights that it asks where it ends: those of all its pixel's are a net.
    #[inline]
    pub(in crate::transport) fn part(&self, seed: u32, part: u32) -> Sampler {
        let index = (self.sample >> 1).wrapping_mul(self.lights.into()).wrapping_add(part);
        Sampler::replicate(seed, self.pixel, self.sample & 1, index)
    }

    /// Goes on behind the triangle of `hit` as if it were not there.
    #[cold]
    pub(in crate::transport) fn cross(
        &mut self,
        next: Ray,
        hit: &Hit,
        counters: &mut Counters,
    ) -> Option<Ray> {
        if u32::from(self.crossings) >= MAX_CROSSINGS {
            counters.dropped.unfinished += 1;
            return None;
        }
        self.crossings += 1;
        self.triangle = hit.triangle;
        Some(next)
    }
}

/// What became of the one vertex of a path at which a photon of caustics can be merged with it ([`crate::transport::caustics::merge`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(in crate::transport) struct MergeState(u16);

impl MergeState {
    /// It may be still to come.
    pub(in crate::transport) const LATER: MergeState = MergeState(0);
    /// Photons were asked.
    pub(in crate::transport) const DONE: MergeState = MergeState(1);
    /// They were not, and will not be.
    pub(in crate::transport) const NEVER: MergeState = MergeState(2);
    /// Photons at a surface before know what comes straight from a mirror; of other light it may be still to come.
    pub(in crate::transport) const KNOWN: MergeState = MergeState(3);

    /// Whether it may be still to come.
    #[inline]
    pub(in crate::transport) fn may_come(self) -> bool {
        self == Self::LATER || self == Self::KNOWN
    }
}

/// Light that comes to a diffuse point is either direct, from emitters and from what mirrors or refracts them; or it
/// was reflected by something rough. A cache knows the second, so that a path from there is to find the first only;
/// rays that gather for the cache the other way round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(in crate::transport) struct Components(u32);

impl Components {
    pub(in crate::transport) const ALL: Components = Components(0);
    pub(in crate::transport) const DIRECT: Components = Components(1);
    pub(in crate::transport) const REFLECTED: Components = Components(2);
    /// Light straight from emitters: photons have the rest.
    pub(in crate::transport) const EMITTED: Components = Components(3);
    /// With photon maps: all but caustics. From a surface with a diffuse part; what is next that has one may end the path.
    pub(in crate::transport) const NO_CAUSTIC: Components = Components(4);
    /// The same behind a mirror or glass, where emitters are caustics.
    pub(in crate::transport) const BEHIND_MIRROR: Components = Components(5);
    /// With photon maps: all light, but the next surface with a diffuse part may end the path.
    pub(in crate::transport) const GATHERED: Components = Components(6);
    /// All light but that of the lamp which a camera ray meets: its pixel has that from rays of their own.
    pub(in crate::transport) const BESIDE_LAMP: Components = Components(7);
    /// All light but that of emitters which the eye sees, itself or by mirrors and glass.
    pub(in crate::transport) const UNSEEN: Components = Components(8);

    /// Whether what `bsdf` reflects or transmits belongs to the other share.
    #[inline]
    pub(in crate::transport) fn ends_at(self, bsdf: &Bsdf) -> bool {
        match self {
            Self::EMITTED => true,
            Self::DIRECT => !bsdf.is_delta(),
            Self::REFLECTED => bsdf.is_delta(),
            _ => false,
        }
    }

    /// Whether what a rough surface reflects belongs to it.
    #[inline]
    pub(in crate::transport) fn goes_on_from_rough(self) -> bool {
        self != Self::EMITTED && self != Self::DIRECT
    }

    /// What belongs to the path behind `bsdf`, if nobody says otherwise.
    #[inline]
    pub(in crate::transport) fn behind(self, bsdf: &Bsdf) -> Self {
        if self == Self::UNSEEN && bsdf.is_delta() { self } else { Self::ALL }
    }

    /// Whether light of emitters at the end of the ray belongs to it.
    #[inline]
    pub(in crate::transport) fn sees_emitters(self) -> bool {
        self != Self::REFLECTED && self != Self::BEHIND_MIRROR && self != Self::UNSEEN
    }

    /// The same of surfaces that emit.
    #[inline]
    pub(in crate::transport) fn sees_lamps(self) -> bool {
        self.sees_emitters() && self != Self::BESIDE_LAMP
    }

    /// Whether the path may end in a map of photons.
    #[inline]
    pub(in crate::transport) fn gathers(self) -> bool {
        matches!(self, Self::REFLECTED | Self::NO_CAUSTIC | Self::BEHIND_MIRROR | Self::GATHERED)
    }
}

/// Slices for up to `capacity` paths. Rays know their path by their tag.
pub(in crate::transport) struct Wavefront<'m> {
    pub(in crate::transport) paths: &'m mut [PathState],
    /// What the paths share with their neighbours.
    pub(in crate::transport) exchanges: &'m mut [ReuseState],
    pub(in crate::transport) pairs: &'m mut [Connection],
    pub(in crate::transport) rays: &'m mut [Ray],
    pub(in crate::transport) hits: &'m mut [Hit],
    pub(in crate::transport) shadow_rays: &'m mut [Ray],
    /// What arrives at the camera from the light at the end of the shadow ray.
    pub(in crate::transport) shadow_light: &'m mut [[f32; 3]],
    pub(in crate::transport) hidden: &'m mut [u8],
}

impl<'m> Wavefront<'m> {
    /// `capacity` paths, or the fewest that can share.
    pub(in crate::transport) fn footprint(capacity: usize) -> Footprint {
        let capacity = capacity.max(CIRCLE);
        Footprint::default()
            .slice::<PathState>(capacity)
            .slice::<ReuseState>(capacity)
            .slice::<Connection>(capacity)
            .slice::<Ray>(capacity)
            .slice::<Hit>(capacity)
            .slice::<Ray>(capacity)
            .slice::<[f32; 3]>(capacity)
            .slice::<u8>(capacity)
    }

    pub(in crate::transport) fn new(capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let capacity = capacity.max(CIRCLE);
        Ok(Self {
            paths: arena.slice(capacity)?,
            exchanges: arena.slice(capacity)?,
            pairs: arena.slice(capacity)?,
            rays: arena.slice(capacity)?,
            hits: arena.slice(capacity)?,
            shadow_rays: arena.slice(capacity)?,
            shadow_light: arena.slice(capacity)?,
            hidden: arena.slice(capacity)?,
        })
    }
}
