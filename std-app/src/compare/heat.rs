//! False colours, as display values. Errors go from black over violet, red and orange to pale yellow: lightness
//! rises all the way, so that the map reads in grey as well. Signed errors are blue below zero, red above it
//! and white at it.

type Stops = [[f32; 3]; 5];

/// The colours of errors, at even distances from 0 to 1.
pub(crate) const HEAT: Stops =
    [[0.0, 0.0, 0.02], [0.32, 0.07, 0.48], [0.72, 0.21, 0.47], [0.99, 0.53, 0.38], [0.99, 0.99, 0.75]];

/// The colours of signed errors, at even distances from −1 to 1.
pub(crate) const SIGNED: Stops =
    [[0.02, 0.19, 0.45], [0.31, 0.61, 0.85], [0.97, 0.97, 0.97], [0.94, 0.53, 0.36], [0.50, 0.04, 0.08]];

/// Display colour of an error in [0, 1].
pub(crate) fn heat(error: f32) -> [f32; 3] {
    between(&HEAT, error)
}

/// Display colour of a signed error in [−1, 1].
pub(crate) fn signed(error: f32) -> [f32; 3] {
    between(&SIGNED, 0.5 + 0.5 * error)
}

fn between(stops: &Stops, place: f32) -> [f32; 3] {
    // `max` drops the NaN.
    let place = place.clamp(0.0, 1.0).max(0.0) * (stops.len() - 1) as f32;
    let below = (place as usize).min(stops.len() - 2);
    let share = place - below as f32;
    core::array::from_fn(|c| stops[below][c] + (stops[below + 1][c] - stops[below][c]) * share)
}
