//! One reader of pictures for all commands: each command reads the same formats, and reports every repair and
//! omission.

use crate::support::Folder;
use halflight::picture;
use halflight::save::{self, Format, Image};
use image::{DynamicImage, ImageBuffer, ImageFormat};
use std::io::Cursor;
use std::path::Path;

/// Colour of float pictures, and of byte pictures: sRGB 188 137 99 is 0.503 0.251 0.125.
const COLOUR: [f32; 3] = [0.5, 0.25, 0.125];
const BYTES: [u8; 3] = [188, 137, 99];

/// Two steps of 8 bits in the sRGB curve at the darkest channel, relative: the error of JPEG.
const TOLERANCE: f64 = 0.03;

fn write(folder: &Folder, name: &str, bytes: impl AsRef<[u8]>) {
    std::fs::write(folder.path(name), bytes).unwrap();
}

/// A scene that shows only its sky.
fn sky(folder: &Folder, map: &str) {
    let scene = format!(
        "[[mesh]]\nfile = \"scene.obj\"\n[camera]\neye = [0, 9, 0]\nlook_at = [0, 19, 0.1]\n\
         [environment]\nmap = \"{map}\"\n"
    );
    write(folder, "sky.toml", scene);
}

const RENDER: &str = "--size 8x8 --spp 16 --threads 1 --json";

fn mean(folder: &Folder, arguments: &str) -> [f64; 3] {
    let object = folder.object(&format!("render {arguments} {RENDER} -o out.pfm"));
    [0, 1, 2].map(|c| object["mean_radiance"][c].as_f64().unwrap())
}

fn close(found: [f64; 3], right: [f32; 3]) -> bool {
    found.iter().zip(right).all(|(found, right)| (found / f64::from(right) - 1.0).abs() < TOLERANCE)
}

