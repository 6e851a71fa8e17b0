//! PNG, BMP, TGA, WebP and integer TIFF.

use super::*;
use image::{DynamicImage, ImageBuffer, ImageFormat};

fn round_trip(picture: DynamicImage, format: ImageFormat, name: &str) -> Picture {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    picture::decode(bytes.get_ref(), Path::new(name), MOST).unwrap()
}

#[test]
fn alpha_of_every_format_is_kept() {
    let pixels = vec![1, 2, 3, 4, 250, 251, 252, 253];
    for (format, name) in [
        (ImageFormat::Png, "a"),
        (ImageFormat::WebP, "a"),
        (ImageFormat::Tiff, "a"),
        (ImageFormat::Tga, "a.tga"),
    ] {
        let picture = ImageBuffer::from_raw(2, 1, pixels.clone()).unwrap();
        let picture = round_trip(DynamicImage::ImageRgba8(picture), format, name);
        assert_eq!((picture.width, picture.height, picture.has_alpha), (2, 1, true), "{format:?}");
        assert_eq!(picture.samples, Samples::Bytes(pixels.clone()), "{format:?}");
        assert_eq!(picture.notes, [""; 0]);
    }
}

#[test]
fn fewer_channels_become_four() {
    let grey = DynamicImage::ImageLuma8(ImageBuffer::from_raw(2, 1, vec![7, 9]).unwrap());
    let expected = Samples::Bytes(vec![7, 7, 7, 255, 9, 9, 9, 255]);
    assert_eq!(round_trip(grey, ImageFormat::Png, "a").samples, expected);
    let rgb = DynamicImage::ImageRgb8(ImageBuffer::from_raw(1, 1, vec![7, 8, 9]).unwrap());
    assert_eq!(round_trip(rgb, ImageFormat::Bmp, "a").samples, Samples::Bytes(vec![7, 8, 9, 255]));
    let words = DynamicImage::ImageLumaA16(ImageBuffer::from_raw(1, 1, vec![700, 900]).unwrap());
    let picture = round_trip(words, ImageFormat::Png, "a");
    assert_eq!((picture.samples, picture.has_alpha), (Samples::Words(vec![700, 700, 700, 900]), true));
}

#[test]
fn truncated_files_are_refused_or_noted() {
    let noise = |i: u32| (i.wrapping_mul(2_654_435_761) >> 24) as u8;
    let pixels: Vec<u8> = (0..40 * 30 * 3).map(noise).collect();
    let picture = DynamicImage::ImageRgb8(ImageBuffer::from_raw(40, 30, pixels).unwrap());
    for format in [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::Tga, ImageFormat::WebP, ImageFormat::Tiff]
    {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        let bytes = bytes.into_inner();
        for length in [bytes.len() / 4, bytes.len() / 2, bytes.len() * 9 / 10] {
            let read = picture::decode(&bytes[..length], Path::new("a.tga"), MOST);
            assert!(read.is_err() || !read.unwrap().notes.is_empty(), "{format:?} {length}");
        }
    }
}
