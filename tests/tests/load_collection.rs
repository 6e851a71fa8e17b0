//! Every file of the collection of published scenes loads or is refused with a clear message. Skipped without
//! the collection, which is not part of the project.

use halflight::load::{LoadError, LoadOptions, LoadedScene, load};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// `HALFLIGHT_SCENES`, or `shared/scenes` beside the repository.
fn collection() -> Option<PathBuf> {
    let named = std::env::var_os("HALFLIGHT_SCENES").map(PathBuf::from);
    let beside = [".", ".."]
        .map(|up| Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(up).join("shared/scenes"));
    let found = named.into_iter().chain(beside).find(|directory| directory.is_dir());
    if found.is_none() {
        println!("skipped: no scenes in HALFLIGHT_SCENES or ../shared/scenes");
    }
    found
}

fn obj_files(directory: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> = entries
        .flat_map(
            |path| if path.is_dir() && !path.ends_with("source") { obj_files(&path) } else { vec![path] },
        )
        .filter(|path| path.extension().is_some_and(|extension| extension == "obj"))
        .collect();
    files.sort();
    files
}

fn report(path: &Path) -> Result<LoadedScene, LoadError> {
    let start = Instant::now();
    let result = load(path, &LoadOptions::default());
    let seconds = start.elapsed().as_secs_f64();
    let name = path.file_name().unwrap_or_default().display();
    match &result {
        Ok(scene) => {
            let (triangles, vertices) = (scene.triangles.len(), scene.positions.len());
            let textures = scene.textures.bytes() as f64 / 1e6;
            println!(
                "{name}: {triangles} triangles, {vertices} vertices, {textures:.1} MB of textures, {seconds:.3} s"
            );
            scene.repairs.iter().for_each(|repair| println!("    {repair}"));
            assert_sound(&name.to_string(), scene);
        }
        Err(error) => println!("{error}"),
    }
    result
}

/// A scene whose detail lies within 1, and its largest coordinate, which is far beyond.
const FAR: (&str, f32) = ("teapot-in-stadium.obj", (1u32 << 31) as f32);

/// Asserts the invariants on which the core relies.
fn assert_sound(name: &str, scene: &LoadedScene) {
    let farthest = if name == FAR.0 { FAR.1 } else { 1.0 };
    assert_eq!(scene.mesh().validate(scene.materials.len()), Ok(()));
    assert!(scene.positions.iter().flatten().all(|x| x.is_finite() && x.abs() <= farthest));
    assert!(scene.texcoords.iter().flatten().all(|x| x.is_finite()));
    let is_unit_or_zero = |n: &[f32; 3]| {
        let squared = n.iter().map(|x| x * x).sum::<f32>();
        squared == 0.0 || (squared - 1.0).abs() < 1e-5
    };
    assert!(scene.normals.iter().all(is_unit_or_zero));
    assert_eq!(scene.materials.len(), scene.material_names.len());
    scene.views();
}

/// Files of the torture folder that must be refused, and a part of the message.
const REFUSED: &[(&str, &str)] = &[
    ("invalid_empty.obj", "neither vertices nor faces"),
    ("invalid_index.obj", "invalid_index.obj:"),
    ("invalid_malformed.obj", "invalid_malformed.obj:"),
    ("lines.obj", "no faces"),
    ("number_formats.obj", "is not a number"),
    ("point_cloud.obj", "no faces"),
    ("testline.obj", "no faces"),
    ("testpoints.obj", "no faces"),
];

#[test]
fn torture_files_load_or_are_refused_clearly() {
    let Some(collection) = collection() else { return };
    for path in obj_files(&collection.join("loader-torture")) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let refused = REFUSED.iter().find(|(refused, _)| *refused == name);
        match (report(&path), refused) {
            (Ok(_), None) => {}
            (Err(error), Some((_, says))) => assert!(error.to_string().contains(says), "{error}"),
            (Ok(_), Some(_)) => panic!("{name} should be refused"),
            (Err(error), None) => panic!("{error}"),
        }
    }
}

#[test]
fn published_scenes_load() {
    let Some(collection) = collection() else { return };
    for path in obj_files(&collection) {
        if !path.components().any(|part| part.as_os_str() == "loader-torture") {
            report(&path).unwrap();
        }
    }
}
