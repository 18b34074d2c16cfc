//! Everyday programs with their setups, generated: what a shop cuts on any day, small, in mm and in inch, with and without a
//! way through the air before the cut. Lengths and feeds below are mm and mm/min; an inch program writes them in inch.
#![allow(dead_code)] // each test file uses its own part of it

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// A program and its setup.
pub struct Everyday {
    /// What it is.
    pub name: String,
    /// The program.
    pub text: String,
    /// The setup, TOML.
    pub setup: String,
}

/// A program while it is written.
struct Text {
    out: String,
    inch: bool,
}

impl Text {
    fn new(inch: bool) -> Self {
        let units = if inch { "G20" } else { "G21" };
        Self { out: format!("%\n{units} G17 G40 G49 G80 G90 G94 G54\n"), inch }
    }
    /// A length in the unit of the program.
    fn l(&self, mm: f64) -> String {
        let value = if self.inch { mm / 25.4 } else { mm };
        let digits = if self.inch { 4 } else { 3 };
        let text = format!("{value:.digits$}");
        let text = text.trim_end_matches('0').to_owned();
        if text == "-0." { "0.".into() } else { text }
    }
    fn tool(&mut self, number: u32, rpm: f64) {
        let _ = writeln!(self.out, "T{number} M6\nS{rpm:.0} M3");
    }
    fn rapid(&mut self, x: f64, y: f64) {
        let _ = writeln!(self.out, "G0 X{} Y{}", self.l(x), self.l(y));
    }
    fn rapid_z(&mut self, z: f64) {
        let _ = writeln!(self.out, "G0 Z{}", self.l(z));
    }
    /// To a place in the air above: up, across, down to `z`.
    fn over(&mut self, x: f64, y: f64, z: f64) {
        self.rapid_z(20.0);
        self.rapid(x, y);
        self.rapid_z(z);
    }
    fn f(&self, feed: f64) -> String {
        if self.inch { format!("F{:.1}", feed / 25.4) } else { format!("F{feed:.0}") }
    }
    fn line(&mut self, x: f64, y: f64) {
        let _ = writeln!(self.out, "G1 X{} Y{}", self.l(x), self.l(y));
    }
    fn line_f(&mut self, x: f64, y: f64, feed: f64) {
        let _ = writeln!(self.out, "G1 X{} Y{} {}", self.l(x), self.l(y), self.f(feed));
    }
    fn line_z(&mut self, z: f64, feed: f64) {
        let _ = writeln!(self.out, "G1 Z{} {}", self.l(z), self.f(feed));
    }
    fn to(&mut self, [x, y, z]: [f64; 3]) {
        let _ = writeln!(self.out, "G1 X{} Y{} Z{}", self.l(x), self.l(y), self.l(z));
    }
    /// An arc to x, y about its centre, counted from its start; `z`: a helix.
    fn arc(&mut self, way: u32, [x, y]: [f64; 2], [i, j]: [f64; 2], z: Option<f64>) {
        let z = z.map_or(String::new(), |z| format!(" Z{}", self.l(z)));
        let _ = writeln!(self.out, "G{way} X{} Y{}{z} I{} J{}", self.l(x), self.l(y), self.l(i), self.l(j));
    }
    fn end(mut self) -> String {
        self.out += "G0 Z";
        let top = self.l(50.0);
        self.out + &top + "\nM5\nM30\n%\n"
    }
}

/// A tool of a setup: number, shape, diameter, teeth, limits.
type Tool<'a> = (u32, &'a str, f64, u32, &'a str);

