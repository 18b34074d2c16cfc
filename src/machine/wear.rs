//! How a tool wears over the metres that it cuts. In: a law, and the feeds of what is cut. Out: the rise of its wear index.
//!
//! The index is the part of the cutting force that does not come from the chip: β₀ of the response model (N), k_te of the
//! linear edge model (N/mm); wear adds to it and to nothing else (Ibaraki, Shimizu, Matsubara, section 2). What has worn the tool is a
//! length W, which grows per length ds of cut by
//!
//! ```text
//! dW = c (f/f₀)^p ds          f feed per tooth, f₀ that at which the rate was seen
//! ```
//! with c = 1 where the law counts the path of the tool, and c = w/(N f₀) where it counts the sliding distance of its teeth: in a revolution a
//! tooth slides w mm through material while the tool with its N teeth advances N f mm. p = −1: the edge wears with the time in the cut, and for
//! the sliding distance W is what each tooth has slid, w/(N f) per length. p = 0: the feed does not matter. p > 0: thick chips wear the edge.
//!
//! The index rises by k W; or, where the stages of the tool's life are known, by r (1 − e^(−W/λ)) + k W + a W³: running in, steady growth, the
//! end of the edge. The tool is worn out where the index reaches its end. A share of its life is a share of W up to there.
//!
//! This one law serves what `learn` finds of wear ([`crate::effects`]), the loads along a program ([`crate::schedule::history`]), the
//! budget of a program ([`crate::schedule::budget`]) and the plan over many ([`crate::toollife`]).

use super::material::ForceModel;
use crate::numeric::bisect;

/// Exponents p for which lengths W are stored, so that p can be estimated from readings later.
pub const POWERS: [f64; 4] = [-1.0, 0.0, 1.0, 2.0];
/// f₀ of sliding distances that are stored for all [`POWERS`], mm.
pub const COUNTED_AT_MM: f64 = 0.1;

/// What a law counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Counted {
    /// The path of the tool in a cut.
    #[default]
    Path,
    /// The way that each of its teeth slides through material.
    TeethWay,
}

impl Counted {
    /// Name in reports and states.
    pub fn name(self) -> &'static str {
        if self == Counted::Path { "path" } else { "teeth-way" }
    }
}

/// How fast a tool wears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WearRate {
    /// k: rise of the index per mm at the feed per tooth f₀.
    pub per_mm: f64,
    /// Of what.
    pub counted: Counted,
    /// f₀, mm.
    pub feed_per_tooth_mm: f64,
    /// p, from −1 to 2.
    pub exponent: f64,
    /// r: rise of the index while the edge runs in.
    pub run_in: f64,
    /// λ, mm.
    pub run_in_mm: f64,
    /// a: rise towards the end of the edge, per mm³.
    pub end_per_mm3: f64,
}

impl WearRate {
    /// So much per mm of path, from the first to the last.
    pub fn along_path(per_mm: f64, feed_per_tooth_mm: f64, exponent: f64) -> Self {
        let counted = Counted::Path;
        Self { per_mm, counted, feed_per_tooth_mm, exponent, run_in: 0.0, run_in_mm: 1.0, end_per_mm3: 0.0 }
    }
    /// The same for an index that is so many times as large.
    pub fn times(self, factor: f64) -> Self {
        let Self { per_mm, run_in, end_per_mm3, .. } = self;
        Self { per_mm: factor * per_mm, run_in: factor * run_in, end_per_mm3: factor * end_per_mm3, ..self }
    }
    /// dW/ds: how much a mm of cut counts, in which a tooth slides `way_mm` a revolution.
    pub fn counts(&self, way_mm: f64, flutes: f64, feed_per_tooth_mm: f64) -> f64 {
        let at_reference = match self.counted {
            Counted::Path => 1.0,
            Counted::TeethWay => way_mm / (flutes * self.feed_per_tooth_mm),
        };
        at_reference * (feed_per_tooth_mm / self.feed_per_tooth_mm).powf(self.exponent)
    }
    /// Rise of the index behind so much, W in mm.
    pub fn rise(&self, mm: f64) -> f64 {
        let mm = mm.max(0.0);
        self.per_mm * mm + self.run_in * (1.0 - (-mm / self.run_in_mm).exp()) + self.end_per_mm3 * mm.powi(3)
    }
    /// W behind which the index has risen by so much, mm; infinite where it never does.
    pub fn behind(&self, rise: f64) -> f64 {
        if rise <= 0.0 {
            return 0.0;
        }
        if self.run_in == 0.0 && self.end_per_mm3 == 0.0 {
            return rise / self.per_mm;
        }
        let mut most = 1.0;
        while self.rise(most) < rise {
            most *= 2.0;
            if most > 1e12 {
                return f64::INFINITY;
            }
        }
        bisect(|mm| self.rise(mm) < rise, 0.0, most, 80)[1]
    }
}

