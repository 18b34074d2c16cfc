//! `calibrate --reading "T1 peak 45% idle 8%"`: coefficients from a load meter read by eye while a program runs.
//!
//! In: one line per tool (peak and idle, in percent of the spindle's rated power, or W or kW), and the program's
//! predicted power. Needle and eye average over about a second: the peak is taken as the largest mean over a second,
//! P₁. Both declared coefficients are scaled by s = P₁(read)/P₁(declared); idle is the tare. Out: k_tc, k_te, tare.
//! Their relative variance is the sum of
//! * reading: 2 points of the scale (5 % of a reading in W) on peak and idle each;
//! * averaging: half of the relative excess of the largest momentary power over P₁;
//! * scale: 10 % for the meaning of 100 % (continuous or short-time rating), not for readings in W;
//! * ratio: k_te/k_tc is not determined; with ln(k_te/k_tc) uncertain by δ = 0.5 and e the edge's share of the power at
//!   the peak, d ln k_tc = −e δ and d ln k_te = (1 − e) δ.
//!
//! Several tools in one material are averaged with weights 1/variance; if they scatter more than their variances
//! explain, the errors are enlarged by that factor (Birge ratio).

use crate::learn::calibrate::calibration::Calibration;
use crate::learn::calibrate::power::RATIO_UNCERTAINTY;
use crate::learn::log::columns::DataError;
use crate::learn::program::declared::declared;
use crate::learn::program::simulated::SimulatedProgram;
use crate::learn::program::timeline::Spot;
use crate::learn::report::Estimate;
use crate::machine::material::LinearEdge;
use crate::machine::{Job, Shape};
use crate::units::watts_from_n_mm_s;

/// One line of readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Tool.
    pub tool: u32,
    /// Largest load seen.
    pub peak: f64,
    /// Load with the spindle running in air.
    pub idle: f64,
    /// True: percent of the rated power; false: W.
    pub percent: bool,
}

/// The standard errors of the head of the file; all judgement.
const EYE_ERROR_POINTS: f64 = 2.0;
const EYE_ERROR_SHARE: f64 = 0.05;
const SCALE_ERROR: f64 = 0.10;
const SPLIT_ERROR: f64 = 0.5;
/// Least difference of peak and idle, in reading errors. Judgement.
const LEAST_DIFFERENCE: f64 = 2.0;
/// Time over which needle and eye average, s. Judgement.
const PEAK_MEAN_S: f64 = 1.0;

/// Reads a line like `T1 peak 45% idle 8%` or `T2 peak 2.1 kW idle 300 W`.
pub fn parse(text: &str) -> Result<Reading, DataError> {
    let wrong =
        || DataError::Unfit(format!("`{text}` is no reading; write it like \"T1 peak 45% idle 8%\", with %, W or kW"));
    let lower = text.to_lowercase().replace([',', '=', ':'], " ").replace('%', " % ");
    let words: Vec<&str> = lower.split_whitespace().collect();
    let tool = words.iter().find_map(|w| w.strip_prefix('t').and_then(|n| n.parse().ok())).ok_or_else(wrong)?;
    let after = |name: &str| -> Option<(f64, bool)> {
        let at = words.iter().position(|w| *w == name)?;
        let cell = words.get(at + 1)?;
        let digits = cell.trim_end_matches(|c: char| c.is_alphabetic());
        let unit = if digits.len() < cell.len() { &cell[digits.len()..] } else { words.get(at + 2).copied()? };
        let value: f64 = digits.parse().ok().filter(|v: &f64| v.is_finite() && *v >= 0.0)?;
        match unit {
            "%" | "percent" => Some((value, true)),
            "w" => Some((value, false)),
            "kw" => Some((1000.0 * value, false)),
            _ => None,
        }
    };
    let ((peak, percent), (idle, same)) = (after("peak").ok_or_else(wrong)?, after("idle").ok_or_else(wrong)?);
    if percent != same {
        return Err(DataError::Unfit(format!("`{text}`: give peak and idle in the same unit")));
    }
    Ok(Reading { tool, peak, idle, percent })
}

/// Estimate from the readings of one tool.
struct ToolEstimate {
    reading: Reading,
    k_tc: f64,
    k_te: f64,
    tare_w: f64,
    /// Relative variance common to both coefficients, and the share of the edge at the peak.
    variance: f64,
    edge_share: f64,
    tare_error_w: f64,
    ball: bool,
}

