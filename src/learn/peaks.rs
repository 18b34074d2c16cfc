//! Forces of a station as a diagnosis needs them. In: stations, job. Out: [`Engaged`] with the derivatives of the peak (or
//! mean) force in the plane by each coefficient, and how runout changes what cutting and edge coefficients add to it.
//!
//! A force is homogeneous of the first degree in its coefficients, F = F_c + F_e; F_e = ∂F/∂ln of both edge coefficients is
//! found by raising them by [`SHARPER`], without runout and with it.

use super::fine::FineRings;
use super::forces::Sample;
use crate::engage::{EngagementMap, Station};
use crate::force::contact::{Engaged, RUNOUT_GRID, Runouts, engaged as geometry};
use crate::force::{Cut, Cutter, Loads};
use crate::machine::material::{ForceModel, LinearEdge, Material, Process};
use crate::machine::{Job, Runout, Slice, Tool};
use crate::nc::Move;
use std::collections::HashMap;

/// By how much edge coefficients are raised, relative.
const SHARPER: f64 = 0.05;
/// Offsets of the axis at which the change of the loads is taken, mm.
pub const RUNOUTS_MM: [f64; RUNOUT_GRID[0]] = [0.006, 0.018];
/// Ways that it points, in pitches of the teeth; the last is the first again.
pub const RUNOUT_PHASES: [f64; RUNOUT_GRID[1] + 1] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// Cutters with one coefficient at a time a little larger, round and with runout.
pub(super) struct Forces<'a> {
    pub(super) map: &'a EngagementMap,
    job: &'a Job,
    /// The force that is asked for: a peak, or the magnitude of the mean vector.
    wanted: Option<Sample>,
    /// Is the change by runout asked for?
    runout: bool,
    /// (tool, speed) and the cutters.
    known: Vec<((u32, u64), Option<Probe>)>,
    /// Forces of the cuts met so far: passes repeat each other, and a long one is many spots.
    met: HashMap<Vec<u32>, ([f64; 4], Runouts)>,
}

pub(super) struct Probe {
    fine: FineRings,
    /// As declared, on the finer rings.
    nominal: Cutter,
    /// k_tc, k_rc, k_te, k_re larger, with by how much.
    larger: [(Cutter, f64); 4],
    /// On the rings of the engagement: as declared, and with both edge coefficients larger.
    round: [Cutter; 2],
    /// The same under each of [`RUNOUTS_MM`], pointing each of the ways of [`RUNOUT_PHASES`].
    out: Vec<[Cutter; 2]>,
}

/// What cutting and edges add to a force, and what the edges and all together take of the power.
struct Parts {
    cutting: f64,
    edge: f64,
    edge_w: f64,
    power_w: f64,
}

impl<'a> Forces<'a> {
    pub(super) fn new(map: &'a EngagementMap, job: &'a Job, wanted: Option<Sample>, runout: bool) -> Self {
        Self { map, job, wanted, runout, known: Vec::new(), met: HashMap::new() }
    }

