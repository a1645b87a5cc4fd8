//! In: profiles and the poses at which they were measured, one after another. Out: a folder of profiles and a file of
//! poses, which can be scanned at any moment: what is there is complete.
//! Frame and unit: profiles in the sensor's plane, poses base_from_flange; mm.

use super::profile::measured;
use crate::fault::Result;
use crate::files::Append;
use crate::geometry::{Base, Flange, Rigid};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Name of the folder of profiles.
const PROFILES: &str = "profiles";
/// Name of the file of poses.
const POSES: &str = "poses.csv";

/// Profiles that are being written.
pub struct ProfileWriter {
    folder: PathBuf,
    poses: Option<Append>,
    count: usize,
    bytes: u64,
}

impl ProfileWriter {
    /// Begins in an existing folder; with `posed`, every profile has a pose.
    ///
    /// # Errors
    /// The folder has profiles or poses, or cannot be written.
    pub fn create(folder: &Path, posed: bool) -> Result<ProfileWriter> {
        let poses = posed.then(|| Append::create(&folder.join(POSES))).transpose()?;
        let mut writer = ProfileWriter { folder: folder.join(PROFILES), poses, count: 0, bytes: 0 };
        crate::files::make_folder(&writer.folder)?;
        if let Some(poses) = &mut writer.poses {
            let names: Vec<String> = (0..16).map(|i| format!("m{}{}", i / 4, i % 4)).collect();
            poses.add(format!("frame,{}\n", names.join(",")).as_bytes())?;
        }
        Ok(writer)
    }

    /// Adds a profile, and its pose if it has one.
    ///
    /// # Errors
    /// The disk cannot be written: what was added before stays.
    pub fn add(&mut self, points: &[[f64; 2]], pose: Option<&Rigid<Base, Flange>>) -> Result<()> {
        let mut text = String::from("x_mm,z_mm\n");
        for p in points {
            // 10 nm. What was not measured has its x, if it is known.
            let [x, z] = p.map(|v| if v.is_finite() { format!("{v:.5}") } else { "nan".into() });
            let z = if measured(p) { z } else { "nan".into() };
            writeln!(text, "{x},{z}").expect("memory");
        }
        let path = self.folder.join(format!("profile_{:06}.csv", self.count));
        crate::files::write_unsynced(&path, text.as_bytes())?;
        self.bytes += text.len() as u64;
        if let (Some(poses), Some(pose)) = (&mut self.poses, pose) {
            let numbers: Vec<String> = pose.to_rows().iter().map(f64::to_string).collect();
            poses.add(format!("{},{}\n", self.count, numbers.join(",")).as_bytes())?;
        }
        self.count += 1;
        Ok(())
    }

    /// Number of profiles so far.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Number of bytes of profiles so far.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Syncs the poses to the disk.
    ///
    /// # Errors
    /// The disk cannot be written.
    pub fn sync(&self) -> Result<()> {
        self.poses.as_ref().map_or(Ok(()), Append::sync)
    }
}
