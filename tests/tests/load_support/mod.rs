//! Small files on disk for tests of loading.

use core::sync::atomic::{AtomicU32, Ordering};
use halflight::load::{LoadError, LoadOptions, LoadedScene, load};
use std::fs;
use std::path::PathBuf;

/// A directory of small files that is removed with the test.
pub(crate) struct Files(PathBuf);

impl Files {
    pub(crate) fn new(files: &[(&str, &[u8])]) -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let name = format!("halflight-load-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let directory = std::env::temp_dir().join(name);
        fs::create_dir_all(&directory).unwrap();
        for (name, bytes) in files {
            let file = directory.join(name);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, bytes).unwrap();
        }
        Self(directory)
    }

    pub(crate) fn load(&self, name: &str) -> Result<LoadedScene, LoadError> {
        self.load_with(name, &LoadOptions::default())
    }

    pub(crate) fn load_with(&self, name: &str, options: &LoadOptions) -> Result<LoadedScene, LoadError> {
        load(&self.0.join(name), options)
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A bitmap of 1 by 1 pixels.
pub(crate) fn bmp(rgb: [u8; 3]) -> Vec<u8> {
    let mut bytes = b"BM".to_vec();
    for word in [58u32, 0, 54, 40, 1, 1, 1 | 24 << 16, 0, 4, 2835, 2835, 0, 0] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend([rgb[2], rgb[1], rgb[0], 0]);
    bytes
}
