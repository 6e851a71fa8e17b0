//! Radiance: orders of rows, factors in the header, XYZ.

use super::*;
fn read(text: &str, pixels: &[[u8; 4]]) -> Result<Picture, FileError> {
    read_bytes(&[text.as_bytes(), pixels.as_flattened()].concat())
}

fn colours(picture: &Picture) -> &[[f32; 3]] {
    match &picture.samples {
        Samples::Floats { rgb, .. } => rgb,
        other => panic!("{other:?}"),
    }
}

#[test]
fn all_eight_orders_give_the_same_picture() {
    // 3 by 2, from the top left: 1 2 3 / 4 5 6.
    let orders = [
        ("-Y 2 +X 3", [1, 2, 3, 4, 5, 6]),
        ("-Y 2 -X 3", [3, 2, 1, 6, 5, 4]),
        ("+Y 2 +X 3", [4, 5, 6, 1, 2, 3]),
        ("+Y 2 -X 3", [6, 5, 4, 3, 2, 1]),
        ("+X 3 -Y 2", [1, 4, 2, 5, 3, 6]),
        ("+X 3 +Y 2", [4, 1, 5, 2, 6, 3]),
        ("-X 3 -Y 2", [3, 6, 2, 5, 1, 4]),
        ("-X 3 +Y 2", [6, 3, 5, 2, 4, 1]),
    ];
    for (order, pixels) in orders {
        let pixels = pixels.map(|n| [n, 0, 0, 136]);
        let picture = read(&format!("#?any program\n\n{order}\n"), &pixels).unwrap();
        assert_eq!((picture.width, picture.height), (3, 2));
        let reds: Vec<f32> = colours(&picture).iter().map(|c| c[0]).collect();
        assert_eq!(reds, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "{order}");
    }
}

#[test]
fn exposure_and_colour_correction_are_divided_out() {
    let of = |lines: &str| {
        let picture = read(&format!("#?x\n{lines}\n-Y 1 +X 1\n"), &[[64, 32, 16, 129]]).unwrap();
        (colours(&picture)[0], picture.notes)
    };
    assert_eq!(of(""), ([0.5, 0.25, 0.125], vec![]));
    assert_eq!(of("EXPOSURE=2\nSOFTWARE=x=y\nexposure = 0.25\n").0, [1.0, 0.5, 0.25]);
    assert_eq!(of("COLORCORR=2 4 1\nCOLORCORR= 0.5 1 1\nEXPOSURE=0.5\n").0, [1.0, 0.125, 0.25]);
    // Some writers leave zeros there.
    for none in ["EXPOSURE=0", "EXPOSURE=0.0", "EXPOSURE= -0", "COLORCORR=0 0 0"] {
        assert_eq!(of(&format!("{none}\n")), ([0.5, 0.25, 0.125], vec![]), "{none}");
    }
    for odd in ["EXPOSURE=nan", "EXPOSURE=", "EXPOSURE=-1", "COLORCORR=1 0 1", "COLORCORR=2"] {
        let (colour, notes) = of(&format!("{odd}\n"));
        assert!(colour == [0.5, 0.25, 0.125] && notes[0].starts_with(odd), "{odd}: {colour:?} {notes:?}");
    }
}

#[test]
fn xyz_becomes_rgb() {
    // D65 white has Y = 1, the sum of the primaries.
    let bytes = |xyz: [f64; 3]| [0, 1, 2].map(|c: usize| (xyz[c] * 128.0).round() as u8);
    for (rgb, xyz) in [
        ([1.0, 1.0, 1.0], [0.9505, 1.0, 1.0888]),
        ([1.0, 0.0, 0.0], [0.4124, 0.2126, 0.0193]),
        ([0.5, 0.25, 0.125], [0.3182, 0.2941, 0.1581]),
    ] {
        let [x, y, z] = bytes(xyz);
        let picture = read("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n", &[[x, y, z, 129]]).unwrap();
        let found = colours(&picture)[0];
        // Half a step of the mantissas, through the matrix.
        assert!((0..3).all(|c| (found[c] - rgb[c]).abs() < 0.02), "{rgb:?}: {found:?}");
    }
}

#[test]
fn other_primaries_are_converted_and_other_formats_are_refused() {
    let header = |line: &str| read(&format!("#?x\n{line}\n\n-Y 1 +X 1\n"), &[[64, 32, 16, 129]]);
    for same in [
        "0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329",
        ".6400 .3300 .2900 .6000 .1500 .0600 .3333 .3333",
        "0 0 0 0 0 0 0 0",
        "0.0000 0.0000 0.0000 0.0000 0.0000 0.0000 0.0000 0.0000",
    ] {
        let picture = header(&format!("PRIMARIES={same}")).unwrap();
        assert_eq!((colours(&picture)[0], picture.notes), ([0.5, 0.25, 0.125], vec![]), "{same}");
    }
    // BT.2020, by the matrix of ITU-R BT.2087.
    let wide = header("PRIMARIES= 0.708 0.292 0.17 0.797 0.131 0.046 0.3127 0.329").unwrap();
    let [r, g, b] = colours(&wide)[0];
    let expected = [0.6742, 0.2199, 0.1056];
    assert!(
        [r - expected[0], g - expected[1], b - expected[2]].iter().all(|x| x.abs() < 2e-4),
        "{r} {g} {b}"
    );
    assert!(wide.notes[0].contains("converted to sRGB"), "{:?}", wide.notes);
    for odd in ["1 2 3", "0.64 0.33 0.3 0.6 0.15 0.06 0 0", "nan 0.33 0.3 0.6 0.15 0.06 0.3127 0.329", "?"] {
        let picture = header(&format!("PRIMARIES={odd}")).unwrap();
        assert_eq!(colours(&picture)[0], [0.5, 0.25, 0.125], "{odd}");
        assert!(picture.notes[0].contains("no primaries"), "{:?}", picture.notes);
    }
    for line in ["FORMAT=32-bit_rle_spectral", "FORMAT=ascii", "NCOMP=8"] {
        assert!(header(line).unwrap_err().to_string().contains("not supported"), "{line}");
    }
}

#[test]
fn impossible_sizes_are_refused() {
    for line in [
        "-Y 1 +Y 1",
        "-Y 1",
        "Y 1 X 1",
        "-Y 0 +X 1",
        "-Y -1 +X 1",
        "-Y 4000000000 +X 4000000000",
        "-Y 3 +X 1",
    ] {
        assert!(read(&format!("#?x\n\n{line}\n"), &[[1, 2, 3, 128]; 2]).is_err(), "{line}");
    }
    assert!(read("#?x\n-Y 1 +X 1\n", &[]).is_err());
}
