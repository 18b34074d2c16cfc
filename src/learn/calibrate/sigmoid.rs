//! Calibration of `sigmoid` (Ko, Yun, Cho): normal pressure over chip thickness, friction, chip-flow angle and runout
//! from one record of instantaneous forces with the spindle angle.
//!
//! In: samples of one steady cut (spindle angle, degrees; forces on the workpiece or the tool, N: x along the feed, y
//! to its left, z up), and the tool. They are averaged at the rotation angles at which the force model samples a turn.
//! Unknown: A1, A2, x0, dx of ln K_n = A2 + (A1 − A2)/(1 + exp((t − x0)/dx)), K_n in N/mm², t = chip thickness / range
//! of the record; friction coefficient K_f; chip-flow angle; offset and direction of the runout; angle of tooth 1 at
//! the encoder's zero. Out: these by nonlinear least squares on all force components, started from several directions
//! of the runout. Chips of the record cover only one flank of the sigmoid, so that A1 and x0 are correlated; well
//! determined is the curve K_n(t), which is reported with its standard error.

use crate::engage::EngagedArc;
use crate::force::closed::{entry_exit_rad, immersion_rad};
use crate::force::{Cut, Cutter};
use crate::learn::calibrate::calibration::Calibration;
use crate::learn::dataset::errors::errors;
use crate::learn::dataset::samples::Data;
use crate::learn::dataset::steady_table::{Side, SteadyRow};
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::regress::levenberg_marquardt::{Solution, Variable, levenberg_marquardt};
use crate::learn::report::Estimate;
use crate::machine::material::{ForceModel, Material, Process};
use crate::machine::{Runout, Shape, Slice, Spindle, Table, Tool};
use std::f64::consts::{PI, TAU};

/// Number of rings over the axial depth.
const RINGS: usize = 30;
/// Fewest samples, and least share of a turn that they must cover. Judgement.
const FEWEST: usize = 72;
const COVERED: f64 = 0.8;
/// Least R² of the model on the record. Judgement.
const LEAST_R2: f64 = 0.9;

/// Variables of the search; start values for aluminium.
const VARIABLES: [Variable; 9] = [
    Variable { start: 12.0, step: 1e-3, low: 7.0, high: 18.0 }, // a1
    Variable { start: 7.0, step: 1e-3, low: 3.0, high: 10.0 },  // a2
    Variable { start: -0.5, step: 1e-3, low: -3.0, high: 3.0 }, // x0
    Variable { start: 0.5, step: 1e-3, low: 0.05, high: 3.0 },  // dx
    Variable { start: 0.7, step: 1e-3, low: 0.0, high: 3.0 },   // k_f
    Variable { start: 0.3, step: 1e-3, low: -1.5, high: 1.5 },  // chip_flow
    Variable { start: 0.003, step: 1e-5, low: 0.0, high: 0.2 }, // offset of the runout, mm
    Variable { start: 0.0, step: 1e-3, low: -TAU, high: 2.0 * TAU }, // its direction, rad
    Variable { start: 0.0, step: 1e-3, low: -TAU, high: 2.0 * TAU }, // tooth 1 at the encoder's zero, rad
];
const NAMES: [(&str, &str); 6] =
    [("a1", "ln(N/mm²)"), ("a2", "ln(N/mm²)"), ("x0", "-"), ("dx", "-"), ("k_f", "-"), ("chip_flow", "rad")];

/// Calibrates the model from a record; every row of the table is a sample of the same cut.
pub fn calibrate(frame: &Frame, rows: &[SteadyRow], tool: &Tool, on_tool: bool) -> Result<Calibration, DataError> {
    let cut = RecordedCut::new(rows, tool)?;
    let record = Record::new(frame, &cut, on_tool)?;
    let phase = record.phase(&cut);
    let own = |k: usize, start: f64| Variable { start, ..VARIABLES[k] };
    let search = |direction: f64, rounds: usize| {
        let mut variables = VARIABLES;
        (variables[7], variables[8]) = (own(7, direction), own(8, phase));
        levenberg_marquardt(&variables, rounds, |x| record.residuals(&cut.forces(x, 0.0), x[8]))
    };
    let first = (0..8)
        .filter_map(|k| search(TAU * f64::from(k) / 8.0, 8))
        .min_by(|a, b| a.squares().total_cmp(&b.squares()))
        .ok_or_else(|| DataError::Unfit("the record has values that are no numbers".into()))?;
    // The range that normalises the chip thickness is fixed now, so that the curve is one over mm and holds at other
    // feeds.
    let range_mm = cut.thickest(&first.x);
    let mut variables = VARIABLES;
    variables.iter_mut().zip(&first.x).for_each(|(v, x)| v.start = *x);
    let solution = levenberg_marquardt(&variables, 60, |x| record.residuals(&cut.forces(x, range_mm), x[8]))
        .ok_or_else(|| DataError::Unfit("the record has values that are no numbers".into()))?;
    calibration_of(&record, &solution, range_mm)
}

