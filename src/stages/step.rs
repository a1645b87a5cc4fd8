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
    /// As many (x, y, z) as the layout of the batch asks for.
    Of(fn(&Frame) -> [u32; 3]),
    /// As many as the list's header of that name asks for when the step runs.
    Listed(&'static str),
}

/// A stage with its place in the chain.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The shader with its bindings.
    pub stage: &'static Stage,
    /// The same arithmetic on the CPU.
    pub twin: Twin,
    /// What is bound, by the names of [`super::chain::table`].
    pub binds: &'static [&'static str],
    /// Workgroups, in its usual place.
    pub groups: Groups,
    /// How far the GPU and the twin may be apart.
    pub same: Same,
}
