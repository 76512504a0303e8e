#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| misclosure_fuzz::run_folder::run(data));
