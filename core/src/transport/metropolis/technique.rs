//! Techniques of bidirectional path tracing, and the one that a point of primary sample space chooses.

use super::numbers::TECHNIQUE;

/// A technique for paths of one length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Technique {
    /// The camera subpath meets a light.
    Hit,
    /// Light sample at the end of the camera subpath.
    LightSample,
    /// Connection with a light subpath of this number of segments.
    Connection(u32),
    /// Splat of the light subpath's end.
    Splat,
}

impl Technique {
    /// Number of techniques for paths of `segments`.
    pub(super) fn count(segments: u32) -> u32 {
        if segments == 1 { 1 } else { segments + 1 }
    }

    /// The technique that number `u` in [0, 1) chooses.
    fn choose(segments: u32, u: f32) -> Self {
        let count = Self::count(segments);
        match ((u * count as f32) as u32).min(count - 1) {
            0 => Self::Hit,
            1 => Self::LightSample,
            number if number == segments => Self::Splat,
            number => Self::Connection(number - 1),
        }
    }

    /// Segments of the light subpath and of the camera subpath.
    pub(super) fn subpaths(self, segments: u32) -> [u32; 2] {
        match self {
            Self::Hit => [0, segments],
            Self::LightSample => [0, segments - 1],
            Self::Connection(light) => [light, segments - 1 - light],
            Self::Splat => [segments - 1, 0],
        }
    }
}

/// The technique of a point.
pub(super) fn technique(segments: u32, numbers: &[f32]) -> Technique {
    Technique::choose(segments, numbers.get(TECHNIQUE).copied().unwrap_or_default())
}
