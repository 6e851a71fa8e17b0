//! libFuzzer entry point of [`halflight_fuzz::splats`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::splats::run(data));
