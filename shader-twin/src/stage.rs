//! In: what the Rust side believes of a shader. Out: the stage, which the contract compares with the WGSL text.

use crate::layout::Shape;
use crate::tolerance::Tolerance;

/// How a shader uses a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `var<uniform>`
    Uniform,
    /// `var<storage, read>`
    Read,
    /// `var<storage, read_write>`
    ReadWrite,
}

impl Access {
    /// As WGSL writes it.
    pub fn wgsl(self) -> &'static str {
        match self {
            Access::Uniform => "var<uniform>",
            Access::Read => "var<storage, read>",
            Access::ReadWrite => "var<storage, read_write>",
        }
    }
}

/// One buffer of a stage.
#[derive(Clone, Debug)]
pub struct Binding {
    /// The name of the WGSL variable.
    pub name: String,
    /// How the shader uses it.
    pub access: Access,
    /// What it holds.
    pub shape: Shape,
    /// Group and binding number, where they are not group 0 and the position in the stage's list.
    pub place: Option<(u32, u32)>,
    /// How far apart the two results may be. Only writable bindings have one.
    pub tolerance: Option<Tolerance>,
    /// Fields of the elements whose tolerance is another.
    pub fields: Vec<(String, Tolerance)>,
}

impl Binding {
    fn new(name: &str, access: Access, shape: Shape, tolerance: Option<Tolerance>) -> Binding {
        Binding { name: name.into(), access, shape, place: None, tolerance, fields: Vec::new() }
    }

    /// A uniform block.
    pub fn uniform(name: &str, shape: Shape) -> Binding {
        Binding::new(name, Access::Uniform, shape, None)
    }

    /// A storage buffer that the shader only reads.
    pub fn read(name: &str, shape: Shape) -> Binding {
        Binding::new(name, Access::Read, shape, None)
    }

    /// A storage buffer that the shader writes. All its words are compared after each case.
    pub fn read_write(name: &str, shape: Shape, tolerance: Tolerance) -> Binding {
        Binding::new(name, Access::ReadWrite, shape, Some(tolerance))
    }

    /// Puts it at another place than group 0 and its position in the stage's list.
    pub fn at(mut self, group: u32, number: u32) -> Binding {
        self.place = Some((group, number));
        self
    }

    /// Gives one field of the layout another tolerance. The contract refuses a name that the layout does not have.
    pub fn field(mut self, name: &str, tolerance: Tolerance) -> Binding {
        self.fields.push((name.into(), tolerance));
        self
    }
}

/// A compute shader and what the Rust side believes of it.
#[derive(Clone, Debug)]
pub struct Stage {
    /// For reports.
    pub name: String,
    /// The text of the shader.
    pub wgsl: String,
    /// The name of the compute function.
    pub entry: String,
    /// Invocations of one workgroup: x, y, z.
    pub workgroup: [u32; 3],
    /// The buffers, in the order in which cases and twin have them.
    pub bindings: Vec<Binding>,
    /// Names of all override constants of the shader.
    pub overrides: Vec<String>,
}

impl Stage {
    /// A stage without override constants.
    pub fn new(name: &str, wgsl: &str, entry: &str, workgroup: [u32; 3], bindings: Vec<Binding>) -> Stage {
        Stage { name: name.into(), wgsl: wgsl.into(), entry: entry.into(), workgroup, bindings, overrides: vec![] }
    }

    /// Names the override constants of the shader: all of them, in any order.
    pub fn overrides(mut self, names: &[&str]) -> Stage {
        self.overrides = names.iter().map(|n| (*n).to_owned()).collect();
        self
    }

    /// Group and number of the binding at this position of the list.
    pub(crate) fn place(&self, position: usize) -> (u32, u32) {
        self.bindings[position].place.unwrap_or((0, position as u32))
    }
}
