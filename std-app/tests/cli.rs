//! The command line as a contract, tested by running the program.

use crate::support::Folder;
use halflight::render::Method;
use halflight::save::{Image, read, write};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn files(folder: &Path) -> usize {
    std::fs::read_dir(folder).unwrap().count()
}

#[test]
fn help_and_version_are_no_errors() {
    let folder = Folder::new("help");
    for arguments in ["--help", "render --help", "compare --help", "race --help", "info --help", "--version"]
    {
        let output = folder.run(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}");
        assert!(!output.stdout.is_empty(), "{arguments}");
    }
    let help = String::from_utf8(folder.run("render --help").stdout).unwrap();
    for flag in ["--eye", "--look-at", "--up", "--fov", "--size", "--method", "--caustics", "--spp", "--time"]
    {
        assert!(help.contains(flag), "{flag}");
    }
    let first = help.split("Options:").nth(1).and_then(|rest| rest.split("Light transport:").next()).unwrap();
    let flags: Vec<&str> = first.split_whitespace().filter(|word| word.starts_with("--")).collect();
    for flag in ["output", "method", "size", "spp", "time", "error", "seed", "threads", "memory", "report"] {
        assert!(flags.contains(&&*format!("--{flag}")), "{flag} is not among the first: {first}");
    }
}

#[test]
fn wrong_usage_is_refused_before_anything_is_written() {
    let folder = Folder::new("usage");
    for (arguments, reason) in [
        ("", "Usage"),
        ("paint scene.obj", "unrecognized subcommand"),
        ("render scene.obj --method photons", "possible values: auto, path, irradiance-cache"),
        ("render scene.obj --size 640", "640x480"),
        ("render scene.obj --size 0x5", "640x480"),
        ("render scene.obj --eye 1,2", "three numbers"),
        ("render scene.obj --time soon", "30s, 2m or 1h"),
        ("render scene.obj --spp 0", "from 1 to 2^30"),
        ("render scene.obj --max-depth 0", "at least 1 segment"),
        ("render scene.obj --error nan", "1e-15 to 1e30"),
        ("render scene.obj --fov 178", "less than 178 degrees"),
        ("render scene.obj --lens 1e9,1", "more than 1000 times"),
        ("render scene.obj --simd mmx", "baseline, avx2, avx512"),
        ("render scene.obj --sparkle", "unexpected argument"),
        ("render scene.obj --error -1", "1e-15 to 1e30"),
        ("render scene.obj --seed -1", "-1"),
        ("bake scene.obj --vertices --spp -4", "`-4` is not a whole number of at least 0"),
        ("render scene.obj --eye 1,1,1 --look-at 1,1,1", "--eye and --look-at are the same point"),
        ("render scene.obj --eye 0,9,0 --look-at 0,0,0", "--up 0,0,1"),
        ("render scene.obj --memory 1K --size 64x64", "raise --memory"),
        ("render missing.obj", "missing.obj"),
        ("render scene.mtl", "scene.mtl"),
        ("render scene.obj -o picture.gif", "picture.gif"),
        ("render scene.obj -o no/such/folder.png", "no folder"),
        ("render scene.obj --reference missing.exr", "missing.exr"),
        ("compare missing.exr missing.exr", "missing.exr"),
        ("compare scene.obj scene.obj", "exr, pfm"),
        ("compare missing.exr missing.exr --difference signed", "--output"),
        ("compare missing.exr missing.exr -o d.hdr --difference relative", "no values below zero"),
        ("compare missing.exr missing.exr -o d.png --difference loud", "signed, absolute, relative, flip"),
        ("render scene.obj --report no/such/report", "no/such/report"),
        ("render scene.obj --report scene.obj", "it is a file, not a folder"),
        ("race scene.obj --time 1s", "--methods"),
        ("race scene.obj --methods path", "--time"),
        ("race scene.obj --methods path --time never", "30s, 2m or 1h"),
        ("race scene.obj --methods path,photons --time 1s", "the methods are auto, path, irradiance-cache"),
        ("race scene.obj --methods path:sparkle=1 --time 1s", "there is no option `sparkle`"),
        ("race scene.obj --methods path:seed=x --time 1s", "seed"),
        ("race scene.obj --methods path,path --time 1s", "path is in the race twice"),
        ("race scene.obj --methods path --time 1s --report scene.mtl", "it is a file, not a folder"),
        ("race missing.obj --methods path --time 1s", "missing.obj"),
        ("info missing.toml", "missing.toml"),
        ("render scene.obj --size 0x9", "640x480"),
        ("render scene.obj --simd mmx", "baseline, avx2, avx512"),
    ] {
        let said = folder.refused(arguments);
        assert!(said.contains(reason), "{arguments}: {said}");
    }
    assert_eq!(files(&folder.0), 2);
}

