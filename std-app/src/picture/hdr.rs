//! Radiance pictures (Ward, "Radiance File Formats"): any program after `#?`, all eight orders of rows and
//! columns, RGBE and XYZE, and the header lines that scale values.

use super::primaries::{Primaries, converted, xyz_to_srgb};
use super::rgbe::read_scanline;
use super::{FileError, Info, Kind, Picture, Samples, black, fail, filled, pixels};
use glam::DMat3;

/// Most lines of a header.
const MOST_LINES: usize = 1 << 16;

/// The header.
struct Header<'a> {
    order: Order,
    is_xyz: bool,
    /// Colours of RGBE.
    primaries: Primaries,
    /// Factors that the values of each channel contain.
    applied: [f64; 3],
    notes: Vec<String>,
    /// Bytes of the pixels.
    rest: &'a [u8],
}

/// Size of the picture and order of its pixels.
#[derive(Clone, Copy)]
struct Order {
    width: usize,
    height: usize,
    /// Scanlines are columns.
    columns: bool,
    /// From right to left.
    leftwards: bool,
    /// From bottom to top.
    upwards: bool,
}

impl Order {
    /// Number of scanlines and their length.
    fn scanlines(&self) -> (usize, usize) {
        if self.columns { (self.width, self.height) } else { (self.height, self.width) }
    }

    /// Index in the picture of a pixel of a scanline.
    fn index(&self, scanline: usize, pixel: usize) -> usize {
        let (x, y) = if self.columns { (scanline, pixel) } else { (pixel, scanline) };
        let x = if self.leftwards { self.width - 1 - x } else { x };
        let y = if self.upwards { self.height - 1 - y } else { y };
        y * self.width + x
    }
}

pub(super) fn info(bytes: &[u8]) -> Result<Info, FileError> {
    let Header { order, .. } = read_header(bytes)?;
    let Order { width, height, .. } = order;
    let kept = width * height * size_of::<[f32; 3]>();
    let peak = kept + order.scanlines().1 * size_of::<[u8; 4]>();
    Ok(Info { kind: Kind::Hdr, width: width as u32, height: height as u32, kept, peak })
}

pub(super) fn decode(bytes: &[u8]) -> Result<Picture, FileError> {
    let header = read_header(bytes)?;
    let (matrix, Header { order, applied, notes, mut rest, .. }) = (header.matrix(), header);
    let (scanlines, length) = order.scanlines();
    let (mut rgb, alpha) = black(order.width * order.height, false)?;
    let mut line = filled(length, [0u8; 4])?;
    for scanline in 0..scanlines {
        read_scanline(&mut rest, &mut line)?;
        for (pixel, &rgbe) in line.iter().enumerate() {
            rgb[order.index(scanline, pixel)] = colour(rgbe, applied, matrix.as_ref());
        }
    }
    let samples = Samples::Floats { rgb, alpha };
    let (width, height) = (order.width as u32, order.height as u32);
    Ok(Picture { width, height, samples, has_alpha: false, notes })
}

/// Mantissas are not increased by half a step, as in most programs.
fn colour([r, g, b, exponent]: [u8; 4], applied: [f64; 3], matrix: Option<&DMat3>) -> [f32; 3] {
    if exponent == 0 {
        return [0.0; 3];
    }
    let scale = 2f64.powi(i32::from(exponent) - 136);
    let mantissas = [r, g, b];
    let value: [f32; 3] = core::array::from_fn(|c| (f64::from(mantissas[c]) * scale / applied[c]) as f32);
    matrix.map_or(value, |matrix| converted(matrix, value))
}

fn read_header(bytes: &[u8]) -> Result<Header<'_>, FileError> {
    let mut rest = bytes;
    let mut header = Header {
        order: Order { width: 0, height: 0, columns: false, leftwards: false, upwards: false },
        is_xyz: false,
        primaries: Primaries::Srgb,
        applied: [1.0; 3],
        notes: Vec::new(),
        rest,
    };
    for _ in 0..MOST_LINES {
        let line = line(&mut rest)?;
        if line.is_empty() {
            header.order = resolution(self::line(&mut rest)?)?;
            // A scanline takes at least four bytes.
            if rest.len() / 4 < header.order.scanlines().0 {
                fail!("truncated: there are fewer pixels than scanlines");
            }
            header.rest = rest;
            return Ok(header);
        }
        if let Some((key, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) {
            header.variable(&key.trim().to_ascii_uppercase(), value.trim())?;
        }
    }
    Err(FileError::new("its header has no end"))
}

