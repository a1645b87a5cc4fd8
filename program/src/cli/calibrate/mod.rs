//! In: a recording and a station. Out: one calibration, stored in the station with its report.
//! Frame and unit: mm, rad, px; each file names its frames.

mod auto;
mod axis;
mod camera;
mod hand_eye;
mod joint;
mod laser_plane;
mod latency;
mod mount;
mod pointer;
mod profile_hand_eye;
pub(in crate::cli) mod store;

use super::terminal::console::Console;
use sheetlight::fault::Result;

#[derive(clap::Subcommand)]
pub enum Command {
    Auto(auto::Args),
    Axis(axis::Args),
    Camera(camera::Args),
    HandEye(hand_eye::Args),
    Joint(joint::Args),
    LaserPlane(laser_plane::Args),
    Latency(latency::Args),
    Pointer(pointer::Args),
    ProfileHandEye(profile_hand_eye::Args),
}

pub fn run(command: &Command, console: &Console) -> Result<()> {
    match command {
        Command::Auto(a) => auto::run(a, console),
        Command::Axis(a) => axis::run(a, console),
        Command::Camera(a) => camera::run(a, console),
        Command::HandEye(a) => hand_eye::run(a, console),
        Command::Joint(a) => joint::run(a, console),
        Command::Latency(a) => latency::run(a, console),
        Command::LaserPlane(a) => laser_plane::run(a, console),
        Command::Pointer(a) => pointer::run(a, console),
        Command::ProfileHandEye(a) => profile_hand_eye::run(a, console),
    }
}
