//! The text of a certificate. In: what it says. Out: lines of words as [`crate::certify::text`] describes and reads them.

use std::fmt::Write;

use crate::certify::Certificate;
use crate::certify::cutter::Part;
use crate::certify::place::Arc;
use crate::certify::text::{HEAD, MovePart, Station, sha256};

/// The text of a certificate.
pub fn write(of: &Certificate) -> String {
    let mut text = format!("{HEAD}\n{}\n", of.given.join("\n"));
    for (tool, parts) in &of.parts {
        for Part { segment, from, to } in parts {
            let _ = writeln!(text, "part {tool} {segment} {from:?} {to:?}");
        }
    }
    for motion in &of.moves {
        let MovePart { index, line, tool, rps, feed_mm_s, stations } = motion;
        let _ = writeln!(text, "move {index} {line} {tool} {rps:?} {feed_mm_s:?}");
        for station in stations {
            write_station(&mut text, station);
        }
    }
    let seal = sha256(text.as_bytes());
    text + &format!("sealed {seal}\n")
}

fn write_station(text: &mut String, of: &Station) {
    let [from, to] = of.over_mm;
    let _ = write!(text, "station {from:?} {to:?}");
    for bound in of.enclosures {
        let _ = write!(text, " {:?} {:?}", bound.lo, bound.hi);
    }
    for Arc { ring, entry, exit } in &of.arcs {
        let _ = write!(text, " {ring} {entry:?} {exit:?}");
    }
    text.push('\n');
}
