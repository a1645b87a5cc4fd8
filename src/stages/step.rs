//! In: nothing. Out: the types with which a stage is described once, for recording, for the run on the twins and for
//! the tests. Frame and unit: words of the stage's bindings.

use super::frame::Frame;
use super::same::Same;
use crate::gpu::Stage;

/// A stage's arithmetic on the CPU: changes the bindings in place; the first is the uniform block.
pub type Twin = fn(bindings: &mut [Vec<u32>], overrides: &[(&'static str, f64)]);

/// The number of workgroups.
#[derive(Clone, Copy, Debug)]
pub enum Groups {
    /// A number (x, y, z) that follows from the layout of the batch.
    Of(fn(&Frame) -> [u32; 3]),
    /// The number in the header of the list with that name, when the step runs.
    Listed(&'static str),
}

/// A stage with its usual place in the chain.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The shader with its bindings.
    pub stage: &'static Stage,
    /// The same arithmetic on the CPU.
    pub twin: Twin,
    /// The buffers that are bound, by the names in [`super::chain::table`].
    pub binds: &'static [&'static str],
    /// Number of workgroups at its usual place.
    pub groups: Groups,
    /// How much the GPU and the twin may differ.
    pub same: Same,
}
