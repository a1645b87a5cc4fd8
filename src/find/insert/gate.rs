//! In: a number and its limit. Out: a gate of an insertion: passed or not, and what it means.
//! Frame and unit: each gate names its own.

/// One gate: what was seen against the limit.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Gate {
    pub name: &'static str,
    pub value: f64,
    pub limit: f64,
    pub passed: bool,
}

impl Gate {
    pub fn least(name: &'static str, value: f64, limit: f64) -> Gate {
        Gate { name, value, limit, passed: value >= limit }
    }
    pub fn most(name: &'static str, value: f64, limit: f64) -> Gate {
        Gate { name, value, limit, passed: value <= limit }
    }
    /// What was missed.
    pub fn words(&self) -> String {
        format!("{} is {:.3}, limit {:.3}", self.name, self.value, self.limit)
    }
}
