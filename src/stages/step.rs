//! In: nothing. Out: what is stated of a stage once and read by whoever records, walks or checks it.
//! Frame and unit: words of the stage's bindings.

use super::frame::Frame;
use super::same::Same;
use crate::gpu::Stage;

/// A stage's arithmetic on the CPU: changes the bindings in place, the uniform block is the first.
pub type Twin = fn(bindings: &mut [Vec<u32>], overrides: &[(&'static str, f64)]);

/// How many workgroups run.
#[derive(Clone, Copy, Debug)]
pub enum Groups {
    Of(fn(&Frame) -> [u32; 3]),
    /// As many as the list's header of that name asks for when the step runs.
    Listed(&'static str),
}

/// A stage with its place in the chain.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    pub stage: &'static Stage,
    pub twin: Twin,
    /// What is bound, by the names of [`super::chain::table`].
    pub binds: &'static [&'static str],
    pub groups: Groups,
    pub same: Same,
}
