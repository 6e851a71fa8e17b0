//! A technique of one lane, and the numbers that its vertices take from blocks.

use super::lanes::Lanes;
use super::numbers::Point;
use super::technique::Technique;
use crate::transport::walk::shading::VertexNumbers;

/// A technique of one lane.
pub(super) struct Lane<'p> {
    pub(super) number: usize,
    pub(super) segments: u32,
    pub(super) technique: Technique,
    pub(super) point: Point<'p>,
}

impl Lane<'_> {
    /// Segments of its light subpath, and the numbers of the vertex under way; `None` at the last.
    #[inline]
    pub(super) fn of_light(&self, lanes: &Lanes) -> Option<(u32, VertexNumbers)> {
        let segments = lanes.lights.get(self.number)?.subpath.segments;
        let goes_on = segments < self.technique.subpaths(self.segments)[0];
        goes_on.then(|| {
            let scattering = Some(self.point.scattering(segments, true));
            (segments, VertexNumbers::Given { light: None, scattering })
        })
    }

    /// The same of its camera subpath, whose last vertex may take a light sample.
    #[inline]
    pub(super) fn of_camera(&self, lanes: &Lanes) -> Option<(u32, VertexNumbers)> {
        let segments = lanes.cameras.get(self.number)?.segments;
        let (light, scattering) = match self.technique {
            _ if segments < self.technique.subpaths(self.segments)[1] => {
                (None, Some(self.point.scattering(segments, false)))
            }
            Technique::LightSample => (Some(self.point.light_sample()), None),
            _ => return None,
        };
        Some((segments, VertexNumbers::Given { light, scattering }))
    }
}
