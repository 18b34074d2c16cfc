//! Numerical methods that rooms share. In: functions of one number. Out: where a condition begins to hold.

/// The last interval about the place where a condition ceases to hold: from a number where it holds and one where it does not, halved
/// so many times. The first of the pair still holds, the second does not; they lie |yes − no|/2ⁿ apart.
pub fn bisect(holds: impl Fn(f64) -> bool, mut yes: f64, mut no: f64, halvings: u32) -> [f64; 2] {
    for _ in 0..halvings {
        let middle = 0.5 * (yes + no);
        if holds(middle) { yes = middle } else { no = middle }
    }
    [yes, no]
}

/// The middle of an interval.
pub fn middle([a, b]: [f64; 2]) -> f64 {
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_border_is_enclosed_from_either_side() {
        let below = |x: f64| x * x < 2.0;
        let [yes, no] = bisect(below, 0.0, 2.0, 30);
        assert!(below(yes) && !below(no) && (no - yes - 2.0 / f64::from(1u32 << 30)).abs() < 1e-15);
        let [yes, no] = bisect(|x| !below(x), 2.0, 0.0, 30);
        assert!(!below(yes) && below(no) && (middle([yes, no]) - 2f64.sqrt()).abs() < 1e-8);
        assert_eq!(bisect(below, 0.0, 2.0, 0), [0.0, 2.0]);
    }
}
