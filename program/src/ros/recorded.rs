//! In: a recording, and a finished scan that may belong to it. Out: the recording's pictures, times and flange poses
//! by the scan's shots; a recording of another scan is refused.
//! Frame and unit: base_from_flange, mm; ns.

use super::clock::Clock;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Flange, Mat3, Rigid, Vec3};
use sheetlight::raster::{Bracket, Image, MERGED_BITS};
use sheetlight::recording::{Carries, FrameRef, Motion, Recording, Stand};
use sheetlight::rig::Rig;
use sheetlight::scan::{Carrier, Format, Shots};
use sheetlight::station::ScanReport;
use std::collections::BTreeMap;

/// The recording of a scan.
pub struct Recorded<'a> {
    recording: &'a Recording,
    /// The exposures of each pose, if they were merged.
    bracket: Option<Bracket>,
    /// Index of each shot's frame.
    frames: Vec<usize>,
    flanges: BTreeMap<u32, Rigid<Base, Flange>>,
}

/// Largest deviation from the scan's camera pose, rad and mm. A larger one means another recording; the corrections
/// of paths and delays stay far below it.
const OTHER: [f64; 2] = [0.035, 5.0];

impl<'a> Recorded<'a> {
    /// `poses` names the file of a robot's poses if meta.json does not; `rig` is the rig that scanned.
    ///
    /// # Errors
    /// A recording that does not belong to this scan: other pictures, fewer shots, another motion, deviating poses.
    pub fn new(
        recording: &'a Recording,
        poses: Option<&str>,
        (report, shots): (&ScanReport, &Shots),
        rig: Option<&Rig>,
    ) -> Result<Recorded<'a>> {
        let meta = &recording.meta;
        let other = |what: String| {
            Fault::input(format!("{}: {what}", recording.folder.display()))
                .cause(format!("the recording of another scan was given; this scan is of {}", report.recording))
                .next("give the recording that was scanned, or exclude it")
        };
        if report.imported.is_some() {
            return Err(other("the scan was imported and has no recording".into()));
        }
        if report.profiles.is_some() {
            return Err(other("the scan was made of profiles, not of pictures".into()));
        }
        let bracket = meta.bracket()?;
        if bracket.is_some() && report.exposures.is_none() {
            return Err(other("its poses have several exposures, the scan is of one of them alone".into()));
        }
        let bits = if bracket.is_some() { MERGED_BITS } else { recording.bits() };
        let format = Format { width: meta.image.width, height: meta.image.height, bits };
        if format != report.image {
            let words = |f: &Format| format!("{}x{} with {} bits", f.width, f.height, f.bits);
            return Err(other(format!("its pictures are {}, the scan's {}", words(&format), words(&report.image))));
        }
        if meta.motion() != report.motion {
            return Err(other("its 'motion' is not the scan's".into()));
        }
        let lit = meta.frames.iter().enumerate().filter(|(_, f)| f.laser.is_some());
        let frames: Vec<usize> = lit.map(|(i, _)| i).collect();
        let last = shots.places().last().map_or(0, |(shot, _)| shot as usize + 1).max(report.shots);
        if frames.len() < last {
            return Err(other(format!("has {} pictures with the laser on, the scan has {last} shots", frames.len())));
        }
        let stands = stands(recording, poses, &frames)?;
        check(&stands, shots, &report.motion, rig).map_err(other)?;
        let flanges = stands.into_iter().filter_map(|(shot, stand)| match stand {
            Stand::Robot(base_from_flange) => Some((shot, base_from_flange)),
            Stand::Count(_) => None,
        });
        Ok(Recorded { recording, bracket, frames, flanges: flanges.collect() })
    }

    fn frame(&self, shot: u32) -> Option<&FrameRef> {
        self.frames.get(shot as usize).map(|i| &self.recording.meta.frames[*i])
    }

    /// Reported pose of the robot's flange at a shot; none for an axis.
    pub fn flange(&self, shot: u32) -> Option<&Rigid<Base, Flange>> {
        self.flanges.get(&shot)
    }

    /// The picture of a shot, with its levels made linear and its exposures merged as in the scan.
    pub fn picture(&self, shot: u32) -> Result<Option<Image>> {
        let Some(frame) = self.frame(shot) else { return Ok(None) };
        match &self.bracket {
            Some(bracket) => self.recording.merged(bracket, &frame.lasers()).map(|(image, _)| Some(image)),
            None => frame.laser.as_ref().map(|name| self.recording.picture(name)).transpose(),
        }
    }

    /// The times of these shots. The inner error states in words why the recording has none.
    pub fn clock(&self, shots: &[u32]) -> Result<std::result::Result<Clock, String>> {
        let taken = |shot: &u32| Some((*shot, self.frame(*shot)?.taken.as_ref()?));
        let without: Vec<u32> = shots.iter().copied().filter(|s| taken(s).is_none()).collect();
        match &without[..] {
            [] => Clock::recorded(shots.iter().filter_map(taken)).map(Ok),
            all if all.len() == shots.len() => Ok(Err("the recording states no times".into())),
            [first, ..] => Ok(Err(format!(
                "the recording states no time for {} of {} shots, shot {first} is the first of them",
                without.len(),
                shots.len()
            ))),
        }
    }
}

