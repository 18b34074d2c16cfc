//! How a cut is spread along the cutting edge. In: pieces of the edge that cut, each with its heights above the tip, the section it
//! removes and the length it sweeps. Out: which share of the cutting and of the edge terms lies below a height.
//! A pass along a wall that also takes a skin off the floor is thick near the tip and thin above: its depth alone does not tell.

/// Heights at which the shares are kept: 1/128, 1/64 … 1 of the cut's height, since cuts are uneven near the tip (floor, corner radius).
const HEIGHTS: usize = 8;

/// Lowest point of a cut over its height up to which it begins at the tip: what the rounding of a table takes. Judgement.
const AT_TIP: f64 = 0.01;

/// Heights of a cut along the edge and what lies below each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlongEdge {
    /// Lowest and highest point of the cut above the tip, mm.
    from_to_mm: [f64; 2],
    /// Share of the cutting terms (by removed section) and of the edge terms (by contact) below each height.
    below: [[f64; 2]; HEIGHTS],
}

/// A piece of the edge that cuts.
#[derive(Debug, Clone, Copy)]
pub struct EdgePiece {
    /// Lowest and highest point above the tip, mm.
    pub from_to_mm: [f64; 2],
    /// Section it removes and area it sweeps, mm².
    pub section_and_contact_mm2: [f64; 2],
}

impl Default for AlongEdge {
    /// Not known.
    fn default() -> Self {
        Self { from_to_mm: [f64::NAN; 2], below: [[f64::NAN; 2]; HEIGHTS] }
    }
}

impl AlongEdge {
    /// A cut that is the same at all heights between two, mm.
    pub fn even(from_to_mm: [f64; 2]) -> Self {
        Self { from_to_mm, below: std::array::from_fn(|k| [portion(k); 2]) }
    }

    /// A cut made by these pieces; not known without any. An end face that plunges cuts at one height.
    pub fn of(pieces: impl Iterator<Item = EdgePiece> + Clone) -> Self {
        let far = [f64::INFINITY, f64::NEG_INFINITY];
        let widen =
            |[low, high]: [f64; 2], piece: EdgePiece| [low.min(piece.from_to_mm[0]), high.max(piece.from_to_mm[1])];
        let from_to_mm = pieces.clone().fold(far, widen);
        let [low, high] = from_to_mm;
        if low > high {
            return Self::default();
        }
        let (mut below, mut whole) = ([[0.0; 2]; HEIGHTS], [0.0; 2]);
        for EdgePiece { from_to_mm: [from, to], section_and_contact_mm2 } in pieces {
            for kind in 0..2 {
                whole[kind] += section_and_contact_mm2[kind];
            }
            for (k, below) in below.iter_mut().enumerate() {
                let height_mm = low + portion(k) * (high - low);
                let share = if height_mm >= to { 1.0 } else { ((height_mm - from) / (to - from)).max(0.0) };
                for kind in 0..2 {
                    below[kind] += share * section_and_contact_mm2[kind];
                }
            }
        }
        Self { from_to_mm, below: below.map(|of| [0, 1].map(|kind| of[kind] / whole[kind].max(1e-12))) }
    }

    /// Whether anything is known of it.
    pub fn is_known(&self) -> bool {
        self.from_to_mm[0].is_finite()
    }

    /// Whether it begins at the tip, to what the heights of rings and tables are rounded.
    pub fn begins_at_tip(&self) -> bool {
        let [from, to] = self.from_to_mm;
        from <= AT_TIP * (to - from)
    }

    /// Share of the cutting and of the edge terms below a height above the tip, mm; straight between the kept heights.
    pub fn below(&self, height_mm: f64) -> [f64; 2] {
        let [from, to] = self.from_to_mm;
        if height_mm >= to {
            return [1.0; 2];
        }
        let at = (height_mm - from) / (to - from);
        if at <= 0.0 {
            return [0.0; 2];
        }
        let (mut before, mut known) = (0.0, [0.0; 2]);
        for (k, next) in self.below.iter().enumerate() {
            if at < portion(k) {
                let share = (at - before) / (portion(k) - before);
                return [0, 1].map(|kind| known[kind] + share * (next[kind] - known[kind]));
            }
            (before, known) = (portion(k), *next);
        }
        // The cut is not known.
        [f64::NAN; 2]
    }

