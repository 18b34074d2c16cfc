//! The times of a program on a machine that accelerates less than declared.
//!
//! In: timeline, speeds of its spots over the declared ones at some factors of the acceleration. Out: the start of
//! every spot. Between two factors the duration of a spot is interpolated linearly in 1/factor, since a move of length
//! L at speed v takes L/v + v/a.

use crate::learn::program::timeline::Timeline;

/// Speed over declared speed of every spot, at a factor of the declared acceleration.
pub type Slower = (f64, Vec<f64>);

/// Start times of the spots on one machine.
#[derive(Debug, Clone)]
pub struct Clock {
    /// Its acceleration over the declared one.
    pub factor: f64,
    /// Start of every spot, and the end, s.
    pub starts: Vec<f64>,
}

impl Clock {
    /// The clock of a machine with `factor` of the declared acceleration; `slower` by falling factor.
    pub fn new(timeline: &Timeline, slower: &[Slower], factor: f64) -> Self {
        let (above, below, t) = around(slower, factor);
        let longer = |ratios: Option<&Vec<f64>>, k: usize| ratios.map_or(1.0, |r| 1.0 / r[k].max(1e-3));
        let mut starts = Vec::with_capacity(timeline.spots.len() + 1);
        starts.push(0.0);
        let mut now = 0.0;
        for (k, spot) in timeline.spots.iter().enumerate() {
            let (fast, slow) = (longer(above, k), longer(below, k));
            now += (spot.end_s - spot.start_s) * (fast + t * (slow - fast));
            starts.push(now);
        }
        Self { factor, starts }
    }

    /// Length of the program, s.
    pub fn total_s(&self) -> f64 {
        self.starts[self.starts.len() - 1]
    }

    /// Spot at a time of this clock and the elapsed share of it; `None` outside the program.
    pub fn place(&self, time_s: f64) -> Option<(usize, f64)> {
        if !(0.0..=self.total_s()).contains(&time_s) || self.starts.len() < 2 {
            return None;
        }
        let spot = self.starts.partition_point(|t| *t <= time_s).clamp(1, self.starts.len() - 1) - 1;
        let length = self.starts[spot + 1] - self.starts[spot];
        Some((spot, ((time_s - self.starts[spot]) / length.max(1e-9)).clamp(0.0, 1.0)))
    }

    /// Time of this clock at a place.
    pub fn time(&self, (spot, share): (usize, f64)) -> f64 {
        self.starts[spot] + share * (self.starts[spot + 1] - self.starts[spot])
    }

    /// Time on the declared machine at a time of this clock, s; NaN outside the program.
    pub fn declared_s(&self, timeline: &Timeline, time_s: f64) -> f64 {
        self.place(time_s).map_or(f64::NAN, |(k, share)| {
            let spot = &timeline.spots[k];
            spot.start_s + share * (spot.end_s - spot.start_s)
        })
    }
}

/// Ratios at the next higher and lower factor, and the position between them, 0 … 1.
fn around(slower: &[Slower], factor: f64) -> (Option<&Vec<f64>>, Option<&Vec<f64>>, f64) {
    let below = slower.partition_point(|(f, _)| *f > factor);
    let Some((low, ratios)) = slower.get(below).or(slower.last()) else { return (None, None, 0.0) };
    let above = below.checked_sub(1).and_then(|k| slower.get(k)).filter(|(f, _)| f > low);
    let high = above.map_or(1.0, |(f, _)| *f);
    let t = (1.0 / factor - 1.0 / high) / (1.0 / low - 1.0 / high);
    (above.map(|(_, r)| r), Some(ratios), t.clamp(0.0, 1.0))
}
