//! Counts of the techniques of bidirectional methods: given by the options, or chosen by a pilot.

use super::{MethodKind, MethodSetup};
use crate::bsdf::Features;
use crate::memory::{MemorySource, OutOfMemory};
use crate::method::Executor;
use crate::method::bidirectional::BidirectionalSettings;
use crate::method::counts::{self, Choice};

/// Counts of `kind` as far as they are `given`; others are open.
pub(super) fn given(kind: MethodKind, given: &BidirectionalSettings) -> BidirectionalSettings {
    match kind {
        MethodKind::LightTracing => {
            let light_paths = given.light_paths;
            BidirectionalSettings { light_paths, ..BidirectionalSettings::LIGHT_TRACING }
        }
        MethodKind::Bidirectional => BidirectionalSettings { merging: Some(false), ..*given },
        _ => *given,
    }
}

/// The counts that suit the picture, where `given` leaves them open, by a pilot with one pixel for each
/// `part` of the picture.
pub(super) fn choose<'a: 'm, 'm, F: Features>(
    setup: &MethodSetup<'a, '_>,
    pilot: (&BidirectionalSettings, usize, bool),
    memory: &mut impl MemorySource<'m>,
    executor: &mut impl Executor,
) -> Result<Option<Choice>, OutOfMemory> {
    counts::choose::<F>(&setup.context, pilot, &mut memory.within(), executor)
}
