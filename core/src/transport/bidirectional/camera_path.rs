//! A camera path in progress, the vertex that it has come to, and the shadow rays of its wave.

use crate::Rgb;
use crate::geometry::Ray;
use crate::sampling::Sampler;
use crate::transport::bidirectional::contribution::{Class, Contribution};
use crate::transport::walk::history::{History, Rest};
use crate::transport::walk::shadow_tag::ShadowTag;
use crate::transport::walk::subpath::{Subpath, Vertex};
use crate::transport::walk::visibility::ShadowRays;
use bytemuck::{Pod, Zeroable};

/// A camera path between two of its vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CameraPath {
    pub(super) subpath: Subpath,
    pub(super) radiance: [f32; 3],
    /// The part of `radiance` by which merges are too bright for their width.
    pub(super) blur: [f32; 3],
    /// Index of the pixel in its tile.
    pub(super) place: u32,
    /// Index of the pixel in the picture.
    pub(super) pixel: u32,
    /// 1 behind the first rough vertex.
    pub(super) has_rough: u32,
    /// η: count of merges at the last vertex.
    pub(super) eta_vcm: f32,
    /// m: length from the lens to the last vertex.
    pub(super) travelled: f32,
    /// Product of the squared relative indices of refraction.
    pub(super) eta_squared: f32,
    /// Random numbers of the lens, which the first vertex is projected with.
    pub(super) lens: [f32; 2],
    /// Rough vertices so far, for the pilot of counts.
    pub(super) history: History,
}

impl CameraPath {
    pub(super) fn add(&mut self, radiance: Rgb) {
        if radiance.is_finite() {
            self.radiance = (Rgb::from(self.radiance) + radiance).to_array();
        }
    }

    pub(super) fn add_blur(&mut self, blur: Rgb) {
        if blur.is_finite() {
            self.blur = (Rgb::from(self.blur) + blur).to_array();
        }
    }

    /// True if a rough vertex lies behind it.
    pub(super) fn has_rough(&self) -> bool {
        self.has_rough == 1
    }
}

/// A vertex that a path has arrived at.
pub(super) struct CameraVertex<'v> {
    pub(super) vertex: Vertex<'v>,
    /// No rough vertex lies before it.
    pub(super) is_first_rough: bool,
    /// η: count of merges here, 0 where there is none.
    pub(super) eta_vcm: f32,
    pub(super) sampler: Sampler,
}

/// Shadow rays of a wave.
pub(super) struct Queue<'w> {
    pub(super) shadows: ShadowRays<'w>,
    /// For the pilot of counts.
    pub(super) recorder: Option<Recorder<'w>>,
}

impl Queue<'_> {
    pub(super) fn push(&mut self, (class, rest): (Class, Rest), path: u32, ray: Ray, light: Rgb) {
        let is_connection = class == Class::Connections;
        if let Some(recorder) = &mut self.recorder {
            recorder.connections += u64::from(is_connection);
        }
        let ShadowTag(tag) = ShadowTag::of_technique(path, is_connection, rest);
        self.shadows.push(Ray { tag, ..ray }, light);
    }

    /// Records what `path` has got since it had `before`.
    pub(super) fn record(&mut self, class: Class, rest: Rest, path: &CameraPath, before: [f32; 3]) {
        if let Some(recorder) = &mut self.recorder {
            recorder.push((class, rest), path.place, Rgb::from(path.radiance) - Rgb::from(before));
        }
    }
}

/// A list of contributions.
pub(super) struct Recorder<'w> {
    pub(super) list: &'w mut [Contribution],
    pub(super) count: usize,
    /// Shadow rays of connections.
    pub(super) connections: u64,
}

impl Recorder<'_> {
    /// Appends `light` of pixel `place`; none where it is zero or the list is full.
    pub(super) fn push(&mut self, (class, rest): (Class, Rest), place: u32, light: Rgb) {
        let value = light.element_sum() / 3.0;
        if let Some(slot) = self.list.get_mut(self.count).filter(|_| value > 0.0) {
            *slot = Contribution::new(class, place, value).with_rest(rest);
            self.count += 1;
        }
    }
}
