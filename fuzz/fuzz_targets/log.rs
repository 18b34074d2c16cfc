//! Any bytes as a measured log and as a table, CSV, SHDR or workbook: samples in the order of time with finite numbers, or a message.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod target;

use feedwright::learn::log::{columns, read_any_log, read_log};

fn go_through(data: &[u8]) {
    for log in [read_any_log(data, &[]), read_log(data, &[])].into_iter().flatten() {
        assert!(log.time_s.iter().all(|time| time.is_finite()), "times are numbers");
        assert!(log.time_s.windows(2).all(|pair| pair[0] <= pair[1]), "times go on");
    }
    if let Err(error) = columns::read(data, &[]) {
        assert!(!error.to_string().is_empty(), "a refusal says why");
    }
}

target::target!(go_through);
