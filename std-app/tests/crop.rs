//! Windows of pictures: their bits, their work, and refusals.

use crate::support::Folder;
use core::sync::atomic::AtomicBool;
use halflight::load::{LoadOptions, load};
use halflight::render::{self, Method, Reconstruct, RenderResult, Settings, Shard, Stop};
use halflight_core::film::PixelWindow;

const CORNELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.obj");

/// Width and height of the picture, and the corner and size of the window.
const FRAME: [u32; 2] = [80, 64];
const CORNER: [u32; 2] = [21, 34];
const SIZE: [u32; 2] = [19, 7];

fn picture(method: Method, shard: Shard) -> RenderResult {
    let loaded = load(CORNELL.as_ref(), &LoadOptions::default()).unwrap();
    let views = loaded.views();
    let stop = Stop { spp: Some(8), ..Stop::default() };
    let [width, height] = FRAME;
    let settings = Settings {
        method: Some(method),
        width,
        height,
        stop,
        shard,
        audit: Some(0.0),
        reconstruct: Reconstruct::Off,
        ..Settings::default()
    };
    let never = AtomicBool::new(false);
    render::render(&views.scene(loaded.camera_or_default()), &settings, &mut |_| {}, &never).unwrap()
}

#[test]
fn a_window_has_the_bits_of_the_whole_picture_by_every_method() {
    let window = Shard::of_window(PixelWindow::new(FRAME, CORNER, SIZE).unwrap());
    for method in Method::ALL {
        let [whole, part] = [Shard::WHOLE, window].map(|shard| picture(method, shard));
        assert_eq!([part.image.width, part.image.height], SIZE);
        for (i, pixel) in (0..).zip(&part.image.pixels) {
            let (x, y) = (CORNER[0] + i % SIZE[0], CORNER[1] + i / SIZE[0]);
            let expected = whole.image.pixels[(y * FRAME[0] + x) as usize];
            assert_eq!(*pixel, expected, "{} at {x}, {y}", method.name());
        }
        let pixels = (SIZE[0] * SIZE[1]) as usize;
        assert_eq!([part.samples.len(), part.variance.pixels.len()], [pixels; 2]);
    }
}

#[test]
fn a_window_saves_the_paths_of_the_other_pixels() {
    let window = Shard::of_window(PixelWindow::new(FRAME, CORNER, SIZE).unwrap());
    let [whole, part] = [Shard::WHOLE, window].map(|shard| picture(Method::Path, shard).counters.paths);
    // Four of twenty tiles.
    assert!(5 * part <= whole, "{part} of {whole} paths");
}

#[test]
fn files_have_the_window_and_the_object_its_place() {
    let folder = Folder::new("crop");
    let all = "render scene.obj --size 64x48 --spp 4 --method path --reconstruct off";
    folder.object(&format!("{all} -o whole.pfm --json"));
    let object = folder.object(&format!("{all} -o part.pfm --crop 20,10,30x25 --json"));
    assert_eq!(object["crop"], serde_json::json!([20, 10, 30, 25]));
    assert!(object["error"]["relmse"].as_f64().is_some(), "{object}");
    let [whole, part] = ["whole.pfm", "part.pfm"].map(|name| std::fs::read(folder.path(name)).unwrap());
    let [whole, part] = [(&whole, 64 * 48), (&part, 30 * 25)].map(|(file, n)| &file[file.len() - 12 * n..]);
    // Rows of a PFM go up.
    for (row, pixels) in part.chunks(12 * 30).enumerate() {
        let from = 12 * ((48 - 35 + row) * 64 + 20);
        assert!(*pixels == whole[from..from + 12 * 30], "row {row}");
    }
    // An OpenEXR file has the window in its place, with its layers: the display window is the whole picture.
    folder.object(&format!("{all} -o part.exr --crop 20,10,30x25 --aov samples --json"));
    let placed = halflight::save::read(&folder.path("part.exr")).unwrap();
    assert_eq!([placed.width, placed.height], [64, 48]);
    let whole = halflight::save::read(&folder.path("whole.pfm")).unwrap();
    for (i, (pixel, of_whole)) in (0..).zip(placed.pixels.iter().zip(&whole.pixels)) {
        let is_in = (20..50).contains(&(i % 64)) && (10..35).contains(&(i / 64));
        assert_eq!(*pixel, if is_in { *of_whole } else { [0.0; 3] }, "pixel {i}");
    }
    for (window, message) in [
        ("60,10,5x5", "is not within the picture"),
        ("0,0,0x5", "a corner and a size in pixels are expected"),
        ("1,2", "a corner and a size in pixels are expected"),
    ] {
        assert!(folder.refused(&format!("{all} -o part.pfm --crop {window}")).contains(message));
    }
    folder.refused(&format!("{all} -o part.pfm --crop 0,0,5x5 --checkpoint film.half"));
}
