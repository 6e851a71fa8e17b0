//! libFuzzer entry point of [`halflight_fuzz::mtl`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::mtl::run(data));
