//! Parsers of flag values: `1,2,3`, `640x480`, `90s`, `512M`.

use core::str::FromStr;
use halflight::render::Shard;
use halflight::values::{FieldOfView, NotNegative, Number, Positive, Seconds, Size};
use halflight_core::cache::irradiance::Metric;
use halflight_core::cache::radiance::Basis;
use halflight_simd::Tier;

/// Number of a checked type.
pub(super) fn checked<N: FromStr, T: TryFrom<N, Error = &'static str>>(text: &str) -> Result<T, String> {
    let number: N = text.trim().parse().map_err(|_| match text.trim().parse::<f64>() {
        Ok(_) => format!("`{text}` is not a whole number of at least 0"),
        Err(_) => format!("`{text}` is not a number"),
    })?;
    Ok(number.try_into()?)
}

/// Vector `X,Y,Z`.
pub(super) fn vector(text: &str) -> Result<[f64; 3], String> {
    let number = |text| checked::<f64, Number>(text).map(f64::from);
    let numbers = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    numbers.try_into().map_err(|_| "three numbers are expected, as in 0,1.5,-2".into())
}

/// Lens `RADIUS[,DISTANCE]`.
pub(super) fn lens(text: &str) -> Result<Lens, String> {
    let (radius, distance) = match text.split_once(',') {
        Some((radius, distance)) => (radius, Some(positive(distance)?)),
        None => (text, None),
    };
    Ok(Lens { radius: not_negative(radius)?, distance })
}

/// Radius of the lens, and the distance in focus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lens {
    pub(super) radius: f64,
    pub(super) distance: Option<f64>,
}

/// Vertical field of view in degrees.
pub(super) fn field_of_view(text: &str) -> Result<f64, String> {
    checked::<f64, FieldOfView>(text).map(f64::from)
}

/// Size `WxH` in pixels.
pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let size = sides.and_then(|sides: [u32; 2]| Size::try_from(sides).ok()).map(<[u32; 2]>::from);
    size.ok_or("width and height are expected, as in 640x480; at most 2^20 a side and 2^28 pixels".into())
}

/// Number of probes along each axis, `NXxNYxNZ`.
pub(super) fn grid(text: &str) -> Result<[u32; 3], String> {
    let sides = text.split(['x', 'X']).map(|side| side.parse().ok().filter(|side| *side > 0));
    let grid = sides.collect::<Option<Vec<u32>>>().and_then(|sides| sides.try_into().ok());
    grid.ok_or("three numbers of probes are expected, as in 8x4x8".into())
}

/// Box `X0,Y0,Z0,X1,Y1,Z1`: two corners.
pub(super) fn bounds(text: &str) -> Result<[[f64; 3]; 2], String> {
    let number = |text| checked::<f64, Number>(text).map(f64::from);
    let numbers = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    match numbers[..] {
        [a, b, c, d, e, f] if a < d && b < e && c < f => Ok([[a, b, c], [d, e, f]]),
        _ => Err("a lower and a higher corner are expected, as in -1,0,-1,1,2,1".into()),
    }
}

/// Time in seconds: `30s`, `2m`, `1.5h`, `250ms`, or a number of seconds.
pub(super) fn duration(text: &str) -> Result<f64, String> {
    let units = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0), ("", 1.0)];
    let seconds = with_unit(text, &units).and_then(|seconds| Seconds::try_from(seconds).ok());
    seconds.map(f64::from).ok_or("a time is expected, as in 30s, 2m or 1h".into())
}

/// Bytes: `64K`, `512M`, `2G`, `1T` in powers of 1024, or a number of bytes.
pub(super) fn bytes(text: &str) -> Result<usize, String> {
    let plain = text.strip_suffix("iB").or(text.strip_suffix('B')).unwrap_or(text);
    let units =
        [("K", 1024.0), ("M", 1024f64.powi(2)), ("G", 1024f64.powi(3)), ("T", 1024f64.powi(4)), ("", 1.0)];
    with_unit(plain, &units)
        .filter(|bytes| *bytes >= 1.0)
        .map(|bytes| bytes as usize)
        .ok_or("a number of bytes is expected, as in 512M or 2G".into())
}

/// Instruction set by name.
pub(super) fn tier(name: &str) -> Result<Tier, String> {
    let names = Tier::ALL.map(Tier::name).join(", ");
    Tier::named(name).ok_or(format!("the levels are {names}"))
}

/// Error metric of the irradiance cache by name.
pub(super) fn metric(name: &str) -> Result<Metric, String> {
    let names = Metric::ALL.map(Metric::name).join(", ");
    Metric::named(name).ok_or(format!("the metrics are {names}"))
}

