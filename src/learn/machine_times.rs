//! Learning from a log without a load: how the machine moves. In: a program, and a log with positions or lines over
//! time. Out: a report whose only possible effect is the acceleration that the times between known positions show.
//!
//! The error is held out: the acceleration is fitted to the first half of the log and predicts the times of stretches
//! of about ten seconds of the second half. The median of their errors counts, because some contain a tool change or a
//! stop by the operator.

use crate::effects::{ALL, Acts};
use crate::learn::align::Aligned;
use crate::learn::align::line::acceleration_shown;
use crate::learn::diagnose::criteria::is_slower;
use crate::learn::log::Log;
use crate::learn::log::columns::DataError;
use crate::learn::program::clock::Clock;
use crate::learn::program::simulated::SimulatedProgram;
use crate::learn::report::{Added, Errors, Estimate, LearnReport};

/// Length of a stretch whose time is compared, s. Judgement.
const STRETCH_S: f64 = 10.0;
/// Fewest stretches for a median. Judgement.
const FEWEST: usize = 3;

/// The report of an aligned log without a load.
pub fn times_alone(prepared: &SimulatedProgram, log: &Log, aligned: &Aligned) -> Result<LearnReport, DataError> {
    let found = measured_acceleration(prepared, log, &aligned.program_s);
    let half = aligned.program_s.len() / 2;
    let first: Vec<f64> = (0..2 * half).map(|i| if i < half { aligned.program_s[i] } else { f64::NAN }).collect();
    let of_first = measured_acceleration(prepared, log, &first).map_or(1.0, |(factor, _)| factor);
    let error = |factor: f64| error_of_times(prepared, log, aligned, half, factor);
    let (Some(before), Some(after)) = (error(1.0), error(of_first)) else {
        return Err(DataError::Unfit("too few samples of the log belong to the program".into()));
    };
    let found = found.filter(|_| after < before);
    let errors = |rmse: f64| Errors { rmse, mape: rmse, r2: f64::NAN };
    let effects: Vec<Added> =
        found.iter().filter_map(|(factor, nats)| added(*factor, *nats, [before, after])).collect();
    let after = if effects.is_empty() { before } else { after };
    Ok(LearnReport {
        samples: log.time_s.len(),
        used: aligned.program_s.iter().filter(|t| t.is_finite()).count(),
        how: "no load is measured: only the times of the machine are learned; second half held out".into(),
        base_test: errors(before),
        final_test: errors(after),
        supports_model: !effects.is_empty(),
        verdict: verdict(found.map(|(factor, _)| factor), before, after),
        warnings: log.warnings.clone(),
        effects,
        ..LearnReport::default()
    })
}

/// (factor, nats) of the acceleration that the times show, if it is clearly less than the declared one.
fn measured_acceleration(prepared: &SimulatedProgram, log: &Log, program_s: &[f64]) -> Option<(f64, f64)> {
    acceleration_shown(log, program_s, &prepared.timeline, &prepared.slower).filter(|(f, nats)| is_slower(*f, *nats))
}

fn added(factor: f64, nats: f64, [before, after]: [f64; 2]) -> Option<Added> {
    let effect = ALL.iter().find(|effect| effect.acts == Acts::Motion)?;
    Some(Added {
        name: effect.name.into(),
        parameters: vec![Estimate {
            name: effect.parameters[0].name.into(),
            value: factor,
            std_error: f64::NAN,
            unit: effect.parameters[0].unit.into(),
        }],
        p_value: (-nats).exp(),
        test_rmse_before: before,
        test_rmse_after: after,
        evidence: format!("the times between known positions show it (log-likelihood {nats:.0} nats higher)"),
    })
}

fn verdict(factor: Option<f64>, before: f64, after: f64) -> String {
    match factor {
        Some(factor) => format!(
            "The machine accelerates with {:.0} % of what the setup declares: times of stretches that were not fitted \
             are off by {before:.1} % with the declared one, {after:.1} % with this.",
            100.0 * factor
        ),
        None => format!("The declared accelerations hold: times of stretches of the log are off by {before:.1} %."),
    }
}

/// Median |error| of the times of stretches from sample `from` on, %; `None` if there are too few.
fn error_of_times(prepared: &SimulatedProgram, log: &Log, aligned: &Aligned, from: usize, factor: f64) -> Option<f64> {
    let (declared, clock) = (
        Clock::new(&prepared.timeline, &prepared.slower, 1.0),
        Clock::new(&prepared.timeline, &prepared.slower, factor),
    );
    let placed = (from..log.time_s.len()).filter_map(|i| {
        let place = declared.place(aligned.program_s[i]).filter(|_| aligned.program_s[i].is_finite())?;
        Some((log.time_s[i], clock.time(place)))
    });
    let mut errors = Vec::new();
    let mut begin: Option<(f64, f64)> = None;
    for (logged, told) in placed {
        let (logged_0, told_0) = *begin.get_or_insert((logged, told));
        if logged - logged_0 >= STRETCH_S {
            errors.push(100.0 * ((told - told_0) / (logged - logged_0) - 1.0).abs());
            begin = Some((logged, told));
        }
    }
    errors.sort_by(f64::total_cmp);
    (errors.len() >= FEWEST).then(|| errors[errors.len() / 2])
}
