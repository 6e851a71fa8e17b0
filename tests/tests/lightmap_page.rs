//! The page of scenes/lightmap in a real browser: the room with its lightmap beside our own picture, and a
//! sphere lit by probes beside irradiances by its normals. Skipped with a message without Chromium or npm,
//! which fetches the package `three`.

use crate::browser::{Folder, browser, noted, opened_at, with_script};
use crate::server::{THREE, package, serve};
use core::f64::consts::PI;
use core::sync::atomic::AtomicBool;
use halflight::bake::{
    BakeSettings, Baked, DirectionalLayout, Lightmap, LightmapSettings, Probe, ProbeFormat, ProbeGrid,
    ProbeSettings, Quantity, Sensor, irradiance, write_probes,
};
use halflight::compare::compare;
use halflight::load::{LoadOptions, LoadedScene, load};
use halflight::memory::Budget;
use halflight::render::{Method, Settings, Stop, render};
use halflight::save::{Format, Image, from_srgb};
use halflight_core::glam::{DVec3, Vec3};
use halflight_core::{IrradiancePoint, Rgb};
use std::path::Path;

/// Largest mean FLIP of the room in the browser against our own picture.
const MOST_FLIP: f64 = 0.05;

/// Largest root mean square error of the light of the sphere by its harmonics, relative to its largest value:
/// bytes of sRGB.
const BYTES: f64 = 0.005;

/// The same beside irradiances by its normals: at this place harmonics of degree 2 have an error of 0.022.
const MOST_ERROR: f64 = 0.03;

/// Notes the pixels of the canvas, in rows from the bottom.
const SCRIPT: &str = "(async () => {
    while (!document.documentElement.dataset.ready) await new Promise((done) => setTimeout(done, 60));
    window.view.draw();
    const gl = window.view.renderer.getContext();
    const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    const bytes = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    const probe = document.body.appendChild(document.createElement('pre'));
    const note = (name, value) => { probe.textContent += `@${name}=${value}\\n`; };
    note('size', width);
    note('harmonics', window.view.sh.toArray().join(' '));
    note('pixels', bytes.join(' '));
})();";

/// The linear picture that a browser shows, and its probe at the sphere.
fn shown(browser: &str, folder: &Path, port: u16, query: &str) -> (Image, Probe) {
    let flags = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--window-size=300,300"];
    let address = format!("http://127.0.0.1:{port}/index.html{query}");
    let (console, document) = opened_at(browser, folder, &address, &flags);
    let errors: Vec<_> = console.iter().filter(|line| line.contains("rror")).collect();
    assert!(errors.is_empty(), "{errors:?}");
    let side: u32 = noted(&document, "size").parse().unwrap();
    let picture = linear_picture(noted(&document, "pixels"), side);
    let harmonics: Vec<f32> =
        noted(&document, "harmonics").split(' ').map(|number| number.parse().unwrap()).collect();
    let coefficients = core::array::from_fn(|i| Rgb::from_slice(&harmonics[3 * i..]));
    (picture, Probe { coefficients, ..Probe::default() })
}

/// The linear picture of bytes of R, G, B and A, in rows from the bottom.
pub(crate) fn linear_picture(bytes: &str, side: u32) -> Image {
    let bytes: Vec<u8> = bytes.split(' ').map(|byte| byte.parse().unwrap()).collect();
    let linear = |rgba: &[u8]| [0, 1, 2].map(|channel| from_srgb(f32::from(rgba[channel]) / 255.0));
    let rows = bytes.chunks(4 * side as usize).rev();
    Image { width: side, height: side, pixels: rows.flat_map(|row| row.chunks(4).map(linear)).collect() }
}

/// Our own picture of a scene.
pub(crate) fn picture_of(loaded: &LoadedScene, [width, height]: [u32; 2]) -> Image {
    let stop = Stop { spp: Some(64), ..Stop::default() };
    let settings = Settings { width, height, stop, method: Some(Method::Path), ..Settings::default() };
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    render(&scene, &settings, &mut |_| (), &AtomicBool::new(false)).unwrap().image
}

/// Irradiances of `points` by so many samples.
pub(crate) fn bake(loaded: &LoadedScene, points: &[IrradiancePoint], samples: u32) -> Baked {
    let stop = Stop { spp: Some(samples), ..Stop::default() };
    let settings = BakeSettings { stop, back_faces: true, ..BakeSettings::default() };
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    irradiance(&scene, points, &settings, &mut |_| {}, &AtomicBool::new(false)).unwrap()
}

