//! Grids of light probes by the program: harmonics against irradiances, probes inside bodies, files.

use crate::lightmaps::{folder, furnace};
use crate::support::Folder;
use core::f64::consts::PI;
use halflight::bake::Probe;
use halflight_core::Rgb;
use halflight_core::glam::Vec3;
use serde_json::Value;

fn json(folder: &Folder, name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.path(name)).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f32> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap() as f32).collect()
}

/// The probe at an index of a file.
fn probe(object: &Value, index: usize) -> Probe {
    let coefficients = object["coefficients"][index].as_array().unwrap();
    let coefficients = core::array::from_fn(|i| Rgb::from_slice(&numbers(&coefficients[i])));
    let half_widths = numbers(&object["half_width"][index]).try_into().unwrap();
    Probe { coefficients, half_widths, ..Probe::default() }
}

#[test]
fn harmonics_give_the_irradiance_of_other_normals() {
    // The lamp is the whole ceiling of an open room with a floor: half of the sphere is dark.
    let folder = Folder::new("probes-normals");
    folder
        .object("bake scene.obj --probes 2x1x3 --box -0.5,0,-0.75,0.5,0.8,0.75 --spp 1024 -o p.json --json");
    let object = json(&folder, "p.json");
    assert_eq!((&object["size"], &object["box"]["max"][2]), (&serde_json::json!([2, 1, 3]), &0.75.into()));
    let normals: Vec<Vec3> = (0..40)
        .map(|i| {
            let (z, turns) = (1.0 - (2.0 * i as f32 + 1.0) / 40.0, i as f32 * 0.618_034);
            let radius = (1.0 - z * z).sqrt();
            Vec3::new(radius * (2.0 * PI as f32 * turns).cos(), z, radius * (2.0 * PI as f32 * turns).sin())
        })
        .collect();
    // The fifth probe: second of x, third of z.
    let line = |n: &Vec3| format!("0.25 0.4 0.5 {} {} {}\n", n.x, n.y, n.z);
    std::fs::write(folder.path("grid.pts"), normals.iter().map(line).collect::<String>()).unwrap();
    folder.object("bake scene.obj --points grid.pts --spp 1024 -o truth.res --json");
    let truth = std::fs::read_to_string(folder.path("truth.res")).unwrap();
    let probe = probe(&object, 5);
    let (mut most, mut squares) = (0f32, 0f32);
    for (normal, line) in normals.iter().zip(truth.lines()) {
        let truth: f32 = line.split_whitespace().next().unwrap().parse().unwrap();
        most = most.max(truth);
        squares += (probe.irradiance(*normal).x - truth).powi(2);
    }
    // Harmonics of degree 2 leave out a few percent of irradiance (Ramamoorthi and Hanrahan 2001).
    let error = (squares / normals.len() as f32).sqrt() / most;
    assert!(error < 0.02, "{error}");
}

#[test]
fn probes_of_a_furnace_have_its_radiance() {
    let folder = furnace("probes-furnace");
    let object = folder.object("bake scene.obj --probes 3x2x2 --spp 256 -o p.json -o p.csv -o p.ktx2 --json");
    assert_eq!(object["probes"], serde_json::json!({ "count": 12, "inside": 0, "open": 0 }));
    assert_eq!(object["points"], 12 * 30);
    let file = json(&folder, "p.json");
    for index in 0..12 {
        let probe = probe(&file, index);
        assert!((probe.coefficients[0].x / (2.0 * (4.0 * PI as f32).sqrt()) - 1.0).abs() < 0.02);
        for i in 1..9 {
            let (value, half_width) = (probe.coefficients[i].x, probe.half_widths[i]);
            assert!(value.abs() < 2.5 * half_width && half_width < 0.3, "{i}: {value} {half_width}");
        }
    }
    let table = std::fs::read_to_string(folder.path("p.csv")).unwrap();
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert!(lines.len() == 13 && lines.iter().all(|line| line.len() == 5 + 36));
    let at = |line: usize, column: usize| lines[line][column].parse::<f64>().unwrap();
    assert!((at(1, 0) + 2.0 / 3.0).abs() < 1e-6 && (at(12, 1) - 0.5).abs() < 1e-6);
    // A volume of half floats after 200 bytes: 3 × 4 × 6 texels of radiance 2.
    let volume = std::fs::read(folder.path("p.ktx2")).unwrap();
    assert_eq!(volume.len(), 200 + 3 * 4 * 6 * 8);
    for texel in volume[200..].chunks(8) {
        // 2 is 0x4000 as a half float, and neighbours differ by 2^-9 above and 2^-10 below.
        let red = i32::from(u16::from_le_bytes([texel[0], texel[1]]));
        assert!((red - 0x4000).abs() < 100 && texel[6..] == [0x00, 0x3c], "{texel:?}");
    }
}

