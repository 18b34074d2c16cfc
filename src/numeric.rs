//! Numerical methods that rooms share: bisection, in steps of equal width or of equal ratio, regula falsi, and golden section. In: functions
//! of one number. Out: where a condition ceases to hold; where a function changes sign; where it is least.
//!
//! Regula falsi ends at what its caller asks for, so [`SignChange`] keeps the interval alone; `engage/gaps.rs` and `force/cap.rs` have one of
//! their own.

/// The last interval about the place where a condition ceases to hold: from a number where it holds and one where it does not, halved
/// so many times. The first of the pair still holds, the second does not; they lie |yes − no|/2ⁿ apart.
pub fn bisect(holds: impl Fn(f64) -> bool, yes: f64, no: f64, halvings: u32) -> [f64; 2] {
    enclose(holds, yes, no, halvings, |yes, no| 0.5 * (yes + no))
}

/// The same between two positive numbers that lie far apart: each step halves the logarithm of their ratio.
pub fn bisect_ratio(holds: impl Fn(f64) -> bool, yes: f64, no: f64, halvings: u32) -> [f64; 2] {
    enclose(holds, yes, no, halvings, |yes, no| (yes * no).sqrt())
}

fn enclose(
    holds: impl Fn(f64) -> bool,
    mut yes: f64,
    mut no: f64,
    halvings: u32,
    between: impl Fn(f64, f64) -> f64,
) -> [f64; 2] {
    for _ in 0..halvings {
        let middle = between(yes, no);
        if holds(middle) { yes = middle } else { no = middle }
    }
    [yes, no]
}

/// The middle of an interval.
pub fn middle([a, b]: [f64; 2]) -> f64 {
    0.5 * (a + b)
}

/// An interval in which a function changes its sign, narrowed by regula falsi with the Illinois modification (Dowell and Jarratt 1971).
#[derive(Debug, Clone, Copy)]
pub struct SignChange {
    ends: [f64; 2],
    /// Values there, of opposite signs; that of an end that stays twice in a row is halved.
    values: [f64; 2],
    last: Option<usize>,
}

impl SignChange {
    /// From two arguments with their values, the first negative, the second positive.
    pub fn new(negative: (f64, f64), positive: (f64, f64)) -> Self {
        Self { ends: [negative.0, positive.0], values: [negative.1, positive.1], last: None }
    }

    /// Where to look next.
    pub fn next(&self) -> f64 {
        let ([a, b], [at_a, at_b]) = (self.ends, self.values);
        a - at_a * (b - a) / (at_b - at_a)
    }

    /// Narrows the interval by a value at a place in it.
    pub fn narrow(&mut self, at: f64, value: f64) {
        let end = usize::from(value > 0.0);
        (self.ends[end], self.values[end]) = (at, value);
        if self.last == Some(end) {
            self.values[1 - end] *= 0.5;
        }
        self.last = Some(end);
    }

    /// How wide it still is.
    pub fn width(&self) -> f64 {
        (self.ends[1] - self.ends[0]).abs()
    }

    /// The end with a negative value.
    pub fn negative(&self) -> f64 {
        self.ends[0]
    }
}

/// The part of an interval that golden section keeps of it at each step, (√5 − 1)/2.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Where a function with one valley is least on an interval, by golden section until no more than `width` is left (Kiefer 1953:
/// each step costs one value and leaves 0.618 of the interval). (argument, value); an end where nothing inside is less.
pub fn golden_section(f: impl Fn(f64) -> f64, a: f64, b: f64, width: f64) -> (f64, f64) {
    let (mut lo, mut hi) = (a, b);
    let (mut x, mut y) = (hi - GOLDEN * (hi - lo), lo + GOLDEN * (hi - lo));
    let (mut fx, mut fy) = (f(x), f(y));
    while hi - lo > width {
        if fx <= fy {
            (hi, y, fy) = (y, x, fx);
            x = hi - GOLDEN * (hi - lo);
            fx = f(x);
        } else {
            (lo, x, fx) = (x, y, fy);
            y = lo + GOLDEN * (hi - lo);
            fy = f(y);
        }
    }
    [(a, f(a)), (b, f(b)), (x, fx)]
        .into_iter()
        .fold((x, f64::INFINITY), |best, new| if new.1 < best.1 { new } else { best })
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

    #[test]
    fn a_border_between_numbers_far_apart_is_enclosed_by_ratio() {
        let [yes, no] = bisect_ratio(|x| x < 3.0, 1e-3, 1e5, 20);
        assert!(yes < 3.0 && no >= 3.0);
        let left = (1e8f64).ln() / f64::from(1u32 << 20);
        assert!(((no / yes).ln() - left).abs() < 1e-12, "halved by ratio");
    }

    #[test]
    fn a_change_of_sign_is_closed_in_on_where_the_function_bends_and_where_it_jumps() {
        let looks = |f: &dyn Fn(f64) -> f64, at: f64| {
            let mut change = SignChange::new((0.0, f(0.0)), (2.0, f(2.0)));
            (1..60).find(|_| {
                let next = change.next();
                change.narrow(next, f(next));
                (next - at).abs() < 1e-9
            })
        };
        assert_eq!(looks(&|x| 3.0 * x - 2.1, 0.7), Some(1));
        assert!(looks(&|x| x.powi(9) - 1.0, 1.0).is_some_and(|count| count < 30));
        assert!(looks(&|x| if x < 0.3 { -1.0 } else { 5.0 }, 0.3).is_some_and(|count| count < 50));
    }

    #[test]
    fn a_valley_is_found_inside_and_at_an_end() {
        let bowl = |x: f64| (x - 0.3).powi(2) + 2.0;
        let (at, value) = golden_section(bowl, -1.0, 4.0, 1e-7);
        assert!((at - 0.3).abs() < 1e-7 && (value - 2.0).abs() < 1e-13);
        assert_eq!(golden_section(|x| x, 1.0, 2.0, 1e-7), (1.0, 1.0));
        assert_eq!(golden_section(|x| -x, 1.0, 2.0, 1e-7), (2.0, -2.0));
        // A step costs one value: width w is reached in ln(5/w)/0.4812 of them, two at the start and three at the end beside.
        let calls = std::cell::Cell::new(0);
        let counted = |x: f64| {
            calls.set(calls.get() + 1);
            bowl(x)
        };
        golden_section(counted, -1.0, 4.0, 1e-3);
        assert!((20..=24).contains(&calls.get()), "{}", calls.get());
    }
}
