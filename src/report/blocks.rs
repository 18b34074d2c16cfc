//! The blocks of a program for `--json-blocks`. In: a run. Out: one record per block that moves at feed.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use std::borrow::Cow;

use super::table::LOADS;
use crate::force::Loads;
use crate::machine::LimitKind;
use crate::nc::MoveKind;
use crate::outcome::ProgramRun;
use crate::outcome::station_loads::{StationLoads, each_station};
use crate::schedule::FeedPiece;
use crate::units::mm_min_from_mm_s;

/// A block with what it did before and after. Feeds are the highest of its pieces, mm/min; loads the largest.
#[derive(Debug, Serialize, JsonSchema)]
pub struct BlockRow {
    line: u32,
    motion: usize,
    length_mm: f64,
    feed_before: f64,
    feed_after: f64,
    realised_before: f64,
    realised_after: f64,
    active_limit: &'static str,
    price_s: f64,
    before: Largest,
    after: Largest,
}

/// The largest of every load.
#[derive(Debug, Clone, Copy, Default)]
struct Largest([f64; LOADS.len()]);

impl Largest {
    fn take(&mut self, loads: &Loads) {
        for (largest, (_, read)) in self.0.iter_mut().zip(LOADS) {
            *largest = largest.max(read(loads));
        }
    }
}

impl Serialize for Largest {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(LOADS.len()))?;
        for (value, (name, _)) in self.0.iter().zip(LOADS) {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

impl JsonSchema for Largest {
    fn schema_name() -> Cow<'static, str> {
        "Loads".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let number = generator.subschema_for::<f64>();
        let names: Vec<&str> = LOADS.iter().map(|(name, _)| *name).collect();
        let each: serde_json::Map<_, _> =
            names.iter().map(|name| ((*name).to_owned(), number.clone().to_value())).collect();
        json_schema!({ "type": "object", "properties": each, "required": names })
    }
}

/// Every feed motion of the original program, in order.
pub fn blocks(run: &ProgramRun) -> Vec<BlockRow> {
    let mut rows: Vec<Option<BlockRow>> =
        run.toolpath.moves.iter().enumerate().map(|(index, _)| row(run, index)).collect();
    fill_feeds(&mut rows, run);
    each_station(run, &mut |found: &StationLoads| {
        if let Some(row) = &mut rows[found.station.move_id.ix()] {
            row.before.take(&found.before);
            row.after.take(&found.after);
        }
    });
    rows.into_iter().flatten().collect()
}

fn row(run: &ProgramRun, index: usize) -> Option<BlockRow> {
    let motion = &run.toolpath.moves[index];
    if motion.kind == MoveKind::Rapid {
        return None;
    }
    let length_mm = motion.curve().length();
    let speed = |seconds: Option<&f64>| seconds.filter(|s| **s > 0.0).map_or(0.0, |s| mm_min_from_mm_s(length_mm / s));
    Some(BlockRow {
        line: motion.line,
        motion: index,
        length_mm,
        feed_before: mm_min_from_mm_s(motion.feed.mm_s),
        feed_after: 0.0,
        realised_before: speed(run.realised_before.move_s.get(index)),
        realised_after: speed(run.realised_after().move_s.get(index)),
        active_limit: LimitKind::Programmed.name(),
        price_s: 0.0,
        before: Largest::default(),
        after: Largest::default(),
    })
}

/// Highest feed after, and the limit and price of the piece that takes longest.
fn fill_feeds(rows: &mut [Option<BlockRow>], run: &ProgramRun) {
    for piece in run.after() {
        if let Some(row) = &mut rows[piece.move_id.ix()] {
            row.feed_after = row.feed_after.max(mm_min_from_mm_s(piece.feed_mm_s));
        }
    }
    let mut longest = vec![0.0; rows.len()];
    for piece in run.written.iter().flat_map(|written| &written.schedule.pieces) {
        let seconds = time_s(piece);
        if let Some(row) = &mut rows[piece.move_id.ix()] {
            row.price_s += piece.price_s;
            if seconds >= longest[piece.move_id.ix()] {
                longest[piece.move_id.ix()] = seconds;
                row.active_limit = piece.limit.name();
            }
        }
    }
}

fn time_s(piece: &FeedPiece) -> f64 {
    piece.time_s(piece.to_mm - piece.from_mm)
}
