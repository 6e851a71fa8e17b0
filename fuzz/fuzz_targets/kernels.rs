//! libFuzzer entry point of [`halflight_fuzz::kernels`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| halflight_fuzz::kernels::run(data));
