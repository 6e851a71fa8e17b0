//! libFuzzer entry point of [`halflight_fuzz::chains`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::chains::run(data));
