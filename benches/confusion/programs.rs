//! Parts to be milled: a program, its setup text, and the steady cuts in it whose depths are known because they were put
//! there. In: a seed. Out: [`Part`].
//!
//! Every part holds the cuts that tell the effects apart: air at several spindle speeds before, between and after the
//! cuts; feeds per tooth over a decade at the same engagement; several axial and radial depths, up, climb and slot; the
//! same cut again and again; cuts all over the stock; sawtooth passes of short blocks; passes across slots at a constant
//! F. Sizes, order, tool, speeds and material are drawn from the seed, in three families: raster layers along X, layers
//! crossed along X and Y, and outside contours with concave arcs.

use super::rng::{Deck, Rng};
use super::writer::{Step, Writer};

/// Height at which nothing is met, mm.
const SAFE_MM: f64 = 5.0;
/// Overtravel in air before and after a pass, mm beyond the tool radius.
const OVERTRAVEL_MM: f64 = 4.0;

/// A steady straight cut.
#[allow(dead_code)] // only the tests of the generator read it
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steady {
    /// Index of its step.
    pub step: usize,
    /// Depth along the axis, mm.
    pub axial_mm: f64,
    /// Depth across the feed, mm.
    pub radial_mm: f64,
    /// Material on the left of the feed (up-milling with a right-hand spindle); slots have it on both.
    pub up: bool,
    /// It is a full slot.
    pub slot: bool,
}

/// Tool of a part: a flat end mill.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mill {
    /// Diameter, mm.
    pub diameter_mm: f64,
    /// Teeth.
    pub flutes: u32,
    /// Helix angle, degrees.
    pub helix_deg: f64,
}

/// What the setup says of the machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Shop {
    /// Acceleration of every axis, mm/s².
    pub acceleration_mm_s2: f64,
    /// Rapid, mm/s.
    pub rapid_mm_s: f64,
    /// Path tolerance, mm.
    pub tolerance_mm: f64,
    /// Spindle run-up, s.
    pub runup_s: f64,
    /// Tool change, s.
    pub tool_change_s: f64,
    /// Declared tare: (rev/min, W).
    pub tare_w: Vec<[f64; 2]>,
    /// Declared efficiency of the drive.
    pub efficiency: f64,
    /// Declared k_tc, k_rc, k_ac (N/mm²), k_te, k_re, k_ae (N/mm).
    pub declared: [f64; 6],
}

/// A part.
#[derive(Debug, Clone)]
pub struct Part {
    /// Program.
    pub program: String,
    /// Setup file.
    pub setup: String,
    /// What the program does.
    pub steps: Vec<Step>,
    /// Stock from (0, 0, −height) to (length, width, 0), mm.
    pub stock_mm: [f64; 3],
    /// Tool.
    pub mill: Mill,
    /// Machine and declared coefficients.
    pub shop: Shop,
    /// Cuts of known depths, against which the tests hold the engagement found by brute force.
    #[allow(dead_code)] // only the tests of the generator read it
    pub steady: Vec<Steady>,
}

/// Plan of one part while its program is written.
struct Plan {
    rng: Rng,
    writer: Writer,
    stock_mm: [f64; 3],
    mill: Mill,
    feeds: Deck,
    speeds: Deck,
    depths: Deck,
    widths: Deck,
    /// Top and bottom of the layer that is being cut.
    layer: [f64; 2],
    /// The layer has slots across; the wall has scallops of a sawtooth: the next pass is no steady cut.
    slotted: bool,
    scalloped: bool,
    passes: usize,
    next_air: usize,
    steady: Vec<Steady>,
}

impl Part {
    /// The part of a seed.
    pub fn new(seed: u64) -> Self {
        Self::made(seed, |plan| match seed % 3 {
            0 => plan.raster_part(false),
            1 => plan.raster_part(true),
            _ => plan.contour_part(),
        })
    }

    /// A part without the cuts that tell effects apart: one layer from one wall to the other, at one speed, feed and width.
    pub fn lean(seed: u64) -> Self {
        Self::made(seed, Plan::lean_part)
    }

