//! In: a robot and a camera with lasers, one board below them. Out: the whole rig, calibrated by moves that the
//! program chooses: first small ones, then each time the one that lowers the expected error most.
//! Frame and unit: mm, rad, px; each file names its frames.

pub(in crate::station) mod arm;
pub(in crate::station) mod cell;
pub(in crate::station) mod check;
mod first;
mod notebook;
pub(in crate::station) mod options;
pub(in crate::station) mod procedure;
pub(in crate::station) mod result;
