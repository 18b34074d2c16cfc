//! The report on the life of a tool. In: plain figures. Out: the table of check points, JSON, and lines for the screen.

use serde::Serialize;

use super::number::short;

/// The first columns of the table of check points.
pub const CHECKS_HEAD: &str = "program,check,cycle,line";

/// A cut of a check point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckRow {
    /// Number of the check point.
    pub check: u32,
    /// Number of the cut in it.
    pub cycle: u32,
    /// Line of the written program.
    pub line: u32,
    /// Middle of the reading, mm.
    pub position_mm: [f64; 3],
    /// Length that the tool has cut by then in this program, m.
    pub cut_m: f64,
    /// And in all, m.
    pub total_m: f64,
    /// Feed, mm/min.
    pub feed_mm_min: f64,
    /// Spindle speed, rev/min.
    pub spindle_rpm: f64,
    /// Predicted peak force in the plane at the wear expected there, N.
    pub force_xy_n: f64,
    /// The same on the line to the target, N.
    pub target_force_xy_n: f64,
    /// Predicted power at the motor shaft, W.
    pub power_w: f64,
    /// What the power meter is predicted to read, W.
    pub meter_w: f64,
}

/// What was read at a check point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadRow {
    /// Number of the check point.
    pub check: u32,
    /// Length cut in all, m.
    pub total_m: f64,
    /// Load; a power at the motor shaft.
    pub load: f64,
    /// Its unit.
    pub unit: &'static str,
    /// What the model predicted with the wear known before.
    pub predicted: f64,
    /// Index of wear.
    pub index: f64,
}

/// A life.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LifeReport {
    /// Who wrote it.
    pub written_by: &'static str,
    /// Tool.
    pub tool: u32,
    /// Unit of the index.
    pub index_unit: String,
    /// Index now, of a fresh edge, at the end.
    pub index: [f64; 3],
    /// Standard deviation of the index now.
    pub index_deviation: f64,
    /// Rise of the index per metre at the reference feed, and its standard deviation.
    pub rate_per_m: [f64; 2],
    /// Metre of what: `path` of the tool, or `teeth-way`, what each tooth slides through material.
    pub counted: &'static str,
    /// Exponent of the feed that was regulated with.
    pub exponent: f64,
    /// What the readings say of it, with its standard deviation; `None` with fewer than three of them.
    pub exponent_seen: Option<[f64; 2]>,
    /// First readings that belong to the run-in; readings that hardly count.
    pub left_out: [usize; 2],
    /// Length cut so far, m.
    pub cut_m: f64,
    /// Length to be reached, m.
    pub target_m: f64,
    /// Probability asked for.
    pub assurance: f64,
    /// Length at which the tool is worn out at the pace of the written program: earliest (5 %), most likely, latest (95 %), m.
    pub worn_out_m: [Option<f64>; 3],
    /// The same at the feeds as they came.
    pub worn_out_as_it_came_m: [Option<f64>; 3],
    /// Share of its life that the program may use; `None`: no budget, because slower feeds do not spare the tool.
    pub budget: Option<f64>,
    /// Seconds that a tenth more life costs in this program.
    pub longer_life_costs_s: Option<f64>,
    /// Time of the program before and after, s.
    pub time_s: [f64; 2],
    /// What was read.
    pub readings: Vec<ReadRow>,
    /// Check points of the written program.
    pub check_points: Vec<CheckRow>,
    /// What is to be known.
    pub notes: Vec<String>,
    /// Does it reach the target with the probability asked for?
    pub lasts: bool,
    /// The result in one sentence.
    pub verdict: String,
}

/// The table of check points; the last columns are to be filled in.
pub fn checks_csv(rows: &[CheckRow], program: &str) -> String {
    let mut text = format!(
        "{CHECKS_HEAD},x_mm,y_mm,z_mm,cut_m,total_m,feed_mm_min,planned_rpm,predicted_force_n,target_force_n,\
         predicted_meter_w,force_xy_n,spindle_power_w\n"
    );
    for row in rows {
        let [x, y, z] = row.position_mm;
        text += &format!(
            "{program},{},{},{},{x:.3},{y:.3},{z:.3},{:.3},{:.3},{:.1},{:.0},{:.1},{:.1},{:.1},,\n",
            row.check,
            row.cycle,
            row.line,
            row.cut_m,
            row.total_m,
            row.feed_mm_min,
            row.spindle_rpm,
            row.force_xy_n,
            row.target_force_xy_n,
            row.meter_w
        );
    }
    text
}

/// The report as JSON.
pub fn life_json(report: &LifeReport) -> String {
    serde_json::to_string_pretty(report).expect("a report is plain data") + "\n"
}

/// Lines for the screen.
pub fn life_words(report: &LifeReport) -> String {
    let [index, fresh, end] = report.index;
    let unit = &report.index_unit;
    let span = |[early, likely, late]: [Option<f64>; 3]| {
        let m = |value: Option<f64>| value.map_or("?".to_owned(), short);
        format!("{} m ({} to {} m in nine of ten tools)", m(likely), m(early), m(late))
    };
    let mut text = format!(
        "T{}        {} m cut; index {} ± {} {unit}, fresh {}, worn out {}\n",
        report.tool,
        short(report.cut_m),
        short(index),
        short(report.index_deviation),
        short(fresh),
        short(end)
    );
    let [rate, deviation] = report.rate_per_m;
    let slid = if report.counted == "path" { "" } else { " that a tooth slides" };
    text += &format!(
        "rate      {} ± {} {unit} per m{slid} at the reference feed, with its power {}\n",
        short(rate),
        short(deviation),
        short(report.exponent)
    );
    for row in &report.readings {
        text += &format!(
            "check {:<3} at {} m: read {} {}, predicted {}, index {} {unit}\n",
            row.check,
            short(row.total_m),
            short(row.load),
            row.unit,
            short(row.predicted),
            short(row.index)
        );
    }
    text += &format!("end       as it came {}\n", span(report.worn_out_as_it_came_m));
    text += &format!("          as written {}\n", span(report.worn_out_m));
    let [before, after] = report.time_s;
    text += &format!("target    {} m; program {} s, was {} s", short(report.target_m), short(after), short(before));
    if let Some(costs) = report.longer_life_costs_s {
        text += &format!("; 10 % more life costs {} s", short(costs));
    }
    text += "\n";
    report.notes.iter().for_each(|note| text += &format!("note: {note}\n"));
    text + &report.verdict + "\n"
}
