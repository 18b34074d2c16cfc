//! Stock from files: STL meshes checked and repaired or refused, files that are damaged or too large for the memory.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod engage_common;
use engage_common::*;
use feedwright::engage::{EngageError, Options, engage};
use feedwright::machine::{Job, StockShape};
use feedwright::stock::{MeshError, read_stl};
use std::path::PathBuf;

type Triangle = [[f64; 3]; 3];

/// The twelve triangles of a box, counter-clockwise from outside.
fn cube(min: [f64; 3], max: [f64; 3]) -> Vec<Triangle> {
    let p = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { max[axis] } else { min[axis] });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    quads.iter().flat_map(|q| [[p(q[0]), p(q[1]), p(q[2])], [p(q[0]), p(q[2]), p(q[3])]]).collect()
}

fn binary(triangles: &[Triangle]) -> Vec<u8> {
    let mut out = vec![0u8; 80];
    out.extend_from_slice(&(triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        out.extend_from_slice(&[0; 12]);
        triangle.iter().flatten().for_each(|x| out.extend_from_slice(&(*x as f32).to_le_bytes()));
        out.extend_from_slice(&[0, 0]);
    }
    out
}

fn text(triangles: &[Triangle]) -> Vec<u8> {
    let mut out = String::from("solid part\n");
    for [a, b, c] in triangles {
        out += "facet normal 0 0 0\nouter loop\n";
        for p in [a, b, c] {
            out += &format!("vertex {} {} {}\n", p[0], p[1], p[2]);
        }
        out += "endloop\nendfacet\n";
    }
    (out + "endsolid part\n").into_bytes()
}

#[test]
fn both_kinds_of_stl_are_read_alike() {
    let part = cube([0.0, 0.0, -10.0], [30.0, 20.0, 0.0]);
    for bytes in [binary(&part), text(&part)] {
        let (mesh, notes) = read_stl(&bytes).unwrap();
        assert!((mesh.volume() - 6000.0).abs() < 1e-6 && notes.is_empty(), "{notes:?}");
        let field = mesh.field(0.5, &mut Vec::new()).unwrap();
        assert!((field.volume_mm3() - 6000.0).abs() < 1e-3);
    }
}

/// What files of CAD systems hold: a binary file whose header begins with `solid`, several bodies in one text, a text without a name,
/// normals that are no numbers, and lengths with more digits than an f32 has.
#[test]
fn files_are_read_as_cad_systems_write_them() {
    let [one, other] = [0.0, 100.0].map(|x| cube([x, 0.0, -10.0], [x + 30.0, 20.0, 0.0]));
    let volume = |bytes: &[u8]| read_stl(bytes).unwrap_or_else(|error| panic!("{error}")).0.volume();
    let mut headed = binary(&one);
    headed[..14].copy_from_slice(b"solid exported");
    assert!((volume(&headed) - 6000.0).abs() < 1e-6, "by its length it is binary");
    let bodies = [text(&one), text(&other)].concat();
    assert!((volume(&bodies) - 12_000.0).abs() < 1e-6, "no body is left out");
    let said = String::from_utf8(text(&one)).unwrap();
    let odd = said.replacen("solid part", "\nsolid", 1).replace("normal 0 0 0", "normal nan nan nan");
    assert!((volume(odd.as_bytes()) - 6000.0).abs() < 1e-6);
    let far = cube([4000.0001, 0.0, -10.0], [4030.0001, 20.0, 0.0]);
    let (mesh, _) = read_stl(&text(&far)).unwrap();
    let least = mesh.vertices.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
    assert!((least - 4000.0001).abs() < 1e-9, "{least}: an f32 has steps of 0.0005 mm there");
}

#[test]
fn what_can_safely_be_repaired_is_and_is_said() {
    let good = cube([0.0, 0.0, -10.0], [30.0, 20.0, 0.0]);
    let mut turned = good.clone();
    turned[3].swap(0, 1);
    let mut inward = good.clone();
    for triangle in &mut inward {
        triangle.swap(0, 1);
    }
    let mut missing = good.clone();
    missing.remove(5);
    let mut double = good.clone();
    double.push(good[2]);
    double.push([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]);
    let mut loose = good.clone();
    loose[7][1][0] += 3e-6;
    for (name, part) in
        [("turned", turned), ("inward", inward), ("missing", missing), ("double", double), ("loose", loose)]
    {
        let (mesh, notes) = read_stl(&binary(&part)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!((mesh.volume() - 6000.0).abs() < 0.01, "{name}: {}", mesh.volume());
        assert!(!notes.is_empty(), "{name}: nothing was said");
    }
}

#[test]
fn what_cannot_be_repaired_is_refused_with_the_reason() {
    let good = cube([0.0, 0.0, -10.0], [30.0, 20.0, 0.0]);
    let mut hole = good.clone();
    hole.drain(4..6);
    assert!(matches!(read_stl(&binary(&hole)), Err(MeshError::Open { open: 4, .. })));
    let mut fin = good.clone();
    fin.push([[0.0, 0.0, 0.0], [30.0, 0.0, 0.0], [15.0, 0.0, 9.0]]);
    assert!(matches!(read_stl(&binary(&fin)), Err(MeshError::Branching { .. } | MeshError::Open { .. })));
    assert!(matches!(read_stl(b"rubbish"), Err(MeshError::NotStl(_))));
    assert!(matches!(read_stl(&binary(&[])), Err(MeshError::Empty)));
    assert!(read_stl(&binary(&good)[..200]).is_err());
    // Two boxes through each other, one inside out: the crossings contradict each other.
    let mut crossed = good;
    let mut other = cube([10.0, 5.0, -5.0], [40.0, 15.0, 5.0]);
    for triangle in &mut other {
        triangle.swap(0, 1);
    }
    crossed.extend(other);
    let (mesh, _) = read_stl(&binary(&crossed)).unwrap();
    assert!(matches!(mesh.field(0.5, &mut Vec::new()), Err(MeshError::SelfIntersecting { .. })));
}

#[test]
fn overhangs_are_filled_and_said() {
    let mut part = cube([0.0, 0.0, -10.0], [30.0, 20.0, -8.0]);
    part.extend(cube([0.0, 0.0, -4.0], [30.0, 20.0, 0.0]));
    let (mesh, _) = read_stl(&binary(&part)).unwrap();
    let mut notes = Vec::new();
    let field = mesh.field(0.5, &mut notes).unwrap();
    assert!((field.volume_mm3() - 6000.0).abs() < 1e-3);
    assert!(notes.iter().any(|note| note.contains("overhangs")), "{notes:?}");
}

#[test]
fn a_million_triangles_are_read() {
    // A wavy sheet over a closed box: 2 × 500 × 500 triangles above and below, walls between.
    let n = 500usize;
    let at = |i: usize, j: usize, top: bool| {
        let (x, y) = (i as f64 * 0.1, j as f64 * 0.1);
        [x, y, if top { 2.0 + (x * 0.7).sin() * (y * 0.9).cos() } else { -5.0 }]
    };
    let mut part = Vec::with_capacity(4 * n * n + 8 * n);
    let mut quad = |a, b, c, d| part.extend([[a, b, c], [a, c, d]]);
    for j in 0..n {
        for i in 0..n {
            quad(at(i, j, true), at(i + 1, j, true), at(i + 1, j + 1, true), at(i, j + 1, true));
            quad(at(i, j, false), at(i, j + 1, false), at(i + 1, j + 1, false), at(i + 1, j, false));
        }
        quad(at(0, j, false), at(0, j, true), at(0, j + 1, true), at(0, j + 1, false));
        quad(at(n, j, false), at(n, j + 1, false), at(n, j + 1, true), at(n, j, true));
        quad(at(j, 0, false), at(j + 1, 0, false), at(j + 1, 0, true), at(j, 0, true));
        quad(at(j, n, false), at(j, n, true), at(j + 1, n, true), at(j + 1, n, false));
    }
    assert!(part.len() >= 1_000_000);
    let (mesh, notes) = read_stl(&binary(&part)).unwrap();
    assert!(notes.is_empty(), "{notes:?}");
    let field = mesh.field(0.1, &mut Vec::new()).unwrap();
    assert!((field.volume_mm3() / mesh.volume() - 1.0).abs() < 1e-4, "{} {}", field.volume_mm3(), mesh.volume());
}

fn from_file(shape: StockShape) -> Job {
    let mut job = job(vec![flat(10.0)], vec![block([0.0, -20.0, -20.0], [40.0, 20.0, 0.0])]);
    job.stocks[0].shape = shape;
    job
}

fn slot(z: f64) -> Path {
    let mut path = Path::from([-20.0, 0.0, z]);
    path.line([60.0, 0.0, z]);
    path
}

#[test]
fn a_mesh_is_cut_like_the_box_it_is() {
    let bytes = binary(&cube([0.0, -20.0, -20.0], [40.0, 20.0, 0.0]));
    let load = |_: &std::path::Path| Ok(bytes.clone());
    let options = Options { cell_mm: Some(0.2), loader: Some(&load), ..Options::default() };
    let job = from_file(StockShape::Stl(PathBuf::from("part.stl")));
    let map = engage(&slot(-3.0).toolpath, &job, &options, &|_| {}).unwrap();
    assert!((map.removed_mm3 / 1200.0 - 1.0).abs() < 1e-3);
    assert!((volume_of(&map, 0) / 1200.0 - 1.0).abs() < 3e-3, "{}", volume_of(&map, 0));
}

#[test]
fn a_damaged_or_missing_stock_file_is_told() {
    let job = from_file(StockShape::Saved(PathBuf::from("op10.stock")));
    for (bytes, said) in [(&b"FWSTOCK2 not really"[..], "cut short"), (b"FWSTOCK1", "another version")] {
        let load = |_: &std::path::Path| Ok(bytes.to_vec());
        let options = Options { loader: Some(&load), ..Options::default() };
        let error = engage(&slot(-3.0).toolpath, &job, &options, &|_| {}).unwrap_err();
        let text = error.to_string();
        let told = text.contains("op10.stock") && text.contains(said);
        assert!(matches!(&error, EngageError::StockFile { .. }) && told, "{text}");
    }
    let load = |_: &std::path::Path| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    let options = Options { loader: Some(&load), ..Options::default() };
    assert!(engage(&slot(-3.0).toolpath, &job, &options, &|_| {}).is_err());
}

#[test]
fn a_field_that_does_not_fit_names_the_resolution_that_does() {
    let job = from_file(job(vec![flat(10.0)], vec![block([0.0; 3], [300.0, 200.0, 10.0])]).stocks[0].shape.clone());
    let fine = Options { cell_mm: Some(0.01), max_memory_bytes: Some(64 << 20), ..Options::default() };
    let error = engage(&slot(-3.0).toolpath, &job, &fine, &|_| {}).unwrap_err();
    let EngageError::Memory { fits_mm, needed_mib, .. } = error else { panic!("{error}") };
    assert!(needed_mib > 4000 && fits_mm > 0.05 && fits_mm < 0.12, "{needed_mib} {fits_mm}");
    let coarse = Options { cell_mm: Some(fits_mm), ..fine };
    assert!(engage(&slot(-3.0).toolpath, &job, &coarse, &|_| {}).is_ok());
    for cell in [0.0, -1.0, f64::NAN] {
        let bad = Options { cell_mm: Some(cell), ..Options::default() };
        assert!(matches!(engage(&slot(-3.0).toolpath, &job, &bad, &|_| {}), Err(EngageError::BadCell(_))));
    }
}

/// A finishing cut of 0.25 mm along the wall of a casting that stands on a flange, in cells of a third of a millimetre: the wall is where it is, or
/// up to an eighth of a cell further out, wherever it lies among the cells.
#[test]
fn walls_of_a_mesh_are_cut_as_deep_as_they_stand_out() {
    let (ae, depth) = (0.25, 10.0);
    for wall in [0.0, 0.1, 0.2, 0.3] {
        let flange = cube([0.0, -10.0, -20.0], [60.0, 50.0, -12.0]);
        let block = cube([0.0, wall, -13.0], [60.0, 40.0, 0.0]);
        let bytes = binary(&[flange, block].concat());
        let mut job = job(vec![flat(10.0)], vec![engage_common::block([0.0; 3], [1.0; 3])]);
        job.stocks[0].shape = StockShape::Stl(PathBuf::from("casting.stl"));
        let load = |_: &std::path::Path| Ok(bytes.clone());
        let options = Options { cell_mm: Some(1.0 / 3.0), spacing_mm: 1.0, loader: Some(&load), ..Options::default() };
        let mut path = Path::from([-10.0, wall + ae - 5.0, -depth]);
        path.line([70.0, wall + ae - 5.0, -depth]);
        let map = engage(&path.toolpath, &job, &options, &|_| {}).unwrap();
        let section = stations(&map, 0).iter().find(|station| station.to_mm > 40.0).unwrap().removal_area_mm2;
        let ratio = f64::from(section) / (ae * depth);
        assert!((0.99..1.2).contains(&ratio), "{wall}: {ratio}");
    }
}
