//! The report of `semifinish`. In: what was found. Out: figures, as JSON and as text.
//!
//! Shares are of the length of the finishing path that cuts what the semi-finish left and whose stock could be chosen; *unbound* is
//! that part of it on which no bound on stock or on its change holds.

use serde::Serialize;

use super::json::{AssumptionPart, assumption_parts};
use super::number::short;
use crate::finish::semifinish::{Answer, CALIBRATED_MM, Gouge, Round, StretchLoads, Wanted};
use crate::force::Loads;
use crate::machine::Job;
use crate::machine::material::ForceModel;
use crate::nc::Toolpath;
use crate::setup::Assumption;

/// What the report is made from.
pub struct Semifinished<'a> {
    /// Names of both programs.
    pub names: [&'a str; 2],
    /// The job.
    pub job: &'a Job,
    /// Motions of both as they came.
    pub paths: &'a [Toolpath; 2],
    /// What was asked for.
    pub wanted: Wanted,
    /// Where the reference comes from.
    pub reference_source: &'static str,
    /// The offsets and what they lead to.
    pub answer: &'a Answer,
    /// Loads of the finish behind the program that was read back, by stretch.
    pub after: &'a [Loads],
    /// Standard deviation of the forces, N, by stretch; empty: not known.
    pub deviation_n: &'a [f64],
    /// Below the surface of the finish.
    pub gouge: Gouge,
    /// Blocks changed, words put in, arcs cut and lines added.
    pub written: [usize; 4],
    /// What the setup does not give.
    pub assumptions: &'a [Assumption],
    /// Warnings of this command.
    pub warnings: Vec<String>,
}

/// Figures of `semifinish`.
#[derive(Debug, Serialize)]
pub struct SemifinishReport<'a> {
    written_by: &'static str,
    semi: String,
    finish: String,
    /// Reference of the force, N, and where it comes from.
    reference_n: f64,
    reference_source: &'static str,
    stock_bounds_mm: [f64; 2],
    change_bound: f64,
    tolerance_mm: f64,
    /// Spacing of the passes, mm.
    pick_semi_mm: Option<f64>,
    pick_finish_mm: Option<f64>,
    force: ForcePart,
    stock: StockPart,
    gouge: GougePart,
    deflection: DeflectionPart,
    /// Stretches more than 10 % off the reference: those on which a bound prevented a constant force, and those on which none holds.
    bounds: Vec<StretchPart>,
    unbound: Vec<StretchPart>,
    moved: MovedPart,
    rounds: Vec<RoundPart>,
    /// One row a stretch of the finishing path.
    path: Vec<PathPart>,
    /// Sentences for people.
    pub warnings: Vec<String>,
    /// Values that the setup does not give.
    assumptions: Vec<AssumptionPart<'a>>,
}

#[derive(Debug, Serialize)]
struct ForcePart {
    before: Spread,
    after: Spread,
    /// Cut length that counts, and the part of it where no bound holds, mm.
    length_mm: f64,
    unbound_mm: f64,
    /// Share of the force, one standard deviation, from the covariance of the coefficients, %; null where it is not known.
    deviation_percent: Option<f64>,
    /// Least force less two standard deviations, and largest with two more, N: 95 % if the coefficients are normal.
    band_n: Option<[f64; 2]>,
    /// Cut length on which the model gives no force at all, mm: it does not hold there.
    no_force_mm: f64,
    /// Cut length on which the force after is more than 10 % above the reference, mm.
    beyond_mm: f64,
}

/// Forces over a length.
#[derive(Debug, Serialize)]
struct Spread {
    least_n: f64,
    mean_n: f64,
    largest_n: f64,
    /// Share of the length within 10 % of the reference, %; and of that where no bound holds.
    within_10_percent: f64,
    unbound_within_10_percent: f64,
}

#[derive(Debug, Serialize)]
struct StockPart {
    before_mm: [f64; 2],
    after_mm: [f64; 2],
    /// Depths for which the force model is calibrated, mm, and the share of the length outside, %; null: the model says nothing.
    calibrated_mm: Option<[f64; 2]>,
    outside_calibrated_percent: Option<f64>,
}

