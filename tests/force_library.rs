//! The built-in library: every entry loads, says where it comes from, and gives a cutter.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

use feedwright::force::Cutter;
use feedwright::machine::material::{ForceModel, LinearEdge};
use feedwright::setup::{library, load};
use std::path::Path;

fn setup(material: &str, machine: &str) -> String {
    format!(
        "machine = \"{machine}\"\n[stock]\nmaterial = \"{material}\"\nbox = {{ min = [0, 0, -10], max = [50, 50, 0] }}\n\
         [[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 10\nflutes = 3\nmaterial = \"carbide\"\n"
    )
}

#[test]
fn every_material_and_machine_loads() {
    for entry in library::materials() {
        assert!(entry.source.len() > 20 && entry.uncertainty > 0.0, "{}", entry.name);
        let (job, assumptions) = load(&setup(&entry.name, "small-vmc"), Path::new(".")).expect(&entry.name);
        let tool = &job.tools[0];
        let material = job.material(tool).expect(&entry.name);
        assert_eq!(material.uncertainty, Some(entry.uncertainty));
        let slices = tool.profile.slices(0.5);
        Cutter::new(tool, material, &job.machine.spindle, &job.process, &slices, 100.0).expect(&entry.name);
        assert!(assumptions.iter().any(|assumption| assumption.source == "library"), "{}", entry.name);
    }
    for entry in library::machines() {
        assert!(!entry.source.is_empty() && entry.uncertainty > 0.0);
        let (job, _) = load(&setup("aluminium", &entry.name), Path::new(".")).expect(&entry.name);
        assert!(job.machine.spindle.max_rps > 100.0);
        let inch = format!("units = \"inch\"\n{}", setup("aluminium", &entry.name));
        let (in_inch, _) = load(&inch, Path::new(".")).expect(&entry.name);
        assert_eq!(in_inch.machine.axes, job.machine.axes, "{}", entry.name);
    }
    for entry in library::tool_materials() {
        assert!(entry.youngs_modulus_mpa > 1e5 && entry.bending_stress_mpa > 100.0 && !entry.source.is_empty());
    }
}

#[test]
fn the_tangent_lies_above_the_published_curve() {
    let (job, _) = load(&setup("aluminium", "small-vmc"), Path::new(".")).expect("loads");
    let ForceModel::LinearEdge(k) = job.material(&job.tools[0]).expect("has one").model else {
        panic!("a linear edge model")
    };
    for h in [0.001, 0.01, 0.05, 0.1, 0.3] {
        let (line, curve) = (k.k_tc * h + k.k_te, 800.0 * f64::powf(h, 0.75));
        assert!(line >= curve * (1.0 - 1e-12), "{h}: {line} {curve}");
        assert!(h != 0.05 || (line / curve - 1.0).abs() < 1e-12);
    }
    // Conservative: above what was measured on 6061-T6.
    assert!(k.k_tc > 843.2 && k.k_te > 18.98);
}

#[test]
fn a_name_that_is_not_there_is_answered_with_the_nearest() {
    let error = load(&setup("aluminum-6061-t6", "small-vmc"), Path::new(".")).expect_err("no such material");
    assert!(format!("{error:?}").contains("aluminium-6061-t6"), "{error:?}");
}

fn coefficients(material: &str) -> LinearEdge {
    let text = setup("aluminium", "small-vmc").replace("material = \"aluminium\"\n", "") + material;
    let (job, _) = load(&text, Path::new(".")).expect("loads");
    let ForceModel::LinearEdge(k) = job.material(&job.tools[0]).expect("has one").model else {
        panic!("a linear edge model")
    };
    k
}

#[test]
fn what_power_alone_does_not_show_follows_from_shares() {
    let k = coefficients("[material]\nk_tc = 1000\nk_te = 10\n");
    for (found, expected) in [(k.k_rc, 395.0), (k.k_re, 5.66), (k.k_ac, 200.0), (k.k_ae, 2.8)] {
        assert!((found - expected).abs() < 1e-9, "{found} for {expected}");
    }
    let k =
        coefficients("[material]\nmodel = \"power\"\nk_tc = 1000\nk_te = 10\nnormal_cutting_share = 0.7\nk_re = 9\n");
    assert!((k.k_rc - 700.0).abs() < 1e-9 && (k.k_re - 9.0).abs() < 1e-9, "{k:?}");
    let text = setup("aluminium", "small-vmc").replace("material = \"aluminium\"\n", "")
        + "[material]\nk_tc = 1000\nk_te = 10\nnormal_cutting_share = 0.7\n";
    assert!(load(&text, Path::new(".")).is_err(), "the linear edge model has no shares");
}

/// A long slender tool in a deep slot: bent beyond what carbide stands, and nothing in the setup forbids it.
#[test]
fn a_tool_bent_beyond_its_material_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let text = setup("steel-45", "small-vmc").replace("diameter = 10", "diameter = 3\noverhang = 30\nflute_length = 9");
    std::fs::write(folder.path().join("p.setup.toml"), text).unwrap();
    std::fs::write(folder.path().join("p.nc"), "G21 G90\nT1 M6\nS8000 M3\nG0 X-5 Y25 Z5\nG0 Z-6\nG1 X60 F2400\nM30\n")
        .unwrap();
    let mut command = assert_cmd::Command::cargo_bin("feedwright").unwrap();
    let done = command.current_dir(folder.path()).args(["simulate", "p.nc", "--json", "r.json"]).output().unwrap();
    let screen = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    let report: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("r.json")).unwrap()).unwrap();
    let warned = report["warnings"].as_array().unwrap().iter().find(|w| w["code"] == "bending-stress");
    assert_eq!(warned.expect("a warning")["line"], 6, "{screen}");
    assert!(screen.contains("line 6: T1 is bent to"), "{screen}");
}
