//! Paths of neighbouring pixels share what they find (Bekaert, Sbert and Halton, "Accelerating path tracing
//! by re-using paths", 2002).
//!
//! Path j starts from a diffuse point x_j in its pixel and meets a diffuse point y_j, which reflects L_j.
//! From every x_i of the circle y_j could have been met as well. The balance heuristic over all of them gives
//! pixel i a share w_ij of what path j found:
//!
//!   w_ij = V_ij g_ij / Σ_k V_kj g_kj,    g_kj = cos θ_k cos θ_y / |x_k - y_j|²
//!
//! with V the visibility between the two. The shares of one y_j add up to one: nothing is lost and nothing is
//! counted twice, whatever V and g are, so the picture stays right in the mean. The price is one shadow ray
//! for each pair, and errors that neighbours have in common.
//!
//! Light that would show in the picture wherever it is shared, a flash, is shared up to a limit, which grows
//! with the number of the sample; the rest stays with the path that found it. The limit is of the light of y,
//! the same for all paths.
//!
//! Where y has a coat, what its diffuse part sends back is shared, times T(to x_i) / T(to x_j), the shares
//! that pass the coat; what the coat mirrors belongs to path j alone.

use super::PathIntegrator;
use super::connection::{ConnectionVertex, density};
use super::estimator::Estimator;
use super::sharing::{PathMemory, PathWave, Sharing};
use crate::Rgb;
use crate::bsdf::{Bsdf, Cover, Features};
use crate::film::CIRCLE;
use crate::geometry::Ray;
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::visibility::ShadowRays;
use crate::transport::wavefront::{PathState, Wavefront};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A flash of the `n`th sample is what brings more light than this times the mean of the picture, times n and
/// [`BEFORE_FLASHES`]: a sixteenth of it, in the mean of n samples, is a quarter of the mean.
const FLASH: f32 = 4.0;

/// With few samples all is noise, and flashes hardly show.
const BEFORE_FLASHES: u32 = 16;

/// What covers the diffuse part of y. Only the light of that part is shared: what leaves y elsewhere is known
/// from what left it here. The light of a coat is for the path alone that found it.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Coated {
    cover: Cover,
    /// The part of the base in the light that a shadow ray brings to y.
    of_light: [f32; 3],
    /// The part of the base in what the path finds behind y.
    of_path: [f32; 3],
    /// What of all this is known to be of the base.
    base: [f32; 3],
}

/// What a path offers to its circle, and what it gets.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct ReuseState {
    x: ConnectionVertex,
    y: ConnectionVertex,
    /// β behind x: what radiance from y is worth in the pixel.
    throughput: [f32; 3],
    /// What the path gathered before y, and its shares of all L_j.
    radiance: [f32; 3],
    /// Which circle the path belongs to.
    circle: u32,
    /// Segments up to x: under a limit of depth only equals can share.
    segments: u16,
    /// [`ALONE`] and so on.
    stage: u16,
    coated: Coated,
}

/// The path has met no diffuse point yet.
const ALONE: u16 = 0;
/// It has left x; what it meets is not known yet.
const LEAVING: u16 = 1;
/// It met nothing that others can use, but takes part in what they offer.
const TAKING: u16 = 2;
/// It has met y, and gathers L.
const OFFERING: u16 = 3;
/// The same, y being coated: what the path has gathered came from a light.
const LIT: u16 = 4;
/// The same, but it came from behind y.
const BEHIND: u16 = 5;

impl ReuseState {
    /// The path scatters at a diffuse `point`, its x if it has none. Whether it has become that: it must go
    /// on for certain then, if it carries any `throughput` from there.
    #[inline]
    fn leave(&mut self, point: &SurfacePoint, throughput: Rgb, segments: u32) -> bool {
        if self.stage != ALONE || throughput == Rgb::ZERO {
            return false;
        }
        self.x = ConnectionVertex::of(point);
        self.throughput = throughput.to_array();
        self.segments = segments as u16;
        self.stage = LEAVING;
        true
    }

    /// The path is about to scatter at the next surface after x. Where that is fit to be met from elsewhere,
    /// it becomes y: the path then gathers for all its circle, with throughput 1.
    #[inline]
    fn arrive(&mut self, point: &SurfacePoint, cover: Option<Cover>, path: &mut PathState) {
        if self.stage != LEAVING {
            return;
        }
        self.y = ConnectionVertex::of(point);
        let density = density(&self.x, &self.y);
        match cover {
            Some(cover) if density > 0.0 && density < f32::INFINITY => {
                self.stage = if cover == Cover::NONE { OFFERING } else { LIT };
                self.coated = Coated { cover, ..Coated::default() };
                self.radiance = core::mem::take(&mut path.radiance);
                path.throughput = [1.0; 3];
            }
            _ => self.stage = TAKING,
        }
    }

