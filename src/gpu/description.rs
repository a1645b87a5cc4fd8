//! In: nothing. Out: the description of a stage: its text, its bindings, the fields of its uniform block. Frame and
//! unit: bytes.

/// How a stage uses a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The stage's uniform block.
    Uniform,
    /// A read-only storage buffer.
    Read,
    /// A read-only array of `u32`, `vec2<u32>` or `vec4<u32>` that is bound whole; it is read as texels on adapters
    /// where that is faster.
    Texels,
    /// A storage buffer that the stage may write.
    ReadWrite,
}

/// One binding of group 0; its index in `Stage::bindings` is its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// The WGSL variable's name.
    pub name: &'static str,
    /// What the stage does with it.
    pub access: Access,
}

/// One member of a uniform block: WGSL name and byte offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The WGSL member's name.
    pub name: &'static str,
    /// Bytes from the block's start.
    pub offset: usize,
}

/// One shader with one entry point `main`. The shared texts are appended after the stage's own text, so that line
/// numbers in messages are those of its file.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// The stage's file is shaders/NAME.wgsl.
    pub name: &'static str,
    /// WGSL text of that file.
    pub wgsl: &'static str,
    /// WGSL texts of shaders/shared, in the order in which they are appended.
    pub shared: &'static [&'static str],
    /// Invocations in one workgroup: x, y, z.
    pub workgroup: [u32; 3],
    /// All bindings of group 0, in the order of their numbers.
    pub bindings: &'static [Binding],
    /// The uniform struct's WGSL name, members and size in bytes; every `Access::Uniform` binding has this type.
    pub uniform: (&'static str, &'static [Field], usize),
    /// Names of the `override` constants, which select a variant when the pipeline is built.
    pub overrides: &'static [&'static str],
}

impl Stage {
    /// Stage text with the shared texts after it.
    pub fn source(&self) -> String {
        std::iter::once(self.wgsl).chain(self.shared.iter().copied()).collect::<Vec<_>>().join("\n")
    }

    /// Workgroups that cover `invocations` in each direction.
    pub fn groups(&self, invocations: [u32; 3]) -> [u32; 3] {
        std::array::from_fn(|i| invocations[i].div_ceil(self.workgroup[i]))
    }
}