    pub(super) fn engaged(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> Engaged {
        let Some(tool) = self.job.tool(motion.tool) else { return Engaged::default() };
        let mut engaged = geometry(station, self.map, self.map.slices_of(motion.tool), tool.flutes, tangent_z);
        if self.wanted.is_some() && station.arc_count > 0 && motion.spin.rps > 0.0 {
            (engaged.peak, engaged.runout) = self.met(motion, station, tangent_z, speed_mm_s);
        }
        engaged
    }

    /// Forces of a cut, worked out where none like it was met: the same tool, speeds and arcs to seven digits.
    fn met(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> ([f64; 4], Runouts) {
        let numbers = [motion.spin.rps, tangent_z, speed_mm_s].map(|x| (x as f32).to_bits());
        let arcs = self.map.arcs_of(station).iter();
        let arcs = arcs.flat_map(|arc| [u32::from(arc.slice), arc.entry_rad.to_bits(), arc.exit_rad.to_bits()]);
        let key: Vec<u32> = std::iter::once(motion.tool).chain(numbers).chain(arcs).collect();
        if let Some(found) = self.met.get(&key) {
            return *found;
        }
        let found = self.peak(motion, station, tangent_z, speed_mm_s);
        self.met.insert(key, found);
        found
    }

    fn peak(&mut self, motion: &Move, station: &Station, tangent_z: f64, speed_mm_s: f64) -> ([f64; 4], Runouts) {
        let key = (motion.tool, motion.spin.rps.to_bits());
        if !self.known.iter().any(|(k, _)| *k == key) {
            let probe = self.probe(motion);
            self.known.push((key, probe));
        }
        let probe = self.known.iter().find(|(k, _)| *k == key).and_then(|(_, probe)| probe.as_ref());
        let Some(probe) = probe else { return Default::default() };
        let arcs = self.map.arcs_of(station);
        let mean = self.wanted == Some(Sample::Mean);
        let force = |loads: &Loads| if mean { loads.force_xy_mean_n } else { loads.force_xy_peak_n };
        let fine = probe.fine.arcs(arcs);
        let on_fine = |c: &Cutter| force(&c.loads(&Cut { arcs: &fine, tangent_z, ..Cut::default() }, speed_mm_s));
        let peak = on_fine(&probe.nominal);
        let slopes = std::array::from_fn(|k| (on_fine(&probe.larger[k].0) - peak) / probe.larger[k].1);
        if !self.runout || peak <= 0.0 {
            return (slopes, Runouts::default());
        }
        let parts = |cutters: &[Cutter; 2]| {
            let [plain, sharper] =
                cutters.each_ref().map(|c| c.loads(&Cut { arcs, tangent_z, ..Cut::default() }, speed_mm_s));
            let edge = (force(&sharper) - force(&plain)) / SHARPER;
            let edge_w = (sharper.power_w - plain.power_w) / SHARPER;
            Parts { cutting: force(&plain) - edge, edge, edge_w, power_w: plain.power_w }
        };
        let round = parts(&probe.round);
        let over = |out: f64, round: f64| if round > 1e-9 { out / round - 1.0 } else { 0.0 };
        let change = |cutters: &[Cutter; 2]| {
            let out = parts(cutters);
            // The chips of all teeth together stay; what the power loses, the edges lose.
            let lost = over(round.edge_w + out.power_w - round.power_w, round.edge_w).clamp(-1.0, 0.0);
            [over(out.cutting, round.cutting), over(out.edge, round.edge), lost]
        };
        (slopes, std::array::from_fn(|k| std::array::from_fn(|p| change(&probe.out[RUNOUT_GRID[1] * k + p]))))
    }

    fn probe(&self, motion: &Move) -> Option<Probe> {
        let tool = self.job.tool(motion.tool)?;
        let ForceModel::LinearEdge(k) = self.job.material(tool)?.model else { return None };
        let coarse = self.map.slices_of(motion.tool);
        let fine = FineRings::new(coarse, tool);
        let cutter_of = |slices: &[Slice], k: LinearEdge, runout: Option<Runout>| {
            let material = Material { name: String::new(), model: ForceModel::LinearEdge(k), uncertainty: None };
            let tool = Tool { runout, ..tool.clone() };
            let spindle = &self.job.machine.spindle;
            Cutter::new(&tool, &material, spindle, &Process::default(), slices, motion.spin.rps).ok()
        };
        let cutter = |k: LinearEdge| cutter_of(&fine.slices, k, tool.runout);
        let step = |value: f64| 1e-3 * value.abs().max(1.0);
        let (tc, rc, te, re) = (step(k.k_tc), step(k.k_rc), step(k.k_te), step(k.k_re));
        let sharper = LinearEdge { k_te: (1.0 + SHARPER) * k.k_te, k_re: (1.0 + SHARPER) * k.k_re, ..k };
        let both = |runout| Some([cutter_of(coarse, k, runout)?, cutter_of(coarse, sharper, runout)?]);
        let pitch = std::f64::consts::TAU / f64::from(tool.flutes.max(1));
        let ways = |offset_mm: f64| RUNOUT_PHASES[..RUNOUT_GRID[1]].iter().map(move |p| (offset_mm, p * pitch));
        let out = |(offset_mm, angle_rad): (f64, f64)| both(Some(Runout { offset_mm, angle_rad }));
        Some(Probe {
            nominal: cutter(k)?,
            larger: [
                (cutter(LinearEdge { k_tc: k.k_tc + tc, ..k })?, tc),
                (cutter(LinearEdge { k_rc: k.k_rc + rc, ..k })?, rc),
                (cutter(LinearEdge { k_te: k.k_te + te, ..k })?, te),
                (cutter(LinearEdge { k_re: k.k_re + re, ..k })?, re),
            ],
            round: both(tool.runout)?,
            out: RUNOUTS_MM.into_iter().flat_map(ways).map(out).collect::<Option<_>>()?,
            fine,
        })
    }
}
