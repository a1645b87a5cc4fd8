//! In: a folder with pictures and poses that this program reads by itself, as it would take them from its own camera
//! and robot, and a station. Out: the height of the highest place in each profile as soon as it is there, CSV on
//! stdout.
//! Frame and unit: robot's base, mm.
//!
//!   outside RECORDING STATION

use sheetlight::Scan;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Flange, Rigid};
use sheetlight::raster::Image;
use sheetlight::recording::Recording;
use sheetlight::scan::{CloudPoint, Profile, Where};
use std::path::{Path, PathBuf};

/// A picture, and where the robot's flange was.
pub type Posed = (Image, Rigid<Base, Flange>);

/// The pictures of a folder, each read when it is asked for.
pub fn own(folder: &Path) -> Result<impl Iterator<Item = Result<Posed>> + use<>> {
    let recording = Recording::open(folder)?;
    let poses = recording.poses(None)?;
    let frames = recording.meta.frames.clone().into_iter().filter_map(|f| Some((f.laser?, f.pose?)));
    Ok(frames.map(move |(name, pose)| Ok((recording.picture(&name)?, *recording.pose_of(pose, &poses)?))))
}

/// Calls `take` with each profile, in order.
pub fn measure(
    station: &Path,
    pictures: impl IntoIterator<Item = Result<Posed>>,
    mut take: impl FnMut(&Profile),
) -> Result<()> {
    let profiles = Scan::at(station)?.on(Where::Cpu).profiles(pictures)?;
    profiles.into_iter().try_for_each(|profile| profile.map(|profile| take(&profile)))
}

/// The highest point of a profile.
pub fn top(profile: &Profile) -> Option<&CloudPoint> {
    profile.points.iter().max_by(|a, b| a.position[2].total_cmp(&b.position[2]))
}

pub fn line(profile: &Profile) -> Option<String> {
    top(profile).map(|p| format!("{},{:.4},{:.4}", profile.shot, p.position[2], p.sigma_mm))
}

fn main() -> Result<()> {
    let folders: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [recording, station] = folders.as_slice() else {
        return Err(Fault::usage("two folders are needed").next("give RECORDING STATION"));
    };
    println!("shot,z_mm,sigma_mm");
    measure(station, own(recording)?, |p| line(p).iter().for_each(|l| println!("{l}")))
}
