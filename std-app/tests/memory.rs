//! `--memory` limits the process from the first byte that it reads. Whatever size a file claims, the program
//! ends with a message within seconds.

use crate::support::Folder;
use core::time::Duration;
use halflight::save::{self, Format, Image};
use image::{DynamicImage, GrayImage, ImageFormat};
use std::io::Cursor;
use std::process::{Command, Output, Stdio};
use std::time::Instant;

/// Address space of the process in KiB: mappings made before reading, plus `--memory`.
const ADDRESSES: u32 = 700 << 10;
/// Generous: a failing program would decode a picture before checking its size.
const DEADLINE: Duration = Duration::from_secs(30);

fn write(folder: &Folder, name: &str, bytes: impl AsRef<[u8]>) {
    std::fs::write(folder.path(name), bytes).unwrap();
}

/// Runs the program within its limit of memory.
fn held(folder: &Folder, arguments: &str) -> Output {
    let start = Instant::now();
    let mut command = Command::new("sh");
    command.current_dir(&folder.0).env("RAYON_NUM_THREADS", "1").stdin(Stdio::null());
    command.args([
        "-c",
        &format!("ulimit -v {ADDRESSES}; exec \"$0\" \"$@\""),
        env!("CARGO_BIN_EXE_halflight"),
    ]);
    let output = command.args(arguments.split_whitespace()).output().unwrap();
    assert!(start.elapsed() < DEADLINE, "{arguments}: {:?}", start.elapsed());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code().is_some(), "{arguments} ends by a signal: {said}");
    assert!(!said.contains("panicked") && !said.contains("internal error"), "{arguments}: {said}");
    output
}

/// Messages of a run that ends with exit code `code`.
fn said(folder: &Folder, arguments: &str, code: i32) -> String {
    let output = held(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments}: {said}");
    said
}

/// Small picture files that need, or claim to need, much more than 32 MB.
fn bombs() -> Vec<(&'static str, Vec<u8>)> {
    let encoded = |picture: DynamicImage, format| {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    };
    let grey = |side| DynamicImage::ImageLuma8(GrayImage::new(side, side));
    let mut bmp = encoded(grey(1), ImageFormat::Bmp);
    bmp[18..22].copy_from_slice(&2_900u32.to_le_bytes());
    bmp[22..26].copy_from_slice(&2_900u32.to_le_bytes());
    let mut tga = encoded(grey(1), ImageFormat::Tga);
    tga[12..16].copy_from_slice(&[0x60, 0xea, 0x60, 0xea]);
    let mut exr = save::encode(&Image::black(1, 1), Format::Exr).unwrap();
    let window = b"displayWindow\0box2i\0";
    let at = exr.windows(window.len()).position(|bytes| bytes == window).unwrap() + window.len() + 12;
    exr[at..at + 8].copy_from_slice(&[0x3f, 0x3f, 0, 0, 0x3f, 0x3f, 0, 0]);
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16000 +X 16000\n".to_vec();
    hdr.extend(vec![0; 100_000]);
    let mut tiff = encoded(grey(1), ImageFormat::Tiff);
    // Width and height are tags 256 and 257, each with one short or long value.
    for tag in [256u16, 257] {
        let entry = |bytes: &[u8]| bytes[..2] == tag.to_le_bytes() && bytes[4..8] == 1u32.to_le_bytes();
        let at = tiff.windows(12).position(entry).unwrap();
        tiff[at + 8..at + 12].copy_from_slice(&1_300u32.to_le_bytes());
    }
    vec![
        ("bomb.png", encoded(grey(6_000), ImageFormat::Png)),
        ("bomb.webp", encoded(grey(4_000), ImageFormat::WebP)),
        ("bomb.jpg", encoded(grey(3_000), ImageFormat::Jpeg)),
        ("bomb.bmp", bmp),
        ("bomb.tga", tga),
        ("bomb.exr", exr),
        ("bomb.hdr", hdr),
        ("bomb.pfm", b"PF\n16000 16000\n-1.0\n".to_vec()),
        ("bomb.tif", tiff),
    ]
}

#[test]
fn pictures_say_what_they_take_before_they_take_it() {
    let folder = Folder::new("bombs");
    for (name, bytes) in bombs() {
        write(&folder, name, bytes);
        write(&folder, "scene.mtl", format!("newmtl floor\nmap_Kd {name}\nnewmtl lamp\nKe 1 1 1\n"));
        let flags = "--memory 32M --threads 1 --size 8x8 --spp 1 -o out.pfm";
        assert!(said(&folder, &format!("render scene.obj {flags}"), 0).contains(name), "{name}");
        write(
            &folder,
            "sky.toml",
            format!("[[mesh]]\nfile = \"scene.obj\"\n[environment]\nmap = \"{name}\"\n"),
        );
        assert!(said(&folder, &format!("render sky.toml {flags}"), 2).contains(name), "{name}");
        assert!(said(&folder, &format!("render scene.obj {flags} --reference {name}"), 2).contains(name));
        // Without a flag the limit of the process applies.
        let output = held(&folder, &format!("compare {name} {name}"));
        let words = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(0) || words.contains(name), "{words}");
    }
}

