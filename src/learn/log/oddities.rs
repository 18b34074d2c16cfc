//! Implausible values of a log: clipping at the end of the range, single-sample spikes, wrong units. In: a log. Out:
//! warnings; only spikes beyond the range of the others are taken out.

use super::sampled::Log;
use crate::learn::regress::statistics::median;

/// Plausible range of the largest reading of a quantity on a milling machine, in the unit of its column, and the
/// probable units outside that range: spindles idle with tens of watts and reach about 100 kW and 2000 N·m (makers'
/// tables of router spindles and of gear-driven boring mills); cutting forces are between newtons and tens of
/// kilonewtons.
const PLAUSIBLE: [(&str, f64, f64, &str); 6] = [
    ("spindle_power_w", 15.0, 3e5, "kW below, mW above"),
    ("spindle_torque_nm", 0.005, 5e3, "kN·m below, N·mm above"),
    ("spindle_load_percent", 1.5, 1e3, "a share of 1 below, thousandths above"),
    ("force_x_n", 0.5, 1e5, "kN below, mN above"),
    ("force_y_n", 0.5, 1e5, "kN below, mN above"),
    ("force_xy_n", 0.5, 1e5, "kN below, mN above"),
];

/// Least share of readings equal to the maximum for clipping: a noisy signal has its maximum once or twice. Judgement,
/// like the others.
const CLIPPED_SHARE: f64 = 0.005;
/// Least ratio of readings at the maximum to those in the 2 % of the range below it: a signal that is not clipped is
/// rarer towards its maximum.
const CLIPPED_EXCESS: f64 = 3.0;
/// Largest share of triples of equal readings below the maximum at which clipping is detected.
const STILL_SHARE: f64 = 0.05;
/// Least difference of a spike to both its neighbours, in median steps from reading to reading. Normal noise exceeds it
/// with probability 2e-7; after an entry of the tool the load stays high.
const SPIKE_STEPS: f64 = 12.0;
/// The same as a share of the range of the middle 98 %.
const SPIKE_RANGE: f64 = 0.5;

/// Warnings about implausible values.
pub fn of(log: &Log) -> Vec<String> {
    let mut said: Vec<String> = milliseconds(log).into_iter().collect();
    for (name, values) in &log.measured {
        said.extend(missing(name, values).filter(|_| !log.on_change));
        said.extend(implausible(name, values));
        let known: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_finite()).collect();
        said.extend(clipped(name, values, &known));
    }
    said
}

/// Leaves out spikes beyond the range of the other readings, and says where spikes are.
pub fn leave_out_spikes(log: &mut Log) -> Vec<String> {
    let of_spindle = log.measured.iter_mut().filter(|(name, _)| !log.on_change && name.starts_with("spindle"));
    of_spindle.filter_map(|(name, values)| spikes(name, values, &log.time_s)).collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().filter(|value| value.is_finite()).fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// Cells without a number, or with one beyond 1e20.
fn missing(name: &str, values: &[f64]) -> Option<String> {
    let none = values.iter().filter(|value| !value.is_finite()).count();
    (none > 0).then(|| format!("{name}: {none} of {} readings are empty or no number and are left out", values.len()))
}

fn implausible(name: &str, values: &[f64]) -> Option<String> {
    let (_, least, greatest, suspect) = PLAUSIBLE.iter().find(|(known, ..)| *known == name)?;
    let most = largest(values);
    let odd = most > 0.0 && !(*least..=*greatest).contains(&most);
    odd.then(|| format!("{name} is {most:.3} at most: is it in another unit by a factor of 1000 ({suspect})?"))
}

fn clipped(name: &str, values: &[f64], known: &[usize]) -> Option<String> {
    let (least, most) =
        known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), i| (a.min(values[*i]), b.max(values[*i])));
    let at_top = known.iter().filter(|i| values[**i] == most).count();
    let below = known.iter().filter(|i| values[**i] < most && values[**i] > most - 0.02 * (most - least)).count();
    let many = at_top >= 10 && at_top as f64 > CLIPPED_SHARE * known.len() as f64;
    // A signal without noise, or in coarse steps, has equal readings at every level: no clipping can be seen.
    let still = |three: &&[usize]| three.iter().all(|i| values[*i] == values[three[0]]);
    let (top, elsewhere): (Vec<&[usize]>, Vec<&[usize]>) =
        known.windows(3).filter(still).partition(|three| values[three[0]] == most);
    let lively = (elsewhere.len() as f64) < STILL_SHARE * (known.len() - at_top) as f64;
    let odd = many && lively && !top.is_empty() && most > least && at_top as f64 > CLIPPED_EXCESS * below as f64;
    odd.then(|| {
        format!("{name} stands at {most} in {at_top} readings and is never above: the meter may be clipped there")
    })
}

