//! In: a station folder, recordings, options. Out: the product's procedures from top to bottom.
//! Frame and unit: millimetres; each file names its frames.

mod judge;
mod page;
mod board_views;
mod calibrate_hand_eye;
mod find;
mod products;
mod progress;
mod run;
mod settings;
mod values;

pub use judge::{Judged, judge};
pub use board_views::{Boards, FrameBoard, boards};
pub use calibrate_hand_eye::{Calibrated, HandEyeResult, HandEyeRun, calibrate_hand_eye};
pub use find::find_part;
pub use run::{HeightMapFigures, ScanOptions, ScanReport, cloud_of, load_report, scan};
pub use settings::{Settings, WorkingVolume};
pub use values::Values;
