//! Effects of a process model that change the job before anything is simulated. In: a job whose process model has effects. Out: stock, tools
//! and machine changed by these effects, and an assumption for each.
//!
//! Effects on loads stay in the process model and are applied station by station (`force/modifiers.rs`). Effects on the measuring chain do not
//! change a cut. An accident in the log (a chipped edge) will not happen again and is left out, unless it holds from the beginning of the log on:
//! then it cannot be told from something permanent.

use crate::effects::unnamed::{BEYOND, CURVES, FACTOR, PLACE};
use crate::effects::{Acts, Change, Covariate, Effect, Excess, Multiplies, Place, State, named};
use crate::machine::material::EffectUse;
use crate::machine::{Job, Stock, StockShape};
use crate::setup::{Assumption, LEARNED};

/// Stock larger than declared, by this much at most, counts as the same.
const NOTHING_MM: f64 = 1e-9;

/// Share of a load that a model may leave unexplained without a remark: the margin that is commonly kept below limits.
const WORTH_SAYING: f64 = 0.05;

/// A remark on the scatter that the model left unexplained, where the setup asks for no confidence and caps therefore have no margin.
pub fn unexplained(job: &Job) -> Option<Assumption> {
    let scatter = job.process.scatter.filter(|s| *s >= WORTH_SAYING && job.confidence.is_none())?;
    let value = format!(
        "its loads were off by {:.0} % (one standard deviation) on data it had not seen; --confidence 0.95 leaves room for that",
        100.0 * scatter
    );
    Some(Assumption { key: "process.scatter".into(), value, source: LEARNED.into() })
}

/// Replaces effects that cannot be predicted for another run by their largest factor on all cuts: curves without a named cause over the time of
/// the log or over the speed of the axes; and an excess of the meter over the load of which no full load is known.
/// Without this the coefficients would be those of the middle of the log, or of a part of the reading. Until the cause is known, the largest
/// load counts everywhere.
pub fn at_their_largest(job: &mut Job) -> Vec<Assumption> {
    let (held, effects): (Vec<EffectUse>, Vec<EffectUse>) =
        job.process.effects.drain(..).partition(|used| largest_factor(used).is_some());
    job.process.effects = effects;
    let factors = || held.iter().filter_map(largest_factor);
    for (is_tare, name) in [(false, ON_EVERY_CUT), (true, ALWAYS)] {
        let own = held.iter().filter(|used| multiplies_tare(used) == is_tare);
        let factor: f64 = own.filter_map(largest_factor).product();
        if factor > 1.0 {
            // A curve without knots is one factor.
            let parameters = vec![("factor_1".to_owned(), factor)];
            job.process.effects.push(EffectUse { name: name.into(), parameters });
        }
    }
    let say = |(used, factor): (&EffectUse, f64)| Assumption {
        key: format!("process.{}", used.name),
        value: format!(
            "{}, +{:.0} %, {}",
            if multiplies_tare(used) {
                "the tare is taken at the largest that it showed"
            } else {
                "every cut is taken at the largest load it showed"
            },
            100.0 * (factor - 1.0),
            until(used)
        ),
        source: LEARNED.into(),
    };
    held.iter().zip(factors()).map(say).collect()
}

/// Makes curves without a named cause over the feed per tooth or the chip thickness rise towards less feed: each factor becomes the largest from
/// there on. Thin chips take more force for their section (size effect), not less; where a log seems to show less, the cuts at that feed were others,
/// and a feed a little lower would seem to take a fifth of the load away.
pub fn no_easier_at_less_feed(job: &mut Job) -> Vec<Assumption> {
    let is_of_feed = |used: &&mut EffectUse| {
        let of = CURVES.iter().find(|(_, effect)| effect.name == used.name && effect.multiplies == Multiplies::Load);
        of.is_some_and(|(covariate, _)| matches!(covariate, Covariate::FeedPerTooth | Covariate::ChipThickness))
    };
    let said = |used: &mut EffectUse| {
        let more = risen_towards_less(&mut used.parameters);
        let value = format!(
            "cuts at less feed are taken to need as much force for their chip as those at more, up to +{:.0} %: what the log shows of feeds may \
             be of the cuts that ran at them",
            100.0 * (more - 1.0)
        );
        (more > 1.0).then(|| Assumption { key: format!("process.{}", used.name), value, source: LEARNED.into() })
    };
    job.process.effects.iter_mut().filter(is_of_feed).filter_map(said).collect()
}

