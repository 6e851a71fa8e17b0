//! Output files of a command: never one of its inputs, never one file twice, and independent of each other's
//! failures.

use crate::support::Folder;
use halflight::save::{Image, read, write};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A folder with a scene that names every kind of file that a scene can name.
fn furnished(name: &str) -> Folder {
    let folder = Folder::new(name);
    let picture = Image { width: 8, height: 8, pixels: vec![[0.5; 3]; 64] };
    for file in ["wood.png", "unused.png", "scene.png", "sky.exr", "steel.png", "reference.exr"] {
        write(&folder.path(file), &picture).unwrap();
    }
    let materials = "newmtl floor\nKd 1 1 1\nmap_Kd wood.png\nmap_Ks scene.png\n\
        newmtl lamp\nKe 1 1 1\nnewmtl nobody\nmap_Kd unused.png\n";
    fs::write(folder.path("scene.mtl"), materials).unwrap();
    let scene = "[[mesh]]\nfile = \"scene.obj\"\n[environment]\nmap = \"sky.exr\"\n\
        [material.none]\ncolor_map = \"steel.png\"\n";
    fs::write(folder.path("room.toml"), scene).unwrap();
    folder
}

/// All files of a folder with their contents, except devices.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    for path in fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path()) {
        let kind = fs::metadata(&path).unwrap();
        if kind.is_dir() {
            all.extend(contents(&path));
        } else if kind.is_file() {
            all.push((path.to_string_lossy().into_owned(), fs::read(&path).unwrap()));
        }
    }
    all.sort();
    all
}

const SMALL: &str = "--size 8x8 --spp 1";

#[test]
fn what_is_read_is_never_written() {
    let folder = furnished("inputs");
    folder.object(&format!("render scene.obj {SMALL} --checkpoint old.film -o a.png --json"));
    folder.object(&format!(
        "render scene.obj {SMALL} --method irradiance-cache --save-cache old.cache -o a.png --json"
    ));
    fs::copy(folder.path("old.film"), folder.path("film.png")).unwrap();
    fs::hard_link(folder.path("wood.png"), folder.path("hard.png")).unwrap();
    fs::create_dir_all(folder.path("sub/report")).unwrap();
    fs::hard_link(folder.path("old.film"), folder.path("sub/hard.film")).unwrap();
    let before = contents(&folder.0);
    let render = "render room.toml --size 8x8 --spp 1";
    for (arguments, names) in [
        (format!("{render} -o hard.png"), ["hard.png", "wood.png"]),
        (format!("{render} -o sub/../wood.png"), ["sub/../wood.png", "wood.png"]),
        (format!("{render} -o ok.png -o sky.exr"), ["sky.exr (-o)", "sky.exr: both"]),
        (format!("{render} -o unused.png"), ["unused.png (-o)", "unused.png: both"]),
        (format!("{render} -o steel.png"), ["steel.png (-o)", "steel.png: both"]),
        (format!("{render} -o ok.png --checkpoint room.toml"), ["--checkpoint", "room.toml: both"]),
        (format!("{render} -o reference.exr --reference ./reference.exr"), ["(-o)", "./reference.exr"]),
        (format!("{render} --save-cache scene.mtl --method irradiance-cache"), ["--save-cache", "scene.mtl"]),
        (format!("{render} --checkpoint old.cache --load-cache old.cache"), ["--checkpoint", "old.cache"]),
        (format!("{render} --save-cache sub/hard.film --resume old.film"), ["--save-cache", "old.film"]),
        (format!("render scene.obj {SMALL}"), ["without -o", "scene.png: both"]),
        ("compare sky.exr reference.exr -o reference.exr".into(), ["(-o)", "reference.exr: both"]),
        (
            "compare sky.exr reference.exr -o d.png -o sub/../sky.exr".into(),
            ["sub/../sky.exr", "sky.exr: both"],
        ),
        ("merge film.png -o film.png".into(), ["film.png (-o)", "film.png: both"]),
    ] {
        let said = folder.refused(&arguments);
        assert!(names.iter().all(|name| said.contains(name)), "{arguments}: {said}");
        assert!(before == contents(&folder.0), "{arguments} has changed something");
    }
    let said = folder.refused(&format!("render scene.obj {SMALL}"));
    assert!(said.contains("-o picture.png"), "{said}");
}

