//! Steady cuts of a log. In: a log aligned with its program. Out: a table with one row for every move whose engagement
//! and speed are constant long enough, with the means of the readings. So a calibration can use the log of a test
//! program (`calibrate --plan`) or of any program.
//!
//! Of each feed move the longest stretch is used in which the removal area stays within 3 % and the speed within 5 % of
//! their medians; samples closer to its ends than the uncertainty of the alignment are left out. Forces in machine axes
//! become x along the feed and y into the wall. Moves in air give the tare.

use crate::force::closed::{Rates, SteadyCut};
use crate::learn::align::Aligned;
use crate::learn::dataset::measured_feed::{MeasuredFeed, measured_feed};
use crate::learn::dataset::steady_table::{Side, SteadyRow};
use crate::learn::log::Log;
use crate::learn::log::columns::{DataError, Frame};
use crate::learn::log::quantity::MEASURED;
use crate::learn::program::timeline::{Activity, Spot, Timeline};
use crate::machine::Job;

/// Fewest samples of a cut.
const FEWEST: usize = 4;
/// Relative deviation of removal area and speed that counts as constant.
const SECTION: f64 = 0.03;
const SPEED: f64 = 0.05;
/// Least distance from the ends of a steady stretch, s.
const GUARD_S: f64 = 0.1;
/// Measured quantities that become columns: all but the axial force.
fn measured() -> impl Iterator<Item = &'static str> {
    MEASURED.into_iter().filter(|name| *name != "force_z_n")
}

/// The steady cuts of a log, and the means of their readings as columns. `on_tool`: forces are on the tool, not the
/// workpiece.
pub fn steady_cuts(
    log: &Log,
    aligned: &Aligned,
    timeline: &Timeline,
    job: &Job,
    on_tool: bool,
) -> Result<(Frame, Vec<SteadyRow>), DataError> {
    let mut placed: Vec<(usize, usize)> = aligned
        .program_s
        .iter()
        .enumerate()
        .filter_map(|(sample, t)| timeline.at(*t).map(|spot| (spot, sample)))
        .collect();
    placed.sort_unstable();
    let feed = measured_feed(log, aligned, timeline);
    let stands = |i: &usize| feed.as_ref().is_some_and(|feed| feed.stands(*i));
    let guard_s = f64::max(GUARD_S, 3.0 * aligned.uncertainty_s);
    let mut rows = Vec::new();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); measured().count()];
    let mut first = 0;
    while first < timeline.spots.len() {
        let last = end_of_move(timeline, first);
        if let Some(stretch) = steady_stretch(&timeline.spots[first..last]) {
            let spots = first + stretch.start..first + stretch.end;
            let from = timeline.spots[spots.start].start_s + guard_s;
            let to = timeline.spots[spots.end - 1].end_s - guard_s;
            let begin = placed.partition_point(|(spot, _)| *spot < spots.start);
            let end = placed.partition_point(|(spot, _)| *spot < spots.end);
            let inside = |i: &usize| (from..=to).contains(&aligned.program_s[*i]);
            let members: Vec<usize> =
                placed[begin..end].iter().map(|(_, sample)| *sample).filter(|i| inside(i) && !stands(i)).collect();
            let middle = &timeline.spots[usize::midpoint(spots.start, spots.end)];
            if members.len() >= FEWEST
                && let Some(row) = row_of(log, feed.as_ref(), &members, middle, job, rows.len())
            {
                let means = means(log, &members, middle, on_tool);
                columns.iter_mut().zip(means).for_each(|(column, mean)| column.push(mean));
                rows.push(row);
            }
        }
        first = last;
    }
    if rows.len() < 3 {
        return Err(DataError::Unfit(format!(
            "the log has only {} steady cuts; give longer straight passes, or --log of a program by --plan",
            rows.len()
        )));
    }
    let known = measured().zip(columns).filter(|(_, values)| values.iter().any(|v| v.is_finite()));
    let frame = Frame::from_numbers(known.map(|(name, values)| (name.to_owned(), values)).collect());
    Ok((frame, rows))
}

/// One past the last spot of the move of spot `first`.
fn end_of_move(timeline: &Timeline, first: usize) -> usize {
    let own = timeline.spots[first].move_id;
    let same = |spot: &&Spot| own.is_some() && spot.move_id == own;
    first + timeline.spots[first..].iter().take_while(same).count().max(1)
}

