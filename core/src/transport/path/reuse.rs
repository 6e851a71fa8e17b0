//! Paths of neighbouring pixels share what they find (Bekaert, Sbert and Halton, "Accelerating path tracing by
//! re-using paths", 2002).
//!
//! Path j starts from a diffuse point x_j in its pixel and meets a diffuse point y_j, which reflects L_j. From
//! every x_i of the circle y_j could have been met as well. The balance heuristic over all of them gives pixel i
//! a share w_ij of what path j found:
//!
//!   w_ij = V_ij g_ij / Σ_k V_kj g_kj,    g_kj = cos θ_k cos θ_y / |x_k - y_j|²
//!
//! with V the visibility between the two. The shares of one y_j add up to one: nothing is lost and nothing is
//! counted twice, whatever V and g are, so the picture stays right in the mean. The price is one shadow ray for
//! each pair, and errors that neighbours have in common.
//!
//! Light that would show in the picture wherever it is shared, a flash, is shared up to a limit, which grows with the number
//! of the sample; the rest stays with the path that found it. The limit is of the light of y, the same for all paths.
//!
//! Where y has a coat, what its diffuse part sends back is shared, times T(to x_i) / T(to x_j), the shares that pass the
//! coat; what the coat mirrors belongs to path j alone.

use crate::Rgb;
use crate::bsdf::{Cover, Features};
use crate::bvh::Coherence;
use crate::film::CIRCLE;
use crate::geometry::Ray;
use crate::scene::SurfacePoint;
use crate::transport::estimator::{Counters, MAX_CROSSINGS};
use crate::transport::path::PathIntegrator;
use crate::transport::path::state::{PathState, Wavefront};
use crate::transport::walk::visibility::FEW;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Below this cosine of the viewer the shading normal may have been turned to him: no two viewers then see the
/// same surface.
const HORIZON: f32 = 2e-3;

/// A flash of the `n`th sample is what brings more light than this times the mean of the picture, times n and
/// [`BEFORE_FLASHES`]: a sixteenth of it, in the mean of n samples, is a quarter of the mean.
const FLASH: f32 = 4.0;

/// With few samples all is noise, and flashes hardly show.
const BEFORE_FLASHES: u32 = 16;

/// One end of a connection. Both normals are on the side of the other end.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(in crate::transport) struct ConnectionVertex {
    position: [f32; 3],
    /// Bound of the error of `position`.
    error: f32,
    /// The shading normal.
    normal: [f32; 3],
    geometric_normal: [f32; 3],
}

impl ConnectionVertex {
    pub(in crate::transport) fn of(point: &SurfacePoint) -> Self {
        Self {
            position: point.position.to_array(),
            error: point.error,
            normal: point.frame.normal.to_array(),
            geometric_normal: point.geometric_normal.to_array(),
        }
    }

    /// The position, moved off the surface.
    #[inline]
    fn outside(&self) -> Vec3 {
        Vec3::from(self.position) + self.error * Vec3::from(self.geometric_normal)
    }

    /// The ray from here to `other` that meets neither surface.
    #[inline]
    fn ray_to(&self, other: &ConnectionVertex) -> Ray {
        let origin = self.outside();
        Ray::segment(origin, other.outside() - origin, 1.0 - f32::EPSILON)
    }
}

/// g = cos θ_x cos θ_y / |x - y|²: density per area, up to π, with which a path from the diffuse point `x` meets
/// `y`. Zero where the two are not on the same side of each other.
#[inline]
fn density(x: &ConnectionVertex, y: &ConnectionVertex) -> f32 {
    let between = Vec3::from(y.position) - Vec3::from(x.position);
    let square = between.length_squared();
    let leaving = between.dot(x.normal.into());
    let arriving = -between.dot(y.geometric_normal.into());
    let shading = -between.dot(y.normal.into());
    let faces = leaving > 0.0
        && arriving > 0.0
        && shading > 0.0
        && between.dot(x.geometric_normal.into()) > 0.0
        && shading * shading > HORIZON * HORIZON * square;
    if faces { leaving * arriving / square / square } else { 0.0 }
}

/// What covers the diffuse part of y. Only the light of that part is shared: what leaves y elsewhere is known from what
/// left it here. The light of a coat is for the path alone that found it.
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
pub(in crate::transport) struct ReuseState {
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
    pub(in crate::transport) fn new(circle: u32) -> Self {
        Self { circle, ..Self::default() }
    }

