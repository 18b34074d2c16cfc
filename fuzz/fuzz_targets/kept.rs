//! Any bytes as a cache of the engagement (first byte even) and as saved stock (odd), made whole by their mark and hash, as the hash
//! would tell a change at once: what is read can be saved and read again.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod target;

use feedwright::bytes::seal;
use feedwright::engage::cache;
use feedwright::path::Vec3;
use feedwright::stock::saved;

const KEY: cache::Key = [7; 32];

fn go_through(data: &[u8]) {
    let Some((first, rest)) = data.split_first() else { return };
    let _ = (cache::from_bytes(rest, &KEY), saved::from_bytes(rest, Vec3::zeros()));
    if first % 2 == 0 {
        let mut bytes = [b"FWENGMAP", &KEY[..], rest].concat();
        seal(&mut bytes);
        if let Ok(map) = cache::from_bytes(&bytes, &KEY) {
            let again = cache::to_bytes(&map, &KEY);
            assert!(cache::from_bytes(&again, &KEY).is_ok(), "what was read can be kept again");
        }
    } else {
        let mut bytes = [&saved::MARK[..], rest].concat();
        seal(&mut bytes);
        if let Some(piece) = saved::from_bytes(&bytes, Vec3::zeros()) {
            let again = saved::to_bytes(&piece, Vec3::zeros());
            assert!(saved::from_bytes(&again, Vec3::zeros()).is_some(), "what was read can be saved again");
        }
    }
}

target::target!(go_through);
