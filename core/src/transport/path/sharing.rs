//! Which pixels receive the light that a path finds: its own, with `()`, or others too (`reuse.rs`).

use super::wave::PathWave;
use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::wavefront::PathState;
use bytemuck::{Pod, Zeroable};

/// The rule by which pixels receive light. By the defaults each has that of its own path.
pub trait Sharing: Copy + Send + Sync {
    /// Carried by each path.
    type State: Pod;
    /// A pair of paths, one of which receives light of the other.
    type Pair: Pod;
    /// Whether the pixels of a circle are sampled together.
    const IN_CIRCLES: bool = false;

    /// State of a path at its start. The paths of a circle have one number in common.
    #[inline]
    fn begin(_circle: u32) -> Self::State {
        Self::State::zeroed()
    }

    /// The ray of `path` was traced; the light samples of its last vertex have arrived.
    #[inline]
    fn resume(_state: &mut Self::State, _path: &mut PathState) {}

    /// The path is about to scatter at `point`.
    #[inline]
    fn arrive(_state: &mut Self::State, _point: &SurfacePoint, _bsdf: &Bsdf, _path: &mut PathState) {}

    /// The path takes a light sample. `base` is the part that the base of the surface reflects.
    #[inline]
    fn sample_light(_state: &mut Self::State, _base: impl FnOnce() -> Rgb) {}

    /// The path samples a direction. `base` is the part that the base of the surface reflects.
    #[inline]
    fn sample_bsdf(_state: &mut Self::State, _base: impl FnOnce() -> Rgb) {}

    /// The path leaves `point` with this `throughput`. Whether it must survive.
    #[inline]
    fn leave(
        _state: &mut Self::State,
        (_point, _bsdf): (&SurfacePoint, &Bsdf),
        _throughput: Rgb,
        _segments: u32,
    ) -> bool {
        false
    }

    /// The factor from radiance to the pixel for a path of this `throughput`.
    #[inline]
    fn worth(_state: &Self::State, throughput: Rgb) -> Rgb {
        throughput
    }

    /// Adds `light` that belongs to the pixel of `path` alone.
    #[inline]
    fn keep(_state: &mut Self::State, path: &mut PathState, light: Rgb) {
        path.add(light);
    }

    /// Radiance of the sample, after [`Sharing::share`].
    #[inline]
    fn radiance(_state: &Self::State, path: &PathState) -> Rgb {
        Rgb::from(path.radiance)
    }

    /// Gives other pixels their shares of the light of the first `count` paths, which have ended. Only paths
    /// of equal length share where depth `is_limited`.
    #[inline]
    fn share<F: Features, S>(
        &self,
        (_context, _is_limited): (&SceneContext<F>, bool),
        _wave: &mut PathWave<S, Self>,
        _count: usize,
        _counters: &mut Counters,
    ) {
    }
}

impl Sharing for () {
    type State = ();
    type Pair = ();
}
