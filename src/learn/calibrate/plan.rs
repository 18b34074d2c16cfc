//! `calibrate --plan`: the test cuts that a calibration needs, as an NC program, with the expected errors of the
//! coefficients.
//!
//! In: kind and job (tool, block, spindle, declared coefficients). Out: [`Plan`]. *power*: eight radial depths (0.05 …
//! 1 D) with four feeds each at half a diameter of axial depth, so that removal rate and contact rate vary
//! independently; *mean-force*: an L9 orthogonal array (Taguchi) of depth, width and feed, deepest first; *layer*: a
//! ball end in steps of depth, two widths with two feeds each, chosen by [`layer_design`](super::layer_design); the
//! difference of two steps is the force of one layer. Condition and expected errors are those of the calibration itself
//! ([`crate::learn::calibrate`]), with readings by the declared coefficients and 3 % noise.

use crate::force::closed::ball_layer;
use crate::force::closed::mean_force_factors;
use crate::learn::calibrate::calibrate;
use crate::learn::calibrate::calibration::CalibrateOptions;
use crate::learn::calibrate::layer_design::{Allowed, NOISE, best};
use crate::learn::calibrate::test_program::{Action, LEFT_MM, Pass, program};
use crate::learn::dataset::steady_table::{SteadyRow, TableTool, row_rates, rows};
use crate::learn::log::columns::{DataError, read};
use crate::learn::program::declared::declared_or_aluminium;
use crate::learn::regress::random::Chance;
use crate::learn::report::Estimate;
use crate::machine::material::LinearEdge;
use crate::machine::{Box3, Job, Shape, StockShape, Tool};
use crate::units::{rpm_from_rps, rps_from_rpm, watts_from_n_mm_s};
use std::f64::consts::PI;

/// What is to be calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// k_tc, k_te, tare from spindle power.
    Power,
    /// k_tc, k_rc, k_te, k_re from mean forces.
    MeanForce,
    /// The layer model of a ball end (Nishida).
    Layer,
}

/// One measured cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestCut {
    /// Depth along the axis, mm.
    pub axial_mm: f64,
    /// Width, mm.
    pub radial_mm: f64,
    /// Feed per tooth, mm.
    pub feed_per_tooth_mm: f64,
}

/// Planned test cuts.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Model to be calibrated.
    pub model: &'static str,
    /// Measured cuts in order.
    pub cuts: Vec<TestCut>,
    /// NC program.
    pub program: String,
    /// Table in the columns of `calibrate`, those of the readings empty.
    pub table: String,
    /// Condition number that the fit will have.
    pub condition: f64,
    /// Coefficients with the standard errors expected with 3 % noise.
    pub expected: Vec<Estimate>,
    /// Assumptions.
    pub notes: Vec<String>,
}

/// Radial depths, diameters, in an order that does not correlate with time; feeds as shares of the largest.
const IMMERSIONS: [f64; 8] = [0.4, 0.1, 0.75, 0.3, 1.0, 0.2, 0.5, 0.05];
const FEED_LEVELS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// Levels of (feed, width) for each depth, deepest first: an orthogonal array.
const L9: [(usize, [usize; 2]); 9] = [
    (2, [0, 2]),
    (2, [1, 0]),
    (2, [2, 1]),
    (1, [0, 1]),
    (1, [1, 2]),
    (1, [2, 0]),
    (0, [0, 0]),
    (0, [1, 1]),
    (0, [2, 2]),
];

