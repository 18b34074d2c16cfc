//! The CSV table. In: a run. Out: one row per station with the documented columns.

use std::io::{self, Write};

use super::figures::node_at;
use super::number::unsigned_zero;
use crate::force::Loads;
use crate::ids::MoveId;
use crate::machine::Slice;
use crate::outcome::ProgramRun;
use crate::outcome::over_limits::{FixedFeed, load_limits};
use crate::outcome::station_loads::{Feeds, StationLoads, each_station};
use crate::schedule::rules::{Rules, rules};
use crate::units::{deg_from_rad, mm_min_from_mm_s, rpm_from_rps};

/// Names of the loads with their units, and how to read them.
type Column = (&'static str, fn(&Loads) -> f64);

/// Loads in the order of the interface.
pub const LOADS: [Column; 12] = [
    ("force_xy_peak_n", |l| l.force_xy_peak_n),
    ("force_xy_mean_n", |l| l.force_xy_mean_n),
    ("force_normal_mean_n", |l| l.force_normal_mean_n),
    ("force_axial_peak_n", |l| l.force_axial_peak_n),
    ("torque_nm", |l| l.torque_nm),
    ("torque_peak_nm", |l| l.torque_peak_nm),
    ("power_w", |l| l.power_w),
    ("deflection_mm", |l| l.deflection_mm),
    ("surface_error_mm", |l| l.surface_error_mm),
    ("bending_stress_mpa", |l| l.bending_stress_mpa),
    ("chip_thickness_max_mm", |l| l.chip_thickness_max_mm),
    ("feed_per_tooth_mm", |l| l.feed_per_tooth_mm),
];

/// Writes the table.
pub fn csv(run: &ProgramRun, out: &mut dyn Write) -> io::Result<()> {
    write!(
        out,
        "{},feed_after_mm_min,spindle_rpm,tool,removal_area_mm2,contact_area_mm2_per_rev,entry_deg,exit_deg,axial_depth_mm",
        super::marks::CSV_HEAD
    )?;
    for side in ["before", "after"] {
        for (name, _) in LOADS {
            write!(out, ",{name}_{side}")?;
        }
    }
    writeln!(out, ",load_ratio_before,load_ratio_after,apart")?;
    let rules = rules(&run.toolpath, &run.map, &run.job);
    let apart = run.fixed_feeds();
    let moves = run.toolpath.moves.len();
    let feeds = [Feeds::new(&run.before, moves), Feeds::new(run.after(), moves)];
    let mut clock = Clock::new(run);
    let mut result = Ok(());
    each_station(run, &mut |found| {
        let times = clock.at(found, &feeds);
        if result.is_ok() {
            let why = node_at(run, found.station).and_then(|node| apart[node]);
            let ratios = ratios(run, &rules, found).map(|ratio| format!("{ratio:.5}"));
            result = row(run, found, times, out)
                .and_then(|()| writeln!(out, ",{},{}", ratios.join(","), why.map_or("", FixedFeed::name)));
        }
    });
    result
}

fn row(run: &ProgramRun, found: &StationLoads, [before_s, after_s]: [f64; 2], out: &mut dyn Write) -> io::Result<()> {
    let station = found.station;
    let motion = &run.toolpath.moves[station.move_id.ix()];
    let at = motion.curve().point(station.from_mm) - run.toolpath.shift_at(station.move_id);
    let (entry, exit) = angles(run, found);
    write!(
        out,
        "{},{},{:.4},{before_s:.4},{after_s:.4},{:.4},{:.4},{:.4},{:.3},{:.3},{:.1},{},{:.5},{:.4},{entry},{exit},{:.4}",
        motion.line,
        station.move_id.0,
        station.from_mm,
        unsigned_zero(at.x, 4),
        unsigned_zero(at.y, 4),
        unsigned_zero(at.z, 4),
        mm_min_from_mm_s(found.feed_before_mm_s),
        mm_min_from_mm_s(found.feed_after_mm_s),
        rpm_from_rps(motion.spin.rps),
        motion.tool,
        unsigned_zero(station.removal_area_mm2.into(), 5),
        unsigned_zero(contact_area(run, found), 4),
        unsigned_zero(station.axial_depth_mm.into(), 4),
    )?;
    for loads in [&found.before, &found.after] {
        for (_, read) in LOADS {
            write!(out, ",{:.5}", unsigned_zero(read(loads), 5))?;
        }
    }
    Ok(())
}

/// Largest load over its limit, before and after; 0 where nothing is cut or limited.
fn ratios(run: &ProgramRun, rules: &Rules, found: &StationLoads) -> [f64; 2] {
    let rps = run.toolpath.moves[found.station.move_id.ix()].spin.rps;
    [&found.before, &found.after].map(|loads| {
        let limits = load_limits(&rules.of(found.station.move_id).loads, &run.job, rps);
        limits.map(|limit| loads.bounded_by(limit.kind).unwrap_or(0.0) / limit.limit).fold(0.0, f64::max)
    })
}

/// Entry and exit angles of the lowest engaged slice, several arcs joined by `;`.
fn angles(run: &ProgramRun, found: &StationLoads) -> (String, String) {
    let arcs = run.map.arcs_of(found.station);
    let lowest = arcs.first().map(|arc| arc.slice);
    let own: Vec<_> = arcs.iter().filter(|arc| Some(arc.slice) == lowest).collect();
    let join = |angle: fn(&crate::engage::EngagedArc) -> f32| {
        let texts: Vec<String> =
            own.iter().map(|arc| format!("{:.2}", unsigned_zero(deg_from_rad(f64::from(angle(arc))), 2))).collect();
        texts.join(";")
    };
    (join(|arc| arc.entry_rad), join(|arc| arc.exit_rad))
}

/// Area that the edges of all teeth sweep over material in one revolution, mm².
fn contact_area(run: &ProgramRun, found: &StationLoads) -> f64 {
    let tool = run.toolpath.moves[found.station.move_id.ix()].tool;
    let slices: &[Slice] = run.map.slices_of(tool);
    let teeth = run.job.tool(tool).map_or(0, |tool| tool.flutes);
    let swept = run.map.arcs_of(found.station).iter().filter_map(|arc| {
        let slice = slices.get(arc.slice as usize)?;
        Some(slice.radius_mm * f64::from(arc.exit_rad - arc.entry_rad) * slice.edge_mm)
    });
    f64::from(teeth) * swept.sum::<f64>()
}

/// Time at the beginning of each station: the realised time of each move, shared in its inside by length over feed.
pub(super) struct Clock<'a> {
    run: &'a ProgramRun,
    /// Start of each move, s, before and after.
    starts: [Vec<f64>; 2],
    current: Option<u32>,
    /// Time at commanded feed since the start of the move, and of the whole move.
    inside: [f64; 2],
    whole: [f64; 2],
}