/// Raises each factor of a curve to the largest of those at higher values of its covariate; the most that one is raised by.
fn risen_towards_less(parameters: &mut [(String, f64)]) -> f64 {
    let known: Vec<(String, f64)> = parameters.to_vec();
    let at = |k: &str| known.iter().find(|(name, _)| name.strip_prefix(PLACE) == Some(k)).map(|(_, at)| *at);
    let mut knots: Vec<(f64, usize)> = (0..known.len())
        .filter_map(|i| Some((at(known[i].0.strip_prefix(FACTOR)?).filter(|at| *at < BEYOND)?, i)))
        .collect();
    knots.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut largest, mut most): (f64, f64) = (0.0, 1.0);
    for (_, i) in knots {
        let factor = &mut parameters[i].1;
        most = most.max(largest / *factor);
        largest = largest.max(*factor);
        *factor = largest;
    }
    most
}

/// The largest factor on the load of an effect that cannot be predicted for another run; `None` for other effects.
fn largest_factor(used: &EffectUse) -> Option<f64> {
    let excess = named(&used.name).map(|effect| change_of(effect, used).excess).unwrap_or_default();
    if excess.at_full > 0.0 && excess.full().is_none() {
        return Some(1.0 + excess.at_full);
    }
    let (covariate, effect) = CURVES.iter().find(|(_, effect)| effect.name == used.name)?;
    let is_unforeseen = match covariate {
        Covariate::Time => effect.multiplies != Multiplies::Reading,
        Covariate::PathSpeed => effect.multiplies == Multiplies::Load,
        _ => false,
    };
    let factors = used.parameters.iter().filter(|(name, _)| name.starts_with("factor")).map(|(_, value)| *value);
    is_unforeseen.then(|| factors.fold(1.0, f64::max))
}

fn multiplies_tare(used: &EffectUse) -> bool {
    named(&used.name).is_some_and(|effect| effect.multiplies == Multiplies::Tare)
}

fn until(used: &EffectUse) -> &'static str {
    if CURVES.iter().any(|(_, effect)| effect.name == used.name) {
        return "until its cause is known: nothing foretells it";
    }
    DRIVE
}

/// The curve that carries one factor on every cut: its covariate is known everywhere.
const ON_EVERY_CUT: &str = "unnamed-load-spindle-speed";
/// The same of the tare.
const ALWAYS: &str = "unnamed-tare-spindle-speed";

/// The job as the learned effects say.
pub fn apply(job: &mut Job) -> Vec<Assumption> {
    let mut said = Vec::new();
    for used in job.process.effects.clone() {
        let Some(effect) = named(&used.name) else { continue };
        let change = change_of(effect, &used);
        match effect.acts {
            Acts::Geometry => said.extend(geometry(job, effect, &change)),
            Acts::Motion => {
                job.machine = job.machine.with_acceleration(change.acceleration);
                said.push(learned(effect, format!("{:.0} % of the declared", 100.0 * change.acceleration)));
            }
            Acts::Measuring => said.push(learned(effect, of_readings(&change.excess))),
            Acts::Load if effect.is_accident && !is_from_the_beginning(effect, &used) => {
                job.process.effects.retain(|other| other.name != used.name);
                said.push(learned(effect, sound_tool(&used)));
            }
            Acts::Load if effect.is_accident => said.push(learned(effect, until_parted(&used))),
            Acts::Load => {}
        }
    }
    said
}

