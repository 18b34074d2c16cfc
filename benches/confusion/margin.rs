//! How far the truth of a case is ahead of its best rival, with nothing but the noise in the way. In: case, noise. Out:
//! [`Margin`].
//!
//! An oracle that knows every formula explains the noiseless readings y. About the base model y₀ (true coefficients, no
//! effect) it fits d = y − y₀ by the derivatives with respect to the coefficients (tare, k_tc, k_te; k_rc, k_re beside them for forces)
//! and, for a rival, by its change of the readings at a usual size, over a grid of what is not linear in it. The truth
//! itself fits d exactly. With the residual r of the best rival, white noise σ whose neighbours correlate by ρ, and n
//! readings, the margin is Σ r² / (2σ²) · (1 − ρ)/(1 + ρ) nats. Readings are those at known places: the feed there is the
//! one that the control would have reached, as in a log without feed.

use super::cases::{Case, MEMORY};
use super::hidden::{Hidden, LISTED};
use super::physics::{Channel, Coefficients, Milling, Reading};
use super::rng::Rng;
use nalgebra::{DMatrix, DVector};

/// Spacing of the readings that are compared, s.
const SPACING_S: f64 = 0.5;

/// The stated threshold: below it, `confounded` with the truth among the names is right.
pub const THRESHOLD_NATS: f64 = 50.0;

/// Lead of the truth.
#[derive(Debug, Clone)]
pub struct Margin {
    /// Best rival.
    pub rival: String,
    /// Log-likelihood by which the truth is ahead.
    pub nats: f64,
    /// The same ahead of no effect at all.
    pub over_none_nats: f64,
}

/// Margin of a case at a noise, which is a share of the mean cutting load.
pub fn margin(case: &Case, noise: f64) -> Margin {
    let oracle = Oracle::new(case);
    let cutting: Vec<f64> = oracle.cutting.iter().copied().filter(|c| *c > 0.0).collect();
    let sigma = noise * cutting.iter().sum::<f64>() / cutting.len().max(1) as f64;
    let per_square = oracle.rate_share() * (1.0 - MEMORY) / (1.0 + MEMORY) / (2.0 * sigma * sigma);
    let none = oracle.residual_squares(&[]);
    let mut best = Margin { rival: "none".to_owned(), nats: none * per_square, over_none_nats: none * per_square };
    for rival in LISTED.iter().filter(|name| !case.names.contains(*name)) {
        if (*rival == "runout") != (case.channel == Channel::PowerAndForceXy) && *rival == "runout" {
            continue;
        }
        // Beside one half of a pair the rival has the other half's help.
        for kept in kept_beside(case) {
            for columns in oracle.columns_of(rival) {
                let with: Vec<Vec<f64>> =
                    kept.iter().flat_map(|name| oracle.true_column(name)).chain(columns).collect();
                let nats = oracle.residual_squares(&with) * per_square;
                if nats < best.nats {
                    best = Margin { rival: (*rival).to_owned(), nats, ..best };
                }
            }
        }
    }
    best
}

/// What is known of the truth beside the rival: nothing for a single effect, either half of a pair.
fn kept_beside(case: &Case) -> Vec<Vec<&'static str>> {
    if case.names.len() < 2 { vec![vec![]] } else { case.names.iter().map(|name| vec![*name]).collect() }
}

/// Readings of the truth and of the base model, and the derivatives of the base.
struct Oracle<'a> {
    case: &'a Case,
    true_milling: Milling<'a>,
    times: Vec<f64>,
    base: Vec<f64>,
    difference: Vec<f64>,
    derivatives: Vec<Vec<f64>>,
    cutting: Vec<f64>,
    /// W per N at which the noise of both is the same; 0 without forces.
    force_to_power: f64,
}

impl<'a> Oracle<'a> {
    fn new(case: &'a Case) -> Self {
        let true_milling = Milling::new(&case.part, &case.truth, &case.hidden, case.channel);
        let times: Vec<f64> = (1..(true_milling.end_s() / SPACING_S) as usize).map(|k| k as f64 * SPACING_S).collect();
        // Nobody judges by readings while the spindle runs up.
        let steady = |r: &Reading| r.moment.rps > 0.0 && r.moment.runup.is_none();
        let all = true_milling.read(&times);
        let times: Vec<f64> = times.iter().zip(&all).filter(|(_, r)| steady(r)).map(|(t, _)| *t).collect();
        let readings: Vec<Reading> = all.into_iter().filter(steady).collect();
        let mut oracle = Self {
            case,
            true_milling,
            times,
            base: Vec::new(),
            difference: Vec::new(),
            derivatives: Vec::new(),
            cutting: readings.iter().map(|r| r.cutting).collect(),
            force_to_power: 0.0,
        };
        oracle.force_to_power = oracle.ratio(&readings);
        oracle.base = oracle.values(&case.truth, &[]);
        oracle.difference = oracle.all(&readings).iter().zip(&oracle.base).map(|(r, b)| r - b).collect();
        oracle.derivatives = oracle.coefficients().iter().map(|k| oracle.change(k, &[])).collect();
        oracle
    }

    /// Readings per reading compared.
    fn rate_share(&self) -> f64 {
        self.case.rate_hz * SPACING_S
    }