/// Coefficients from the readings of a program's tools.
pub fn coefficients(readings: &[Reading], prepared: &SimulatedProgram, job: &Job) -> Result<Calibration, DataError> {
    let found: Vec<ToolEstimate> =
        readings.iter().map(|r| tool_estimate(*r, prepared, job)).collect::<Result<_, _>>()?;
    let weight = |f: &ToolEstimate| 1.0 / f.variance;
    let whole: f64 = found.iter().map(weight).sum();
    let average = |of: &dyn Fn(&ToolEstimate) -> f64| found.iter().map(|f| weight(f) * of(f)).sum::<f64>() / whole;
    let (k_tc, k_te) = (average(&|f| f.k_tc.ln()).exp(), average(&|f| f.k_te.ln()).exp());
    let scatter = found.iter().map(|f| weight(f) * (f.k_tc / k_tc).ln().powi(2)).sum::<f64>();
    let grown = if found.len() > 1 { (scatter / (found.len() - 1) as f64).max(1.0) } else { 1.0 };
    let common = grown / whole;
    let e = average(&|f| f.edge_share);
    let split = [-e * SPLIT_ERROR, (1.0 - e) * SPLIT_ERROR];
    let k = [k_tc, k_te];
    let mut covariance = vec![vec![0.0; 3]; 3];
    for a in 0..2 {
        for b in 0..2 {
            covariance[a][b] = k[a] * k[b] * (common + split[a] * split[b]);
        }
    }
    covariance[2][2] = found[0].tare_error_w.powi(2);
    let value = |name: &str, value: f64, std_error: f64, unit: &str| Estimate {
        name: name.to_owned(),
        value,
        std_error,
        unit: unit.to_owned(),
    };
    let own = |f: &ToolEstimate| {
        let error = (f.variance + (f.edge_share * SPLIT_ERROR).powi(2)).sqrt();
        value(&format!("k_tc of T{}", f.reading.tool), f.k_tc, f.k_tc * error, "N/mm²")
    };
    let mut notes = vec![
        "peak taken as the largest mean over a second; errors: 2 points of reading, 10 % of the scale, averaging, and \
         the unknown ratio of edge to cutting"
            .to_owned(),
    ];
    if grown > 1.0 {
        notes.push(format!(
            "the tools scatter {:.1} times as much as their errors explain: errors were enlarged by that factor",
            grown.sqrt()
        ));
    }
    let ratio = RATIO_UNCERTAINTY[usize::from(found.iter().any(|f| f.ball))];
    let relative = (common + split[0].powi(2)).sqrt();
    Ok(Calibration {
        model: "power".into(),
        tests: found.len(),
        parameters: vec![
            value("k_tc", k_tc, covariance[0][0].sqrt(), "N/mm²"),
            value("k_te", k_te, covariance[1][1].sqrt(), "N/mm"),
            value("tare", found[0].tare_w, found[0].tare_error_w, "W"),
        ],
        derived: found.iter().map(own).collect(),
        tare: Some(found[0].tare_w),
        covariance,
        condition: f64::NAN,
        leave_one_out_rmse: f64::NAN,
        force_uncertainty: Some(relative.hypot(ratio)),
        notes,
        ..Calibration::default()
    })
}

