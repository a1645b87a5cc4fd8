//! In: shots of a running camera. Out: a recording, or profiles, that can be opened at any moment; warnings about disk
//! space.
//! Frame and unit: docs/file-formats.md.

mod backlog;
mod gather;
mod poses;
mod profiles;
mod recorder;
mod run;
mod space;

pub use backlog::{Backlog, Handing, Recorded, Waits};
pub use poses::record_poses;
pub use profiles::{Rows, record_profiles};
pub use recorder::{Kept, Recorder, RecorderOptions, Shows, Store, is_recorded_into};
pub use run::{Exposed, Recording as RecordReport, record};
pub use space::Space;