    fn made(seed: u64, cut: impl Fn(&mut Plan)) -> Self {
        let mut rng = Rng::new(seed, 1);
        let steel = rng.index(3) == 0;
        let diameter_mm = rng.pick(&[8.0, 10.0, 10.0, 12.0]);
        let mill = Mill { diameter_mm, flutes: rng.pick(&[3, 3, 4]), helix_deg: rng.pick(&[30.0, 35.0, 40.0]) };
        let shop = Shop::new(&mut rng, steel);
        let mut plan = Plan::new(rng, mill, steel);
        plan.begin();
        cut(&mut plan);
        plan.end();
        let setup = setup_text(&plan.stock_mm, &mill, &shop);
        Self {
            program: plan.writer.text,
            setup,
            steps: plan.writer.steps,
            stock_mm: plan.stock_mm,
            mill,
            shop,
            steady: plan.steady,
        }
    }
}

impl Shop {
    fn new(rng: &mut Rng, steel: bool) -> Self {
        let low = rng.uniform(60.0, 140.0).round();
        let high = low + rng.uniform(120.0, 300.0).round();
        let declared = if steel {
            [rng.uniform(1700.0, 2200.0), 0.0, 0.0, rng.uniform(24.0, 40.0), 0.0, 0.0]
        } else {
            [rng.uniform(680.0, 900.0), 0.0, 0.0, rng.uniform(10.0, 18.0), 0.0, 0.0]
        };
        let (t, e) = (declared[0].round(), (declared[3] * 10.0).round() / 10.0);
        Self {
            acceleration_mm_s2: rng.pick(&[1000.0, 1500.0, 2500.0]),
            rapid_mm_s: rng.pick(&[10000.0, 15000.0, 20000.0]) / 60.0,
            tolerance_mm: rng.pick(&[0.01, 0.02]),
            runup_s: rng.pick(&[1.0, 1.5, 2.0]),
            tool_change_s: rng.pick(&[4.0, 6.0]),
            tare_w: vec![[1000.0, low], [12000.0, high]],
            efficiency: rng.pick(&[0.88, 0.92, 1.0]),
            declared: [t, (0.4 * t).round(), (0.18 * t).round(), e, (5.6 * e).round() / 10.0, 2.0],
        }
    }
    /// Declared tare at a speed in rev/s.
    pub fn tare_at(&self, rps: f64) -> f64 {
        let [[x0, y0], [x1, y1]] = [self.tare_w[0], self.tare_w[1]];
        y0 + (y1 - y0) * ((60.0 * rps - x0) / (x1 - x0)).clamp(0.0, 1.0)
    }
}

impl Plan {
    fn new(mut rng: Rng, mill: Mill, steel: bool) -> Self {
        let d = mill.diameter_mm;
        let stock_mm = [rng.uniform(52.0, 76.0).round(), rng.uniform(40.0, 54.0).round(), 30.0];
        let cutting_speed_m_min = if steel { rng.uniform(80.0, 130.0) } else { rng.uniform(160.0, 260.0) };
        let middle_rpm = cutting_speed_m_min * 1000.0 / (std::f64::consts::PI * d);
        let speeds = [0.6, 0.85, 1.15, 1.6].map(|x| (x * middle_rpm / 50.0).round() * 50.0).map(|n| n.min(12000.0));
        let top = if steel { 0.12 } else { 0.2 };
        // A decade of feeds per tooth; the slowest comes least often, or it would take most of the time.
        let feeds = [0.0, 0.25, 0.5, 0.5, 0.75, 0.75, 1.0, 1.0].map(|k| 0.02 * (top / 0.02f64).powf(k));
        let deep = if steel { 0.2 } else { 0.38 };
        let depths = [0.45, 1.0, 0.7].map(|x| (x * deep * d * rng.uniform(0.9, 1.1) * 10.0).round() / 10.0);
        let widths = [0.06, 0.15, 0.3, 0.5, 0.75].map(|x| x * d);
        Self {
            writer: Writer::new([0.0, 0.0, 60.0]),
            stock_mm,
            mill,
            feeds: Deck::new(&feeds),
            speeds: Deck::new(&speeds),
            depths: Deck::new(&depths),
            widths: Deck::new(&widths),
            layer: [0.0; 2],
            slotted: false,
            scalloped: false,
            passes: 0,
            next_air: 5,
            steady: Vec::new(),
            rng,
        }
    }