#[test]
fn a_render_writes_every_picture_and_says_the_contract() {
    let folder = Folder::new("render");
    let object = folder.object(
        "render scene.obj -o a.png -o a.exr -o a.hdr -o a.pfm --size 24x16 --spp 4 --seed 7 --threads 1 \
         --simd baseline --eye -0.5,1,4 --look-at 0,1,0 --fov 45 --json",
    );
    for name in ["a.png", "a.exr", "a.hdr", "a.pfm"] {
        let image = read(&folder.path(name)).unwrap();
        assert_eq!((image.width, image.height), (24, 16), "{name}");
        assert!(image.mean()[0] > 0.01, "{name} is not black");
    }
    assert_eq!(files(&folder.0), 6, "nothing else is left");

    for key in ["rays", "paths", "rounds"] {
        assert!(object[key].as_u64().unwrap() > 0, "{key}");
    }
    for key in ["load", "build", "render", "total"] {
        assert!(object["seconds"][key].as_f64().unwrap() >= 0.0, "{key}");
    }
    assert_eq!(object["paths"], 24 * 16 * 4);
    for (key, value) in [("width", 24), ("height", 16), ("spp", 4), ("seed", 7), ("threads", 1)] {
        assert_eq!(object[key], value, "{key}");
    }
    assert_eq!((object["method"].as_str(), object["level"].as_str()), (Some("path"), Some("baseline")));
    assert_eq!(object["error"]["against"], "estimate");
    assert!(object["error"]["relmse"].is_number() && object["error"]["interval"].is_array());
    assert!(object["dropped"].is_object() && object["memory"]["bvh"].is_number());
    assert_eq!(object["mean_radiance"].as_array().unwrap().len(), 3);
    let findings = object["findings"].as_object().unwrap();
    assert!(
        findings.values().all(|finding| finding["decision"].is_string() && finding["reason"].is_string())
    );
    let left_out = object["left_out"].as_array().unwrap();
    assert!(left_out.iter().all(|entry| entry["what"].is_string() && entry["why"].is_string()));
}

#[test]
fn a_render_without_a_stop_rule_ends_by_its_error_and_says_so() {
    let folder = Folder::new("sensible");
    let object = folder.object("render scene.obj --size 16x16 --json");
    assert_eq!((&object["ending"], &object["stop_rule"]), (&"done".into(), &"error".into()));
    assert!(object["error"]["interval"][1].as_f64().unwrap() <= 1e-3, "{}", object["error"]);
    let output = folder.run("render scene.obj --size 16x16");
    assert!(String::from_utf8(output.stdout).unwrap().contains("ended at relMSE 1e-3, the default"));
    let output = folder.run("render scene.obj --size 16x16 --error 0.001 --time 60s");
    assert!(!String::from_utf8(output.stdout).unwrap().contains("default"), "the rules were given");

    assert_eq!(folder.object("render scene.obj --size 16x16 --spp 4 --json")["stop_rule"], "spp");
    let object = folder.object("render scene.obj --size 64x64 --time 0.2s --json");
    assert_eq!(object["stop_rule"], "time");
}

#[test]
fn a_scene_without_light_is_black_at_once_and_says_so() {
    let folder = Folder::new("dark");
    std::fs::write(folder.path("scene.mtl"), "newmtl floor\nKd 0.5 0.5 0.5\n").unwrap();
    for (rules, spp) in [("", 1), ("--time 1h", 1), ("--error 1e-9", 1), ("--spp 3", 3)] {
        let output = folder.run(&format!("render scene.obj -o a.pfm --size 8x8 {rules} --json"));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains("note: nothing in this scene emits light"), "{said}");
        let object: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((output.status.code(), &object["spp"]), (Some(0), &spp.into()), "{rules}");
    }
    assert_eq!(read(&folder.path("a.pfm")).unwrap(), Image::black(8, 8));
}

