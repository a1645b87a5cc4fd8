//! In: the settings that a camera offers. Out: their names, values, units and ranges.
//! Frame and unit: those of the GenICam Standard Features Naming Convention: ExposureTime in us, Gain in dB, lengths
//! in px.

/// Value of a feature.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A whole number.
    Integer(i64),
    /// A floating-point number.
    Float(f64),
    /// True or false.
    Boolean(bool),
    /// A word: one of a list, or free text.
    Word(String),
    /// An action, which has no value.
    Command,
}

/// Values that a feature accepts.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Range {
    /// Lowest and highest value, both included.
    Between(f64, f64),
    /// One of these words.
    OneOf(Vec<String>),
    /// Unknown, or unrestricted.
    Any,
}

/// One setting of a camera.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Feature {
    /// Name by the naming convention, e.g. `ExposureTime`.
    pub name: String,
    /// Present value; none if it cannot be read.
    pub value: Option<Value>,
    /// `us`, `dB`, `px`, `Hz`; empty if it has none.
    pub unit: String,
    /// Values that it accepts.
    pub range: Range,
    /// Whether it can be set at present.
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
