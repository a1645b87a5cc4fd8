//! In: a station folder, recordings, options. Out: the product's procedures from top to bottom.
//! Frame and unit: millimetres; each file names its frames.

mod judge;
mod page;
mod products;
mod progress;
mod run;
mod settings;
mod values;

pub use judge::{Judged, judge};
pub use run::{HeightMapFigures, ScanOptions, ScanReport, cloud_of, load_report, scan};
pub use settings::{Settings, WorkingVolume};
pub use values::Values;
