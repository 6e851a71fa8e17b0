//! Portable float maps.

use super::*;
fn colours(bytes: &[u8]) -> Vec<[f32; 3]> {
    match read_bytes(bytes).unwrap().samples {
        Samples::Floats { rgb, .. } => rgb,
        other => panic!("{other:?}"),
    }
}

#[test]
fn rows_are_stored_from_the_bottom() {
    let mut bytes = b"Pf\n1 2\n1.0\n".to_vec();
    bytes.extend([1.0f32, 2.0].iter().flat_map(|v| v.to_be_bytes()));
    assert_eq!(colours(&bytes), [[2.0; 3], [1.0; 3]]);
}

#[test]
fn magnitude_of_the_scale_is_a_factor() {
    let pixel: Vec<u8> = [1.0f32, 2.0, 3.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(colours(&[b"PF 1 1 -2.5\n", &pixel[..]].concat()), [[2.5, 5.0, 7.5]]);
    let zero = read_bytes(&[b"PF 1 1 -0.0\n", &pixel[..]].concat()).unwrap();
    assert!(zero.notes[0].contains("scale of -0"), "{:?}", zero.notes);
}

#[test]
fn four_values_are_a_colour_and_its_alpha() {
    let pixel: Vec<u8> = [1.0f32, 2.0, 3.0, 0.25].iter().flat_map(|v| v.to_le_bytes()).collect();
    let picture = read_bytes(&[b"PF4\n1 1\n-1\n", &pixel[..]].concat()).unwrap();
    assert!(picture.has_alpha);
    assert_eq!(picture.samples, Samples::Floats { rgb: vec![[1.0, 2.0, 3.0]], alpha: vec![0.25] });
}

#[test]
fn first_pixel_may_resemble_a_blank() {
    let bytes = [b"Pf 1 1 -1\n".as_slice(), &[0x20, 0x20, 0x20, 0x20]].concat();
    assert_eq!(colours(&bytes), [[f32::from_le_bytes([0x20; 4]); 3]]);
}

#[test]
fn impossible_sizes_are_refused() {
    for header in
        ["PF\n4000000000 4000000000\n-1\n", "PF\n9 9\n-1\n", "PF\n-1 1\n-1\n", "PF\n1 nan\n1\n", "P6\n"]
    {
        assert!(read_bytes(header.as_bytes()).is_err(), "{header}");
    }
}
