//! Outputs to pipes, and files that become unwritable during a render.

use crate::support::Folder;
use core::time::Duration;
use halflight::picture::decode;
use halflight::save::{Image, read};
use std::fs::{self, File};
use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::Instant;

/// A named pipe.
fn pipe(folder: &Folder, name: &str) -> PathBuf {
    let path = folder.path(name);
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    path
}

/// All bytes of a pipe, read by a thread that starts after `delay` milliseconds.
fn reader(path: PathBuf, delay: u64) -> JoinHandle<Vec<u8>> {
    spawn(move || {
        sleep(Duration::from_millis(delay));
        let mut bytes = Vec::new();
        File::open(path).unwrap().read_to_end(&mut bytes).unwrap();
        bytes
    })
}

/// Sends a signal by the shell's built-in command: not every machine has the program `kill`.
fn signal(child: &Child, name: &str) {
    let kill = format!("kill -{name} {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn pipes_get_what_they_are_named_for() {
    let folder = Folder::new("pipes");
    let picture = reader(pipe(&folder, "a.png"), 0);
    // Late, but before the longest wait is over.
    let film = reader(pipe(&folder, "film"), 1000);
    let cache = reader(pipe(&folder, "cache"), 0);
    folder.object(
        "render scene.obj --method irradiance-cache --size 16x16 --spp 16 -o a.png -o b.png --checkpoint film \
         --checkpoint-every 1ms --save-cache cache --json",
    );
    let picture = Image::from(decode(&picture.join().unwrap(), "f.png".as_ref(), 1 << 24).unwrap());
    assert_eq!(picture, read(&folder.path("b.png")).unwrap());
    fs::write(folder.path("kept.film"), film.join().unwrap()).unwrap();
    fs::write(folder.path("kept.cache"), cache.join().unwrap()).unwrap();
    let again = folder.object(
        "render scene.obj --method irradiance-cache --size 16x16 --spp 1 -o c.png --load-cache kept.cache --json",
    );
    assert_eq!(again["findings"]["irradiance_cache"]["gathered"], 0);
    assert_eq!(folder.object("merge kept.film -o d.png --json")["spp"], 16);
    assert_eq!(picture, read(&folder.path("d.png")).unwrap());

    let page = reader(pipe(&folder, "run.json"), 0);
    folder.object("render scene.obj --size 8x8 --spp 1 -o e.png --report . --json");
    assert!(page.join().unwrap().starts_with(b"{"));
}

#[test]
fn a_pipe_that_nobody_reads_costs_nothing_else() {
    let folder = Folder::new("nobody");
    pipe(&folder, "a.png");
    let start = Instant::now();
    let mut command = folder.command("render scene.obj --size 8x8 --spp 1 -o a.png -o b.png");
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while !folder.path("b.png").exists() {
        sleep(Duration::from_millis(10));
        assert!(child.try_wait().unwrap().is_none(), "files are written before it waits");
    }
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(
        words(&output).contains("a.png") && words(&output).contains("nobody reads"),
        "{}",
        words(&output)
    );
    assert!(read(&folder.path("b.png")).is_ok());
    assert!(start.elapsed() < Duration::from_secs(60));
}

#[test]
fn a_reader_that_stops_reading_can_be_given_up() {
    let folder = Folder::new("stalled");
    let path = pipe(&folder, "a.pfm");
    let mut command = folder.command("render scene.obj --size 256x256 --spp 1 -o a.pfm -o b.png");
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The open blocks until the render opens the pipe for writing, at its end.
    let _stalled = File::open(path).unwrap();
    sleep(Duration::from_secs(1));
    signal(&child, "TERM");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("stopped reading"), "{}", words(&output));
    assert!(read(&folder.path("b.png")).is_ok());
}

#[test]
fn a_reader_that_leaves_is_named() {
    let folder = Folder::new("leaves");
    let path = pipe(&folder, "a.pfm");
    let reader = spawn(move || File::open(path).unwrap().read_exact(&mut [0; 100]));
    let output = folder.run("render scene.obj --size 256x256 --spp 1 -o a.pfm -o b.png");
    reader.join().unwrap().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("a.pfm: cannot be written: its reader is gone"), "{}", words(&output));
    assert!(read(&folder.path("b.png")).is_ok());
}

/// A render of about three seconds whose folder of checkpoints vanishes after the first write.
fn without_its_folder(folder: &Folder, arguments: &str, comes_back: bool) -> Output {
    fs::create_dir(folder.path("sub")).unwrap();
    let mut command = folder.command(&format!("render scene.obj -o a.png --json --size 32x32 {arguments}"));
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while !folder.path("sub/c.film").exists() {
        sleep(Duration::from_millis(10));
    }
    fs::rename(folder.path("sub"), folder.path("away")).unwrap();
    sleep(Duration::from_millis(1500));
    if comes_back {
        fs::rename(folder.path("away"), folder.path("sub")).unwrap();
    }
    child.wait_with_output().unwrap()
}

#[test]
fn a_checkpoint_that_fails_is_said_and_the_render_goes_on() {
    let arguments = "--time 3s --checkpoint sub/c.film --checkpoint-every 100ms";
    let folder = Folder::new("away");
    let output = without_its_folder(&folder, arguments, false);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("note: sub/c.film").count(), 1, "said once: {said}");
    assert_eq!(said.matches("error: sub/c.film").count(), 1, "{said}");
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&object["ending"], &object["outputs"][0]), (&"done".into(), &"a.png".into()));
    folder.object("merge away/c.film -o b.png --json");

    let folder = Folder::new("back");
    let output = without_its_folder(&folder, arguments, true);
    assert_eq!(output.status.code(), Some(0), "the last is there: {}", words(&output));
    assert!(words(&output).contains("note: sub/c.film"));
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(folder.object("merge sub/c.film -o b.png --json")["paths"], object["paths"]);
}

#[test]
fn signals_while_files_are_written_leave_them_whole() {
    let folder = Folder::new("signals");
    let outputs = ["a.exr", "a.png", "a.hdr", "a.pfm"];
    for wait in [0, 40, 90, 200] {
        let named: String = outputs.iter().map(|output| format!(" -o {output}")).collect();
        let mut command = folder.command(&format!("render scene.obj --size 1024x1024 --spp 1{named}"));
        let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        // The first file is being written, or about to be.
        let begins = |entry: fs::DirEntry| {
            let is_first = entry.file_name().to_string_lossy().contains("a.exr");
            is_first && entry.metadata().is_ok_and(|data| data.len() > 0)
        };
        while !fs::read_dir(&folder.0).unwrap().flatten().any(begins) {
            sleep(Duration::from_millis(1));
        }
        sleep(Duration::from_millis(wait));
        signal(&child, "TERM");
        let output = child.wait_with_output().unwrap();
        assert!([Some(0), Some(3)].contains(&output.status.code()), "{output:?}");
        for output in outputs {
            assert_eq!(read(&folder.path(output)).unwrap().pixels.len(), 1024 * 1024, "{output}");
            fs::remove_file(folder.path(output)).unwrap();
        }
    }
}
