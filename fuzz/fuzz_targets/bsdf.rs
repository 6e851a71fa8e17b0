//! libFuzzer entry point of [`halflight_fuzz::bsdf`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::bsdf::run(data));
