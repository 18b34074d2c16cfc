//! Tables of steady cuts. In: rows of a CSV file, tools. Out: [`SteadyRow`]s with removal and contact rate, from the
//! depths in closed form ([`crate::force::closed`]) or as given by the table.

use crate::effects::{AlongEdge, State};
use crate::force::closed::{Rates, SteadyCut, immersion_rad, rates};
use crate::learn::dataset::samples::{Base, Class, UNBOUNDED};
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::log::quantity::{OF_SPINDLE, Quantity};
use crate::machine::wear::Lengths;
use crate::machine::{Shape, Tool};
use crate::units::{mm_s_from_mm_min, rps_from_rpm};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Side of the cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Conventional.
    Up,
    /// Climb.
    Down,
    /// Full slot.
    Slot,
    /// Axis within a cut narrower than the tool, with walls on both sides or none.
    Centre,
}

/// A tool, for tables without its geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableTool {
    /// Number.
    pub number: u32,
    /// Diameter, mm.
    pub diameter_mm: f64,
    /// Teeth.
    pub flutes: u32,
    /// Flat or ball.
    pub shape: Shape,
}

impl From<&Tool> for TableTool {
    fn from(tool: &Tool) -> Self {
        Self { number: tool.number, diameter_mm: tool.diameter_mm, flutes: tool.flutes, shape: tool.shape }
    }
}

/// One steady cut.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyRow {
    /// Set-up or part.
    pub group: String,
    /// Operation.
    pub kind: String,
    /// The edge that cuts; wear is counted from its first cut.
    pub edge: String,
    /// Is the edge declared fresh at this cut (`wear` = 0)?
    pub is_fresh: bool,
    /// Place in the order of the tests.
    pub order: f64,
    /// The cut in closed form, straight or curved as the table says.
    pub cut: SteadyCut,
    /// Side of the cut.
    pub side: Side,
    /// Rates given by the table.
    pub given: Option<Rates>,
    /// Height of the layer above the tip, mm.
    pub layer_height_mm: Option<f64>,
    /// Duration, s; NaN if it is not given.
    pub duration_s: f64,
}

impl SteadyRow {
    /// Is it conventional (up) milling?
    pub fn is_conventional(&self) -> bool {
        self.side == Side::Up
    }
}

/// Columns that name the edge of a cut.
const EDGE_COLUMNS: [&str; 3] = ["edge", "tool_edge", "insert"];

