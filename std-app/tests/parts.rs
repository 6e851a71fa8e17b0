//! Renders in parts: killed and resumed, or divided into shards and merged, with the same bits or a refusal
//! with its reason; and renders that end by time or error.

use crate::support::Folder;
use core::time::Duration;
use halflight::save::read;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Instant;

/// Number of kills of a render.
const KILLS: u32 = 50;

/// Kills a render again and again, each time resuming from the last checkpoint.
#[test]
fn a_render_killed_fifty_times_gives_the_same_bits() {
    let folder = Folder::new("killed");
    let render = "render scene.obj --size 40x56 --spp 700 --seed 3 -o";
    folder.object(&format!("{render} whole.pfm --json"));
    let whole = fs::read(folder.path("whole.pfm")).unwrap();

    let mut random = 1u32;
    let (mut kills, mut resumed, mut finished) = (0, 0, 0);
    while kills < KILLS || finished == 0 {
        let resume = if folder.path("film").exists() { "--resume film" } else { "" };
        let arguments = format!("{render} parts.pfm --checkpoint film --checkpoint-every 1ms {resume}");
        let mut child =
            folder.command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        if kills < KILLS {
            // Every other render is killed after its first film, however slow the machine is.
            let written = || fs::metadata(folder.path("film")).and_then(|film| film.modified()).ok();
            let before = written();
            while kills % 2 == 1 && written() == before && child.try_wait().unwrap().is_none() {
                std::thread::sleep(Duration::from_millis(1));
            }
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            std::thread::sleep(Duration::from_micros(u64::from(random % 90_000)));
            let _ = child.kill();
        }
        let status = child.wait().unwrap();
        if status.success() {
            assert!(fs::read(folder.path("parts.pfm")).unwrap() == whole, "after {kills} kills");
            fs::remove_file(folder.path("film")).unwrap();
            finished += 1;
        } else {
            assert_eq!(status.code(), None, "killed, not refused");
            kills += 1;
            resumed += u32::from(!resume.is_empty());
        }
    }
    println!("{kills} kills, {resumed} of them of resumed renders, {finished} renders finished");
    assert!(resumed > KILLS / 4, "{resumed} of {kills}");
}

#[test]
fn a_finished_film_goes_on_to_more_samples() {
    let folder = Folder::new("more");
    folder.object("render scene.obj --size 33x20 --spp 40 -o whole.pfm --json");
    let first = folder.object("render scene.obj --size 33x20 --spp 13 -o a.pfm --checkpoint film --json");
    // A time beyond the range of the clock is no limit.
    let second = folder
        .object("render scene.obj --size 33x20 --spp 40 --time 1e300 --checkpoint b --checkpoint-every 1e300 -o b.pfm --resume film --json");
    assert!(fs::read(folder.path("whole.pfm")).unwrap() == fs::read(folder.path("b.pfm")).unwrap());
    assert_eq!((first["paths"].as_u64(), second["paths"].as_u64()), (Some(33 * 20 * 13), Some(33 * 20 * 40)));
    // Up to the last round: later seconds are not in the film.
    let rounds = first["history"].as_array().unwrap();
    let before = rounds.last().unwrap()["seconds"].as_f64().unwrap();
    assert!(second["seconds"]["render"].as_f64().unwrap() > before, "the time before counts");
    // Samples reached already: the picture is that of the film.
    let same = folder.object("render scene.obj --size 33x20 --spp 5 -o c.pfm --resume film --json");
    assert_eq!(same["spp"], 13);
    assert!(fs::read(folder.path("a.pfm")).unwrap() == fs::read(folder.path("c.pfm")).unwrap());
}

#[test]
fn shards_merge_to_the_bits_of_one_render() {
    let folder = Folder::new("shards");
    let render = "render scene.obj --size 70x50 --spp 12 --json";
    let whole = folder.object(&format!("{render} -o whole.exr"));
    for shard in 1..=3 {
        folder.object(&format!("{render} --shard {shard}/3 --checkpoint {shard}.film"));
    }
    let merged = folder.object("merge 3.film 1.film 2.film -o merged.exr --json");
    assert_eq!(read(&folder.path("whole.exr")).unwrap(), read(&folder.path("merged.exr")).unwrap());
    assert_eq!(merged["findings"]["reconstruction"]["decision"], "used");
    assert_eq!(merged["findings"]["reconstruction"], whole["findings"]["reconstruction"]);
    for key in ["spp", "rays", "shadow_rays", "paths", "mean_radiance", "error"] {
        assert_eq!(whole[key], merged[key], "{key}");
    }

    folder.object(&format!("{render} --seed 9 --shard 2/3 --checkpoint seed.film"));
    folder.object(&format!("{render} --shard 2/4 --checkpoint four.film"));
    folder.object("render scene.obj --size 70x50 --spp 11 --shard 2/3 --checkpoint few.film --json");
    for (films, reason) in [
        ("1.film 2.film", "shard 3/3 is missing"),
        ("1.film 2.film 2.film 3.film", "shard 2/3 is there more than once"),
        ("1.film seed.film 3.film", "seed.film: does not belong to 1.film: it is a film of seed 9, not 0"),
        ("1.film four.film 3.film", "one of 4 shards, not of 3"),
        ("1.film few.film 3.film", "a film of 11 samples, not of 12"),
        ("1.film scene.obj", "scene.obj: is no film file"),
    ] {
        let said = folder.refused(&format!("merge {films} -o no.png"));
        assert!(said.contains(reason), "{films}: {said}");
    }
    assert!(!folder.path("no.png").exists());
    let said = folder.refused(&format!("{render} --shard 9/99 --checkpoint no.film"));
    assert!(said.contains("number of tiles"), "{said}");
}

