//! OpenEXR: channel types, layers, parts, data windows.

use super::*;
use ::exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use ::exr::meta::attribute::Chromaticities;
use ::exr::prelude::{IntegerBounds, LayerAttributes, Vec2, WritableImage, f16};

fn layer(name: &str, channels: Vec<(&str, FlatSamples)>) -> Layer<AnyChannels<FlatSamples>> {
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    Layer::new((2, 1), LayerAttributes::named(name), Encoding::FAST_LOSSLESS, AnyChannels::sort(channels))
}

fn floats(values: [f32; 2]) -> FlatSamples {
    FlatSamples::F32(values.to_vec())
}

fn file(layers: Vec<Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    with_chromaticities(layers, None)
}

/// A file with x and y of red, green, blue and white.
fn with_chromaticities(layers: Vec<Layer<AnyChannels<FlatSamples>>>, given: Option<[f32; 8]>) -> Vec<u8> {
    let mut attributes = Image::from_layer(layers[0].clone()).attributes;
    attributes.chromaticities = given.map(|[rx, ry, gx, gy, bx, by, wx, wy]| Chromaticities {
        red: Vec2(rx, ry),
        green: Vec2(gx, gy),
        blue: Vec2(bx, by),
        white: Vec2(wx, wy),
    });
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layers(attributes, layers).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn read(bytes: &[u8]) -> (Vec<[f32; 3]>, Vec<f32>, Vec<String>) {
    let picture = read_bytes(bytes).unwrap();
    match picture.samples {
        Samples::Floats { rgb, alpha } => (rgb, alpha, picture.notes),
        other => panic!("{other:?}"),
    }
}

#[test]
fn channel_types_and_layers() {
    let half = FlatSamples::F16(vec![f16::from_f32(0.25), f16::INFINITY]);
    let whole = FlatSamples::U32(vec![7, 9]);
    let mixed = file(vec![layer(
        "",
        vec![("R", half), ("G", whole), ("B", floats([0.5, -1.0])), ("A", floats([1.0, 0.5]))],
    )]);
    let expected = (vec![[0.25, 7.0, 0.5], [f32::INFINITY, 9.0, -1.0]], vec![1.0, 0.5], vec![]);
    assert_eq!(read(&mixed), expected);

    let grey = file(vec![layer("", vec![("Y", floats([0.5, 2.0]))])]);
    assert_eq!(read(&grey), (vec![[0.5; 3], [2.0; 3]], vec![], vec![]));

    let rgb = |prefix: &str, value: f32| {
        ["R", "G", "B"].map(|channel| (format!("{prefix}{channel}"), floats([value; 2])))
    };
    let layered: Vec<(String, FlatSamples)> =
        rgb("albedo.", 1.0).into_iter().chain(rgb("beauty.", 3.0)).collect();
    let layered = layered.iter().map(|(name, samples)| (name.as_str(), samples.clone())).collect();
    let (colours, _, notes) = read(&file(vec![layer("", layered)]));
    assert_eq!(colours, [[3.0; 3]; 2]);
    assert_eq!(notes, ["its layer `beauty` is read"]);
}

#[test]
fn picture_in_a_later_part_is_chosen() {
    let depth = layer("depth", vec![("Z", floats([9.0; 2]))]);
    let colour =
        layer("colour", vec![("R", floats([1.0; 2])), ("G", floats([2.0; 2])), ("B", floats([3.0; 2]))]);
    assert_eq!(read(&file(vec![depth, colour])).0, [[1.0, 2.0, 3.0]; 2]);
}

#[test]
fn outside_of_the_data_window_is_black() {
    let mut image = Image::from_layer(layer("", vec![("Y", floats([5.0, 6.0])), ("A", floats([1.0; 2]))]));
    image.attributes.display_window = IntegerBounds::new((-1, 0), (2, 2));
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    let (colours, alpha, _) = read(bytes.get_ref());
    assert_eq!(colours, [[0.0; 3], [5.0; 3], [0.0; 3], [0.0; 3]]);
    assert_eq!(alpha, [0.0, 1.0, 0.0, 0.0]);
}

#[test]
fn truncated_files_are_refused() {
    let bytes = file(vec![layer("", vec![("Y", floats([5.0, 6.0]))])]);
    for length in 0..bytes.len() {
        assert!(read_bytes(&bytes[..length]).is_err(), "{length}");
    }
}

#[test]
fn chromaticities_are_converted_to_srgb() {
    const AP1: [f32; 8] = [0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767];
    let rgb = |given: Option<[f32; 8]>| {
        let channels = vec![
            ("R", floats([0.5, f32::INFINITY])),
            ("G", floats([0.25, f32::INFINITY])),
            ("B", floats([0.125, f32::INFINITY])),
        ];
        read(&with_chromaticities(vec![layer("", channels)], given))
    };
    // By the matrix of ACES (S-2014-004) with Bradford's adaptation.
    let (colours, _, notes) = rgb(Some(AP1));
    let [r, g, b] = colours[0];
    assert!(
        (r - 0.6867).abs() < 2e-4 && (g - 0.2188).abs() < 2e-4 && (b - 0.0999).abs() < 2e-4,
        "{r} {g} {b}"
    );
    assert_eq!(colours[1], [f32::INFINITY; 3]);
    assert!(notes[0].contains("0.7130 0.2930") && notes[0].contains("converted to sRGB"), "{notes:?}");
    let srgb = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];
    for same in [None, Some(srgb), Some([0.0; 8])] {
        assert_eq!(rgb(same), (vec![[0.5, 0.25, 0.125], [f32::INFINITY; 3]], vec![], vec![]), "{same:?}");
    }
    let (colours, _, notes) = rgb(Some([0.3; 8]));
    assert_eq!(colours[0], [0.5, 0.25, 0.125]);
    assert!(notes[0].contains("no primaries"), "{notes:?}");
    // A luminance has no primaries to convert.
    let grey = with_chromaticities(vec![layer("", vec![("Y", floats([0.5, 2.0]))])], Some(AP1));
    assert_eq!(read(&grey), (vec![[0.5; 3], [2.0; 3]], vec![], vec![]));
}
