//! libFuzzer entry point of [`halflight_fuzz::photons`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::photons::run(data));
