//! Path reuse among neighbouring pixels (Bekaert, Sbert and Halton, "Accelerating path tracing by re-using
//! paths", 2002).
//!
//! Path j leaves a diffuse point x_j of its pixel and hits a diffuse point y_j, which reflects L_j. A path
//! from any other x_i of the circle could have hit y_j as well. The balance heuristic over all of them gives
//! pixel i a share w_ij of L_j:
//!
//!   w_ij = V_ij g_ij / Σ_k V_kj g_kj,    g_kj = cos θ_k cos θ_y / |x_k - y_j|²
//!
//! Here V is the visibility between the two points. The shares of one y_j sum to one for any V and g, so that
//! the picture is unbiased. The price is one shadow ray per pair, and correlated errors of neighbours.
//!
//! A firefly that is shared shows in all pixels of its circle. Each sample is therefore shared up to a limit,
//! which grows with the sample number; the rest stays with the path that found it. The limit applies to the
//! light of y and is the same for all paths.
//!
//! At a coated y, only light of the diffuse base is shared, times T(to x_i) / T(to x_j), the transmittances
//! of the coat; light that the coat reflects belongs to path j alone.

use super::PathIntegrator;
use super::connection::{ConnectionVertex, density};
use super::estimator::LightEstimator;
use super::sharing::{PathMemory, PathWave, Sharing};
use crate::Rgb;
use crate::bsdf::{Bsdf, CoatTransmittance, Features};
use crate::film::CIRCLE;
use crate::geometry::Ray;
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::wavefront::{PathState, Wavefront};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Firefly limit of sample n over the mean radiance of the picture and over (n + [`FIREFLY_OFFSET`]). A
/// sixteenth of 4 n, averaged over n samples, is a quarter of the mean.
const FIREFLY_FACTOR: f32 = 4.0;

/// Offset of the sample number: with few samples fireflies hardly stand out from noise.
const FIREFLY_OFFSET: u32 = 16;

/// Coat over the diffuse part of y. Only light of the base is shared, whose radiance towards x_i follows from
/// that towards x_j by the transmittances. Light that the coat reflects stays with the path that found it.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Coated {
    coat: CoatTransmittance,
    /// Fraction of the base in the reflected light of the light sample at y.
    of_light: [f32; 3],
    /// Fraction of the base in the reflected light that the path finds behind y.
    of_path: [f32; 3],
    /// Light of the base so far.
    base: [f32; 3],
}

/// State of path reuse per path: the light that it offers to its circle, and the light that it receives.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct ReuseState {
    x: ConnectionVertex,
    y: ConnectionVertex,
    /// β behind x: factor from radiance of y to the pixel.
    throughput: [f32; 3],
    /// Radiance found before y, and the received shares of all L_j.
    radiance: [f32; 3],
    /// Number of the circle of the path.
    circle: u32,
    /// Segments up to x. With a limit of depth only paths of equal `segments` share.
    segments: u16,
    /// Stage of the path: [`BEFORE_X`], [`LEFT_X`], [`RECEIVING`], [`AT_Y`], [`AT_COATED_Y`] or
    /// [`BEHIND_COATED_Y`].
    stage: u16,
    coated: Coated,
}

/// The path has not hit a diffuse point yet.
const BEFORE_X: u16 = 0;
/// The path has left x; its next surface is unknown.
const LEFT_X: u16 = 1;
/// The surface after x cannot be shared, but the path receives shares of others.
const RECEIVING: u16 = 2;
/// The path has hit y and gathers L.
const AT_Y: u16 = 3;
/// The path has hit a coated y; its radiance since then is of the light sample.
const AT_COATED_Y: u16 = 4;
/// The path has left a coated y; its radiance since then comes from behind y.
const BEHIND_COATED_Y: u16 = 5;

impl ReuseState {
    /// Called when the path scatters at a diffuse `point`, which becomes x if the path has none. Returns
    /// whether it became x; the path must then survive, if it carries any `throughput`.
    #[inline]
    fn leave(&mut self, point: &SurfacePoint, throughput: Rgb, segments: u32) -> bool {
        if self.stage != BEFORE_X || throughput == Rgb::ZERO {
            return false;
        }
        self.x = ConnectionVertex::of(point);
        self.throughput = throughput.to_array();
        self.segments = segments as u16;
        self.stage = LEFT_X;
        true
    }

    /// Called before the path scatters at the surface after x. If other paths can connect to this surface, it
    /// becomes y, and the path gathers light for its circle, with throughput 1.
    #[inline]
    fn arrive(&mut self, point: &SurfacePoint, coat: Option<CoatTransmittance>, path: &mut PathState) {
        if self.stage != LEFT_X {
            return;
        }
        self.y = ConnectionVertex::of(point);
        let density = density(&self.x, &self.y);
        match coat {
            Some(coat) if density > 0.0 && density < f32::INFINITY => {
                self.stage = if coat == CoatTransmittance::NONE { AT_Y } else { AT_COATED_Y };
                self.coated = Coated { coat, ..Coated::default() };
                self.radiance = core::mem::take(&mut path.radiance);
                path.throughput = [1.0; 3];
            }
            _ => self.stage = RECEIVING,
        }
    }

