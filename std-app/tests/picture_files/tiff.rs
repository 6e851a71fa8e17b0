//! TIFF of every kind of number.

use super::*;
use ::tiff::encoder::{TiffEncoder, TiffValue, colortype};
use ::tiff::tags::Tag;

/// A picture, 2 by 1, whose tags and samples are given.
fn file<T>(photometric: u16, format: Option<u16>, channels: u16, in_planes: bool, values: &[T]) -> Vec<u8>
where
    [T]: TiffValue,
{
    let bits = 8 * size_of::<T>() as u16;
    packed(photometric, format, [channels, bits], in_planes, values)
}

fn packed<T>(
    photometric: u16,
    format: Option<u16>,
    [channels, bits]: [u16; 2],
    in_planes: bool,
    values: &[T],
) -> Vec<u8>
where
    [T]: TiffValue,
{
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    let mut directory = encoder.image_directory().unwrap();
    let planes = if in_planes { values.chunks(2).collect::<Vec<_>>() } else { vec![values] };
    let offsets: Vec<u32> = planes.iter().map(|plane| directory.write_data(*plane).unwrap() as u32).collect();
    let lengths: Vec<u32> = planes.iter().map(|plane| size_of_val(*plane) as u32).collect();
    let mut write = |tag, values: &[u16]| directory.write_tag(tag, values).unwrap();
    write(Tag::ImageWidth, &[2]);
    write(Tag::ImageLength, &[1]);
    write(Tag::BitsPerSample, &vec![bits; channels.into()]);
    write(Tag::Compression, &[1]);
    write(Tag::PhotometricInterpretation, &[photometric]);
    write(Tag::SamplesPerPixel, &[channels]);
    write(Tag::RowsPerStrip, &[1]);
    write(Tag::PlanarConfiguration, &[1 + u16::from(in_planes)]);
    if let Some(format) = format {
        write(Tag::SampleFormat, &vec![format; channels.into()]);
    }
    let colours = if photometric == RGB { 3 } else { 1 };
    if channels > colours && photometric != CMYK {
        write(Tag::ExtraSamples, &[2]);
    }
    directory.write_tag(Tag::StripOffsets, &offsets[..]).unwrap();
    directory.write_tag(Tag::StripByteCounts, &lengths[..]).unwrap();
    directory.finish().unwrap();
    bytes.into_inner()
}

const WHITE_IS_0: u16 = 0;
const BLACK_IS_0: u16 = 1;
const RGB: u16 = 2;
const CMYK: u16 = 5;
const UNSIGNED: u16 = 1;
const SIGNED: u16 = 2;
const FLOAT: u16 = 3;

#[test]
fn integers_of_32_and_64_bits_are_the_numbers_that_they_are() {
    let words = |bytes: Vec<u8>| match read_bytes(&bytes).unwrap().samples {
        Samples::Words(words) => words,
        other => panic!("{other:?}"),
    };
    let [a, b, c, d] = [0xbcbc_bcbcu32, 0x6363_6363, 0x0a0a_0a0a, 0x4000_0000];
    let rgba = [0xbcbc, 0x6363, 0x0a0a, 0xffff, 0x6363, 0x0a0a, 0xbcbc, 0xffff];
    // Without a format, samples are integers.
    for format in [None, Some(UNSIGNED)] {
        assert_eq!(words(file(RGB, format, 3, false, &[a, b, c, b, c, a])), rgba, "{format:?}");
        assert_eq!(words(file(RGB, format, 3, true, &[a, b, b, c, c, a])), rgba, "{format:?}");
        let with_alpha = words(file(RGB, format, 4, false, &[a, b, c, d, b, c, a, d]));
        assert_eq!(with_alpha[..4], [0xbcbc, 0x6363, 0x0a0a, 0x4000]);
        let grey = words(file(BLACK_IS_0, format, 1, false, &[a, b]));
        assert_eq!(grey, [0xbcbc, 0xbcbc, 0xbcbc, 0xffff, 0x6363, 0x6363, 0x6363, 0xffff]);
        let grey = words(file(BLACK_IS_0, format, 2, false, &[a, d, b, d]));
        assert_eq!(grey, [0xbcbc, 0xbcbc, 0xbcbc, 0x4000, 0x6363, 0x6363, 0x6363, 0x4000]);
    }
    let long = |x: u32| u64::from(x) << 32 | 7;
    assert_eq!(words(file(RGB, None, 3, false, &[a, b, c, b, c, a].map(long))), rgba);
    assert_eq!(words(file(WHITE_IS_0, None, 1, false, &[!a, !b]))[..4], [0xbcbc, 0xbcbc, 0xbcbc, 0xffff]);
    let ink = [0u32, u32::MAX, 0x8000_0000, 0x8000_0000];
    let printed = words(file(CMYK, None, 4, false, &[ink, [0; 4]].concat()));
    assert_eq!(printed, [0x7fff, 0, 0x3fff, 0xffff, 0xffff, 0xffff, 0xffff, 0xffff]);
}

