//! Range of feeds that the data cover. In: data. Out: the highest feed per tooth of the cuts of each tool.

use std::collections::BTreeMap;

use super::samples::{Class, Data};

/// Share of a tool's cuts that must reach a feed for it to count as measured; excludes a corner or an edge of the stock
/// that is passed once at a high feed. Judgement.
const REACHED_BY: f64 = 0.05;

/// Tools in order with their highest feed per tooth, mm; empty if tools or feeds are not known.
pub fn highest_feeds(data: &Data) -> Vec<(u32, f64)> {
    let cutting: Vec<usize> = (0..data.base.len()).filter(|b| data.base[*b].class == Class::Cutting).collect();
    let mut feeds: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for i in data.used().filter(|i| cutting.iter().any(|b| data.columns[*b][*i] != 0.0)) {
        let state = &data.state[i];
        if state.tool >= 0.0 && state.feed_per_tooth_mm > 0.0 {
            feeds.entry(state.tool as u32).or_default().push(state.feed_per_tooth_mm);
        }
    }
    let highest = |(tool, mut own): (u32, Vec<f64>)| {
        own.sort_by(|a, b| b.total_cmp(a));
        (tool, own[(REACHED_BY * own.len() as f64) as usize])
    };
    feeds.into_iter().map(highest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::State;
    use crate::learn::dataset::samples::{Base, UNBOUNDED};

    /// A hundred cuts of tool 2 at 0.05 mm, `fast` of them at 0.2 mm, and air at 1 mm.
    fn data(fast: usize) -> Data {
        let feed = |i: usize| if i >= 100 { 1.0 } else { [0.2, 0.05][usize::from(i >= fast)] };
        let state = |i| State { tool: 2.0, feed_per_tooth_mm: feed(i), ..State::default() };
        let base =
            Base { name: "k_tc".into(), unit: "N/mm²".into(), class: Class::Cutting, prior: None, bounds: UNBOUNDED };
        Data {
            base: vec![base],
            columns: vec![(0..120).map(|i| if i < 100 { 1.0 } else { 0.0 }).collect()],
            reading: vec![1.0; 120],
            weight: vec![1.0; 120],
            state: (0..120).map(state).collect(),
            ..Data::default()
        }
    }

    #[test]
    fn a_feed_counts_where_more_than_a_twentieth_of_the_cuts_has_it() {
        assert_eq!(highest_feeds(&data(4)), [(2, 0.05)]);
        assert_eq!(highest_feeds(&data(6)), [(2, 0.2)]);
    }

    #[test]
    fn without_a_tool_nothing_is_known() {
        let mut unknown = data(6);
        unknown.state.iter_mut().for_each(|state| state.tool = f64::NAN);
        assert_eq!(highest_feeds(&unknown), []);
    }
}