    /// Mean height of what is cut, weighted by the removed section, mm above the tip.
    pub fn middle_mm(&self) -> f64 {
        let [from, to] = self.from_to_mm;
        let (mut middle, mut before) = (0.0, [0.0; 2]);
        for (k, [share, _]) in self.below.iter().enumerate() {
            middle += (share - before[1]) * 0.5 * (before[0] + portion(k));
            before = [portion(k), *share];
        }
        from + middle * (to - from)
    }
}

/// Height of a kept share over that of the cut.
fn portion(k: usize) -> f64 {
    0.5_f64.powi((HEIGHTS - 1 - k) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_cut_has_the_share_of_its_height() {
        let cut = AlongEdge::even([0.0, 8.0]);
        for (height_mm, share) in
            [(-1.0, 0.0), (0.0, 0.0), (0.5, 0.0625), (1.0, 0.125), (6.0, 0.75), (8.0, 1.0), (9.0, 1.0)]
        {
            assert!(cut.below(height_mm).iter().all(|s| (s - share).abs() < 1e-12), "{height_mm}");
        }
        assert!((cut.middle_mm() - 4.0).abs() < 1e-12);
        assert!(cut.begins_at_tip() && AlongEdge::even([0.019, 2.019]).begins_at_tip());
        let layer = AlongEdge::even([2.0, 3.0]);
        assert!(!layer.begins_at_tip() && !AlongEdge::even([0.021, 2.021]).begins_at_tip());
        assert_eq!([1.0, 2.25, 4.0].map(|height| layer.below(height)[0]), [0.0, 0.25, 1.0]);
        assert!((layer.middle_mm() - 2.5).abs() < 1e-12);
        assert!(AlongEdge::default().below(1.0)[0].is_nan());
    }

    /// A wall 8 mm high of which 0.25 mm at the tip take a floor ten times as wide: the shares of the two, to what the kept heights round.
    #[test]
    fn a_wall_with_a_floor_is_thick_at_the_tip() {
        let rings = 64;
        let step = 8.0 / f64::from(rings);
        let pieces = (0..rings).map(|k| {
            let from = f64::from(k) * step;
            let wide = if from < 0.25 { 10.0 } else { 1.0 };
            EdgePiece { from_to_mm: [from, from + step], section_and_contact_mm2: [wide * step, step] }
        });
        let cut = AlongEdge::of(pieces);
        let whole = 0.25 * 10.0 + 7.75;
        for (height_mm, section) in [(0.125, 1.25), (0.25, 2.5), (1.25, 3.5), (8.0, whole)] {
            let [of_cutting, of_edge] = cut.below(height_mm);
            assert!((of_cutting - section / whole).abs() < 1e-9, "{height_mm}: {of_cutting}");
            assert!((of_edge - height_mm / 8.0).abs() < 1e-9, "{height_mm}: {of_edge}");
        }
        let middle = (2.5 * 0.125 + 7.75 * (0.25 + 8.0) * 0.5) / whole;
        assert!((cut.middle_mm() - middle).abs() < 0.02, "{} for {middle}", cut.middle_mm());
        assert!(!AlongEdge::of(std::iter::empty()).is_known());
    }

    /// A flat end that plunges cuts with its end face alone, which has no height: all of it lies at the tip.
    #[test]
    fn an_end_face_cuts_at_the_tip() {
        let face = EdgePiece { from_to_mm: [0.0; 2], section_and_contact_mm2: [3.0, 5.0] };
        let cut = AlongEdge::of([face, face].into_iter());
        assert!(cut.is_known() && cut.begins_at_tip());
        assert_eq!((cut.middle_mm(), cut.below(0.4), cut.below(-0.1)), (0.0, [1.0; 2], [0.0; 2]));
    }
}
