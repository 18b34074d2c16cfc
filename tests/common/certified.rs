//! Programs with certificates: what is optimised, certified and read back. Used by the tests of certificates.

#![allow(dead_code)] // each test file uses its own part of it

use assert_cmd::cargo::cargo_bin;
use feedwright::certify::Basis;
use feedwright::machine::Job;
use feedwright::nc::{self, Dialect, Environment, Toolpath};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A program with its setup.
pub struct Case {
    /// What it is.
    pub name: String,
    /// Its text.
    pub program: String,
    /// TOML.
    pub setup: String,
}

const FLAT: &str = "[[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 10\nflutes = 3\nhelix = 30\nflute_length = 22\noverhang = 32\ncentre_cutting = true\n";
const BALL: &str =
    "[[tool]]\nnumber = 1\nshape = \"ball\"\ndiameter = 6\nflutes = 2\nhelix = 30\nflute_length = 12\noverhang = 25\n";
const BULL: &str = "[[tool]]\nnumber = 1\nshape = \"bull\"\ndiameter = 12\ncorner_radius = 2\nflutes = 4\nhelix = 40\nflute_length = 24\noverhang = 40\n";
pub const STEEL: &str = "[material]\nk_tc = 820\nk_rc = 310\nk_ac = 120\nk_te = 14\nk_re = 11\nk_ae = 2\n";

fn setup(stock: &str, tool: &str, limits: &str, rest: &str) -> String {
    format!(
        "units = \"mm\"\n[machine]\ndialect = \"generic\"\n[stock]\n{stock}\nuncertainty = 0.2\n{STEEL}{rest}\n{tool}[raise]\nplunges = true\nramps = true\nentries = true\nfinishing = true\n\
         [limits]\n{limits}\nfeed_change = {{ min = 0.02, max = 2 }}\n"
    )
}

/// Four by hand.
pub fn by_hand() -> Vec<Case> {
    let slots = "G21 G90 G17 G94\nT1 M6\nS6000 M3\nG0 X-12 Y10 Z5\nG1 Z-3 F600\nG1 X60 F900\nG1 Y18\nG1 X-12\nG0 Z5\nG0 X30 Y-10\nG1 Z-2 F400\nG1 Y3\nG2 X36 Y9 I6 J0\nG1 X62\nG0 Z20\nM30\n";
    let down = "G21 G90 G17 G94\nT1 M6\nS5000 M3\nG0 X15 Y15 Z2\nG1 Z-1.5 F120\nG1 X35 Z-3 F500\nG3 X35 Y15 Z-5 I-6 J0 F600\nG1 X15 Y15 F500\nG0 Z20\nM30\n";
    let mut raster = "G21 G90 G17 G94\nT1 M6\nS12000 M3\nG0 X-5 Y0 Z5\nG1 Z-0.4 F800\n".to_owned();
    for pass in 0..6 {
        let (y, dip) = (0.5 * f64::from(pass), 0.6 + 0.1 * f64::from(pass % 3));
        let [from, to] = if pass % 2 == 0 { [-5.0, 20.0] } else { [20.0, -5.0] };
        raster += &format!("G1 Y{y:.3}\n");
        for step in 1..=10 {
            let x: f64 = from + (to - from) * f64::from(step) / 10.0;
            raster += &format!("G1 X{x:.3} Z{:.3} F1200\n", -dip - 0.3 * (x / 4.0).sin());
        }
    }
    raster += "G0 Z20\nM30\n";
    let wide = "box = { min = [0, 0, -10], max = [50, 30, 0] }";
    let measured = "[process]\nbase = { model = \"linear-edge\", k_tc = 900, k_rc = 350, k_ac = 130, k_te = 15, k_re = 12, k_ae = 2 }\ncovariance_of = [\"k_tc\", \"k_te\"]\ncovariance = [[900, -12], [-12, 0.6]]\nscatter = 0.03\n";
    vec![
        Case {
            name: "slots".to_owned(),
            program: slots.to_owned(),
            setup: setup(wide, FLAT, "force_xy = 220", "uncertainty = 0.1"),
        },
        Case {
            name: "downwards".to_owned(),
            program: down.to_owned(),
            setup: setup(
                wide,
                FLAT,
                "force_xy = 300\nforce_axial = 320\ntorque = 1.6\npower = 850",
                "uncertainty = 0.05",
            ),
        },
        Case {
            name: "raster".to_owned(),
            program: raster,
            setup: setup(
                "box = { min = [0, -2, -10], max = [16, 5, 0] }",
                BALL,
                "force_xy = 80\ndeflection = 0.06\nchip_thickness = { max = 0.06 }",
                "uncertainty = 0.15",
            ),
        },
        Case {
            name: "measured".to_owned(),
            program: slots.replace("Z-3", "Z-2.5"),
            setup: setup(wide, BULL, "force_xy = 350\nbending_stress = 60\nfeed_per_tooth = 0.12", measured),
        },
    ]
}

/// Runs the binary.
pub fn feedwright(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(cargo_bin("feedwright")).current_dir(dir).args(arguments).output().unwrap()
}

/// What it printed.
pub fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// A written program with its certificate.
pub struct Written {
    pub job: Job,
    pub bytes: Vec<u8>,
    pub toolpath: Toolpath,
    pub certificate: String,
    /// What the written program takes, s, and what it takes with `--confidence` alone.
    pub seconds: [f64; 2],
}

impl Written {
    /// Optimised with a certificate, which is then checked; and without one.
    pub fn of(case: &Case) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let dir = dir.path();
        fs::write(dir.join("p.nc"), &case.program).unwrap();
        fs::write(dir.join("s.toml"), &case.setup).unwrap();
        let common = ["optimize", "p.nc", "--setup", "s.toml", "--confidence", "0.95", "--force", "--json", "r.json"];
        let seconds = [&["-o", "o.nc", "--certificate", "c.txt"][..], &["-o", "plain.nc"][..]].map(|own| {
            let output = feedwright(dir, &[&common[..], own].concat());
            assert_eq!(output.status.code(), Some(0), "{}: {}", case.name, said(&output));
            let report: serde_json::Value = serde_json::from_slice(&fs::read(dir.join("r.json")).unwrap()).unwrap();
            report["time"]["realised_after_s"].as_f64().unwrap()
        });
        let output = feedwright(dir, &["certify", "o.nc", "--setup", "s.toml", "--certificate", "c.txt"]);
        assert_eq!(output.status.code(), Some(0), "{}: {}", case.name, said(&output));
        let bytes = fs::read(dir.join("o.nc")).unwrap();
        let (job, _) = feedwright::setup::load(&case.setup, dir).unwrap();
        let toolpath = read(&bytes, &job);
        let certificate = fs::read_to_string(dir.join("c.txt")).unwrap();
        Self { job, bytes, toolpath, certificate, seconds }
    }

    /// What its checker is given.
    pub fn basis(&self) -> Basis<'_> {
        Basis { bytes: &self.bytes, toolpath: &self.toolpath, job: &self.job, switched: false }
    }
}

/// What a program does.
pub fn read(bytes: &[u8], job: &Job) -> Toolpath {
    let dialect = job.machine.dialect.as_deref().and_then(Dialect::from_name);
    let program = nc::parse(bytes.to_vec(), dialect);
    let environment = nc::unit::with_its_unit(&program, Environment::from_job(job), Some(job));
    nc::interpret(&program, &environment)
}
