//! Path-traced references in `tests/tests/references.txt`: means of values over independent pictures, with
//! their standard errors.
//!
//! ```text
//! SNAPSHOT=write cargo test --profile quick -p halflight-tests --test main
//! ```
//!
//! renders those of the tests that it runs anew. A scene that changes needs it.

use crate::snapshot;
use crate::statistics::Estimates;
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::Mutex;

/// The reference of that name; `pictures` renders values of independent pictures if it is to be written.
///
/// # Panics
/// If the file has no such reference, or cannot be read or written.
pub fn reference(name: &str, pictures: impl FnOnce() -> Vec<Vec<f64>>) -> Estimates {
    if snapshot::is_written() {
        write(name, &Estimates::of(&pictures()));
    }
    let rows = read();
    let row = rows.get(name).unwrap_or_else(|| panic!("no reference {name}: SNAPSHOT=write makes one"));
    parse(row).unwrap_or_else(|| panic!("the reference {name} is damaged"))
}

fn file() -> PathBuf {
    snapshot::path("references.txt")
}

/// Rows of the file by name.
fn read() -> BTreeMap<String, String> {
    let text = fs::read_to_string(file()).unwrap_or_default();
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    rows.filter_map(|line| line.split_once(" = ")).map(|(name, row)| (name.into(), row.into())).collect()
}

/// Replaces or adds one row. Tests run at the same time.
fn write(name: &str, estimates: &Estimates) {
    static FILE: Mutex<()> = Mutex::new(());
    let _guard = FILE.lock().expect("no panic holds it");
    let mut rows = read();
    rows.insert(name.to_owned(), format(estimates));
    let mut text = "# name = number of pictures, then mean and standard error of each value\n".to_owned();
    rows.iter().for_each(|(name, row)| text += &format!("{name} = {row}\n"));
    fs::write(file(), text).expect("references can be written");
}

fn format(estimates: &Estimates) -> String {
    let mut text = estimates.pictures.to_string();
    for (mean, variance) in &estimates.moments {
        text += &format!(" {mean:.5e}~{:.1e}", variance.sqrt());
    }
    text
}

fn parse(row: &str) -> Option<Estimates> {
    let mut words = row.split(' ');
    let pictures = words.next()?.parse().ok()?;
    let moment = |word: &str| {
        let (mean, error) = word.split_once('~')?;
        Some((mean.parse().ok()?, error.parse::<f64>().ok()?.powi(2)))
    };
    Some(Estimates { pictures, moments: words.map(moment).collect::<Option<_>>()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_keep_means_and_errors() {
        let estimates = Estimates { pictures: 8, moments: vec![(0.25, 1e-6), (0.0, 0.0)] };
        assert_eq!(parse(&format(&estimates)).map(|row| row.pictures), Some(8));
        let row = parse("8 0.25~1e-3 0~0e0").expect("a row");
        assert_eq!(row.moments[0].0, 0.25);
        assert!((row.moments[0].1 - 1e-6).abs() < 1e-12);
        assert!(parse("8 0.25").is_none() && parse("").is_none());
    }
}
