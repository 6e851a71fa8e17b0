//! The program as a process: signals that it inherits, and threads that it starts.

use crate::support::Folder;
use core::time::Duration;
use std::fs;
use std::process::{Command, Stdio};

/// As `nohup` and the shell do for commands in the background.
#[test]
fn signals_that_are_ignored_at_the_start_stay_ignored() {
    let folder = Folder::new("ignored");
    // The film appears after the first round.
    let script = "trap '' HUP INT TERM
        $H render scene.obj -o a.png --size 64x64 --time 1s --checkpoint film --json > out 2> err &
        while ! test -e film; do sleep 0.02; done
        kill -HUP $!; kill -INT $!; kill -TERM $!; wait $!";
    let mut shell = Command::new("sh");
    shell.current_dir(&folder.0).env("H", env!("CARGO_BIN_EXE_halflight")).args(["-c", script]);
    assert_eq!(shell.status().unwrap().code(), Some(0));
    let object: serde_json::Value = serde_json::from_slice(&fs::read(folder.path("out")).unwrap()).unwrap();
    assert_eq!((&object["ending"], &object["stop_rule"]), (&"done".into(), &"time".into()));
    assert_eq!(fs::read_to_string(folder.path("err")).unwrap(), "");
}

#[test]
fn a_command_starts_the_threads_that_it_says() {
    let folder = Folder::new("threads");
    folder.object("render scene.obj -o r.pfm --size 32x32 --spp 1 --json");
    let render = "render scene.obj -o a.exr --size 32x32 --time 300ms --reference r.pfm --report out";
    for threads in [1, 2] {
        let mut command = folder.command(&format!("{render} --threads {threads}"));
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let tasks = format!("/proc/{}/task", child.id());
        let mut most = 0;
        while child.try_wait().unwrap().is_none() {
            most = most.max(fs::read_dir(&tasks).map_or(0, Iterator::count));
            std::thread::sleep(Duration::from_millis(1));
        }
        // The pool, the main thread that waits for it, and the one that waits for Ctrl-C.
        assert!((2..=threads + 2).contains(&most), "{most} of {threads} threads");
    }
}
