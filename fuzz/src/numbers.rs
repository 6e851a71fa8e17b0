//! Numbers for fuzzing: mostly ordinary ones on a coarse grid, so that values coincide; some from the
//! extremes of f32.

use arbitrary::{Result, Unstructured};

/// A coordinate.
pub(crate) fn coordinate(input: &mut Unstructured) -> Result<f32> {
    let [kind, value] = input.arbitrary::<[u8; 2]>()?;
    let grid = f32::from(value as i8);
    Ok(match kind {
        0..200 => grid * 0.25,
        200..210 => grid * 1e-20,
        210..220 => grid * 1e15,
        220..230 => 100_000.0 + grid * 0.0078125,
        230..240 => f32::from_bits(input.arbitrary()?),
        _ => SPECIAL[usize::from(value) % SPECIAL.len()],
    })
}

/// A point.
pub(crate) fn point(input: &mut Unstructured) -> Result<[f32; 3]> {
    Ok([coordinate(input)?, coordinate(input)?, coordinate(input)?])
}

/// A point within the range of the ray tracer's arithmetic, or not finite. Products of three coordinates must
/// neither overflow nor vanish, as the error bound of a zero area would. Scenes are scaled to the order of 1
/// before tracing.
pub(crate) fn traceable_point(input: &mut Unstructured) -> Result<[f32; 3]> {
    const RANGE: core::ops::RangeInclusive<f32> = 1e-10..=1e10;
    let within = |x: f32| if RANGE.contains(&x.abs()) || !x.is_finite() { x } else { 0.0f32.copysign(x) };
    Ok(point(input)?.map(within))
}

const SPECIAL: [f32; 12] = [
    0.0,
    -0.0,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    1e-45,
    f32::EPSILON,
    1.0,
    -1.0,
];

/// A number in [0, 1), often near the ends.
pub(crate) fn fraction(input: &mut Unstructured) -> Result<f32> {
    const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
    let bits: u16 = input.arbitrary()?;
    Ok(match bits % 16 {
        0 => [0.0, BELOW_ONE, 0.5, 1e-10][usize::from(bits >> 4) % 4],
        _ => f32::from(bits) / 65536.0,
    })
}