/// Law of one tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WearLaw {
    /// How fast it wears.
    pub rate: WearRate,
    /// Index at which the tool is worn out; infinite where that is not known.
    pub end: f64,
    /// Relative standard deviation of the rate from tool to tool.
    pub rate_scatter: f64,
    /// Standard deviation of the index at the end from tool to tool, in the unit of the index.
    pub end_scatter: f64,
}

impl WearLaw {
    /// Does a slower feed wear the tool less per length?
    pub fn slower_is_safer(&self) -> bool {
        self.rate.exponent > 0.0
    }
    /// W from a fresh edge to the end, mm.
    pub fn life_mm(&self, fresh: f64) -> f64 {
        self.rate.behind(self.end - fresh)
    }
}

/// The law of a tool, and how far it is worn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wear {
    /// Law.
    pub law: WearLaw,
    /// Index of a fresh edge.
    pub fresh: f64,
    /// Index when the program begins.
    pub index: f64,
}

impl Wear {
    /// Rise of the index over that of a fresh edge, as a multiple of it, behind so much of this program, W in mm.
    pub fn worn(&self, mm: f64) -> f64 {
        let begun_mm = self.law.rate.behind(self.index - self.fresh);
        (self.index + self.law.rate.rise(begun_mm + mm) - self.law.rate.rise(begun_mm)) / self.fresh - 1.0
    }
}

/// What a setup says of the wear of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolWear {
    /// How fast it wears; `None`: as the process model says.
    pub rate: Option<WearRate>,
    /// Index at which it is worn out; `None`: not known.
    pub end: Option<f64>,
    /// Relative standard deviation of the rate from tool to tool.
    pub rate_scatter: f64,
    /// Standard deviation of the index at the end from tool to tool.
    pub end_scatter: f64,
    /// Index when the program begins; `None`: a fresh edge.
    pub index: Option<f64>,
}

impl From<Wear> for ToolWear {
    fn from(Wear { law, index, .. }: Wear) -> Self {
        let WearLaw { rate, end, rate_scatter, end_scatter } = law;
        let end = end.is_finite().then_some(end);
        Self { rate: Some(rate), end, rate_scatter, end_scatter, index: Some(index) }
    }
}

/// A length counted for each of [`POWERS`]: a metre at feed f counts (f/f₀)^p metres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Lengths(pub [f64; 4]);

impl Lengths {
    /// The same for every power: what is cut at the reference feed.
    pub fn at_reference(m: f64) -> Self {
        Self([m; 4])
    }
    /// Way of teeth in material at a feed per tooth, in mm, counted from [`COUNTED_AT_MM`] on: per length of path it is as the power −1
    /// of the feed, so a mm of it counts (f/f₀)^(p+1).
    pub fn slid(way_mm: f64, feed_per_tooth_mm: f64) -> Self {
        let counts = |power: f64| way_mm * (feed_per_tooth_mm / COUNTED_AT_MM).powf(power + 1.0);
        if way_mm == 0.0 { Self::default() } else { Self(POWERS.map(counts)) }
    }
    /// With another length behind it.
    pub fn and(&self, more: &Self) -> Self {
        Self([0, 1, 2, 3].map(|k| self.0[k] + more.0[k]))
    }
    /// A share of it.
    pub fn times(&self, share: f64) -> Self {
        Self(self.0.map(|m| share * m))
    }
    /// For a power from −1 to 2. ln W is a cumulant generating function of ln (f/f₀), smooth in p: the cubic through the four.
    pub fn at(&self, power: f64) -> f64 {
        if let Some(k) = POWERS.iter().position(|known| *known == power) {
            return self.0[k];
        }
        let weight = |k: usize| -> f64 {
            let others = POWERS.iter().enumerate().filter(|(j, _)| *j != k);
            others.map(|(_, other)| (power - other) / (POWERS[k] - other)).product()
        };
        if self.0.iter().any(|m| *m <= 0.0) {
            return 0.0;
        }
        self.0.iter().enumerate().map(|(k, m)| weight(k) * m.ln()).sum::<f64>().exp()
    }
}

