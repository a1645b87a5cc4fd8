//! In: a folder with pictures and poses that this program reads by itself, as it would take them from its own camera
//! and robot, and a station. Out: the height of the highest place in each profile as soon as it is there, CSV on
//! stdout.
//! Frame and unit: robot's base, mm.
//!
//!   outside RECORDING STATION

use sheetlight::fault::{Fault, Result};
use sheetlight::recording::{Motion, Recording, Stand};
use sheetlight::rig::Rig;
use sheetlight::scan::{BadShot, Carrier, CloudPoint, Format, Profile, Scanner, Shot, Source, Where};
use sheetlight::station::{ScanOptions, Settings};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// Shots that this program holds in memory.
pub struct Held {
    pub format: Format,
    pub shots: VecDeque<Shot>,
}

impl Held {
    pub fn read(folder: &Path) -> Result<Held> {
        let recording = Recording::open(folder)?;
        let poses = recording.poses(None)?;
        let (image, bits) = (&recording.meta.image, recording.bits());
        let format = Format { width: image.width, height: image.height, bits };
        let named = recording.meta.frames.iter().filter_map(|f| Some((f.laser.clone()?, f.pose?)));
        let shots = named.enumerate().map(|(index, (name, pose))| {
            let image = recording.picture(&name)?;
            let stand = Stand::Robot(*recording.pose_of(pose, &poses)?);
            Ok(Shot { index: index as u32, name, image, stand, slip: None, here_ns: None })
        });
        Ok(Held { format, shots: shots.collect::<Result<_>>()? })
    }
}

impl Source for Held {
    fn format(&self) -> Format {
        self.format
    }
    fn remaining(&self) -> Option<usize> {
        Some(self.shots.len())
    }
    fn next(&mut self) -> Option<std::result::Result<Shot, BadShot>> {
        self.shots.pop_front().map(Ok)
    }
}

/// Calls `take` with each profile, in order.
pub fn measure(station: &Path, mut source: impl Source, mut take: impl FnMut(&Profile)) -> Result<()> {
    let (settings, rig) = (Settings::load(station)?, Rig::load(station)?);
    let o = ScanOptions::for_station(&settings, &rig, Path::new(""));
    let carrier = Carrier::new(&rig, &Motion::default())?;
    let (format, volume, place) = (source.format(), o.volume.as_ref(), Where::Cpu.open()?);
    let mut scanner = Scanner::new(&rig, carrier, format, &o.extraction, volume, None, place)?;
    while let Some(shot) = source.next() {
        scanner.push(shot.map_err(|bad| bad.fault)?)?;
        scanner.ready()?.iter().for_each(&mut take);
    }
    scanner.finish()?.iter().for_each(take);
    Ok(())
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
    measure(station, Held::read(recording)?, |p| line(p).iter().for_each(|l| println!("{l}")))
}