#[test]
fn integers_of_1_to_16_bits() {
    let bytes = |bytes: Vec<u8>| match read_bytes(&bytes).unwrap().samples {
        Samples::Bytes(bytes) => bytes,
        other => panic!("{other:?}"),
    };
    assert_eq!(bytes(file(RGB, None, 3, true, &[1u8, 4, 2, 5, 3, 6])), [1, 2, 3, 255, 4, 5, 6, 255]);
    assert_eq!(bytes(file(BLACK_IS_0, None, 2, false, &[7u8, 8, 9, 10])), [7, 7, 7, 8, 9, 9, 9, 10]);
    for (bits, packed_byte) in [(1, 0b0100_0000u8), (2, 0b0011_0000), (4, 0b0000_1111)] {
        let black_and_white = bytes(packed(BLACK_IS_0, None, [1, bits], false, &[packed_byte]));
        assert_eq!(black_and_white, [0, 0, 0, 255, 255, 255, 255, 255], "{bits}");
    }
    let words = read_bytes(&file(RGB, None, 3, true, &[1u16, 4, 2, 5, 3, 6])).unwrap();
    assert_eq!(words.samples, Samples::Words(vec![1, 2, 3, 0xffff, 4, 5, 6, 0xffff]));
}

#[test]
fn floats_of_16_32_and_64_bits_are_linear() {
    let expected = Samples::Floats { rgb: vec![[0.25, 9.0, -3.0], [1.0, 0.5, 0.0]], alpha: vec![] };
    let values = [0.25, 9.0, -3.0, 1.0, 0.5, 0.0];
    let half: [u16; 6] = [0x3400, 0x4880, 0xc200, 0x3c00, 0x3800, 0];
    let [short, single, double] = [
        file(RGB, Some(FLOAT), 3, false, &half),
        file(RGB, Some(FLOAT), 3, false, &values.map(|x| x as f32)),
        file(RGB, Some(FLOAT), 3, false, &values),
    ];
    for bytes in [short, single, double] {
        assert_eq!(read_bytes(&bytes).unwrap().samples, expected);
    }
    let alpha = file(BLACK_IS_0, Some(FLOAT), 2, true, &[0.25f64, 4.0, 1.0, 0.5]);
    let expected = Samples::Floats { rgb: vec![[0.25; 3], [4.0; 3]], alpha: vec![1.0, 0.5] };
    assert_eq!(read_bytes(&alpha).unwrap().samples, expected);
}

#[test]
fn other_numbers_are_refused() {
    for (bytes, word) in [
        (file(RGB, Some(SIGNED), 3, false, &[1i8; 6]), "sign"),
        (file(BLACK_IS_0, Some(SIGNED), 1, false, &[1i16; 2]), "sign"),
        (file(RGB, Some(SIGNED), 3, false, &[1i32; 6]), "sign"),
        (file(RGB, Some(4), 3, false, &[1u32; 6]), "kind of numbers"),
        (file(RGB, Some(6), 3, false, &[1u64; 6]), "kind of numbers"),
        (packed(RGB, None, [3, 12], false, &[0u8; 9]), "12 bits"),
        (packed(RGB, None, [3, 24], false, &[0u8; 18]), "24 bits"),
        (file(BLACK_IS_0, None, 3, false, &[1u8; 6]), "not supported"),
        (file(8, None, 3, false, &[1u8; 6]), ""),
    ] {
        let why = read_bytes(&bytes).unwrap_err().to_string();
        assert!(why.to_lowercase().contains(word), "{word}: {why}");
    }
}

#[test]
fn grey_and_rgb_floats_are_linear() {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    encoder.write_image::<colortype::Gray32Float>(2, 1, &[0.25, -7.5]).unwrap();
    let picture = read_bytes(bytes.get_ref()).unwrap();
    let expected = Samples::Floats { rgb: vec![[0.25; 3], [-7.5; 3]], alpha: vec![] };
    assert_eq!((picture.width, picture.height, picture.samples), (2, 1, expected));

    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    encoder.write_image::<colortype::RGB32Float>(1, 1, &[0.25, 9.0, 3.0]).unwrap();
    let picture = read_bytes(bytes.get_ref()).unwrap();
    assert_eq!(picture.samples, Samples::Floats { rgb: vec![[0.25, 9.0, 3.0]], alpha: vec![] });
}

#[test]
fn truncated_files_are_refused() {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    encoder.write_image::<colortype::Gray32Float>(8, 8, &[0.5; 64]).unwrap();
    let bytes = bytes.into_inner();
    for length in (0..bytes.len()).step_by(7) {
        assert!(read_bytes(&bytes[..length]).is_err(), "{length}");
    }
}
