//! Golden table: hashes of pictures of every method, scene, seed and instruction set.
//!
//! The renderer is deterministic, so a change of structure keeps every row. Rows change in commits that fix
//! an error or delete a mechanism, and these commits say so:
//!
//!     GOLDEN=write cargo test --profile quick -p halflight-tests --test main golden::
//!
//! rewrites `golden.txt` for the instruction sets of this machine; the rows of others stay.

use glam::Vec3;
use halflight::load::{self, LoadOptions};
use halflight::render::{Method, RenderResult, Settings};
use halflight_core::scene::Scene;
use halflight_simd::Level;
use halflight_tests::render::render;
use halflight_tests::scenes::{
    SceneBuffers, constant_environment, cornell_box, everything, glass, in_a_room, lamp_before,
};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Pixels across and down: tiles of 16 pixels are cut at the border.
const SIZE: u32 = 20;

/// Samples per pixel: enough for an error estimate and for more than one set of photon maps.
const SPP: u32 = 9;

const SEEDS: [u32; 2] = [0, 77];

/// Calls `each` with the scenes of the repository as loaded, and with scenes made by hand.
fn for_each_scene(mut each: impl FnMut(&str, &Scene)) {
    for file in
        ["cornell/cornell.obj", "caustic/caustic.toml", "glossy/glossy.toml", "two-rooms/two-rooms.toml"]
    {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(file);
        let loaded = load::load(&path, &LoadOptions::default()).expect("a scene of the repository");
        let views = loaded.views();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        each(&name, &views.scene(loaded.camera_or_default()));
    }
    let made = [
        ("white-furnace", furnace()),
        ("box", cornell_box()),
        ("everything", everything()),
        ("glass-in-room", in_a_room(lamp_before(glass(0.0), 0.05))),
    ];
    for (name, buffers) in &made {
        each(name, &buffers.scene());
    }
}

/// A ball under a white sky.
fn furnace() -> SceneBuffers {
    let mut buffers = cornell_box();
    buffers.triangles.clear();
    buffers.positions.clear();
    buffers.environment = constant_environment(1.0);
    buffers.sphere(Vec3::splat(0.5), 0.4, 8, 0);
    buffers
}

/// FNV-1a over the bits of the picture.
fn hash(result: &RenderResult) -> u64 {
    let bytes = result.image.pixels.iter().flatten().flat_map(|value| value.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

/// A row: the render's name, the hash of its picture, and its estimated error.
fn row(scene: &Scene, method: Method, seed: u32, level: Level) -> String {
    let result = render(scene, method, SIZE, SPP, |settings: &mut Settings| {
        settings.seed = seed;
        settings.level = level;
        settings.threads = Some(2);
    });
    let sum: f64 = result.image.pixels.iter().flatten().map(|value| f64::from(*value)).sum();
    let mean = sum / (3.0 * f64::from(SIZE * SIZE));
    let error = result.error.map_or("none".to_owned(), |error| format!("{:.6e}", error.relmse));
    format!("{:016x} {mean:.6e} {error}", hash(&result))
}

fn table() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden.txt")
}

/// Rows of the file by name of the render.
fn read_rows() -> BTreeMap<String, String> {
    let text = fs::read_to_string(table()).unwrap_or_default();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines.filter_map(|line| line.split_once(" = ")).map(|(key, row)| (key.into(), row.into())).collect()
}

#[test]
fn pictures_are_the_same_to_the_bit() {
    let mut rows = read_rows();
    let is_written = std::env::var_os("GOLDEN").is_some_and(|value| value == "write");
    let mut changed = Vec::new();
    for_each_scene(|name, scene| {
        for method in Method::ALL {
            for seed in SEEDS {
                for level in Level::detect().and_below() {
                    let key = format!("{name} {} {seed} {}", method.name(), level.name());
                    let row = row(scene, method, seed, level);
                    let before = rows.get(&key).cloned().unwrap_or_else(|| "no row".into());
                    if before != row {
                        changed.push(format!("{key}: {before} -> {row}"));
                        rows.insert(key, row);
                    }
                }
            }
        }
    });
    if is_written {
        let mut text = "# scene method seed level = hash of the picture, mean, estimated relMSE\n".to_owned();
        rows.iter().for_each(|(key, row)| text += &format!("{key} = {row}\n"));
        fs::write(table(), text).expect("the table can be written");
    } else {
        assert!(changed.is_empty(), "{} rows differ:\n{}", changed.len(), changed.join("\n"));
    }
}
