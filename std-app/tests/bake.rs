//! Irradiance at points by the program and by the library.

use crate::lightmaps::{folder, furnace};
use crate::support::Folder;
use core::sync::atomic::AtomicBool;
use core::sync::atomic::Ordering::Relaxed;
use halflight::Renderer;
use halflight::bake::{BakeProgress, BakeSettings, Sensor, irradiance};
use halflight::load::{LoadOptions, load};
use halflight::render::{Checkpoint, Stop};
use halflight_core::PointMethod;
use std::io::Write;
use std::process::Stdio;

/// Irradiance below the middle of the lamp: π times the form factor of a square of side 2 at distance 2.
const BELOW_THE_LAMP: f64 = 0.752_25;

/// Rows of a table, without its head.
fn rows(table: &[u8]) -> Vec<Vec<f64>> {
    let text = String::from_utf8(table.to_vec()).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}

#[test]
fn sensors_of_standard_input_give_a_table_on_standard_output() {
    let folder = Folder::new("bake-stdin");
    let mut command = folder.command("bake scene.obj --points - --spp 256");
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // On the floor, a rounding below it, and a desk that looks down.
    let sensors = b"# grid\n0 0 0 0 1 0\n0 -1e-8 0 0 2 0\n0.1 0.5 0.1 0 -1 0\n";
    child.stdin.take().unwrap().write_all(sensors).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let rows = rows(&output.stdout);
    assert_eq!(rows.len(), 3);
    for row in &rows[..2] {
        let [value, lower, upper] = [row[9], row[10], row[11]];
        assert!((value / BELOW_THE_LAMP - 1.0).abs() < 0.02 && lower <= value && value <= upper, "{row:?}");
    }
    assert!(rows[2][9] < 0.5 * BELOW_THE_LAMP && rows[2][9] > 0.0, "{:?}", rows[2]);
}

#[test]
fn tables_have_the_bits_of_any_number_of_threads() {
    let folder = Folder::new("bake-threads");
    write_grid(&folder);
    let table = |threads: usize| {
        let name = format!("{threads}.csv");
        let object = folder.object(&format!(
            "bake scene.obj --points grid.pts --error 0.1 --threads {threads} -o {name} --json"
        ));
        assert_eq!((&object["points"], &object["tiles"]), (&600.into(), &object["within_error"]));
        std::fs::read(folder.path(&name)).unwrap()
    };
    assert_eq!(table(1), table(3));
}

/// Sensors on the floor, three tiles of them.
fn write_grid(folder: &Folder) {
    let grid: String = (0..600)
        .map(|i| format!("{} 0.0 {} 0 1 0\n", (i % 25) as f64 / 12.5 - 1.0, i as f64 / 300.0 - 1.0))
        .collect();
    std::fs::write(folder.path("grid.pts"), grid).unwrap();
}

