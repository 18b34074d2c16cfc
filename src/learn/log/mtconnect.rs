//! MTConnect streams, the response of an agent: XML with `Samples` and `Events`, each value an element with
//! `timestamp`, `dataItemId`, `name` and `subType` (MTConnect Standard, part 3, streams). In: bytes. Out: columns, one
//! row per time stamp. By the standard positions are in mm and path feeds in mm/s.

use super::columns::{DataError, Frame};
use super::layout::number;
use super::on_change::Changes;
use super::stamps::stamp_s;
use quick_xml::events::{BytesStart, Event};

/// Is a file the response of an agent?
pub fn is_streams(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(4096)];
    memchr::memmem::find(head, b"<MTConnectStreams").is_some()
}

/// The value of an open element: its time, possible names, and factor to our unit.
struct Item {
    stamp_s: f64,
    names: Vec<String>,
    factor: f64,
}

/// The response of an agent as columns.
pub fn streams(bytes: &[u8], mapping: &[(String, String)]) -> Result<Frame, DataError> {
    let text = String::from_utf8_lossy(bytes);
    let mut reader = quick_xml::Reader::from_str(&text);
    let (mut changes, mut component, mut open) = (Changes::default(), String::new(), None);
    loop {
        let event = reader.read_event();
        let place = reader.buffer_position();
        match event.map_err(|error| DataError::Unreadable(format!("the XML is not valid at byte {place}: {error}")))? {
            Event::Start(element) if element.local_name().as_ref() == "ComponentStream" => {
                component = attribute(&element, "name").unwrap_or_default();
            }
            Event::Start(element) => open = item(&element, &component),
            Event::Text(text) => {
                let value = number(text.trim(), false);
                if let Some((item, value)) = open.as_ref().zip(value) {
                    let Item { stamp_s, names, factor } = item;
                    let names: Vec<&str> = names.iter().map(String::as_str).collect();
                    changes.note(*stamp_s, &names, value, *factor, mapping);
                }
            }
            Event::End(_) => open = None,
            Event::Eof => break,
            _ => {}
        }
    }
    changes.sort();
    changes.held()
}

fn attribute(element: &BytesStart, name: &str) -> Option<String> {
    let found = element.attributes().flatten().find(|attribute| attribute.key.local_name().as_ref() == name)?;
    Some(found.value.into_owned())
}

/// The value of an element: its own names first, then its kind. A load is that of a spindle or axis by its component.
fn item(element: &BytesStart, component: &str) -> Option<Item> {
    let stamp_s = stamp_s(&attribute(element, "timestamp")?)?;
    let kind = element.local_name().as_ref().to_owned();
    let actual = attribute(element, "subType")
        .is_none_or(|kind| !matches!(kind.as_str(), "COMMANDED" | "PROGRAMMED" | "TARGET"));
    let mut names: Vec<String> = ["name", "dataItemId"].into_iter().filter_map(|key| attribute(element, key)).collect();
    let spindle = ["S", "S1", "C"].contains(&component) || component.to_lowercase().contains("spindle");
    let axis = component.to_lowercase();
    match kind.as_str() {
        "Load" if spindle => names.push("spindle_load".into()),
        "Load" if matches!(axis.as_str(), "x" | "y" | "z") => names.push(format!("{axis}_load_percent")),
        "Position" if actual && matches!(axis.as_str(), "x" | "y" | "z") => names.push(format!("{axis}pos")),
        "PathFeedrate" if actual => names.push("path_feedrate".into()),
        _ => names.push(kind.clone()),
    }
    // Path feed: mm/s to mm/min. Overrides are events in percent.
    let factor = if kind == "PathFeedrate" { 60.0 } else { 1.0 };
    Some(Item { stamp_s, names, factor })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_agents_answer_is_a_log() {
        let text = r#"<?xml version="1.0"?><MTConnectStreams xmlns="urn:mtconnect.org:MTConnectStreams:1.3"><Streams><DeviceStream name="VMC">
            <ComponentStream component="Linear" name="X"><Samples>
              <Position dataItemId="x1" timestamp="2026-01-02T10:00:00.0Z" sequence="1" subType="ACTUAL">10.5</Position>
              <Position dataItemId="x1" timestamp="2026-01-02T10:00:00.2Z" sequence="4" subType="ACTUAL">11.5</Position>
            </Samples></ComponentStream>
            <ComponentStream component="Rotary" name="S"><Samples>
              <Load dataItemId="s9" timestamp="2026-01-02T10:00:00.1Z" sequence="2">33</Load>
              <RotaryVelocity dataItemId="s2" timestamp="2026-01-02T10:00:00.0Z" sequence="3">8000</RotaryVelocity>
            </Samples></ComponentStream>
            <ComponentStream component="Path" name="path"><Samples>
              <PathFeedrate dataItemId="p1" timestamp="2026-01-02T10:00:00.0Z" sequence="5">10</PathFeedrate>
            </Samples><Events><Line dataItemId="l" timestamp="2026-01-02T10:00:00.1Z" sequence="6">UNAVAILABLE</Line></Events></ComponentStream>
            </DeviceStream></Streams></MTConnectStreams>"#;
        assert!(is_streams(text.as_bytes()));
        let frame = streams(text.as_bytes(), &[]).unwrap();
        assert_eq!(frame.rows, 3);
        assert_eq!(frame.numbers("x_mm").unwrap(), [10.5, 10.5, 11.5]);
        assert_eq!(frame.numbers("feed_mm_min").unwrap(), [600.0, 600.0, 600.0]);
        assert_eq!(frame.numbers("spindle_rpm").unwrap()[2], 8000.0);
        let load = frame.numbers("spindle_load_percent").unwrap();
        assert!(load[0].is_nan() && load[1] == 33.0);
        assert!(streams(b"<MTConnectStreams><a", &[]).is_err());
    }
}