#[cfg(unix)]
#[test]
fn links_are_what_they_lead_to() {
    use std::os::unix::fs::symlink;
    let folder = furnished("links");
    symlink("wood.png", folder.path("link.png")).unwrap();
    symlink("link.png", folder.path("chain.png")).unwrap();
    fs::create_dir(folder.path("report")).unwrap();
    symlink("../scene.mtl", folder.path("report/curve.csv")).unwrap();
    let before = contents(&folder.0);
    for arguments in ["render room.toml -o chain.png", "render room.toml -o a.png --report report"] {
        folder.refused(arguments);
        assert!(before == contents(&folder.0), "{arguments} has changed something");
    }

    // A link to a missing file is written through; a cycle of links is an error.
    fs::create_dir(folder.path("sub")).unwrap();
    symlink("sub/new.film", folder.path("c.film")).unwrap();
    symlink("sub/new.png", folder.path("new.png")).unwrap();
    folder.object(&format!("render scene.obj {SMALL} -o new.png --checkpoint c.film --json"));
    assert!(folder.path("new.png").is_symlink() && folder.path("c.film").is_symlink());
    assert_eq!(read(&folder.path("sub/new.png")).unwrap().pixels.len(), 64);
    folder.object(&format!(
        "render scene.obj {SMALL} -o a.png --resume sub/new.film --checkpoint c.film --json"
    ));
    symlink("b.png", folder.path("a.pfm")).unwrap();
    symlink("circle.png", folder.path("circle.png")).unwrap();
    symlink("none/x.png", folder.path("far.png")).unwrap();
    for (output, why) in [("circle.png", "circle"), ("far.png", "there is no folder")] {
        let said = folder.refused(&format!("render scene.obj {SMALL} -o {output}"));
        assert!(said.contains(why), "{said}");
    }
    // Two names of one file that does not exist yet.
    let said = folder.refused(&format!("render scene.obj {SMALL} -o a.pfm -o b.png"));
    assert!(said.contains("a.pfm (-o)") && said.contains("b.png (-o)"), "{said}");
}

#[test]
fn no_two_outputs_are_the_same_file() {
    let folder = Folder::new("twice");
    fs::create_dir(folder.path("out")).unwrap();
    for (outputs, names) in [
        ("-o a.png -o ./a.png", ["a.png (-o)", "./a.png (-o)"]),
        ("-o a.png --checkpoint b.film --save-cache out/../b.film", ["--checkpoint", "--save-cache"]),
        ("-o a.png --report out --checkpoint out/run.json", ["--checkpoint", "--report"]),
    ] {
        let said = folder.refused(&format!("render scene.obj {SMALL} --method irradiance-cache {outputs}"));
        assert!(names.iter().all(|name| said.contains(name)), "{outputs}: {said}");
    }
    assert_eq!(contents(&folder.0).len(), 2, "nothing is written");
}

#[test]
fn a_report_takes_the_place_of_reports_alone() {
    let folder = Folder::new("site");
    for (report, file, text) in [
        ("site", "site/index.html", "<!doctype html><p>My page about halflight</p>"),
        ("data", "data/curve.csv", "x,y\n1,2\n"),
        ("more", "more/run.json", "{}"),
    ] {
        fs::create_dir(folder.path(report)).unwrap();
        fs::write(folder.path(file), text).unwrap();
        let race = format!("race scene.obj --methods path --time 100ms --size 8x8 --report {report}");
        for command in [format!("render scene.obj {SMALL} -o a.png --report {report}"), race] {
            let said = folder.refused(&command);
            assert!(said.contains(file), "{said}");
        }
        assert_eq!(fs::read_to_string(folder.path(file)).unwrap(), text);
    }
    assert!(!folder.path("a.png").exists());
    // Reports of a race and of a render replace each other.
    folder.object("race scene.obj --methods path --time 100ms --size 8x8 --report ours --json");
    folder.object(&format!("render scene.obj {SMALL} -o a.png --report ours --json"));
    folder.object("race scene.obj --methods path --time 100ms --size 8x8 --report ours --json");
}