/// Rows of a table.
pub fn rows(frame: &Frame, tools: &[TableTool]) -> Result<Vec<SteadyRow>, DataError> {
    let column = |name: &str| frame.numbers(name).unwrap_or_else(|| vec![f64::NAN; frame.rows]);
    let given = frame.numbers("removal_rate_mm3_s").zip(frame.numbers("contact_rate_mm2_s"));
    let tool_number = column("tool");
    let (diameter, flutes) = (column("diameter_mm"), column("flutes"));
    let (feed, per_tooth, rpm) = (column("feed_mm_min"), column("feed_per_tooth_mm"), column("spindle_rpm"));
    let (axial, radial) = (column("axial_depth_mm"), column("radial_depth_mm"));
    let (entry, exit) = (column("entry_deg"), column("exit_deg"));
    let (path, layer) = (column("path_radius_mm"), frame.numbers("layer_height_mm"));
    let (order, duration) = (column("order"), column("duration_s"));
    let text = |name: &str, i: usize| frame.text(name).map_or(String::new(), |t| t[i].clone());
    let edge_name = EDGE_COLUMNS.into_iter().find(|name| frame.text(name).is_some());
    let wear = column("wear");
    let group_name = ["group", "part", "set_up", "setup"].into_iter().find(|name| frame.text(name).is_some());
    let shape_text = frame.text("shape");
    (0..frame.rows)
        .map(|i| {
            let known = tool_of(tools, tool_number[i], i)?;
            let diameter_mm = or(diameter[i], known.map_or(f64::NAN, |t| t.diameter_mm));
            let teeth = or(flutes[i], known.map_or(f64::NAN, |t| f64::from(t.flutes)));
            let rps = rps_from_rpm(rpm[i]);
            let side = side_of(&text("side", i), radial[i], diameter_mm, i)?;
            let from_angles = 0.5 * diameter_mm * (1.0 - (exit[i] - entry[i]).abs().to_radians().cos());
            let ball =
                shape_text.map_or(known.is_some_and(|t| t.shape == Shape::Ball), |t| t[i].eq_ignore_ascii_case("ball"));
            let row = SteadyRow {
                group: group_name.map_or_else(|| "all".to_owned(), |name| text(name, i)),
                kind: text("operation", i),
                edge: edge_of(
                    edge_name.map(|name| text(name, i)),
                    group_name.map(|name| text(name, i)),
                    tool_number[i],
                ),
                is_fresh: wear[i] == 0.0,
                order: or(order[i], i as f64),
                cut: SteadyCut {
                    diameter_mm,
                    shape: if ball { Shape::Ball } else { Shape::Flat },
                    axial_depth_mm: axial[i],
                    radial_depth_mm: if side == Side::Slot { diameter_mm } else { or(radial[i], from_angles) },
                    path_radius_mm: path[i].is_finite().then_some(path[i]),
                    feed_mm_s: or(mm_s_from_mm_min(feed[i]), per_tooth[i] * teeth * rps),
                    flutes: teeth.max(1.0) as u32,
                    rps,
                },
                side,
                given: given
                    .as_ref()
                    .map(|(q, a)| Rates { removal_rate_mm3_s: q[i], contact_rate_mm2_s: a[i] })
                    .filter(|rates| rates.removal_rate_mm3_s.is_finite() && rates.contact_rate_mm2_s.is_finite()),
                layer_height_mm: layer.as_ref().map(|l| l[i]).filter(|l| l.is_finite()),
                duration_s: duration[i],
            };
            if row.given.is_none() {
                needs_geometry(&row, i, frame)?;
            }
            Ok(row)
        })
        .collect()
}

/// Name of the edge of a cut: by the table, else a new one for every set-up (part) and tool.
fn edge_of(named: Option<String>, group: Option<String>, tool: f64) -> String {
    let of_tool = if tool.is_finite() { format!(" T{tool}") } else { String::new() };
    named.or(group).unwrap_or_default() + &of_tool
}

fn or(value: f64, other: f64) -> f64 {
    if value.is_finite() { value } else { other }
}

/// Error if row `i` (from 0) lacks what the closed forms need.
pub(in crate::learn) fn needs_geometry(row: &SteadyRow, i: usize, frame: &Frame) -> Result<(), DataError> {
    let c = &row.cut;
    let geometry = [
        ("diameter_mm (or a setup with the tool)", c.diameter_mm),
        ("axial_depth_mm", c.axial_depth_mm),
        ("radial_depth_mm (or entry_deg, exit_deg)", c.radial_depth_mm),
        ("feed_mm_min (or feed_per_tooth_mm)", c.feed_mm_s),
        ("spindle_rpm", c.rps),
    ];
    match geometry.iter().find(|(_, value)| !value.is_finite()) {
        Some((name, _)) => Err(DataError::Unfit(format!(
            "row {}: {name} is missing, and so are the rates of a table without geometry (removal_rate_mm3_s, \
             contact_rate_mm2_s); there are: {}. Rename them in the header or map them with --columns",
            i + 1,
            frame.names().join(", ")
        ))),
        None => is_possible(c, i),
    }
}

/// A cut is no wider than the tool (1 % is left to rounding), and no depth is below zero. `i`: row, from 0.
fn is_possible(cut: &SteadyCut, i: usize) -> Result<(), DataError> {
    let [radial, axial, diameter] = [cut.radial_depth_mm, cut.axial_depth_mm, cut.diameter_mm];
    let wrong = if radial > 1.01 * diameter {
        format!("radial_depth_mm = {radial} is more than the diameter of the tool, {diameter} mm")
    } else if radial < 0.0 || axial < 0.0 {
        format!("a depth is below zero (axial {axial}, radial {radial} mm)")
    } else {
        return Ok(());
    };
    Err(DataError::Unfit(format!("row {}: {wrong}; correct the row, the unit of the column, or the diameter", i + 1)))
}