fn encoded(picture: DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn constant(rgba: [u8; 4]) -> DynamicImage {
    DynamicImage::ImageRgba8(ImageBuffer::from_fn(16, 8, |_, _| image::Rgba(rgba)))
}

/// One picture in every format, with file names.
fn formats() -> Vec<(&'static str, Vec<u8>)> {
    let floats = Image { width: 16, height: 8, pixels: vec![COLOUR; 128] };
    let [r, g, b] = BYTES;
    let bytes = |format| encoded(DynamicImage::ImageRgb8(constant([r, g, b, 255]).into_rgb8()), format);
    let words = constant([r, g, b, 255]).into_rgb16();
    let rgb: Vec<u8> = [128, 64, 32, 128].repeat(128);
    vec![
        ("a.pfm", save::encode(&floats, Format::Pfm).unwrap()),
        ("a.exr", save::encode(&floats, Format::Exr).unwrap()),
        ("a.hdr", save::encode(&floats, Format::Hdr).unwrap()),
        ("flat.hdr", [b"#?RGBE\nEXPOSURE=1\n\n-X 16 +Y 8\n", &rgb[..]].concat()),
        ("a.png", bytes(ImageFormat::Png)),
        ("b.png", encoded(DynamicImage::ImageRgb16(words), ImageFormat::Png)),
        ("a.bmp", bytes(ImageFormat::Bmp)),
        ("a.tga", bytes(ImageFormat::Tga)),
        ("a.webp", bytes(ImageFormat::WebP)),
        ("a.tif", bytes(ImageFormat::Tiff)),
        ("a.jpg", bytes(ImageFormat::Jpeg)),
        ("no extension", bytes(ImageFormat::Jpeg)),
        ("float.tif", {
            let picture = ImageBuffer::from_fn(16, 8, |_, _| image::Rgb(COLOUR));
            encoded(DynamicImage::ImageRgb32F(picture), ImageFormat::Tiff)
        }),
    ]
}

#[test]
fn every_format_is_a_sky_a_texture_and_a_picture_to_compare() {
    let folder = Folder::new("pictures");
    write(
        &folder,
        "quad.obj",
        "mtllib quad.mtl\nv -9 0 -9\nv 9 0 -9\nv 9 0 9\nv -9 0 9\nvt 0 0\nusemtl a\nf 4/1 3/1 2/1 1/1\n",
    );
    for (name, bytes) in formats() {
        write(&folder, name, bytes);
        sky(&folder, name);
        let found = mean(&folder, "sky.toml");
        assert!(close(found, COLOUR), "{name} as a sky: {found:?}");
        let object = folder.command("compare a.pfm --json").arg(folder.path(name)).output().unwrap();
        let object: serde_json::Value = serde_json::from_slice(&object.stdout).unwrap();
        let relmse = object["relmse"].as_f64().unwrap();
        assert!(relmse < TOLERANCE * TOLERANCE, "{name} compared: {relmse}");
        write(&folder, "quad.mtl", format!("newmtl a\nKd 0 0 0\nKe 1 1 1\nmap_Ke {name}\n"));
        let found = mean(&folder, "quad.obj --eye 0,5,0 --look-at 0,0,0.01");
        assert!(close(found, COLOUR), "{name} as a texture: {found:?}");
    }
}

#[test]
fn alpha_of_every_format_cuts_out() {
    let folder = Folder::new("alpha");
    let rgba = [255, 255, 255, 64];
    let floats = ImageBuffer::from_fn(16, 8, |_, _| image::Rgba([1.0, 1.0, 1.0, 64.0 / 255.0f32]));
    let floats = || DynamicImage::ImageRgba32F(floats.clone());
    let mut pfm = b"PF4\n1 1\n-1\n".to_vec();
    pfm.extend([1.0, 1.0, 1.0, 64.0 / 255.0f32].iter().flat_map(|value| value.to_le_bytes()));
    let files = [
        ("a.png", encoded(constant(rgba), ImageFormat::Png)),
        ("a.tga", encoded(constant(rgba), ImageFormat::Tga)),
        ("a.webp", encoded(constant(rgba), ImageFormat::WebP)),
        ("a.tif", encoded(constant(rgba), ImageFormat::Tiff)),
        ("b.tif", encoded(floats(), ImageFormat::Tiff)),
        ("a.pfm", pfm),
    ];
    let scene = "[[mesh]]\nfile = \"quad.obj\"\n[camera]\neye = [0, 5, 0]\nlook_at = [0, 0, 0.01]\n\
        [environment]\nradiance = 1\n";
    write(&folder, "scene.toml", scene);
    write(
        &folder,
        "quad.obj",
        "mtllib quad.mtl\nv -9 0 -9\nv 9 0 -9\nv 9 0 9\nv -9 0 9\nvt 0 0\nusemtl a\nf 4/1 3/1 2/1 1/1\n",
    );
    for (name, bytes) in files {
        write(&folder, name, bytes);
        write(&folder, "quad.mtl", format!("newmtl a\nKd 0 0 0\nmap_d {name}\n"));
        let object = folder.object("render scene.toml --size 16x16 --spp 256 --threads 1 --json -o out.pfm");
        let found = object["mean_radiance"][0].as_f64().unwrap();
        // A black square is opaque with probability 64 / 255; 65536 samples, five standard deviations.
        assert!((found - (1.0 - 64.0 / 255.0)).abs() < 0.009, "{name}: {found}");
    }
}

#[test]
fn what_the_scene_file_names_is_refused_where_it_cannot_be_read() {
    let folder = Folder::new("broken");
    let whole = |name: &str| formats().into_iter().find(|(known, _)| *known == name).unwrap().1;
    let half = |name: &str| {
        let bytes = whole(name);
        bytes[..bytes.len() / 2].to_vec()
    };
    let spectral = b"#?RADIANCE\nFORMAT=32-bit_rle_spectral\n\n-Y 1 +X 1\n\x80\x80\x80\x80".to_vec();
    let files = [
        ("text.exr", b"this is no picture\n".to_vec()),
        ("empty.png", Vec::new()),
        ("half.exr", half("a.exr")),
        ("half.hdr", half("flat.hdr")),
        ("half.pfm", half("a.pfm")),
        ("half.png", half("b.png")),
        ("half.bmp", half("a.bmp")),
        ("half.tga", half("a.tga")),
        ("half.tif", half("float.tif")),
        ("spectral.hdr", spectral),
    ];
    for (name, bytes) in files {
        write(&folder, name, bytes);
        sky(&folder, name);
        let said = folder.refused(&format!("render sky.toml {RENDER} -o out.pfm"));
        assert!(said.contains(name), "{said}");
        write(
            &folder,
            "map.toml",
            format!("[[mesh]]\nfile = \"scene.obj\"\n[material.floor]\ncolor_map = \"{name}\"\n"),
        );
        let said = folder.refused(&format!("render map.toml {RENDER} -o out.pfm"));
        assert!(said.contains(name), "{said}");
        assert!(folder.refused(&format!("compare {name} {name}")).contains(name));
        // Unreadable maps of an MTL give a note.
        write(&folder, "scene.mtl", format!("newmtl floor\nmap_Kd {name}\nnewmtl lamp\nKe 1 1 1\n"));
        let output = folder.run(&format!("render scene.obj {RENDER} -o out.pfm"));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(0) && said.contains(name), "{said}");
    }
}

