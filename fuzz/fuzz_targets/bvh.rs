//! libFuzzer entry point of [`halflight_fuzz::bvh`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::bvh::run(data));
