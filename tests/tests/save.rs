//! Pictures written and read back, and files with false headers.

use halflight::picture::{self, FileError};
use halflight::save::{Format, Image, check_writable, encode, read, read_within, to_srgb, write};
use std::path::{Path, PathBuf};

/// RGBE keeps 8 bits of the largest channel; truncation loses up to one step of them.
const RGBE_TOLERANCE: f32 = 1.0 / 128.0;

/// A picture with values below 0 and above 1, of a size without symmetry.
fn picture() -> Image {
    let value = |i: u32, c: u32| {
        let bright = if i % 11 == 3 { 100.0 } else { 0.0 };
        ((i * 7 + c * 13) % 29) as f32 * 0.17 - 0.4 + bright
    };
    let pixels = (0..37 * 23).map(|i| [value(i, 0), value(i, 1), value(i, 2)]).collect();
    Image { width: 37, height: 23, pixels }
}

/// Memory limit of reading, bytes.
const MOST: usize = 1 << 24;

fn decode(bytes: &[u8]) -> Result<Image, FileError> {
    picture::decode(bytes, Path::new("a"), MOST).map(Image::from)
}

fn there_and_back(image: &Image, format: Format) -> Image {
    decode(&encode(image, format).unwrap()).unwrap()
}

#[test]
fn linear_formats_without_loss_keep_every_bit() {
    let image = picture();
    for format in [Format::Exr, Format::Pfm] {
        assert_eq!(there_and_back(&image, format), image, "{format:?}");
    }
}

#[test]
fn values_that_are_not_finite_survive_in_exr_and_pfm_only() {
    let image = Image { width: 3, height: 1, pixels: vec![[f32::NAN; 3], [f32::INFINITY; 3], [-1.0; 3]] };
    for format in [Format::Exr, Format::Pfm] {
        let back = there_and_back(&image, format);
        assert!(back.pixels[0][0].is_nan() && back.pixels[1][0] == f32::INFINITY, "{format:?}");
    }
    let hdr = there_and_back(&image, Format::Hdr);
    assert!(hdr.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    assert_eq!(there_and_back(&image, Format::Png).pixels, [[0.0; 3], [1.0; 3], [0.0; 3]]);
}

#[test]
fn hdr_keeps_seven_bits_of_the_largest_channel() {
    let image = picture();
    for (a, b) in image.pixels.iter().zip(&there_and_back(&image, Format::Hdr).pixels) {
        let largest = a.iter().fold(0.0f32, |m, v| m.max(*v));
        for c in 0..3 {
            assert!((a[c].max(0.0) - b[c]).abs() <= RGBE_TOLERANCE * largest, "{a:?} {b:?}");
        }
    }
}

#[test]
fn png_is_within_half_a_step_of_the_display_value() {
    let image = picture();
    let back = there_and_back(&image, Format::Png);
    for (a, b) in image.pixels.iter().flatten().zip(back.pixels.iter().flatten()) {
        assert!((to_srgb(*a) - to_srgb(*b)).abs() <= 0.5 / 255.0 + 1e-5);
    }
}

#[test]
fn damaged_files_are_an_error_or_a_picture_and_never_a_panic() {
    for format in Format::ALL {
        let whole = encode(&picture(), format).unwrap();
        for length in (0..whole.len()).step_by(13) {
            let _ = decode(&whole[..length]);
        }
        for at in 0..whole.len().min(600) {
            for flip in [0x01, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] ^= flip;
                let _ = decode(&bytes);
            }
        }
        assert!(decode(b"").is_err() && decode(b"hello, picture").is_err());
    }
}

#[test]
fn files_are_replaced_whole_and_errors_name_them() {
    let folder: PathBuf = std::env::temp_dir().join(format!("halflight-save-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("picture.exr");
    write(&path, &Image::black(2, 2)).unwrap();
    write(&path, &picture()).unwrap();
    assert_eq!(read(&path).unwrap(), picture());
    assert_eq!(read_within(&path, MOST).unwrap(), (picture(), vec![]));
    let short = read_within(&path, 20_000).unwrap_err().to_string();
    assert!(short.contains("picture.exr") && short.contains("37x23 pixels"), "{short}");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside the picture");

    let refusal = |name: &str| check_writable(&folder.join(name)).unwrap_err().to_string();
    let missing = read(&folder.join("nothing.exr")).unwrap_err().to_string();
    assert!(missing.contains("nothing.exr") && missing.contains("no such file"), "{missing}");
    let unknown = refusal("picture.gif");
    assert!(unknown.contains("picture.gif") && unknown.contains(".png, .exr"), "{unknown}");
    assert!(refusal("no/such/folder.png").contains("no folder"));
    assert!(check_writable(&folder.join("new.png")).is_ok() && !folder.join("new.png").exists());
    std::fs::create_dir(folder.join("folder.png")).unwrap();
    assert!(refusal("folder.png").contains("is a folder"));
    std::fs::remove_dir_all(folder).unwrap();
}