    /// The path has left y: what it has gathered so far came from a light.
    #[inline]
    fn go_behind(&mut self, path: &mut PathState) {
        if self.stage == LIT {
            self.divide(self.coated.of_light, path);
            self.stage = BEHIND;
        }
    }

    /// The path has ended: what it offers is what it has gathered, less what is its own.
    #[inline]
    fn finish(&mut self, path: &mut PathState) {
        match self.stage {
            LIT => self.divide(self.coated.of_light, path),
            BEHIND => self.divide(self.coated.of_path, path),
            _ => return,
        }
        path.radiance = core::mem::take(&mut self.coated.base);
        self.stage = OFFERING;
    }

    /// Divides what the path has gathered between base and coat.
    fn divide(&mut self, part: [f32; 3], path: &mut PathState) {
        let light = Rgb::from(core::mem::take(&mut path.radiance));
        let base = light * Rgb::from(part);
        self.coated.base = (Rgb::from(self.coated.base) + base).to_array();
        self.take(1.0, light - base);
    }

    /// What T of y at `x` is.
    #[inline]
    fn transmittance(&self, x: &ConnectionVertex) -> Rgb {
        let to_x = Vec3::from(x.position) - Vec3::from(self.y.position);
        let cosine = to_x.dot(self.y.normal.into()) / to_x.length();
        self.coated.cover.transmittance(cosine.clamp(0.0, 1.0))
    }

    /// What the pixel would see if nothing were shared, before it is.
    pub(super) fn alone(&self, path: &PathState) -> Rgb {
        let worth = if self.stage >= OFFERING { Rgb::from(self.throughput) } else { Rgb::ONE };
        Rgb::from(self.radiance) + worth * (Rgb::from(path.radiance) + Rgb::from(self.coated.base))
    }

    #[inline]
    fn take(&mut self, share: f32, light: Rgb) {
        self.radiance = (Rgb::from(self.radiance) + share * (Rgb::from(self.throughput) * light)).to_array();
    }
}

/// That path `taking` might have met what path `offering` did.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Connection {
    offering: u32,
    taking: u32,
    /// V g.
    density: f32,
}