/// Force model with these variables.
fn model(x: &[f64], range_mm: f64) -> ForceModel {
    let own = NAMES.iter().zip(x).map(|((name, _), value)| ((*name).to_owned(), *value));
    ForceModel::Named { name: "sigmoid".into(), parameters: own.chain([("chip_range".to_owned(), range_mm)]).collect() }
}

/// The cut of a record.
struct RecordedCut {
    tool: Tool,
    slices: Vec<Slice>,
    arcs: Vec<EngagedArc>,
    feed_mm_s: f64,
    rps: f64,
    spindle: Spindle,
}

impl RecordedCut {
    fn new(rows: &[SteadyRow], tool: &Tool) -> Result<Self, DataError> {
        let first = rows.first().ok_or(DataError::Empty("the record has no samples"))?;
        let (c, r) = (&first.cut, tool.radius_mm());
        let same = |row: &SteadyRow| {
            let near = |a: f64, b: f64| (a - b).abs() <= 0.02 * b.abs();
            near(row.cut.axial_depth_mm, c.axial_depth_mm)
                && near(row.cut.radial_depth_mm, c.radial_depth_mm)
                && near(row.cut.feed_mm_s, c.feed_mm_s)
        };
        if !rows.iter().all(same) {
            return Err(DataError::Unfit(
                "a record for the model sigmoid is one steady cut: its depths and feed must not change".into(),
            ));
        }
        if tool.shape != Shape::Flat {
            return Err(DataError::Unfit("the model sigmoid is identified with a flat end mill".into()));
        }
        let immersion = immersion_rad(r, c.radial_depth_mm, None);
        let (entry, exit) = entry_exit_rad(immersion, first.side != Side::Up);
        let edge_mm = c.axial_depth_mm / RINGS as f64;
        let ring = |k: usize| Slice {
            z_mm: (k as f64 + 0.5) * edge_mm,
            radius_mm: r,
            edge_mm,
            normal_r: 1.0,
            normal_z: 0.0,
            segment: 1,
        };
        let arc = |k: usize| EngagedArc { slice: k as u32, entry_rad: entry as f32, exit_rad: exit as f32 };
        Ok(Self {
            tool: tool.clone(),
            slices: (0..RINGS).map(ring).collect(),
            arcs: (0..RINGS).map(arc).collect(),
            feed_mm_s: c.feed_mm_s,
            rps: c.rps,
            spindle: Spindle {
                max_rps: f64::INFINITY,
                power_w: None,
                torque_nmm: None,
                tare_w: Table::constant(0.0),
                efficiency: Table::constant(1.0),
                runup_time_s: 0.0,
            },
        })
    }

    fn cutter(&self, x: &[f64], range_mm: f64) -> Option<Cutter> {
        let runout = Some(Runout { offset_mm: x[6].max(1e-9), angle_rad: x[7] });
        let tool = Tool { runout, ..self.tool.clone() };
        let material = Material { name: String::new(), model: model(x, range_mm), uncertainty: None };
        Cutter::new(&tool, &material, &self.spindle, &Process::default(), &self.slices, self.rps).ok()
    }

    /// Forces on the tool at the angles of a turn, N; empty if the variables give no valid model.
    fn forces(&self, x: &[f64], range_mm: f64) -> Vec<[f64; 3]> {
        let line = self.cutter(x, range_mm).map(|c| c.line(&Cut { arcs: &self.arcs, ..Cut::default() }));
        line.map_or_else(Vec::new, |line| line.through_a_turn(self.feed_mm_s))
    }