/// What a change of readings does to predicted loads: what is read beyond the load counts as load.
fn of_readings(excess: &Excess) -> String {
    let [power, torque] = [(excess.full_power, "W"), (excess.full_torque_nm, "N·m")];
    let Some((full, unit)) = [power, torque].into_iter().find(|(full, _)| excess.at_full > 0.0 && *full > 0.0) else {
        return "changes readings, not the cut".into();
    };
    format!(
        "loads count as the meter showed them, +{:.0} % at {} {unit} and less below it, {DRIVE}",
        100.0 * excess.at_full,
        (100.0 * full).round() / 100.0
    )
}

/// When what a drive reads more counts as load no longer.
const DRIVE: &str = "until the setup says what the drive loses (machine.spindle.efficiency = [[reading, ratio], ...])";

/// An accident that is known for one: what is taken out, and what that asks for.
fn sound_tool(used: &EffectUse) -> String {
    if CURVES.iter().any(|(_, effect)| effect.name == used.name) {
        return format!("left out, nothing foretells it for another run: {} at its own times", more(used));
    }
    format!(
        "left out, it happened once: these are the loads of a sound tool, so put one in; the old one takes {}",
        more(used)
    )
}

/// An accident that may as well be something that stays.
fn until_parted(used: &EffectUse) -> String {
    format!(
        "in force from the beginning on, {}, until a cut has told it from what else the log may show (learn --experiment)",
        more(used)
    )
}

/// What it adds at most: the largest of its jumps, or of the factors of a curve less one.
fn more(used: &EffectUse) -> String {
    let jump = |(name, value): &(String, f64)| match name {
        _ if name.starts_with("jump") => Some(*value),
        _ if name.starts_with(FACTOR) => Some(value - 1.0),
        _ => None,
    };
    format!("up to {:.0} % more", 100.0 * used.parameters.iter().filter_map(jump).fold(0.0, f64::max))
}

/// Does its instant lie at the beginning of the program?
fn is_from_the_beginning(effect: &Effect, used: &EffectUse) -> bool {
    let instant = effect.parameters.iter().find(|p| p.place == Some(Place::Instant));
    instant.is_some_and(|p| used.parameters.iter().any(|(name, value)| name == p.name && *value <= 0.0))
}

/// Effects on geometry and motion do not depend on the cut.
fn change_of(effect: &Effect, used: &EffectUse) -> Change {
    change_at(effect, used, &State::default())
}

fn change_at(effect: &Effect, used: &EffectUse, state: &State) -> Change {
    effect.values(used).map_or_else(Change::default, |values| (effect.change)(&values, state))
}

fn geometry(job: &mut Job, effect: &Effect, change: &Change) -> Option<Assumption> {
    let [top, side] = [highest_top(job, change), change.stock_side_mm];
    let turned_mm = most_by_turning(job, change.stock_turn_rad);
    let sides = change.stock_faces_mm.map(|face| side + face + turned_mm);
    if sides.into_iter().fold(top.abs(), |most, side| most.max(side.abs())) > NOTHING_MM {
        *job = job.with_faces_moved(top, sides);
        let fixed = |shape: &StockShape| matches!(shape, StockShape::Stl(_) | StockShape::Saved(_));
        for stock in job.stocks.iter_mut().filter(|stock| fixed(&stock.shape)) {
            stock.uncertainty_mm += sides.into_iter().fold(0.0, f64::max);
        }
        let is_of_file = job.stocks.iter().any(|stock| fixed(&stock.shape)) && change.stock_slope != [0.0; 2];
        let over =
            if is_of_file { ", its slope over 300 mm about the zero point, for the stock is from a file" } else { "" };
        return Some(learned(effect, faces_moved(top, sides) + over));
    }
    let by = change.diameter_mm;
    if by.abs() > NOTHING_MM {
        *job = job.with_mills_wider(by)?;
        return Some(learned(effect, format!("{by:+.3} mm")));
    }
    let offset_mm = change.runout_mm;
    (offset_mm > NOTHING_MM).then(|| {
        *job = job.with_mills_off_axis(offset_mm, change.runout_phase);
        learned(effect, format!("{offset_mm:.4} mm, on every end mill"))
    })
}

