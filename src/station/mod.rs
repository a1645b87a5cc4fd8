//! In: a station folder, recordings, options. Out: the product's procedures from top to bottom.
//! Frame and unit: millimetres; each file names its frames.

mod settings;
mod values;

pub use settings::{Settings, WorkingVolume};
pub use values::Values;