    /// Called after the path has left y: its radiance so far is of the light sample.
    #[inline]
    fn go_behind(&mut self, path: &mut PathState) {
        if self.stage == AT_COATED_Y {
            self.split_base_and_coat(self.coated.of_light, path);
            self.stage = BEHIND_COATED_Y;
        }
    }

    /// Called after the path has ended: it offers its radiance, less the part that belongs to it alone.
    #[inline]
    fn finish(&mut self, path: &mut PathState) {
        match self.stage {
            AT_COATED_Y => self.split_base_and_coat(self.coated.of_light, path),
            BEHIND_COATED_Y => self.split_base_and_coat(self.coated.of_path, path),
            _ => return,
        }
        path.radiance = core::mem::take(&mut self.coated.base);
        self.stage = AT_Y;
    }

    /// Divides the radiance of the path between base and coat.
    fn split_base_and_coat(&mut self, part: [f32; 3], path: &mut PathState) {
        let light = Rgb::from(core::mem::take(&mut path.radiance));
        let base = light * Rgb::from(part);
        self.coated.base = (Rgb::from(self.coated.base) + base).to_array();
        self.receive(1.0, light - base);
    }

    /// Transmittance T of the coat of y towards `x`.
    #[inline]
    fn transmittance(&self, x: &ConnectionVertex) -> Rgb {
        let to_x = Vec3::from(x.position) - Vec3::from(self.y.position);
        let cosine = to_x.dot(self.y.normal.into()) / to_x.length();
        self.coated.coat.transmittance(cosine.clamp(0.0, 1.0))
    }

    /// Radiance of the sample without sharing; valid before shares are distributed.
    pub(super) fn unshared_radiance(&self, path: &PathState) -> Rgb {
        let throughput = if self.stage >= AT_Y { Rgb::from(self.throughput) } else { Rgb::ONE };
        Rgb::from(self.radiance) + throughput * (Rgb::from(path.radiance) + Rgb::from(self.coated.base))
    }

    #[inline]
    fn receive(&mut self, share: f32, light: Rgb) {
        self.radiance = (Rgb::from(self.radiance) + share * (Rgb::from(self.throughput) * light)).to_array();
    }
}

/// Pair of paths: `target` might have hit the point y of `source`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Connection {
    source: u32,
    target: u32,
    /// V g.
    density: f32,
}

/// Path reuse: pixels of a circle share the light that their paths find.
#[derive(Clone, Copy, Debug)]
pub struct PathReuse {
    /// Radiance over the sample number, above which a sample is shared in part only.
    firefly_limit: f32,
}

impl Sharing for PathReuse {
    type State = ReuseState;
    type Pair = Connection;
    const IN_CIRCLES: bool = true;

    #[inline]
    fn begin(circle: u32) -> ReuseState {
        ReuseState { circle, ..ReuseState::default() }
    }

    #[inline]
    fn resume(state: &mut ReuseState, path: &mut PathState) {
        state.go_behind(path);
    }

    #[inline]
    fn arrive(state: &mut ReuseState, point: &SurfacePoint, bsdf: &Bsdf, path: &mut PathState) {
        state.arrive(point, bsdf.coat_transmittance(), path);
    }

    /// Light behind x is shared, except at a coated y before the path has left it: the fraction of the base
    /// is not common to light from several directions.
    #[inline]
    fn may_connect(state: &ReuseState) -> bool {
        state.stage == AT_Y || state.stage == BEHIND_COATED_Y
    }

    #[inline]
    fn sample_light(state: &mut ReuseState, base: impl FnOnce() -> Rgb) {
        if state.stage == AT_COATED_Y {
            state.coated.of_light = base().to_array();
        }
    }

    #[inline]
    fn sample_bsdf(state: &mut ReuseState, base: impl FnOnce() -> Rgb) {
        if state.stage == AT_COATED_Y {
            state.coated.of_path = base().to_array();
        }
    }

    #[inline]
    fn leave(
        state: &mut ReuseState,
        (point, bsdf): (&SurfacePoint, &Bsdf),
        throughput: Rgb,
        segments: u32,
    ) -> bool {
        matches!(bsdf, Bsdf::Diffuse(_)) && state.leave(point, throughput, segments)
    }

    #[inline]
    fn throughput(state: &ReuseState, throughput: Rgb) -> Rgb {
        if state.stage >= AT_Y { throughput * Rgb::from(state.throughput) } else { throughput }
    }

    #[inline]
    fn add_own(state: &mut ReuseState, path: &mut PathState, light: Rgb) {
        if state.stage >= AT_Y {
            state.receive(1.0, light);
        } else {
            path.add(light);
        }
    }

    #[inline]
    fn radiance(state: &ReuseState, path: &PathState) -> Rgb {
        let own = if state.stage >= AT_Y { Rgb::ZERO } else { Rgb::from(path.radiance) };
        own + Rgb::from(state.radiance)
    }

