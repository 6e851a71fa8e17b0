//! The way by which light comes to a vertex where it is merged.

/// The way by which light comes to a vertex where it is merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arrival {
    /// From a caster.
    FromCaster,
    /// From a rough vertex that is near.
    FromNear,
}

impl Arrival {
    /// From a caster, or from a rough vertex at this `squared` distance to one whose merges count η, by
    /// `MergeRadii::near`: about there merges and connections are as good as each other. `None` where light
    /// is not merged.
    pub(super) fn of(from_caster: bool, squared: f32, near: f32) -> Option<Self> {
        match from_caster {
            true => Some(Arrival::FromCaster),
            false => (squared < near).then_some(Arrival::FromNear),
        }
    }

    /// True if light is merged that comes so to the vertex at the end of segment `segments` of a camera path.
    pub(super) fn is_merged(self, segments: u32) -> bool {
        self == Arrival::FromCaster || segments > 1
    }
}
