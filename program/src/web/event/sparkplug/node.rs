//! In: what was last seen of bar and jobs. Out: messages of a Sparkplug node: birth, data by exception, death.
//! Frame and unit: ms since 1970.

use super::payload::{Metric, Payload, Properties, REBIRTH, Value, datatype};
use super::seen::Seen;
use super::table::ROWS;
use prost::Message;

/// Name of the metric that joins a death with its birth.
const SESSION: &str = "bdSeq";

/// A message that may be handed over.
pub struct Draft {
    /// Kind of its topic.
    pub kind: &'static str,
    /// Its payload.
    pub bytes: Vec<u8>,
    values: Vec<Option<Value>>,
    seq: u8,
}

/// What others know of the station.
#[derive(Default)]
pub struct Node {
    /// The values that they have, in the order of the rows; empty before the first birth.
    known: Vec<Option<Value>>,
    /// Number of the last message.
    seq: u8,
}

impl Node {
    /// The birth of a session: all metrics, with data types and units.
    pub fn birth(seen: &Seen, session: u8, now_ms: u64) -> Draft {
        let values: Vec<_> = ROWS.iter().map(|row| row.value(seen)).collect();
        let rebirth = metric(REBIRTH, now_ms, Some(Value::Boolean(false)));
        let mut metrics = vec![number_of(session, now_ms), Metric { datatype: Some(datatype::BOOLEAN), ..rebirth }];
        metrics.extend(ROWS.iter().zip(&values).map(|(row, value)| Metric {
            datatype: Some(row.datatype()),
            properties: Some(Properties::of(row.unit, &row.what.replace('`', ""))),
            ..metric(row.name, now_ms, value.clone())
        }));
        Draft { kind: "NBIRTH", bytes: payload(metrics, Some(0), now_ms), values, seq: 0 }
    }

    /// The values that others do not have yet; `None` if they have all.
    pub fn data(&self, seen: &Seen, now_ms: u64) -> Option<Draft> {
        let values: Vec<_> = ROWS.iter().map(|row| row.value(seen)).collect();
        let changed = ROWS.iter().zip(values.iter().zip(&self.known)).filter(|(_, (now, known))| now != known);
        let metrics: Vec<_> = changed.map(|(row, (now, _))| metric(row.name, now_ms, now.clone())).collect();
        let seq = self.seq.wrapping_add(1);
        let bytes = (!metrics.is_empty()).then(|| payload(metrics, Some(seq), now_ms))?;
        Some(Draft { kind: "NDATA", bytes, values, seq })
    }

    /// Notes that a message was handed over. Others get the values of one that was not with the next message, so that
    /// no number is missing.
    pub fn handed(&mut self, draft: Draft) {
        (self.known, self.seq) = (draft.values, draft.seq);
    }
}

/// The death of a session, which the broker publishes when the connection is lost.
pub fn death(session: u8, now_ms: u64) -> Vec<u8> {
    payload(vec![number_of(session, now_ms)], None, now_ms)
}

fn number_of(session: u8, now_ms: u64) -> Metric {
    let number = metric(SESSION, now_ms, Some(Value::Long(session.into())));
    Metric { datatype: Some(datatype::INT64), ..number }
}

fn metric(name: &str, now_ms: u64, value: Option<Value>) -> Metric {
    let (name, timestamp) = (Some(name.to_owned()), Some(now_ms));
    Metric { name, timestamp, is_null: value.is_none().then_some(true), value, ..Metric::default() }
}

fn payload(metrics: Vec<Metric>, seq: Option<u8>, now_ms: u64) -> Vec<u8> {
    Payload { timestamp: Some(now_ms), metrics, seq: seq.map(u64::from) }.encode_to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read(bytes: &[u8]) -> Payload {
        Payload::decode(bytes).unwrap()
    }

    fn named<'a>(payload: &'a Payload, name: &str) -> Option<&'a Metric> {
        payload.metrics.iter().find(|m| m.name.as_deref() == Some(name))
    }

    #[test]
    fn a_birth_has_every_metric_with_its_type_and_unit() {
        let seen = Seen { bar: json!({"robot": "moving", "disk_left_gb": 5.0}), ..Seen::default() };
        let birth = read(&Node::birth(&seen, 255, 1_700_000_000_000).bytes);
        assert_eq!(
            (birth.seq, birth.timestamp, birth.metrics.len()),
            (Some(0), Some(1_700_000_000_000), ROWS.len() + 2)
        );
        assert!(birth.metrics.iter().all(|m| m.datatype.is_some() && m.timestamp == birth.timestamp));
        assert!(birth.metrics.iter().all(|m| m.value.is_none() == (m.is_null == Some(true))));
        assert_eq!(named(&birth, "bdSeq").unwrap().value, Some(Value::Long(255)));
        assert_eq!(named(&birth, REBIRTH).unwrap().value, Some(Value::Boolean(false)));
        let free = named(&birth, "Disk/Free").unwrap();
        assert_eq!(free.properties, Some(Properties::of("B", "free on the disk that holds the jobs")));
        assert_eq!(free.value, Some(Value::Long(5_000_000_000)));
        assert_eq!(named(&birth, "Job/State").unwrap().is_null, Some(true));
    }

    #[test]
    fn data_has_what_changed_and_no_number_is_missing() {
        let (mut node, mut seen) = (Node::default(), Seen::default());
        node.handed(Node::birth(&seen, 0, 1));
        assert!(node.data(&seen, 2).is_none());
        let mut numbers = Vec::new();
        for viewers in 0..600 {
            seen.bar = json!({"viewers": viewers, "laser": viewers % 2 == 0});
            let draft = node.data(&seen, 3).unwrap();
            let data = read(&draft.bytes);
            assert!(data.metrics.iter().all(|m| m.datatype.is_none() && m.properties.is_none()));
            // After one that was not handed over the laser is as others know it.
            assert_eq!(data.metrics.len(), if viewers % 3 == 2 { 1 } else { 2 });
            // One of three is not handed over: what it had comes with the next one.
            if viewers % 3 != 1 {
                numbers.push(data.seq.unwrap());
                node.handed(draft);
                assert!(node.data(&seen, 3).is_none());
            }
        }
        assert!(numbers.iter().enumerate().all(|(k, seq)| *seq == (k as u64 + 1) % 256), "{numbers:?}");
        // What is no longer known is said to be null.
        seen.bar = json!({"viewers": 599});
        let data = read(&node.data(&seen, 4).unwrap().bytes);
        assert_eq!((data.metrics.len(), named(&data, "Laser/On").unwrap().is_null), (1, Some(true)));
        // A birth counts from 0 again.
        node.handed(Node::birth(&seen, 1, 5));
        seen.bar = json!({"viewers": 1});
        assert_eq!(read(&node.data(&seen, 6).unwrap().bytes).seq, Some(1));
    }

    #[test]
    fn a_death_has_its_session_and_no_number_of_its_own() {
        let death = read(&death(9, 5));
        assert_eq!((death.seq, death.metrics.len()), (None, 1));
        assert_eq!(named(&death, "bdSeq").unwrap().value, Some(Value::Long(9)));
    }
}
