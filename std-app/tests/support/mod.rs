//! Shared parts of tests of the program: a folder with a scene, and functions that run the program in it.

use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Output};

/// A lamp over a floor.
const SCENE: &str = "mtllib scene.mtl\n\
    v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
    usemtl floor\nf 4 3 2 1\nusemtl lamp\nf 5 6 7 8\n";
const MATERIALS: &str = "newmtl floor\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n";

/// A folder for one test with the scene in it, removed if the test passes.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("halflight-cli-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("scene.obj"), SCENE).unwrap();
        std::fs::write(folder.join("scene.mtl"), MATERIALS).unwrap();
        Self(folder)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub(crate) fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_halflight"));
        command.current_dir(&self.0).args(arguments.split_whitespace());
        command
    }

    pub(crate) fn run(&self, arguments: &str) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Runs a command that must succeed, and returns the JSON object that it prints.
    pub(crate) fn object(&self, arguments: &str) -> Value {
        let output = self.run(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {said}");
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// The object that the page of a report holds.
    pub(crate) fn page_object(&self, report: &str) -> Value {
        let page = std::fs::read_to_string(self.path(report).join("index.html")).unwrap();
        let rest = page.split_once("id=\"object\">").unwrap().1;
        serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
    }

    /// Runs a command that must be refused with exit code 2, and returns its messages.
    pub(crate) fn refused(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
        assert!(output.stdout.is_empty(), "{arguments}: results go to stdout, complaints do not");
        assert!(!said.contains("panicked"), "{said}");
        said
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }
}
