//! libFuzzer entry point of [`halflight_fuzz::shading`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::shading::run(data));
