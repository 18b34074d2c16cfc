//! The cache gives back the map it was made from, and nothing when it is damaged or stale; threads change nothing.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod engage_common;
use engage_common::*;
use feedwright::engage::cache::{Unusable, from_bytes, key, to_bytes};
use feedwright::engage::{EngagementMap, Options};
use feedwright::machine::{AirFeed, Box3, Job, Profile, Shape, StockShape};
use feedwright::path::Vec3;

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

/// A change of a job.
type Change = fn(&mut Job);

/// Everything of the setup that the simulation reads changes the key, each thing to one of its own.
#[test]
fn every_input_of_the_simulation_is_in_the_key() {
    let path = raster(3);
    let changes: [(&str, Change); 20] = [
        ("nothing", |_| ()),
        ("cell", |job| job.cell_mm = Some(0.3)),
        ("a work offset", |job| job.machine.offsets.push((55, Vec3::new(1.0, 0.0, 0.0)))),
        ("a fixture", |job| job.fixtures.push(Box3 { min: Vec3::zeros(), max: Vec3::repeat(1.0) })),
        ("clearance", |job| job.air_feed = Some(AirFeed { feed_mm_s: 50.0, approach_mm: 3.0 })),
        ("number", |job| job.tools[0].number += 1),
        ("kind", |job| job.tools[0].shape = Shape::Bull),
        ("outline", |job| job.tools[0].profile = Profile::ball(6.0, 20.5)),
        ("flute length", |job| job.tools[0].flute_length_mm += 1.0),
        ("flute length given", |job| job.tools[0].flute_length_given ^= true),
        ("overhang", |job| job.tools[0].overhang_mm += 1.0),
        ("shank", |job| job.tools[0].shank_diameter_mm += 1.0),
        ("centre cutting", |job| job.tools[0].centre_cutting ^= true),
        ("holder", |job| job.tools[0].holder.push((32.0, 40.0))),
        ("a tool more", |job| job.tools.push(job.tools[0].clone())),
        ("blank", |job| {
            job.stocks[0].shape = StockShape::Cylinder { centre: [0.0; 2], diameter_mm: 30.0, z_mm: [-20.0, 0.0] }
        }),
        ("offset of the blank", |job| job.stocks[0].offset = Some(54)),
        ("place of the blank", |job| job.stocks[0].moved_mm.x += 0.1),
        ("allowance of the blank", |job| job.stocks[0].uncertainty_mm += 0.1),
        ("a blank more", |job| job.stocks.push(job.stocks[0].clone())),
    ];
    let keys = changes.map(|(what, change)| {
        let mut job = setup();
        change(&mut job);
        (what, key(&path.toolpath, &job, &Options::default()))
    });
    for (k, (what, one)) in keys.iter().enumerate() {
        let same: Vec<&str> = keys[..k].iter().filter(|(_, other)| other == one).map(|(what, _)| *what).collect();
        assert!(same.is_empty(), "{what} has the key of {same:?}");
    }
    let again = key(&path.toolpath, &setup(), &Options::default());
    assert_eq!(again, keys[0].1, "the same input, the same key");
}

#[test]
fn a_file_of_stock_is_in_the_key_by_its_bytes() {
    let mut job = setup();
    job.stocks[0].shape = StockShape::Stl("casting.stl".into());
    let of = |bytes: &'static [u8]| {
        let load = move |_: &std::path::Path| std::io::Result::Ok(bytes.to_vec());
        key(&raster(3).toolpath, &job, &Options { loader: Some(&load), ..Options::default() })
    };
    assert_eq!(of(b"solid a"), of(b"solid a"));
    assert_ne!(of(b"solid a"), of(b"solid b"));
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
