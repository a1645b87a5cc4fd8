//! In: a name and values. Out: one input of a stage.

use crate::words::Words;
use bytemuck::NoUninit;

/// One named input of a stage.
#[derive(Clone, Debug)]
pub struct Case {
    /// What the input shows, for reports.
    pub name: String,
    /// Workgroups of the dispatch: x, y, z.
    pub groups: [u32; 3],
    /// The content of each binding before the dispatch, in the stage's order.
    pub bindings: Vec<Words>,
    /// Values of override constants: name, value.
    pub overrides: Vec<(String, f64)>,
}

impl Case {
    /// A case without bindings, which are added in the stage's order.
    pub fn new(name: &str, groups: [u32; 3]) -> Case {
        Case { name: name.into(), groups, bindings: Vec::new(), overrides: Vec::new() }
    }

    /// The next binding's content.
    pub fn with<T: NoUninit>(mut self, values: &[T]) -> Case {
        self.bindings.push(Words::of(values));
        self
    }

    /// The next binding's content: this many words of zeros.
    pub fn zeros(mut self, words: usize) -> Case {
        self.bindings.push(Words::zeros(words));
        self
    }

    /// Sets an override constant.
    pub fn set(mut self, name: &str, value: f64) -> Case {
        self.overrides.push((name.into(), value));
        self
    }

    /// The value that the case gives to an override constant.
    pub fn constant(&self, name: &str) -> Option<f64> {
        self.overrides.iter().find(|(n, _)| n == name).map(|(_, value)| *value)
    }
}