fn setup(inch: bool, stock: [[f64; 3]; 2], tools: &[Tool], limits: &str) -> String {
    let dialect = if inch { "fanuc" } else { "linuxcnc" };
    let mut out = format!(
        "units = \"mm\"\nfixtures = \"none\"\n[machine]\ndialect = \"{dialect}\"\nrapid = 15000\ncorner_tolerance = 0.02\nblock_time = 0.002\n\
         [machine.axes]\nx = {{ velocity = 15000, acceleration = 1500 }}\ny = {{ velocity = 15000, acceleration = 1500 }}\n\
         z = {{ velocity = 12000, acceleration = 1200 }}\n[machine.spindle]\nmax_rpm = 15000\nrunup_time = 1\n\
         [stock]\nbox = {{ min = {:?}, max = {:?} }}\n[material]\nk_tc = 842\nk_rc = 332\nk_ac = 150\nk_te = 15.2\nk_re = 8.6\nk_ae = 2\n",
        stock[0], stock[1]
    );
    for (number, shape, diameter, flutes, own) in tools {
        let _ = write!(
            out,
            "[[tool]]\nnumber = {number}\nshape = \"{shape}\"\ndiameter = {diameter}\nflutes = {flutes}\nflute_length = {}\n\
             overhang = {}\n{own}\n",
            (2.5 * diameter).max(12.0),
            (4.0 * diameter).max(25.0)
        );
    }
    let _ = write!(out, "[limits]\nfeed_change = {{ max = 4 }}\nair_feed = 5000\n{limits}\n");
    out
}

/// Every program.
pub fn all() -> Vec<Everyday> {
    let mut all = Vec::new();
    let mut put = |name: &str, (text, setup): (String, String)| {
        all.push(Everyday { name: name.to_owned(), text, setup });
    };
    for (inch, unit) in [(false, "mm"), (true, "inch")] {
        put(&format!("contour loops, {unit}"), loops(inch, [120.0, 80.0], 2.0, 0.0));
        put(&format!("contour loops through air, {unit}"), loops(inch, [150.0, 66.0], 1.2, 15.0));
        put(&format!("slots from the air, {unit}"), slots(inch, 12.0));
        put(&format!("slots from a plunge, {unit}"), slots(inch, -8.0));
        put(&format!("facing in zigzag, {unit}"), facing(inch, true));
        put(&format!("facing one way, {unit}"), facing(inch, false));
        put(&format!("pocket in a spiral, {unit}"), spiral(inch));
        put(&format!("pocket in circles, {unit}"), circles(inch));
        put(&format!("pocket in zigzag, {unit}"), zigzag(inch));
        put(&format!("trochoidal slot, {unit}"), trochoids(inch));
        put(&format!("ramps to depth, {unit}"), ramps(inch));
        put(&format!("helical bores, {unit}"), bores(inch));
        put(&format!("thread milling, {unit}"), threads(inch));
        put(&format!("drilling pattern, {unit}"), drilling(inch));
        put(&format!("raster finishing, {unit}"), raster(inch));
        put(&format!("waterline finishing, {unit}"), waterlines(inch));
        put(&format!("chamfers, {unit}"), chamfers(inch));
        put(&format!("engraving, {unit}"), engraving(inch));
        put(&format!("five blocks, {unit}"), short(inch, 0.0));
        put(&format!("five blocks through air, {unit}"), short(inch, 30.0));
        put(&format!("contour with arcs, {unit}"), rounded(inch));
        put(&format!("many tools, {unit}"), many_tools(inch));
    }
    all
}

/// Ten loops around a block, each `step` further in, one F a loop: convex corners, in full cut and out of it.
pub fn loops(inch: bool, [a, b]: [f64; 2], step: f64, air: f64) -> (String, String) {
    let (r, n) = (5.0, 10);
    let grown = f64::from(n) * step;
    let mut t = Text::new(inch);
    t.tool(1, 8000.0);
    t.over(-grown - 20.0 - air, -grown - 20.0, -8.0);
    for k in 1..=n {
        let off = grown - f64::from(k) * step + r;
        t.line_f(-off - air, -off, 600.0);
        for [x, y] in [[-off, b + off], [a + off, b + off], [a + off, -off], [-off, -off]] {
            t.line(x, y);
        }
    }
    let stock = [[-grown, -grown, -20.0], [a + grown, b + grown, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 10.0, 3, "")], "force_xy = 400"))
}

/// Eight slots that start `air` mm before the stock (below 0: inside it, after a plunge).
pub fn slots(inch: bool, air: f64) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 8000.0);
    for k in 0..8 {
        let y = 10.0 + 15.0 * f64::from(k);
        t.over(-5.0 - air, y, 2.0);
        t.line_z(-3.0, 200.0);
        t.line_f(100.0, y, 360.0);
    }
    let stock = [[0.0, 0.0, -20.0], [120.0, 125.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 10.0, 3, "")], "force_xy = 180"))
}

