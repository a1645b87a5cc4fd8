//! In: simulated stations with known truth. Out: whether the joint calibration is as good as it says, and as it must be.
//! Frame and unit: mm, rad, px.

mod common;

#[path = "joint/accuracy.rs"]
mod accuracy;
#[path = "joint/stations.rs"]
mod stations;
