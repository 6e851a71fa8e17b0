//! Names of files and of materials, whose bytes may be no text or commands to a terminal.

use crate::support::Folder;
use std::fs;
use std::process::Output;

/// A name that sets the title of a terminal, in an encoding of file names and in text.
const TITLE: &str = "a\u{1b}]0;b\u{7}\u{9b}2J";

/// Asserts that a terminal can show both streams as they are.
fn check(output: &Output) {
    for stream in [&output.stdout, &output.stderr] {
        let text = str::from_utf8(stream).unwrap();
        assert!(text.chars().all(|c| c == '\n' || !c.is_control()), "{text:?}");
        assert!(!text.contains("internal error"), "{text}");
    }
}

#[test]
fn names_in_files_do_not_command_the_terminal() {
    let folder = Folder::new("title");
    let obj = format!("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl {TITLE}\nf 1 2 3\n{TITLE} 1\n");
    fs::write(folder.path("a.obj"), obj).unwrap();
    fs::write(folder.path("m.mtl"), format!("newmtl x\nmap_Kd {TITLE}.png\n{TITLE} 3\n")).unwrap();
    fs::write(folder.path("a.toml"), "[[mesh]]\nfile = \"\\u001b[31mx.obj\"").unwrap();
    for command in [
        "render a.obj --size 8x8 --spp 1 -o a.png",
        "info a.obj",
        "info a.obj --json",
        "info a.toml",
        &format!("info {TITLE}.obj"),
        &format!("render a.obj -o {TITLE}.gif"),
        &format!("render a.obj {TITLE}"),
        &format!("render a.obj --method {TITLE}"),
        &format!("paint {TITLE}"),
    ] {
        check(&folder.run(command));
    }
    let said = folder.run("info a.obj").stdout;
    assert!(String::from_utf8(said).unwrap().contains("`a\\u001b]0;b\\u0007\\u009b2J`"));
}

/// Other systems refuse such names.
#[cfg(target_os = "linux")]
#[test]
fn names_that_are_no_text_are_names_in_every_command() {
    use std::ffi::OsString;
    use std::os::unix::ffi::OsStringExt;
    let folder = Folder::new("bytes");
    let named = |name: &str| OsString::from_vec([name.as_bytes(), b"\xff\x1b"].concat());
    let with = |name: &str, end: &str| [named(name), end.into()].into_iter().collect::<OsString>();
    for name in ["scene.obj", "scene.mtl"] {
        fs::copy(folder.path(name), folder.0.join(named(name))).unwrap();
    }
    let obj = with("s", ".obj");
    fs::rename(folder.path("scene.obj"), folder.0.join(&obj)).unwrap();
    let run = |arguments: &str, names: &[&OsString]| {
        let mut names = names.iter();
        let mut command = folder.command("");
        command.args(arguments.split(' ').map(|word| match word {
            "NAME" => (*names.next().unwrap()).clone(),
            word => word.into(),
        }));
        let output = command.output().unwrap();
        check(&output);
        output
    };
    let [picture, other, film, report] =
        [with("a", ".pfm"), with("b", ".png"), named("film"), named("report")];
    let render = "render NAME --size 16x16 --spp 4 -o NAME --checkpoint NAME --report NAME --json";
    for (arguments, names, code) in [
        (render, vec![&obj, &picture, &film, &report], 0),
        ("render NAME --size 16x16 --spp 4 -o NAME --resume NAME", vec![&obj, &picture, &film], 0),
        ("render NAME --size 16x16 --spp 4 -o NAME --reference NAME", vec![&obj, &other, &picture], 0),
        ("merge NAME -o NAME --json", vec![&film, &other], 0),
        ("compare NAME NAME -o NAME --json", vec![&picture, &picture, &other], 0),
        ("race NAME --methods path --time 100ms --size 8x8 --report NAME --json", vec![&obj, &report], 0),
        ("info NAME --json", vec![&obj], 0),
        ("render NAME", vec![&picture], 2),
        ("compare NAME NAME", vec![&picture, &report], 2),
        ("merge NAME -o NAME", vec![&picture, &other], 2),
        ("render NAME -o NAME", vec![&obj, &report], 2),
        ("render NAME --spp NAME", vec![&obj, &report], 2),
    ] {
        let output = run(arguments, &names);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments}: {said}");
        if arguments.ends_with("--json") {
            assert!(serde_json::from_slice::<serde_json::Value>(&output.stdout).is_ok(), "{arguments}");
        }
    }
    assert!(folder.0.join(&picture).exists() && folder.0.join(&other).exists());
}
