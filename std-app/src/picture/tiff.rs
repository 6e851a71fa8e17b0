//! TIFF by the `tiff` crate: grey, RGB and CMYK, with or without alpha; integers without sign, or floats;
//! interleaved or in planes. The first of several pictures.

use super::raster::TABLES;
use super::{FileError, Info, Kind, Picture, Samples, black, fail, filled, plausible};
use std::io::Cursor;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, DecodingSampleType, Limits};

/// Pixels that one byte can encode: 1032 bytes of deflate with 8 pixels each.
const PIXELS_PER_BYTE: usize = 8 * 1032;

/// A file whose header is read.
struct File<'a> {
    decoder: Decoder<Cursor<&'a [u8]>>,
    width: usize,
    height: usize,
    /// Channels of colour: 1 grey, 3 RGB, 4 CMYK.
    colours: usize,
    has_alpha: bool,
    /// Bits of a channel: 1, 2 and 4 in grey pictures only, else 8, 16, 32 or 64.
    bits: usize,
    is_float: bool,
    /// Bytes of all channels.
    raw: usize,
}

pub(super) fn info(bytes: &[u8]) -> Result<Info, FileError> {
    let File { width, height, has_alpha, bits, is_float, raw, .. } = open(bytes)?;
    let of_pixel = match (is_float, bits) {
        (true, _) => {
            if has_alpha {
                16
            } else {
                12
            }
        }
        (false, ..=8) => 4,
        (false, _) => 8,
    };
    let kept = of_pixel * plausible(width, height, bytes.len(), PIXELS_PER_BYTE)?;
    // The pixels of the decoder, an unpacked strip or tile, and bytes of packed bits.
    let peak = kept.saturating_add(raw.saturating_mul(4)).saturating_add(8 * raw * usize::from(bits < 8));
    let peak = peak.saturating_add(2 * bytes.len() + TABLES);
    Ok(Info { kind: Kind::Tiff, width: width as u32, height: height as u32, kept, peak })
}

fn open(bytes: &[u8]) -> Result<File<'_>, FileError> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(FileError::new)?;
    let (width, height) = decoder.dimensions().map_err(FileError::new)?;
    let (colours, has_alpha, bits) = match decoder.colortype().map_err(FileError::new)? {
        ColorType::Gray(bits) => (1, false, bits),
        // Grey with one more channel.
        ColorType::GrayA(bits) | ColorType::Multiband { bit_depth: bits, num_samples: 2 } => (1, true, bits),
        ColorType::RGB(bits) => (3, false, bits),
        ColorType::RGBA(bits) => (3, true, bits),
        ColorType::CMYK(bits) => (4, false, bits),
        ColorType::CMYKA(bits) => (4, true, bits),
        other => fail!("its colours ({other:?}) are not supported"),
    };
    if !(matches!(bits, 8 | 16 | 32 | 64) || matches!((colours, has_alpha, bits), (1, false, 1 | 2 | 4))) {
        fail!("{bits} bits a channel are not supported");
    }
    let layout = decoder.image_buffer_layout().map_err(FileError::new)?;
    use DecodingSampleType::{F16, F32, F64, U8, U16, U32, U64};
    let is_float = match layout.sample_type {
        Some(U8 | U16 | U32 | U64) => false,
        Some(F16 | F32 | F64) => true,
        Some(_) => fail!("integers with a sign are not supported"),
        None => fail!("its kind of numbers is not supported"),
    };
    let (width, height, bits) = (width as usize, height as usize, usize::from(bits));
    Ok(File { decoder, width, height, colours, has_alpha, bits, is_float, raw: layout.complete_len })
}

