//! libFuzzer entry point of [`halflight_fuzz::scene_file`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::scene_file::run(data));