#[test]
fn a_merged_picture_knows_what_its_samples_share() {
    let folder = Folder::new("shared");
    // Photons correlate the errors of distant pixels, also across shards.
    let caustic = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/caustic/caustic.toml");
    let render =
        |scene: &str, method: &str| format!("render {scene} --size 64x64 --spp 8 --method {method} --json");
    let cases = [
        (caustic.to_str().unwrap(), "path", false, "noise and blur of photons"),
        ("scene.obj", "path", false, "noise and bias of the reconstruction"),
        ("scene.obj", "sppm", true, "noise and bias of the reconstruction; other bias is not included"),
    ];
    for (scene, method, biased, words) in cases {
        let render = render(scene, method);
        let whole = folder.object(&format!("{render} --audit off -o whole.exr"));
        for shard in 1..=2 {
            folder.object(&format!("{render} --audit off --shard {shard}/2 --checkpoint {shard}.film"));
        }
        let merged = folder.object("merge 1.film 2.film -o merged.exr --json");
        assert_eq!(
            (&whole["error"], &merged["may_be_biased"]),
            (&merged["error"], &biased.into()),
            "{method}"
        );
        let said = |command: &str| String::from_utf8_lossy(&folder.run(command).stdout).into_owned();
        let alone = format!("{} --audit off -o again.exr", render.replace("--json", ""));
        for said in [said("merge 1.film 2.film -o merged.exr"), said(&alone)] {
            assert!(said.contains(&format!("{words}\n")), "{said}");
        }
    }
    // Audited shards also have a bias estimate.
    for shard in 1..=2 {
        let render = render("scene.obj", "sppm");
        folder.object(&format!("{render} --shard {shard}/2 --checkpoint {shard}.film"));
    }
    let merged = folder.object("merge 2.film 1.film -o audited.exr --json");
    assert_eq!(read(&folder.path("merged.exr")).unwrap(), read(&folder.path("audited.exr")).unwrap());
    assert_eq!(merged["error"]["bias"]["audit"]["pixels"], 256);
    let said = folder.run("merge 1.film 2.film -o merged.exr").stdout;
    assert!(String::from_utf8_lossy(&said).contains("noise and bias"));
}

#[test]
fn caches_are_made_again_as_they_were() {
    let folder = Folder::new("caches");
    let cornell = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.obj");
    let view = "--eye 278,273,-800 --look-at 278,273,279 --fov 37.5 --size 128x128";
    let method = "--method irradiance-cache --cache-rays 256 --audit off --json";
    let render = format!("render {} {view} {method}", cornell.display());
    let whole = folder.object(&format!("{render} --spp 6 -o whole.exr"));
    folder.object(&format!("{render} --spp 2 --checkpoint part.film -o part.exr"));
    let resumed = folder.object(&format!("{render} --spp 6 --resume part.film -o resumed.exr"));
    for shard in 1..=2 {
        folder.object(&format!("{render} --spp 6 --shard {shard}/2 --checkpoint {shard}.film"));
    }
    folder.object("merge 1.film 2.film -o merged.exr --json");
    let bits = |name: &str| read(&folder.path(name)).unwrap();
    assert_eq!(bits("whole.exr"), bits("resumed.exr"));
    assert_eq!(bits("whole.exr"), bits("merged.exr"));
    // Prepasses are repeated on resumption, and their rays count once.
    for key in ["rays", "shadow_rays", "paths", "error"] {
        assert_eq!(whole[key], resumed[key], "{key}");
    }
}

