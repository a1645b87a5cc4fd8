#![doc = include_str!("../README.md")]
//!
//! # The parts
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
