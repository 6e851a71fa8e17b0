//! KTX 2.0 files of one 3D texture of half floats, without mip levels or compression (Khronos 2021).

use halflight_core::Rgb;
use std::io::{self, Write};

const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";

/// VK_FORMAT_R16G16B16A16_SFLOAT, which every GPU filters.
const FORMAT: u32 = 97;

/// Bytes of a channel.
const CHANNEL: u32 = 2;

/// Bytes of header, index and the entry of the one level.
const INDEX: u32 = 80 + 24;

/// Bytes of the description of the format, its length included.
const DESCRIPTION: u32 = 4 + 24 + 4 * 16;

/// Start of the texels, a multiple of their size.
const TEXELS: u32 = (INDEX + DESCRIPTION).next_multiple_of(4 * CHANNEL);

/// Writes a volume of linear colours, the first axis fastest.
///
/// # Errors
/// Those of `out`.
pub(super) fn write_volume(out: &mut dyn Write, size: [usize; 3], texels: &[Rgb]) -> io::Result<()> {
    let [width, height, depth] = size.map(|side| side as u32);
    let (layers, faces, levels, supercompression) = (0, 1, 1, 0);
    out.write_all(&IDENTIFIER)?;
    words(out, &[FORMAT, CHANNEL, width, height, depth, layers, faces, levels, supercompression])?;
    // Description; no keys and values; no global data.
    words(out, &[INDEX, DESCRIPTION, 0, 0, 0, 0, 0, 0])?;
    let bytes = (texels.len() * 4 * CHANNEL as usize) as u64;
    for number in [u64::from(TEXELS), bytes, bytes] {
        out.write_all(&number.to_le_bytes())?;
    }
    describe(out)?;
    out.write_all(&vec![0; (TEXELS - INDEX - DESCRIPTION) as usize])?;
    for texel in texels {
        for channel in texel.extend(1.0).to_array() {
            out.write_all(&half(channel).to_le_bytes())?;
        }
    }
    Ok(())
}

/// Bits of the half float next to `value`, which is at most the largest one.
fn half(value: f32) -> u16 {
    let sign = (value.to_bits() >> 16) as u16 & 0x8000;
    let size = value.abs().min(LARGEST_HALF);
    // A power of two, such that the sum has as many bits of mantissa below it as the half float.
    let unit = f32::from_bits((size.to_bits() & 0x7f80_0000).max(SMALLEST_NORMAL.to_bits())) * 8192.0;
    let rounded = size + unit - unit;
    // The exponents of half floats are less by 112; subnormal ones are multiples of 2^-24.
    let bits = match rounded < SMALLEST_NORMAL {
        true => (rounded * 16_777_216.0) as u16,
        false => ((rounded.to_bits() - (112 << 23)) >> 13) as u16,
    };
    sign | bits
}

const LARGEST_HALF: f32 = 65504.0;
const SMALLEST_NORMAL: f32 = 6.103_515_6e-5;

/// Writes the basic data format descriptor: linear RGBA of signed floats.
fn describe(out: &mut dyn Write) -> io::Result<()> {
    let version_and_size = 2 | (DESCRIPTION - 4) << 16;
    let (rgbsda, bt709, linear) = (1, 1, 1);
    words(out, &[DESCRIPTION, 0, version_and_size, rgbsda | bt709 << 8 | linear << 16, 0, 4 * CHANNEL, 0])?;
    let (signed_float, one) = (0xc0, 1f32.to_bits());
    for (number, channel) in [0, 1, 2, 15].into_iter().enumerate() {
        let offset_and_length = 16 * number as u32 + (15 << 16) + ((channel | signed_float) << 24);
        words(out, &[offset_and_length, 0, (-1f32).to_bits(), one])?;
    }
    Ok(())
}

fn words(out: &mut dyn Write, words: &[u32]) -> io::Result<()> {
    words.iter().try_for_each(|word| out.write_all(&word.to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::f16;
    use ktx2::dfd::Basic;
    use ktx2::{Format, Reader};

    #[test]
    fn half_floats_are_the_nearest() {
        for bits in (0..0x4780_0000).step_by(997).chain((0..1 << 15).map(|half| half << 13 | 0x1000)) {
            let value = f32::from_bits(bits);
            let expected = f16::from_f32(value.min(LARGEST_HALF));
            assert_eq!([half(value), half(-value)], [expected.to_bits(), (-expected).to_bits()], "{value}");
        }
    }

    #[test]
    fn a_reader_of_the_format_finds_all_texels() {
        let texels: Vec<Rgb> = (0..24).map(|i| Rgb::new(i as f32, 0.25, 1e6)).collect();
        let mut bytes = Vec::new();
        write_volume(&mut bytes, [2, 3, 4], &texels).unwrap();
        let reader = Reader::new(&bytes).unwrap();
        let header = reader.header();
        assert_eq!(header.format, Some(Format::R16G16B16A16_SFLOAT));
        assert_eq!([header.pixel_width, header.pixel_height, header.pixel_depth], [2, 3, 4]);
        let levels: Vec<_> = reader.levels().collect();
        let read: Vec<f32> =
            levels[0].data.chunks(2).map(|bytes| f16::from_le_bytes([bytes[0], bytes[1]]).to_f32()).collect();
        let written = |texel: &Rgb| [texel.x, 0.25, 65504.0, 1.0];
        assert_eq!(read, texels.iter().flat_map(written).collect::<Vec<_>>());
        let (description, size) = Basic::from_format(Format::R16G16B16A16_SFLOAT).unwrap();
        assert_eq!((reader.basic_dfd(), header.type_size), (Some(&description), size));
    }
}
