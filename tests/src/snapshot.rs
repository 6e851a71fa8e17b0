//! Snapshots: files of expected results beside the tests.
//!
//! ```text
//! SNAPSHOT=write cargo test --profile quick -p halflight-tests --test main MODULE::
//! ```
//!
//! rewrites those of the tests that it runs. A commit that changes a snapshot says why.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// True if the tests that run write their snapshots.
pub fn is_written() -> bool {
    env::var_os("SNAPSHOT").is_some_and(|value| value == "write")
}

/// Path of a snapshot.
pub fn path(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(file)
}

/// Writes `now` to the snapshot, or compares both.
///
/// # Panics
/// If lines differ, or the file cannot be written.
pub fn check(file: &str, now: &str) {
    if is_written() {
        fs::write(path(file), now).expect("the snapshot can be written");
        return;
    }
    let before = fs::read_to_string(path(file)).unwrap_or_default();
    assert!(now == before, "{file} differs:\n{}", differences(&before, now));
}

/// Lines of either text that the other lacks.
fn differences(before: &str, now: &str) -> String {
    let only = |text: &str, other: &str, mark: &str| -> String {
        let lines = text.lines().filter(|line| !other.lines().any(|other| other == *line));
        lines.map(|line| format!("{mark} {line}\n")).collect()
    };
    only(before, now, "-") + &only(now, before, "+")
}

#[cfg(test)]
mod tests {
    use super::differences;

    #[test]
    fn differences_are_the_lines_of_one_text_alone() {
        assert_eq!(differences("a = 1\nb = 2\n", "b = 3\na = 1\nc = 4\n"), "- b = 2\n+ b = 3\n+ c = 4\n");
        assert_eq!(differences("a\n", "a\n"), "");
    }
}
