//! `[machine]` and `[offsets]`. In: these tables of the setup. Out: [`Machine`]. Defaults are those of a small vertical machining centre; each one
//! used is recorded as an assumption.

use super::file::{AxesTable, AxisTable, MachineTable, SpindleTable};
use super::forms::Curve;
use super::quantity::Quantity;
use super::read::{Reader, Sense};
use crate::machine::{Axis, Compensation, MAX_CALL_DEPTH, MAX_REPEATED_BYTES, Machine, Spindle, Table, Unsaid};
use crate::nc::{ADDITIONAL_OFFSETS, BEFORE_ADDITIONAL_OFFSETS, Dialect};
use crate::path::Vec3;
use crate::units::{Dimension, mm_min_from_mm_s};
use std::collections::BTreeMap;

/// The machine with its work offsets.
pub fn machine(
    reader: &mut Reader,
    table: &MachineTable,
    offsets: Option<&BTreeMap<String, [Quantity; 3]>>,
) -> Machine {
    let rapid_mm_s = reader.or("machine.rapid", table.rapid.as_ref(), Dimension::Feed, Sense::Positive, 10000.0);
    let axes = table.axes.clone().unwrap_or_default();
    Machine {
        dialect: table.dialect.clone().filter(|name| known_dialect(reader, name)),
        rapid_mm_s,
        corner_tolerance_mm: reader.or(
            "machine.corner_tolerance",
            table.corner_tolerance.as_ref(),
            Dimension::Length,
            Sense::Within(
                0.0,
                5.0,
                "a control needs some tolerance to move through a corner without a stop: 0.005 to 0.05 mm is usual",
            ),
            0.02,
        ),
        block_time_s: reader.or(
            "machine.block_time",
            table.block_time.as_ref(),
            Dimension::Time,
            Sense::Within(-1e-12, 1.0, "it is the shortest block the control digests in s: 0.0005 to 0.01 is usual"),
            0.002,
        ),
        tool_change_time_s: reader.or(
            "machine.tool_change_time",
            table.tool_change_time.as_ref(),
            Dimension::Time,
            Sense::NotNegative,
            6.0,
        ),
        home_mm: table.home.as_ref().map(|home| reader.point("machine.home", home)),
        compensation: table.compensation.as_deref().and_then(|word| compensation(reader, word)),
        wear_mm: table.wear_offsets.as_ref().map_or_else(Vec::new, |written| wear_offsets(reader, written)),
        tool_names: table.tool_names.iter().flatten().map(|(name, number)| (name.clone(), *number)).collect(),
        max_line_length: table.max_line_length.map(|length| line_length(reader, length)),
        max_repeated_bytes: table.max_repeated_mb.map_or(MAX_REPEATED_BYTES, |mb| repeated_bytes(reader, mb)),
        max_call_depth: table.max_call_depth.map_or(MAX_CALL_DEPTH, |depth| call_depth(reader, depth)),
        axes: all_axes(reader, &axes, mm_min_from_mm_s(rapid_mm_s)),
        spindle: spindle(reader, &table.spindle.clone().unwrap_or_default()),
        offsets: offsets.map_or_else(Vec::new, |written| origins(reader, written)),
        unsaid: Unsaid {
            inch: table.program_unit.as_deref().and_then(|word| program_unit(reader, word)),
            speeds_rps: Vec::new(),
        },
    }
}

