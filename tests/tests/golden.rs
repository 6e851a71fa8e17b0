//! Golden table: hashes of pictures of every method, scene and seed. Pictures have the same bits by every
//! instruction set, so the rows take turns at those of this machine; `table::` compares them all.
//!
//! The renderer is deterministic, so a change of structure keeps every row. Rows change in commits that fix
//! an error or delete a mechanism, and these commits say so:
//!
//!     SNAPSHOT=write cargo test --profile quick -p halflight-tests --test main golden::
//!
//! rewrites `golden.txt`.

use glam::Vec3;
use halflight::load::{self, LoadOptions};
use halflight::render::{Method, RenderResult, Settings};
use halflight_core::scene::Scene;
use halflight_simd::Level;
use halflight_tests::render::render;
use halflight_tests::scenes::{
    SceneBuffers, constant_environment, cornell_box, everything, glass, in_a_room, lamp_before,
};
use halflight_tests::snapshot;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::thread;

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

/// A row: the hash of a picture, its mean, and its estimated error.
fn row(scene: &Scene, method: Method, seed: u32, level: Level) -> String {
    let result = render(scene, method, SIZE, SPP, |settings: &mut Settings| {
        settings.seed = seed;
        settings.level = level;
        settings.threads = Some(1);
    });
    let sum: f64 = result.image.pixels.iter().flatten().map(|value| f64::from(*value)).sum();
    let mean = sum / (3.0 * f64::from(SIZE * SIZE));
    let error = result.error.map_or("none".to_owned(), |error| format!("{:.6e}", error.relmse));
    format!("{:016x} {mean:.6e} {error}", hash(&result))
}

/// Rows of a scene by name of the render. The pictures are too small for threads, so each processor renders
/// pictures of its own.
fn rows(
    name: &str,
    scene: &Scene,
    levels: &mut (impl Iterator<Item = Level> + Send),
) -> BTreeMap<String, String> {
    let renders = Method::ALL.into_iter().flat_map(|method| SEEDS.map(|seed| (method, seed))).zip(levels);
    let (renders, rows) = (Mutex::new(renders), Mutex::new(BTreeMap::new()));
    let next = || renders.lock().expect("no panic holds it").next();
    let work = || {
        while let Some(((method, seed), level)) = next() {
            let key = format!("{name} {} {seed}", method.name());
            let row = row(scene, method, seed, level);
            rows.lock().expect("no panic holds it").insert(key, row);
        }
    };
    let processors = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| (0..processors).for_each(|_| drop(scope.spawn(work))));
    rows.into_inner().expect("no panic holds it")
}

#[test]
fn pictures_are_the_same_to_the_bit() {
    let mut all_rows = BTreeMap::new();
    let all: Vec<Level> = Level::detect().and_below().collect();
    let mut levels = all.into_iter().cycle();
    for_each_scene(|name, scene| all_rows.append(&mut rows(name, scene, &mut levels)));
    let mut text = "# scene method seed = hash of the picture, mean, estimated relMSE\n".to_owned();
    all_rows.iter().for_each(|(key, row)| text += &format!("{key} = {row}\n"));
    snapshot::check("golden.txt", &text);
}