/// Basis of radiance coefficients by name.
pub(super) fn basis(name: &str) -> Result<Basis, String> {
    let names = Basis::ALL.map(Basis::name).join(", ");
    Basis::named(name).ok_or(format!("the bases are {names}"))
}

/// Gather rays of a record: squares of multiples of 8.
pub(super) fn gather_rays(text: &str) -> Result<u32, String> {
    let known = text.parse().ok().filter(|rays| [64, 256, 576, 1024, 2304, 4096].contains(rays));
    known.ok_or("64, 256, 576, 1024, 2304 or 4096 rays are expected".into())
}

/// Shard `I/N`, counted from 1.
pub(super) fn shard(text: &str) -> Result<Shard, String> {
    let (index, count) = text
        .split_once('/')
        .and_then(|(index, count)| Some((index.parse::<u32>().ok()?, count.parse::<u32>().ok()?)))
        .filter(|(index, count)| (1..=*count).contains(index))
        .ok_or("a shard is expected, as in 1/4, the first of four")?;
    Ok(Shard::part(index - 1, count))
}

/// Share of the work for the audit: `5%`, `0.05`, or `off`.
pub(super) fn audit(text: &str) -> Result<f64, String> {
    if text == "off" {
        return Ok(0.0);
    }
    let share = match text.strip_suffix('%') {
        Some(percent) => finite(percent.trim())? / 100.0,
        None => finite(text)?,
    };
    let usable = share > 0.0 && share <= 0.5;
    usable.then_some(share).ok_or("a share up to a half is expected, as in 5%, or off".into())
}

/// Number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    checked::<f64, Positive>(text).map(f64::from)
}

/// Number of at least 0.
pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    checked::<f64, NotNegative>(text).map(f64::from)
}

fn finite(text: &str) -> Result<f64, String> {
    f64::from_str(text).ok().filter(|number| number.is_finite()).ok_or(format!("`{text}` is not a number"))
}

/// Finite number with the first of the units that fits.
fn with_unit(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    units.iter().find_map(|(unit, factor)| {
        let number = finite(text.strip_suffix(unit)?).ok()? * factor;
        number.is_finite().then_some(number)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_parse_with_units() {
        assert_eq!(vector("-1,2.5,3e2"), Ok([-1.0, 2.5, 300.0]));
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert_eq!(
            [duration("30s"), duration("2m"), duration("1h"), duration("90")],
            [30.0, 120.0, 3600.0, 90.0].map(Ok)
        );
        assert_eq!(duration("250ms"), Ok(0.25));
        assert_eq!(
            [bytes("512M"), bytes("2G"), bytes("1KiB"), bytes("77")],
            [512 << 20, 2 << 30, 1024, 77].map(Ok)
        );
        assert_eq!(lens("0.1,3"), Ok(Lens { radius: 0.1, distance: Some(3.0) }));
        assert_eq!(
            [shard("1/1"), shard("3/4")],
            [(0, 1), (2, 4)].map(|(index, count)| Ok(Shard::part(index, count)))
        );
        assert_eq!((field_of_view("40"), positive("0.01")), (Ok(40.0), Ok(0.01)));
        assert_eq!([audit("5%"), audit("0.25"), audit("off")], [Ok(0.05), Ok(0.25), Ok(0.0)]);
    }

    #[test]
    fn invalid_values_are_refused() {
        for text in ["", "1,2", "1,2,3,4", "a,b,c", "1,nan,3", "1,2,inf"] {
            assert!(vector(text).is_err(), "{text}");
        }
        for text in ["", "640", "0x480", "640x", "-1x5", "1.5x2", "2000000x1", "1000000x1000000"] {
            assert!(size(text).is_err(), "{text}");
        }
        for text in ["", "s", "0", "-1s", "5d", "nan", "inf", "1e300h1"] {
            assert!(duration(text).is_err(), "{text}");
        }
        for text in ["", "M", "0", "-5M", "1Q", "0.5"] {
            assert!(bytes(text).is_err(), "{text}");
        }
        for text in ["", "0/4", "5/4", "4", "1/0", "-1/2", "a/b"] {
            assert!(shard(text).is_err(), "{text}");
        }
        for text in ["", "%", "0%", "51%", "-1%", "nan", "none"] {
            assert!(audit(text).is_err(), "{text}");
        }
        for text in ["0", "178", "-40", "wide"] {
            assert!(field_of_view(text).is_err(), "{text}");
        }
    }
}