/// Facing with an 50 mm cutter at about a third of its limit.
pub fn facing(inch: bool, zigzag: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 3000.0);
    let rows = 5;
    t.over(-35.0, 12.0, -1.5);
    for k in 0..rows {
        let y = 12.0 + 32.0 * f64::from(k);
        let (from, to) = if zigzag && k % 2 == 1 { (235.0, -35.0) } else { (-35.0, 235.0) };
        if k > 0 && zigzag {
            t.line(from, y);
        } else if k > 0 {
            t.over(from, y, -1.5);
        }
        t.line_f(to, y, 700.0);
    }
    let stock = [[0.0, 0.0, -20.0], [200.0, 150.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "face", 50.0, 4, "lead_angle = 45")], "force_xy = 300"))
}

/// A pocket opened by a helix and cut in a spiral of squares.
pub fn spiral(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 9000.0);
    for level in 1..=2 {
        let z = -4.0 * f64::from(level);
        t.over(3.0, 0.0, z + 5.0);
        for k in 1..=5 {
            let f = if k == 1 { " ".to_owned() + &t.f(500.0) } else { String::new() };
            let _ = writeln!(t.out, "G3 X{} Y0. Z{} I{} J0.{f}", t.l(3.0), t.l(z + 5.0 - f64::from(k)), t.l(-3.0));
        }
        t.line_f(4.0, 0.0, 1000.0);
        for k in 1..=6 {
            let h = 4.0 * f64::from(k);
            for [x, y] in [[h, -h], [-h, -h], [-h, h], [h, h], [h, -h + 4.0]] {
                t.line(x, y);
            }
        }
    }
    let stock = [[-40.0, -40.0, -20.0], [40.0, 40.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 10.0, 3, "")], "force_xy = 450\npower = 2600"))
}

/// A round pocket: down a helix, then circles, each further out; circles say their centre only, as many posts write them.
pub fn circles(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 9000.0);
    t.over(53.0, 40.0, 0.5);
    for k in 1..=5 {
        let f = if k == 1 { " ".to_owned() + &t.f(500.0) } else { String::new() };
        let _ = writeln!(t.out, "G3 Z{} I{}{f}", t.l(0.5 - 0.9 * f64::from(k)), t.l(-3.0));
    }
    for k in 1..=9 {
        let r = 3.0 * f64::from(k);
        t.line_f(50.0 + r, 40.0, 600.0);
        let _ = writeln!(t.out, "G3 I{}", t.l(-r));
    }
    let stock = [[0.0, 0.0, -20.0], [100.0, 80.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 10.0, 3, "")], "force_xy = 450"))
}

/// A pocket in zigzag rows, then once along its wall.
pub fn zigzag(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 9000.0);
    t.over(-30.0, -20.0, 2.0);
    t.line_z(-4.0, 150.0);
    for k in 0..9 {
        let y = -20.0 + 5.0 * f64::from(k);
        let x = if k % 2 == 0 { 30.0 } else { -30.0 };
        t.line_f(x, y, 700.0);
        if k < 8 {
            t.line(x, y + 5.0);
        }
    }
    for [x, y] in [[31.0, 21.0], [-31.0, 21.0], [-31.0, -21.0], [31.0, -21.0], [31.0, 21.0]] {
        t.line(x, y);
    }
    let stock = [[-45.0, -35.0, -20.0], [45.0, 35.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 10.0, 3, "")], "force_xy = 450"))
}

/// A slot in trochoids: full circles that advance.
pub fn trochoids(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 10000.0);
    t.over(-14.0, 20.0, -8.0);
    t.line_f(-12.0, 20.0, 1500.0);
    for k in 0..40 {
        let x = -12.0 + 1.5 * f64::from(k);
        t.arc(3, [x + 1.5, 20.0], [0.75, -4.0], None);
        t.arc(3, [x, 20.0], [-0.75, 4.0], None);
        t.line(x + 1.5, 20.0);
    }
    let stock = [[0.0, 0.0, -20.0], [60.0, 40.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 8.0, 4, "")], "force_xy = 350"))
}

