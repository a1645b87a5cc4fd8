//! In: recordings of boards, in any order, some with robot poses, stripe or spot. Out: the whole rig's calibration
//! from one joint solve, besides separate calibrations from the same pictures.
//! Frame and unit: mm, rad, px; each file names its frames.

pub(in crate::station) mod gather;
pub(in crate::station) mod measure;
pub(in crate::station) mod page;
pub(in crate::station) mod run;