/// Runs `script`, in which `$H` is the program.
fn shell(folder: &Folder, script: &str) -> Output {
    let mut shell = Command::new("sh");
    shell.current_dir(&folder.0).env("H", env!("CARGO_BIN_EXE_halflight")).args(["-c", script]);
    shell.output().unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn one_output_that_fails_leaves_all_others() {
    let folder = Folder::new("full");
    std::os::unix::fs::symlink("/dev/full", folder.path("full.pfm")).unwrap();
    let output = folder.run("render scene.obj --size 16x16 --spp 4 -o full.pfm -o b.png --report out --json");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("full.pfm").count(), 1, "{said}");
    assert!(said.contains("the disk is full"), "{said}");
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(object["outputs"], serde_json::json!(["b.png"]));
    assert!(read(&folder.path("b.png")).is_ok() && folder.path("out/index.html").exists());

    write(&folder.path("r.pfm"), &Image::black(16, 16)).unwrap();
    let output = folder.run("compare b.png r.pfm -o full.pfm -o d.png");
    assert_eq!(output.status.code(), Some(2));
    assert!(folder.path("d.png").exists() && String::from_utf8_lossy(&output.stdout).contains("relMSE"));

    // A limit of 20 kB per file; the float picture has 49 kB.
    let script =
        "ulimit -f 40; exec $H render scene.obj --size 64x64 --spp 4 -o a.pfm -o c.png --checkpoint c.film";
    let output = shell(&folder, script);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("error: a.pfm") && said.contains("error: c.film"), "{said}");
    assert!(read(&folder.path("c.png")).is_ok());
    assert!(!folder.path("a.pfm").exists() && !folder.path("c.film").exists());

    // A limit of 512 bytes per file, which suffices for the picture but not for the cache.
    let script = "ulimit -f 1; exec $H render scene.obj --spp 1 --method irradiance-cache \
        -o tiny.png --size 8x8 --save-cache c.cache";
    let output = shell(&folder, script);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("note: c.cache") && said.contains("error: c.cache"), "{said}");
    assert!(contents(&folder.0).iter().all(|(name, _)| !name.ends_with(".part")));
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_are_lost_are_a_failure_in_every_command() {
    let folder = Folder::new("lost");
    write(&folder.path("r.pfm"), &Image::black(8, 8)).unwrap();
    folder.object(&format!("render scene.obj {SMALL} -o a.png --checkpoint a.film --json"));
    for command in [
        "info scene.obj",
        "info scene.obj --json",
        "compare a.png r.pfm",
        "merge a.film -o b.png",
        "race scene.obj --methods path --time 100ms --size 8x8",
        "render scene.obj --size 8x8 --spp 1 -o c.png",
        "--help",
        "render --help",
        "--version",
    ] {
        let output = shell(&folder, &format!("$H {command} > /dev/full"));
        assert_eq!(output.status.code(), Some(2), "{command}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("standard output"), "{command}");
    }
    assert!(folder.path("b.png").exists() && folder.path("c.png").exists());
}

#[cfg(unix)]
#[test]
fn readers_that_are_gone_change_nothing() {
    use std::process::Stdio;
    let folder = Folder::new("gone");
    // A missing material, which gives a note.
    fs::write(folder.path("grey.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl none\nf 1 2 3\n").unwrap();
    write(&folder.path("r.pfm"), &Image::black(8, 8)).unwrap();
    for (command, code) in [
        ("render grey.obj --size 8x8 --spp 1 -o a.png", 0),
        ("info grey.obj", 0),
        ("compare r.pfm r.pfm", 0),
        ("race grey.obj --methods path --time 100ms --size 8x8", 0),
        ("--help", 0),
        ("info missing.obj", 2),
        ("render grey.obj --sparkle", 2),
        ("", 2),
    ] {
        let mut child = folder.command(command);
        let mut child = child.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().unwrap().code(), Some(code), "{command}");
        for closed in ["2>&-", ">&-", ">&- 2>&-"] {
            assert_eq!(
                shell(&folder, &format!("$H {command} {closed}")).status.code(),
                Some(code),
                "{command}"
            );
        }
    }
    assert!(read(&folder.path("a.png")).is_ok());
    // Notes to a full disk are lost without an error.
    #[cfg(target_os = "linux")]
    assert_eq!(shell(&folder, "$H info grey.obj 2> /dev/full").status.code(), Some(0));
}

#[cfg(target_os = "linux")]
#[test]
fn standard_output_may_be_where_the_picture_goes() {
    let folder = Folder::new("stdout");
    std::os::unix::fs::symlink("/dev/stdout", folder.path("out.pfm")).unwrap();
    let output = folder.run(&format!("render scene.obj {SMALL} -o out.pfm"));
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(output.stdout.len(), "PF\n8 8\n-1.0\n".len() + 8 * 8 * 12, "the picture, and nothing else");
    assert!(String::from_utf8_lossy(&output.stderr).contains("saved"));
    let output = shell(&folder, &format!("$H render scene.obj {SMALL} -o out.pfm > file.pfm"));
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(read(&folder.path("file.pfm")).unwrap().pixels.len(), 64);
    let said = folder.refused(&format!("render scene.obj {SMALL} -o out.pfm --json"));
    assert!(said.contains("--json"), "{said}");
    // A redirection counts as an output.
    let output = shell(&folder, &format!("$H render scene.obj {SMALL} -o b.png --json > b.png"));
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("standard output"));
    std::os::unix::fs::symlink("/dev/null", folder.path("null.png")).unwrap();
    folder.object(&format!("render scene.obj {SMALL} -o null.png --checkpoint /dev/null --json"));
    assert!(folder.path("null.png").is_symlink());
}