    /// Coefficients changed one by one.
    fn coefficients(&self) -> Vec<Coefficients> {
        let k = self.case.truth;
        let mut changed = vec![
            Coefficients { k_tc: 1.02 * k.k_tc, ..k },
            Coefficients { k_te: 1.02 * k.k_te, ..k },
            Coefficients { tare: 1.02 * k.tare, ..k },
        ];
        if self.case.channel == Channel::PowerAndForceXy {
            changed.extend([Coefficients { k_rc: 1.02 * k.k_rc, ..k }, Coefficients { k_re: 1.02 * k.k_re, ..k }]);
        }
        changed
    }

    fn values(&self, truth: &Coefficients, hidden: &[Hidden]) -> Vec<f64> {
        let milling = Milling::new(&self.case.part, truth, hidden, self.case.channel).at_places_of(&self.true_milling);
        self.all(&milling.read(&self.times))
    }

    /// Powers, then forces (if there are any) on the same scale.
    fn all(&self, readings: &[Reading]) -> Vec<f64> {
        let forces = readings.iter().filter(|_| self.force_to_power > 0.0).map(|r| r.force * self.force_to_power);
        readings.iter().map(|r| r.value).chain(forces).collect()
    }

    /// Mean cutting power over mean force.
    fn ratio(&self, readings: &[Reading]) -> f64 {
        if self.case.channel == Channel::Power {
            return 0.0;
        }
        let mean = |of: &dyn Fn(&Reading) -> f64| {
            let all: Vec<f64> = readings.iter().map(of).filter(|v| *v > 0.0).collect();
            all.iter().sum::<f64>() / all.len().max(1) as f64
        };
        mean(&|r| r.cutting) / mean(&|r| r.force)
    }

    fn change(&self, truth: &Coefficients, hidden: &[Hidden]) -> Vec<f64> {
        self.values(truth, hidden).iter().zip(&self.base).map(|(v, b)| v - b).collect()
    }

    fn true_column(&self, name: &str) -> Vec<Vec<f64>> {
        let of = |(k, known): (usize, &&str)| {
            (*known == name).then(|| self.change(&self.case.truth, &[self.case.hidden[k]]))
        };
        self.case.names.iter().enumerate().filter_map(of).collect()
    }

    /// Sets of columns of a rival.
    fn columns_of(&self, name: &str) -> Vec<Vec<Vec<f64>>> {
        let column = |hidden: Hidden| self.change(&self.case.truth, &[hidden]);
        grid(name, self.case).into_iter().map(|set| set.into_iter().map(column).collect()).collect()
    }

    /// Σ r² of the best fit of the difference by the derivatives and these columns.
    fn residual_squares(&self, columns: &[Vec<f64>]) -> f64 {
        let all: Vec<&Vec<f64>> = self.derivatives.iter().chain(columns).collect();
        let n = self.difference.len();
        let scale = |c: &Vec<f64>| c.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-12);
        let matrix = DMatrix::from_fn(n, all.len(), |i, k| all[k][i] / scale(all[k]));
        let difference = DVector::from_column_slice(&self.difference);
        let solved = matrix.clone().svd(true, true).solve(&difference, 1e-9).expect("both sides of the SVD are there");
        (difference - matrix * solved).norm_squared()
    }
}

/// Members of an effect's family at a usual size: each set is used together.
fn grid(name: &str, case: &Case) -> Vec<Vec<Hidden>> {
    let [length, width, _] = case.part.stock_mm;
    match name {
        "tare-warm-up" => [80.0, 160.0, 400.0].map(|tau_s| vec![Hidden::TareWarmUp { excess: 0.3, tau_s }]).to_vec(),
        "tare-speed" => [1.2, 2.0].map(|power| vec![Hidden::TareSpeed { share: 0.3, power }]).to_vec(),
        "stock-proud" => vec![vec![
            Hidden::StockProud { top_mm: 0.3, side_mm: 0.0 },
            Hidden::StockProud { top_mm: 0.0, side_mm: 0.3 },
        ]],
        "edge-chipping" => {
            (1..8).map(|k| vec![Hidden::EdgeChipping { jump: 0.1, at_share: f64::from(k) / 8.0 }]).collect()
        }
        "hard-zone" => (0..9)
            .map(|k| {
                let centre = [length * (0.25 + 0.25 * f64::from(k % 3)), width * (0.25 + 0.25 * f64::from(k / 3))];
                vec![Hidden::HardZone { excess: 0.1, centre, half: [0.2 * length, 0.2 * width] }]
            })
            .collect(),
        "sensor-lag" => [0.2, 0.8].map(|time_s| vec![Hidden::SensorLag { time_s }]).to_vec(),
        "entry" => [8.0, 16.0].map(|length_mm| vec![Hidden::Entry { excess: 0.3, length_mm }]).to_vec(),
        "axis-power" => vec![vec![
            Hidden::AxisPower { friction: 0.3, acceleration: 0.0 },
            Hidden::AxisPower { friction: 0.0, acceleration: 0.3 },
        ]],
        "corner-feed" => [0.05, 0.2].map(|acceleration| vec![Hidden::CornerFeed { acceleration }]).to_vec(),
        _ => vec![vec![Hidden::draw(name, 0.5, &case.part, &mut Rng::new(case.seed, 4))]],
    }
}