    /// The path scatters at a diffuse `point`, its x if it has none. Whether it has become that: it must go on for
    /// certain then, if it carries any `throughput` from there.
    #[inline]
    pub(in crate::transport) fn leave(
        &mut self,
        point: &SurfacePoint,
        throughput: Rgb,
        segments: u32,
    ) -> bool {
        if self.stage != ALONE || throughput == Rgb::ZERO {
            return false;
        }
        self.x = ConnectionVertex::of(point);
        self.throughput = throughput.to_array();
        self.segments = segments as u16;
        self.stage = LEAVING;
        true
    }

    /// The path is about to scatter at the next surface after x. Where that is fit to be met from elsewhere, it
    /// becomes y: the path then gathers for all its circle, with throughput 1.
    #[inline]
    pub(in crate::transport) fn arrive(
        &mut self,
        point: &SurfacePoint,
        cover: Option<Cover>,
        path: &mut PathState,
    ) {
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

    /// Whether the path is at a coated y.
    #[inline]
    pub(in crate::transport) fn is_lit(&self) -> bool {
        self.stage == LIT
    }

    /// At a coated y: which part of the light that a shadow ray brings is the base's.
    #[inline]
    pub(in crate::transport) fn light_is_of_base(&mut self, part: Rgb) {
        self.coated.of_light = part.to_array();
    }

    /// At a coated y: which part of what is found behind it is the base's.
    #[inline]
    pub(in crate::transport) fn path_is_of_base(&mut self, part: Rgb) {
        self.coated.of_path = part.to_array();
    }

    /// The path has left y: what it has gathered so far came from a light.
    #[inline]
    pub(in crate::transport) fn go_behind(&mut self, path: &mut PathState) {
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

    /// What a throughput is worth in the pixel.
    #[inline]
    pub(in crate::transport) fn worth(&self, throughput: Rgb) -> Rgb {
        if self.stage >= OFFERING { throughput * Rgb::from(self.throughput) } else { throughput }
    }

    /// What the pixel sees in the end, `path` being what the path gathered.
    #[inline]
    pub(in crate::transport) fn seen(&self, path: &PathState) -> Rgb {
        let own = if self.stage >= OFFERING { Rgb::ZERO } else { Rgb::from(path.radiance) };
        own + Rgb::from(self.radiance)
    }

    /// What the pixel would see if nothing were shared, before it is.
    pub(in crate::transport) fn alone(&self, path: &PathState) -> Rgb {
        let worth = if self.stage >= OFFERING { Rgb::from(self.throughput) } else { Rgb::ONE };
        Rgb::from(self.radiance) + worth * (Rgb::from(path.radiance) + Rgb::from(self.coated.base))
    }

    /// Adds `light` that belongs to `path` alone, wherever it is met.
    #[inline]
    pub(in crate::transport) fn keep(&mut self, path: &mut PathState, light: Rgb) {
        if self.stage >= OFFERING {
            self.take(1.0, light);
        } else {
            path.add(light);
        }
    }

    #[inline]
    fn take(&mut self, share: f32, light: Rgb) {
        self.radiance = (Rgb::from(self.radiance) + share * (Rgb::from(self.throughput) * light)).to_array();
    }
}

/// That path `taking` might have met what path `offering` did.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(in crate::transport) struct Connection {
    offering: u32,
    taking: u32,
    /// V g.
    density: f32,
}

impl<F: Features> PathIntegrator<'_, F> {
    /// The same, where samples that are bright next to the `mean` radiance of the picture are shared in part only.
    pub fn with_flashes(&self, mean: f32) -> Self {
        let mut other = *self;
        other.flash = if mean > 0.0 { FLASH * mean } else { f32::INFINITY };
        other
    }

    /// Deals out what the first `count` paths of the wave have gathered behind their y.
    pub(in crate::transport) fn share(&self, wave: &mut Wavefront, count: usize, counters: &mut Counters) {
        for (exchange, path) in wave.exchanges.iter_mut().zip(wave.paths.iter_mut()).take(count) {
            exchange.finish(path);
        }
        let (mut pairs, mut rays, mut circle) = (0, 0, 0..0);
        for j in 0..count {
            if j >= circle.end {
                circle = j..end_of_circle(&wave.exchanges[..count], j);
            }
            let offer = wave.exchanges[j];
            if offer.stage != OFFERING {
                continue;
            }
            if pairs + CIRCLE > wave.pairs.len() {
                self.deal(wave, pairs, rays, counters);
                (pairs, rays) = (0, 0);
            }
            for k in circle.clone() {
                let taker = &wave.exchanges[k];
                if taker.stage == ALONE || (self.is_limited() && taker.segments != offer.segments) {
                    continue;
                }
                let density = density(&taker.x, &offer.y);
                if density > 0.0 && density < f32::INFINITY {
                    wave.pairs[pairs] = Connection { offering: j as u32, taking: k as u32, density };
                    if k != j {
                        wave.shadow_rays[rays] = Ray { tag: pairs as u32, ..offer.y.ray_to(&taker.x) };
                        rays += 1;
                    }
                    pairs += 1;
                }
            }
        }
        self.deal(wave, pairs, rays, counters);
    }