#[test]
fn texts_say_what_they_take_before_they_take_it() {
    let folder = Folder::new("texts");
    let square = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let materials: String = (0..60_000).map(|i| format!("usemtl {i}\nf 1 2 3\n")).collect();
    let files = [
        ("faces.obj", square.to_string() + &"f 1 2 3\n".repeat(400_000)),
        ("vertices.obj", square.to_string() + &"v 0 0 0\n".repeat(600_000) + "f 1 2 3\n"),
        ("materials.obj", square.to_string() + &materials),
        ("lights.toml", "[[light]]\n".repeat(100_000)),
        ("numbers.toml", format!("a = [{}0]\n", "0,".repeat(400_000))),
    ];
    for (name, text) in files {
        write(&folder, name, text);
        let words = said(
            &folder,
            &format!("render {name} --memory 32M --threads 1 --size 8x8 --spp 1 -o out.pfm"),
            2,
        );
        assert!(words.contains(name) && words.contains("--memory"), "{words}");
    }
    write(&folder, "scene.mtl", "newmtl floor\n".repeat(60_000));
    let words = said(&folder, "render scene.obj --memory 32M --threads 1 --size 8x8 --spp 1 -o out.pfm", 0);
    assert!(words.contains("scene.mtl") && words.contains("left out"), "{words}");
    // One mesh in many places, in the memory of one or with triangles of its own in each.
    write(&folder, "grid.obj", square.to_string() + &"f 1 2 3\n".repeat(2_000));
    let many = "[[mesh]]\nfile = \"grid.obj\"\n";
    for (mesh, code) in [(many.into(), 0), (format!("{many}share = false\n"), 2)] {
        write(&folder, "many.toml", mesh.repeat(3_000));
        let arguments = "render many.toml --memory 48M --threads 1 --size 8x8 --spp 1 -o out.pfm";
        let words = said(&folder, arguments, code);
        assert!(code == 0 || words.contains("memory"), "{words}");
    }
}

/// A sealed file with `from` in its header replaced by `to`.
fn with_header(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let header = core::str::from_utf8(&bytes[16..16 + length]).unwrap();
    assert!(header.contains(from), "{header}");
    let header = header.replace(from, to);
    [&bytes[..12], &(header.len() as u32).to_le_bytes(), header.as_bytes(), &bytes[16 + length..]].concat()
}

#[test]
fn films_and_caches_that_lie_about_their_size_are_refused() {
    let folder = Folder::new("sealed");
    let flags = "--size 16x16 --spp 4 --threads 1 -o out.pfm";
    folder.object(&format!("render scene.obj --json {flags} --checkpoint film"));
    let film = std::fs::read(folder.path("film")).unwrap();
    write(&folder, "large", with_header(&film, "\"width\":16", "\"width\":16384"));
    write(&folder, "huge", with_header(&film, "\"height\":16", "\"height\":16000000"));
    let mut long = film.clone();
    long[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    write(&folder, "long", long);
    for name in ["large", "huge", "long"] {
        assert!(said(&folder, &format!("merge {name} -o out.pfm"), 2).contains(name));
        let words = said(&folder, &format!("render scene.obj --memory 64M {flags} --resume {name}"), 2);
        assert!(words.contains(name), "{words}");
    }

    let cached = format!("render scene.obj --method irradiance-cache {flags} --memory 64M");
    folder.object(&format!("{cached} --json --save-cache cache"));
    let cache = std::fs::read(folder.path("cache")).unwrap();
    let at = String::from_utf8_lossy(&cache).find("\"records\":").unwrap();
    let digits: String =
        cache[at + 10..].iter().map(|b| *b as char).take_while(|digit| digit.is_ascii_digit()).collect();
    write(&folder, "many", with_header(&cache, &format!("\"records\":{digits}"), "\"records\":4000000000"));
    assert!(said(&folder, &format!("{cached} --load-cache many"), 2).contains("many"));
}

#[test]
fn files_without_an_end_are_not_read_to_it() {
    let folder = Folder::new("endless");
    let words = said(&folder, "compare /dev/zero /dev/zero", 2);
    assert!(words.contains("/dev/zero"), "{words}");
    let words =
        said(&folder, "render scene.obj --memory 32M --size 8x8 --spp 1 -o out.pfm --reference /dev/zero", 2);
    assert!(words.contains("/dev/zero"), "{words}");
}
