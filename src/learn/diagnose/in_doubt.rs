//! Names that a report asserts alone no more. In: a report. Out: the same with more groups of causes that it cannot part.

use crate::effects::{ALL, named};
use crate::learn::report::{Confounded, LearnReport};

/// If a curve over another covariate explains as much, the effect that a curve was named after is reported as one of
/// several possible causes. So is wear that comes at once: an edge that broke out leaves the same curve.
pub(in crate::learn) fn doubt_families_with_rivals(report: &mut LearnReport) {
    let in_doubt = report.unnamed.iter().filter_map(|curve| {
        let name = curve.family.clone()?;
        let family = named(&name)?;
        let along = curve.rivals.iter().map(|rival| format!("a curve of the {} along {rival}", curve.multiplies));
        let comes_at_once = family.wear.is_some() && is_stepped(&curve.knots);
        let accidents = ALL.iter().filter(|effect| comes_at_once && effect.is_accident).map(|e| e.name.to_owned());
        let rivals: Vec<String> = along.chain(accidents).collect();
        (!rivals.is_empty()).then(|| Confounded {
            experiment: family.separated_by.to_owned(),
            names: std::iter::once(name).chain(rivals).collect(),
            why: if comes_at_once { "the load rises at once and not by and by" } else { AS_LOW }.to_owned(),
        })
    });
    let in_doubt: Vec<Confounded> = in_doubt.collect();
    report.confounded.extend(in_doubt);
}

/// Why a curve has rivals.
const AS_LOW: &str = "in its place each has as low a held-out error";

/// Does a curve change at steps, two knots at one place, more than between them?
fn is_stepped(knots: &[[f64; 2]]) -> bool {
    let change = |at_once: bool| -> f64 {
        let pairs = knots.windows(2).filter(|pair| (pair[0][0] == pair[1][0]) == at_once);
        pairs.map(|pair| (pair[1][1] - pair[0][1]).abs()).sum()
    };
    change(true) > change(false)
}

/// An effect that the data kept for the judgement refute is not asserted alone: it is reported as one of several possible
/// causes. `all`: whether they refute all effects together; `refuted`: effects that they refute beside the others.
pub(in crate::learn) fn doubt_what_does_not_help(report: &mut LearnReport, all: bool, refuted: &[&str]) {
    let in_doubt = |name: &&str| report.one_of(name).is_none() && (all || refuted.contains(name));
    let in_doubt: Vec<String> = report.names().into_iter().filter(in_doubt).map(str::to_owned).collect();
    let why = if all { "the error rose" } else { "the error is no lower with it" };
    report.confounded.extend(in_doubt.into_iter().map(|name| Confounded {
        experiment: named(&name).map_or_else(String::new, |effect| effect.separated_by.to_owned()),
        names: vec![name, "a cause that the data kept for the judgement do not share".to_owned()],
        why: format!("on the data kept for the judgement {why}"),
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::report::{Added, Unnamed};

    /// A report with one effect, and a curve named after an effect, with rivals.
    fn report(rivals: &[&str]) -> LearnReport {
        let added = |name: &str| Added {
            name: name.into(),
            parameters: Vec::new(),
            p_value: 0.0,
            test_rmse_before: 10.0,
            test_rmse_after: 9.0,
            evidence: String::new(),
        };
        let curve = Unnamed {
            added: added("unnamed-load-feed-per-tooth"),
            covariate: "feed per tooth".into(),
            unit: "mm".into(),
            multiplies: "load".into(),
            knots: Vec::new(),
            beside: None,
            rivals: rivals.iter().map(|rival| (*rival).to_owned()).collect(),
            family: Some("size-effect".into()),
            sentence: String::new(),
        };
        LearnReport { effects: vec![added("tool-diameter")], unnamed: vec![curve], ..LearnReport::default() }
    }

    #[test]
    fn what_the_data_kept_refute_is_asserted_alone_no_more() {
        let in_doubt = |all: bool, refuted: &[&str]| {
            let mut report = report(&[]);
            doubt_what_does_not_help(&mut report, all, refuted);
            ["tool-diameter", "size-effect"].map(|name| report.one_of(name).is_some())
        };
        assert_eq!([in_doubt(false, &[]), in_doubt(true, &[])], [[false; 2], [true; 2]]);
        assert_eq!(in_doubt(false, &["tool-diameter"]), [true, false]);
    }

    #[test]
    fn wear_that_comes_at_once_may_be_an_edge_that_broke_out() {
        let doubted = |family: &str, knots: &[[f64; 2]]| {
            let mut report = report(&[]);
            (report.unnamed[0].family, report.unnamed[0].knots) = (Some(family.into()), knots.to_vec());
            doubt_families_with_rivals(&mut report);
            report.one_of(family).map(|group| group.names.clone())
        };
        let step = [[50.0, 1.0], [50.0, 1.3]];
        assert_eq!(doubted("flank-wear", &step).unwrap(), ["flank-wear", "edge-chipping"]);
        assert_eq!(doubted("flank-wear", &[[0.0, 1.0], [50.0, 1.1], [50.0, 1.15], [90.0, 1.3]]), None);
        assert_eq!(doubted("size-effect", &step), None);
    }

    #[test]
    fn a_family_is_one_of_several_where_its_curve_follows_something_else_as_well() {
        let said = |rivals: &[&str]| {
            let mut report = report(rivals);
            doubt_families_with_rivals(&mut report);
            report.one_of("size-effect").map(|group| group.names.clone())
        };
        assert_eq!(said(&[]), None);
        assert_eq!(said(&["tool"]).unwrap(), ["size-effect", "a curve of the load along tool"]);
    }
}
