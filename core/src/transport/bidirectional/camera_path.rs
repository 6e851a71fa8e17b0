//! A camera path in progress, the vertex that it has come to, and the shadow rays of its wave.

use crate::Rgb;
use crate::bsdf::Bsdf;
use crate::geometry::Ray;
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::bidirectional::contribution::{Class, Contribution};
use crate::transport::bidirectional::mis::Sums;
use crate::transport::bidirectional::shaded::Shaded;
use crate::transport::walk::history::{History, Rest};
use crate::transport::walk::visibility::ShadowRays;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A camera path between two of its vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CameraPath {
    pub(super) throughput: [f32; 3],
    /// Density of the ray's direction per solid angle; infinite after a delta lobe and at the lens.
    pub(super) pdf: f32,
    pub(super) radiance: [f32; 3],
    /// The part of `radiance` by which merges are too bright for their width.
    pub(super) blur: [f32; 3],
    /// Index of the pixel in its tile.
    pub(super) place: u32,
    /// Index of the pixel in the picture.
    pub(super) pixel: u32,
    /// The last vertex, and its normal for light sampling.
    pub(super) position: [f32; 3],
    pub(super) normal: [f32; 3],
    /// Sums after the last scattering.
    pub(super) sums: Sums,
    pub(super) segments: u32,
    /// 1 behind the first rough vertex.
    pub(super) has_rough: u32,
    /// η: count of merges at the last vertex.
    pub(super) eta_vcm: f32,
    /// m: length from the lens to the last vertex.
    pub(super) travelled: f32,
    pub(super) crossings: u32,
    /// Triangle that the ray starts on.
    pub(super) triangle: u32,
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

    /// Sums for a light at the end of the segment. No light path splats direct light.
    pub(super) fn sums_of_hit(&self) -> Sums {
        if self.segments == 2 { Sums::default() } else { self.sums }
    }
}

/// A vertex that a path has arrived at.
pub(super) struct Vertex<'v> {
    pub(super) point: &'v SurfacePoint<'v>,
    pub(super) bsdf: &'v Bsdf,
    /// Direction to the vertex before, local.
    pub(super) wo: Vec3,
    /// Sums on arrival.
    pub(super) sums: Sums,
    /// No rough vertex lies before it.
    pub(super) is_first_rough: bool,
    /// η: count of merges here, 0 where there is none.
    pub(super) eta_vcm: f32,
    /// The shading normal depends on the camera path: no light path can come here.
    pub(super) is_bent: bool,
    pub(super) sampler: Sampler,
    /// Its light sample and next ray, where they have been computed in lanes.
    pub(super) shaded: Option<Shaded<'v>>,
}

/// The bit of a shadow ray's tag that says that it belongs to a connection.
const CONNECTION: u32 = 1 << 31;

/// Least bit of the [`Rest`] in the tag.
const REST: u32 = 27;

/// Shadow rays of a wave, whose tag is the index of their path.
pub(super) struct Queue<'w> {
    pub(super) shadows: ShadowRays<'w>,
    pub(super) count: usize,
    /// For the pilot of counts.
    pub(super) recorder: Option<Recorder<'w>>,
}

impl Queue<'_> {
    pub(super) fn push(&mut self, (class, rest): (Class, Rest), path: u32, ray: Ray, light: Rgb) {
        let slots = (self.shadows.rays.get_mut(self.count), self.shadows.light.get_mut(self.count));
        if let (Some(slot), Some(arrives)) = slots {
            let connection = if class == Class::Connections { CONNECTION } else { 0 };
            let tag = path | connection | rest.bits() << REST;
            if let Some(recorder) = &mut self.recorder {
                recorder.connections += u64::from(class == Class::Connections);
            }
            (*slot, *arrives) = (Ray { tag, ..ray }, light.to_array());
            self.count += 1;
        }
    }

    /// The path of a shadow ray by its `tag`, its class and the rest that its light belongs to.
    pub(super) fn of_tag(tag: u32) -> (usize, (Class, Rest)) {
        let class = if tag & CONNECTION == 0 { Class::Paths } else { Class::Connections };
        let rest = Rest::from_bits(tag >> REST);
        ((tag & ((1 << REST) - 1)) as usize, (class, rest))
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
