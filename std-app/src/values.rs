//! Quantities of flags and scene files. Each has one type, which refuses senseless values, so that both are
//! checked alike: flags when they are parsed, keys with their line and column.

use crate::render::Method;
use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// Largest number: beyond it, f32 has no room for a change of scale.
const LARGEST: f64 = 1e30;

/// Longest side of a picture in pixels, a limit of formats and of raster coordinates.
const MAX_SIDE: u32 = 1 << 20;

macro_rules! checked {
    ($($(#[$meta:meta])* $type:ident($inner:ty): $x:ident => $valid:expr, $problem:literal;)*) => {$(
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $type($inner);

        impl TryFrom<$inner> for $type {
            type Error = &'static str;

            fn try_from($x: $inner) -> Result<Self, Self::Error> {
                if $valid { Ok(Self($x)) } else { Err($problem) }
            }
        }

        impl From<$type> for $inner {
            fn from(value: $type) -> $inner {
                value.0
            }
        }

        impl<'de> Deserialize<'de> for $type {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                <$inner>::deserialize(deserializer)?.try_into().map_err(D::Error::custom)
            }
        }
    )*};
}

checked! {
    /// A finite number.
    #[derive(Default)]
    Number(f64): x => x.abs() <= LARGEST, "this number must be finite and at most 1e30 in size";
    /// A finite number, zero or above.
    #[derive(Default)]
    NotNegative(f64): x => (0.0..=LARGEST).contains(&x), "a number from 0 to 1e30 is expected";
    /// A finite number above zero.
    Positive(f64): x => (1.0 / LARGEST..=LARGEST).contains(&x), "a number above 0 is expected, 1e-30 to 1e30";
    /// A factor on lengths, which does not flatten what it scales.
    Factor(f64): x => (1.0 / LARGEST..=LARGEST).contains(&x.abs()), "a factor has a size from 1e-30 to 1e30";
    /// A part of a whole.
    Fraction(f64): x => (0.0..=1.0).contains(&x), "this number must lie between 0 and 1";
    /// An index of refraction, within the limits of the MTL specification.
    RefractiveIndex(f64): x => (0.001..=100.0).contains(&x), "an index of refraction is 0.001 to 100";
    /// The vertical field of view in degrees.
    FieldOfView(f64): x => x > 0.0 && x < 178.0, "a field of view is more than 0 and less than 178 degrees";
    /// An angle in degrees.
    Degrees(f64): x => (0.0..=180.0).contains(&x), "this angle must lie between 0 and 180 degrees";
    /// The half-angle in degrees of a cone that is not empty: f32 has a cosine below 1 for it.
    ConeAngle(f64): x => (0.05..=180.0).contains(&x), "the angle of a cone is from 0.05 to 180 degrees";
    /// Degrees of latitude, north positive.
    Latitude(f64): x => x.abs() <= 90.0, "a latitude is -90 to 90 degrees";
    /// Degrees of longitude, east positive.
    Longitude(f64): x => x.abs() <= 360.0, "a longitude is -180 to 180 degrees, east positive";
    /// Turbidity of the air.
    Turbidity(f64): x => (1.0..=10.0).contains(&x), "turbidity is 1 (pure air) to 10 (haze)";
    /// Seconds of rendering.
    Seconds(f64): x => x > 0.0 && x < f64::INFINITY, "a time is a finite number of seconds above 0";
    /// A relMSE at which to stop. Rounding of f32 alone has one of 1e-15.
    TargetError(f64): x => (1e-15..=LARGEST).contains(&x), "an error to stop at is 1e-15 to 1e30";
    /// Samples per pixel.
    Samples(u32): x => (1..=1 << 30).contains(&x), "samples per pixel are a number from 1 to 2^30";
    /// Segments of the longest path; 1: directly visible light.
    Depth(u32): x => x > 0, "a path has at least 1 segment";
    /// Width and height of a picture in pixels.
    Size([u32; 2]): x => x.iter().all(|side| (1..=MAX_SIDE).contains(side))
        && x[0] as usize * x[1] as usize <= crate::picture::MAX_PIXELS,
        "width and height are numbers from 1 to 2^20, with at most 2^28 pixels in all";
}

/// Name of a method in any case; `None` for `auto`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct MethodName(pub Option<Method>);

impl TryFrom<String> for MethodName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, Self::Error> {
        let lower = name.to_ascii_lowercase();
        let method = Method::named(&lower);
        if method.is_none() && lower != "auto" {
            let names = Method::ALL.map(Method::name).join(", ");
            return Err(format!("there is no method `{name}`, expected one of auto, {names}"));
        }
        Ok(Self(method))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn senseless_numbers_are_refused() {
        for x in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e31] {
            let refused = [
                Number::try_from(x).is_err(),
                NotNegative::try_from(x).is_err(),
                Positive::try_from(x).is_err(),
                Factor::try_from(x).is_err(),
                Fraction::try_from(x).is_err(),
                RefractiveIndex::try_from(x).is_err(),
                FieldOfView::try_from(x).is_err(),
                Degrees::try_from(x).is_err(),
                ConeAngle::try_from(x).is_err(),
                TargetError::try_from(x).is_err(),
                Seconds::try_from(x).is_err() || x == 1e31,
            ];
            assert_eq!(refused, [true; 11], "{x}");
        }
        for x in [0.0, -1.0] {
            assert!(Positive::try_from(x).is_err() && FieldOfView::try_from(x).is_err());
            assert!(ConeAngle::try_from(x).is_err() && RefractiveIndex::try_from(x).is_err());
            assert!(Seconds::try_from(x).is_err() && TargetError::try_from(x).is_err());
        }
        assert!(Factor::try_from(0.0).is_err() && Factor::try_from(-1.0).is_ok());
        assert!(Samples::try_from(0).is_err() && Samples::try_from(u32::MAX).is_err());
        assert!(Depth::try_from(0).is_err());
        for size in [[0, 5], [5, 0], [(1 << 20) + 1, 1], [1 << 15, 1 << 14], [u32::MAX; 2]] {
            assert_eq!(Size::try_from(size).is_err(), size != [1 << 14, 1 << 14], "{size:?}");
        }
        assert_eq!(Size::try_from([1 << 14, 1 << 14]).map(<[u32; 2]>::from), Ok([1 << 14; 2]));
    }

    #[test]
    fn methods_have_names_in_any_case() {
        assert_eq!(MethodName::try_from("Auto".to_owned()), Ok(MethodName(None)));
        assert_eq!(MethodName::try_from("BDPT".to_owned()), Ok(MethodName(Some(Method::Bidirectional))));
        let refused = MethodName::try_from("paths".to_owned()).unwrap_err();
        assert!(refused.starts_with("there is no method `paths`, expected one of auto, path"), "{refused}");
    }
}