fn spikes(name: &str, values: &mut [f64], time_s: &[f64]) -> Option<String> {
    let known: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_finite()).collect();
    if known.len() < 100 {
        return None;
    }
    let steps: Vec<f64> = known.windows(2).map(|two| (values[two[1]] - values[two[0]]).abs()).collect();
    let mut sorted: Vec<f64> = known.iter().map(|i| values[*i]).collect();
    sorted.sort_by(f64::total_cmp);
    let [low, high] = [sorted[sorted.len() / 100], sorted[sorted.len() * 99 / 100]];
    let range = high - low;
    let least = (SPIKE_STEPS * median(&steps)).max(SPIKE_RANGE * range);
    let alone = |three: &&[usize]| {
        let [before, at, after] = [three[0], three[1], three[2]].map(|i| values[i]);
        (at - before).abs() > least && (at - after).abs() > least && (at > before) == (at > after)
    };
    let found: Vec<usize> = known.windows(3).filter(alone).map(|three| three[1]).collect();
    let first = found.first().filter(|_| least > 0.0 && found.len() * 100 < known.len())?;
    let beyond: Vec<usize> =
        found.iter().copied().filter(|i| !(low - least..=high + least).contains(&values[*i])).collect();
    let first = format!("{:.4} at {:.2} s", values[*first], time_s[*first]);
    let left_out = match (found.len(), beyond.len()) {
        (_, 0) => "none is beyond all other readings, so none is left out".to_owned(),
        (1, _) => "it is beyond all other readings and left out".to_owned(),
        (_, some) => format!("{some} of them, beyond all other readings, left out"),
    };
    let said = match found.len() {
        1 => format!("{name} has a spike of a single reading ({first}), which no cut causes; {left_out}"),
        some => {
            format!("{name} has {some} spikes of a single reading (first {first}), which no cut causes; {left_out}")
        }
    };
    for i in beyond {
        values[i] = f64::NAN;
    }
    Some(said)
}

/// Integer times in steps of 5 to 1000 are probably milliseconds (1 to 200 Hz).
fn milliseconds(log: &Log) -> Option<String> {
    let whole = log.time_s.iter().all(|time| time.fract() == 0.0);
    let steps: Vec<f64> = log.time_s.windows(2).map(|two| two[1] - two[0]).collect();
    let step = median(&steps);
    (whole && !log.on_change && log.time_s.len() >= 100 && (5.0..=1000.0).contains(&step))
        .then(|| format!("readings are {step} s apart: if the times are milliseconds, name the column time_ms"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(values: Vec<f64>, step_s: f64) -> Log {
        let time_s = (0..values.len()).map(|k| k as f64 * step_s).collect();
        Log { time_s, measured: vec![("spindle_power_w", values)], ..Log::default() }
    }

    /// A cut of 40 s at some 800 W with a little noise, at 20 Hz, with air before and after.
    fn cut() -> Vec<f64> {
        let noise = |k: usize| ((k * 7919) % 101) as f64 * 0.2;
        (0..1000).map(|k| if (100..900).contains(&k) { 800.0 + (k % 200) as f64 } else { 200.0 } + noise(k)).collect()
    }

    #[test]
    fn a_clean_cut_is_not_odd() {
        assert_eq!(of(&log(cut(), 0.05)), Vec::<String>::new());
        // A load meter in whole percent has its maximum several times.
        let meter: Vec<f64> = cut().iter().map(|value| (value * 0.05).round()).collect();
        assert_eq!(of(&log(meter, 0.05)), Vec::<String>::new());
    }

    #[test]
    fn an_end_of_range_and_a_spike_are_said() {
        let clipped = cut().into_iter().map(|value| value.min(950.0)).collect();
        let said = of(&log(clipped, 0.05));
        assert!(said.len() == 1 && said[0].contains("stands at 950"), "{said:?}");
        // Without noise every level of a load is constant.
        let level = |k: u32| if k % 200 < 100 { 950.0 } else { 300.0 };
        assert_eq!(of(&log((0..1000).map(level).collect(), 0.05)), Vec::<String>::new());
        let mut spiky = cut();
        spiky[500] = 4000.0;
        let mut log_of = log(spiky, 0.05);
        let said = leave_out_spikes(&mut log_of);
        assert!(said.len() == 1 && said[0].contains("at 25.00 s"), "{said:?}");
        assert!(log_of.measured[0].1[500].is_nan() && log_of.measured[0].1[501].is_finite());
        // Two readings in a row are a load.
        let mut load = cut();
        (load[500], load[501]) = (4000.0, 4000.0);
        assert_eq!(leave_out_spikes(&mut log(load, 0.05)), Vec::<String>::new());
    }

    #[test]
    fn what_is_no_number_is_counted() {
        let mut holed = cut();
        (holed[7], holed[8]) = (f64::NAN, f64::INFINITY);
        let said = of(&log(holed.clone(), 0.05));
        assert!(said.len() == 1 && said[0].contains("2 of 1000 readings"), "{said:?}");
        // If rows come with every change of any item, most have no reading of a load.
        assert_eq!(of(&Log { on_change: true, ..log(holed, 0.05) }), Vec::<String>::new());
    }

    #[test]
    fn units_that_cannot_be_are_suspected() {
        let kilowatts = cut().into_iter().map(|value| value * 1e-3).collect();
        assert!(of(&log(kilowatts, 0.05))[0].contains("kW"), "a thousandth");
        let milliwatts = cut().into_iter().map(|value| value * 1e3).collect();
        assert!(of(&log(milliwatts, 0.05))[0].contains("mW"), "a thousand times");
        assert!(of(&log(cut(), 50.0))[0].contains("time_ms"));
        assert_eq!(of(&log(cut(), 1.0)), Vec::<String>::new());
    }
}
