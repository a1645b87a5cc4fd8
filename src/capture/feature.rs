//! In: what a camera lets be set. Out: its names, values, units and ranges.
//! Frame and unit: as the GenICam Standard Features Naming Convention has them: ExposureTime in us, Gain in dB,
//! lengths in px.

/// What a feature can be.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A whole number.
    Integer(i64),
    /// A number.
    Float(f64),
    /// Yes or no.
    Boolean(bool),
    /// A word: one of a list, or free.
    Word(String),
    /// Something that is done, not a value.
    Command,
}

/// What a feature may be set to.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Range {
    /// From, to, both included.
    Between(f64, f64),
    /// One of these.
    OneOf(Vec<String>),
    /// Not known, or anything.
    Any,
}

/// One setting of a camera.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Feature {
    /// By the naming convention, e.g. `ExposureTime`.
    pub name: String,
    /// What it is now; none where it cannot be read.
    pub value: Option<Value>,
    /// `us`, `dB`, `px`, `Hz`; empty where it has none.
    pub unit: String,
    /// What it can be set to.
    pub range: Range,
    /// Whether it can be set now.
    pub writable: bool,
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Integer(v) => write!(f, "{v}"),
            Value::Float(v) => write!(f, "{v}"),
            Value::Boolean(v) => write!(f, "{v}"),
            Value::Word(v) => f.write_str(v),
            Value::Command => f.write_str("(command)"),
        }
    }
}

impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Range::Between(low, high) => write!(f, "{low} to {high}"),
            Range::OneOf(words) => f.write_str(&words.join(", ")),
            Range::Any => Ok(()),
        }
    }
}