/// How far a turn moves a face of the stock outward at most, mm: |sin| of it times half the longest side of a box. Stock is not turned in
/// a simulation: with every face moved out so far it encloses the turned one, which is the safe reading.
fn most_by_turning(job: &Job, turn_rad: f64) -> f64 {
    let half = |stock: &Stock| match &stock.shape {
        StockShape::Box(blank) => 0.5 * (blank.max.x - blank.min.x).max(blank.max.y - blank.min.y),
        _ => 0.0,
    };
    turn_rad.sin().abs() * job.stocks.iter().map(half).fold(0.0, f64::max)
}

/// How far from the zero point the top of stock from a file counts, whose extent is not known here, mm.
const REACH_OF_A_FILE_MM: f64 = 300.0;

/// By how much the top of the stock is higher at most, mm. Stock has a level top in a simulation: raised by this it encloses one with a slope,
/// which is the safe reading.
fn highest_top(job: &Job, change: &Change) -> f64 {
    let of = |stock: &Stock| {
        let [x, y] = match &stock.shape {
            StockShape::Box(blank) => [[blank.min.x, blank.max.x], [blank.min.y, blank.max.y]],
            StockShape::Cylinder { centre: [x, y], diameter_mm, .. } => {
                [*x, *y].map(|c| [-0.5, 0.5].map(|r| c + r * diameter_mm))
            }
            StockShape::Stl(_) | StockShape::Saved(_) => [[-REACH_OF_A_FILE_MM, REACH_OF_A_FILE_MM]; 2],
        };
        [x.map(|x| x + stock.moved_mm.x), y.map(|y| y + stock.moved_mm.y)]
    };
    let corners = job.stocks.iter().map(of).flat_map(|[x, y]| [[x[0], y[0]], [x[1], y[0]], [x[0], y[1]], [x[1], y[1]]]);
    corners.map(|[x, y]| change.stock_top_at_mm(x, y)).reduce(f64::max).unwrap_or(change.stock_top_mm)
}

fn faces_moved(top: f64, sides: [f64; 4]) -> String {
    if sides.iter().all(|side| *side == sides[0]) {
        return format!("{top:+.2} mm on top, {:+.2} mm on each side", sides[0]);
    }
    let [x_min, x_max, y_min, y_max] = sides;
    format!(
        "{top:+.2} mm on top, outward {x_min:+.2} mm at −x, {x_max:+.2} at +x, {y_min:+.2} at −y, {y_max:+.2} at +y"
    )
}

