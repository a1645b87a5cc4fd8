//! In: a number and its limit. Out: a gate of an insertion or of a motion: passed or not, and what it means.
//! Frame and unit: each gate names its own.

/// One gate: a measured value and its limit.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Gate {
    /// Name of the judged quantity as messages print it, with its unit where it has a unit.
    pub name: &'static str,
    /// The measured value, in the gate's unit.
    pub value: f64,
    /// The limit, in the same unit.
    pub limit: f64,
    /// True if the value keeps the limit.
    pub passed: bool,
}

impl Gate {
    /// A gate that passes values of at least `limit`.
    pub fn least(name: &'static str, value: f64, limit: f64) -> Gate {
        Gate { name, value, limit, passed: value >= limit }
    }
    /// A gate that passes values of at most `limit`.
    pub fn most(name: &'static str, value: f64, limit: f64) -> Gate {
        Gate { name, value, limit, passed: value <= limit }
    }
    /// A sentence with the value and the limit.
    pub fn words(&self) -> String {
        format!("{} is {:.3}, limit {:.3}", self.name, self.value, self.limit)
    }
}