/// Ramps down to depth along a groove, then one pass on the level.
pub fn ramps(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 8000.0);
    t.over(10.0, 20.0, 0.5);
    t.line_z(0.0, 300.0);
    for k in 1..=6 {
        let x = if k % 2 == 1 { 70.0 } else { 10.0 };
        t.to([x, 20.0, -f64::from(k)]);
    }
    t.line_f(70.0, 20.0, 500.0);
    for [x, y] in [[70.0, 30.0], [10.0, 30.0], [10.0, 36.0], [70.0, 36.0]] {
        t.line(x, y);
    }
    let stock = [[0.0, 0.0, -20.0], [80.0, 50.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 8.0, 3, "")], "force_xy = 400"))
}

/// Bores made by helices, each then cleaned at the bottom and widened by a circle.
pub fn bores(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 9000.0);
    for [cx, cy] in [[20.0, 20.0], [60.0, 20.0], [60.0, 55.0]] {
        t.over(cx + 4.0, cy, 1.0);
        t.line_z(0.5, 600.0);
        for k in 1..=8 {
            t.arc(3, [cx + 4.0, cy], [-4.0, 0.0], Some(0.5 - f64::from(k)));
        }
        t.arc(3, [cx + 4.0, cy], [-4.0, 0.0], None);
        t.line_f(cx + 6.0, cy, 500.0);
        t.arc(3, [cx + 6.0, cy], [-6.0, 0.0], None);
        t.line(cx, cy);
    }
    let stock = [[0.0, 0.0, -20.0], [80.0, 75.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 10.0, 3, "")], "force_xy = 450"))
}

/// A drilled hole with a thread milled in one turn and a half.
pub fn threads(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    let holes = [[15.0, 15.0], [45.0, 15.0], [45.0, 45.0], [15.0, 45.0]];
    t.tool(1, 3000.0);
    for [x, y] in holes {
        t.over(x, y, 2.0);
        t.line_z(-16.0, 300.0);
        t.rapid_z(2.0);
    }
    t.tool(2, 5000.0);
    for [x, y] in holes {
        t.over(x, y, -14.0);
        t.line_f(x + 1.6, y, 300.0);
        for k in 1..=3 {
            t.arc(3, [x + 1.6, y], [-1.6, 0.0], Some(-14.0 + 1.5 * f64::from(k)));
        }
        t.line(x, y);
    }
    let stock = [[0.0, 0.0, -20.0], [60.0, 60.0, 0.0]];
    let tools = [(1, "drill", 10.2, 2, "point_angle = 118"), (2, "flat", 8.0, 3, "")];
    (t.end(), setup(inch, stock, &tools, "force_xy = 400\nforce_axial = 1500"))
}

/// Holes in cycles.
pub fn drilling(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 4000.0);
    t.rapid_z(20.0);
    t.rapid(10.0, 10.0);
    let _ = writeln!(t.out, "G98 G81 X{} Y{} Z{} R{} {}", t.l(10.0), t.l(10.0), t.l(-3.0), t.l(2.0), t.f(240.0));
    for k in 1..12 {
        let (x, y) = (10.0 + 15.0 * f64::from(k % 4), 10.0 + 15.0 * f64::from(k / 4));
        let _ = writeln!(t.out, "X{} Y{}", t.l(x), t.l(y));
    }
    let _ = writeln!(t.out, "G80");
    t.tool(2, 3000.0);
    t.over(10.0, 10.0, 5.0);
    let (z, q) = (t.l(-18.0), t.l(4.0));
    let _ = writeln!(t.out, "G98 G83 X{} Y{} Z{z} R{} Q{q} {}", t.l(10.0), t.l(10.0), t.l(2.0), t.f(300.0));
    for k in 1..12 {
        let (x, y) = (10.0 + 15.0 * f64::from(k % 4), 10.0 + 15.0 * f64::from(k / 4));
        let _ = writeln!(t.out, "X{} Y{}", t.l(x), t.l(y));
    }
    let _ = writeln!(t.out, "G80");
    let stock = [[0.0, 0.0, -20.0], [65.0, 50.0, 0.0]];
    let tools = [(1, "drill", 10.0, 2, "point_angle = 90"), (2, "drill", 6.0, 2, "point_angle = 118")];
    // A cycle has one F for its way through the air and its cut: drills are slowed only.
    let slowed = "force_axial = 700\n[[operation]]\nmatch = { lines = [1, 100] }\nmode = \"slow-only\"";
    (t.end(), setup(inch, stock, &tools, slowed))
}

