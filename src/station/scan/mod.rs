//! In: a source of shots, a station. Out: the scan's folder: cloud, height map, pictures, report.
//! Frame and unit: cloud in the base frame, mm (docs/file-formats.md).

pub(super) mod done;
pub(super) mod held;
pub(super) mod options;
mod overlays;
pub(super) mod products;
pub mod progress;
pub(super) mod recorded;
pub(super) mod refined;
pub(super) mod report;
pub(super) mod run;
pub(super) mod scan_folder;
pub(super) mod seen;
mod spread;
pub(super) mod watch;