fn known_dialect(reader: &mut Reader, name: &str) -> bool {
    let known: Vec<(&'static str, ())> = Dialect::NAMES.iter().map(|name| (*name, ())).collect();
    reader.choice("machine.dialect", name, &known).is_some()
}

/// Is it inches?
fn program_unit(reader: &mut Reader, word: &str) -> Option<bool> {
    reader.choice("machine.program_unit", word, &[("mm", false), ("inch", true)])
}

fn compensation(reader: &mut Reader, word: &str) -> Option<Compensation> {
    let known =
        [("control", Compensation::Control), ("wear", Compensation::Wear), ("inverse-wear", Compensation::InverseWear)];
    reader.choice("machine.compensation", word, &known)
}

/// "D1" → 1, each with its radius.
fn wear_offsets(reader: &mut Reader, written: &BTreeMap<String, Quantity>) -> Vec<(u32, f64)> {
    let mut offsets = Vec::new();
    for (name, value) in written {
        let key = format!("machine.wear_offsets.{name}");
        match name.strip_prefix(['D', 'd']).and_then(|number| number.parse().ok()) {
            Some(number) => offsets.push((number, reader.value(&key, value, Dimension::Length, Sense::Any))),
            None => reader.complain(&key, "is no offset number", "write D and the number of the offset, as in D1"),
        }
    }
    offsets
}

fn line_length(reader: &mut Reader, length: u32) -> usize {
    if length < 20 {
        reader.complain(
            "machine.max_line_length",
            format!("{length} bytes hold no block"),
            "controls read 80 to 256 bytes",
        );
    }
    length as usize
}

/// MB of text as bytes.
fn repeated_bytes(reader: &mut Reader, mb: u32) -> u64 {
    if !(1..=4096).contains(&mb) {
        let text = format!("{mb} MB is not between 1 and 4096");
        reader.complain("machine.max_repeated_mb", text, "64 MB are 1.2 million blocks of 24 bytes");
    }
    u64::from(mb) << 20
}

fn call_depth(reader: &mut Reader, depth: u32) -> usize {
    if !(1..=1000).contains(&depth) {
        let text = format!("{depth} levels are not between 1 and 1000");
        reader.complain("machine.max_call_depth", text, "controls nest calls 4 to 16 deep");
    }
    depth as usize
}

fn all_axes(reader: &mut Reader, axes: &AxesTable, rapid_mm_min: f64) -> [Axis; 3] {
    let nothing = AxisTable::default();
    [("x", &axes.x), ("y", &axes.y), ("z", &axes.z)]
        .map(|(name, table)| axis(reader, name, table.as_ref().unwrap_or(&nothing), rapid_mm_min))
}

/// A number that was converted and is converted back, as it was written: with nine significant digits, for 15000.000000000002 is 15000.
fn as_written(converted: f64) -> f64 {
    format!("{converted:.8e}").parse().unwrap_or(converted)
}

fn axis(reader: &mut Reader, name: &str, table: &AxisTable, rapid_mm_min: f64) -> Axis {
    let key = |what: &str| format!("machine.axes.{name}.{what}");
    Axis {
        velocity_mm_s: reader.or(
            &key("velocity"),
            table.velocity.as_ref(),
            Dimension::Feed,
            Sense::Positive,
            as_written(rapid_mm_min),
        ),
        acceleration_mm_s2: reader.or(
            &key("acceleration"),
            table.acceleration.as_ref(),
            Dimension::Acceleration,
            Sense::Positive,
            1000.0,
        ),
        jerk_mm_s3: reader.optional(&key("jerk"), table.jerk.as_ref(), Dimension::Jerk, Sense::Positive),
    }
}

fn spindle(reader: &mut Reader, table: &SpindleTable) -> Spindle {
    let mut curve = |key: &str, written: Option<&Curve>, y: Dimension, sense: Sense| {
        written.map(|curve| reader.curve(&format!("machine.spindle.{key}"), curve, Dimension::Speed, y, sense))
    };
    let power_w = curve("power", table.power.as_ref(), Dimension::Power, Sense::NotNegative);
    let torque_nmm = curve("torque", table.torque.as_ref(), Dimension::Torque, Sense::NotNegative);
    let tare_w = curve("tare", table.tare.as_ref(), Dimension::Power, Sense::NotNegative);
    if tare_w.is_none() {
        reader.assume("machine.spindle.tare", "0 W", "default");
    }
    let ratio = Sense::Within(0.0, 1.5, "it is motor shaft power over meter reading, usually 0.8 to 1");
    let efficiency = table.efficiency.as_ref();
    let efficiency =
        efficiency.map(|c| reader.curve("machine.spindle.efficiency", c, Dimension::Power, Dimension::Ratio, ratio));
    if efficiency.is_none() {
        reader.assume("machine.spindle.efficiency", "1", "default");
    }
    Spindle {
        max_rps: reader.or(
            "machine.spindle.max_rpm",
            table.max_rpm.as_ref(),
            Dimension::Speed,
            Sense::Positive,
            24000.0,
        ),
        power_w,
        torque_nmm,
        tare_w: tare_w.unwrap_or_else(|| Table::constant(0.0)),
        efficiency: efficiency.unwrap_or_else(|| Table::constant(1.0)),
        runup_time_s: reader.or(
            "machine.spindle.runup_time",
            table.runup_time.as_ref(),
            Dimension::Time,
            Sense::NotNegative,
            0.0,
        ),
    }
}

fn origins(reader: &mut Reader, written: &BTreeMap<String, [Quantity; 3]>) -> Vec<(u16, Vec3)> {
    let mut origins: Vec<(u16, Vec3)> = Vec::new();
    for (name, point) in written {
        let key = format!("offsets.{name}");
        match offset_number(name) {
            Some(number) => origins.push((number, reader.point(&key, point))),
            None => reader.complain(&key, "is no work offset", OFFSET_NAMES),
        }
    }
    origins
}

/// Names of work offsets, for messages.
pub const OFFSET_NAMES: &str = "write G54 to G59, G59.1 to G59.3, \"G54.1 P1\", \"G154 P1\", on a Siemens G505 to G599";

/// Number of a work offset as the toolpath has it: "G55" → 55; G59.1 to G59.3 → 60 to 62; "G54.1 P2", "G54 P2", "G154 P2" → 102; G505 → 505.
pub fn offset_number(name: &str) -> Option<u16> {
    let name: String = name.chars().filter(|letter| !letter.is_whitespace()).collect::<String>().to_ascii_uppercase();
    let code = name.strip_prefix('G')?;
    if let Some((code, number)) = code.split_once('P') {
        let number = number.parse().ok().filter(|number| (1..=ADDITIONAL_OFFSETS).contains(number))?;
        return ["54", "54.1", "154"].contains(&code).then_some(BEFORE_ADDITIONAL_OFFSETS + number);
    }
    match code {
        "59.1" => Some(60),
        "59.2" => Some(61),
        "59.3" => Some(62),
        plain => plain.parse().ok().filter(|number| (54..=59).contains(number) || (505..=599).contains(number)),
    }
}

#[cfg(test)]
mod tests {
    use super::offset_number;

    #[test]
    fn work_offsets_by_their_names() {
        for (name, number) in [
            ("G54", 54),
            ("g59.3", 62),
            ("G54.1 P1", 101),
            ("G54 P48", 148),
            ("G154P99", 199),
            ("G505", 505),
            ("G599", 599),
        ] {
            assert_eq!(offset_number(name), Some(number), "{name}");
        }
        for name in ["G53", "G60", "G54.1", "G54.1 P0", "G154 P301", "G504", "G600", "54", "G55 P1"] {
            assert_eq!(offset_number(name), None, "{name}");
        }
    }
}
