//! The pixels that receive the light of a path: its own, with `()`, or others too (`reuse.rs`); and the
//! working memory of the path tracer, which holds the state of such a rule beside the wavefront.

use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::wavefront::{PathState, Wavefront};
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

    /// Whether an estimator may connect the vertex that the path has arrived at.
    #[inline]
    fn may_connect(_state: &Self::State) -> bool {
        true
    }

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

/// A wavefront, with an estimator's state `S` of each path and the working memory of sharing.
pub struct PathWave<'m, S, R: Sharing> {
    pub(in crate::transport) wave: Wavefront<'m>,
    pub(in crate::transport) memory: PathMemory<'m, S, R>,
}

/// The part of the memory that the wavefront does not know. Slices are empty where there is no state.
pub(in crate::transport) struct PathMemory<'m, S, R: Sharing> {
    pub(in crate::transport) states: &'m mut [S],
    pub(in crate::transport) shared: &'m mut [R::State],
    pub(in crate::transport) pairs: &'m mut [R::Pair],
}

impl<'m, S: Pod, R: Sharing> PathWave<'m, S, R> {
    /// Bytes that [`PathWave::new`] takes.
    pub(in crate::transport) fn footprint(capacity: usize) -> Footprint {
        let paths = Wavefront::capacity(capacity);
        Wavefront::footprint(capacity).slice::<S>(paths).slice::<R::State>(paths).slice::<R::Pair>(paths)
    }

    /// An empty wave of `capacity` paths.
    pub(in crate::transport) fn new(capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let paths = Wavefront::capacity(capacity);
        let wave = Wavefront::new(capacity, arena)?;
        let (states, shared) = (slice(paths, arena)?, slice(paths, arena)?);
        Ok(Self { wave, memory: PathMemory { states, shared, pairs: slice(paths, arena)? } })
    }

    /// Radiance of the sample of path number `path`.
    #[inline]
    pub(in crate::transport) fn radiance(&self, path: usize) -> Rgb {
        let none = R::State::zeroed();
        R::radiance(self.memory.shared.get(path).unwrap_or(&none), &self.wave.paths[path])
    }

    /// Resets what is beside the wavefront for path number `path`, of this circle.
    #[inline]
    pub(in crate::transport) fn begin(&mut self, path: usize, circle: u32) {
        let PathMemory { states, shared, .. } = &mut self.memory;
        if let Some(state) = states.get_mut(path) {
            *state = S::zeroed();
        }
        if let Some(state) = shared.get_mut(path) {
            *state = R::begin(circle);
        }
    }
}

/// A slice of `count` values; an empty one of values without size.
fn slice<'m, T: Pod>(count: usize, arena: &mut Arena<'m>) -> Result<&'m mut [T], OutOfMemory> {
    if size_of::<T>() == 0 { Ok(&mut []) } else { arena.slice(count) }
}
