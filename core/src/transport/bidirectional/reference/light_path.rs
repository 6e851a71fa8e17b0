//! Light paths, written down vertex by vertex.

use super::Reference;
use super::densities::{Light, MOST_SEGMENTS, PathVertex};
use crate::Rgb;
use crate::bsdf::BsdfSample;
use crate::geometry::Hit;
use crate::light::LightType;
use crate::transport::bidirectional::light_pass::{DIMENSIONS, SEED, continuation};
use crate::transport::settings::Counters;
use crate::transport::walk::light::{Continuation, LightPathState, Vertex, Visitor};
use crate::transport::walk::vertex::is_bent_at;
use glam::Vec3;

/// A light path: where it starts, and its vertices.
#[derive(Clone, Copy, Default)]
pub struct LightPath {
    pub(super) light: Light,
    pub(super) vertices: [PathVertex; MOST_SEGMENTS],
    /// W on arrival at each vertex.
    pub(super) power: [Rgb; MOST_SEGMENTS],
    /// Random numbers of the point on the lens that sees each vertex.
    pub(super) lens: [[f32; 2]; MOST_SEGMENTS],
    count: usize,
}

/// A stored vertex: the number of its path, and the number of its vertices up to this one.
pub type StoredVertex = (usize, usize);

/// The vertex or light before a vertex of a light path.
pub(super) struct Before {
    position: Option<Vec3>,
    direction: Vec3,
}

impl Before {
    /// Unit direction of light from here to `vertex`.
    pub(super) fn direction_to(&self, vertex: &PathVertex) -> Vec3 {
        self.position.map_or(self.direction, |from| (vertex.position - from).normalize())
    }
}

impl LightPath {
    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if it has none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Before its `count`th vertex.
    pub(super) fn before(&self, count: usize) -> Before {
        match count.checked_sub(2).and_then(|i| self.vertices.get(i)) {
            Some(vertex) => Before { position: Some(vertex.position), direction: Vec3::ZERO },
            None => Before { position: self.light.position, direction: -self.light.to_light },
        }
    }
}

/// Writes down light paths.
pub(super) struct Recorder<'r, 'a> {
    pub(super) reference: &'r Reference<'a>,
    pub(super) paths: &'r mut [LightPath],
    pub(super) stored: &'r mut [StoredVertex],
    pub(super) count: usize,
}

impl Visitor for Recorder<'_, '_> {
    const DIMENSIONS: u32 = DIMENSIONS;
    const SEED: u64 = SEED;

    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        _: &mut Counters,
    ) -> Option<Continuation> {
        let Vertex { point, bsdf, .. } = *vertex;
        if is_bent_at(point, vertex.to_light) {
            return None;
        }
        let path = self.paths.get_mut(state.number as usize)?;
        let count = state.segments as usize;
        if count == 1 {
            path.light = match self.reference.kind(state.light) {
                LightType::Area => Light::near(state.light, state.origin.into()),
                _ => Light::far(state.light, vertex.to_light),
            };
        } else {
            let left = path.vertices.get_mut(count - 2)?;
            (left.is_delta, left.eta) = (state.from_caster == 1, f64::from(state.chain_ratio));
        }
        let [u, v] = vertex.barycentric;
        let slot = path.vertices.get_mut(count - 1)?;
        *slot = PathVertex::at(point, &Hit { t: 0.0, u, v, triangle: point.triangle });
        (path.power[count - 1], path.lens[count - 1]) = (state.power.into(), vertex.visitor_pair());
        path.count = count;
        if !bsdf.is_delta() {
            *self.stored.get_mut(self.count)? = (state.number as usize, count);
            self.count += 1;
        }
        Some(continuation(vertex.bsdf))
    }

    fn leave(&self, state: &mut LightPathState, _: &Vertex, _: Vec3, (sample, _): (&BsdfSample, bool)) {
        (state.from_caster, state.chain_ratio) = (u32::from(sample.delta), sample.eta);
    }
}