#[derive(Debug, Serialize)]
struct GougePart {
    cells: usize,
    gouged: usize,
    deepest_mm: f64,
    /// The same beside the finished surface, against finish and semi-finish as they came.
    beside: usize,
    beside_mm: f64,
}

#[derive(Debug, Serialize)]
struct DeflectionPart {
    /// Of the tool along the normal of the surface under the peak force, largest, mm.
    normal_before_mm: f64,
    normal_after_mm: f64,
    /// Largest less least of it: what it leaves as an error of form, mm.
    range_before_mm: f64,
    range_after_mm: f64,
    /// What it covers: lateral only.
    covers: &'static str,
}

#[derive(Debug, Serialize)]
struct StretchPart {
    line: u32,
    last_line: u32,
    length_mm: f64,
    force_n: [f64; 2],
    stock_mm: [f64; 2],
}

#[derive(Debug, Serialize)]
struct MovedPart {
    blocks_changed: usize,
    words_added: usize,
    arcs_cut: usize,
    lines_added: usize,
    /// Largest offset of a point, mm: the bound that `--prove … --within` holds.
    largest_offset_mm: f64,
}

#[derive(Debug, Serialize)]
struct RoundPart {
    rms_percent: f64,
    force_n: [f64; 2],
}

#[derive(Debug, Serialize)]
struct PathPart {
    line: u32,
    s_mm: f64,
    length_mm: f64,
    /// The semi-finishing line that left what is met, and mm along it.
    semi_line: Option<u32>,
    semi_s_mm: Option<f64>,
    /// Slope of the surface from the horizontal, deg.
    slope_deg: f64,
    stock_before_mm: f64,
    stock_after_mm: f64,
    force_xy_peak_n_before: f64,
    force_xy_peak_n_after: f64,
    deflection_normal_mm_before: f64,
    deflection_normal_mm_after: f64,
    free: bool,
    bound: bool,
}

/// Deflection along the normal: that in the plane, in the direction of the mean force, as the surface sees it.
fn along_normal(loads: &Loads, seen: &StretchLoads, dir: [f64; 2]) -> f64 {
    let [along, left, _] = loads.mean_force_n;
    let size = along.hypot(left);
    if size <= 0.0 {
        return 0.0;
    }
    let [x, y] = [along * dir[0] - left * dir[1], along * dir[1] + left * dir[0]];
    loads.deflection_mm * (x * seen.normal.x + y * seen.normal.y) / size
}