impl<'a> Clock<'a> {
    pub(super) fn new(run: &'a ProgramRun) -> Self {
        let starts = [&run.realised_before, run.realised_after()].map(|realised| {
            let mut now = 0.0;
            let start = |s: &f64| {
                now += s;
                now - s
            };
            realised.move_s.iter().map(start).collect()
        });
        Self { run, starts, current: None, inside: [0.0; 2], whole: [1.0; 2] }
    }
    /// Before and after, at the beginning of a move.
    pub(super) fn start_of(&self, id: MoveId) -> [f64; 2] {
        [0, 1].map(|side| self.starts[side].get(id.ix()).copied().unwrap_or(0.0))
    }
    /// Before and after, at the end of the last move.
    pub(super) fn end(&self) -> [f64; 2] {
        [&self.run.realised_before, self.run.realised_after()].map(|realised| realised.move_s.iter().sum())
    }
    /// Before and after, at the beginning of a station; stations come in order.
    pub(super) fn at(&mut self, found: &StationLoads, feeds: &[Feeds; 2]) -> [f64; 2] {
        let id = found.station.move_id;
        if self.current != Some(id.0) {
            self.current = Some(id.0);
            self.inside = [0.0; 2];
            let all = self.run.map.stations_of(id);
            self.whole = [0, 1].map(|side| all.iter().map(|station| feeds[side].time_s(station)).sum::<f64>());
        }
        let realised = [&self.run.realised_before, self.run.realised_after()];
        let now = [0, 1].map(|side| {
            let share = if self.whole[side] > 0.0 { self.inside[side] / self.whole[side] } else { 0.0 };
            let (start, length) = (self.starts[side].get(id.ix()), realised[side].move_s.get(id.ix()));
            start.copied().unwrap_or(0.0) + share * length.copied().unwrap_or(0.0)
        });
        for side in [0, 1] {
            self.inside[side] += feeds[side].time_s(found.station);
        }
        now
    }
}
