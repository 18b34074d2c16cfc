//! The result of a diagnosis as plain data, one to one with the JSON report of `learn` and `learn-table`.

use crate::machine::Spindle;

/// Errors of a model on some samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// Root mean square, unit of the reading.
    pub rmse: f64,
    /// Mean |error| / |reading|, percent, over readings above 5 % of the largest.
    pub mape: f64,
    /// 1 − Σ r² / Σ (y − ȳ)².
    pub r2: f64,
}

/// An estimate of a coefficient or parameter, with its standard error.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard error; infinite if the data do not determine it.
    pub std_error: f64,
    /// Unit.
    pub unit: String,
}

/// An effect that was added.
#[derive(Debug, Clone, PartialEq)]
pub struct Added {
    /// Name, as in `library effects`.
    pub name: String,
    /// Its parameters.
    pub parameters: Vec<Estimate>,
    /// Probability of such a gain without the effect.
    pub p_value: f64,
    /// Held-out error before.
    pub test_rmse_before: f64,
    /// Held-out error after.
    pub test_rmse_after: f64,
    /// Why it was accepted, one sentence.
    pub evidence: String,
}

/// A curve over a covariate, for what no effect of the list explains.
#[derive(Debug, Clone, PartialEq)]
pub struct Unnamed {
    /// The curve as an effect of a model, with its errors.
    pub added: Added,
    /// The covariate.
    pub covariate: String,
    /// Its unit in `knots`.
    pub unit: String,
    /// "load" of the cut, "tare", or the whole "reading".
    pub multiplies: String,
    /// (covariate, factor): linear between, constant beyond; two knots at one value are a step.
    pub knots: Vec<[f64; 2]>,
    /// A named effect of the model that depends on the covariate too: the curve corrects its law.
    pub beside: Option<String>,
    /// Covariates correlated with this one, so that a curve over each explains as much; best first.
    pub rivals: Vec<String>,
    /// The only effect of the list that depends on the covariate, if the curve goes the way of its law.
    pub family: Option<String>,
    /// One sentence.
    pub sentence: String,
}

impl Unnamed {
    /// The curve in words, with its rivals and the cuts that would separate them.
    pub fn in_words(&self) -> String {
        if self.rivals.is_empty() {
            return self.sentence.clone();
        }
        format!(
            "{}; or it follows {}, which changes together with {} in this program: the same cut at other values of one \
             of them alone shows which",
            self.sentence,
            self.rivals.join(" or "),
            self.covariate
        )
    }
}

/// An effect that was tried and not added.
#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    /// Name.
    pub name: String,
    /// One clause.
    pub why: String,
}

/// Effects that explain the data equally well.
#[derive(Debug, Clone, PartialEq)]
pub struct Confounded {
    /// Their names, the one in the model first.
    pub names: Vec<String>,
    /// One clause.
    pub why: String,
    /// The cuts that would separate them.
    pub experiment: String,
}

impl LearnReport {
    /// Says what was read of power as the meter showed it; the data hold it as power at the motor shaft.
    pub(in crate::learn) fn read_at_meter(&mut self, spindle: &Spindle, channel_names: &[String]) {
        for ceiling in &mut self.ceilings {
            ceiling.read_at_meter(spindle);
        }
        if channel_names.first().is_some_and(|name| is_power(name)) {
            for cut in &mut self.outlying {
                (cut.reading, cut.predicted) = (spindle.meter_w(cut.reading), spindle.meter_w(cut.predicted));
            }
        }
    }

    /// Names of the effects found, and of those that curves are named after.
    pub fn names(&self) -> Vec<&str> {
        let laws = self.effects.iter().map(|e| e.name.as_str());
        laws.chain(self.unnamed.iter().filter_map(|u| u.family.as_deref())).collect()
    }

    /// Base coefficients of the final model, without those that were left out.
    pub fn determined_base(&self) -> Vec<Estimate> {
        let is_determined = |value: &&Estimate| self.left_out.iter().all(|left| left.name != value.name);
        self.final_base.iter().filter(is_determined).cloned().collect()
    }

    /// The group of confounded effects that this name belongs to; `None` if it is asserted alone.
    pub fn one_of(&self, name: &str) -> Option<&Confounded> {
        self.confounded.iter().find(|group| group.names.iter().any(|other| other == name))
    }

    /// Curves that no effect's name is reported for.
    pub fn nameless(&self) -> impl Iterator<Item = &Unnamed> {
        self.unnamed.iter().filter(|u| u.family.is_none() && u.beside.is_none())
    }
}

/// Structure that no named effect explains.
#[derive(Debug, Clone, PartialEq)]
pub struct Unexplained {
    /// Share of the residual's variance that its strongest correlate predicts on blocks it was not learned on.
    pub test_r2_of_residual_structure: f64,
    /// The strongest correlate.
    pub largest_correlate: String,
    /// Where that is not the time: the time and the lines of the program at which the residual is largest, in words.
    pub largest: Option<String>,
}

