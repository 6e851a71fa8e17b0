//! libFuzzer entry point of [`halflight_fuzz::sampling`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::sampling::run(data));