pub(super) fn decode(bytes: &[u8], info: &Info) -> Result<Picture, FileError> {
    let mut file = open(bytes)?;
    let mut limits = Limits::default();
    (limits.decoding_buffer_size, limits.intermediate_buffer_size) = (info.peak, info.peak);
    let mut decoder = file.decoder.with_limits(limits);
    let mut values = DecodingResult::U8(Vec::new());
    let layout = decoder.read_image_to_buffer(&mut values).map_err(FileError::new)?;
    file.decoder = decoder;
    if file.bits < 8
        && let DecodingResult::U8(packed) = values
    {
        values = DecodingResult::U8(file.unpacked(&packed)?);
    }
    let in_planes = layout.planes > 1;
    let samples = match &values {
        DecodingResult::U8(v) => Samples::Bytes(file.integers(v, in_planes, |x| x, u8::MAX)?),
        DecodingResult::U16(v) => Samples::Words(file.integers(v, in_planes, |x| x, u16::MAX)?),
        DecodingResult::U32(v) => {
            Samples::Words(file.integers(v, in_planes, |x| (x >> 16) as u16, u16::MAX)?)
        }
        DecodingResult::U64(v) => {
            Samples::Words(file.integers(v, in_planes, |x| (x >> 48) as u16, u16::MAX)?)
        }
        DecodingResult::F16(v) => file.floats(v, in_planes, |x| x.to_f32())?,
        DecodingResult::F32(v) => file.floats(v, in_planes, |x| x)?,
        DecodingResult::F64(v) => file.floats(v, in_planes, |x| x as f32)?,
        _ => fail!("integers with a sign are not supported"),
    };
    let (width, height) = (file.width as u32, file.height as u32);
    Ok(Picture { width, height, samples, has_alpha: file.has_alpha, notes: Vec::new() })
}

impl File<'_> {
    /// Bytes of grey pixels of 1, 2 or 4 bits, whose rows begin with a byte.
    fn unpacked(&self, packed: &[u8]) -> Result<Vec<u8>, FileError> {
        let (per_byte, largest) = (8 / self.bits, (1 << self.bits) - 1);
        let mut bytes = filled(self.width * self.height, 0)?;
        let rows = packed.chunks_exact(self.width.div_ceil(per_byte));
        if rows.len() < self.height {
            fail!("truncated: pixels are missing");
        }
        for (row, packed) in bytes.chunks_exact_mut(self.width).zip(rows) {
            for (x, byte) in row.iter_mut().enumerate() {
                let shift = 8 - self.bits * (x % per_byte + 1);
                *byte = (packed[x / per_byte] >> shift & largest) * (u8::MAX / largest);
            }
        }
        Ok(bytes)
    }

    /// Steps in `values` between pixels and between channels.
    fn steps<T>(&self, values: &[T], in_planes: bool) -> Result<[usize; 2], FileError> {
        let (pixels, channels) = (self.width * self.height, self.colours + usize::from(self.has_alpha));
        if values.len() < pixels * channels {
            fail!("truncated: pixels are missing");
        }
        Ok(if in_planes { [1, pixels] } else { [channels, 1] })
    }

    /// RGBA of integers.
    fn integers<T: Copy, U: Copy + Into<u32> + TryFrom<u32>>(
        &self,
        values: &[T],
        in_planes: bool,
        value: impl Fn(T) -> U,
        largest: U,
    ) -> Result<Vec<U>, FileError> {
        let [step, to_channel] = self.steps(values, in_planes)?;
        let mut rgba = filled(4 * self.width * self.height, largest)?;
        for (i, pixel) in rgba.chunks_exact_mut(4).enumerate() {
            let at = |c: usize| value(values[i * step + c * to_channel]);
            let without = |ink: U| largest.into() - ink.into();
            let printed = |ink: U| {
                let light = u64::from(without(ink)) * u64::from(without(at(3))) / u64::from(largest.into());
                U::try_from(light as u32).unwrap_or(largest)
            };
            let colour = match self.colours {
                1 => [at(0); 3],
                3 => [0, 1, 2].map(at),
                _ => [0, 1, 2].map(|c| printed(at(c))),
            };
            pixel[..3].copy_from_slice(&colour);
            if self.has_alpha {
                pixel[3] = at(self.colours);
            }
        }
        Ok(rgba)
    }

    /// Linear floats.
    fn floats<T: Copy>(
        &self,
        values: &[T],
        in_planes: bool,
        value: impl Fn(T) -> f32,
    ) -> Result<Samples, FileError> {
        let [step, to_channel] = self.steps(values, in_planes)?;
        let (mut rgb, mut alpha) = black(self.width * self.height, self.has_alpha)?;
        for (i, pixel) in rgb.iter_mut().enumerate() {
            let at = |c: usize| value(values[i * step + c * to_channel]);
            *pixel = match self.colours {
                1 => [at(0); 3],
                3 => [0, 1, 2].map(at),
                _ => [0, 1, 2].map(|c| (1.0 - at(c)) * (1.0 - at(3))),
            };
            if let Some(alpha) = alpha.get_mut(i) {
                *alpha = at(self.colours);
            }
        }
        Ok(Samples::Floats { rgb, alpha })
    }
}