/// Writes the probes of a room into `folder`, and a lightmap by the name of its file. Returns the probes.
/// The lightmap is a directional one of Godot if its file has such a name.
pub(crate) fn write_light(
    loaded: &LoadedScene,
    folder: &Path,
    (name, quantity): (&str, Quantity),
) -> Vec<Probe> {
    let mut budget = Budget::new(None);
    let (size, directional) = ([160, 120], name.starts_with("directional"));
    let layout = DirectionalLayout::Godot;
    let settings = LightmapSettings { subject: None, size, points: 1, padding: 4, directional, layout };
    let lightmap = Lightmap::new(loaded, settings, &mut budget, &mut |_| true).unwrap();
    let map = lightmap.map(&bake(loaded, lightmap.points(), 128), quantity, &|| true);
    let format = Format::of(Path::new(name)).unwrap();
    std::fs::write(folder.join(name), map.encode(format).unwrap()).unwrap();
    let settings = ProbeSettings { size: [6; 3], bounds: None, cubes: false };
    let grid = ProbeGrid::new(loaded, settings, &mut budget).unwrap();
    let probes = grid.probes(&bake(loaded, grid.points(), 256));
    let mut file = Vec::new();
    write_probes(&mut file, ProbeFormat::Json, &grid, &probes).unwrap();
    std::fs::write(folder.join("probes.json"), file).unwrap();
    probes
}

/// Pixels of the sphere of the page and its normals there.
pub(crate) fn sphere_pixels(side: u32) -> Vec<(usize, Vec3)> {
    let (eye, target, centre, radius) =
        (DVec3::new(0.0, 1.0, 3.6), DVec3::new(0.0, 0.95, 0.0), DVec3::new(0.5, 0.45, 0.25), 0.3);
    let along = (target - eye).normalize();
    let across = along.cross(DVec3::Y).normalize();
    let (up, slope) = (across.cross(along), 20f64.to_radians().tan());
    let mut pixels = Vec::new();
    for (x, y) in (0..side * side).map(|i| (i % side, i / side)).filter(|(x, y)| (x + 2 * y) % 5 == 0) {
        let at = |pixel: u32| (2.0 * f64::from(pixel) + 1.0) / f64::from(side) - 1.0;
        let direction = (along + slope * (at(x) * across - at(y) * up)).normalize();
        let nearest = (centre - eye).dot(direction);
        let square = radius * radius - (eye + nearest * direction - centre).length_squared();
        // Pixels at the outline have other light in them.
        if square > 0.2 * radius * radius {
            let normal = (eye + (nearest - square.sqrt()) * direction - centre) / radius;
            pixels.push(((y * side + x) as usize, normal.as_vec3()));
        }
    }
    pixels
}

#[test]
fn three_js_shows_the_lightmap_and_the_probes_as_we_do() {
    let (Some(browser), Some(three)) = (browser(), package(THREE)) else { return };
    let folder = Folder::new("lightmap");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/lightmap");
    let page = std::fs::read_to_string(scene.join("index.html")).unwrap();
    std::fs::write(folder.0.join("index.html"), with_script(&page, SCRIPT)).unwrap();
    std::fs::copy(scene.join("room.obj"), folder.0.join("room.obj")).unwrap();
    let options = LoadOptions { keeps_texcoords: true, ..LoadOptions::default() };
    let loaded = load(&scene.join("room.toml"), &options).unwrap();
    write_light(&loaded, &folder.0, ("map.exr", Quantity::Irradiance));
    let (port, _posted) = serve(folder.0.clone(), &[("three", three)]);

    let (room, _) = shown(browser, &folder.0, port, "?sphere=off");
    let (width, height) = (room.width, room.height);
    let flip = compare(&room, &picture_of(&loaded, [width, height])).unwrap().flip;
    println!("room in the browser: FLIP {flip:.4}");
    assert!(flip < MOST_FLIP, "{flip}");

    let (picture, probe) = shown(browser, &folder.0, port, "");
    let pixels = sphere_pixels(width);
    assert!(pixels.len() > 50, "{}", pixels.len());
    let sensor = |normal: &Vec3| Sensor { position: [0.5, 0.45, 0.25], normal: normal.as_dvec3().into() };
    let points: Vec<_> = pixels.iter().map(|(_, normal)| sensor(normal).point(&loaded)).collect();
    let truth = bake(&loaded, &points, 2048);
    let found =
        || pixels.iter().map(|(pixel, _)| DVec3::from(picture.pixels[*pixel].map(f64::from)) * PI / 0.7);
    let by_harmonics: Vec<_> =
        pixels.iter().map(|(_, normal)| probe.irradiance(*normal).as_dvec3()).collect();
    let by_normals: Vec<_> = truth.values.iter().map(|value| value.irradiance.as_dvec3()).collect();
    let error = |truth: &[DVec3]| {
        let squares = found().zip(truth).map(|(found, truth)| (found - truth).length_squared() / 3.0);
        let most = truth.iter().map(|truth| truth.max_element()).fold(0.0, f64::max);
        (squares.sum::<f64>() / truth.len() as f64).sqrt() / most
    };
    let errors = [error(&by_harmonics), error(&by_normals)];
    println!("sphere in the browser: errors {errors:.4?} at {} pixels", pixels.len());
    assert!(errors[0] < BYTES && errors[1] < MOST_ERROR, "{errors:?}");
}
