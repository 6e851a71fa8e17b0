//! False colours for error maps: black, violet, red, orange, pale yellow. Lightness rises all the way,
//! so that the map reads in grey as well.

const STOPS: [[f32; 3]; 5] =
    [[0.0, 0.0, 0.02], [0.32, 0.07, 0.48], [0.72, 0.21, 0.47], [0.99, 0.53, 0.38], [0.99, 0.99, 0.75]];

/// Display colour of an error in [0, 1].
pub(super) fn colour(error: f32) -> [f32; 3] {
    // `max` drops the NaN.
    let place = error.clamp(0.0, 1.0).max(0.0) * (STOPS.len() - 1) as f32;
    let below = (place as usize).min(STOPS.len() - 2);
    let share = place - below as f32;
    core::array::from_fn(|c| STOPS[below][c] + (STOPS[below + 1][c] - STOPS[below][c]) * share)
}
