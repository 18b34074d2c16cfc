//! Loads of one station as functions of feed, for every force model. In: a station with its engine. Out: [`LoadLine`], which gives the loads at
//! any feed and the cap for any limit.
//!
//! Engines: [`super::affine`] (linear edge model, exact; its edges from [`super::helix`] or [`super::sweep`]),
//! [`super::scan`] (any law of chip thickness, runout, deflection; sampled over a revolution) and [`super::summary`]
//! (models of the resultant alone). Load effects of the process model multiply cutting and edge forces and the tare;
//! where a factor depends on feed, or a meter showed more than the load, caps come from the first crossing of the sampled load instead of a formula.

use super::affine::Affine;
use super::affine::Spans;
use super::cap::{first_crossing, scaled};
use super::loads::{Cap, Forces, Loads};
use super::modifiers::{Factors, Modifiers};
use super::scan::{ANGLES_PER_TURN, Scan};
use super::summary::Summary;
use crate::effects::Excess;
use crate::machine::LimitKind;
use crate::units::{n_mm_s_from_watts, nm_from_nmm, watts_from_n_mm_s};
use std::f64::consts::TAU;

/// A feed per tooth above every real one, mm: a cap above it only means that forces cancel apart from rounding.
const BEYOND_MM: f64 = 1e4;

/// How the forces of a station are found.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Engine {
    Spans(Spans),
    Scan(Box<Scan>),
    Summary(Summary),
}

/// Data of a station beside its forces.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Station {
    pub rps: f64,
    /// Feed per tooth over feed, s.
    pub per_feed: f64,
    pub tare_w: f64,
    /// Tip deflection and bending stress per N.
    pub compliance: [f64; 2],
    /// What a meter showed beyond the load, which counts as load.
    pub excess: Excess,
}

impl Station {
    /// The excess where the spindle gives this power, W.
    fn excess_at(&self, power_w: f64) -> f64 {
        self.excess.of(if self.excess.full_power > 0.0 { power_w } else { power_w / (TAU * self.rps) })
    }
}

/// All loads of one station as functions of feed.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadLine {
    pub(super) engine: Engine,
    pub(super) station: Station,
    pub(super) modifiers: Modifiers,
    /// Volume removed per mm of path, mm², as the engaged arcs say.
    pub removal_area_mm2: f64,
    /// Area swept over material by all edges in one revolution, mm².
    pub contact_mm2_per_rev: f64,
}

impl LoadLine {
    /// Loads at a feed.
    pub fn loads(&self, feed_mm_s: f64) -> Loads {
        let f = feed_mm_s * self.station.per_feed;
        let factors = self.modifiers.at(f);
        let forces = self.engine.forces(f, &factors);
        let station = &self.station;
        let made_by_cut = self.torque_beside_forces(&factors);
        let loads = Loads {
            force_xy_peak_n: forces.xy_peak,
            force_xy_mean_n: forces.mean[0].hypot(forces.mean[1]),
            force_normal_mean_n: forces.mean[1].abs(),
            force_axial_peak_n: forces.axial_peak,
            torque_nm: nm_from_nmm(forces.torque + made_by_cut),
            torque_peak_nm: nm_from_nmm(forces.torque_peak + made_by_cut),
            power_w: factors.tare * station.tare_w
                + watts_from_n_mm_s(TAU * station.rps * (forces.torque + made_by_cut)),
            deflection_mm: station.compliance[0] * forces.xy_peak,
            surface_error_mm: station.compliance[0] * forces.wall,
            bending_stress_mpa: station.compliance[1] * forces.xy_peak,
            chip_thickness_max_mm: forces.chip,
            feed_per_tooth_mm: f,
            mean_force_n: forces.mean,
        };
        if station.excess.at_full == 0.0 { loads } else { loads.times(1.0 + station.excess_at(loads.power_w)) }
    }

    /// Torque of the power that the cut takes beside its forces ([`Factors::made_by_cut`]), N·mm.
    fn torque_beside_forces(&self, factors: &Factors) -> f64 {
        if factors.made_by_cut == 0.0 {
            return 0.0;
        }
        n_mm_s_from_watts(factors.made_by_cut * self.station.tare_w) / (TAU * self.station.rps)
    }

    /// The feed at which each tooth advances so far, mm/s.
    pub fn feed_mm_s(&self, per_tooth_mm: f64) -> f64 {
        per_tooth_mm / self.station.per_feed
    }

    /// The part of a load that is there at this feed without a cut.
    pub fn idle(&self, kind: LimitKind, feed_mm_s: f64) -> f64 {
        let tare = self.modifiers.at(feed_mm_s * self.station.per_feed).tare;
        if kind == LimitKind::Power { tare * self.station.tare_w } else { 0.0 }
    }

