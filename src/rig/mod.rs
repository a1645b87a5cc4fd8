//! In: calibration results and the station folder's `calibration/*.json`. Out: the measured rig —
//! camera, laser plane, pointer, hand-eye — each with its covariance, origin and verdict.
//! Frame and unit: camera and flange; millimetres, radians, pixels (docs/file-formats.md).

mod calibration;
mod folder;
mod volume;

pub use calibration::{Calibration, Covariance, HandEye, Quality, Verdict, hash_file, hash_text};
pub use folder::Rig;
pub use volume::Volume;
