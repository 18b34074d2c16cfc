//! Base coefficients that a table does not determine. In: a diagnosis, its final model. Out: the model without terms
//! that raise its held-out error, and these terms.
//!
//! A coefficient whose standard error exceeds its value is not determined by the cuts, but changes every prediction
//! outside them: chips of a few µm determine the edge force and no cutting coefficient. In logs all terms are kept: the
//! coefficients that the setup declares act as priors.

use crate::learn::dataset::samples::{Class, Data};
use crate::learn::diagnose::diagnosis::Diagnosis;
use crate::learn::diagnose::forms::FORM_ROUNDS;
use crate::learn::model::cross_validation::held_out_residuals;
use crate::learn::model::fit::{Fitted, certainty, fit};
use crate::learn::report::Estimate;

/// A model without some of its base terms.
pub(in crate::learn) struct Reduced {
    /// All data, without the terms.
    pub(in crate::learn) data: Data,
    /// The data for the fit, without the terms.
    pub(in crate::learn) train: Data,
    /// The model.
    pub(in crate::learn) fitted: Fitted,
    /// The terms that were left out, with their last values.
    pub(in crate::learn) left_out: Vec<Estimate>,
}

impl Diagnosis<'_> {
    /// Leaves out one term after the other, each time the one whose omission lowers the held-out error most.
    pub(in crate::learn) fn without_undetermined_terms(&self, fitted: Fitted) -> Reduced {
        let mut reduced = Reduced { data: self.data.clone(), train: self.train.clone(), fitted, left_out: Vec::new() };
        while !self.data.is_series() {
            let Some((term, value, fitted)) = self.worst_term(&reduced) else { break };
            reduced.data = without_term(&reduced.data, term);
            reduced.train = without_term(&reduced.train, term);
            reduced.fitted = fitted;
            reduced.left_out.push(value);
        }
        reduced
    }

    /// The undetermined term whose omission lowers the held-out error most; `None` if none does.
    fn worst_term(&self, reduced: &Reduced) -> Option<(usize, Estimate, Fitted)> {
        let (train, fitted) = (&reduced.train, &reduced.fitted);
        let sure = certainty(train, fitted);
        let before = held_out_residuals(train, &fitted.model.effects, self.split);
        let without = |term: usize| {
            let (base, value, std_error) = (&train.base[term], fitted.model.base[term], sure.std_error(term));
            if !has_term(train, term) || value.abs() > std_error || is_last_of_cut(train, term) {
                return None;
            }
            let rest = without_term(train, term);
            let after = held_out_residuals(&rest, &fitted.model.effects, self.split);
            let value = Estimate { name: base.name.clone(), value, std_error, unit: base.unit.clone() };
            Some((self.drop_of(&before, &after), (term, value, fit(&rest, &fitted.model.effects, FORM_ROUNDS)?)))
        };
        let better = (0..train.base.len()).filter_map(without).filter(|(drop, _)| *drop > 0.0);
        better.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, found)| found)
    }
}

/// Is the term non-zero in any sample?
fn has_term(data: &Data, term: usize) -> bool {
    data.used().any(|i| data.columns[term][i] != 0.0)
}

/// Is it the last term of the cut's load?
fn is_last_of_cut(data: &Data, term: usize) -> bool {
    let is_of_cut = |b: usize| data.base[b].class != Class::Tare && has_term(data, b);
    is_of_cut(term) && (0..data.base.len()).filter(|b| is_of_cut(*b)).count() == 1
}

fn without_term(data: &Data, term: usize) -> Data {
    let mut data = data.clone();
    data.columns[term].fill(0.0);
    data.base[term].prior = None;
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::dataset::samples::{Base, UNBOUNDED};
    use crate::learn::diagnose::Options;
    use crate::learn::model::cross_validation::by_blocks;

    /// Fourteen cuts with chips between 0.05 mm and `chips` times that, 3 % error, k_tc 1000 N/mm² and k_te 20 N/mm.
    fn left_out(chips: f64) -> Vec<String> {
        let base =
            |name: &str, class| Base { name: name.into(), unit: String::new(), class, prior: None, bounds: UNBOUNDED };
        let n = 14;
        let chip = |i: usize| 0.05 * chips.powf(i as f64 / 13.0);
        let width = |i: usize| 1.0 + (i * 5 % 7) as f64;
        let error = |i: usize| 1.0 + 0.03 * ((i * 7919 % 13) as f64 / 6.0 - 1.0);
        let data = Data {
            base: vec![base("k_tc", Class::Cutting), base("k_te", Class::Edge)],
            columns: vec![(0..n).map(|i| width(i) * chip(i)).collect(), (0..n).map(width).collect()],
            reading: (0..n).map(|i| width(i) * (1000.0 * chip(i) + 20.0) * error(i)).collect(),
            weight: vec![1.0; n],
            state: vec![crate::effects::State::default(); n],
            run: (0..n).collect(),
            channel: vec![0; n],
            block: (0..n).collect(),
            kind: vec![0; n],
            channel_names: vec![String::new()],
            ..Data::default()
        };
        let split = by_blocks(&data, "cut");
        let report = crate::learn::diagnose::diagnose(&data, &split, &Options::default()).unwrap();
        report.left_out.iter().map(|v| v.name.clone()).collect()
    }

    #[test]
    fn what_the_chips_of_a_table_do_not_part_is_left_out_and_what_they_do_stays() {
        assert_eq!(left_out(1.02).len(), 1);
        assert!(left_out(8.0).is_empty());
    }
}
