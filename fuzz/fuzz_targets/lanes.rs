//! libFuzzer entry point of [`halflight_fuzz::lanes`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::lanes::run(data));