/// The index of a fresh edge and its unit; `None` where the force model has no part that does not come from the chip.
pub fn fresh_index(model: &ForceModel) -> Option<(f64, &'static str)> {
    let (value, unit) = match model {
        ForceModel::LinearEdge(k) => (k.k_te, "N/mm"),
        ForceModel::Named { name, parameters } => {
            let value = |key: &str| parameters.iter().find(|(known, _)| known == key).map(|(_, value)| *value);
            match name.as_str() {
                "response" => (value("b0")?, "N"),
                "layer" => (value("c0")?, "N/mm"),
                _ => (value("k_te")?, "N/mm"),
            }
        }
    };
    (value > 0.0).then_some((value, unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pace_is_a_power_of_the_feed_and_its_sign_says_whether_slower_is_safer() {
        let law = |exponent| WearLaw {
            rate: WearRate::along_path(1e-3, 0.1, exponent),
            end: 400.0,
            rate_scatter: 0.2,
            end_scatter: 0.0,
        };
        for (p, half) in [(-1.0, 2.0), (0.0, 1.0), (1.0, 0.5), (2.0, 0.25)] {
            let counts = |feed: f64| law(p).rate.counts(7.0, 2.0, feed);
            assert!((counts(0.05) - half).abs() < 1e-12 && (counts(0.1) - 1.0).abs() < 1e-12, "{p}");
            assert_eq!(law(p).slower_is_safer(), p > 0.0);
        }
        assert!((law(0.0).life_mm(100.0) - 3e5).abs() < 1e-6);
    }

    /// 12 mm in material a revolution, two teeth: at 0.05 mm a tooth the tool goes 0.1 mm meanwhile.
    #[test]
    fn by_the_way_of_the_teeth_the_power_minus_one_counts_what_a_tooth_slides() {
        for feed_per_tooth_mm in [0.02, 0.3] {
            let rate = WearRate { counted: Counted::TeethWay, ..WearRate::along_path(1.0, feed_per_tooth_mm, -1.0) };
            assert!((rate.counts(12.0, 2.0, 0.05) - 120.0).abs() < 1e-9);
        }
        // Counted for all powers it is the same, whatever the power.
        for exponent in POWERS {
            let rate = WearRate { counted: Counted::TeethWay, ..WearRate::along_path(1.0, COUNTED_AT_MM, exponent) };
            let all = Lengths::slid(120.0, 0.05);
            assert!((rate.counts(12.0, 2.0, 0.05) / all.at(exponent) - 1.0).abs() < 1e-9);
        }
        assert_eq!(Lengths::slid(0.0, f64::INFINITY), Lengths::default());
    }

    #[test]
    fn what_lies_behind_a_rise_is_where_the_index_has_risen_by_it() {
        let staged =
            WearRate { run_in: 5.0, run_in_mm: 100.0, end_per_mm3: 1e-9, ..WearRate::along_path(1e-3, 0.1, -1.0) };
        for rate in [staged, WearRate::along_path(2e-3, 0.1, 1.0)] {
            for mm in [1.0, 80.0, 3000.0] {
                assert!((rate.behind(rate.rise(mm)) / mm - 1.0).abs() < 1e-9);
            }
            assert_eq!(rate.behind(-1.0), 0.0);
        }
        let level = WearRate { run_in: 5.0, run_in_mm: 100.0, ..WearRate::along_path(0.0, 0.1, -1.0) };
        assert!(level.behind(4.9).is_finite() && level.behind(5.1).is_infinite());
    }

    /// An edge that begins where another stood goes on as that one does.
    #[test]
    fn a_used_edge_goes_on_where_it_stood() {
        let rate =
            WearRate { run_in: 5.0, run_in_mm: 100.0, end_per_mm3: 1e-9, ..WearRate::along_path(1e-3, 0.1, -1.0) };
        let law = WearLaw { rate, end: 40.0, rate_scatter: 0.2, end_scatter: 0.0 };
        let fresh = Wear { law, fresh: 20.0, index: 20.0 };
        let used = Wear { index: 20.0 * (1.0 + fresh.worn(70.0)), ..fresh };
        for mm in [0.0, 30.0, 2000.0] {
            assert!((used.worn(mm) - fresh.worn(70.0 + mm)).abs() < 1e-9, "{mm}");
        }
    }

    #[test]
    fn lengths_between_the_powers_are_those_of_the_sum() {
        let cuts = [(30.0, 0.4), (50.0, 0.9), (20.0, 1.6)];
        let sum = |power: f64| cuts.iter().map(|(m, ratio)| m * f64::powf(*ratio, power)).sum::<f64>();
        let lengths = Lengths(POWERS.map(sum));
        for k in 0..=30 {
            let power = -1.0 + 0.1 * f64::from(k);
            // Far below what a rate scatters by.
            assert!((lengths.at(power) / sum(power) - 1.0).abs() < 5e-3, "{power}");
        }
        assert_eq!(Lengths::default().at(0.5), 0.0);
    }

    #[test]
    fn the_index_is_what_does_not_come_from_the_chip() {
        let named = |name: &str, parameters: &[(&str, f64)]| ForceModel::Named {
            name: name.into(),
            parameters: parameters.iter().map(|(key, value)| ((*key).to_owned(), *value)).collect(),
        };
        assert_eq!(fresh_index(&named("response", &[("b0", 80.0), ("b_l", 3.0)])), Some((80.0, "N")));
        assert_eq!(fresh_index(&named("layer", &[("c0", 3.0)])), Some((3.0, "N/mm")));
        assert_eq!(fresh_index(&named("kienzle", &[("k_c11", 1500.0)])), None);
        let linear = super::super::material::LinearEdge { k_te: 0.0, k_tc: 900.0, ..Default::default() };
        assert_eq!(fresh_index(&ForceModel::LinearEdge(linear)), None);
    }
}