/// Longest run of spots with constant removal area, speed and direction; `None` if it is no feed move.
fn steady_stretch(spots: &[Spot]) -> Option<std::ops::Range<usize>> {
    let first = spots.first().filter(|s| s.activity == Activity::Feed && s.rps > 0.0)?;
    let level = weighted_median(spots, |s| s.engaged.section_mm2);
    let speed = weighted_median(spots, Spot::speed_mm_s);
    let steady = |s: &Spot| {
        (s.engaged.section_mm2 - level).abs() <= SECTION * level + 1e-9
            && (s.speed_mm_s() - speed).abs() <= SPEED * speed
            && (s.direction - first.direction).norm() < 1e-3
    };
    let (mut best, mut from) = (0..0, 0);
    for k in 0..=spots.len() {
        if k == spots.len() || !steady(&spots[k]) {
            if k - from > best.len() {
                best = from..k;
            }
            from = k + 1;
        }
    }
    (!best.is_empty()).then_some(best)
}

/// Median by length.
fn weighted_median(spots: &[Spot], value: impl Fn(&Spot) -> f64) -> f64 {
    let mut pairs: Vec<(f64, f64)> = spots.iter().map(|s| (value(s), s.length_mm)).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * pairs.iter().map(|p| p.1).sum::<f64>();
    let mut sum = 0.0;
    pairs
        .iter()
        .find(|(_, length)| {
            sum += length;
            sum >= half
        })
        .map_or(0.0, |p| p.0)
}

fn mean(values: &[f64], members: &[usize]) -> f64 {
    let known: Vec<f64> = members.iter().map(|i| values[*i]).filter(|v| v.is_finite()).collect();
    known.iter().sum::<f64>() / known.len() as f64
}

/// The cut of some samples, at the speed that was logged and the feed that was measured, where the log shows them.
fn row_of(
    log: &Log,
    feed: Option<&MeasuredFeed>,
    members: &[usize],
    spot: &Spot,
    job: &Job,
    order: usize,
) -> Option<SteadyRow> {
    let tool = job.tool(spot.tool)?;
    let logged = |values: Option<&Vec<f64>>, planned: f64| {
        values.map(|v| mean(v, members)).filter(|v| v.is_finite() && *v > 0.0).unwrap_or(planned)
    };
    let rps = logged(log.rps.as_ref(), spot.rps);
    let feed_mm_s = spot.speed_mm_s() * logged(feed.map(|feed| &feed.ratio), 1.0);
    let e = &spot.engaged;
    let radial_depth_mm = if e.axial_mm > 1e-6 { e.section_mm2 / e.axial_mm } else { 0.0 };
    let side = match () {
        () if e.up_share > 0.3 => Side::Up,
        () if e.up_share < -0.3 => Side::Down,
        () if radial_depth_mm > 0.9 * tool.diameter_mm => Side::Slot,
        () => Side::Centre,
    };
    Some(SteadyRow {
        group: format!("{radial_depth_mm:.1}"),
        kind: String::new(),
        edge: spot.tool.to_string(),
        is_fresh: false,
        order: order as f64,
        cut: SteadyCut {
            diameter_mm: tool.diameter_mm,
            shape: tool.shape,
            axial_depth_mm: e.axial_mm,
            radial_depth_mm,
            path_radius_mm: None,
            feed_mm_s,
            flutes: tool.flutes,
            rps,
        },
        side,
        given: Some(Rates { removal_rate_mm3_s: e.section_mm2 * feed_mm_s, contact_rate_mm2_s: e.contact_mm2 * rps }),
        layer_height_mm: None,
        duration_s: log.time_s[members[members.len() - 1]] - log.time_s[members[0]],
    })
}

/// Means in the order of [`measured`]; forces rotated into x along the feed and y into the wall, on the workpiece.
fn means(log: &Log, members: &[usize], spot: &Spot, on_tool: bool) -> Vec<f64> {
    let of = |name: &str| log.measured.iter().find(|(n, _)| *n == name).map_or(f64::NAN, |(_, v)| mean(v, members));
    let sign = if on_tool { -1.0 } else { 1.0 };
    let (x, y, d) = (sign * of("force_x_n"), sign * of("force_y_n"), spot.direction);
    let along = x * d.x + y * d.y;
    let left = -x * d.y + y * d.x;
    let into_wall = if spot.engaged.up_share > 0.3 { left } else { -left };
    let resultant = of("force_xy_n");
    measured()
        .map(|name| match name {
            "force_x_n" if spot.engaged.section_mm2 > 0.0 => along,
            "force_y_n" if spot.engaged.section_mm2 > 0.0 => into_wall,
            "force_x_n" | "force_y_n" => f64::NAN,
            "force_xy_n" if resultant.is_nan() => along.hypot(into_wall),
            other => of(other),
        })
        .collect()
}
