//! In: a height map or a cloud of a finished scan, selected points. Out: sections, distances, and points to view.
//! Frame and unit: grid frame, mm; each value with its standard deviation.

mod fit;
mod look;
mod measure;
mod section;
mod view;

pub use look::{Looked, Maps};
pub use measure::measure;
pub use section::section;
pub use view::view;
