//! False colours, as display values. Errors: black, violet, red, orange, pale yellow, with increasing
//! lightness, so that the map is readable in grey. Signed errors: blue below zero, white at zero, red above.

type Stops = [[f32; 3]; 5];

/// Colours of errors, evenly spaced from 0 to 1.
pub(crate) const HEAT: Stops =
    [[0.0, 0.0, 0.02], [0.32, 0.07, 0.48], [0.72, 0.21, 0.47], [0.99, 0.53, 0.38], [0.99, 0.99, 0.75]];

/// Colours of signed errors, evenly spaced from −1 to 1.
pub(crate) const SIGNED: Stops =
    [[0.02, 0.19, 0.45], [0.31, 0.61, 0.85], [0.97, 0.97, 0.97], [0.94, 0.53, 0.36], [0.50, 0.04, 0.08]];

/// Display colour of an error in [0, 1].
pub(crate) fn heat(error: f32) -> [f32; 3] {
    interpolate(&HEAT, error)
}

/// Display colour of a signed error in [−1, 1].
pub(crate) fn signed(error: f32) -> [f32; 3] {
    interpolate(&SIGNED, 0.5 + 0.5 * error)
}

fn interpolate(stops: &Stops, position: f32) -> [f32; 3] {
    // `max` drops NaN.
    let position = position.clamp(0.0, 1.0).max(0.0) * (stops.len() - 1) as f32;
    let below = (position as usize).min(stops.len() - 2);
    let fraction = position - below as f32;
    core::array::from_fn(|c| stops[below][c] + (stops[below + 1][c] - stops[below][c]) * fraction)
}