    fn thickest(&self, x: &[f64]) -> f64 {
        let cut = Cut { arcs: &self.arcs, ..Cut::default() };
        self.cutter(x, 0.0).map_or(0.0, |cutter| cutter.loads(&cut, self.feed_mm_s).chip_thickness_max_mm)
    }
}

/// Forces on the tool, averaged over the turns of a record.
struct Record {
    /// Mean of each component at each angle.
    mean: Vec<[f64; 3]>,
    /// Number of samples at each angle.
    count: Vec<f64>,
    /// Components that were measured.
    components: Vec<usize>,
}

impl Record {
    fn new(frame: &Frame, cut: &RecordedCut, on_tool: bool) -> Result<Self, DataError> {
        let angle = frame.needed("spindle_angle_deg")?;
        let forces = [frame.needed("force_x_n")?, frame.needed("force_y_n")?];
        let axial = frame.numbers("force_z_n").filter(|z| z.iter().any(|v| v.is_finite()));
        let components = if axial.is_some() { vec![0, 1, 2] } else { vec![0, 1] };
        let forces = [forces[0].clone(), forces[1].clone(), axial.unwrap_or_else(|| vec![0.0; angle.len()])];
        let start: Vec<f64> = VARIABLES.iter().map(|v| v.start).collect();
        let angles = cut.forces(&start, 0.0).len().max(1);
        let (mut mean, mut count) = (vec![[0.0; 3]; angles], vec![0.0; angles]);
        let sign = if on_tool { 1.0 } else { -1.0 };
        for i in 0..angle.len() {
            if !angle[i].is_finite() || !components.iter().all(|c| forces[*c][i].is_finite()) {
                continue;
            }
            let k = ((angle[i].to_radians().rem_euclid(TAU) / TAU * angles as f64) as usize).min(angles - 1);
            for &c in &components {
                mean[k][c] += sign * forces[c][i];
            }
            count[k] += 1.0;
        }
        let samples = count.iter().sum::<f64>() as usize;
        let covered = covered(&count);
        if samples < FEWEST || covered < COVERED {
            return Err(DataError::Unfit(format!(
                "{samples} samples over {:.0} % of a turn do not show the teeth; give at least {FEWEST} over a whole \
                 turn",
                100.0 * covered
            )));
        }
        for (sum, n) in mean.iter_mut().zip(&count) {
            for force in sum.iter_mut() {
                *force /= f64::max(*n, 1.0);
            }
        }
        Ok(Self { mean, count, components })
    }

    /// Measured less modelled force, times the square root of the number of samples, for each angle and component.
    fn residuals(&self, forces: &[[f64; 3]], phase_rad: f64) -> Vec<f64> {
        let n = self.mean.len();
        let mut out = Vec::with_capacity(n * self.components.len());
        for k in (0..n).filter(|k| self.count[*k] > 0.0) {
            for &c in &self.components {
                let modelled = interpolated(forces, k as f64 + phase_rad / TAU * n as f64, c);
                out.push(self.count[k].sqrt() * (self.mean[k][c] - modelled));
            }
        }
        out
    }

    /// Start value for the angle of tooth 1 at the encoder's zero, rad, within a pitch: best fit of teeth without
    /// runout, up to a factor on the force.
    fn phase(&self, cut: &RecordedCut) -> f64 {
        let mut start: Vec<f64> = VARIABLES.iter().map(|v| v.start).collect();
        start[6] = 0.0;
        let forces = cut.forces(&start, 0.0);
        let pitch = TAU / f64::from(cut.tool.flutes);
        let zero = vec![[0.0; 3]; forces.len()];
        let measured = self.residuals(&zero, 0.0);
        let miss = |phase: f64| {
            let shape: Vec<f64> = self.residuals(&forces, phase).iter().zip(&measured).map(|(r, y)| y - r).collect();
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            -dot(&shape, &measured).max(0.0).powi(2) / dot(&shape, &shape).max(1e-300)
        };
        let steps = 60;
        (0..steps)
            .map(|k| pitch * f64::from(k) / f64::from(steps))
            .min_by(|a, b| miss(*a).total_cmp(&miss(*b)))
            .unwrap_or(0.0)
    }
}