#[test]
fn shards_of_a_bake_merge_to_the_bits_of_one() {
    let folder = Folder::new("bake-shards");
    write_grid(&folder);
    let bake = "bake scene.obj --points grid.pts --unit lux --spp 24 --json";
    folder.object(&format!("{bake} -o whole.csv -o whole.ply --threads 1"));
    for shard in 1..=3 {
        folder.object(&format!("{bake} --shard {shard}/3 --checkpoint {shard}.bake --threads {shard}"));
    }
    let merged = folder.object("merge 3.bake 1.bake 2.bake -o merged.csv -o merged.ply --json");
    assert_eq!((&merged["points"], &merged["spp"]), (&600.into(), &24.into()));
    for ending in ["csv", "ply"] {
        let [whole, merged] =
            ["whole", "merged"].map(|name| std::fs::read(folder.path(&format!("{name}.{ending}"))).unwrap());
        assert!(whole == merged, "{ending}");
    }
    folder.object(&format!("{bake} --seed 9 --shard 2/3 --checkpoint seed.bake"));
    folder.object("bake scene.obj --points grid.pts --spp 8 --shard 2/3 --checkpoint few.bake --json");
    folder.object("render scene.obj --size 16x16 --spp 1 --checkpoint picture.film -o p.pfm --json");
    for (arguments, reason) in [
        ("merge 1.bake 2.bake -o no.csv", "shard 3/3 is missing"),
        ("merge 1.bake seed.bake 3.bake -o no.csv", "it is a bake of seed 9, not 0"),
        ("merge 1.bake few.bake 3.bake -o no.csv", "a bake of 8 samples, not of 24"),
        ("merge 1.bake picture.film -o no.csv", "picture.film: is no bake file"),
        ("merge 1.bake 2.bake 3.bake -o no.csv --aov albedo", "--aov is for pictures"),
        ("merge 1.bake 2.bake 3.bake -o no.csv --for-error 0.1", "--for-error is for pictures"),
        ("merge 1.bake 2.bake 3.bake -o no.png", "a table is .csv, .res or .ply"),
        ("bake scene.obj --points grid.pts --shard 1/3 --spp 4", "--checkpoint"),
        ("bake scene.obj --points grid.pts --shard 1/3 --error 0.1 --checkpoint a.bake", "--error"),
        (
            "bake scene.obj --points grid.pts --spp 4 --shard 4/4 --checkpoint a.bake",
            "the shard does not exist",
        ),
    ] {
        let said = folder.refused(arguments);
        assert!(said.contains(reason), "{arguments}: {said}");
    }
    assert!(!folder.path("no.csv").exists());
}

#[test]
fn a_bake_goes_on_from_its_file_with_the_same_bits() {
    let folder = Folder::new("bake-resumed");
    write_grid(&folder);
    let bake = "bake scene.obj --points grid.pts --error 0.008";
    folder.object(&format!("{bake} -o whole.csv --json"));
    let table = |name: &str| std::fs::read(folder.path(name)).unwrap();
    // Ended between decisions, at a decision, and before the first one.
    for spp in [5, 64, 100] {
        let first = folder.object(&format!("{bake} --spp {spp} --checkpoint a.bake -o a.csv --json"));
        assert_eq!(first["samples"]["most"], spp);
        let name = format!("{spp}.csv");
        folder.object(&format!("{bake} --resume a.bake --checkpoint a.bake -o {name} --json"));
        assert!(table(&name) == table("whole.csv"), "{spp}");
    }
    // Fewer samples than the file has: its values.
    folder.object("bake scene.obj --points grid.pts --resume a.bake --spp 5 -o again.csv --json");
    assert!(table("again.csv") == table("whole.csv"));
    let said = folder.refused(&format!("{bake} --light direct --resume a.bake"));
    assert!(said.contains("a.bake: is a bake of light all, not direct"), "{said}");
    let mut bytes = table("a.bake");
    bytes[2000] ^= 1;
    std::fs::write(folder.path("bad.bake"), bytes).unwrap();
    let said = folder.refused(&format!("{bake} --resume bad.bake"));
    assert!(said.contains("bad.bake: is damaged"), "{said}");
}

