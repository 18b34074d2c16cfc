//! A sparse matrix for products with it and with its transpose. In: its rows. Out: A x, Aᵀ y. Every component is one sum in the order of the
//! entries, so that the result does not depend on the number of threads.

use rayon::prelude::*;

/// Components that a thread takes at a time.
pub(super) const RUN: usize = 2048;

/// The matrix.
#[derive(Debug, Clone)]
pub struct Sparse {
    rows: Lines,
    columns: Lines,
}

/// Rows, or columns: what follows one after the other.
#[derive(Debug, Clone)]
struct Lines {
    /// Where each begins in `entries`, and the end of the last.
    begins: Vec<u32>,
    /// Column, or row, and coefficient.
    entries: Vec<(u32, f64)>,
}

impl Sparse {
    /// A matrix of these rows with so many columns.
    pub fn new<'a>(rows: impl Iterator<Item = &'a [(u32, f64)]>, columns: usize) -> Self {
        let mut by_row = Lines { begins: vec![0], entries: Vec::new() };
        for row in rows {
            by_row.entries.extend_from_slice(row);
            by_row.begins.push(by_row.entries.len() as u32);
        }
        let columns = by_row.transposed(columns);
        Self { rows: by_row, columns }
    }

    /// A x.
    pub fn times(&self, x: &[f64], out: &mut Vec<f64>) {
        self.rows.times(x, out);
    }

    /// Aᵀ y.
    pub fn transposed_times(&self, y: &[f64], out: &mut Vec<f64>) {
        self.columns.times(y, out);
    }

    /// The diagonal of AᵀA.
    pub fn squares(&self) -> Vec<f64> {
        let square = |column: usize| self.columns.line(column).iter().map(|(_, a)| a * a).sum();
        (0..self.columns.count()).map(square).collect()
    }
}

impl Lines {
    fn count(&self) -> usize {
        self.begins.len() - 1
    }

    fn line(&self, k: usize) -> &[(u32, f64)] {
        &self.entries[self.begins[k] as usize..self.begins[k + 1] as usize]
    }

    fn times(&self, x: &[f64], out: &mut Vec<f64>) {
        let sum = |k: usize| self.line(k).iter().map(|(at, a)| a * x[*at as usize]).sum();
        (0..self.count()).into_par_iter().with_min_len(RUN).map(sum).collect_into_vec(out);
    }

    /// The same entries line by line the other way; `count`: number of those lines.
    fn transposed(&self, count: usize) -> Self {
        let mut begins = vec![0u32; count + 1];
        for (at, _) in &self.entries {
            begins[*at as usize + 1] += 1;
        }
        for k in 0..count {
            begins[k + 1] += begins[k];
        }
        let (mut next, mut entries) = (begins.clone(), vec![(0, 0.0); self.entries.len()]);
        for k in 0..self.count() {
            for (at, a) in self.line(k) {
                let place = &mut next[*at as usize];
                entries[*place as usize] = (k as u32, *a);
                *place += 1;
            }
        }
        Self { begins, entries }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_the_full_matrix() {
        // (1 2 0; 0 0 3; 0 4 5), with an empty row between.
        let rows = [vec![(0, 1.0), (1, 2.0)], vec![], vec![(2, 3.0)], vec![(2, 5.0), (1, 4.0)]];
        let matrix = Sparse::new(rows.iter().map(Vec::as_slice), 3);
        let mut out = Vec::new();
        matrix.times(&[1.0, 10.0, 100.0], &mut out);
        assert_eq!(out, [21.0, 0.0, 300.0, 540.0]);
        matrix.transposed_times(&[1.0, 7.0, 10.0, 100.0], &mut out);
        assert_eq!(out, [1.0, 402.0, 530.0]);
        assert_eq!(matrix.squares(), [1.0, 20.0, 34.0]);
    }
}