/// Works out the figures.
pub fn semifinish_report(found: Semifinished<'_>) -> SemifinishReport<'_> {
    let answer = found.answer;
    let paths: Vec<PathPart> = (0..answer.before.len()).map(|k| path(&found, k)).collect();
    let counts: Vec<&PathPart> = paths.iter().filter(|part| part.free).collect();
    let reference_n = answer.reference_n;
    let spread = |force: fn(&PathPart) -> f64| {
        let (mut range, mut sums) = ([f64::INFINITY, 0.0_f64], [0.0; 5]);
        for part in &counts {
            let (value, length) = (force(part), part.length_mm);
            range = [range[0].min(value), range[1].max(value)];
            let within = f64::from((value / reference_n - 1.0).abs() <= 0.1);
            let unbound = f64::from(!part.bound);
            for (sum, add) in sums.iter_mut().zip([1.0, value, within, unbound, unbound * within]) {
                *sum += length * add;
            }
        }
        let share = |part: f64, whole: f64| if whole > 0.0 { 100.0 * part / whole } else { 0.0 };
        let spread = Spread {
            least_n: range[0],
            mean_n: sums[1] / sums[0].max(1e-12),
            largest_n: range[1],
            within_10_percent: share(sums[2], sums[0]),
            unbound_within_10_percent: share(sums[4], sums[3]),
        };
        (spread, [sums[0], sums[3]])
    };
    let (before, _) = spread(|part| part.force_xy_peak_n_before);
    let (after, [length_mm, unbound_mm]) = spread(|part| part.force_xy_peak_n_after);
    let range = |of: fn(&PathPart) -> f64| {
        let values = counts.iter().map(|part| of(part));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    let layers = is_layers(found.job);
    let outside = |part: &&&PathPart| !(CALIBRATED_MM[0]..=CALIBRATED_MM[1]).contains(&part.stock_after_mm);
    let outside_mm: f64 = counts.iter().filter(outside).map(|part| part.length_mm).sum();
    let [deflected_before, deflected_after] =
        [range(|part| part.deflection_normal_mm_before), range(|part| part.deflection_normal_mm_after)];
    let largest = |[low, high]: [f64; 2]| if -low > high { low } else { high };
    let deviation = deviation(&found, &paths);
    let [blocks_changed, words_added, arcs_cut, lines_added] = found.written;
    let stock = |k: usize| {
        let values = answer.chosen.iter().map(|(_, stock)| stock[k]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    SemifinishReport {
        written_by: super::marks::WRITTEN_BY,
        assumptions: assumption_parts(found.assumptions),
        semi: found.names[0].to_owned(),
        finish: found.names[1].to_owned(),
        reference_n,
        reference_source: found.reference_source,
        stock_bounds_mm: found.wanted.stock_mm,
        change_bound: found.wanted.change,
        tolerance_mm: found.wanted.tolerance_mm,
        pick_semi_mm: answer.picks_mm[0],
        pick_finish_mm: answer.picks_mm[1],
        force: ForcePart {
            before,
            after,
            length_mm,
            unbound_mm,
            deviation_percent: deviation,
            band_n: band(&found, &paths),
            no_force_mm: no_force_mm(&counts),
            beyond_mm: {
                let beyond = counts.iter().filter(|part| part.force_xy_peak_n_after > HELD_WITHIN * reference_n);
                beyond.map(|part| part.length_mm).sum()
            },
        },
        stock: StockPart {
            before_mm: stock(0),
            after_mm: stock(1),
            calibrated_mm: layers.then_some(CALIBRATED_MM),
            outside_calibrated_percent: layers.then(|| 100.0 * outside_mm / length_mm.max(1e-12)),
        },
        gouge: gouge_part(found.gouge),
        deflection: DeflectionPart {
            normal_before_mm: largest(deflected_before),
            normal_after_mm: largest(deflected_after),
            range_before_mm: deflected_before[1] - deflected_before[0],
            range_after_mm: deflected_after[1] - deflected_after[0],
            covers: "lateral only: the bending of tool and holder; what the tool gives along its axis is not modelled",
        },
        bounds: off_reference(&paths, reference_n, true),
        unbound: off_reference(&paths, reference_n, false),
        moved: MovedPart {
            blocks_changed,
            words_added,
            arcs_cut,
            lines_added,
            largest_offset_mm: answer.offsets.iter().map(crate::path::Vec3::norm).fold(0.0, f64::max),
        },
        rounds: answer.rounds.iter().map(round).collect(),
        path: paths,
        warnings: found.warnings,
    }
}

fn gouge_part(gouge: Gouge) -> GougePart {
    let Gouge { cells, gouged, deepest_mm, beside, beside_mm, .. } = gouge;
    GougePart { cells, gouged, deepest_mm, beside, beside_mm }
}

fn round(round: &Round) -> RoundPart {
    RoundPart { rms_percent: 100.0 * round.error, force_n: round.force_n }
}

/// Is the force that of a layer model?
fn is_layers(job: &Job) -> bool {
    let named = |model: &ForceModel| matches!(model, ForceModel::Named { name, .. } if name == "layer");
    match &job.process.base {
        Some(base) => named(base),
        None => job.tools.iter().filter_map(|tool| job.material(tool)).any(|material| named(&material.model)),
    }
}

fn path(found: &Semifinished, k: usize) -> PathPart {
    let (before, after) = (&found.answer.before[k], &found.answer.after[k]);
    let motion = &found.paths[1].moves[before.sample.of as usize];
    let along = motion.curve().tangent(before.sample.s_mm);
    let level = along.x.hypot(along.y).max(1e-12);
    let dir = [along.x / level, along.y / level];
    let left = after.left_by.or(before.left_by);
    PathPart {
        line: motion.line,
        s_mm: before.sample.s_mm,
        length_mm: before.sample.length_mm,
        semi_line: left.map(|(of, _)| found.paths[0].moves[of as usize].line),
        semi_s_mm: left.map(|(_, s_mm)| s_mm),
        slope_deg: after.normal.z.clamp(-1.0, 1.0).acos().to_degrees(),
        stock_before_mm: before.stock_mm,
        stock_after_mm: after.stock_mm,
        force_xy_peak_n_before: before.loads.force_xy_peak_n,
        force_xy_peak_n_after: found.after[k].force_xy_peak_n,
        deflection_normal_mm_before: along_normal(&before.loads, before, dir),
        deflection_normal_mm_after: along_normal(&found.after[k], after, dir),
        free: after.free,
        bound: after.bound,
    }
}

/// Length without a force, mm.
fn no_force_mm(counts: &[&PathPart]) -> f64 {
    let none = |part: &&&PathPart| part.force_xy_peak_n_before.min(part.force_xy_peak_n_after) <= 0.0;
    counts.iter().filter(none).map(|part| part.length_mm).sum()
}

/// Standard deviations from the force to the ends of its band.
const BAND: f64 = 2.0;

/// Band of the forces after.
fn band(found: &Semifinished, paths: &[PathPart]) -> Option<[f64; 2]> {
    let ends = paths.iter().zip(found.deviation_n).filter(|(part, _)| part.free).map(|(part, off)| {
        let force = part.force_xy_peak_n_after;
        [(force - BAND * off).max(0.0), force + BAND * off]
    });
    ends.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
}

/// Mean share of the force that one standard deviation of the coefficients makes, %.
fn deviation(found: &Semifinished, paths: &[PathPart]) -> Option<f64> {
    let (mut sum, mut length) = (0.0, 0.0);
    for (part, off) in paths.iter().zip(found.deviation_n).filter(|(part, _)| part.free) {
        if part.force_xy_peak_n_after > 0.0 {
            sum += part.length_mm * off / part.force_xy_peak_n_after;
            length += part.length_mm;
        }
    }
    (length > 0.0).then(|| 100.0 * sum / length)
}

/// Stretches on which the force is off the reference by more than 10 %: those on which a bound on the stock holds, or the others.
fn off_reference(paths: &[PathPart], reference_n: f64, bound: bool) -> Vec<StretchPart> {
    let off = |part: &PathPart| {
        part.free && part.bound == bound && (part.force_xy_peak_n_after / reference_n - 1.0).abs() > 0.1
    };
    let mut found: Vec<StretchPart> = Vec::new();
    for pair in paths.chunk_by(|a, b| off(a) == off(b)).filter(|chunk| off(&chunk[0])) {
        let range = |of: fn(&PathPart) -> f64| {
            pair.iter().map(of).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
        };
        found.push(StretchPart {
            line: pair[0].line,
            last_line: pair[pair.len() - 1].line,
            length_mm: pair.iter().map(|part| part.length_mm).sum(),
            force_n: range(|part| part.force_xy_peak_n_after),
            stock_mm: range(|part| part.stock_after_mm),
        });
    }
    found
}

/// The force counts as held up to this ratio of the reference: within 10 %, as is asked of constancy.
const HELD_WITHIN: f64 = 1.1;

/// Stretches that are listed on the screen.
const LISTED: usize = 8;

/// The first stretches, a line each, and how many there are more.
fn stretches(parts: &[StretchPart]) -> String {
    let mut text = String::new();
    for part in parts.iter().take(LISTED) {
        text += &format!(
            "          lines {} to {} of the finish: {:.1} mm, {:.2} to {:.2} N with {:.3} to {:.3} mm of stock\n",
            part.line,
            part.last_line,
            part.length_mm,
            part.force_n[0],
            part.force_n[1],
            part.stock_mm[0],
            part.stock_mm[1]
        );
    }
    match parts.len().saturating_sub(LISTED) {
        0 => text,
        more => text + &format!("          and {more} more; the JSON report lists them (--json)\n"),
    }
}

impl SemifinishReport<'_> {
    /// As JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain data") + "\n"
    }

    /// What is not held of the reference, wherever it comes from: one sentence.
    pub fn unmet(&self) -> Option<String> {
        let force = &self.force;
        (force.beyond_mm > 0.0).then(|| {
            format!(
                "the force of {} N is not held: on {:.1} of {:.0} mm it is more than 10 % above, {:.2} N at most",
                short(self.reference_n),
                force.beyond_mm,
                force.length_mm,
                force.after.largest_n
            )
        })
    }

    /// As text.
    pub fn text(&self) -> String {
        let force = &self.force;
        let row = |name: &str, spread: &Spread| {
            format!(
                "{name}  {:.2} to {:.2} N, largest over least {:.2}; {:.1} % of the length within 10 % of {} N\n",
                spread.least_n,
                spread.largest_n,
                spread.largest_n / spread.least_n.max(1e-12),
                spread.within_10_percent,
                short(self.reference_n)
            )
        };
        let mut text = format!(
            "reference {} N ({}), over {:.0} mm of cuts\n",
            short(self.reference_n),
            self.reference_source,
            force.length_mm
        );
        text += &row("before  ", &force.before);
        text += &row("after   ", &force.after);
        text += &format!(
            "stock     {:.3} to {:.3} mm before, {:.3} to {:.3} mm after (bounds {} to {})\n",
            self.stock.before_mm[0],
            self.stock.before_mm[1],
            self.stock.after_mm[0],
            self.stock.after_mm[1],
            self.stock_bounds_mm[0],
            self.stock_bounds_mm[1]
        );
        if force.unbound_mm < 0.999 * force.length_mm {
            text += &format!(
                "bounds    hold on {:.0} mm; where they do not, {:.1} % of the length is within 10 %\n",
                force.length_mm - force.unbound_mm,
                force.after.unbound_within_10_percent
            );
        }
        text += &stretches(&self.bounds);
        if !self.unbound.is_empty() {
            let length_mm: f64 = self.unbound.iter().map(|part| part.length_mm).sum();
            text += &format!("unbound   on {length_mm:.1} mm the force is more than 10 % off though no bound holds\n");
            text += &stretches(&self.unbound);
        }
        let outside = self.stock.outside_calibrated_percent.filter(|percent| *percent > 0.0);
        if let (Some([low, high]), Some(percent)) = (self.stock.calibrated_mm, outside) {
            text += &format!(
                "          {percent:.0} % of the length has stock outside {low} to {high} mm, for which layer models are calibrated\n"
            );
        }
        if force.no_force_mm > 0.0 {
            text += &format!(
                "no force  on {:.0} mm the model gives none (thin chips over long contacts): it does not hold there\n",
                force.no_force_mm
            );
        }
        text += &format!(
            "gouges    {} of {} cells below what the finish leaves{}\n",
            self.gouge.gouged,
            self.gouge.cells,
            if self.gouge.gouged > 0 {
                format!(", {:.3} mm deep at most", self.gouge.deepest_mm)
            } else {
                String::new()
            }
        );
        text += &format!(
            "deflection along the normal of the surface {:.1} µm at most before, {:.1} after; range {:.1} and {:.1} µm (lateral only)\n",
            1e3 * self.deflection.normal_before_mm,
            1e3 * self.deflection.normal_after_mm,
            1e3 * self.deflection.range_before_mm,
            1e3 * self.deflection.range_after_mm
        );
        text += &match force.deviation_percent {
            Some(percent) => {
                let [low, high] = force.band_n.unwrap_or_default();
                format!(
                    "forces are uncertain by {percent:.1} % (one standard deviation of the coefficients): with two of them {low:.2} to {high:.2} N\n"
                )
            }
            None => "how uncertain the forces are is not known: the coefficients carry no covariance\n".into(),
        };
        text += &format!(
            "moved     {} blocks, {} coordinates put in, {} arcs cut into chords ({} lines added), by {:.3} mm at most\n",
            self.moved.blocks_changed,
            self.moved.words_added,
            self.moved.arcs_cut,
            self.moved.lines_added,
            self.moved.largest_offset_mm
        );
        if !self.assumptions.is_empty() {
            text += &format!(
                "assumed   {} values that the setup does not give; the JSON report lists them (--json)\n",
                self.assumptions.len()
            );
        }
        text
    }
}