    /// Forces on the tool through a turn at a feed, N: along the feed, to its left and up the axis, at the K rotation angles
    /// (k + ½)·2π/K, tooth 1 being at φ = 0 at its tip where the angle is 0. Empty for models of the resultant and for the
    /// linear edge model without runout, whose engine does not sample.
    pub fn through_a_turn(&self, feed_mm_s: f64) -> Vec<[f64; 3]> {
        let Engine::Scan(scan) = &self.engine else { return Vec::new() };
        let f = feed_mm_s * self.station.per_feed;
        let samples = scan.force_by_angle(f, &self.modifiers.at(f), &[]);
        // Teeth that are all alike are sampled over one pitch.
        let pitches = (ANGLES_PER_TURN as f64 / samples.len() as f64).round().max(1.0) as usize;
        let turn = samples.iter().map(|s| [s.plane.re, s.plane.im, s.axial]);
        std::iter::repeat_n(turn, pitches).flatten().collect()
    }

    /// Largest feed below which a load stays within `limit`, in the unit of [`crate::machine::Limits`]; kinds that are no
    /// loads are free.
    pub fn cap(&self, kind: LimitKind, limit: f64) -> Cap {
        let per_tooth = match (&self.engine, self.modifiers.constant()) {
            (_, Some(_)) if kind == LimitKind::FeedPerTooth => Affine { base: 0.0, slope: 1.0 }.cap(limit),
            (Engine::Spans(spans), Some(factors)) if self.station.excess.at_full == 0.0 => {
                self.exact_cap(spans, &factors, kind, limit)
            }
            _ => self.sampled_cap(kind, limit),
        };
        match per_tooth {
            Cap::Feed { feed_mm_s, .. } if feed_mm_s > BEYOND_MM => Cap::Free,
            cap => scaled(cap, self.station.per_feed.recip(), self.station.per_feed.recip()),
        }
    }

    /// Feed per tooth from the closed forms.
    fn exact_cap(&self, spans: &Spans, factors: &Factors, kind: LimitKind, limit: f64) -> Cap {
        let [deflection, stress] = self.station.compliance;
        // A load that is `by` times a force meets its limit where the force meets limit / by.
        let of_force = |by: f64, cap: &dyn Fn(f64) -> Cap| scaled(cap(limit / by), 1.0, by.recip());
        let watts_per_nmm = watts_from_n_mm_s(TAU * self.station.rps);
        match kind {
            LimitKind::ForceXy => spans.cap_xy(limit, factors),
            LimitKind::ForceNormalMean => spans.cap_normal_mean(limit, factors),
            LimitKind::ForceAxial => spans.cap_axial(limit, factors),
            LimitKind::Torque => spans.cap_torque(limit - self.torque_beside_forces(factors), factors),
            LimitKind::Power => {
                let cutting_w = limit - factors.tare * self.station.tare_w;
                let torque_nmm = n_mm_s_from_watts(cutting_w) / (TAU * self.station.rps);
                let torque_nmm = torque_nmm - self.torque_beside_forces(factors);
                scaled(spans.cap_torque(torque_nmm, factors), 1.0, watts_per_nmm.recip())
            }
            LimitKind::Deflection => of_force(deflection, &|n| spans.cap_xy(n, factors)),
            LimitKind::BendingStress => of_force(stress, &|n| spans.cap_xy(n, factors)),
            LimitKind::SurfaceError => of_force(deflection, &|n| spans.cap_wall(n, factors)),
            LimitKind::ChipThickness => spans.cap_chip(limit, factors),
            // Loads without a closed form are sampled.
            _ => self.sampled_cap(kind, limit),
        }
    }

    /// Feed per tooth from samples over the range of feeds that tools can take.
    fn sampled_cap(&self, kind: LimitKind, limit: f64) -> Cap {
        let per_feed = self.station.per_feed;
        let load = |f: f64| self.loads(f / per_feed).bounded_by(kind).unwrap_or(0.0);
        first_crossing(&sampled_feeds(), limit, load)
    }
}

/// Feeds per tooth at which loads without a formula are sampled, mm: from 0.1 µm to 3 mm, each 1.25 times the one before.
fn sampled_feeds() -> Vec<f64> {
    let mut feeds = vec![1e-4];
    while feeds[feeds.len() - 1] < 3.0 {
        feeds.push(feeds[feeds.len() - 1] * 1.25);
    }
    feeds
}

impl Engine {
    fn forces(&self, f: f64, factors: &Factors) -> Forces {
        match self {
            Engine::Spans(spans) => spans.forces(f, factors),
            Engine::Scan(scan) => scan.forces(f, factors),
            Engine::Summary(summary) => summary.forces(f, factors),
        }
    }
}