#[test]
fn probes_inside_bodies_are_flagged_and_filled() {
    // A lamp far above a solid ground, whose surface is at height 0 and which has no bottom.
    let mesh = "v -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9\nusemtl grey\nf 1 2 3 4\n\
                v -9 5 -9\nv 9 5 -9\nv 9 5 9\nv -9 5 9\nusemtl lamp\nf 5 6 7 8\n";
    let materials = "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n";
    let folder = folder("probes-inside", mesh, materials);
    let arguments = "bake scene.obj --probes 1x4x1 --box -1,-2,-1,1,2,1 --spp 64 -o p.json --json";
    assert_eq!(folder.object(arguments)["probes"]["inside"], 2);
    let object = json(&folder, "p.json");
    assert_eq!(object["valid"], serde_json::json!([false, false, true, true]));
    let first = |index: usize| probe(&object, index).coefficients[0].x;
    assert!(first(2) > 1.0 && first(0) == first(2) && first(1) == first(2));
}

#[test]
fn bad_grids_are_refused_before_the_work() {
    let folder = Folder::new("probes-refused");
    for (arguments, message) in [
        ("--probes 2x2 -o a.json", "three numbers of probes"),
        ("--probes 0x2x2 -o a.json", "three numbers of probes"),
        ("--probes 2x2x2 --box 0,0,0,1,1,0 -o a.json", "a lower and a higher corner"),
        ("--probes 2x2x2 -o a.ply", "probes are .json, .csv or .ktx2"),
        ("--probes 2x2x2", "--probes has no output"),
        ("--probes 2x2x2 --unit white -o a.json", "--unit"),
        ("--probes 2000x2000x2000 -o a.json --memory 1G", "too many probes"),
        ("--vertices --box 0,0,0,1,1,1", "--box"),
    ] {
        let said = folder.refused(&format!("bake scene.obj {arguments}"));
        assert!(said.contains(message), "{arguments}: {said}");
    }
}

#[test]
fn probes_in_parts_have_the_bits_of_one() {
    let folder = furnace("probes-parts");
    let bake = "bake scene.obj --probes 3x4x3 --spp 24 --json";
    folder.object(&format!("{bake} -o whole.json -o whole.csv -o whole.ktx2 --threads 1"));
    for shard in 1..=3 {
        let part = folder.object(&format!("{bake} --shard {shard}/3 --checkpoint {shard}.bake"));
        // Probes of other shards are not inside bodies.
        let probes = &part["probes"];
        assert!(part["half_width"].as_f64().is_some_and(|half_width| half_width < 1.0), "{part}");
        assert!(probes["inside"] == 0 && probes["open"].as_u64().is_some_and(|open| open > 0), "{probes}");
    }
    let merged = folder.object("merge 3.bake 1.bake 2.bake -o m.json -o m.csv -o m.ktx2 --json");
    assert_eq!(merged["probes"], serde_json::json!({ "count": 36, "inside": 0, "open": 0 }));
    // A bake that ended early goes on.
    for spp in [5, 24] {
        folder.object(&format!(
            "bake scene.obj --probes 3x4x3 --spp {spp} --continue a.bake -o a.json -o a.csv -o a.ktx2 --json"
        ));
    }
    for (name, ending) in
        ["m", "a"].into_iter().flat_map(|name| [(name, "json"), (name, "csv"), (name, "ktx2")])
    {
        let [whole, parts] =
            ["whole", name].map(|name| std::fs::read(folder.path(&format!("{name}.{ending}"))).unwrap());
        assert!(whole == parts, "{name}.{ending}");
    }
    // Without ambient cubes.
    folder.object(&format!("{bake} --checkpoint b.bake -o b.json"));
    for (arguments, reason) in [
        ("merge b.bake -o no.ktx2", "no ambient cubes"),
        ("merge b.bake -o no.exr", "no.exr: probes are .json, .csv or .ktx2"),
        ("merge b.bake -o no.json --error-map e.exr", "lightmaps alone"),
    ] {
        let said = folder.refused(arguments);
        assert!(said.contains(reason), "{arguments}: {said}");
    }
}
