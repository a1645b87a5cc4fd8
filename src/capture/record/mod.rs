//! In: shots of a running camera. Out: a recording that can be opened at any moment, and the room that is left for it.
//! Frame and unit: docs/file-formats.md.

mod recorder;
mod run;
mod space;

pub use recorder::{Kept, Recorder, RecorderOptions, Shows, Store};
pub use run::{Backlog, Recorded, Recording as RecordReport, handing_on, record};
pub use space::Space;