impl Header<'_> {
    /// Matrix of the colours to sRGB; `None` if they are of sRGB.
    fn matrix(&self) -> Option<DMat3> {
        match self.primaries {
            _ if self.is_xyz => Some(xyz_to_srgb()),
            Primaries::Other(matrix) => Some(matrix),
            Primaries::Srgb | Primaries::Invalid => None,
        }
    }

    /// Applies a line of the header.
    fn variable(&mut self, key: &str, value: &str) -> Result<(), FileError> {
        let numbers = || value.split_whitespace().map(|word| word.parse().ok()).collect::<Option<Vec<f64>>>();
        match key {
            "FORMAT" => match value.to_ascii_lowercase().as_str() {
                "32-bit_rle_rgbe" => self.is_xyz = false,
                "32-bit_rle_xyze" => self.is_xyz = true,
                _ => fail!("its format `{value}` is not supported"),
            },
            "NCOMP" if value != "3" => fail!("{value} components of colour are not supported"),
            "EXPOSURE" => self.apply(key, value, numbers().filter(|n| n.len() == 1)),
            "COLORCORR" => self.apply(key, value, numbers().filter(|n| n.len() == 3)),
            "PRIMARIES" => {
                self.primaries = numbers().map_or(Primaries::Invalid, |given| Primaries::of(&given));
                let what = match self.primaries {
                    Primaries::Srgb => return Ok(()),
                    Primaries::Other(_) => "are converted to sRGB",
                    Primaries::Invalid => "are taken as those of sRGB: these are no primaries",
                };
                self.notes.push(format!("its colours of PRIMARIES={value} {what}"));
            }
            _ => {}
        }
        Ok(())
    }

    /// Accumulates a factor that the pixels contain. Some writers leave zeros there, which mean none.
    fn apply(&mut self, key: &str, value: &str, factors: Option<Vec<f64>>) {
        if factors.iter().flatten().all(|factor| *factor == 0.0) && factors.is_some() {
            return;
        }
        let usable = factors.filter(|factors| factors.iter().all(|f| *f > 0.0 && f.is_finite()));
        let Some(factors) = usable else {
            self.notes.push(format!("{key}={value} is ignored: it is no factor"));
            return;
        };
        let factor = |c: usize| if factors.len() == 3 { factors[c] } else { factors[0] };
        self.applied = core::array::from_fn(|c| self.applied[c] * factor(c));
    }
}

/// The next line of the header.
fn line<'a>(rest: &mut &'a [u8]) -> Result<&'a str, FileError> {
    let bytes = *rest;
    let end =
        bytes.iter().position(|&b| b == b'\n').ok_or_else(|| FileError::new("its header has no end"))?;
    *rest = &bytes[end + 1..];
    let line = &bytes[..end];
    // A line in another encoding is a comment.
    Ok(core::str::from_utf8(line).unwrap_or("#").trim_end_matches('\r'))
}

/// Parses `-Y 512 +X 1024`: the axis across scanlines, then the axis along them; y is up.
fn resolution(line: &str) -> Result<Order, FileError> {
    let unknown = || FileError::new(format!("`{line}` is no order of rows and columns"));
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first, lines, second, length] = words[..] else { return Err(unknown()) };
    let count = |word: &str| word.parse::<u32>().map(|count| count as usize).map_err(|_| unknown());
    let (lines, length) = (count(lines)?, count(length)?);
    let (columns, (x, width), (y, height)) = match (first.get(1..), second.get(1..)) {
        (Some("Y"), Some("X")) => (false, (second, length), (first, lines)),
        (Some("X"), Some("Y")) => (true, (first, lines), (second, length)),
        _ => return Err(unknown()),
    };
    if ![x, y].iter().all(|axis| axis.starts_with(['+', '-'])) {
        return Err(unknown());
    }
    pixels(width, height)?;
    Ok(Order { width, height, columns, leftwards: x.starts_with('-'), upwards: y.starts_with('+') })
}