/// Plans the tests of a kind.
pub fn plan(kind: Kind, job: &Job) -> Result<Plan, DataError> {
    let shape = if kind == Kind::Layer { Shape::Ball } else { Shape::Flat };
    let tool = job.tools.iter().find(|tool| tool.shape == shape).ok_or_else(|| {
        DataError::Unfit(format!(
            "the setup has no {} end mill for these tests",
            if shape == Shape::Ball { "ball" } else { "flat" }
        ))
    })?;
    let k = declared_or_aluminium(job, tool);
    let rps = speed(job, tool, &k);
    let planner = Planner { job, tool, block: block(job)?, k, rps };
    let (model, cuts, actions) = match kind {
        Kind::Power => planner.power()?,
        Kind::MeanForce => planner.mean_force(),
        Kind::Layer => planner.layer()?,
    };
    let measured_cuts = if kind == Kind::Power { planner.with_air(&actions) } else { cuts.clone() };
    let (condition, expected) = conditioning(&planner, kind, model, &measured_cuts)?;
    let mut notes = vec![format!(
        "T{} at {:.0} rev/min: check that speed, depth and feeds suit tool, material and clamping before you run it",
        tool.number,
        rpm_from_rps(rps)
    )];
    if kind == Kind::MeanForce {
        notes.push("the deepest cuts come first: wear during the tests would look like an effect of depth".into());
    }
    let stated = expected.iter().map(|v| format!("{} = {:.4} ± {:.4} {}", v.name, v.value, v.std_error, v.unit));
    let mut title = vec![
        format!("{} test cuts for calibrate --model {model}, condition {condition:.1}", cuts.len()),
        format!("expected at {:.0} % noise: {}", 100.0 * NOISE, stated.collect::<Vec<_>>().join(", ")),
    ];
    title.extend(notes.iter().cloned());
    let program = program(&title, &actions, tool, &planner.block)?;
    let table = table_text(&planner, kind, &measured_cuts, |_| vec![String::new(); measured_columns(kind).len()]);
    Ok(Plan { model, cuts, program, table, condition, expected, notes })
}

/// Spindle speed, rev/s: 200 m/min if k_tc < 1200 N/mm² (soft materials), else 100 m/min, within the range of the
/// spindle. Judgement.
fn speed(job: &Job, tool: &Tool, k: &LinearEdge) -> f64 {
    let m_min = if k.k_tc < 1200.0 { 200.0 } else { 100.0 };
    let rpm = (m_min * 1000.0 / (PI * tool.diameter_mm)).min(rpm_from_rps(job.machine.spindle.max_rps));
    rps_from_rpm((rpm / 10.0).floor() * 10.0)
}

/// The box of the setup's first stock.
pub(in crate::learn) fn block(job: &Job) -> Result<Box3, DataError> {
    match job.stocks.first().map(|stock| &stock.shape) {
        Some(StockShape::Box(block)) => Ok(*block),
        _ => Err(DataError::Unfit("test cuts need a stock that is a box: [stock] box = { min = …, max = … }".into())),
    }
}

struct Planner<'a> {
    job: &'a Job,
    tool: &'a Tool,
    block: Box3,
    k: LinearEdge,
    rps: f64,
}

