//! JPEG, whole and truncated.

use super::*;
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageBuffer};

fn file() -> Vec<u8> {
    let value = |i: u32| (i.wrapping_mul(2_654_435_761) >> 26) as u8 + (i / 40 % 128) as u8;
    let pixels: Vec<u8> = (0..60 * 41 * 3).map(value).collect();
    let picture = DynamicImage::ImageRgb8(ImageBuffer::from_raw(60, 41, pixels).unwrap());
    let mut bytes = Vec::new();
    picture.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, 90)).unwrap();
    bytes
}

#[test]
fn whole_files_agree_with_the_image_crate() {
    let bytes = file();
    let picture = read_bytes(&bytes).unwrap();
    let expected = image::load_from_memory(&bytes).unwrap().into_rgba8().into_raw();
    assert_eq!((picture.width, picture.height, picture.has_alpha), (60, 41, false));
    assert_eq!(picture.samples, Samples::Bytes(expected));
    assert_eq!(picture.notes, [""; 0]);
    // Bytes after the end do not matter.
    let longer = [&bytes[..], b"more"].concat();
    assert_eq!(read_bytes(&longer).unwrap().notes, [""; 0]);
}

#[test]
fn truncated_files_are_refused_or_noted() {
    let bytes = file();
    for length in (2..bytes.len()).step_by(61).chain(bytes.len() - 3..bytes.len()) {
        let read = read_bytes(&bytes[..length]);
        assert!(read.is_err() || !read.unwrap().notes.is_empty(), "{length} of {}", bytes.len());
    }
}
