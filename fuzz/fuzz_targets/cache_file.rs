//! libFuzzer entry point of [`halflight_fuzz::cache_file`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::cache_file::run(data));