#[test]
fn a_report_is_a_page_a_curve_and_the_same_object() {
    let folder = Folder::new("report");
    let object = folder.object("render scene.obj -o a.png --size 20x16 --spp 16 --report out --json");
    let text = |name: &str| std::fs::read_to_string(folder.path("out").join(name)).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&text("run.json")).unwrap(), object);
    assert_eq!(text("curve.csv").lines().count(), 1 + object["history"].as_array().unwrap().len());
    let page = text("index.html");
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    assert_eq!(folder.page_object("out"), object);
    for layer in ["picture", "variances"] {
        assert!(page.contains(&format!(r#"{{"of":0,"name":"{layer}","width":20,"height":16,"#)), "{layer}");
    }
    assert_eq!((&object["scene"], &object["census"]["emissive"]), (&"scene.obj".into(), &2.into()));
    assert_eq!(files(&folder.path("out")), 3);
    assert_eq!(object["made"]["command"][1], "render");

    // A second report in the same folder, and a report of a picture without an error to draw.
    folder.object("render scene.obj -o a.png --size 3x5 --spp 1 --report out --json");
    folder.object(
        "render scene.obj -o a.png --size 1x1 --spp 4 --eye 0,50,0 --look-at 0,90,1 --report out --json",
    );
}

#[test]
fn a_race_tells_who_is_ahead() {
    let folder = Folder::new("race");
    let object = folder.object(
        "race scene.obj --methods path,path:max-depth=1:seed=4 --time 400ms --size 16x16 --report out --json",
    );
    let methods = object["methods"].as_array().unwrap();
    assert_eq!(methods.len(), 2);
    assert_eq!((&methods[1]["name"], &methods[1]["seed"]), (&"path:max-depth=1:seed=4".into(), &4.into()));
    for method in methods {
        let (error, seconds) = (&method["error"]["relmse"], &method["seconds"]["render"]);
        assert!(seconds.as_f64().unwrap() > 0.1, "{seconds}");
        let efficiency = 1.0 / (error.as_f64().unwrap() * seconds.as_f64().unwrap());
        assert!((method["efficiency"].as_f64().unwrap() / efficiency - 1.0).abs() < 1e-9);
    }
    assert_eq!(methods[0]["ratio"], 1.0);
    assert_eq!(object["against"], "estimate");
    let csv = std::fs::read_to_string(folder.path("out/curve.csv")).unwrap();
    assert!(csv.starts_with("method,seconds,") && csv.contains("\npath:max-depth=1:seed=4,"), "{csv}");
    let page = std::fs::read_to_string(folder.path("out/index.html")).unwrap();
    assert_eq!(folder.page_object("out"), object);
    assert!(page.contains(r#"{"of":1,"name":"picture","width":16"#));

    folder.object("render scene.obj -o r.exr --size 16x16 --spp 256 --seed 9 --json");
    let text =
        folder.run("race scene.obj --methods path,auto --time 200ms --size 16x16 --reference r.exr").stdout;
    let text = String::from_utf8(text).unwrap();
    assert!(text.contains("against the reference") && text.contains("efficiency"), "{text}");
}

#[test]
fn every_method_races() {
    let folder = Folder::new("race-all");
    let methods = Method::ALL.map(Method::name);
    let list = methods.join(",");
    let object = folder.object(&format!("race scene.obj --methods {list} --time 100ms --size 8x8 --json"));
    let rows = object["methods"].as_array().unwrap();
    assert_eq!(rows.len(), methods.len());
    for (row, name) in rows.iter().zip(methods) {
        assert_eq!(row["name"], name);
        assert!(row["spp"].as_u64().unwrap() > 0 && row["filled_pixels"] == 0, "{row}");
    }
}

#[test]
fn threads_leave_the_bits_alone() {
    let folder = Folder::new("bits");
    for (name, threads) in [("one", 1), ("three", 3)] {
        folder.object(&format!(
            "render scene.obj -o {name}.pfm --size 40x30 --spp 5 --threads {threads} --json"
        ));
    }
    let bytes = |name| std::fs::read(folder.path(name)).unwrap();
    assert!(bytes("one.pfm") == bytes("three.pfm"));
}

#[test]
fn without_output_the_picture_has_the_name_of_the_scene() {
    let folder = Folder::new("default");
    folder.object("render scene.obj --size 8x8 --spp 1 --json");
    assert_eq!(read(&folder.path("scene.png")).unwrap().pixels.len(), 64);
}

#[test]
fn a_reference_is_compared_with_and_its_size_is_checked_first() {
    let folder = Folder::new("reference");
    folder.object("render scene.obj -o r.exr --size 16x16 --spp 64 --json");
    let object =
        folder.object("render scene.obj -o a.exr --size 16x16 --spp 4 --seed 1 --reference r.exr --json");
    assert_eq!(object["error"]["against"], "reference");
    for key in ["relmse", "mse", "rmse", "flip"] {
        assert!(object["error"][key].as_f64().unwrap() > 0.0, "{key}");
    }
    assert!(object["error"]["estimate"]["relmse"].is_number());
    let history = object["history"].as_array().unwrap();
    assert_eq!(history.len() as u64, object["rounds"].as_u64().unwrap());
    for keys in history.windows(2) {
        assert!(keys[0]["seconds"].as_f64() < keys[1]["seconds"].as_f64());
        assert!(keys[0]["rays"].as_u64() < keys[1]["rays"].as_u64());
    }
    let last = &history[history.len() - 1];
    assert_eq!((&last["spp"], &last["relmse"]), (&object["spp"], &object["error"]["estimate"]["relmse"]));
    assert_eq!(last["reference"]["mse"], object["error"]["mse"]);
    assert!(history[0]["reference"]["flip"].is_number());
    write(&folder.path("nan.pfm"), &Image { width: 8, height: 8, pixels: vec![[f32::NAN; 3]; 64] }).unwrap();
    let render = "render scene.obj -o a.exr --size 8x8 --spp 4 --reference nan.pfm --report out --json";
    assert!(folder.object(render)["error"]["relmse"].is_null(), "there is nothing to compare with");
    let said = folder.refused("render scene.obj -o b.exr --size 9x9 --reference r.exr");
    assert!(said.contains("--size 16x16") && !folder.path("b.exr").exists(), "{said}");
}

#[test]
fn compare_prints_known_values() {
    let folder = Folder::new("compare");
    let flat = |value: f32| Image { width: 2, height: 1, pixels: vec![[value; 3]; 2] };
    write(&folder.path("a.exr"), &flat(1.5)).unwrap();
    write(&folder.path("b.pfm"), &flat(1.0)).unwrap();
    let object = folder.object("compare a.exr b.pfm --json -o d.pfm");
    assert_eq!((object["mse"].as_f64(), object["rmse"].as_f64()), (Some(0.25), Some(0.5)));
    assert_eq!(object["relmse"].as_f64(), Some(0.25 / 1.01));
    assert_eq!(object["flip"].as_f64(), Some(0.0), "both are white on a display");
    assert_eq!(read(&folder.path("d.pfm")).unwrap(), flat(0.5));
    let object = folder.object("compare b.pfm a.exr --json -o d.pfm -o d.png --difference signed");
    assert_eq!(read(&folder.path("d.pfm")).unwrap(), flat(-0.5));
    assert_eq!(
        object["outputs"][0],
        serde_json::json!({"file": "d.pfm", "difference": "signed", "scale": null})
    );
    assert_eq!(object["outputs"][1]["scale"], serde_json::json!([-0.5, 0.5]));

    write(&folder.path("c.exr"), &Image::black(3, 1)).unwrap();
    assert!(folder.refused("compare a.exr c.exr").contains("2x1 and 3x1"));
    write(&folder.path("nan.pfm"), &flat(f32::NAN)).unwrap();
    let text = String::from_utf8(folder.run("compare nan.pfm b.pfm").stdout).unwrap();
    assert!(text.contains("2 pixels of the picture are infinite or not a number"), "{text}");
    assert!(text.contains("relMSE NaN"), "{text}");
    for pair in ["nan.pfm b.pfm", "b.pfm nan.pfm", "nan.pfm nan.pfm"] {
        let object = folder.object(&format!("compare {pair} --json"));
        assert!(
            ["relmse", "mse", "rmse", "flip", "mean"].iter().all(|key| object[key].is_null()),
            "{object}"
        );
    }
}

#[test]
fn info_counts_what_is_there() {
    let folder = Folder::new("info");
    let object = folder.object("info scene.obj --json");
    assert_eq!(
        (object["census"]["triangles"].as_u64(), object["census"]["emissive"].as_u64()),
        (Some(4), Some(2))
    );
    assert!(object["memory"]["bvh"].is_number() && !object["left_out"].as_array().unwrap().is_empty());
    assert!(object["objects"].as_array().is_some_and(|names| !names.is_empty()), "{object}");
    let text = String::from_utf8(folder.run("info scene.obj").stdout).unwrap();
    assert!(text.contains("objects") && text.contains("triangles") && text.contains("left out"), "{text}");
}

/// Ctrl-C, as a terminal sends it.
#[cfg(unix)]
#[test]
fn an_interrupt_saves_what_there_is_and_exits_with_3() {
    use std::process::Stdio;
    let folder = Folder::new("interrupt");
    let mut command = folder.command("render scene.obj -o a.png --size 64x64 --time 1h --json");
    let child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(core::time::Duration::from_secs(2));
    // By the shell's built-in command: not every machine has the program `kill`.
    let kill = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(3));
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(object["ending"], "interrupted");
    assert_eq!(read(&folder.path("a.png")).unwrap().pixels.len(), 64 * 64);
}
