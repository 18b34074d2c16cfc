//! What every target needs: libFuzzer where it is built in, else a `main` that replays files.

/// Makes a target of a function over bytes.
macro_rules! target {
    ($function:ident) => {
        #[cfg(feature = "libfuzzer")]
        libfuzzer_sys::fuzz_target!(|data: &[u8]| $function(data));

        #[cfg(not(feature = "libfuzzer"))]
        fn main() {
            for file in std::env::args().skip(1) {
                $function(&std::fs::read(&file).expect("the file can be read"));
            }
        }
    };
}
pub(crate) use target;