/// Held-out error of one measured quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelError {
    /// Quantity and unit.
    pub name: String,
    /// Error of the base model.
    pub base_rmse: f64,
    /// Error of the final model.
    pub final_rmse: f64,
}

/// How well the model does on a kind of cut it was not fitted on.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    /// Kind of cut.
    pub kind: String,
    /// Samples.
    pub samples: usize,
    /// Error of the base model.
    pub rmse_before: f64,
    /// Error of the final model.
    pub rmse_after: f64,
}

/// How a log was tied to its program.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Alignment {
    /// Log time at which the program starts, s.
    pub offset_s: f64,
    /// Log seconds per predicted second.
    pub stretch: f64,
    /// position, line, block or load.
    pub method: String,
    /// Standard uncertainty of the program time of a sample, s: median over the samples placed in the program.
    pub uncertainty_s: f64,
    /// The same by stretches of the log: ([from, to], uncertainty), s.
    pub stretches: Vec<([f64; 2], f64)>,
    /// Samples outside the program: before it begins, while it is held, and after it ends.
    pub outside: [usize; 3],
    /// How much later than its position each reading was taken, s; 0 where that is not seen.
    pub read_later_s: f64,
    /// Pauses found: (time in the log, length), s.
    pub pauses: Vec<(f64, f64)>,
}

/// A reading that is the same whatever the load above it: a meter or a drive at its limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Ceiling {
    /// What was measured, with its unit.
    pub name: String,
    /// The reading.
    pub reading: f64,
    /// Samples at it, which were left out.
    pub samples: usize,
}

/// Is a quantity of this name a power of the spindle?
fn is_power(name: &str) -> bool {
    name.starts_with("spindle_power")
}

impl Ceiling {
    /// One sentence.
    pub fn in_words(&self) -> String {
        let digits = (3 - self.reading.abs().max(1e-9).log10().floor() as i32).clamp(0, 6) as usize;
        format!(
            "{} saturates at {:.digits$}: the load of {} samples is larger, and they were left out",
            self.name, self.reading, self.samples
        )
    }
    /// A power as the meter showed it; the data hold it as power at the motor shaft.
    pub(in crate::learn) fn read_at_meter(&mut self, spindle: &Spindle) {
        if is_power(&self.name) {
            self.reading = spindle.meter_w(self.reading);
        }
    }
}

/// A cut of a table that the others do not predict and that was left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlying {
    /// Row of the table, 1-based, the header not counted.
    pub row: usize,
    /// Its reading.
    pub reading: f64,
    /// What the model of the other cuts predicts.
    pub predicted: f64,
    /// Has it the largest predicted load of all?
    pub is_largest: bool,
}

impl Outlying {
    /// One sentence.
    pub fn in_words(&self) -> String {
        let apart = 100.0 * (self.reading / self.predicted - 1.0);
        let (percent, way) = (apart.abs(), if apart < 0.0 { "less" } else { "more" });
        let ask = if self.is_largest && apart < 0.0 {
            "it has the largest load of all: does the meter or the drive end there?"
        } else {
            "is the row right, or was something else about this cut?"
        };
        format!("row {} reads {percent:.0} % {way} than the other cuts predict, and was left out; {ask}", self.row)
    }
}

/// A stretch of a log in which the machine did not run at the predicted feed.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedEvent {
    /// Time in the log, s.
    pub time_s: [f64; 2],
    /// Lines of the program, 1-based.
    pub lines: [u32; 2],
    /// Feed over the predicted one; 0: the tool stood still, or did something else.
    pub ratio: f64,
    /// Was it elsewhere than on what lies ahead in the program?
    pub elsewhere: bool,
}

impl FeedEvent {
    /// One sentence.
    pub fn in_words(&self) -> String {
        let [from, to] = self.time_s;
        let [first, last] = self.lines;
        let lines = if first == last { format!("line {first}") } else { format!("lines {first} to {last}") };
        if self.elsewhere {
            return format!(
                "from {from:.1} s to {to:.1} s ({lines}) the machine did not go on in the program: lines that run again, or moves by \
                 hand; left out"
            );
        }
        if self.ratio == 0.0 {
            return format!("the tool stood for {:.1} s from {from:.1} s on ({lines}): a pause, and no cut", to - from);
        }
        format!(
            "from {from:.1} s to {to:.1} s ({lines}) the machine ran at {:.0} % of the predicted feed: an override? \
             The loads are compared at the feed that was measured",
            100.0 * self.ratio
        )
    }
}