/// Rows of short chords over a wavy surface with a ball.
pub fn raster(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 12000.0);
    let height = |x: f64, y: f64| -1.0 - 0.8 * (x / 40.0 * TAU).sin() * (y / 30.0 * PI).cos();
    t.over(0.0, 0.0, 3.0);
    for k in 0..14 {
        let y = f64::from(k);
        for i in 0..=40 {
            let x = if k % 2 == 0 { f64::from(i) } else { 40.0 - f64::from(i) };
            if k == 0 && i == 0 {
                t.line_z(height(x, y), 300.0);
                t.line_f(x, y, 1200.0);
            } else {
                t.to([x, y, height(x, y)]);
            }
        }
    }
    let stock = [[-5.0, -5.0, -20.0], [45.0, 18.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "ball", 8.0, 2, "")], "force_xy = 120\nforce_axial = 120"))
}

/// Level lines down a cone.
pub fn waterlines(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 9000.0);
    for k in 1..=10 {
        let z = -0.8 * f64::from(k);
        let r = 14.0 + 0.5 * f64::from(k) + 5.0;
        t.over(r + 12.0, 0.0, z);
        t.line_f(r, 0.0, 900.0);
        t.arc(2, [r, 0.0], [-r, 0.0], None);
        t.line(r + 12.0, 0.0);
    }
    let stock = [[-24.0, -22.0, -20.0], [24.0, 22.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "bull", 10.0, 3, "corner_radius = 1")], "force_xy = 150"))
}

/// The upper edge of a block broken, with a way in and out.
pub fn chamfers(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 8000.0);
    for (depth, off) in [(-2.0, 1.0), (-3.0, 1.0)] {
        t.over(-15.0, -15.0, depth);
        t.line_f(-off, -off, 800.0);
        for [x, y] in [[-off, 40.0 + off], [60.0 + off, 40.0 + off], [60.0 + off, -off], [-off, -off], [-15.0, -15.0]] {
            t.line(x, y);
        }
    }
    let stock = [[0.0, 0.0, -20.0], [60.0, 40.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "chamfer", 10.0, 2, "point_angle = 90")], "force_xy = 150"))
}

/// Figures of short strokes, each from above.
pub fn engraving(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 12000.0);
    for k in 0..6 {
        let (x, y) = (5.0 + 9.0 * f64::from(k), 5.0);
        t.over(x, y, 1.0);
        t.line_z(-0.6, 150.0);
        t.line_f(x + 3.0, y + 8.0, 400.0);
        t.line(x + 6.0, y);
        t.over(x + 1.5, y + 4.0, 1.0);
        t.line_z(-0.6, 150.0);
        t.line_f(x + 4.5, y + 4.0, 400.0);
        t.arc(3, [x + 4.5, y + 4.0], [-1.5, 0.0], None);
    }
    let stock = [[0.0, 0.0, -5.0], [65.0, 20.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "chamfer", 6.0, 2, "point_angle = 60")], "force_xy = 40"))
}

/// The shortest program that cuts: down, across a step, up.
pub fn short(inch: bool, air: f64) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 8000.0);
    t.over(-8.0 - air, 3.0, -6.0);
    t.line_f(208.0 + air, 3.0, 500.0);
    t.line(208.0 + air, 8.0);
    t.line(-8.0 - air, 14.0);
    let stock = [[0.0, 0.0, -20.0], [200.0, 40.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 12.0, 3, "")], "force_xy = 500"))
}

