//! In: a height map or a cloud of a finished scan, places a person pointed at. Out: sections, distances and points to
//! look at.
//! Frame and unit: grid frame, mm; each number with its standard deviation.

mod fit;
mod look;
mod measure;
mod pins;
mod section;
mod view;

pub use look::{Looked, Maps};
pub use measure::measure;
pub use pins::between_pins;
pub use section::section;
pub use view::view;
