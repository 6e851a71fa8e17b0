//! TIFF of floats.

use super::*;
use ::tiff::encoder::{TiffEncoder, colortype};

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