    fn radius(&self) -> f64 {
        0.5 * self.mill.diameter_mm
    }

    /// Air at every speed.
    fn air(&mut self, dwell_s: f64) {
        for _ in 0..4 {
            let rpm = self.speeds.deal(&mut self.rng);
            self.writer.spindle(rpm, dwell_s);
        }
    }

    fn begin(&mut self) {
        for line in ["%", "(test part)", "G21 G90 G17 G94 G40", "G54"] {
            self.writer.say(line);
        }
        self.writer.tool();
        self.writer.rapid([-20.0, -20.0, 30.0]);
        self.air(3.0);
    }

    fn end(&mut self) {
        self.up();
        self.air(3.0);
        self.writer.say("M5");
        self.writer.say("M30");
        self.writer.say("%");
    }

    fn up(&mut self) {
        let [x, y, _] = self.writer.position();
        self.writer.rapid([x, y, SAFE_MM]);
    }

    /// Feed in mm/min for the next pass.
    fn next_feed(&mut self) -> f64 {
        let per_tooth = self.feeds.deal(&mut self.rng);
        self.feed_of(per_tooth)
    }

    fn feed_of(&self, per_tooth_mm: f64) -> f64 {
        per_tooth_mm * f64::from(self.mill.flutes) * self.writer.rpm()
    }

    /// Between passes: now and then an air cut, another speed.
    fn pause(&mut self) {
        self.passes += 1;
        if self.passes >= self.next_air {
            self.next_air = self.passes + 3 + self.rng.index(4);
            let dwell_s = self.rng.uniform(1.5, 3.0).round();
            let rpm = self.speeds.deal(&mut self.rng);
            self.writer.spindle(rpm, dwell_s);
        }
    }

    /// Moves in air to a point beside the stock at depth z.
    fn approach(&mut self, to: [f64; 3]) {
        self.up();
        self.writer.rapid([to[0], to[1], SAFE_MM]);
        self.writer.rapid(to);
    }

    /// Begins the next layer and says its bottom.
    fn deeper(&mut self) -> f64 {
        let depth = self.depths.deal(&mut self.rng);
        let top = self.layer[1];
        self.slotted = false;
        self.layer = [top, ((top - depth) * 1e3).round() / 1e3];
        self.layer[1]
    }

    /// One straight pass along X (or Y) with the axis at `v` across; `side` is where the material stands (+1 above `v`,
    /// −1 below, 0 on both), `radial_mm` how wide the cut is.
    fn pass(&mut self, along_x: bool, v: f64, radial_mm: f64, side: f64) {
        self.pause();
        let feed = self.next_feed();
        let [u0, u1] = self.span(along_x);
        let z = self.layer[1];
        let place = |u: f64| if along_x { [u, v, z] } else { [v, u, z] };
        self.approach(place(u0));
        self.writer.feed(place(u1), feed);
        if !self.slotted && !std::mem::take(&mut self.scalloped) {
            // Material towards +v is on the left when going +X, on the right when going +Y.
            let up = (side > 0.0) == ((u1 > u0) == along_x);
            let axial_mm = self.layer[0] - z;
            self.steady.push(Steady { step: self.writer.steps.len() - 1, axial_mm, radial_mm, up, slot: side == 0.0 });
        }
    }

    /// Ends of a pass, the nearer first, so that passes alternate.
    fn span(&self, along_x: bool) -> [f64; 2] {
        let reach = self.radius() + OVERTRAVEL_MM;
        let (here, length) = if along_x {
            (self.writer.position()[0], self.stock_mm[0])
        } else {
            (self.writer.position()[1], self.stock_mm[1])
        };
        if here <= 0.5 * length { [-reach, length + reach] } else { [length + reach, -reach] }
    }

    /// Clears a layer with passes along X or Y, between the walls `low` and `high` of its material.
    fn raster(&mut self, along_x: bool, [low, high]: [f64; 2], slot: bool, sawtooth: usize) {
        let r = self.radius();
        if !slot {
            let wall = self.sawtooth(along_x, low, sawtooth);
            return self.widen(along_x, wall, high, 1.0);
        }
        let middle = low + (high - low) * self.rng.uniform(0.35, 0.65);
        self.pass(along_x, middle, 2.0 * r, 0.0);
        self.widen(along_x, middle + r, high, 1.0);
        self.widen(along_x, middle - r, low, -1.0);
    }

