//! Writes NC programs of straight test passes along X in a block, for `calibrate --plan` and `learn --experiment`.
//!
//! In: actions (air at a speed; passes of stated depth, width, milling mode and feeds), tool, block. Out: the text of a
//! program whose cuts have exactly those depths. Passes start at the back of the block (+Y) and proceed towards −Y:
//! climb milling along +X, conventional milling along −X, both with the wall on the −Y side. When the width is used up,
//! a new layer begins below, within the width that the layer above has cleared. A pass with several feeds has each on
//! an equal part of the block's length.

use crate::learn::log::columns::DataError;
use crate::machine::{Box3, Tool};
use crate::units::{mm_min_from_mm_s, rpm_from_rps};

/// One step of a test program.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Running in air.
    Air {
        /// Spindle speed, rev/s.
        rps: f64,
        /// How long, s.
        seconds: f64,
    },
    /// A pass.
    Pass(Pass),
}

/// A straight pass through the block.
#[derive(Debug, Clone, PartialEq)]
pub struct Pass {
    /// Depth along the axis, mm.
    pub axial_mm: f64,
    /// Radial depth, mm.
    pub radial_mm: f64,
    /// Conventional milling.
    pub up: bool,
    /// Spindle speed, rev/s.
    pub rps: f64,
    /// Feeds on equal parts of the length, mm/s.
    pub feeds_mm_s: Vec<f64>,
    /// Comment before it; empty: none.
    pub note: String,
}

/// Clearance beside and above the block, mm.
const CLEAR_MM: f64 = 3.0;
/// Least thickness of the block that is left below the last layer and behind the last pass, mm.
pub(super) const LEFT_MM: f64 = 1.0;

/// The program; `title` lines become comments at its head.
pub fn program(title: &[String], actions: &[Action], tool: &Tool, block: &Box3) -> Result<String, DataError> {
    let mut writer = Writer {
        text: format!("(Written by feedwright {})\n", env!("CARGO_PKG_VERSION")),
        tool,
        block,
        wall_mm: block.max.y,
        limit_mm: block.min.y + LEFT_MM,
        top_mm: block.max.z,
        layer: Vec::new(),
        rpm: 0.0,
    };
    for line in title {
        writer.say(&format!("({})", plain(line)));
    }
    writer.say("G21 G90 G17 G94 G40");
    writer.say("G54");
    writer.say(&format!("T{} M6", tool.number));
    for action in actions {
        match action {
            Action::Air { rps, seconds } => writer.air(*rps, *seconds),
            Action::Pass(pass) => writer.pass(pass)?,
        }
    }
    writer.say("M5");
    writer.say("M30");
    Ok(writer.text)
}

/// Text for a comment: ASCII without parentheses, which every control can read.
fn plain(text: &str) -> String {
    let spelled = text.replace('²', "2").replace('·', " ").replace("± ", "+-").replace('→', "->");
    spelled.chars().filter(|c| c.is_ascii() && !"()".contains(*c)).collect()
}

struct Writer<'a> {
    text: String,
    tool: &'a Tool,
    block: &'a Box3,
    /// Y of the wall that the next pass cuts into.
    wall_mm: f64,
    /// Least Y of the layer.
    limit_mm: f64,
    top_mm: f64,
    /// Depths of the passes of this layer.
    layer: Vec<f64>,
    rpm: f64,
}

impl Writer<'_> {
    fn say(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn spindle(&mut self, rps: f64) {
        let rpm = rpm_from_rps(rps).round();
        if rpm != self.rpm {
            self.say(&format!("S{rpm} M3"));
            self.rpm = rpm;
        }
    }

    fn safe_mm(&self) -> f64 {
        self.block.max.z + CLEAR_MM + 2.0
    }

    /// To and fro above the block.
    fn air(&mut self, rps: f64, seconds: f64) {
        self.spindle(rps);
        let (from, to) = (self.block.min.x, self.block.max.x);
        self.say(&format!("G0 Z{}", number(self.safe_mm())));
        self.say(&format!("G0 X{} Y{}", number(from), number(self.block.max.y)));
        let feed = mm_min_from_mm_s(2.0 * (to - from) / seconds);
        self.say(&format!("G1 X{} F{}", number(to), number(feed)));
        self.say(&format!("G1 X{}", number(from)));
    }

    fn pass(&mut self, pass: &Pass) -> Result<(), DataError> {
        if self.wall_mm - pass.radial_mm < self.limit_mm - 1e-9 {
            self.next_layer()?;
        }
        if self.layer.iter().any(|depth| *depth < pass.axial_mm - 1e-9) && pass.radial_mm > 0.0 {
            return Err(DataError::Unfit("deeper test cuts must come before shallower ones beside them".into()));
        }
        let z = self.top_mm - pass.axial_mm;
        if z < self.block.min.z + LEFT_MM - 1e-9 || self.wall_mm - pass.radial_mm < self.limit_mm - 1e-9 {
            return Err(self.too_small());
        }
        self.wall_mm -= pass.radial_mm;
        if pass.radial_mm <= 0.0 {
            self.layer.clear();
        }
        self.layer.push(pass.axial_mm);
        self.spindle(pass.rps);
        if !pass.note.is_empty() {
            self.say(&format!("({})", plain(&pass.note)));
        }
        let r = self.tool.radius_mm();
        let ends = [self.block.min.x - r - CLEAR_MM, self.block.max.x + r + CLEAR_MM];
        let (start, end) = if pass.up { (ends[1], ends[0]) } else { (ends[0], ends[1]) };
        self.say(&format!("G0 Z{}", number(self.safe_mm())));
        self.say(&format!("G0 X{} Y{}", number(start), number(self.wall_mm + r)));
        self.say(&format!("G0 Z{}", number(z)));
        self.cuts(pass, end);
        self.say(&format!("G0 Z{}", number(self.safe_mm())));
        Ok(())
    }

    fn cuts(&mut self, pass: &Pass, end: f64) {
        let (from, to) =
            if pass.up { (self.block.max.x, self.block.min.x) } else { (self.block.min.x, self.block.max.x) };
        let parts = pass.feeds_mm_s.len();
        for (k, feed) in pass.feeds_mm_s.iter().enumerate() {
            let x = if k + 1 == parts { end } else { from + (to - from) * (k + 1) as f64 / parts as f64 };
            self.say(&format!("G1 X{} F{}", number(x), number(mm_min_from_mm_s(*feed))));
        }
    }

    /// Begins a new layer below this one, if the floor of this one is plane.
    fn next_layer(&mut self) -> Result<(), DataError> {
        let depth = self.layer.first().copied().unwrap_or(0.0);
        if self.layer.is_empty() || self.layer.iter().any(|d| (d - depth).abs() > 1e-9) {
            return Err(self.too_small());
        }
        self.top_mm -= depth;
        self.limit_mm = self.wall_mm;
        self.wall_mm = self.block.max.y;
        self.layer.clear();
        Ok(())
    }

    fn too_small(&self) -> DataError {
        let size = self.block.max - self.block.min;
        DataError::Unfit(format!(
            "the block of {:.0} × {:.0} × {:.0} mm is too small for these test cuts with a tool of {} mm: give the \
             setup a larger stock (more in Y first) or a smaller tool",
            size.x, size.y, size.z, self.tool.diameter_mm
        ))
    }
}

fn number(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}
