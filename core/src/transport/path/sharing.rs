//! Rule for the pixels that receive the light of a path: its own alone with `()`, or neighbours too
//! (`reuse.rs`); and the working memory of the path tracer, with the states of the rule and of the estimator
//! beside the wavefront.

use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::wavefront::{PathState, Wavefront};
use bytemuck::{Pod, Zeroable};

/// Sharing rule of the light of paths. Each pixel receives the light of its own path by default.
pub trait Sharing: Copy + Send + Sync {
    /// State per path.
    type State: Pod;
    /// Pair of paths, one of which receives light of the other.
    type Pair: Pod;
    /// True if the pixels of a circle are sampled together.
    const IN_CIRCLES: bool = false;

    /// State at the start of a path. All paths of a circle have the same number `circle`.
    #[inline]
    fn begin(_circle: u32) -> Self::State {
        Self::State::zeroed()
    }

    /// Called after the next ray of `path` was traced and the light samples of its last vertex have arrived.
    #[inline]
    fn resume(_state: &mut Self::State, _path: &mut PathState) {}

    /// Called before the path scatters at `point`.
    #[inline]
    fn arrive(_state: &mut Self::State, _point: &SurfacePoint, _bsdf: &Bsdf, _path: &mut PathState) {}

    /// True if an estimator may connect the current vertex of the path.
    #[inline]
    fn may_connect(_state: &Self::State) -> bool {
        true
    }

    /// Called at a light sample. `base` is the fraction of the light that the base of the surface reflects.
    #[inline]
    fn sample_light(_state: &mut Self::State, _base: impl FnOnce() -> Rgb) {}

    /// Called at a BSDF sample. `base` is the fraction of the light that the base of the surface reflects.
    #[inline]
    fn sample_bsdf(_state: &mut Self::State, _base: impl FnOnce() -> Rgb) {}

    /// Called when the path leaves `point` with `throughput`. Returns whether the path must survive.
    #[inline]
    fn leave(
        _state: &mut Self::State,
        (_point, _bsdf): (&SurfacePoint, &Bsdf),
        _throughput: Rgb,
        _segments: u32,
    ) -> bool {
        false
    }

    /// Factor from radiance to the pixel for a path of `throughput`.
    #[inline]
    fn throughput(_state: &Self::State, throughput: Rgb) -> Rgb {
        throughput
    }

    /// Adds `light` to the pixel of `path` alone.
    #[inline]
    fn add_own(_state: &mut Self::State, path: &mut PathState, light: Rgb) {
        path.add(light);
    }

    /// Radiance of the sample, valid after [`Sharing::distribute`].
    #[inline]
    fn radiance(_state: &Self::State, path: &PathState) -> Rgb {
        Rgb::from(path.radiance)
    }

    /// Distributes the light of the first `count` paths, which have ended, among pixels. If depth
    /// `is_limited`, only paths of equal length share.
    #[inline]
    fn distribute<F: Features, S>(
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

/// Wavefront, with an estimator's state `S` per path and the memory of the sharing rule.
pub struct PathWave<'m, S, R: Sharing> {
    pub(in crate::transport) wave: Wavefront<'m>,
    pub(in crate::transport) memory: PathMemory<'m, S, R>,
}

/// Memory of a wave beside the wavefront. Slices of types without size are empty.
pub(in crate::transport) struct PathMemory<'m, S, R: Sharing> {
    pub(in crate::transport) states: &'m mut [S],
    pub(in crate::transport) shared: &'m mut [R::State],
    pub(in crate::transport) pairs: &'m mut [R::Pair],
}

impl<'m, S: Pod, R: Sharing> PathWave<'m, S, R> {
    /// Footprint of [`PathWave::new`].
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

    /// Radiance of the sample of path `path`.
    #[inline]
    pub(in crate::transport) fn radiance(&self, path: usize) -> Rgb {
        let none = R::State::zeroed();
        R::radiance(self.memory.shared.get(path).unwrap_or(&none), &self.wave.paths[path])
    }

    /// Resets the states of path `path` of this circle.
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

/// Slice of `count` values; empty for types without size.
fn slice<'m, T: Pod>(count: usize, arena: &mut Arena<'m>) -> Result<&'m mut [T], OutOfMemory> {
    if size_of::<T>() == 0 { Ok(&mut []) } else { arena.slice(count) }
}
