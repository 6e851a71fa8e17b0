//! libFuzzer entry point of [`halflight_fuzz::lights`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::lights::run(data));
