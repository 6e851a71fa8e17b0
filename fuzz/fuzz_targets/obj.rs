//! libFuzzer entry point of [`halflight_fuzz::obj`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::obj::run(data));