#[test]
fn a_film_of_something_else_is_refused_with_the_reason() {
    let folder = Folder::new("else");
    folder.object("render scene.obj --size 20x20 --spp 4 -o a.png --checkpoint film --json");
    let resume = "render scene.obj --spp 8 -o b.png --size 20x20 --resume";
    for (more, reason) in [
        ("film --seed 1", "a film of seed 0, not 1"),
        ("film --max-depth 3", "a film of max-depth unlimited, not 3"),
        ("film --fov 12", "another scene, or its camera changed since"),
        ("missing", "error: missing: no such file\n  help: give another file"),
    ] {
        let said = folder.refused(&format!("{resume} {more}"));
        assert!(said.contains(reason), "{more}: {said}");
    }
    let said = folder.refused("render scene.obj --spp 8 -o b.png --size 20x21 --resume film");
    assert!(said.contains("a film of size 20x20, not 20x21"), "{said}");
    let whole = fs::read(folder.path("film")).unwrap();
    for (name, bytes, reason) in [
        ("short", whole[..whole.len() - 100].to_vec(), "damaged"),
        ("header", whole[..40].to_vec(), "damaged"),
        ("long", [whole.as_slice(), b"!"].concat(), "checksum"),
        (
            "flipped",
            whole.iter().enumerate().map(|(i, b)| b ^ u8::from(i == whole.len() / 2)).collect(),
            "checksum",
        ),
        ("empty", Vec::new(), "damaged"),
        ("text", b"hello\n".to_vec(), "is no film file"),
    ] {
        fs::write(folder.path(name), bytes).unwrap();
        let said = folder.refused(&format!("{resume} {name}"));
        assert!(said.contains(reason), "{name}: {said}");
    }
    fs::write(folder.path("scene.mtl"), "newmtl floor\nKd 0.6 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n")
        .unwrap();
    let said = folder.refused(&format!("{resume} film"));
    assert!(said.contains("another scene"), "{said}");
    assert!(!folder.path("b.png").exists());
}

#[test]
fn no_round_begins_after_the_time_of_a_render() {
    let folder = Folder::new("time");
    for (size, seconds) in [("64x64", 0.3), ("640x480", 1.5)] {
        let start = Instant::now();
        let object =
            folder.object(&format!("render scene.obj --size {size} --time {seconds} -o a.pfm --json"));
        let render = object["seconds"]["render"].as_f64().unwrap();
        assert!(start.elapsed().as_secs_f64() >= render, "{render} s");
        assert_eq!((&object["ending"], &object["stop_rule"]), (&"done".into(), &"time".into()));
        assert!(object["spp"].as_u64().unwrap() > 0);
        // A round begins when the one before it ends.
        let rounds = object["history"].as_array().unwrap();
        for round in &rounds[..rounds.len() - 1] {
            assert!(round["seconds"].as_f64().unwrap() < seconds, "{rounds:?}");
        }
    }
}

#[test]
fn the_error_is_reached_with_the_same_bits_however_fast() {
    let folder = Folder::new("error");
    let render = |name: &str, threads: u32, more: &str| {
        folder.object(&format!(
            "render scene.obj --size 48x48 --error 0.0001 --threads {threads} -o {name}.pfm {more} --json"
        ))
    };
    let one = render("one", 1, "");
    let upper = one["error"]["interval"][1].as_f64().unwrap();
    assert!(upper <= 1e-4 && upper > 0.0, "{upper}");
    render("many", 5, "--checkpoint film");
    // A film that has reached the error target is done.
    render("again", 2, "--resume film");
    let bytes = |name| fs::read(folder.path(name)).unwrap();
    assert!(bytes("one.pfm") == bytes("many.pfm") && bytes("one.pfm") == bytes("again.pfm"));
}

#[test]
fn what_is_dropped_is_told_with_its_place() {
    let folder = Folder::new("ledger");
    // The camera is in a cube of dense glass: total reflection keeps most of its paths there.
    let mut obj = fs::read_to_string(folder.path("scene.obj")).unwrap();
    for i in 0..8 {
        let at = |bit: u32, middle: f64| if i >> bit & 1 == 0 { middle - 0.5 } else { middle + 0.5 };
        obj += &format!("v {} {} {}\n", at(0, 0.0), at(1, 1.0), at(2, 4.0));
    }
    obj += "usemtl glass\nf -8 -6 -5 -7\nf -4 -3 -1 -2\nf -8 -7 -3 -4\nf -6 -2 -1 -5\nf -8 -4 -2 -6\nf -7 -5 -1 -3\n";
    fs::write(folder.path("scene.obj"), obj).unwrap();
    let mut mtl = fs::read_to_string(folder.path("scene.mtl")).unwrap();
    mtl += "\nnewmtl glass\nillum 7\nNi 2.4\nTf 1 1 1\n";
    fs::write(folder.path("scene.mtl"), mtl).unwrap();
    let object = folder
        .object("render scene.obj --size 128x128 --spp 1 --eye 0.1,1.2,4.1 --look-at 0,1,0 -o a.pfm --json");
    let dropped = &object["dropped"];
    let total = dropped["unfinished"].as_u64().unwrap();
    assert!(total > 8, "{dropped}");
    let places = dropped["places"].as_array().unwrap();
    assert_eq!(dropped["tiles"].as_u64().unwrap(), places.len() as u64);
    assert_eq!(places.iter().map(|place| place["unfinished"].as_u64().unwrap()).sum::<u64>(), total);
    assert!(places[0]["unfinished"].as_u64() >= places[1]["unfinished"].as_u64());
    assert_eq!((&places[0]["width"], &places[0]["height"]), (&16.into(), &16.into()));
    // Samples of unfinished paths count with the light found so far.
    assert_eq!(dropped["empty_pixels"].as_u64(), Some(0));
    let picture = read(&folder.path("a.pfm")).unwrap();
    assert!(picture.pixels.iter().flatten().all(|value| value.is_finite()));
}
