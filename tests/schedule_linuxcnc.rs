//! The model of the control against LinuxCNC's own planner, on two small programs (the corpus is in
//! `benches/linuxcnc_time.rs`). Runs where LinuxCNC is installed.

#![allow(clippy::format_collect, clippy::print_stdout, clippy::unwrap_used)]

mod linuxcnc;

/// A zigzag of right angles, arcs that meet lines at a tangent and at an angle, a rapid, and a row of short lines.
fn program(mode: &str) -> String {
    let mut text = format!("{mode}\nG21 G17 G90\nF900\nG0 X0 Y0 Z0\n");
    for i in 0..12 {
        let (x, y) = (2.0 * f64::from((i + 1) / 2), 2.0 * f64::from(i / 2 % 2 + i % 2));
        text += &format!("G1 X{x:.3} Y{y:.3}\n");
    }
    text += "G2 X17 Y4 I2.5 J0\nG3 X22 Y4 I2.5 J0\nG1 X40\nG1 X40 Y12\nG2 X50 Y12 I5 J0\nG0 X60 Y20\n";
    for i in 0..30 {
        let angle = f64::from(i) * 0.1;
        text += &format!("G1 X{:.4} Y{:.4}\n", 60.0 + 8.0 * angle.sin(), 20.0 + 8.0 * (1.0 - angle.cos()));
    }
    text + "M2\n"
}

#[test]
#[cfg_attr(any(absent_shared, absent_linuxcnc), ignore = "LinuxCNC, its user lcnc or ../shared is not there")]
fn total_time_is_within_three_percent() {
    assert!(linuxcnc::installed(), "LinuxCNC was there when this was built");
    for (name, mode, acceleration) in [("zigzag_g61", "G61", 500.0), ("zigzag_g64", "G64 P0.01", 2000.0)] {
        let text = program(mode);
        // A busy computer starves the simulator when its clock runs fast: it says so, and is asked again at real time.
        let theirs = linuxcnc::run(name, &text, acceleration, 3)
            .or_else(|_| linuxcnc::run(name, &text, acceleration, 1))
            .expect("LinuxCNC runs the program");
        let found = linuxcnc::compare(&theirs, &linuxcnc::model(&text, acceleration));
        println!("{name}: {found:?}");
        assert!(found.error().abs() <= 0.03, "{name}: {found:?}");
    }
}
