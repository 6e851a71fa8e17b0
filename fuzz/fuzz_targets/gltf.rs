//! libFuzzer entry point of [`halflight_fuzz::gltf`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::gltf::run(data));
