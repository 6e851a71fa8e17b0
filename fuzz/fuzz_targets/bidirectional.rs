//! libFuzzer entry point of [`halflight_fuzz::bidirectional`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::bidirectional::run(data));
