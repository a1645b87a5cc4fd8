//! Tests of compute shaders written in WGSL, on software Vulkan and on real GPUs.
//!
//! A [`Stage`] is the text of a shader together with what the Rust side believes of it: entry point, workgroup size,
//! bindings, layouts, overrides. A [`Pair`] adds the CPU twin, which is the same arithmetic in Rust, and named
//! [`Case`]s. The kit then does three things, each alone or all with [`Pair::run`]:
//!
//! 1. [`Pair::check`] reads the shader with naga and compares it with what the stage declares. It needs no device.
//! 2. [`Pair::compare`] runs every case on a [`Device`] and on the twin. Every word of every writable binding must
//!    agree within its [`Tolerance`], and every tolerance has a written reason.
//! 3. [`Pair::mutate`] changes one operator or constant of the shader at a time. The cases must notice each change;
//!    a mutant that they do not notice is listed with its line and column.
//!
//! A [`Report`] holds the outcomes and writes them as JUnit XML and as Markdown.
//!
//! ```no_run
//! use shader_twin::{Binding, Case, Device, Pair, Shape, Stage, Tolerance, Wanted};
//!
//! let text = "@group(0) @binding(0) var<storage, read_write> words: array<u32>;
//!     @compute @workgroup_size(64)
//!     fn main(@builtin(global_invocation_id) id: vec3<u32>) {
//!         if id.x < arrayLength(&words) { words[id.x] = words[id.x] * 3u; }
//!     }";
//! let words = Binding::read_write("words", Shape::array::<u32>(), Tolerance::exact("whole numbers"));
//! let pair = Pair::new(
//!     Stage::new("triple", text, "main", [64, 1, 1], vec![words]),
//!     |bindings, _| bindings[0].get_mut::<u32>().iter_mut().for_each(|word| *word *= 3),
//!     vec![Case::new("a hundred", [2, 1, 1]).with(&(0..100).collect::<Vec<u32>>())],
//! );
//! let device = Device::open(&Wanted::from_env()?)?;
//! let outcome = pair.run(&device);
//! assert!(outcome.passed(), "{outcome}");
//! # Ok::<(), shader_twin::Error>(())
//! ```
//!
//! Units: sizes and offsets are bytes, times are seconds, lines and columns count from 1, columns in characters.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod case;
mod compare;
mod contract;
mod device;
mod error;
mod layout;
mod mutants;
mod pair;
mod report;
mod stage;
mod tolerance;
mod words;

pub use case::Case;
pub use compare::{CaseResult, Comparison, Worst};
pub use device::{Adapter, Device, Wanted, adapters};
pub use error::{Error, Kind, Result};
#[doc(hidden)]
pub use layout::field_bytes;
pub use layout::{Field, Layout, Shape};
pub use mutants::{Explained, Mutant, Mutants};
pub use pair::Pair;
pub use report::{Outcome, Report};
pub use stage::{Access, Binding, Stage};
pub use tolerance::Tolerance;
pub use words::Words;
