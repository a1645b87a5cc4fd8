//! In: one part or object seen from several sides, the rig. Out: what the scans agree on, what they disagree about,
//! which calibration explains it and what stays undetected.
//! Frame and unit: base frame, part axes; mm, degrees (docs/math.md, Second look).

pub mod explain;
pub mod levers;
pub mod looks;
pub mod part_seen;
mod pieces;
mod plan;
pub mod register;
pub mod size_check;
pub mod stack;

pub use plan::{LookPlan, Shown, plan_look};