/// Path reuse: pixels of a circle share the light that their paths find.
#[derive(Clone, Copy, Debug)]
pub struct PathReuse {
    /// Light of a sample, times the number of samples, above which it is shared in part only.
    flash: f32,
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
        state.arrive(point, bsdf.cover(), path);
    }

    /// Behind x, whose light is shared, except at a coated y: of light that comes there in several ways the
    /// base has no common part.
    #[inline]
    fn may_connect(state: &ReuseState) -> bool {
        state.stage == OFFERING || state.stage == BEHIND
    }

    #[inline]
    fn sample_light(state: &mut ReuseState, base: impl FnOnce() -> Rgb) {
        if state.stage == LIT {
            state.coated.of_light = base().to_array();
        }
    }

    #[inline]
    fn sample_bsdf(state: &mut ReuseState, base: impl FnOnce() -> Rgb) {
        if state.stage == LIT {
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
    fn worth(state: &ReuseState, throughput: Rgb) -> Rgb {
        if state.stage >= OFFERING { throughput * Rgb::from(state.throughput) } else { throughput }
    }

    #[inline]
    fn keep(state: &mut ReuseState, path: &mut PathState, light: Rgb) {
        if state.stage >= OFFERING {
            state.take(1.0, light);
        } else {
            path.add(light);
        }
    }

    #[inline]
    fn radiance(state: &ReuseState, path: &PathState) -> Rgb {
        let own = if state.stage >= OFFERING { Rgb::ZERO } else { Rgb::from(path.radiance) };
        own + Rgb::from(state.radiance)
    }

    fn share<F: Features, S>(
        &self,
        (context, is_limited): (&SceneContext<F>, bool),
        PathWave { wave, memory }: &mut PathWave<S, Self>,
        count: usize,
        counters: &mut Counters,
    ) {
        for (state, path) in memory.shared.iter_mut().zip(wave.paths.iter_mut()).take(count) {
            state.finish(path);
        }
        let (mut pairs, mut rays, mut circle) = (0, 0, 0..0);
        for j in 0..count {
            if j >= circle.end {
                circle = j..end_of_circle(&memory.shared[..count], j);
            }
            let offer = memory.shared[j];
            if offer.stage != OFFERING {
                continue;
            }
            if pairs + CIRCLE > memory.pairs.len() {
                self.divide(context, wave, memory, (pairs, rays), counters);
                (pairs, rays) = (0, 0);
            }
            for k in circle.clone() {
                let taker = &memory.shared[k];
                if taker.stage == ALONE || (is_limited && taker.segments != offer.segments) {
                    continue;
                }
                let density = density(&taker.x, &offer.y);
                if density > 0.0 && density < f32::INFINITY {
                    memory.pairs[pairs] = Connection { offering: j as u32, taking: k as u32, density };
                    if k != j {
                        wave.shadow_rays[rays] = Ray { tag: pairs as u32, ..offer.y.ray_to(&taker.x) };
                        wave.shadow_light[rays] = [density; 3];
                        rays += 1;
                    }
                    pairs += 1;
                }
            }
        }
        self.divide(context, wave, memory, (pairs, rays), counters);
    }
}

impl PathReuse {
    /// Traces the first `rays` connections of the first `pairs` pairs, and gives each path its shares.
    fn divide<F: Features, S>(
        &self,
        context: &SceneContext<F>,
        wave: &mut Wavefront,
        memory: &mut PathMemory<S, Self>,
        (pairs, rays): (usize, usize),
        counters: &mut Counters,
    ) {
        see(context, wave, memory.pairs, rays, counters);
        let PathMemory { shared, pairs: all, .. } = memory;
        let mut rest = &all[..pairs];
        while let Some(first) = rest.first() {
            let count = rest.iter().take_while(|pair| pair.offering == first.offering).count();
            let (takers, others) = rest.split_at(count);
            rest = others;
            let path = wave.paths[first.offering as usize];
            let light = Rgb::from(path.radiance);
            if light == Rgb::ZERO {
                continue;
            }
            // Light that is not finite spoils, and is counted in, one pixel only.
            if !light.is_finite() {
                shared[first.offering as usize].take(1.0, light);
                continue;
            }
            let total: f32 = takers.iter().map(|pair| pair.density).sum();
            let offer = shared[first.offering as usize];
            let coated = offer.coated.cover != Cover::NONE;
            let here = if coated { offer.transmittance(&offer.x) } else { Rgb::ONE };
            let base = Rgb::select(here.cmpgt(Rgb::ZERO), light / here, Rgb::ZERO);
            let most = self.flash * (BEFORE_FLASHES + path.sample) as f32;
            let part = (most / base.max_element()).min(1.0);
            if part < 1.0 {
                shared[first.offering as usize].take(1.0 - part, light);
            }
            for pair in takers.iter().filter(|pair| pair.density > 0.0) {
                let taker = &mut shared[pair.taking as usize];
                let there = if coated { offer.transmittance(&taker.x) } else { Rgb::ONE };
                taker.take(part * pair.density / total, base * there);
            }
        }
    }
}

/// Multiplies the densities of `pairs` with the transmittance V of the first `rays` rays between them.
fn see<F: Features>(
    context: &SceneContext<F>,
    wave: &mut Wavefront,
    pairs: &mut [Connection],
    rays: usize,
    counters: &mut Counters,
) {
    for ray in &wave.shadow_rays[..rays] {
        pairs[ray.tag as usize].density = 0.0;
    }
    let Wavefront { shadow_rays: rays_of, shadow_light: light, hits, hidden, .. } = wave;
    let mut shadows = ShadowRays { rays: rays_of, light, hits, hidden };
    let arrive = |ray: &Ray, density: Rgb| pairs[ray.tag as usize].density = density.x;
    context.trace_shadow_rays(&mut shadows, rays, &mut counters.shadow_rays, arrive);
}

/// The end of the circle of path `first`.
fn end_of_circle(states: &[ReuseState], first: usize) -> usize {
    let members = |other: &&ReuseState| other.circle == states[first].circle;
    first + states[first..].iter().take_while(members).count()
}

impl<'a, F: Features, E: Estimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// The same, where pixels of a circle share the light that their paths find.
    pub fn with_reuse(&self) -> PathIntegrator<'a, F, E, PathReuse> {
        self.with_sharing(PathReuse { flash: f32::INFINITY })
    }
}

impl<F: Features, E: Estimator<F>> PathIntegrator<'_, F, E, PathReuse> {
    /// The same, where samples that are bright next to the `mean` radiance of the picture are shared in part
    /// only.
    pub fn with_flashes(&self, mean: f32) -> Self {
        let flash = if mean > 0.0 { FLASH * mean } else { f32::INFINITY };
        Self { sharing: PathReuse { flash }, ..*self }
    }
}