    /// Traces the first `rays` connections of the first `pairs` pairs and gives each path its shares.
    fn deal(&self, wave: &mut Wavefront, pairs: usize, rays: usize, counters: &mut Counters) {
        self.see(wave, rays, counters);
        let mut rest = &wave.pairs[..pairs];
        while let Some(first) = rest.first() {
            let count = rest.iter().take_while(|pair| pair.offering == first.offering).count();
            let (takers, others) = rest.split_at(count);
            rest = others;
            let light = Rgb::from(wave.paths[first.offering as usize].radiance);
            if light == Rgb::ZERO {
                continue;
            }
            // What is no light spoils, and is counted in, one pixel only.
            if !light.is_finite() {
                wave.exchanges[first.offering as usize].take(1.0, light);
                continue;
            }
            let total: f32 = takers.iter().map(|pair| pair.density).sum();
            let offer = wave.exchanges[first.offering as usize];
            let coated = offer.coated.cover != Cover::NONE;
            let here = if coated { offer.transmittance(&offer.x) } else { Rgb::ONE };
            let base = Rgb::select(here.cmpgt(Rgb::ZERO), light / here, Rgb::ZERO);
            let most = self.flash * (BEFORE_FLASHES + wave.paths[first.offering as usize].sample) as f32;
            let shared = (most / base.max_element()).min(1.0);
            if shared < 1.0 {
                wave.exchanges[first.offering as usize].take(1.0 - shared, light);
            }
            for pair in takers.iter().filter(|pair| pair.density > 0.0) {
                let taker = &mut wave.exchanges[pair.taking as usize];
                let there = if coated { offer.transmittance(&taker.x) } else { Rgb::ONE };
                taker.take(shared * pair.density / total, base * there);
            }
        }
    }

    /// Multiplies the densities of the pairs with what the rays between them let pass: V.
    fn see(&self, wave: &mut Wavefront, mut rays: usize, counters: &mut Counters) {
        if !self.context.has_cutouts {
            counters.shadow_rays += rays as u64;
            let (shadow_rays, hidden) = (&wave.shadow_rays[..rays], &mut wave.hidden[..rays]);
            self.context.bvh.occluded_batch(self.context.level, shadow_rays, hidden);
            for (ray, _) in shadow_rays.iter().zip(&*hidden).filter(|(_, hidden)| **hidden != 0) {
                wave.pairs[ray.tag as usize].density = 0.0;
            }
            return;
        }
        for _ in 0..=MAX_CROSSINGS {
            if rays <= FEW {
                break;
            }
            counters.shadow_rays += rays as u64;
            let (shadow_rays, hits) = (&wave.shadow_rays[..rays], &mut wave.hits[..rays]);
            self.context.nearest_batch(shadow_rays, Coherence::Incoherent, hits);
            let mut left = 0;
            for i in 0..rays {
                let (ray, hit) = (wave.shadow_rays[i], wave.hits[i]);
                if !hit.is_some() {
                    continue;
                }
                let pair = &mut wave.pairs[ray.tag as usize];
                match self.context.pass_cutout(&ray, &hit) {
                    Some((through, transmittance)) => {
                        pair.density *= transmittance;
                        wave.shadow_rays[left] = through;
                        left += 1;
                    }
                    None => pair.density = 0.0,
                }
            }
            rays = left;
        }
        for ray in &wave.shadow_rays[..rays] {
            let density = &mut wave.pairs[ray.tag as usize].density;
            let light = Rgb::splat(*density);
            let rays = &mut counters.shadow_rays;
            let passed = self.context.transmit(*ray, light, rays);
            *density = passed.unwrap_or_default().x;
        }
    }
}

/// Where the circle of path `first` ends.
fn end_of_circle(exchanges: &[ReuseState], first: usize) -> usize {
    let members = |other: &&ReuseState| other.circle == exchanges[first].circle;
    first + exchanges[first..].iter().take_while(members).count()
}
