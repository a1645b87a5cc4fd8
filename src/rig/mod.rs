//! In: calibration results and the station folder's `calibration/*.json`. Out: the measured rig —
//! camera, laser plane, pointer, hand-eye, axes — each with its covariance, origin, seal and verdict.
//! Frame and unit: camera and flange; millimetres, radians, pixels (docs/file-formats.md).

mod calibration;
mod checks;
mod covariance;
mod folder;
mod hash;
mod joint;
mod kind;
mod measured;
mod once;
mod pictures;
mod plan;
mod seal;
mod volume;
mod whole;

pub use calibration::{
    AXIS_SIGMA_DEG, AXIS_SIGMA_MM, Calibration, HandEye, Quality, ROBOT_SIGMA_DEG, ROBOT_SIGMA_MM, Verdict, axis_sigma,
    hash_file,
};
pub use checks::depths_seen;
pub use covariance::Covariance;
pub use hash::hash_text;
pub use joint::{Joint, JointCovariance};
pub use kind::{Kind, Place, Units};
pub use measured::Measured;
pub(crate) use once::parse as json_once;
pub use plan::{RigForecast, RigPlan};
pub use seal::{sealed, unsealed};
pub use volume::Volume;
pub use whole::{Record, Rig};
