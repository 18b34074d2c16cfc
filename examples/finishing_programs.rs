//! Writes the pairs of semi-finish and finish in `programs/finishing`: `cargo run --example finishing_programs`.
//!
//! *mould*: a concave quarter cylinder of radius 25 mm along Y, passes along Y from 5° to 75°, pick 0.5 mm, 0.1 mm of stock.
//! *petal*: a boss with the outline ρ = 16 + 3.4 cos 4φ mm and a draft of 10°, in closed passes 0.5 mm apart from the top down, 0.15 mm
//! of stock. Its concave corners have a radius of 3.8 mm and its convex ones 5.1 mm: convex is where the part bulges towards the tool.
//! Both with a ball of 6 mm, two teeth, 0.05 mm per tooth.

use std::fmt::Write;
use std::fs;
use std::io;

const R: f64 = 3.0;

fn head(name: &str) -> String {
    format!(
        "%\n(FEEDWRIGHT EXAMPLE: {name})\nN10 G21 G17 G40 G90 G94\nN20 T1 M6\nN30 S9600 M3\nN40 G54 G0 X0 Y-10 Z40\n"
    )
}

fn mould(above: f64) -> String {
    let (radius, pick) = (25.0, 0.5);
    let mut text = head("QUARTER CYLINDER, CONCAVE");
    let mut slope = 5.0_f64.to_radians();
    while slope <= 75.0_f64.to_radians() {
        let to_centre = radius - R - above;
        let (x, z) = (to_centre * slope.sin(), radius - to_centre * slope.cos() - R);
        let _ = write!(text, "G0 X{x:.4} Y-4.0\nG0 Z{:.4}\nG1 Z{z:.4} F960\nG1 Y12.0\nG0 Z40.0\n", z + 3.0);
        slope += pick / radius;
    }
    text + "M30\n%\n"
}

/// Centre of a ball that touches the boss at angle `phi` and depth `below` its top.
fn centre(phi: f64, below: f64, above: f64) -> [f64; 3] {
    let draft = 10.0_f64.to_radians().tan();
    let outline = |phi: f64| 16.0 + 3.4 * (4.0 * phi).cos() + below * draft;
    let (rho, slope) = (outline(phi), -13.6 * (4.0 * phi).sin());
    let (sin, cos) = phi.sin_cos();
    // Normal of the outline outward, raised by the draft.
    let out = [rho * cos + slope * sin, rho * sin - slope * cos];
    let size = out[0].hypot(out[1]);
    // ∂S/∂z is −draft along the radius: the rise of the normal is draft times the radial part of the outline's normal.
    let rise = draft * rho / size;
    let whole = (1.0 + rise * rise).sqrt();
    let far = R + above;
    [rho * cos + far * out[0] / size / whole, rho * sin + far * out[1] / size / whole, -below + far * rise / whole]
}

/// The semi-finish goes one pass deeper: the last pass of the finish meets no floor.
fn petal(above: f64) -> String {
    let mut text = head("TAPERED PETAL");
    let last = if above > 0.0 { 8 } else { 7 };
    for level in 0..last {
        let below = 0.5 * f64::from(level);
        for step in 0..=480 {
            let [x, y, z] = centre(0.75_f64.to_radians() * f64::from(step), below, above);
            let z = z - R;
            if step == 0 {
                let _ = write!(text, "G0 X{:.4} Y{y:.4}\nG0 Z{:.4}\nG1 Z{z:.4} F960\nG1 X{x:.4}\n", x + 6.0, z + 8.0);
            } else {
                let _ = writeln!(text, "G1 X{x:.4} Y{y:.4} Z{z:.4}");
            }
        }
        let _ = write!(text, "G1 X{:.4}\nG0 Z40.0\n", centre(0.0, below, above)[0] + 6.0);
    }
    text + "M30\n%\n"
}

/// Coefficients: Nishida's Eq. 1, as fitted to his Table 1.
fn setup(stock: &str) -> String {
    format!(
        "# A ball of 6 mm under the layer model of Nishida and others (Eq. 1, fitted to their Table 1: 50 to 200 µm of stock).\n\
         resolution = 0.1\n\n[machine]\ndialect = \"fanuc\"\nrapid = 15000\n\n[machine.spindle]\nmax_rpm = 12000\n\n[stock]\n{stock}\n\n\
         [material]\nmodel = \"layer\"\nc0 = 3.6033\nc1 = -2.3323\nc2 = 0.3534\nc3 = 0.3487\n\n\
         [[tool]]\nnumber = 1\nshape = \"ball\"\ndiameter = 6\nflutes = 2\nhelix = 30\nflute_length = 45\noverhang = 50\nmaterial = \"carbide\"\n"
    )
}

fn main() -> io::Result<()> {
    fs::create_dir_all("programs/finishing")?;
    let write = |name: &str, text: String| fs::write(format!("programs/finishing/{name}"), text);
    let stocks = [
        ("mould", "box = { min = [0, 0, -2], max = [26, 8, 22] }"),
        ("petal", "box = { min = [-27, -27, -9], max = [27, 27, 0] }"),
    ];
    for (name, stock) in stocks {
        let program = if name == "mould" { mould } else { petal };
        let above = if name == "mould" { 0.1 } else { 0.15 };
        write(&format!("{name}-semi.nc"), program(above))?;
        write(&format!("{name}-finish.nc"), program(0.0))?;
        write(&format!("{name}-semi.setup.toml"), setup(stock))?;
    }
    Ok(())
}
