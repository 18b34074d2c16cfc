//! How a tool wears over the metres that it cuts. In: a law, and the feeds of what is cut. Out: the rise of its wear index.
//!
//! The index is the part of the cutting force that does not come from the chip: β₀ of the response model (N), k_te of the
//! linear edge model (N/mm); wear adds to it and to nothing else (Ibaraki, Shimizu, Matsubara, section 2). It rises per
//! length of cut by
//!
//! ```text
//! dβ/ds = k (f/f₀)^p          f feed per tooth, f₀ that at which k was seen
//! ```
//! p = −1: the edge wears with the way its teeth slide, of which a slower feed has more per length. p = 0: the feed is all
//! one. p > 0: thick chips wear it. The tool is worn out where the index reaches its end. One law serves the loads along a
//! program ([`crate::schedule::history`]), the budget of a program ([`crate::schedule::budget`]) and the plan over many.

use super::material::ForceModel;

/// Law of one tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WearLaw {
    /// k: rise of the index per mm of cut at the feed per tooth f₀.
    pub rate_per_mm: f64,
    /// f₀, mm.
    pub feed_per_tooth_mm: f64,
    /// p, from −1 to 2.
    pub exponent: f64,
    /// Index at which the tool is worn out.
    pub end: f64,
    /// Relative standard deviation of k from tool to tool.
    pub rate_scatter: f64,
    /// Standard deviation of the index at the end from tool to tool, in the unit of the index.
    pub end_scatter: f64,
}

impl WearLaw {
    /// (f/f₀)^p: how much faster than at f₀ the index rises per length at a feed per tooth, mm.
    pub fn pace(&self, feed_per_tooth_mm: f64) -> f64 {
        (feed_per_tooth_mm / self.feed_per_tooth_mm).powf(self.exponent)
    }
    /// Does a slower feed wear the tool less per length?
    pub fn slower_is_safer(&self) -> bool {
        self.exponent > 0.0
    }
}

/// The law of a tool, and how far it is worn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wear {
    /// Law.
    pub law: WearLaw,
    /// Index when the program begins; `None`: a fresh edge.
    pub index: Option<f64>,
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
            rate_per_mm: 1e-3,
            feed_per_tooth_mm: 0.1,
            exponent,
            end: 400.0,
            rate_scatter: 0.2,
            end_scatter: 0.0,
        };
        for (p, half) in [(-1.0, 2.0), (0.0, 1.0), (1.0, 0.5), (2.0, 0.25)] {
            assert!((law(p).pace(0.05) - half).abs() < 1e-12 && (law(p).pace(0.1) - 1.0).abs() < 1e-12, "{p}");
            assert_eq!(law(p).slower_is_safer(), p > 0.0);
        }
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
