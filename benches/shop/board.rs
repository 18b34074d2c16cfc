//! The table of results: one row a cause, sums, and the goals.

use super::judge::{Answer, Verdict};

/// Heads of the columns.
pub fn print_heads() {
    println!(
        "{:<18} {:>4} {:>5} {:>6} {:>5} {:>6} {:>5} {:>9} {:>6} {:>6} {:>8} {:>6} {:>6} {:>6} {:>5}",
        "cause",
        "logs",
        "right",
        "silent",
        "false",
        "one of",
        "in it",
        "covariate",
        "failed",
        "unseen",
        "before",
        "after",
        "second",
        "gone",
        "s"
    );
}

/// Sums of one row of the table.
#[derive(Default)]
pub struct Row {
    pub logs: usize,
    pub unseen: usize,
    pub right: usize,
    pub silent: usize,
    pub wrong: usize,
    pub one_of: usize,
    pub among: usize,
    pub covariate: usize,
    pub covariate_among: usize,
    pub failed: usize,
    pub before: Vec<f64>,
    pub after: Vec<f64>,
    pub second: Vec<f64>,
    pub gone: Vec<f64>,
    pub seconds: Vec<f64>,
}

/// Middle value; not a number of none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    if sorted.is_empty() { f64::NAN } else { sorted[sorted.len() / 2] }
}

impl Row {
    /// Adds a judged log.
    pub fn add(&mut self, verdict: &Verdict, answer: &Answer, noise_w: f64, second: Option<f64>, seconds: f64) {
        self.logs += 1;
        self.right += usize::from(verdict.right);
        self.silent += usize::from(verdict.silent);
        self.wrong += usize::from(!verdict.false_names.is_empty());
        self.one_of += usize::from(verdict.one_of);
        self.among += usize::from(verdict.among);
        self.covariate += usize::from(verdict.covariate_right);
        self.covariate_among += usize::from(verdict.covariate_among);
        self.failed += usize::from(answer.failure.is_some());
        self.seconds.push(seconds);
        if let (Some(before), Some(after)) = (answer.before, answer.after) {
            self.before.push(before / noise_w);
            self.after.push(after / noise_w);
            if before > noise_w {
                self.gone.push(((before - after) / (before - noise_w)).min(1.0));
            }
        }
        self.second.extend(second.map(|watts| watts / noise_w));
    }

    /// One line of the table.
    pub fn print(&self, name: &str) {
        println!(
            "{name:<18} {:>4} {:>5} {:>6} {:>5} {:>6} {:>5} {:>9} {:>6} {:>6} {:>8.2} {:>6.2} {:>6.2} {:>5.0}% {:>5.1}",
            self.logs,
            self.right,
            self.silent,
            self.wrong,
            self.one_of,
            self.among,
            self.covariate,
            self.failed,
            self.unseen,
            median(&self.before),
            median(&self.after),
            median(&self.second),
            100.0 * median(&self.gone),
            median(&self.seconds)
        );
    }

    /// Adds the logs of another row.
    pub fn take_in(&mut self, other: &Self) {
        self.logs += other.logs;
        self.unseen += other.unseen;
        self.right += other.right;
        self.silent += other.silent;
        self.wrong += other.wrong;
        self.one_of += other.one_of;
        self.among += other.among;
        self.covariate += other.covariate;
        self.covariate_among += other.covariate_among;
        self.failed += other.failed;
        self.before.extend(&other.before);
        self.after.extend(&other.after);
        self.second.extend(&other.second);
        self.gone.extend(&other.gone);
        self.seconds.extend(&other.seconds);
    }
}

/// Sums by kind (plain, one listed effect, two, no name), and the goals of this bench at 3 % noise.
pub fn print_goals(totals: &[Row; 4]) {
    println!();
    for (name, total) in ["plain", "one listed", "two listed", "no name"].iter().zip(totals) {
        total.print(name);
    }
    let share = |part: usize, of: usize| 100.0 * part as f64 / of.max(1) as f64;
    let logs: usize = totals.iter().map(|row| row.logs).sum();
    let wrong: usize = totals.iter().map(|row| row.wrong).sum();
    println!("\nlisted effect right  {:5.1} %  goal 95", share(totals[1].right, totals[1].logs));
    println!("pairs right          {:5.1} %  goal 90", share(totals[2].right, totals[2].logs));
    println!("false names          {:5.1} %  goal at most 2", share(wrong, logs));
    let (one_of, among): (usize, usize) =
        totals.iter().fold((0, 0), |sum, row| (sum.0 + row.one_of, sum.1 + row.among));
    println!("answered \"one of\"    {:5.1} %  with the truth in it {among} of {one_of}", share(one_of, logs));
    println!("covariate right      {:5.1} %  goal 80", share(totals[3].covariate, totals[3].logs));
    println!(
        "  or among its rivals {:4.1} %  (at most two are said beside the first)",
        share(totals[3].covariate_among, totals[3].logs)
    );
    println!(
        "error above the noise that is gone, median over causes without a name {:3.0} %  goal 70",
        100.0 * median(&totals[3].gone)
    );
}
