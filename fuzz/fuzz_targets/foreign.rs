#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| misclosure_fuzz::foreign::run(data));
