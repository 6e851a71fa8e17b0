//! Scene files: any bytes give a scene description, or an error that names a line of the file.

use halflight::load::scene_file;
use std::path::Path;

/// One input.
pub fn run(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    if let Err(error) = scene_file::parse(&text, Path::new("fuzz.toml")) {
        assert!(!error.to_string().is_empty());
    }
}
