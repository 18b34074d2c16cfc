//! Any bytes as a setup file, in a folder that holds nothing: a job, or a message for each thing that is wrong.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod target;

use feedwright::Setup;

fn go_through(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Err(error) = Setup::from_toml(text, "/nowhere") {
        assert!(!error.to_string().is_empty() || !error.diagnostics().is_empty(), "a refusal says why");
    }
}

target::target!(go_through);