type Cuts = (&'static str, Vec<TestCut>, Vec<Action>);

impl Planner<'_> {
    fn feed_mm_s(&self, per_tooth_mm: f64) -> f64 {
        per_tooth_mm * f64::from(self.tool.flutes) * self.rps
    }

    fn pass(&self, axial_mm: f64, radial_mm: f64, feeds_per_tooth: &[f64], note: String) -> Action {
        let feeds_mm_s = feeds_per_tooth.iter().map(|f| self.feed_mm_s(*f)).collect();
        Action::Pass(Pass { axial_mm, radial_mm, up: false, rps: self.rps, feeds_mm_s, note })
    }

    fn air(&self) -> Action {
        Action::Air { rps: self.rps, seconds: 8.0 }
    }

    fn power(&self) -> Result<Cuts, DataError> {
        let d = self.tool.diameter_mm;
        let largest = 0.01 * d;
        let axial_mm = self.depth_within_power(largest)?;
        let (mut cuts, mut actions) = (Vec::new(), vec![self.air()]);
        for (k, immersion) in IMMERSIONS.iter().enumerate() {
            let mut feeds = FEED_LEVELS.map(|level| level * largest);
            // Every other pass has its feeds in reverse order, so that feed and position in X are not correlated.
            if k % 2 == 1 {
                feeds.reverse();
            }
            let radial_mm = immersion * d;
            cuts.extend(feeds.map(|f| TestCut { axial_mm, radial_mm, feed_per_tooth_mm: f }));
            actions.push(self.pass(axial_mm, radial_mm, &feeds, format!("CUT AP {axial_mm:.3} AE {radial_mm:.3}")));
            if k == 3 {
                actions.push(self.air());
            }
        }
        actions.push(self.air());
        Ok(("power", cuts, actions))
    }

    /// All steady cuts that a log of the power tests has: the test cuts, and the passes in air for the tare.
    fn with_air(&self, actions: &[Action]) -> Vec<TestCut> {
        let cut = |axial_mm: f64, radial_mm: f64, feed_mm_s: f64| {
            let feed_per_tooth_mm = feed_mm_s / self.feed_mm_s(1.0);
            TestCut { axial_mm, radial_mm, feed_per_tooth_mm }
        };
        let length_mm = self.block.max.x - self.block.min.x;
        let of = |action: &Action| match action {
            Action::Air { seconds, .. } => vec![cut(0.0, 0.0, 2.0 * length_mm / seconds); 2],
            Action::Pass(pass) => pass.feeds_mm_s.iter().map(|f| cut(pass.axial_mm, pass.radial_mm, *f)).collect(),
        };
        actions.iter().flat_map(of).collect()
    }

    /// Axial depth, mm: half a diameter, or less if flute length, block or spindle power require it.
    fn depth_within_power(&self, feed_per_tooth_mm: f64) -> Result<f64, DataError> {
        let d = self.tool.diameter_mm;
        let height = self.block.max.z - self.block.min.z;
        let deep = (0.5 * d).min(0.9 * self.tool.flute_length_mm).min(0.4 * height);
        let teeth = f64::from(self.tool.flutes) * self.rps;
        let per_mm_w =
            watts_from_n_mm_s(self.k.k_tc * d * self.feed_mm_s(feed_per_tooth_mm) + self.k.k_te * 0.5 * d * PI * teeth);
        let spindle = &self.job.machine.spindle;
        let available = spindle.power_w.as_ref().map_or(f64::INFINITY, |p| p.at(self.rps));
        let free = 0.8 * available - spindle.tare_w.at(self.rps);
        let depth = (deep.min(free / per_mm_w) * 20.0).floor() / 20.0;
        if depth < 0.1 {
            return Err(DataError::Unfit("the spindle has no power for test cuts at this speed".into()));
        }
        Ok(depth)
    }

    fn mean_force(&self) -> Cuts {
        let d = self.tool.diameter_mm;
        let depths = [0.15, 0.3, 0.45].map(|x| x * d);
        let widths = [0.2, 0.45, 0.7].map(|x| x * d);
        let feeds = [0.0025, 0.005, 0.01].map(|x| x * d);
        let cut = |(depth, [feed, width]): &(usize, [usize; 2])| TestCut {
            axial_mm: depths[*depth],
            radial_mm: widths[*width],
            feed_per_tooth_mm: feeds[*feed],
        };
        let cuts: Vec<TestCut> = L9.iter().map(cut).collect();
        let passes = cuts.iter().map(|c| self.noted_pass(c));
        let actions = std::iter::once(self.air()).chain(passes).chain([self.air()]).collect();
        ("linear-edge", cuts, actions)
    }

    fn noted_pass(&self, c: &TestCut) -> Action {
        let note = format!("CUT AP {:.3} AE {:.3}", c.axial_mm, c.radial_mm);
        self.pass(c.axial_mm, c.radial_mm, &[c.feed_per_tooth_mm], note)
    }

    fn layer(&self) -> Result<Cuts, DataError> {
        let r = self.tool.radius_mm();
        let limits = self.job.limits.overridden_by(&self.tool.limits);
        let allowed = Allowed {
            force_n: limits.force_xy_n.unwrap_or(f64::INFINITY),
            width_mm: self.block.max.y - self.block.min.y - LEFT_MM,
        };
        let (design, _) = best(r, &self.k, allowed).ok_or_else(|| {
            DataError::Unfit(
                "no layer cuts are within limits.force_xy and the block of the setup: the block is too small, or the \
                 limit too low"
                    .into(),
            )
        })?;
        let (mut cuts, mut actions) = (Vec::new(), vec![self.air()]);
        let lowest = design.feeds_mm.as_flattened().iter().copied().fold(f64::INFINITY, f64::min);
        for step in 1..=design.steps.0 {
            let axial_mm = design.steps.1 * f64::from(step);
            // The groove that the measured passes widen: first at the edge of the block, then deeper at the same place.
            let into = if step == 1 { r } else { 0.0 };
            actions.push(self.pass(axial_mm, into, &[lowest], "GROOVE".into()));
            for (radial_mm, feeds) in design.widths_mm.into_iter().zip(design.feeds_mm) {
                cuts.extend(feeds.map(|f| TestCut { axial_mm, radial_mm, feed_per_tooth_mm: f }));
                actions.push(self.pass(axial_mm, radial_mm, &feeds, format!("CUT AP {axial_mm:.3} AE {radial_mm:.3}")));
            }
        }
        actions.push(self.air());
        Ok(("layer", cuts, actions))
    }
}