/// A contour of lines and arcs in two depths with an arc in and out.
pub fn rounded(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 9000.0);
    for z in [-5.0, -10.0] {
        t.over(-18.0, 20.0, z);
        t.line_f(-12.0, 26.0, 800.0);
        t.arc(2, [-6.0, 32.0], [6.0, 0.0], None);
        t.line(-6.0, 40.0);
        t.arc(2, [10.0, 56.0], [16.0, 0.0], None);
        t.line(60.0, 56.0);
        t.arc(2, [76.0, 40.0], [0.0, -16.0], None);
        t.line(76.0, 10.0);
        t.arc(2, [60.0, -6.0], [-16.0, 0.0], None);
        t.line(10.0, -6.0);
        t.arc(2, [-6.0, 10.0], [0.0, 16.0], None);
        t.line(-6.0, 32.0);
        t.arc(2, [-12.0, 38.0], [-6.0, 0.0], None);
    }
    let stock = [[-3.0, -3.0, -20.0], [73.0, 53.0, 0.0]];
    (t.end(), setup(inch, stock, &[(1, "flat", 12.0, 4, "")], "force_xy = 480\ndeflection = 0.05"))
}

/// A part with six tools: faced, contoured, pocketed, slotted, drilled, broken edges.
pub fn many_tools(inch: bool) -> (String, String) {
    let mut t = Text::new(inch);
    t.tool(1, 3000.0);
    t.over(-30.0, 12.0, -1.0);
    t.line_f(110.0, 12.0, 900.0);
    t.line(110.0, 45.0);
    t.line(-30.0, 45.0);
    t.tool(2, 6000.0);
    for z in [-5.0, -9.0] {
        t.over(-20.0, -20.0, z);
        t.line_f(-6.0, -12.0, 700.0);
        for [x, y] in [[-6.0, 66.0], [86.0, 66.0], [86.0, -6.0], [-20.0, -6.0]] {
            t.line(x, y);
        }
    }
    t.tool(3, 9000.0);
    t.over(25.0, 25.0, 1.0);
    t.line_z(-4.0, 150.0);
    for k in 1..=3 {
        let h = 4.0 * f64::from(k);
        t.line_f(25.0 + h, 25.0, 800.0);
        t.arc(3, [25.0 + h, 25.0], [-h, 0.0], None);
    }
    t.tool(4, 9000.0);
    t.over(55.0, 10.0, 1.0);
    t.line_z(-3.0, 150.0);
    t.line_f(55.0, 50.0, 400.0);
    t.line(62.0, 50.0);
    t.line(62.0, 10.0);
    t.tool(5, 4000.0);
    t.over(10.0, 50.0, 3.0);
    let _ = writeln!(t.out, "G98 G81 X{} Y{} Z{} R{} {}", t.l(10.0), t.l(50.0), t.l(-15.0), t.l(2.0), t.f(300.0));
    let _ = writeln!(t.out, "X{}\nG80", t.l(72.0));
    t.tool(6, 8000.0);
    t.over(-15.0, -15.0, -3.5);
    t.line_f(-1.0, -1.0, 700.0);
    for [x, y] in [[-1.0, 61.0], [81.0, 61.0], [81.0, -1.0], [-1.0, -1.0]] {
        t.line(x, y);
    }
    let tools = [
        (1, "face", 40.0, 4, "lead_angle = 45\nlimits = { force_xy = 1200 }"),
        (2, "flat", 12.0, 3, "limits = { force_xy = 600 }"),
        (3, "flat", 8.0, 3, "limits = { force_xy = 350 }"),
        (4, "flat", 6.0, 3, "limits = { force_xy = 220 }"),
        (5, "drill", 6.0, 2, "point_angle = 118\nlimits = { force_axial = 600 }"),
        (6, "chamfer", 10.0, 2, "point_angle = 90\nlimits = { force_xy = 120 }"),
    ];
    let stock = [[-3.0, -3.0, -20.0], [83.0, 63.0, 0.0]];
    let limits = "power = 4000\n[[operation]]\nmatch = { tool = 5 }\nmode = \"slow-only\"";
    (t.end(), setup(inch, stock, &tools, limits))
}