/// The tool with this number; where a row names none, the first.
fn tool_of(tools: &[TableTool], number: f64, i: usize) -> Result<Option<&TableTool>, DataError> {
    let known = tools.iter().find(|tool| f64::from(tool.number) == number);
    if known.is_some() || number.is_nan() || tools.is_empty() {
        return Ok(known.or(tools.first()));
    }
    let known: Vec<String> = tools.iter().map(|tool| tool.number.to_string()).collect();
    Err(DataError::Unfit(format!(
        "row {}: the setup has no tool {number}; it has {}. Describe it there, or correct the column tool",
        i + 1,
        known.join(", ")
    )))
}

/// Beginnings of the words for a side, in English and German.
const SIDES: [(&[&str], Side); 4] = [
    (&["up", "conv", "gegen"], Side::Up),
    (&["down", "climb", "gleich"], Side::Down),
    (&["slot", "full", "nut", "voll"], Side::Slot),
    (&["both", "cent", "mitt"], Side::Centre),
];

/// The side of the cut from its word; without a word a slot where the cut is as wide as the tool, else climb.
fn side_of(text: &str, radial: f64, diameter: f64, i: usize) -> Result<Side, DataError> {
    let word = text.trim().to_lowercase();
    if word.is_empty() {
        return Ok(if radial >= 0.999 * diameter { Side::Slot } else { Side::Down });
    }
    let known = SIDES.iter().find(|(words, _)| words.iter().any(|begin| word.starts_with(begin)));
    known
        .map(|(_, side)| *side)
        .ok_or_else(|| DataError::Unfit(format!("row {}: the side `{text}` is none of up, down, slot, centre", i + 1)))
}

/// Rates of a row on its path, or on a straight path of the same depths.
pub fn row_rates(row: &SteadyRow, straight: bool) -> Rates {
    if let Some(given) = row.given {
        return given;
    }
    rates(&if straight { SteadyCut { path_radius_mm: None, ..row.cut } } else { row.cut })
}

/// The measured quantity of a frame: its column name, kind and unit.
pub fn measured_quantity(frame: &Frame) -> Result<(&'static str, Quantity, &'static str), DataError> {
    OF_SPINDLE
        .into_iter()
        .find(|(name, ..)| frame.numbers(name).is_some_and(|v| v.iter().any(|x| x.is_finite())))
        .ok_or_else(|| DataError::NoColumn {
            missing: "spindle_power_w (or torque, load, current)".into(),
            present: frame.names().join(", "),
        })
}

/// The three base coefficients of a spindle reading. A cut takes power, so that neither of its two is below zero; what a drive reads
/// without a cut may be, where its zero is not set.
pub fn spindle_base(quantity: Quantity, unit: &str) -> Vec<Base> {
    let base = |name: &str, unit: String, class| {
        let bounds = if class == Class::Tare { UNBOUNDED } else { (0.0, f64::INFINITY) };
        Base { name: name.into(), unit, class, prior: None, bounds }
    };
    match quantity {
        Quantity::Relative => vec![
            base("tare", unit.to_owned(), Class::Tare),
            base("k_tc", format!("{unit}/(1000 mm³/s)"), Class::Cutting),
            base("k_te", format!("{unit}/(1000 mm²/s)"), Class::Edge),
        ],
        Quantity::Power | Quantity::Torque => vec![
            base("tare", "W".into(), Class::Tare),
            base("k_tc", "N/mm²".into(), Class::Cutting),
            base("k_te", "N/mm".into(), Class::Edge),
        ],
    }
}

/// Numbers the distinct names in order of appearance.
pub fn numbered<'a>(names: impl Iterator<Item = &'a str>) -> (Vec<usize>, Vec<String>) {
    let mut known: Vec<String> = Vec::new();
    let numbers = names
        .map(|name| {
            known.iter().position(|k| k == name).unwrap_or_else(|| {
                known.push(name.to_owned());
                known.len() - 1
            })
        })
        .collect();
    (numbers, known)
}

/// Length of a cut in a table that says nothing of how long its cuts last, mm: the way of the teeth is then known but for one factor that all
/// cuts share.
pub const COUNTED_MM: f64 = 100.0;

