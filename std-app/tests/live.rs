//! Renders that are watched: previews, the viewer tev, progress as objects, quiet renders; and those that go
//! on where they were.

use crate::support::Folder;
use halflight::save::read;
use serde_json::Value;
use std::io::Read;
use std::net::TcpListener;
use std::process::Stdio;

const RENDER: &str = "render scene.obj --size 40x56 --seed 3 -o whole.exr";

#[test]
fn each_preview_is_a_whole_picture_and_the_last_is_the_result() {
    let folder = Folder::new("preview");
    let arguments = format!("{RENDER} --spp 600 --preview now.exr --every 1ms");
    let mut child = folder.command(&arguments).stdout(Stdio::null()).spawn().unwrap();
    let mut seen = 0;
    while child.try_wait().unwrap().is_none() {
        // Before the first preview there is no file.
        if folder.path("now.exr").exists() {
            let picture = read(&folder.path("now.exr")).unwrap();
            assert_eq!((picture.width, picture.height), (40, 56));
            seen += 1;
        }
    }
    assert!(child.wait().unwrap().success() && seen > 0, "{seen}");
    assert_eq!(read(&folder.path("now.exr")).unwrap(), read(&folder.path("whole.exr")).unwrap());
    println!("{seen} previews read");

    let said = folder.refused(&format!("{RENDER} --spp 1 --preview whole.exr"));
    assert!(said.contains("--preview") && said.contains("same file"), "{said}");
    let said = folder.refused(&format!("{RENDER} --spp 1 --every 2s"));
    assert!(said.contains("--every has nothing to show"), "{said}");
    let said = folder.refused(&format!("{RENDER} --spp 1 --preview now.gif"));
    assert!(said.contains("now.gif"), "{said}");
}

#[test]
fn pictures_that_are_shown_count_in_the_limit_of_memory() {
    let folder = Folder::new("shown");
    let render = "render scene.obj --size 400x300 --spp 1 --reconstruct off --method path -o whole.exr";
    let alone = folder.object(&format!("{render} --json"))["memory_peak"].as_u64().unwrap();
    for shown in ["--preview now.png", "--preview now.exr", "--tev=127.0.0.1:1"] {
        let described = folder.object(&format!("{render} {shown} --json"));
        let preview = described["memory"]["preview"].as_u64().unwrap();
        assert!(preview >= 400 * 300 * 24 && described["memory_peak"] == alone + preview, "{shown}");
        let said = folder.refused(&format!("{render} {shown} --memory {}", alone + preview - 1));
        assert!(said.contains("memory"), "{shown}: {said}");
    }
}

/// One packet of a client of tev: its kind, and its bytes without length and kind. `None` at the end.
fn packet(stream: &mut impl Read) -> Option<(u8, Vec<u8>)> {
    let mut length = [0; 4];
    stream.read_exact(&mut length).ok()?;
    let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
    stream.read_exact(&mut bytes).unwrap();
    Some((bytes[0], bytes[1..].to_vec()))
}

/// Reads from the bytes of a packet.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn array<const N: usize>(&mut self) -> [u8; N] {
        let (first, rest) = self.0.split_at(N);
        self.0 = rest;
        first.try_into().unwrap()
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|&byte| byte == 0).unwrap();
        let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
        self.0 = &self.0[end + 1..];
        text
    }

    fn number(&mut self) -> usize {
        i32::from_le_bytes(self.array()) as usize
    }
}

/// Kinds of packets, from tev's documentation of its protocol.
const CREATE: u8 = 4;
const UPDATE: u8 = 6;

#[test]
fn tev_gets_the_bits_of_the_picture() {
    let folder = Folder::new("tev");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let viewer = std::thread::spawn(move || {
        let mut stream = listener.accept().unwrap().0;
        let (kind, bytes) = packet(&mut stream).unwrap();
        assert_eq!(kind, CREATE);
        let mut fields = Fields(&bytes);
        assert_eq!((fields.array::<1>(), &*fields.text()), ([1], "halflight"));
        assert_eq!([0; 3].map(|_| fields.number()), [40, 56, 3]);
        assert_eq!([(); 3].map(|()| fields.text()), ["R", "G", "B"]);
        let mut pixels = Vec::new();
        while let Some((kind, bytes)) = packet(&mut stream) {
            assert_eq!(kind, UPDATE);
            let mut fields = Fields(&bytes);
            assert_eq!((fields.array::<1>(), &*fields.text()), ([0], "halflight"));
            assert_eq!((fields.number(), [(); 3].map(|()| fields.text()).concat()), (3, "RGB".into()));
            assert_eq!([0; 4].map(|_| fields.number()), [0, 0, 40, 56]);
            assert_eq!([0; 6].map(|_| i64::from_le_bytes(fields.array())), [0, 1, 2, 3, 3, 3]);
            pixels = fields.0.chunks(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
        }
        pixels
    });
    let output = folder.run(&format!("{RENDER} --spp 64 --every 1ms --tev={address}"));
    assert!(output.status.success());
    let exact = read(&folder.path("whole.exr")).unwrap();
    assert!(viewer.join().unwrap() == exact.pixels.concat());

    // Nobody listens: a note, and the same picture.
    let output = folder.run(&format!("{RENDER} --spp 64 --tev={address}"));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && said.matches("note:").count() == 1, "{said}");
    assert_eq!(read(&folder.path("whole.exr")).unwrap(), exact);
}

