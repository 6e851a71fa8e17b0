//! Camera paths that are lit by virtual lights: an estimator of the path tracer.
//!
//! A vertex z takes C virtual lights. Each is chosen from [`CANDIDATES`] of the set, one of each of as many
//! equal parts, in proportion to what it would bring if nothing were in its way (Talbot et al. 2005). The
//! path would go on from z to y with density g = p(z → y) cos θ_y / d² per area, and the light of y counts
//!
//!   w(z, y) = min(1, b / g)
//!
//! For a diffuse z that is min(G, π b) in place of the geometry term G; where z is glossy, p holds the
//! connection down wherever its lobe is high. The path that goes on from z and meets y has the rest, 1 - w,
//! as a factor on all light that y reflects (Kollig and Keller 2004): most paths end there. Light of emitters
//! is left to light samples and to paths, as ever. So the mean is right for any bound b. Light of lights
//! without extent that comes to y by mirrors and smooth glass, which no path finds, is not bounded.

use super::lights::{VirtualLight, holds_virtual_lights, is_lit_by_virtual_lights};
use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::geometry::Ray;
use crate::light::luminance;
use crate::sampling::ONE_MINUS_EPSILON;
use crate::scene::SurfacePoint;
use crate::transport::path::estimator::{LightEstimator, PathVertex};
use crate::transport::path::{PathIntegrator, Sharing};
use crate::transport::settings::PathSettings;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::vertex::is_bent_at;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Virtual lights of which one is chosen for a connection.
const CANDIDATES: u32 = 4;

/// Light of a set of virtual lights.
#[derive(Clone, Copy)]
pub struct VirtualLighting<'l> {
    /// The set.
    pub lights: &'l [VirtualLight],
    /// Connections of the first vertex of a path that has any; later ones have one.
    pub connections: u32,
    /// b, density per area up to which all light of a surface is that of its virtual lights, 1/m². With 0
    /// there are no connections.
    pub bound: f32,
    /// True if light that the bound cuts is left out.
    pub is_clamped: bool,
    /// Splats on the pixels of the tile.
    pub splats: &'l [[f32; 3]],
}

/// Virtual lighting's part of the state of a path.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct LightingState {
    /// Density of the path's direction per solid angle, where its last vertex is lit by virtual lights; else
    /// 0.
    pdf: f32,
    /// 1 where its present vertex is.
    is_lit: u32,
    /// Vertices that were.
    lit: u32,
}

/// A virtual light as it would light a vertex.
struct Candidate {
    target: Vec3,
    /// Contribution to the pixel, divided by its own luminance.
    color: Rgb,
    luminance: f32,
}

impl VirtualLighting<'_> {
    /// w, for a point that the path would meet with this `density` per area.
    #[inline]
    fn weight(&self, density: f32) -> f32 {
        (self.bound / density).min(1.0)
    }

    /// Virtual light number `index` for `vertex`; `None` where it brings nothing.
    #[inline]
    fn candidate<F: Features>(
        &self,
        (context, settings): (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        index: usize,
    ) -> Option<Candidate> {
        let light = self.lights.get(index)?;
        let segments = vertex.segments.saturating_add(light.segments()).saturating_add(1);
        if segments > settings.max_depth {
            return None;
        }
        let point = vertex.point;
        let sent = light.sent_to(context, point.position)?;
        let wi = point.frame.to_local(sent.direction);
        if !point.sides_agree(wi, sent.direction) {
            return None;
        }
        let (value, pdf) = vertex.bsdf.evaluate::<F>(vertex.wo, wi);
        let weight = match light.is_hidden() && !self.is_clamped {
            true => 1.0,
            false => self.weight(pdf * sent.solid_angle),
        };
        let radiance = vertex.throughput * value * sent.radiance * (sent.solid_angle * weight);
        let luminance = luminance(radiance);
        (luminance > 0.0 && luminance < f32::INFINITY).then(|| Candidate {
            target: sent.target,
            color: radiance / luminance,
            luminance,
        })
    }
}

impl<F: Features> LightEstimator<F> for VirtualLighting<'_> {
    type State = LightingState;
    type Found = ();

    #[inline]
    fn splat(&self, place: u32) -> Rgb {
        self.splats.get(place as usize).map_or(Rgb::ZERO, |splat| Rgb::from(*splat))
    }

    #[inline]
    fn connections(&self) -> u32 {
        self.connections
    }

    #[inline]
    fn share_left(&self, state: &LightingState, from: Vec3, (point, bsdf): (&SurfacePoint, &Bsdf)) -> f32 {
        if state.pdf == 0.0 || !holds_virtual_lights(bsdf) {
            return 1.0;
        }
        let between = from - point.position;
        let squared = between.length_squared();
        let direction = between / libm::sqrtf(squared);
        let density = state.pdf * direction.dot(point.geometric_normal).abs() / squared;
        // At no distance nothing is connected.
        if !density.is_finite() || is_bent_at(point, direction) {
            return 1.0;
        }
        if self.is_clamped { 0.0 } else { 1.0 - self.weight(density) }
    }

    fn connect(
        &self,
        scene: (&SceneContext<F>, &PathSettings),
        vertex: &PathVertex,
        state: &mut LightingState,
        push: &mut impl FnMut(Ray, Rgb),
    ) {
        if self.bound == 0.0 || !is_lit_by_virtual_lights(&vertex.bsdf) {
            return;
        }
        let connections = if state.lit == 0 { self.connections } else { 1 };
        state.is_lit = 1;
        state.lit += 1;
        let [offset, mut choice] = vertex.sampler.pair(dimension::CONNECTION + vertex.segments);
        let candidates = (connections * CANDIDATES) as f32;
        let each = self.lights.len() as f32 / candidates;
        for connection in 0..connections {
            let (mut chosen, mut sum) = (None, 0.0);
            for number in 0..CANDIDATES {
                let at = (connection * CANDIDATES + number) as f32 + offset;
                let index = ((at / candidates).min(ONE_MINUS_EPSILON) * self.lights.len() as f32) as usize;
                let Some(candidate) = self.candidate(scene, vertex, index) else { continue };
                // The latest is chosen with its share of the sum so far; what decides is a new number then.
                let share = candidate.luminance / (sum + candidate.luminance);
                sum += candidate.luminance;
                if choice < share {
                    choice = (choice / share).min(ONE_MINUS_EPSILON);
                    chosen = Some(candidate);
                } else {
                    choice = ((choice - share) / (1.0 - share)).clamp(0.0, ONE_MINUS_EPSILON);
                }
            }
            if let Some(Candidate { target, color, .. }) = chosen {
                push(vertex.point.spawn_to(target), color * (sum * each));
            }
        }
    }

    #[inline]
    fn scattered(
        &self,
        _context: &SceneContext<F>,
        _vertex: &PathVertex,
        state: &mut LightingState,
        (sample, _): (&BsdfSample, bool),
    ) {
        let has_density = state.is_lit == 1 && !sample.delta;
        state.pdf = if has_density { sample.pdf } else { 0.0 };
        state.is_lit = 0;
    }
}

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// The same, lit by virtual lights.
    pub fn with_virtual_lights<'l>(
        &self,
        lighting: VirtualLighting<'l>,
    ) -> PathIntegrator<'a, F, VirtualLighting<'l>, R> {
        self.with_estimator(lighting)
    }
}
