//! In: finished profiles of a running scan. Out: a sealed checkpoint file to resume from, and running figures in
//! memory that does not grow with the scan.
//! Frame and unit: counts; sigma in mm; places of the camera in the cloud's frame.

mod depths;
mod repeats;

pub(super) use depths::Calibrated;
pub use depths::Depths;
pub use repeats::Repeats;

use super::scan_folder::PROGRESS;
use super::spread::Spread;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Camera, Rigid, Vec3};
use crate::raster::{HotPixels, Image, Pixels};
use crate::rig::{sealed, unsealed};
use crate::scan::{CloudWriter, Profile};
use crate::stages::peak::Stripe;
use crate::stages::peak::found::Reject;
use std::collections::BTreeMap;
use std::path::Path;

/// State of an interrupted scan. It refers only to points that are on disk.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Hash of recording, rig, working volume and settings.
    pub identity: String,
    /// Number of shots done, including skipped ones.
    pub shots: usize,
    /// Number of points of the cloud that are on disk.
    pub points: u64,
    /// Number of peaks by rejection reason; accepted ones are listed too.
    pub peaks: BTreeMap<String, u64>,
    /// Indices of the shots without a single point.
    pub dark: Vec<u32>,
    /// Skipped shots: name and reason.
    pub skipped: Vec<(String, String)>,
    /// Number of pixels that exceeded the stages' list.
    pub cut: u64,
    /// The stripe as measured in the first shots.
    pub stripe: Option<Stripe>,
    /// Hot pixels, as measured in the first shots.
    pub hot: HotPixels,
    /// Camera pose at the first shot, as rows: it determines the map's up direction and the stripe's axis.
    first_place: Option<[f64; 16]>,
    /// Fingerprint of the last finished shot, which a resumed scan reads again.
    pub last_picture: Option<u32>,
    /// Histogram of the points' standard deviations.
    pub sigma: Spread,
    /// Shots that repeat a picture or a pose.
    #[serde(default)]
    pub repeats: Repeats,
    /// Depths of the points, beside those of the laser plane's calibration.
    #[serde(default)]
    pub depths: Depths,
}

/// CRC-32 of a picture's levels. It distinguishes the pictures of two recordings, because their noise differs.
pub fn fingerprint_of(image: &Image) -> u32 {
    match &image.pixels {
        Pixels::U8(p) => crc32fast::hash(p),
        Pixels::U16(p) => crc32fast::hash(bytemuck::cast_slice(p)),
    }
}

impl Checkpoint {
    /// The state before the first shot; for `identity` see the field.
    pub fn new(identity: String) -> Checkpoint {
        Checkpoint {
            identity,
            shots: 0,
            points: 0,
            peaks: BTreeMap::new(),
            dark: Vec::new(),
            skipped: Vec::new(),
            cut: 0,
            stripe: None,
            hot: HotPixels::default(),
            first_place: None,
            last_picture: None,
            sigma: Spread::default(),
            repeats: Repeats::default(),
            depths: Depths::default(),
        }
    }

    /// The checkpoint in a working folder, if a scan was interrupted there.
    pub fn load(part: &Path) -> Result<Option<Checkpoint>> {
        let path = part.join(PROGRESS);
        let again = "scan again without --resume: the pictures are still there";
        let Some(text) = crate::files::read_text_if_there(&path).map_err(|e| e.next(again))? else { return Ok(None) };
        let what = format!("{}: the checkpoint", path.display());
        let found: Checkpoint = unsealed(&text, &what).map_err(|e| e.next(again))?;
        if let Some(strange) = found.sigma.strange() {
            return Err(Fault::input(format!("{what} {strange}")).cause("of another version").next(again));
        }
        Ok(Some(found))
    }

    /// Writes the cloud to disk, then the checkpoint.
    pub fn save(&mut self, part: &Path, cloud: &mut CloudWriter) -> Result<()> {
        self.points = cloud.checkpoint()?;
        crate::files::write(&part.join(PROGRESS), sealed(self).as_bytes())
    }

    /// Number of finished shots that a resumed scan reads again: the last one, because points are judged by
    /// neighbouring shots.
    pub(super) fn repeated(&self) -> usize {
        self.shots.min(1)
    }

    /// Camera pose at the scan's first shot.
    pub fn first_place(&self) -> Option<Rigid<Base, Camera>> {
        // Not orthonormalized like poses from outside, so that it stays identical to the last bit.
        let m = self.first_place?;
        let rotation = crate::geometry::Mat3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
        Some(Rigid::new(rotation, Vec3::new(m[3], m[7], m[11])))
    }

    /// Stores the camera pose of the very first shot.
    pub fn begin_at(&mut self, place: &Rigid<Base, Camera>) {
        self.first_place.get_or_insert(place.to_rows());
    }

    /// Counts a finished profile, made from a picture of this fingerprint. `calibrated` is what its depths are compared
    /// with, if it is known.
    pub(super) fn add(&mut self, profile: &Profile, picture: u32, calibrated: Option<&Calibrated>) {
        self.last_picture = Some(picture);
        self.repeats.add(profile, picture);
        calibrated.into_iter().for_each(|c| self.depths.add(profile, c));
        // A skipped shot leaves a gap in the indices; resuming continues after the last finished shot.
        self.shots = profile.shot as usize + 1;
        let mut fates = [0; Reject::ALL.len()];
        profile.peaks.iter().for_each(|peak| fates[peak.reject() as usize] += 1);
        for (fate, n) in Reject::ALL.into_iter().zip(fates).filter(|&(_, n)| n > 0) {
            *self.peaks.entry(fate.words().to_owned()).or_default() += n;
        }
        if profile.points.is_empty() {
            self.dark.push(profile.shot);
        }
        self.sigma.add(&profile.points);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_checkpoint_comes_back_and_a_damaged_one_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let mut cloud = CloudWriter::create(&dir.path().join("cloud.ply")).unwrap();
        let mut state = Checkpoint::new("id".into());
        state.begin_at(&Rigid::from_vectors(&Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.0, 2.0, 3.0)));
        state.last_picture = Some(7);
        state.save(dir.path(), &mut cloud).unwrap();
        assert_eq!(Checkpoint::load(dir.path()).unwrap(), Some(state));
        let path = dir.path().join(PROGRESS);
        let text = std::fs::read_to_string(&path).unwrap();
        for (from, to) in [("\"shots\": 0", "\"shots\": 64"), ("\"points\": 0", "\"points\": 1"), ("0,\n    0,", "0,")]
        {
            assert!(text.contains(from), "{from}");
            std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
            let said = Checkpoint::load(dir.path()).unwrap_err();
            assert!(said.what.contains("was changed") && said.next.contains("without --resume"), "{said}");
        }
    }
}
