//! In: metrics. Out: payloads of Sparkplug B 3.0 in Protocol Buffers, and back.
//! Frame and unit: ms since 1970.
//!
//! Field numbers are those of the published `org.eclipse.tahu.protobuf.Payload`. Only the fields that this program
//! writes or reads are declared; others are skipped when a command is read.

use prost::{Message, Oneof};

/// Numbers of the data types that are used here.
pub mod datatype {
    pub const INT64: u32 = 4;
    pub const DOUBLE: u32 = 10;
    pub const BOOLEAN: u32 = 11;
    pub const STRING: u32 = 12;
}

/// A payload.
#[derive(Clone, PartialEq, Message)]
pub struct Payload {
    /// When the message was made.
    #[prost(uint64, optional, tag = "1")]
    pub timestamp: Option<u64>,
    /// The metrics.
    #[prost(message, repeated, tag = "2")]
    pub metrics: Vec<Metric>,
    /// Number of the message since the last birth, modulo 256.
    #[prost(uint64, optional, tag = "3")]
    pub seq: Option<u64>,
}

/// A metric with its value.
#[derive(Clone, PartialEq, Message)]
pub struct Metric {
    /// Levels are separated by `/`.
    #[prost(string, optional, tag = "1")]
    pub name: Option<String>,
    /// When the value was read.
    #[prost(uint64, optional, tag = "3")]
    pub timestamp: Option<u64>,
    /// One of `datatype`.
    #[prost(uint32, optional, tag = "4")]
    pub datatype: Option<u32>,
    /// The value is unknown.
    #[prost(bool, optional, tag = "7")]
    pub is_null: Option<bool>,
    /// Such as the unit.
    #[prost(message, optional, tag = "9")]
    pub properties: Option<Properties>,
    /// The value.
    #[prost(oneof = "Value", tags = "11, 13, 14, 15")]
    pub value: Option<Value>,
}

/// A value.
#[derive(Clone, PartialEq, Oneof)]
pub enum Value {
    /// An Int64, as its two's complement.
    #[prost(uint64, tag = "11")]
    Long(u64),
    /// A Double.
    #[prost(double, tag = "13")]
    Double(f64),
    /// A Boolean.
    #[prost(bool, tag = "14")]
    Boolean(bool),
    /// A String.
    #[prost(string, tag = "15")]
    Text(String),
}

/// Properties of a metric: names, and as many values.
#[derive(Clone, PartialEq, Message)]
pub struct Properties {
    /// The names.
    #[prost(string, repeated, tag = "1")]
    pub keys: Vec<String>,
    /// Their values.
    #[prost(message, repeated, tag = "2")]
    pub values: Vec<Property>,
}

/// Value of a property.
#[derive(Clone, PartialEq, Message)]
pub struct Property {
    /// One of `datatype`.
    #[prost(uint32, optional, tag = "1")]
    pub datatype: Option<u32>,
    /// The text.
    #[prost(string, optional, tag = "8")]
    pub text: Option<String>,
}

impl Properties {
    /// Unit and description of a metric, by the names that host applications know; without unit if it has none.
    pub fn of(unit: &str, what: &str) -> Properties {
        let all = [("engUnit", unit), ("documentation", what)].into_iter().filter(|(_, text)| !text.is_empty());
        let value = |text: &str| Property { datatype: Some(datatype::STRING), text: Some(text.to_owned()) };
        let (keys, values) = all.map(|(key, text)| (key.to_owned(), value(text))).unzip();
        Properties { keys, values }
    }
}

/// Name of the only command.
pub const REBIRTH: &str = "Node Control/Rebirth";
/// Longest command that is read, bytes. A real one has 60; metrics take far more memory than bytes.
const LONGEST: usize = 64 << 10;

/// Whether a command asks for a new birth. Everything else orders nothing.
pub fn asks_for_birth(bytes: &[u8]) -> bool {
    let asks = |m: &Metric| m.name.as_deref() == Some(REBIRTH) && m.value == Some(Value::Boolean(true));
    bytes.len() <= LONGEST && Payload::decode(bytes).is_ok_and(|payload| payload.metrics.iter().any(asks))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Written by hand from the published field numbers.
    #[test]
    fn a_payload_has_the_bytes_of_the_specification() {
        let metric = |name: &str, value| Metric { name: Some(name.into()), value: Some(value), ..Metric::default() };
        let unit = Metric { properties: Some(Properties::of("mm", "")), ..metric("a", Value::Double(1.0)) };
        let metrics = vec![unit, metric("b", Value::Long(-1_i64 as u64))];
        let payload = Payload { timestamp: Some(300), metrics, seq: Some(7) };
        let mut wanted = vec![0x08, 0xac, 0x02];
        wanted.extend([0x12, 31, 0x0a, 1, b'a', 0x4a, 17, 0x0a, 7]);
        wanted.extend(b"engUnit");
        wanted.extend([0x12, 6, 0x08, 12, 0x42, 2, b'm', b'm', 0x69, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
        wanted.extend([0x12, 14, 0x0a, 1, b'b', 0x58]);
        wanted.extend([0xff; 9]);
        wanted.extend([0x01, 0x18, 7]);
        assert_eq!(payload.encode_to_vec(), wanted);
    }

    #[test]
    fn only_a_rebirth_is_a_command() {
        let command = |name: &str, value: Option<Value>| {
            let metric = Metric { name: Some(name.into()), value, ..Metric::default() };
            Payload { metrics: vec![metric], ..Payload::default() }.encode_to_vec()
        };
        let yes = command(REBIRTH, Some(Value::Boolean(true)));
        assert!(asks_for_birth(&yes));
        for (name, value) in [
            (REBIRTH, None),
            (REBIRTH, Some(Value::Boolean(false))),
            (REBIRTH, Some(Value::Long(1))),
            (REBIRTH, Some(Value::Text("true".into()))),
            ("Node Control/Reboot", Some(Value::Boolean(true))),
            ("Robot/Armed", Some(Value::Boolean(true))),
        ] {
            assert!(!asks_for_birth(&command(name, value.clone())), "{name} {value:?}");
        }
        // Cut off, or too long although the command is in it.
        assert!((0..yes.len()).all(|end| !asks_for_birth(&yes[..end])));
        let long: Vec<u8> = yes.iter().copied().cycle().take(yes.len() * (1 + LONGEST / yes.len())).collect();
        assert!(!asks_for_birth(&long));
    }
}
