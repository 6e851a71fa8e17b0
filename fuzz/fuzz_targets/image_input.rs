//! libFuzzer entry point of [`halflight_fuzz::image_input`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::image_input::run(data));
