//! Quantities as text for people.

use halflight_core::findings::Value;

/// Bytes with one decimal, in powers of 1024.
pub fn readable_bytes(bytes: usize) -> String {
    let mut value = bytes as f64 / 1024.0;
    let mut units = ["KiB", "MiB", "GiB"].into_iter();
    let unit = units.find(|_| {
        let fits = value < 1000.0;
        value /= if fits { 1.0 } else { 1024.0 };
        fits
    });
    if bytes < 1024 { format!("{bytes} bytes") } else { format!("{value:.1} {}", unit.unwrap_or("TiB")) }
}

/// Seconds as `12 ms`, `3.2 s`, `2 min 05 s` or `2 h 01 min`.
pub fn readable_seconds(seconds: f64) -> String {
    match seconds {
        s if s < 0.0995 => format!("{:.0} ms", s * 1e3),
        s if s < 99.95 => format!("{s:.1} s"),
        s if s < 5400.0 => format!("{} min {:02} s", (s / 60.0) as u64, (s % 60.0) as u64),
        s => format!("{} h {:02} min", (s / 3600.0) as u64, (s / 60.0 % 60.0) as u64),
    }
}

/// Count with its noun, which takes an `s` in the plural.
pub fn plural(count: u64, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Name in snake case, with spaces.
pub fn readable_name(name: &str) -> String {
    name.replace('_', " ")
}

/// Value of a finding, with narrow no-break spaces.
pub fn readable_value(value: Value) -> String {
    match value {
        Value::Count(count) => grouped(count),
        Value::Seconds(seconds) => readable_seconds(seconds),
        Value::Fraction(fraction) => percent(fraction),
        Value::Number(value) => number(value, 3),
        Value::Name(name) => name.to_owned(),
        Value::Prediction { error, work, reason } if error.is_finite() => {
            format!("relMSE {}, {} rays a sample: {reason}", number(error, 2), number(work, 2))
        }
        Value::Prediction { reason, .. } => format!("no choice: {reason}"),
    }
}

/// Fraction as a percentage with two significant digits.
fn percent(fraction: f64) -> String {
    format!("{}\u{202f}%", number(100.0 * fraction, 2))
}

/// Count, with thin spaces between thousands from five digits on.
fn grouped(count: u64) -> String {
    let digits = count.to_string();
    if digits.len() < 5 {
        return digits;
    }
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// Number with `digits` significant digits, plain from 0.01 to 9999 and otherwise as 2.4 × 10⁻³.
fn number(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return if value.is_nan() { "unknown".into() } else { format!("{}∞", minus(value)) };
    }
    // Rounding may carry into the next decade, so the formatter determines the exponent.
    let scientific = format!("{:.*e}", digits.saturating_sub(1), value.abs());
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or_default();
    let text = match exponent {
        0..=3 => format!("{:.*}", (digits as i32 - 1 - exponent).max(0) as usize, value.abs()),
        -2..=-1 => format!("{:.*}", (digits as i32 - 1 - exponent) as usize, value.abs()),
        _ => format!("{mantissa} × 10{}", superscript(exponent)),
    };
    minus(value).to_owned() + &text
}

fn minus(value: f64) -> &'static str {
    if value < 0.0 { "−" } else { "" }
}

fn superscript(exponent: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        // ⁰ and ⁴ to ⁹ are consecutive.
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or_default()).unwrap_or(digit),
    };
    exponent.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_short_texts() {
        assert_eq!(
            [0, 1023, 1024, 90 << 20, 1000 << 30, 3 << 50].map(readable_bytes),
            ["0 bytes", "1023 bytes", "1.0 KiB", "90.0 MiB", "1.0 TiB", "3072.0 TiB"]
        );
        assert_eq!(
            [0.012, 3.21, 125.0, 7260.0].map(readable_seconds),
            ["12 ms", "3.2 s", "2 min 05 s", "2 h 01 min"]
        );
        assert_eq!([7, 1234, 12_345_678].map(grouped), ["7", "1234", "12\u{202f}345\u{202f}678"]);
        assert_eq!(
            [0.0, 0.999, 9.99, -0.0123, 2.4e-3, 1.5e17, 4096.0, 0.0999, f64::INFINITY].map(|x| number(x, 2)),
            ["0", "1.0", "10", "−0.012", "2.4 × 10⁻³", "1.5 × 10¹⁷", "4096", "0.10", "∞"]
        );
    }
}
