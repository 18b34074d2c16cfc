//! The cache gives back the map it was made from, and nothing when it is damaged or stale; threads change nothing.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod engage_common;
use engage_common::*;
use feedwright::engage::cache::{Unusable, from_bytes, key, to_bytes};
use feedwright::engage::{EngagementMap, Options};
use feedwright::machine::Job;

fn raster(rows: usize) -> Path {
    let mut path = Path::from([0.0, 0.0, 5.0]);
    for row in 0..rows {
        let y = 0.4 * row as f64;
        for k in 0..=100 {
            let x = if row % 2 == 0 { 0.3 * k as f64 } else { 30.0 - 0.3 * k as f64 };
            path.line([x, y, -2.0 + (x * 0.3).sin() * (y * 0.2).cos()]);
        }
    }
    path.turn([15.0, 3.0], 5.0, -2.0).rapid([0.0, 0.0, 20.0]);
    path
}

fn setup() -> Job {
    job(vec![ball(6.0)], vec![block([0.0, 0.0, -20.0], [30.0, 25.0, 0.0])])
}

fn equal(a: &EngagementMap, b: &EngagementMap) -> bool {
    let bits = |map: &EngagementMap| to_bytes(map, &[0; 32]);
    bits(a) == bits(b)
}

#[test]
fn the_map_comes_back_bit_for_bit() {
    let (path, job) = (raster(30), setup());
    let map = run(&path, &job, 0.2, 1.0);
    let key = key(&path.toolpath, &job, &Options::default());
    let back = from_bytes(&to_bytes(&map, &key), &key).unwrap();
    assert_eq!(back.stations, map.stations);
    assert_eq!(back.arcs, map.arcs);
    assert_eq!(back.of_move, map.of_move);
    assert_eq!(back.slices, map.slices);
    assert_eq!(back.events, map.events);
    assert!(equal(&back, &map));
}

#[test]
fn damage_and_staleness_are_told_apart() {
    let (path, mut job) = (raster(3), setup());
    let map = run(&path, &job, 0.2, 1.0);
    let old = key(&path.toolpath, &job, &Options::default());
    let bytes = to_bytes(&map, &old);
    for at in [0, 9, 45, bytes.len() / 2, bytes.len() - 1] {
        let mut bad = bytes.clone();
        bad[at] ^= 0x10;
        assert_eq!(from_bytes(&bad, &old).unwrap_err(), Unusable::Damaged, "byte {at}");
    }
    for length in [0, 31, 100, bytes.len() - 1] {
        assert_eq!(from_bytes(&bytes[..length], &old).unwrap_err(), Unusable::Damaged);
    }
    // Limits do not change the key, geometry does.
    job.limits.power_w = Some(17.0);
    assert_eq!(key(&path.toolpath, &job, &Options::default()), old);
    job.tools[0].overhang_mm += 1.0;
    let new = key(&path.toolpath, &job, &Options::default());
    assert_eq!(from_bytes(&bytes, &new).unwrap_err(), Unusable::Stale);
    assert_ne!(key(&raster(4).toolpath, &setup(), &Options::default()), old);
    let finer = Options { cell_mm: Some(0.05), ..Options::default() };
    assert_ne!(key(&path.toolpath, &setup(), &finer), old);
}

#[test]
fn one_two_and_seven_threads_agree_bit_for_bit() {
    let (path, job) = (raster(60), setup());
    let with = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| run(&path, &job, 0.1, 0.5))
    };
    let one = with(1);
    assert!(one.arcs.len() > 1000);
    assert!(equal(&one, &with(2)));
    assert!(equal(&one, &with(7)));
}
