//! Writes the contour-parallel program of the case study of Ibaraki, Shimizu and Matsubara: a rectangle of 150 × 66 mm, cut
//! from outside inwards in loops a radial step of 0.3 mm apart, climb milling with a 6 mm tool at 8000 rev/min and
//! 2900 mm/min. The tool centre begins 2.7 mm outside, so that the first loop takes one step.
//!
//! `cargo run --example contour_parallel > programs/island.nc`

#![allow(clippy::print_stdout)]

/// Length and width of the rectangle, mm.
const SIZE_MM: [f64; 2] = [150.0, 66.0];
/// Radial step, mm.
const STEP_MM: f64 = 0.3;
/// How far outside the tool centre begins, mm.
const OUTSIDE_MM: f64 = 2.7;
/// Depth, mm.
const DEPTH_MM: f64 = 6.0;

fn main() {
    let mut text = String::from(
        "%\nO2300 (ISLAND 150 X 66, CONTOUR PARALLEL FROM OUTSIDE, STEP 0.3)\n(T1 D=6 FLAT, 6 FLUTES)\nG21 G90 G94 G17\nT1 M6\nS8000 M3\n",
    );
    text += &format!("G0 X{:.3} Y{:.3} Z5\nG0 Z-{DEPTH_MM}\n", -OUTSIDE_MM - 4.0, -OUTSIDE_MM);
    let mut cut_mm = 0.0;
    let mut offset_mm = -OUTSIDE_MM;
    let mut first = true;
    // Clockwise about the part, which then lies to the right: a tooth leaves the finished wall, as climb milling does.
    while SIZE_MM[1] - 2.0 * offset_mm > 0.0 {
        let [left, bottom] = [offset_mm; 2];
        let [right, top] = [SIZE_MM[0] - offset_mm, SIZE_MM[1] - offset_mm];
        let feed = if std::mem::take(&mut first) { " F2900" } else { "" };
        text +=
            &format!("G1 X{left:.3} Y{bottom:.3}{feed}\nX{left:.3} Y{top:.3}\nX{right:.3}\nY{bottom:.3}\nX{left:.3}\n");
        cut_mm += 2.0 * (right - left + top - bottom);
        offset_mm += STEP_MM;
    }
    text += "G0 Z50\nM30\n%\n";
    print!("{text}");
    eprintln!("{:.1} m of path in loops", 1e-3 * cut_mm);
}
