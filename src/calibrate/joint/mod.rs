//! In: all pictures of boards that a station took, with the robot's poses, the stripe and the pointer's spot on them.
//! Out: camera, hand-eye, laser plane, pointer, the boards' poses and the noise of each source, solved together with
//! their joint covariance; the next pose of the robot. Frame and unit: see `unknowns`; mm, rad, px (docs/math.md,
//! Joint calibration).

pub mod choose;
pub mod limits;
pub mod moved;
pub mod noise;
pub mod options;
pub mod records;
pub mod shots;
pub mod solve;
pub mod start;
pub mod terms;
pub mod unknowns;
pub mod volume;