/// Share of the ten-degree sectors of a turn that have samples.
fn covered(count: &[f64]) -> f64 {
    let parts = 36;
    let seen = |p: usize| (p * count.len() / parts..(p + 1) * count.len() / parts).any(|k| count[k] > 0.0);
    (0..parts).filter(|p| seen(*p)).count() as f64 / parts as f64
}

/// A force component, interpolated between two angles of a turn.
fn interpolated(forces: &[[f64; 3]], index: f64, component: usize) -> f64 {
    if forces.is_empty() {
        return f64::NAN;
    }
    let n = forces.len();
    let low = index.floor();
    let (k, t) = (low.rem_euclid(n as f64) as usize % n, index - low);
    forces[k][component] * (1.0 - t) + forces[(k + 1) % n][component] * t
}

/// ln K_n at the normalised chip thickness t.
fn log_pressure(x: &[f64], t: f64) -> f64 {
    x[1] + (x[0] - x[1]) / (1.0 + ((t - x[2]) / x[3]).exp())
}

fn calibration_of(record: &Record, solution: &Solution, range_mm: f64) -> Result<Calibration, DataError> {
    let x = &solution.x;
    let weight: Vec<f64> =
        record.count.iter().filter(|n| **n > 0.0).flat_map(|n| vec![*n; record.components.len()]).collect();
    let reading: Vec<f64> = (0..record.mean.len())
        .filter(|k| record.count[*k] > 0.0)
        .flat_map(|k| record.components.iter().map(move |c| record.mean[k][*c]))
        .collect();
    let judged = Data { reading, weight: weight.clone(), ..Data::default() };
    let train = errors(&judged, |i| solution.residuals[i] / weight[i].sqrt());
    if train.r2 < LEAST_R2 || !train.r2.is_finite() {
        return Err(DataError::Unfit(format!(
            "the model sigmoid explains only {:.0} % of the record: are the columns swapped, or is it another cut?",
            100.0 * train.r2.max(0.0)
        )));
    }
    let error = |j: usize| solution.covariance[j][j].max(0.0).sqrt();
    let value = |name: &str, value: f64, std_error: f64, unit: &str| Estimate {
        name: name.to_owned(),
        value,
        std_error,
        unit: unit.to_owned(),
    };
    let mut parameters: Vec<Estimate> =
        NAMES.iter().enumerate().map(|(j, (name, unit))| value(name, x[j], error(j), unit)).collect();
    parameters.push(value("chip_range", range_mm, 0.0, "mm"));
    let steps: Vec<f64> = VARIABLES.iter().map(|v| v.step).collect();
    let pressure = |t: f64| {
        let relative = solution.variance_of(&steps, |x| log_pressure(x, t)).sqrt();
        let k_n = log_pressure(x, t).exp();
        value(&format!("k_n at {:.3} mm", t * range_mm), k_n, k_n * relative, "N/mm²")
    };
    let degrees = |j: usize| x[j].to_degrees().rem_euclid(360.0);
    let mut derived = vec![
        value("runout_offset", x[6], error(6), "mm"),
        value("runout_angle", degrees(7), error(7).to_degrees(), "deg"),
        value("tooth_1_at_zero", degrees(8), error(8).to_degrees(), "deg"),
    ];
    derived.extend([0.25, 0.5, 1.0].map(pressure));
    Ok(Calibration {
        model: "sigmoid".into(),
        tests: record.count.iter().sum::<f64>() as usize,
        parameters,
        derived,
        covariance: (0..NAMES.len()).map(|a| solution.covariance[a][..NAMES.len()].to_vec()).collect(),
        condition: solution.condition,
        train,
        leave_one_out_rmse: f64::NAN,
        notes: vec![
            "the chips of the record cover one flank of the sigmoid only: a1 and x0 are correlated, well determined is \
             the curve k_n"
                .into(),
            format!(
                "put into the setup's tool: runout = {{ offset = {:.4}, angle = {:.0} }}",
                x[6],
                x[7].rem_euclid(2.0 * PI).to_degrees()
            ),
        ],
        ..Calibration::default()
    })
}
