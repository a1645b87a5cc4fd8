//! In: recordings of boards, in any order, with robot poses, stripe and spot where they have them. Out: the whole rig's
//! calibration from one joint solve, beside what separate calibrations of the same pictures come to.
//! Frame and unit: mm, rad, px; each file names its frames.

pub(in crate::station) mod gather;
pub(in crate::station) mod measure;
pub(in crate::station) mod page;
pub(in crate::station) mod run;
