//! libFuzzer entry point of [`halflight_fuzz::derivatives`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::derivatives::run(data));
