//! Files of irradiance caches: any bytes are a cache, or give a reason why they are none. What is read fits into the
//! bytes that were there.

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