#[test]
fn progress_as_objects_follows_its_schema() {
    let folder = Folder::new("progress");
    std::fs::write(folder.path("bad.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n").unwrap();
    let schema = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/progress.schema.json");
    let schema: Value = serde_json::from_str(&std::fs::read_to_string(schema).unwrap()).unwrap();
    let mut kinds = std::collections::BTreeSet::new();
    for arguments in [
        format!("{RENDER} --spp 64 --progress json"),
        "render bad.obj --spp 1 -o bad.png --progress json".into(),
        "render scene.obj --spp 1 --size 8x8 -o a.png --tev=127.0.0.1:1 --progress json".into(),
        "bake scene.obj --vertices --spp 64 -o table.csv --progress json".into(),
    ] {
        let output = folder.run(&arguments);
        for line in String::from_utf8(output.stderr).unwrap().lines() {
            let object: Value = serde_json::from_str(line).unwrap_or_else(|_| panic!("{arguments}: {line}"));
            check(&schema, &object, line);
            kinds.insert(object["event"].as_str().unwrap().to_string());
        }
    }
    assert_eq!(kinds.into_iter().collect::<Vec<_>>(), ["message", "note", "progress"]);
}

/// Checks `value` against the part of JSON Schema that the file uses.
fn check(schema: &Value, value: &Value, line: &str) {
    if let Some(choices) = schema["oneOf"].as_array() {
        let kind = |choice: &&Value| choice["properties"]["event"]["const"] == value["event"];
        return check(choices.iter().find(kind).unwrap_or_else(|| panic!("{line}")), value, line);
    }
    let is = |kind: &str| match kind {
        "object" => value.is_object(),
        "number" => value.is_number(),
        "integer" => value.is_u64(),
        "string" => value.is_string(),
        "null" => value.is_null(),
        _ => panic!("{kind}"),
    };
    let mut kinds = schema["type"].as_array().cloned().unwrap_or_else(|| vec![schema["type"].clone()]);
    kinds.retain(|kind| !kind.is_null());
    assert!(kinds.is_empty() || kinds.iter().any(|kind| is(kind.as_str().unwrap())), "{line}: {schema}");
    let Some(object) = value.as_object() else { return };
    for required in schema["required"].as_array().into_iter().flatten() {
        assert!(object.contains_key(required.as_str().unwrap()), "{line} has no {required}");
    }
    for (name, value) in object {
        let of_name = &schema["properties"][name];
        assert!(of_name.is_object(), "{line}: {name} is not in the schema");
        check(of_name, value, line);
    }
}

#[test]
fn a_quiet_render_prints_errors_alone() {
    let folder = Folder::new("quiet");
    let output = folder.run(&format!("{RENDER} --spp 4 -q"));
    assert!(output.status.success() && output.stderr.is_empty() && output.stdout.is_empty());
    assert_eq!(folder.object(&format!("{RENDER} --spp 4 -q --json"))["spp"], 4);
    let output = folder.run("bake scene.obj --vertices --spp 4 -q -o table.csv");
    assert!(output.status.success() && output.stderr.is_empty() && output.stdout.is_empty());
    let output = folder.run("bake scene.obj --vertices --spp 4 -q");
    assert!(output.stderr.is_empty() && output.stdout.starts_with(b"x,y,z,"), "a table is a result");
    assert!(folder.refused("render none.obj -q").starts_with("error: none.obj"));
}

#[test]
fn a_continued_render_goes_on_where_its_file_is() {
    let folder = Folder::new("continue");
    folder.object("render scene.obj --size 33x20 --spp 40 -o whole.pfm --json");
    let part = |spp: u32| {
        let arguments =
            format!("render scene.obj --size 33x20 --spp {spp} -o part.pfm --continue film --json");
        folder.object(&arguments)["spp"].as_u64().unwrap() as u32
    };
    assert_eq!([13, 40].map(part), [13, 40]);
    assert!(
        std::fs::read(folder.path("whole.pfm")).unwrap() == std::fs::read(folder.path("part.pfm")).unwrap()
    );
    let said = folder.refused("render scene.obj --spp 4 -o part.pfm --shard 1/2");
    assert!(said.contains("--checkpoint <FILE>|--continue <FILE>"), "{said}");
}

#[test]
fn merged_shards_know_the_samples_of_an_error() {
    let folder = Folder::new("for-error");
    let films = |spp: u32| {
        for shard in 1..=2 {
            folder.object(&format!(
                "render scene.obj --size 64x64 --spp {spp} --method path --reconstruct off \
                 --shard {shard}/2 --checkpoint {shard}.film --json"
            ));
        }
        folder.object("merge 1.film 2.film -o merged.exr --for-error 1e-4 --json")
    };
    let needed = films(16)["spp_for_error"].as_u64().unwrap() as u32;
    assert!(needed > 16 && needed.is_multiple_of(4), "{needed}");
    // The error of the second array holds within a factor of 1.3.
    let second = films(needed);
    assert!(second["error"]["interval"][1].as_f64().unwrap() < 1.3e-4, "{needed}: {}", second["error"]);
}

#[test]
fn shells_and_manual_pages_know_all_commands() {
    let folder = Folder::new("manual");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = folder.run(&format!("completions {shell}"));
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(
            output.status.success() && ["render", "bake", "--spp"].iter().all(|word| text.contains(word))
        );
    }
    let page = String::from_utf8(folder.run("man").stdout).unwrap();
    assert!(page.contains(".TH halflight 1") && page.contains("render"));
    assert!(folder.run("man .").status.success());
    for command in ["", "-render", "-bake", "-merge", "-race", "-compare", "-info"] {
        let page = std::fs::read_to_string(folder.path(&format!("halflight{command}.1"))).unwrap();
        assert!(page.contains(".SH SYNOPSIS"), "{command}");
    }
    assert!(folder.refused("man none").contains("none"));
}
