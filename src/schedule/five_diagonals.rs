//! Symmetric positive definite systems with five diagonals. In: the diagonals, right sides. Out: L D Lᵀ in place, solutions.
//! Every vector carries one entry of padding before and after the n unknowns, which stand at 1 … n.

/// The matrix; after [`Band::factor`] its factors.
#[derive(Debug, Clone, Default)]
pub struct Band {
    /// Entries (i, i).
    pub diagonal: Vec<f64>,
    /// Entries (i, i + 1).
    pub next: Vec<f64>,
    /// Entries (i, i + 2).
    pub after: Vec<f64>,
}

impl Band {
    /// Zeros for n unknowns.
    pub fn zeros(n: usize) -> Self {
        Self { diagonal: vec![0.0; n + 2], next: vec![0.0; n + 2], after: vec![0.0; n + 2] }
    }
    /// All entries to 0.
    pub fn clear(&mut self) {
        for entries in [&mut self.diagonal, &mut self.next, &mut self.after] {
            entries.fill(0.0);
        }
    }
    /// Adds d·g gᵀ, g standing at `at`, `at` + 1, `at` + 2.
    pub fn add(&mut self, at: usize, g: &[f64; 3], d: f64) {
        let [d0, d1, d2] = g.map(|g| d * g);
        self.diagonal[at] += d0 * g[0];
        self.diagonal[at + 1] += d1 * g[1];
        self.diagonal[at + 2] += d2 * g[2];
        self.next[at] += d0 * g[1];
        self.next[at + 1] += d1 * g[2];
        self.after[at] += d0 * g[2];
    }
    /// Factors; `None` when the matrix is not positive definite.
    pub fn factor(&mut self) -> Option<()> {
        let n = self.diagonal.len() - 2;
        for i in 1..=n {
            let d = self.diagonal[i];
            if !(d > 0.0 && d.is_finite()) {
                return None;
            }
            let (next, after) = (self.next[i], self.after[i]);
            (self.next[i], self.after[i]) = (next / d, after / d);
            self.diagonal[i + 1] -= self.next[i] * next;
            if i < n {
                self.next[i + 1] -= self.next[i] * after;
                self.diagonal[i + 2] -= self.after[i] * after;
            }
        }
        Some(())
    }
    /// Solves in place, after [`Band::factor`]; the padding of `x` is 0 afterwards.
    pub fn solve(&self, x: &mut [f64]) {
        let n = self.diagonal.len() - 2;
        x[0] = 0.0;
        for i in 1..n {
            x[i + 1] -= self.next[i] * x[i];
            x[i + 2] -= self.after[i] * x[i];
        }
        x[n + 1] = 0.0;
        for i in (1..=n).rev() {
            let beyond = if i < n { self.after[i] * x[i + 2] } else { 0.0 };
            x[i] = x[i] / self.diagonal[i] - self.next[i] * x[i + 1] - beyond;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_it_was_given() {
        let n = 7;
        let mut band = Band::zeros(n);
        for i in 1..=n {
            band.diagonal[i] = 4.0 + i as f64;
        }
        for at in 0..n {
            let g = [if at > 0 { 1.0 } else { 0.0 }, -0.5 * at as f64, if at + 2 <= n { 0.7 } else { 0.0 }];
            band.add(at, &g, 2.0);
        }
        let wanted: Vec<f64> = (0..n + 2).map(|i| if i == 0 || i > n { 0.0 } else { (i as f64).sin() }).collect();
        let mut right = vec![0.0; n + 2];
        for i in 1..=n {
            right[i] = band.diagonal[i] * wanted[i] + band.next[i] * wanted[i + 1] + band.next[i - 1] * wanted[i - 1];
            right[i] += if i < n { band.after[i] * wanted[i + 2] } else { 0.0 };
            right[i] += if i > 1 { band.after[i - 2] * wanted[i - 2] } else { 0.0 };
        }
        band.factor().unwrap();
        band.solve(&mut right);
        assert!(right.iter().zip(&wanted).all(|(x, y)| (x - y).abs() < 1e-12), "{right:?} {wanted:?}");
    }
}
