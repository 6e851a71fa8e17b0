//! The way by which light comes to a vertex where it is merged.

/// The way by which light comes to a vertex where it is merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arrival {
    /// From a narrow vertex.
    Narrow,
    /// From a rough one that is near.
    Near,
}

impl Arrival {
    /// From a vertex that `is_narrow`, or at this squared distance, to one with a count of merges η, by
    /// `MergeRadii::near`: about there merges and connections are as good as each other. `None` where light
    /// is not merged.
    pub(super) fn of(is_narrow: bool, squared: f32, near: f32) -> Option<Self> {
        match is_narrow {
            true => Some(Arrival::Narrow),
            false => (squared < near).then_some(Arrival::Near),
        }
    }

    /// Whether light is merged that comes so to the vertex at the end of segment `segments` of a camera path.
    pub(super) fn is_merged(self, segments: u32) -> bool {
        self == Arrival::Narrow || segments > 1
    }
}
