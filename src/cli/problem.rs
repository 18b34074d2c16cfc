//! `--dump-problem`: the problem that the schedule solves, and its answer, as JSON for other solvers and for people who want to
//! see. In: a run. Out: legs between points in b = v², with caps, accelerations, jerk and the rows of arcs
//! (p b₀ + q b₁ ≤ r), the caps at the points, and the b that was found with its price.

use serde::Serialize;

use crate::outcome::ProgramRun;
use crate::report::WRITTEN_BY;
use crate::schedule::exact_pass::Leg;
use crate::schedule::optimum::optimum;
use crate::schedule::solve::node_track;

#[derive(Serialize)]
struct Problem<'a> {
    written_by: &'static str,
    file: &'a str,
    units: &'static str,
    solved_by: String,
    legs: Vec<LegPart>,
    points: Vec<PointPart>,
    time_s: f64,
}

#[derive(Serialize)]
struct LegPart {
    line: u32,
    length_mm: f64,
    cap_b: f64,
    /// Along a straight leg, either way; of an arc its rows say it.
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration_mm_s2: Option<f64>,
    /// Absent: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    jerk_mm_s3: Option<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    rows: Vec<[f64; 3]>,
}

#[derive(Serialize)]
struct PointPart {
    /// Absent: only the caps of the legs.
    #[serde(skip_serializing_if = "Option::is_none")]
    cap_b: Option<f64>,
    b: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    price_s: Option<f64>,
}

/// The problem as text.
pub fn json(run: &ProgramRun, file: &str) -> String {
    let found = optimum(node_track(&run.problem, &run.toolpath, &run.job), 0.0);
    let finite = |value: f64| value.is_finite().then_some(value);
    let leg = |(i, leg): (usize, &Leg)| LegPart {
        line: run.toolpath.moves[found.moves[i].ix()].line,
        length_mm: leg.ds_mm,
        cap_b: leg.cap_b,
        acceleration_mm_s2: (leg.row_count == 0).then_some(leg.accel_mm_s2),
        jerk_mm_s3: finite(leg.jerk_mm_s3),
        rows: found.chain.rows_of(leg).iter().map(|row| [row.p, row.q, row.r]).collect(),
    };
    let point = |i: usize| PointPart {
        cap_b: finite(found.chain.point_b[i]),
        b: found.b[i],
        price_s: finite(found.window_price_s[i]),
    };
    let problem = Problem {
        written_by: WRITTEN_BY,
        file,
        units: "mm, s; b in mm²/s²",
        solved_by: found.how(),
        legs: found.chain.legs.iter().enumerate().map(leg).collect(),
        points: (0..found.b.len()).map(point).collect(),
        time_s: found.leg_times().iter().sum(),
    };
    serde_json::to_string(&problem).expect("plain data") + "\n"
}