    /// Passes from the wall `from` until the wall stands at `to`.
    fn widen(&mut self, along_x: bool, from: f64, to: f64, side: f64) {
        let mut wall = from;
        loop {
            let left = (to - wall) * side;
            if left < 0.05 {
                return;
            }
            let drawn = self.widths.deal(&mut self.rng);
            let ae = if left - drawn < 0.05 * self.mill.diameter_mm { left } else { drawn };
            wall = ((wall + side * ae) * 1e3).round() / 1e3;
            self.pass(along_x, wall - side * self.radius(), ae, side);
        }
    }

    /// Sawtooth passes of short blocks from the low side; says where the wall stands afterwards.
    fn sawtooth(&mut self, along_x: bool, low: f64, passes: usize) -> f64 {
        let mut wall = low;
        self.scalloped = passes > 0;
        for _ in 0..passes {
            let leg = self.rng.uniform(2.5, 5.0);
            let swing = self.rng.uniform(0.8, 1.6);
            let ae = 0.12 * self.mill.diameter_mm;
            self.pause();
            let per_tooth = self.rng.uniform(0.09, 0.14);
            let feed = self.feed_of(per_tooth);
            let [u0, u1] = self.span(along_x);
            let (z, direction, v) = (self.layer[1], (u1 - u0).signum(), wall + ae - self.radius());
            let place = |u: f64, v: f64| if along_x { [u, v, z] } else { [v, u, z] };
            self.approach(place(u0, v));
            let legs = ((u1 - u0).abs() / leg).floor() as usize;
            for k in 1..legs {
                let swung = if k % 2 == 1 { swing } else { 0.0 };
                self.writer.feed(place(u0 + direction * leg * k as f64, v + swung), feed);
            }
            self.writer.feed(place(u1, v), feed);
            wall += ae + swing;
        }
        wall
    }

    /// Layers along X, or crossed; every second one begins with slots across it, others with a slot along it.
    fn raster_part(&mut self, crossed: bool) {
        for layer in 0..4 {
            self.deeper();
            let along_x = !crossed || layer % 2 == 0;
            let across = if along_x { self.stock_mm[1] } else { self.stock_mm[0] };
            if layer == 1 || layer == 3 {
                self.cross_slots(!along_x);
            }
            let sawtooth = if layer % 2 == 0 { 3 } else { 0 };
            self.raster(along_x, [0.0, across], layer % 2 == 1, sawtooth);
        }
    }

    fn lean_part(&mut self) {
        let speed = self.speeds.deal(&mut self.rng);
        (self.speeds, self.feeds) = (Deck::new(&[speed]), Deck::new(&[0.08]));
        self.widths = Deck::new(&[0.1 * self.mill.diameter_mm]);
        self.deeper();
        self.writer.spindle(speed, 3.0);
        self.raster(true, [0.0, self.stock_mm[1]], false, 0);
    }

    /// Two slots with gaps between them: the passes that cross them later meet material and air in turn.
    fn cross_slots(&mut self, along_x: bool) {
        let across = if along_x { self.stock_mm[1] } else { self.stock_mm[0] };
        self.slotted = true;
        for share in [0.25, 0.65] {
            let v = ((across * (share + self.rng.uniform(0.0, 0.1))) * 1e3).round() / 1e3;
            self.pass(along_x, v, self.mill.diameter_mm, 0.0);
        }
    }

    /// Outside contours in both directions, layers along X, concave arcs about a corner.
    fn contour_part(&mut self) {
        let mut inset = 0.0;
        let depth = self.deeper();
        for clockwise in [true, false, true] {
            inset += self.mill.diameter_mm * self.rng.uniform(0.08, 0.2);
            self.contour(inset, depth, clockwise);
        }
        self.raster(true, [inset, self.stock_mm[1] - inset], true, 0);
        for layer in 0..3 {
            self.deeper();
            if layer == 1 {
                self.cross_slots(false);
            }
            self.raster(true, [0.0, self.stock_mm[1]], layer == 1, if layer == 1 { 0 } else { 3 });
        }
        self.deeper();
        self.corner_arcs();
    }

