//! A quantity tabulated over another (tare or power over spindle speed). In: points, and an argument. Out: the value, linear between the points
//! and constant beyond the ends.

/// Points (x, y) with strictly rising x.
#[derive(Debug, Clone, PartialEq)]
pub struct Table(Vec<[f64; 2]>);

impl Table {
    /// One value everywhere.
    pub fn constant(y: f64) -> Self {
        Self(vec![[0.0, y]])
    }
    /// From points; `None` when empty, not finite, or x does not rise strictly.
    pub fn new(points: Vec<[f64; 2]>) -> Option<Self> {
        let finite = points.iter().flatten().all(|value| value.is_finite());
        let rising = points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        (finite && rising && !points.is_empty()).then_some(Self(points))
    }
    /// Value at `x`.
    pub fn at(&self, x: f64) -> f64 {
        let points = &self.0;
        let after = points.partition_point(|p| p[0] <= x);
        if after == 0 {
            return points[0][1];
        }
        if after == points.len() {
            return points[after - 1][1];
        }
        let ([x0, y0], [x1, y1]) = (points[after - 1], points[after]);
        y0 + (y1 - y0) * (x - x0) / (x1 - x0)
    }
}

#[cfg(test)]
mod tests {
    use super::Table;

    #[test]
    fn is_linear_between_and_constant_beyond() {
        let table = Table::new(vec![[0.0, 1.0], [2.0, 5.0]]).unwrap();
        assert_eq!([table.at(-1.0), table.at(0.5), table.at(2.0), table.at(9.0)], [1.0, 2.0, 5.0, 5.0]);
        assert!(Table::new(vec![[1.0, 0.0], [1.0, 2.0]]).is_none());
        assert!(Table::new(vec![[1.0, f64::NAN]]).is_none());
    }
}
