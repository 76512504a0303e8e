#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| misclosure_fuzz::descriptor::run(data));