#[test]
fn a_killed_bake_leaves_a_file_that_goes_on() {
    let folder = Folder::new("bake-killed");
    write_grid(&folder);
    let bake = "bake scene.obj --points grid.pts --spp 3000";
    folder.object(&format!("{bake} -o whole.csv --json"));
    let kept = format!("{bake} -o parts.csv --checkpoint a.bake --checkpoint-every 1ms");
    let spawn = |arguments: &str| {
        folder.command(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    // Killed as soon as there is a file, and a new one.
    let mut child = spawn(&kept);
    for kills in 0.. {
        let before = std::fs::read(folder.path("a.bake")).ok();
        while child.try_wait().unwrap().is_none() && std::fs::read(folder.path("a.bake")).ok() == before {
            std::thread::yield_now();
        }
        if kills == 8 || child.try_wait().unwrap().is_some() {
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        child = spawn(&format!("{kept} --resume a.bake"));
    }
    assert!(child.wait().unwrap().success());
    let [whole, parts] = ["whole", "parts"].map(|name| std::fs::read(folder.path(&format!("{name}.csv"))));
    assert!(whole.unwrap() == parts.unwrap());
}

#[test]
fn vertices_and_formats_follow_from_flags() {
    let folder = Folder::new("bake-formats");
    let object = folder.object("bake scene.obj --vertices --spp 16 --unit lux -o a.res -o b.ply --json");
    assert_eq!(object["points"], 8);
    assert_eq!(std::fs::read_to_string(folder.path("a.res")).unwrap().lines().count(), 8);
    assert!(std::fs::read(folder.path("b.ply")).unwrap().starts_with(b"ply\nformat binary_little_endian"));
    let direct = folder.object("bake scene.obj --vertices --spp 16 --light direct -o a.csv --json");
    let indirect = folder.object("bake scene.obj --vertices --spp 16 --light indirect -o b.csv --json");
    assert!(direct["mean"][0].as_f64().unwrap() > 0.0);
    // The lamp reflects nothing, and the floor is lit by it alone; the lamp sees the floor.
    let at = |file: &str, row: usize| rows(&std::fs::read(folder.path(file)).unwrap())[row][9];
    assert_eq!(at("b.csv", 0), 0.0);
    assert!(at("b.csv", 4) > 0.0 && at("a.csv", 4) == 0.0);
    drop(indirect);
}

#[test]
fn bad_sensors_and_outputs_are_refused_before_the_work() {
    let folder = Folder::new("bake-refused");
    std::fs::write(folder.path("bad.pts"), "0 0 0 0 1 0\n0 0 0 0 1\n").unwrap();
    std::fs::write(folder.path("grid.csv"), "0 0 0 0 1 0\n").unwrap();
    for (arguments, message) in [
        ("bake scene.obj --points bad.pts", "bad.pts: line 2: 5 numbers where six are expected"),
        ("bake scene.obj --points none.pts", "none.pts"),
        ("bake scene.obj", "<--points <FILE>|--vertices|--lightmap <NAME>|--probes <NXxNYxNZ>>"),
        ("bake scene.obj --vertices -o table.txt", "a table is .csv, .res or .ply"),
        ("bake scene.obj --points grid.csv -o grid.csv", "would overwrite the input"),
        ("bake scene.obj --vertices --error 0", "--error"),
        ("bake scene.obj --vertices --memory 1K", "memory"),
    ] {
        let said = folder.refused(arguments);
        assert!(said.contains(message), "{arguments}: {said}");
    }
}

#[test]
fn the_owner_of_a_scene_bakes_what_a_build_of_its_own_does() {
    let folder = Folder::new("bake-library");
    let loaded = load(&folder.path("scene.obj"), &LoadOptions::default()).unwrap();
    let sensor = Sensor { position: [0.2, 0.0, 0.1], normal: [0.0, 1.0, 0.0] };
    let points = [sensor.point(&loaded)];
    let stop = Stop { spp: Some(16), ..Stop::default() };
    let settings = BakeSettings { stop, ..BakeSettings::default() };
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    let alone = irradiance(&scene, &points, &settings, &mut |_| {}, &AtomicBool::new(false)).unwrap();
    let owned = Renderer::new(loaded.clone(), None).unwrap().irradiance(&points, &settings).unwrap();
    assert_eq!(alone.values, owned.values);
    // A single point has 64 replicates.
    assert_eq!(alone.values[0].samples, 16 * 64);
}

/// A closed room of side 2 with a lamp below its ceiling, and 1,000 sensors on its floor.
fn room(name: &str) -> Folder {
    let folder = Folder::new(name);
    let walls = "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 2 -1\nv -1 2 1\nv 1 2 1\nv 1 2 -1\n\
                 v -0.3 1.9 -0.3\nv 0.3 1.9 -0.3\nv 0.3 1.9 0.3\nv -0.3 1.9 0.3\n\
                 usemtl wall\nf 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n\
                 usemtl lamp\nf 9 10 11 12\n";
    std::fs::write(folder.path("room.obj"), format!("mtllib room.mtl\n{walls}")).unwrap();
    let materials = "newmtl wall\nKd 0.7 0.7 0.7\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n";
    std::fs::write(folder.path("room.mtl"), materials).unwrap();
    let at = |i: u32, count: u32| 1.9 * (f64::from(i) + 0.5) / f64::from(count) - 0.95;
    let grid: String =
        (0..1000).map(|i| format!("{} 0 {} 0 1 0\n", at(i % 40, 40), at(i / 40, 25))).collect();
    std::fs::write(folder.path("grid.pts"), grid).unwrap();
    folder
}

#[test]
fn a_cache_has_the_light_of_paths_within_its_intervals() {
    let folder = room("bake-cache");
    let bake = "bake room.obj --points grid.pts --json";
    folder.object(&format!("{bake} --spp 1024 -o paths.csv"));
    let cached = |threads: u32| {
        let name = format!("cache-{threads}.csv");
        let command = format!("{bake} --method irradiance-cache --spp 64 --threads {threads} -o {name}");
        let findings = folder.object(&command)["findings"].clone();
        assert_eq!(findings["irradiance_cache"]["decision"], "used", "{findings}");
        assert!(findings["audit"]["bias"].as_f64().unwrap() < 0.05, "{findings}");
        std::fs::read(folder.path(&name)).unwrap()
    };
    let table = cached(1);
    assert_eq!(table, cached(3));
    let (paths, cache) = (rows(&std::fs::read(folder.path("paths.csv")).unwrap()), rows(&table));
    let mean = |rows: &[Vec<f64>]| rows.iter().map(|row| row[9]).sum::<f64>() / rows.len() as f64;
    assert!((mean(&cache) / mean(&paths) - 1.0).abs() < 0.01, "{} {}", mean(&cache), mean(&paths));
    // Noise of the paths is in neither interval; joint ones are wider.
    let holds = |(cache, paths): &(&Vec<f64>, &Vec<f64>)| {
        let joint = (cache[11] - cache[9]).hypot(paths[11] - paths[9]);
        (cache[9] - paths[9]).abs() <= joint
    };
    let held = cache.iter().zip(&paths).filter(holds).count();
    assert!(held > 900, "{held}");
    let width = |rows: &[Vec<f64>]| rows.iter().map(|row| row[11] - row[9]).sum::<f64>();
    folder.object(&format!("{bake} --spp 64 -o few.csv"));
    let few = rows(&std::fs::read(folder.path("few.csv")).unwrap());
    assert!(width(&cache) < 0.7 * width(&few), "{} {}", width(&cache), width(&few));
}

#[test]
fn a_cache_is_chosen_where_it_is_predicted_to_have_less_error() {
    let folder = room("bake-cache-auto");
    // So few rays cannot fill a cache.
    let bake = "bake room.obj --points grid.pts --method auto --json";
    let object = folder.object(&format!("{bake} --spp 2 -o few.csv"));
    assert_eq!(object["findings"]["irradiance_cache"]["decision"], "left out", "{object}");
    let few = std::fs::read(folder.path("few.csv")).unwrap();
    folder.object("bake room.obj --points grid.pts --spp 2 -o paths.csv --json");
    assert_eq!(few, std::fs::read(folder.path("paths.csv")).unwrap());
    let object = folder.object(&format!("{bake} --error 0.02 -o many.csv"));
    assert_eq!(object["findings"]["irradiance_cache"]["decision"], "used", "{object}");
    assert_eq!(object["tiles"], object["within_error"], "{object}");
    let said = folder.refused(&format!("{bake} --spp 4 --shard 1/2 --checkpoint a.bake"));
    assert!(said.contains("a shard has no irradiance cache"), "{said}");
}

#[test]
fn vertices_at_the_free_end_of_a_wall_have_one_value_in_all_directions() {
    // A floor, a wall along half of its side, and a lamp behind the wall. The vertex at the end of the wall
    // is on the fan of the floor.
    let places = [
        [1.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 0.0, 2.0],
        [0.0, 0.0, 2.0],
        [0.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [1.0, 2.0, 0.0],
        [-5.0, 0.0, -3.0],
        [7.0, 0.0, -3.0],
        [7.0, 5.0, -3.0],
        [-5.0, 5.0, -3.0],
    ];
    let faces = "usemtl black\nf 1 3 2\nf 1 4 3\nf 5 4 1\nf 5 1 7 6\nusemtl lamp\nf 8 9 10 11\n";
    let materials = "newmtl black\nKd 0 0 0\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n";
    let values = (0..6).map(|number| {
        let (sin, cos) = (0.3 + 0.7 * f64::from(number)).sin_cos();
        let turned = |[x, y, z]: [f64; 3]| [x * cos - z * sin + 3.7, y + 0.9, x * sin + z * cos - 1.3];
        let vertices = places.map(turned).map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
        let folder = folder(&format!("bake-free-end-{number}"), &format!("{vertices}{faces}"), materials);
        folder.object("bake scene.obj --vertices --spp 64 -o vertices.csv --json");
        let rows = rows(&std::fs::read(folder.path("vertices.csv")).unwrap());
        let [x, y, z] = turned(places[0]);
        let is_at_end = |row: &Vec<f64>| {
            let near = [row[0] - x, row[1] - y, row[2] - z].iter().all(|part| part.abs() < 1e-4);
            near && row[4] > 0.5
        };
        rows.iter().find(|row| is_at_end(row)).unwrap()[9]
    });
    let values: Vec<f64> = values.collect();
    let mean = values.iter().sum::<f64>() / 6.0;
    // One of them was a quarter of the others.
    assert!(mean > 0.1 && values.iter().all(|value| (value / mean - 1.0).abs() < 0.05), "{values:?}");
}

#[test]
fn an_interrupted_bake_with_a_cache_goes_on_to_the_bits_of_one() {
    let folder = furnace("bake-cache-parts");
    let loaded = load(&folder.path("scene.obj"), &LoadOptions::default()).unwrap();
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    let place = |i: u32| [0, 1].map(|axis| 1.8 * ((f64::from(i) * [0.7548, 0.5698][axis]).fract() - 0.5));
    let sensors =
        (0..600).map(place).map(|[x, z]| Sensor { position: [x, -1.0, z], normal: [0.0, 1.0, 0.0] });
    let points: Vec<_> = sensors.map(|sensor| sensor.point(&loaded)).collect();
    let settings = BakeSettings {
        stop: Stop { spp: Some(96), ..Stop::default() },
        method: PointMethod::IrradianceCache,
        threads: Some(2),
        ..BakeSettings::default()
    };
    let bake = |settings: &BakeSettings, most: u32| {
        let interrupt = AtomicBool::new(false);
        let mut progress = |progress: &BakeProgress| interrupt.store(progress.samples >= most, Relaxed);
        irradiance(&scene, &points, settings, &mut progress, &interrupt).unwrap()
    };
    let whole = bake(&settings, u32::MAX);
    let file = folder.path("a.bake");
    let checkpoint = Some(Checkpoint { path: file.clone(), every: 1e9 });
    let first = bake(&BakeSettings { checkpoint, ..settings.clone() }, 8);
    assert!(first.is_interrupted && first.values[0].samples < 96);
    let second = bake(&BakeSettings { resume: Some(file), threads: Some(1), ..settings }, u32::MAX);
    assert_eq!(second.values, whole.values);
    let cache = whole.findings.get("irradiance_cache").and_then(|finding| finding.number("records"));
    assert!(
        cache.is_some_and(|records| records > 0.0) && whole.values.iter().all(|value| value.samples == 96)
    );
}