fn measured_columns(kind: Kind) -> &'static [&'static str] {
    match kind {
        Kind::Power => &["spindle_power_w"],
        Kind::MeanForce => &["force_x_n", "force_y_n"],
        Kind::Layer => &["force_xy_n"],
    }
}

/// The cuts as a table; `readings` gives the measured cells of each.
fn table_text(planner: &Planner, kind: Kind, cuts: &[TestCut], readings: impl Fn(usize) -> Vec<String>) -> String {
    let mut text = format!(
        "order,group,tool,spindle_rpm,feed_per_tooth_mm,axial_depth_mm,radial_depth_mm,side,{}\n",
        measured_columns(kind).join(",")
    );
    for (k, c) in cuts.iter().enumerate() {
        text += &format!(
            "{},{:.3},{},{:.0},{:.5},{:.4},{:.4},down,{}\n",
            k + 1,
            c.radial_mm,
            planner.tool.number,
            rpm_from_rps(planner.rps),
            c.feed_per_tooth_mm,
            c.axial_mm,
            c.radial_mm,
            readings(k).join(",")
        );
    }
    text
}

/// Condition number and expected errors, by calibrating on readings from the declared coefficients with noise.
fn conditioning(
    planner: &Planner,
    kind: Kind,
    model: &str,
    cuts: &[TestCut],
) -> Result<(f64, Vec<Estimate>), DataError> {
    let tool = TableTool {
        number: planner.tool.number,
        diameter_mm: planner.tool.diameter_mm,
        flutes: planner.tool.flutes,
        shape: planner.tool.shape,
    };
    let blank = table_text(planner, kind, cuts, |_| vec![String::new(); measured_columns(kind).len()]);
    let planned = rows(&read(blank.as_bytes(), &[])?, &[tool])?;
    let mut chance = Chance::new(1);
    let mut normal = || (0..12).map(|_| chance.unit()).sum::<f64>() - 6.0;
    let cells: Vec<Vec<String>> = planned
        .iter()
        .map(|row| readings(planner, kind, row).iter().map(|y| (y * (1.0 + NOISE * normal())).to_string()).collect())
        .collect();
    let filled = table_text(planner, kind, cuts, |k| cells[k].clone());
    let frame = read(filled.as_bytes(), &[])?;
    let result = calibrate(&frame, &planned, model, CalibrateOptions::default(), |y| y)?;
    Ok((result.condition, result.parameters))
}

/// Readings of a cut by the declared coefficients.
fn readings(planner: &Planner, kind: Kind, row: &SteadyRow) -> Vec<f64> {
    let k = &planner.k;
    match kind {
        Kind::Power => {
            let r = row_rates(row, true);
            let cutting_w = watts_from_n_mm_s(k.k_tc * r.removal_rate_mm3_s + k.k_te * r.contact_rate_mm2_s);
            vec![planner.job.machine.spindle.tare_w.at(planner.rps) + cutting_w]
        }
        Kind::MeanForce => {
            let of = |y: bool| {
                mean_force_factors(&row.cut, row.is_conventional(), y)
                    .iter()
                    .zip([k.k_tc, k.k_rc, k.k_te, k.k_re])
                    .map(|(x, k)| x * k)
                    .sum()
            };
            vec![of(false), of(true)]
        }
        Kind::Layer => vec![layered_force(planner, row)],
    }
}

/// Force of a ball end, N: sum over 50 layers of (k_tc t_m + k_te)·dz.
fn layered_force(planner: &Planner, row: &SteadyRow) -> f64 {
    let c = &row.cut;
    let fz = c.feed_mm_s / (f64::from(c.flutes) * c.rps);
    let layers = 50;
    let dz = c.axial_depth_mm / f64::from(layers);
    let force = |k: u32| {
        let height = (f64::from(k) + 0.5) * dz;
        let (_, chip) = ball_layer(0.5 * c.diameter_mm, height, c.radial_depth_mm, fz);
        (planner.k.k_tc * chip + planner.k.k_te) * dz
    };
    (0..layers).map(force).sum()
}
