//! Covariates of the samples of a log. In: samples placed in the program. Out: [`State`].

use crate::effects::State;
use crate::learn::align::Method;
use crate::learn::dataset::placed_log::{PlacedLog, slid};
use crate::learn::program::motion::motion;
use std::f64::consts::PI;

impl PlacedLog<'_> {
    /// Mean speed v along the path, mm/s, and mean of v·max(0, a) over v, mm/s²: over the times at which the sample may
    /// have been taken. Without acceleration: the largest deceleration, negative.
    pub(in crate::learn) fn motion(&self, i: usize) -> [f64; 2] {
        let by_way = self.aligned.method == Method::Position;
        let program_s = self.aligned.program_s[i];
        let about_s = if by_way { 0.0 } else { self.aligned.sample_uncertainty_s[i] };
        let (mut v, mut v_a, mut least) = (0.0, 0.0, 0.0);
        for k in -2..=2 {
            let at_s = program_s + 0.75 * f64::from(k) * about_s;
            let Some(index) = self.known.timeline.at(at_s) else { continue };
            let (speed, acceleration) = motion(self.known.timeline, index, at_s, by_way, &self.known.job.machine);
            v += speed;
            v_a += speed * acceleration.max(0.0);
            least = f64::min(least, acceleration);
        }
        [v / 5.0, if v_a > 0.0 { v_a / v } else { least }]
    }

    /// The same over several samples.
    fn mean_motion(&self, members: &[usize]) -> [f64; 2] {
        let each: Vec<[f64; 2]> = members.iter().map(|i| self.motion(*i)).collect();
        let (v, v_a) = each.iter().fold((0.0, 0.0), |(v, v_a), m| (v + m[0], v_a + m[0] * m[1].max(0.0)));
        let least = each.iter().map(|m| m[1]).fold(0.0, f64::min);
        [v / members.len() as f64, if v_a > 0.0 { v_a / v } else { least }]
    }

    /// Time of the log at which a tool first cut, s.
    fn first_cut_s(&self, tool: u32) -> f64 {
        let found = self.first_cuts_s.iter().find(|(number, _)| *number == tool);
        found.map_or(f64::NEG_INFINITY, |(_, time_s)| *time_s)
    }

    /// Does the tool remove anything on this spot?
    fn cuts(&self, spot: usize) -> bool {
        self.known.timeline.spots[spot].engaged.section_mm2 > 1e-6
    }

    /// State of a cell at the mean program time of its samples. If the tool is in air at that time but one of the samples is in a cut, the cut
    /// is described: `loaded` is the spot that carries most of the cell's load, and its end nearest to that time counts.
    pub(in crate::learn) fn state(&self, members: &[usize], loaded: Option<usize>) -> State {
        let mean = |of: &[f64]| members.iter().map(|i| of[*i]).sum::<f64>() / members.len() as f64;
        let program_s = mean(&self.aligned.program_s);
        let in_middle = self.known.timeline.at(program_s).unwrap_or(0);
        let index = if self.cuts(in_middle) { in_middle } else { loaded.unwrap_or(in_middle) };
        let (spot, history) = (&self.known.timeline.spots[index], &self.history[index]);
        let e = &spot.engaged;
        let rps = self.rps(members[members.len() / 2], spot);
        let tool = self.known.job.tool(spot.tool);
        let share = ((program_s - spot.start_s) / (spot.end_s - spot.start_s).max(1e-9)).clamp(0.0, 1.0);
        let mut state = State {
            time_s: mean(&self.log.time_s),
            in_use_since_s: self.first_cut_s(spot.tool),
            slid: history.slid.and(&slid(spot, share, rps, self.known.job)),
            volume_mm3: history.volume_mm3 + share * e.section_mm2 * spot.length_mm,
            rps,
            reference_rps: self.reference_rps,
            tool: f64::from(spot.tool),
            coolant: f64::from(u8::from(spot.coolant)),
            ..State::default()
        };
        [state.path_speed_mm_s, state.path_acceleration_mm_s2] = self.mean_motion(members);
        state.tare_share = self.tare_shape(rps);
        state.position = spot.from + (spot.to - spot.from) * share;
        let Some(tool) = tool.filter(|_| self.cuts(index) && rps > 0.0) else { return state };
        let left = crate::path::Vec3::new(-spot.direction.y, spot.direction.x, 0.0);
        let feed_ratio = members.iter().map(|i| self.feed_ratio(*i)).sum::<f64>() / members.len() as f64;
        let speed = feed_ratio * spot.speed_mm_s();
        state.feed_per_tooth_mm = speed / (f64::from(tool.flutes) * rps);
        state.chip_thickness_mm = e.section_mm2 * speed / (e.contact_mm2 * rps).max(1e-12);
        state.cutting_speed_mm_s = PI * tool.diameter_mm * rps;
        state.axial_depth_mm = e.axial_mm;
        state.radial_depth_mm = e.section_mm2 / e.axial_mm.max(1e-6);
        state.immersion_rad = e.immersion_rad;
        state.up_share = e.up_share;
        state.up_share_chip = e.up_share_chip;
        state.mean_cosine = e.mean_cosine;
        let at =
            |along: f64, aside: f64| spot.from + (spot.to - spot.from) * share + spot.direction * along + left * aside;
        state.sectors = e.sectors_at(state.feed_per_tooth_mm, at);
        state.position = at(e.contact_mm[0], e.contact_mm[1]);
        state.direction = spot.direction;
        state.curvature_per_mm = spot.curvature_per_mm;
        state.along_edge = e.along_edge;
        state.since_entry_mm = history.since_entry_mm + share * spot.length_mm;
        state
    }
}
