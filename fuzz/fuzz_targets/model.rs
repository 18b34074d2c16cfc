//! Any bytes as a process model: taken by a setup, or refused with a message.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod target;

use std::sync::LazyLock;

use feedwright::Setup;

static SETUP: LazyLock<Setup> = LazyLock::new(|| {
    let text = include_str!("../../programs/pocket.setup.toml");
    Setup::from_toml(text, "/nowhere").expect("the setup of the pocket is good")
});

fn go_through(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Err(error) = SETUP.clone().with_model(text) {
        assert!(!error.to_string().is_empty() || !error.diagnostics().is_empty(), "a refusal says why");
    }
}

target::target!(go_through);