/// Does the table leave open how long its cuts last, so that each is counted as [`COUNTED_MM`] long?
pub fn way_is_counted(table: &[SteadyRow]) -> bool {
    table.iter().all(|row| !row.duration_s.is_finite())
}

/// The table with one edge for each tool, whatever the set-up: the other reading of a table that does not say when an edge was fresh.
/// `None` where it says so, or has one set-up only.
pub fn with_one_edge(frame: &Frame, table: &[SteadyRow]) -> Option<Vec<SteadyRow>> {
    let is_declared = EDGE_COLUMNS.iter().any(|name| frame.text(name).is_some()) || frame.numbers("wear").is_some();
    let several = table.iter().any(|row| row.group != table[0].group);
    let of_tool = |row: &SteadyRow| row.edge.strip_prefix(&row.group).unwrap_or_default().to_owned();
    let one = || table.iter().map(|row| SteadyRow { edge: of_tool(row), ..row.clone() }).collect();
    (!is_declared && several).then(one)
}

/// States in the order of the rows; time, sliding distance and volume accumulate in the `order` of the tests, the
/// latter two for each edge.
pub(in crate::learn) fn states(table: &[SteadyRow], order: &[usize]) -> Vec<State> {
    let mut states = vec![State::default(); table.len()];
    let reference = table.first().map_or(1.0, |row| row.cut.rps);
    let counted = way_is_counted(table);
    let mut clock = 0.0;
    // History of each edge: sliding distance, mm, and volume, mm³.
    let mut behind: BTreeMap<&str, (Lengths, f64)> = BTreeMap::new();
    for &i in order {
        let (row, c) = (&table[i], &table[i].cut);
        let r = row_rates(row, true);
        // Without any duration the cuts are as long as each other.
        let way_s = if counted { COUNTED_MM / c.feed_mm_s } else { row.duration_s };
        let lasts = or(way_s, 1.0);
        let known = c.diameter_mm.is_finite() && c.radial_depth_mm.is_finite();
        let theta = if known { immersion_rad(0.5 * c.diameter_mm, c.radial_depth_mm, None) } else { f64::NAN };
        let past = behind.entry(row.edge.as_str()).or_default();
        if row.is_fresh {
            *past = Default::default();
        }
        let (slid, volume) = *past;
        let feed_per_tooth_mm = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
        states[i] = State {
            time_s: if row.duration_s.is_finite() { clock } else { row.order },
            slid: if way_s.is_finite() { slid } else { Lengths([f64::NAN; 4]) },
            volume_mm3: if way_s.is_finite() { volume } else { f64::NAN },
            rps: c.rps,
            reference_rps: reference,
            feed_per_tooth_mm,
            chip_thickness_mm: r.removal_rate_mm3_s / r.contact_rate_mm2_s,
            cutting_speed_mm_s: PI * c.diameter_mm * c.rps,
            axial_depth_mm: c.axial_depth_mm,
            radial_depth_mm: c.radial_depth_mm,
            immersion_rad: theta,
            up_share: up_share(row, theta),
            up_share_chip: up_share_chip(row, theta),
            mean_cosine: mean_cosine(theta).map(|of_up| on_side(row.side, of_up)),
            curvature_per_mm: c.path_radius_mm.map_or(0.0, |radius| 1.0 / radius),
            along_edge: along_edge(row),
            ..State::default()
        };
        clock += lasts;
        let way_mm = 0.5 * c.diameter_mm * theta * c.rps * lasts;
        *past = (slid.and(&Lengths::slid(way_mm, feed_per_tooth_mm)), volume + r.removal_rate_mm3_s * lasts);
    }
    states
}

/// A layer around its height, or a cut from the tip to its depth.
fn along_edge(row: &SteadyRow) -> AlongEdge {
    let from_mm = row.layer_height_mm.map_or(0.0, |middle_mm| middle_mm - 0.5 * row.cut.axial_depth_mm);
    AlongEdge::even([from_mm, from_mm + row.cut.axial_depth_mm])
}

