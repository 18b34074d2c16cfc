//! `semifinish` on long programs: a free-form patch, z = 1.5 sin(2πx/40) cos(2πy/50), in passes along X, one block each half
//! millimetre, both programs alike but for 0.1 mm of stock; the force model is the linear edge model, the cell the default one.
//!
//! ```text
//! cargo bench --bench semifinish                      100,000 blocks
//! cargo bench --bench semifinish -- 20000             as many blocks
//! ```

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::f64::consts::TAU;
use std::fmt::Write;
use std::process::Command;
use std::time::Instant;

const R: f64 = 3.0;
const STEP_MM: f64 = 0.5;
const SETUP: &str = "[machine]\ndialect = \"fanuc\"\n[machine.spindle]\nmax_rpm = 12000\n[material]\nk_tc = 1800\nk_rc = 600\n\
                     k_ac = 200\nk_te = 20\nk_re = 15\nk_ae = 3\n[[tool]]\nnumber = 1\nshape = \"ball\"\ndiameter = 6\nflutes = 2\n\
                     helix = 30\nflute_length = 40\noverhang = 45\nmaterial = \"carbide\"\n[stock]\n";

/// Tip of the ball that touches `above` the patch at a place.
fn tip(x: f64, y: f64, above: f64) -> [f64; 3] {
    let ((sx, cx), (sy, cy)) = ((TAU * x / 40.0).sin_cos(), (TAU * y / 50.0).sin_cos());
    let z = 1.5 * sx * cy;
    let [dx, dy] = [1.5 * TAU / 40.0 * cx * cy, -1.5 * TAU / 50.0 * sx * sy];
    let far = (R + above) / (1.0 + dx * dx + dy * dy).sqrt();
    [x - far * dx, y - far * dy, z + far - R]
}

fn program(side: usize, above: f64) -> String {
    let mut text = String::from("%\nO1 (PATCH)\nG21 G17 G40 G90 G94\nT1 M6\nS9600 M3\nG54 G0 X0 Y0 Z40\n");
    for pass in 0..side {
        let y = STEP_MM * pass as f64;
        let [x0, y0, z0] = tip(0.0, y, above);
        let _ = write!(text, "G0 X{x0:.4} Y{y0:.4}\nG0 Z{:.4}\nG1 Z{z0:.4} F960\n", z0 + 3.0);
        for k in 1..side {
            let [x, y, z] = tip(STEP_MM * k as f64, y, above);
            let _ = writeln!(text, "G1 X{x:.4} Y{y:.4} Z{z:.4}");
        }
        text += "G0 Z40.0\n";
    }
    text + "M30\n%\n"
}

fn main() {
    let blocks = std::env::args().skip(1).find_map(|word| word.parse::<f64>().ok()).unwrap_or(100_000.0);
    let side = blocks.sqrt().ceil() as usize;
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    let far = STEP_MM * side as f64;
    let stock = format!("box = {{ min = [-4, -4, -8], max = [{:.0}, {:.0}, 3] }}\n", far + 4.0, far + 4.0);
    for (name, text) in [
        ("semi.nc", program(side, 0.1)),
        ("finish.nc", program(side, 0.0)),
        ("s.toml", [SETUP, stock.as_str()].concat()),
    ] {
        std::fs::write(path(name), text).unwrap();
    }
    let lines = std::fs::read_to_string(path("semi.nc")).unwrap().lines().count();
    let begin = Instant::now();
    let output = Command::new(env!("CARGO_BIN_EXE_feedwright"))
        .current_dir(dir.path())
        .args([
            "semifinish",
            "semi.nc",
            "--finish",
            "finish.nc",
            "--setup",
            "s.toml",
            "-o",
            "out.nc",
            "--force-xy",
            "25",
        ])
        .output()
        .unwrap();
    let seconds = begin.elapsed().as_secs_f64();
    print!("{}", String::from_utf8_lossy(&output.stdout));
    println!("{lines} lines each, exit {:?}: {seconds:.1} s by the clock", output.status.code());
}
