//! libFuzzer entry point of [`halflight_fuzz::radiance`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::radiance::run(data));