fn learned(effect: &Effect, value: String) -> Assumption {
    Assumption { key: format!("process.{}", effect.name), value, source: LEARNED.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(effect: &str, parameters: &[(&str, f64)]) -> Job {
        let text = "[stock]\nmaterial = \"aluminium-6061-t6\"\nbox = { min = [0, 0, -20], max = [100, 60, 0] }\n\
                    [[tool]]\nnumber = 1\nshape = \"flat\"\ndiameter = 10\nflutes = 3\n";
        let (mut job, _) = crate::setup::load(text, std::path::Path::new(".")).expect("a sound setup");
        let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        job.process.effects.push(EffectUse { name: effect.into(), parameters });
        job
    }

    #[test]
    fn geometry_and_motion_are_those_that_were_learned() {
        let mut proud = job("stock-proud", &[("top", 0.4), ("side", 0.0)]);
        assert_eq!(apply(&mut proud).len(), 1);
        let StockShape::Box(shape) = &proud.stocks[0].shape else { panic!("a box") };
        assert_eq!([shape.max.z, shape.max.x], [0.4, 100.0]);
        let mut shifted = job("stock-proud", &[("top", 0.0), ("side", 0.0), ("x_min", -0.3), ("x_max", 0.3)]);
        let said = apply(&mut shifted);
        let StockShape::Box(shape) = &shifted.stocks[0].shape else { panic!("a box") };
        assert_eq!([shape.min.x, shape.max.x, shape.min.y, shape.max.z], [0.3, 100.3, 0.0, 0.0]);
        assert!(said[0].value.contains("-0.30 mm at −x, +0.30 at +x"), "{}", said[0].value);
        // A top with a slope counts as level at its highest corner, where x = 100 and y = 0.
        let mut askew = job("stock-proud", &[("top", 0.1), ("slope_x", 0.5), ("slope_y", -1.0)]);
        apply(&mut askew);
        let StockShape::Box(shape) = &askew.stocks[0].shape else { panic!("a box") };
        assert!((shape.max.z - 0.6).abs() < 1e-12, "{}", shape.max.z);
        // The extent of stock from a file is not known: 300 mm count.
        let mut handed_on = job("stock-proud", &[("top", 0.1), ("slope_x", 0.5)]);
        handed_on.stocks[0].shape = StockShape::Saved("before.stock".into());
        let said = apply(&mut handed_on);
        assert!((handed_on.stocks[0].moved_mm.z - 1.6).abs() < 1e-12 && said[0].value.contains("300 mm"), "{said:?}");
        let mut small = job("tool-diameter", &[("difference", -0.2)]);
        apply(&mut small);
        assert!((small.tools[0].diameter_mm - 9.8).abs() < 1e-12);
        let mut off = job("runout", &[("offset", 0.02), ("phase", 0.5)]);
        apply(&mut off);
        let runout = off.tools[0].runout.expect("a runout");
        assert!(runout.offset_mm == 0.02 && (runout.angle_rad - std::f64::consts::PI / 3.0).abs() < 1e-12);
        let mut slow = job("corner-feed", &[("acceleration", 0.25)]);
        let declared = slow.machine.axes[0].acceleration_mm_s2;
        apply(&mut slow);
        assert_eq!(slow.machine.axes[0].acceleration_mm_s2, 0.25 * declared);
    }

    #[test]
    fn a_tare_over_the_time_of_a_log_counts_at_its_largest() {
        let mut job =
            job("unnamed-tare-time", &[("at_1", 10.0), ("at_2", 90.0), ("factor_1", 1.0), ("factor_2", 1.29)]);
        let said = at_their_largest(&mut job);
        assert!(said[0].value.contains("the tare") && said[0].value.contains("+29 %"), "{said:?}");
        assert_eq!(apply(&mut job), []);
        let [used] = &job.process.effects[..] else { panic!("one effect: {:?}", job.process.effects) };
        let effect = named(&used.name).expect("of the list");
        let change = change_at(effect, used, &State { rps: 50.0, ..State::default() });
        assert_eq!([change.tare, change.cutting], [1.29, 1.0]);
    }

    #[test]
    fn a_curve_over_the_time_of_a_log_counts_at_its_largest() {
        let mut job =
            job("unnamed-load-time", &[("at_1", 10.0), ("at_2", 90.0), ("factor_1", 0.9), ("factor_2", 1.25)]);
        let said = at_their_largest(&mut job);
        assert!(said[0].value.contains("+25 %"), "{said:?}");
        assert_eq!(apply(&mut job), []);
        let [used] = &job.process.effects[..] else { panic!("one effect: {:?}", job.process.effects) };
        assert_eq!(used.parameters, [("factor_1".to_owned(), 1.25)]);
        let effect = named(&used.name).expect("of the list");
        let state = State { rps: 50.0, ..State::default() };
        assert_eq!(change_at(effect, used, &state).cutting, 1.25);
    }

    #[test]
    fn less_feed_makes_no_cut_easier_and_may_make_it_harder() {
        let curve = |name: &str, factors: [f64; 3]| {
            let places = [0.03, 0.07, 0.09].into_iter().enumerate().map(|(k, at)| (format!("at_{}", k + 1), at));
            let factors = factors.into_iter().enumerate().map(|(k, factor)| (format!("factor_{}", k + 1), factor));
            let all: Vec<(String, f64)> = places.chain(factors).collect();
            let mut job = job(name, &all.iter().map(|(name, value)| (name.as_str(), *value)).collect::<Vec<_>>());
            let said = no_easier_at_less_feed(&mut job);
            let own = job.process.effects[0].parameters[3..].iter().map(|(_, factor)| *factor).collect::<Vec<_>>();
            (said.first().map(|said| said.value.contains("+25 %")), own)
        };
        assert_eq!(curve("unnamed-load-feed-per-tooth", [1.1, 0.8, 1.0]), (Some(true), vec![1.1, 1.0, 1.0]));
        assert_eq!(curve("unnamed-load-chip-thickness", [1.3, 1.1, 1.0]), (None, vec![1.3, 1.1, 1.0]));
        assert_eq!(curve("unnamed-load-axial-depth", [1.1, 0.8, 1.0]), (None, vec![1.1, 0.8, 1.0]));
    }

    #[test]
    fn a_model_that_left_much_unexplained_says_so_unless_room_is_left() {
        let mut job = job("sensor-lag", &[]);
        let mut said = |scatter: f64, confidence: Option<f64>| {
            (job.process.scatter, job.confidence) = (Some(scatter), confidence);
            unexplained(&job).map(|told| told.value)
        };
        assert!(said(0.051, None).is_some_and(|text| text.contains("5 %")));
        assert_eq!([said(0.049, None), said(0.2, Some(0.95))], [None, None]);
    }

    #[test]
    fn what_a_meter_reads_beyond_the_load_counts_as_load() {
        let mut drive = job("drive-efficiency", &[("excess", 0.22), ("exponent", 1.0)]);
        assert!(at_their_largest(&mut drive)[0].value.contains("+22 %"));
        assert_eq!(drive.process.effects[0].parameters, [("factor_1".to_owned(), 1.22)]);
        // With the full load it is known for every cut.
        let known = [("excess", 0.22), ("exponent", 1.0), ("full_power", 800.0)];
        let mut drive = job("drive-efficiency", &known);
        assert_eq!((at_their_largest(&mut drive), drive.process.effects.len()), (Vec::new(), 1));
        assert!(apply(&mut drive)[0].value.contains("+22 % at 800 W"));
        // A lag of the sensor changes no load.
        let mut lag = job("sensor-lag", &[("time_constant", 0.3)]);
        assert_eq!((at_their_largest(&mut lag), lag.process.effects.len()), (Vec::new(), 1));
    }

    #[test]
    fn an_accident_does_not_happen_again() {
        let mut job = job("edge-chipping", &[("jump_cutting", 0.2), ("jump_edge", 0.3), ("time", 100.0)]);
        let said = apply(&mut job);
        assert!(said[0].value.contains("put one in; the old one takes up to 30 % more"), "{said:?}");
        assert!(job.process.effects.is_empty());
    }

    #[test]
    fn a_curve_over_the_time_of_another_log_is_left_out() {
        let mut job =
            job("unnamed-load-time", &[("at_1", 10.0), ("factor_1", 0.9), ("at_2", 90.0), ("factor_2", 1.25)]);
        let said = apply(&mut job);
        assert!(said[0].value.contains("left out, nothing foretells it for another run: up to 25 % more"), "{said:?}");
        assert!(job.process.effects.is_empty());
    }

    #[test]
    fn an_accident_from_the_beginning_on_stays() {
        let mut job = job("edge-chipping", &[("jump_cutting", 0.2), ("jump_edge", 0.3), ("time", 0.0)]);
        let said = apply(&mut job);
        assert!(said[0].value.starts_with("in force from the beginning on, up to 30 % more"), "{said:?}");
        assert_eq!(job.process.effects.len(), 1);
    }
}
