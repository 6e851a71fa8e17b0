//! libFuzzer entry point of [`halflight_fuzz::records`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::records::run(data));
