//! Half floats (IEEE 754 binary16) as bits: conversions to and from f32.

/// Value of a half float, exact. A signalling NaN becomes quiet, as in F16C.
#[inline(always)]
pub fn to_f32(half: u16) -> f32 {
    let (sign, rest) = (u32::from(half & 0x8000) << 16, u32::from(half & 0x7fff));
    let magnitude = if rest >= 0x7c00 {
        let quiet = if rest > 0x7c00 { 0x40_0000 } else { 0 };
        0x7f80_0000 | quiet | (rest & 0x3ff) << 13
    } else {
        // 2¹¹² moves the bias of the exponent from 15 to 127, denormals included.
        (f32::from_bits(rest << 13) * f32::from_bits((127 + 112) << 23)).to_bits()
    };
    f32::from_bits(sign | magnitude)
}

/// Nearest half float, ties to even; infinite beyond 65519.
#[inline(always)]
pub fn from_f32(value: f32) -> u16 {
    let bits = value.to_bits();
    let (sign, rest) = ((bits >> 16 & 0x8000) as u16, bits & 0x7fff_ffff);
    if rest > 0x7f80_0000 {
        return sign | 0x7e00;
    }
    if rest < (127 - 14) << 23 {
        // The sum with ½ rounds to multiples of 2⁻²⁴, the denormals.
        let rounded = f32::from_bits(rest) + 0.5;
        return sign | (rounded.to_bits() - 0.5f32.to_bits()) as u16;
    }
    let odd = rest >> 13 & 1;
    let rounded = (rest + 0xfff + odd) >> 13;
    sign | (rounded.min((127 - 15 + 31) << 10) - ((127 - 15) << 10)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_in_both_directions() {
        let pairs = [
            (0.0, 0x0000),
            (-0.0, 0x8000),
            (1.0, 0x3c00),
            (-2.0, 0xc000),
            (65504.0, 0x7bff),
            (f32::INFINITY, 0x7c00),
            (5.960_464_5e-8, 0x0001),
            (6.103_515_6e-5, 0x0400),
            (0.333_251_95, 0x3555),
        ];
        for (value, half) in pairs {
            assert_eq!(to_f32(half).to_bits(), f32::to_bits(value));
            assert_eq!(from_f32(value), half);
        }
        // Rounding: ties to even, overflow, underflow.
        for (value, half) in [
            (1.0 + 1.0 / 2048.0, 0x3c00),
            (1.0 + 3.0 / 2048.0, 0x3c02),
            (65519.0, 0x7bff),
            (65520.0, 0x7c00),
            (f32::MAX, 0x7c00),
            (2.9e-8, 0x0000),
            (3.0e-8, 0x0001),
            (f32::NAN, 0x7e00),
        ] {
            assert_eq!(from_f32(value), half, "{value}");
        }
    }

    #[test]
    fn every_half_float_survives() {
        for half in 0..=u16::MAX {
            let value = to_f32(half);
            assert!(value.is_nan() || from_f32(value) == half, "{half:x}");
        }
    }
}