/// Position of what moves at every shot; an axis' shots without a count are missing.
fn stands(recording: &Recording, poses: Option<&str>, frames: &[usize]) -> Result<BTreeMap<u32, Stand>> {
    let numbered = || (0..).zip(frames.iter().copied());
    if recording.meta.motion().axis().is_some() {
        let counts = recording.counts()?;
        return Ok(numbered().filter_map(|(shot, i)| Some((shot, Stand::Count(counts[i]?)))).collect());
    }
    let poses = recording.poses(poses)?;
    let stand = |(shot, i)| Ok((shot, Stand::Robot(*recording.pose_of(i, &poses)?)));
    numbered().map(stand).collect()
}

/// Compares the recording's poses with the scan's camera poses; an error states the deviation in words. With the rig
/// that scanned, every motion is compared. Without it, a robot's poses must give the same pose of the camera
/// relative to what they move.
fn check(
    stands: &BTreeMap<u32, Stand>,
    shots: &Shots,
    motion: &Motion,
    rig: Option<&Rig>,
) -> std::result::Result<(), String> {
    let carrier = rig.map(|rig| Carrier::new(rig, motion)).transpose().map_err(|e| e.what)?;
    let mut first: Option<Rigid<Flange, Base>> = None;
    for (shot, place) in shots.places() {
        let Some(stand) = stands.get(&shot) else { return Err(format!("does not say where shot {shot} stood")) };
        let (turn, far) = match (&carrier, stand) {
            (Some(carrier), stand) => {
                carrier.place(stand, None, &Vec3::zeros()).map_err(|e| e.what)?.from_camera.difference(&place)
            }
            (None, Stand::Count(_)) => return Ok(()),
            (None, Stand::Robot(flange)) => {
                let steady = steady(flange, &Rigid::new(place.rotation, place.translation), motion.carries);
                first.get_or_insert(steady).difference(&steady)
            }
        };
        if !(turn <= OTHER[0] && far <= OTHER[1]) {
            return Err(format!(
                "at shot {shot} its pose puts the camera {far:.2} mm and {:.2} degrees from where the scan has it; {} \
                 mm and {:.0} degrees are possible",
                turn.to_degrees(),
                OTHER[1],
                OTHER[0].to_degrees()
            ));
        }
    }
    Ok(())
}

/// The transform that is the same at every shot: the camera on the flange, or the fixed camera in the base before a
/// moving part.
fn steady(
    base_from_flange: &Rigid<Base, Flange>,
    cloud_from_camera: &Rigid<Base, Base>,
    carries: Carries,
) -> Rigid<Flange, Base> {
    match carries {
        Carries::Sensor => base_from_flange.inverse() * *cloud_from_camera,
        Carries::Part => {
            let r: Mat3 = base_from_flange.rotation * cloud_from_camera.rotation;
            Rigid::new(r, base_from_flange.point(&cloud_from_camera.translation))
        }
    }
}