/// Share of the engaged arc in the up half minus that in the climb half; a cut beyond half the diameter has both.
fn up_share(row: &SteadyRow, theta: f64) -> f64 {
    on_side(row.side, if theta <= 0.5 * PI { 1.0 } else { (PI - theta) / theta })
}

/// The same weighted with the chip thickness, sin φ.
fn up_share_chip(row: &SteadyRow, theta: f64) -> f64 {
    on_side(row.side, if theta <= 0.5 * PI { 1.0 } else { (1.0 + theta.cos()) / (1.0 - theta.cos()) })
}

/// Mean of cos φ over the arc 0 … θ of up-milling: by chip thickness sin φ, and by contact.
fn mean_cosine(theta: f64) -> [f64; 2] {
    [0.5 * (1.0 + theta.cos()), theta.sin() / theta]
}

/// What an arc that begins at one side of the tool has more in the up half than in the climb half, from its value of up-milling.
fn on_side(side: Side, of_up: f64) -> f64 {
    match side {
        Side::Up => of_up,
        Side::Down => -of_up,
        Side::Slot | Side::Centre => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::log::columns;

    /// What is read of a table with one row like this: its side and depths, or what is wrong with it.
    fn of_row(side: &str, tool: u32, [axial, radial]: [f64; 2]) -> Result<SteadyRow, String> {
        let text = format!(
            "tool,side,axial_depth_mm,radial_depth_mm,feed_mm_min,spindle_rpm,spindle_power_w\n{tool},{side},{axial},{radial},300,3000,200\n"
        );
        let frame = columns::read(text.as_bytes(), &[]).map_err(|error| error.to_string())?;
        let tools = [TableTool { number: 1, diameter_mm: 10.0, flutes: 4, shape: Shape::Flat }];
        rows(&frame, &tools).map(|mut rows| rows.remove(0)).map_err(|error| error.to_string())
    }

    #[test]
    fn a_side_is_known_by_its_word_or_asked_for() {
        for (word, side) in [
            ("up", Side::Up),
            ("Gegenlauf", Side::Up),
            ("climb", Side::Down),
            ("gleichlauf", Side::Down),
            ("", Side::Down),
            ("Nut", Side::Slot),
            ("centre", Side::Centre),
        ] {
            assert_eq!(of_row(word, 1, [2.0, 5.0]).unwrap().side, side, "{word}");
        }
        assert_eq!(of_row("", 1, [2.0, 10.0]).unwrap().side, Side::Slot);
        assert!(of_row("left", 1, [2.0, 5.0]).unwrap_err().contains("the side `left`"));
    }

    /// On each side of what a cut can be.
    #[test]
    fn a_row_that_cannot_be_is_refused_by_its_number() {
        assert!(of_row("up", 1, [2.0, 10.1]).is_ok() && of_row("up", 1, [0.0, 5.0]).is_ok());
        assert!(of_row("up", 1, [2.0, 10.2]).unwrap_err().contains("row 1: radial_depth_mm = 10.2"));
        assert!(of_row("up", 1, [-0.1, 5.0]).unwrap_err().contains("below zero"));
        assert!(of_row("up", 9, [2.0, 5.0]).unwrap_err().contains("no tool 9"));
    }

    #[test]
    fn the_mean_cosine_of_an_arc_is_that_of_a_sum_over_its_teeth() {
        const STEPS: u32 = 10_000;
        for theta in [0.2, 0.5 * PI, 2.0, PI] {
            let sums = (0..STEPS)
                .map(|k| theta * (f64::from(k) + 0.5) / f64::from(STEPS))
                .fold([0.0; 3], |sum, phi| [sum[0] + phi.sin() * phi.cos(), sum[1] + phi.sin(), sum[2] + phi.cos()]);
            let expected = [sums[0] / sums[1], sums[2] / f64::from(STEPS)];
            let found = mean_cosine(theta);
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-6), "{theta}: {found:?} for {expected:?}");
        }
        let mirrored = [Side::Up, Side::Down, Side::Slot, Side::Centre].map(|side| on_side(side, 0.3));
        assert_eq!(mirrored, [0.3, -0.3, 0.0, 0.0]);
    }
}
