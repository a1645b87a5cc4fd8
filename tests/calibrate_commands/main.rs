//! In: simulated stations and recordings, true and wrong, and files of other programs. Out: whether the program's
//! commands calibrate them, or refuse them with the number, the cause and the next step.
//! Frame and unit: mm, degrees, px, as each file says.

#[path = "../common/mod.rs"]
mod common;

mod bad_input;
mod commands;
mod foreign_cameras;
mod guide;
mod joint_recordings;
mod notations;
mod second_look_commands;
