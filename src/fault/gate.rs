//! In: a number and its limit. Out: a gate of an insertion or of a motion: passed or not, and what it means.
//! Frame and unit: each gate names its own.

/// One gate: what was seen against the limit.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Gate {
    /// What is judged, as messages call it; the unit stands in it where there is one.
    pub name: &'static str,
    /// What was seen, in the gate's unit.
    pub value: f64,
    /// What it is held against, in the same unit.
    pub limit: f64,
    /// True where the value keeps the limit.
    pub passed: bool,
}

impl Gate {
    /// A gate that passes values of `limit` and above.
    pub fn least(name: &'static str, value: f64, limit: f64) -> Gate {
        Gate { name, value, limit, passed: value >= limit }
    }
    /// A gate that passes values up to `limit`.
    pub fn most(name: &'static str, value: f64, limit: f64) -> Gate {
        Gate { name, value, limit, passed: value <= limit }
    }
    /// What was missed.
    pub fn words(&self) -> String {
        format!("{} is {:.3}, limit {:.3}", self.name, self.value, self.limit)
    }
}