fn tool_estimate(reading: Reading, prepared: &SimulatedProgram, job: &Job) -> Result<ToolEstimate, DataError> {
    let number = reading.tool;
    let missing = |what: String| DataError::Unfit(format!("T{number}: {what}"));
    let tool = job.tool(number).ok_or_else(|| missing("the setup has no such tool".into()))?;
    let k = declared(job, tool).filter(|k| k.k_tc > 0.0);
    let k = k.ok_or_else(|| missing("the setup's material needs linear coefficients to begin with".into()))?;
    let peak = peak(&prepared.timeline().spots, number, &k)
        .ok_or_else(|| missing("it cuts nothing in this program".into()))?;
    let spindle = &job.machine.spindle;
    let (unit_w, points) = if reading.percent {
        let rated = spindle.power_w.as_ref().map(|p| p.at(peak.rps)).filter(|w| *w > 0.0);
        let rated = rated.ok_or_else(|| {
            missing("a load in percent needs the power of the spindle: [machine.spindle] power, or read in W".into())
        })?;
        (0.01 * rated, EYE_ERROR_POINTS)
    } else {
        (spindle.efficiency.at(reading.peak), EYE_ERROR_SHARE * reading.peak)
    };
    let difference = reading.peak - reading.idle;
    let eye = points * 2f64.sqrt();
    if difference < LEAST_DIFFERENCE * eye {
        return Err(missing(format!(
            "peak {} and idle {} are closer than they can be read (± {points:.3} each): they do not show the load of \
             the cut",
            reading.peak, reading.idle
        )));
    }
    let scale = unit_w * difference / peak.second_w;
    let scale_error = if reading.percent { SCALE_ERROR } else { 0.0 };
    let second = 0.5 * (peak.moment_w / peak.second_w - 1.0);
    Ok(ToolEstimate {
        reading,
        k_tc: scale * k.k_tc,
        k_te: scale * k.k_te,
        tare_w: unit_w * reading.idle,
        variance: (eye / difference).powi(2) + scale_error.powi(2) + second.powi(2),
        edge_share: peak.edge_share,
        tare_error_w: unit_w * points.hypot(scale_error * reading.idle),
        ball: tool.shape == Shape::Ball,
    })
}

/// The second of highest mean power of a tool, by the declared coefficients.
struct Peak {
    /// Mean over the second, and largest momentary cutting power, W.
    second_w: f64,
    moment_w: f64,
    /// Share of the edge in that second.
    edge_share: f64,
    rps: f64,
}

fn peak(spots: &[Spot], tool: u32, k: &LinearEdge) -> Option<Peak> {
    let parts = |s: &Spot| {
        let [k_tc, k_te] = [k.k_tc, k.k_te].map(|k| if s.tool == tool { watts_from_n_mm_s(k) } else { 0.0 });
        [k_tc * s.engaged.section_mm2 * s.speed_mm_s(), k_te * s.engaged.contact_mm2 * s.rps]
    };
    let (mut first, mut sums, mut best, mut moment) = (0, [0.0; 2], None::<Peak>, 0.0f64);
    for spot in spots {
        let power = parts(spot);
        let lasts = spot.end_s - spot.start_s;
        moment = moment.max(if lasts > 0.0 { power[0] + power[1] } else { 0.0 });
        (sums[0], sums[1]) = (sums[0] + power[0] * lasts, sums[1] + power[1] * lasts);
        while spots[first].end_s < spot.end_s - PEAK_MEAN_S {
            let (left, gone) = (&spots[first], parts(&spots[first]));
            let lasted = left.end_s - left.start_s;
            (sums[0], sums[1]) = (sums[0] - gone[0] * lasted, sums[1] - gone[1] * lasted);
            first += 1;
        }
        // The part of the oldest spot that lies before the second.
        let (oldest, old) = (&spots[first], parts(&spots[first]));
        let too_much = (spot.end_s - PEAK_MEAN_S - oldest.start_s).max(0.0);
        let energy = [sums[0] - old[0] * too_much, sums[1] - old[1] * too_much];
        let second_w = (energy[0] + energy[1]) / PEAK_MEAN_S;
        if second_w > best.as_ref().map_or(1e-9, |b| b.second_w) && spot.tool == tool {
            best =
                Some(Peak { second_w, moment_w: 0.0, edge_share: energy[1] / (energy[0] + energy[1]), rps: spot.rps });
        }
    }
    best.map(|b| Peak { moment_w: moment.max(b.second_w), ..b })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_in_several_spellings() {
        let expected = Reading { tool: 1, peak: 45.0, idle: 8.0, percent: true };
        for text in ["T1 peak 45% idle 8%", "t1: idle 8 %, peak=45 %", "T1 peak 45percent idle 8 percent"] {
            assert_eq!(parse(text).unwrap(), expected, "{text}");
        }
        assert_eq!(
            parse("T2 peak 2.1kW idle 300 W").unwrap(),
            Reading { tool: 2, peak: 2100.0, idle: 300.0, percent: false }
        );
        for text in
            ["", "T1 peak 45%", "T1 peak 45 idle 8", "peak 45% idle 8%", "T1 peak 45% idle 8 W", "T1 peak -4% idle 8%"]
        {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