    fn distribute<F: Features, S>(
        &self,
        (context, is_limited): (&SceneContext<F>, bool),
        PathWave { wave, memory }: &mut PathWave<S, Self>,
        count: usize,
        counters: &mut Counters,
    ) {
        for (state, path) in memory.shared.iter_mut().zip(wave.paths.iter_mut()).take(count) {
            state.finish(path);
        }
        let (mut pairs, mut circle) = (0, 0..0);
        for j in 0..count {
            if j >= circle.end {
                circle = j..end_of_circle(&memory.shared[..count], j);
            }
            let source = memory.shared[j];
            if source.stage != AT_Y {
                continue;
            }
            if pairs + CIRCLE > memory.pairs.len() {
                self.distribute_pairs(context, wave, memory, pairs, counters);
                pairs = 0;
            }
            for k in circle.clone() {
                let target = &memory.shared[k];
                if target.stage == BEFORE_X || (is_limited && target.segments != source.segments) {
                    continue;
                }
                let density = density(&target.x, &source.y);
                if density > 0.0 && density < f32::INFINITY {
                    memory.pairs[pairs] = Connection { source: j as u32, target: k as u32, density };
                    if k != j {
                        let ray = Ray { tag: pairs as u32, ..source.y.ray_to(&target.x) };
                        wave.shadows.push(ray, Rgb::splat(density));
                    }
                    pairs += 1;
                }
            }
        }
        self.distribute_pairs(context, wave, memory, pairs, counters);
    }
}

impl PathReuse {
    /// Traces the connections of the first `pairs` pairs and distributes the shares.
    fn distribute_pairs<F: Features, S>(
        &self,
        context: &SceneContext<F>,
        wave: &mut Wavefront,
        memory: &mut PathMemory<S, Self>,
        pairs: usize,
        counters: &mut Counters,
    ) {
        trace_connections(context, wave, memory.pairs, counters);
        let PathMemory { shared, pairs: all, .. } = memory;
        let mut rest = &all[..pairs];
        while let Some(first) = rest.first() {
            let count = rest.iter().take_while(|pair| pair.source == first.source).count();
            let (targets, others) = rest.split_at(count);
            rest = others;
            let path = wave.paths[first.source as usize];
            let light = Rgb::from(path.radiance);
            if light == Rgb::ZERO {
                continue;
            }
            // Light that is not finite stays in one pixel, where it is counted.
            if !light.is_finite() {
                shared[first.source as usize].receive(1.0, light);
                continue;
            }
            let total: f32 = targets.iter().map(|pair| pair.density).sum();
            let source = shared[first.source as usize];
            let coated = source.coated.coat != CoatTransmittance::NONE;
            let here = if coated { source.transmittance(&source.x) } else { Rgb::ONE };
            let base = Rgb::select(here.cmpgt(Rgb::ZERO), light / here, Rgb::ZERO);
            let most = self.firefly_limit * (FIREFLY_OFFSET + path.sample) as f32;
            let part = (most / base.max_element()).min(1.0);
            if part < 1.0 {
                shared[first.source as usize].receive(1.0 - part, light);
            }
            for pair in targets.iter().filter(|pair| pair.density > 0.0) {
                let target = &mut shared[pair.target as usize];
                let there = if coated { source.transmittance(&target.x) } else { Rgb::ONE };
                target.receive(part * pair.density / total, base * there);
            }
        }
    }
}

/// Multiplies the densities of `pairs` by the transmittance V of the queued rays between them.
fn trace_connections<F: Features>(
    context: &SceneContext<F>,
    wave: &mut Wavefront,
    pairs: &mut [Connection],
    counters: &mut Counters,
) {
    let shadows = &mut wave.shadows;
    for ray in &shadows.rays[..shadows.count] {
        pairs[ray.tag as usize].density = 0.0;
    }
    shadows.trace(context, counters, |ray, density| pairs[ray.tag as usize].density = density.x);
}

/// End of the circle of path `first`.
fn end_of_circle(states: &[ReuseState], first: usize) -> usize {
    let members = |other: &&ReuseState| other.circle == states[first].circle;
    first + states[first..].iter().take_while(members).count()
}

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// This path tracer with path reuse: pixels of a circle share the light that their paths find.
    pub fn with_reuse(&self) -> PathIntegrator<'a, F, E, PathReuse> {
        self.with_sharing(PathReuse { firefly_limit: f32::INFINITY })
    }
}

impl<F: Features, E: LightEstimator<F>> PathIntegrator<'_, F, E, PathReuse> {
    /// This path tracer with a firefly limit: samples much brighter than the `mean` radiance of the picture
    /// are shared in part only.
    pub fn with_firefly_limit(&self, mean: f32) -> Self {
        let firefly_limit = if mean > 0.0 { FIREFLY_FACTOR * mean } else { f32::INFINITY };
        Self { sharing: PathReuse { firefly_limit }, ..*self }
    }
}