    /// Once around the stock at `inset` from its sides, with rounded corners.
    fn contour(&mut self, inset: f64, z: f64, clockwise: bool) {
        self.pause();
        let feed = self.next_feed();
        let (r, round) = (self.radius(), 6.0);
        let [length, width, _] = self.stock_mm;
        // Corners of the tool-centre path, counter-clockwise from low left, with the centres of their arcs.
        let (a, b) = (inset - r, inset + round);
        let middle = 0.5 * width;
        self.approach([-r - OVERTRAVEL_MM, middle, z]);
        self.writer.feed([a, middle, z], feed);
        let (x1, y1) = (length - a, width - a);
        let (bx, by) = (length - b, width - b);
        // (line to, arc to, centre) of each corner, clockwise from the left side upward.
        let mut corners = vec![
            ([a, by], [b, y1], [b, by]),
            ([bx, y1], [x1, by], [bx, by]),
            ([x1, b], [bx, a], [bx, b]),
            ([b, a], [a, b], [b, b]),
        ];
        if !clockwise {
            corners = corners.into_iter().rev().map(|(line, arc, centre)| (arc, line, centre)).collect();
        }
        for (line, arc, centre) in corners {
            self.writer.feed([line[0], line[1], z], feed);
            self.writer.arc(arc, centre, !clockwise, feed);
        }
        self.writer.feed([a, middle, z], feed);
        self.writer.feed([-r - OVERTRAVEL_MM, middle, z], feed);
    }

    /// Arcs about the corner (0, 0) of the stock, the material outside.
    fn corner_arcs(&mut self) {
        let r = self.radius();
        let z = self.layer[1];
        let mut rho = r + 3.0;
        for k in 0..8 {
            self.pause();
            let feed = self.next_feed();
            let lead = ((r + 1.5) / rho).min(0.95).asin();
            let point = |angle: f64| [rho * angle.cos(), rho * angle.sin()];
            let (low, high) = (point(-lead), point(std::f64::consts::FRAC_PI_2 + lead));
            let (from, to) = if k % 2 == 0 { (low, high) } else { (high, low) };
            self.approach([from[0], from[1], z]);
            self.writer.arc(to, [0.0, 0.0], k % 2 == 0, feed);
            rho = ((rho + self.widths.deal(&mut self.rng)) * 1e3).round() / 1e3;
        }
    }
}

fn setup_text(stock_mm: &[f64; 3], mill: &Mill, shop: &Shop) -> String {
    let Shop { acceleration_mm_s2: a, tolerance_mm, runup_s, tool_change_s, efficiency, .. } = shop;
    let rapid = (shop.rapid_mm_s * 60.0).round();
    let axis = format!("{{ velocity = {rapid}, acceleration = {a} }}");
    let axes = format!("x = {axis}\ny = {axis}\nz = {axis}\n");
    let [[n0, p0], [n1, p1]] = [shop.tare_w[0], shop.tare_w[1]];
    let [k_tc, k_rc, k_ac, k_te, k_re, k_ae] = shop.declared;
    let [length, width, height] = stock_mm;
    let Mill { diameter_mm, flutes, helix_deg } = mill;
    format!(
        "units = \"mm\"\n\n[machine]\ndialect = \"linuxcnc\"\nrapid = {rapid}\ncorner_tolerance = {tolerance_mm}\n\
         block_time = 0.001\ntool_change_time = {tool_change_s}\n\n[machine.axes]\n{axes}\n[machine.spindle]\n\
         max_rpm = 12000\ntare = [[{n0}, {p0}], [{n1}, {p1}]]\nefficiency = {efficiency}\nrunup_time = {runup_s}\n\n\
         [stock]\nbox = {{ min = [0, 0, -{height}], max = [{length}, {width}, 0] }}\n\n[material]\nk_tc = {k_tc}\n\
         k_rc = {k_rc}\nk_ac = {k_ac}\nk_te = {k_te}\nk_re = {k_re}\nk_ae = {k_ae}\n\n[[tool]]\nnumber = 1\n\
         shape = \"flat\"\ndiameter = {diameter_mm}\nflutes = {flutes}\nhelix = {helix_deg}\nflute_length = 30\n\
         overhang = 45\nmaterial = \"carbide\"\n"
    )
}