/// A coefficient in one window of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Start and end, s.
    pub time_s: [f64; 2],
    /// Factor on the cutting terms fitted to the whole log, with standard error.
    pub cutting: [f64; 2],
    /// Factor on the edge terms, with standard error.
    pub edge: [f64; 2],
}

/// The report of `learn`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LearnReport {
    /// Samples read.
    pub samples: usize,
    /// Samples with weight.
    pub used: usize,
    /// Samples with reduced weight.
    pub down_weighted: usize,
    /// Samples in the fit.
    pub train: usize,
    /// Samples kept for the judgement; all samples if each is held out in turn.
    pub test: usize,
    /// How they were split.
    pub how: String,
    /// Alignment, for logs.
    pub alignment: Option<Alignment>,
    /// Where the machine stood still, or ran at another feed than predicted.
    pub events: Vec<FeedEvent>,
    /// Readings that stop at a ceiling.
    pub ceilings: Vec<Ceiling>,
    /// Cuts of a table that the others do not predict.
    pub outlying: Vec<Outlying>,
    /// Base parameters.
    pub base: Vec<Estimate>,
    /// Condition number of the base fit.
    pub condition: f64,
    /// Errors of the base model.
    pub base_train: Errors,
    /// Errors of the base model on held-out data.
    pub base_test: Errors,
    /// Effects added, in order.
    pub effects: Vec<Added>,
    /// Curves without a name, in the order found.
    pub unnamed: Vec<Unnamed>,
    /// Effects not added.
    pub rejected: Vec<Rejected>,
    /// Groups of effects that the data cannot separate.
    pub confounded: Vec<Confounded>,
    /// Structure that the named effects leave; `None`: none.
    pub unexplained: Option<Unexplained>,
    /// Errors of the final model.
    pub final_train: Errors,
    /// Errors of the final model on held-out data.
    pub final_test: Errors,
    /// The same, quantity by quantity.
    pub channels: Vec<ChannelError>,
    /// Base parameters of the final model.
    pub final_base: Vec<Estimate>,
    /// Base coefficients that the cuts do not determine and that were left out, with their last values.
    pub left_out: Vec<Estimate>,
    /// Least radius of a layer over that of its ball, for tables of layers.
    pub least_radius: Option<f64>,
    /// Greatest way of an edge at the end of a table that does not say how long its cuts are, each counted as equally long, mm.
    pub counted_way_mm: Option<f64>,
    /// Covariance of the final base parameters.
    pub covariance: Vec<Vec<f64>>,
    /// Spindle speed that the tare belongs to, rev/s; `None` if nothing has a tare.
    pub tare_rps: Option<f64>,
    /// Noise of neighbouring readings, unit of the reading; `None` if it is not known.
    pub noise_floor: Option<f64>,
    /// Relative error of the predicted load of a cut on held-out data, without the noise of the sensor; `None` if too
    /// little was held out.
    pub scatter: Option<f64>,
    /// Highest feed per tooth of the cuts of each tool, mm.
    pub feed_per_tooth_mm: Vec<(u32, f64)>,
    /// Other kinds of cut.
    pub transfer: Vec<Transfer>,
    /// Coefficients over time.
    pub windows: Vec<Window>,
    /// Wear or chipping that the windows show, if any.
    pub wear: Option<String>,
    /// What was noticed about the data.
    pub warnings: Vec<String>,
    /// Models that were fitted.
    pub variants_tried: usize,
    /// False if the data do not support a model file.
    pub supports_model: bool,
    /// One sentence.
    pub verdict: String,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Spindle, Table};

    #[test]
    fn a_ceiling_of_power_is_said_as_the_meter_shows_it_and_others_as_they_are() {
        let spindle = Spindle {
            max_rps: 200.0,
            power_w: None,
            torque_nmm: None,
            tare_w: Table::constant(0.0),
            efficiency: Table::constant(0.8),
            runup_time_s: 1.0,
        };
        let ceiling = |name: &str| Ceiling { name: name.into(), reading: 800.0, samples: 4 };
        let cut = Outlying { row: 2, reading: 400.0, predicted: 800.0, is_largest: true };
        let mut report = LearnReport {
            ceilings: vec![ceiling("spindle_power_w (W)"), ceiling("force_xy_n")],
            outlying: vec![cut.clone()],
            ..LearnReport::default()
        };
        let names = |first: &str| [first.to_owned(), "force_xy_n".to_owned()];
        report.read_at_meter(&spindle, &names("force_x_n (N)"));
        assert_eq!(report.outlying, [cut]);
        assert_eq!([0, 1].map(|k| report.ceilings[k].reading), [1000.0, 800.0]);
        report.read_at_meter(&spindle, &names("spindle_power_w"));
        assert_eq!([report.outlying[0].reading, report.outlying[0].predicted], [500.0, 1000.0]);
    }
}