/// A JPEG without its last quarter.
fn cut_jpeg() -> Vec<u8> {
    let value = |x: u32, y: u32| image::Rgb([(x * 5) as u8, (y * 9) as u8, (x * y) as u8]);
    let bytes = encoded(DynamicImage::ImageRgb8(ImageBuffer::from_fn(48, 24, value)), ImageFormat::Jpeg);
    bytes[..bytes.len() * 3 / 4].to_vec()
}

#[test]
fn a_repair_is_noted_wherever_the_picture_is_read() {
    let folder = Folder::new("repaired");
    write(&folder, "cut.jpg", cut_jpeg());
    write(&folder, "scene.mtl", "newmtl floor\nmap_Kd cut.jpg\nnewmtl lamp\nKe 1 1 1\n");
    sky(&folder, "cut.jpg");
    for arguments in [
        "render scene.obj --size 8x8 --spp 1 -o out.pfm",
        "render sky.toml --size 8x8 --spp 1 -o out.pfm",
        "render scene.obj --size 48x24 --spp 1 -o out.pfm --reference cut.jpg",
        "compare cut.jpg cut.jpg",
        "info scene.obj",
    ] {
        let output = folder.run(arguments);
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert!(output.status.code() == Some(0), "{arguments}: {said}");
        assert!(said.contains("cut.jpg: its end is missing"), "{arguments}: {said}");
    }
}

#[test]
fn numbers_that_light_cannot_be_reach_no_pixel() {
    let folder = Folder::new("infinite");
    let odd = [f32::INFINITY, f32::NAN, f32::MAX, -1.0, f32::NEG_INFINITY, 1e-40];
    let mut pixels = vec![[0.5; 3]; 128];
    pixels.iter_mut().zip(odd).for_each(|(pixel, value)| *pixel = [value, 1.0, 1.0]);
    write(&folder, "odd.exr", save::encode(&Image { width: 16, height: 8, pixels }, Format::Exr).unwrap());
    sky(&folder, "odd.exr");
    let output = folder.run("render sky.toml --size 32x32 --spp 16 --threads 1 -o out.pfm");
    let said = String::from_utf8_lossy(&output.stderr);
    for what in [
        "odd.exr: infinite texels are set to 1000000",
        "NaN or negative are set to 0, 3 times",
        "texels above 1e15",
    ] {
        assert!(said.contains(what), "{said}");
    }
    let picture = picture::decode(&std::fs::read(folder.path("out.pfm")).unwrap(), Path::new("a"), 1 << 24);
    assert!(
        Image::from(picture.unwrap()).pixels.iter().flatten().all(|value| value.is_finite() && *value >= 0.0)
    );
}
