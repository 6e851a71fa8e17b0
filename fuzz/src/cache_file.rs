//! Irradiance cache files: any bytes are a cache or an error with a reason. A cache has no more records than
//! its bytes hold.

use halflight::render::inspect_cache;

/// Bytes of a record in a file.
const RECORD: usize = 160;

/// One input.
pub fn run(data: &[u8]) {
    match inspect_cache(data) {
        Ok([even, odd]) => assert!((even + odd) * RECORD <= data.len()),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}
