//! Scanlines of Radiance pictures: flat, or in one of two run-length encodings.

use super::{FileError, fail};

/// Lengths of scanlines in the newer encoding.
const NEWER: core::ops::RangeInclusive<usize> = 8..=0x7fff;

/// Reads the next scanline of `rest` into `line`: three mantissas and an exponent for each pixel.
pub(super) fn read_scanline(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Result<(), FileError> {
    match **rest {
        [2, 2, high, low, ..] if NEWER.contains(&line.len()) && high < 128 => {
            if usize::from(high) << 8 | usize::from(low) != line.len() {
                fail!("damaged: a scanline has another length than the picture");
            }
            *rest = &rest[4..];
            (0..4).try_for_each(|component| read_component(rest, line, component))
        }
        _ => read_pixels(rest, line),
    }
}

/// Reads one component of all pixels: runs of one value, and runs of literal values.
fn read_component(rest: &mut &[u8], line: &mut [[u8; 4]], component: usize) -> Result<(), FileError> {
    let mut pixels = line.iter_mut();
    while pixels.len() > 0 {
        let code = usize::from(take(rest)?);
        let (count, run) = if code > 128 { (code - 128, Some(take(rest)?)) } else { (code, None) };
        if count == 0 || count > pixels.len() {
            fail!("damaged: a run does not fit into its scanline");
        }
        for pixel in pixels.by_ref().take(count) {
            pixel[component] = match run {
                Some(value) => value,
                None => take(rest)?,
            };
        }
    }
    Ok(())
}

/// Reads flat pixels. 1 1 1 n repeats the last pixel n times, 256 n times after another repetition, and so
/// on.
fn read_pixels(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Result<(), FileError> {
    let (mut at, mut shift) = (0, 0);
    while at < line.len() {
        let pixel = [take(rest)?, take(rest)?, take(rest)?, take(rest)?];
        let [1, 1, 1, count] = pixel else {
            line[at] = pixel;
            (at, shift) = (at + 1, 0);
            continue;
        };
        let Some(&last) = at.checked_sub(1).and_then(|last| line.get(last)) else {
            fail!("damaged: a scanline begins with a repetition");
        };
        let count = usize::from(count).checked_shl(shift).unwrap_or(usize::MAX);
        let end = at.saturating_add(count).min(line.len());
        line[at..end].fill(last);
        (at, shift) = (end, (shift + 8).min(32));
    }
    Ok(())
}

fn take(rest: &mut &[u8]) -> Result<u8, FileError> {
    let (&first, others) =
        rest.split_first().ok_or_else(|| FileError::new("truncated: pixels are missing"))?;
    *rest = others;
    Ok(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line<const N: usize>(mut bytes: &[u8]) -> Result<[[u8; 4]; N], FileError> {
        let mut line = [[0; 4]; N];
        read_scanline(&mut bytes, &mut line)?;
        assert!(bytes.is_empty());
        Ok(line)
    }

    #[test]
    fn older_encoding_repeats_the_last_pixel() {
        let mut expected = [[7, 8, 9, 130]; 300];
        expected[0] = [1, 2, 3, 129];
        // 43 and 256 times 1.
        let bytes = [1, 2, 3, 129, 7, 8, 9, 130, 1, 1, 1, 42, 1, 1, 1, 1];
        assert_eq!(line(&bytes).unwrap(), expected);
        assert!(line::<4>(&[1, 1, 1, 4]).is_err(), "there is nothing to repeat");
    }

    #[test]
    fn newer_encoding_separates_components() {
        let mut bytes = vec![2, 2, 0, 9];
        for component in [10, 20, 30, 128] {
            bytes.extend([128 + 7, component, 2, component + 1, component + 2]);
        }
        let pixels: [[u8; 4]; 9] = line(&bytes).unwrap();
        assert_eq!((pixels[0], pixels[6]), ([10, 20, 30, 128], [10, 20, 30, 128]));
        assert_eq!((pixels[7], pixels[8]), ([11, 21, 31, 129], [12, 22, 32, 130]));
        for end in 0..bytes.len() {
            assert!(line::<9>(&bytes[..end]).is_err(), "{end}");
        }
        bytes[4] = 128 + 10;
        assert!(line::<9>(&bytes).is_err(), "a run past the end");
        bytes[4] = 0;
        assert!(line::<9>(&bytes).is_err(), "a run of nothing");
    }

    #[test]
    fn short_lines_may_resemble_the_newer_encoding() {
        assert_eq!(line(&[2, 2, 0, 7, 5, 5, 5, 128]).unwrap(), [[2, 2, 0, 7], [5, 5, 5, 128]]);
    }
}
