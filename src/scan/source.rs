//! In: a recording folder, or raw frames on a pipe with a pose file. Out: shots in order, decoded ahead on other
//! threads, with a bounded number of them in memory.
//! Frame and unit: robot poses are base_from_flange, mm; an axis position is in counts; pictures in grey levels of
//! the sensor's depth.

use crate::camera::Readout;
use crate::capture::{Account, Format, Latency, Pictures, RawFormat, RawFrames};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::{Bracket, Image, Levels, MERGED_BITS, Shares};
use crate::recording::{FrameRef, Meta, Pairing, Recording, Slip, Stand};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::io::Read;
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

/// A picture of the stripe, with the position of the robot or the axis when it was taken.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Index in the recording, from 0.
    pub index: u32,
    /// Name of the picture in messages and reports.
    pub name: String,
    /// Grey levels of the sensor's depth.
    pub image: Image,
    /// Pose of the robot's flange, or count of the axis, at the exposure.
    pub stand: Stand,
    /// How far that may be off because the time between picture and position is uncertain.
    pub slip: Option<Slip>,
    /// When its last byte arrived, ns of the host's clock; `None` for files.
    pub here_ns: Option<u64>,
}

/// A shot that could not be read, with the reason; the next one may be fine.
#[derive(Clone, Debug)]
pub struct BadShot {
    /// Index in the recording, from 0.
    pub index: u32,
    /// Name of the picture in messages and reports.
    pub name: String,
    /// Why it could not be read.
    pub fault: Fault,
    /// The source ended with it: there is no next shot, and excluding this one does not help.
    pub last: bool,
}

/// The exposures that shots were merged from.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Merged {
    /// Exposure times of the pictures of a shot, us, ascending.
    pub exposures_us: Vec<f64>,
    /// Number of pictures that were merged.
    pub pictures: u64,
    /// Share of the lit pixels that each exposure gave: it is the longest that was not saturated there.
    pub shares: Vec<f64>,
    /// Share of the lit pixels that are saturated even in the shortest exposure.
    pub saturated: f64,
}

impl std::fmt::Display for Merged {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let list = |values: &[f64], places: usize| {
            values.iter().map(|v| format!("{v:.places$}")).collect::<Vec<_>>().join(", ")
        };
        let percent: Vec<f64> = self.shares.iter().map(|s| 100.0 * s).collect();
        write!(
            f,
            "{} pictures with exposures of {} us were merged; these gave {} % of the lit pixels, {:.2} % are saturated \
             in all",
            self.pictures,
            list(&self.exposures_us, 1),
            list(&percent, 2),
            100.0 * self.saturated
        )
    }
}

/// Where shots come from: a folder, a pipe, a camera.
pub trait Source {
    /// Size and depth of all its shots.
    fn format(&self) -> Format;
    /// Format of all its shots, and how they were read out from the sensor.
    fn pictures(&self) -> Pictures {
        self.format().into()
    }
    /// Number of shots still to come, if known.
    fn remaining(&self) -> Option<usize>;
    /// The next shot, in order; `None` at the end.
    fn next(&mut self) -> Option<std::result::Result<Shot, BadShot>>;
    /// Whether the source can be opened again at the position where it was left.
    fn resumable(&self) -> bool {
        true
    }
    /// The exposures that its shots were merged from so far, if they are merged.
    fn merged(&self) -> Option<Merged> {
        None
    }
    /// The levels of its shots in terms of one exposure's.
    fn levels(&self) -> Levels {
        Levels::default()
    }
    /// What became of every picture that its camera sent, if it has a camera.
    fn account(&self) -> Option<Account> {
        None
    }
    /// Remarks for the scan's report.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Memory for shots that are decoded ahead: at 640x480 two batches of the GPU's chain, at 12 MP and 8 bits eight
/// shots. Shots being decoded take half as much again.
const AHEAD_BYTES: usize = 100 << 20;

/// A recording folder as a source.
pub struct RecordingSource {
    pictures: Pictures,
    merging: Option<Merging>,
    remarks: Vec<String>,
    remaining: usize,
    shots: Receiver<std::result::Result<Shot, BadShot>>,
}

/// Whether pictures and poses were paired by time.
fn by_clock(meta: &Meta) -> bool {
    meta.frames.iter().flat_map(|f| &f.taken).any(|t| t.pairing == Some(Pairing::Clock))
}

/// The exposures to merge, and what became of the pixels of the shots so far.
#[derive(Clone)]
struct Merging {
    bracket: Arc<Bracket>,
    so_far: Arc<Mutex<(u64, Shares)>>,
}

impl Merging {
    /// The shot of these pictures.
    fn shot(&self, recording: &Recording, names: &[String]) -> Result<Image> {
        let (image, shares) = recording.merged(&self.bracket, names)?;
        let mut so_far = self.so_far.lock().unwrap_or_else(PoisonError::into_inner);
        so_far.0 += names.len() as u64;
        so_far.1.add(&shares);
        Ok(image)
    }

    fn report(&self) -> Merged {
        let (pictures, shares) = *self.so_far.lock().unwrap_or_else(PoisonError::into_inner);
        let share = |n: u64| n as f64 / shares.lit().max(1) as f64;
        let exposures_us = self.bracket.exposures_us().to_vec();
        let by_exposure = shares.by_exposure[..exposures_us.len()].iter().map(|n| share(*n)).collect();
        Merged { exposures_us, pictures, shares: by_exposure, saturated: share(shares.saturated) }
    }
}

/// Index of a shot, the names of its pictures, the position at its exposure, and how far that may be off.
type Job = (u32, Vec<String>, Result<Stand>, Option<Slip>);

/// The shots in order, decoded on another thread as far ahead as memory allows.
fn ahead(
    recording: Recording,
    jobs: Vec<Job>,
    format: &Format,
    merging: Option<Merging>,
) -> Result<Receiver<std::result::Result<Shot, BadShot>>> {
    let bytes = format.width as usize * format.height as usize * if format.bits > 8 { 2 } else { 1 };
    let ahead = (AHEAD_BYTES / bytes.max(1)).clamp(8, 64);
    let (send, shots) = sync_channel(ahead);
    let started = std::thread::Builder::new().name("pictures".into()).spawn(move || {
        for chunk in jobs.chunks((ahead / 2).max(rayon::current_num_threads())) {
            let decoded: Vec<_> = chunk
                .par_iter()
                .map(|(index, names, stand, slip)| {
                    let (index, name, slip) = (*index, names[0].clone(), *slip);
                    let picture = || match &merging {
                        Some(merging) => merging.shot(&recording, names),
                        None => recording.picture(&name),
                    };
                    let shot = stand.clone().and_then(|s| Ok((s, picture()?)));
                    match shot {
                        Ok((stand, image)) => Ok(Shot { index, name, image, stand, slip, here_ns: None }),
                        Err(fault) => Err(BadShot { index, name, fault, last: false }),
                    }
                })
                .collect();
            for shot in decoded {
                // The scan ended early and dropped the receiver: nothing is left to do.
                if send.send(shot).is_err() {
                    return;
                }
            }
        }
    });
    started.map_err(|e| Fault::threads(&e))?;
    Ok(shots)
}

impl RecordingSource {
    /// Starts decoding at shot `first`. `poses` names the pose file if meta.json does not. Refuses a recording
    /// without laser pictures, and a pose index outside the pose file.
    pub fn open(recording: &Recording, poses: Option<&str>, first: usize) -> Result<RecordingSource> {
        RecordingSource::late(recording, poses, first, None)
    }

    /// As [`RecordingSource::open`], with a known delay of the pictures' times against the poses'. It applies to
    /// pictures that were paired by clock.
    pub fn late(
        recording: &Recording,
        poses: Option<&str>,
        first: usize,
        latency: Option<&Latency>,
    ) -> Result<RecordingSource> {
        let meta = &recording.meta;
        if !meta.frames.iter().any(|f| f.laser.is_some()) {
            return Err(Fault::input(format!("{}: has no picture with the laser on", recording.folder.display()))
                .cause("a board recording, not a scan")
                .next("give a recording whose frames name 'laser' pictures"));
        }
        let mut stands = if meta.motion().axis().is_some() { counted(recording)? } else { posed(recording, poses)? };
        if let Some(latency) = latency.filter(|_| by_clock(meta)) {
            latency.of(meta.sources.as_ref())?;
            let taken = meta.frames.iter().filter(|f| f.laser.is_some()).map(|f| f.taken.as_ref());
            for ((_, stand, slip), taken) in stands.iter_mut().zip(taken) {
                if let (Ok(at), Some(taken)) = (&stand, taken) {
                    let (moved, within) = taken.delayed(at, 1e6 * latency.delay_ms, 1e6 * latency.sigma_ms);
                    (*stand, *slip) = (Ok(moved), within);
                }
            }
        }
        let mut jobs: Vec<Job> = Vec::new();
        for (names, stand, slip) in stands {
            names.iter().try_for_each(|name| recording.inside(name).map(|_| ()))?;
            jobs.push((jobs.len() as u32, names, stand, slip));
        }
        let jobs = jobs.split_off(first.min(jobs.len()));
        let merging = meta.bracket()?.map(|b| Merging { bracket: Arc::new(b), so_far: Default::default() });
        let bits = if merging.is_some() { MERGED_BITS } else { recording.bits() };
        let format = Format { width: meta.image.width, height: meta.image.height, bits };
        let remaining = jobs.len();
        let shots = ahead(recording.clone(), jobs, &format, merging.clone())?;
        let alone = recording.exposure.map(|n| format!("exposure {n} of each pose was scanned alone"));
        let remarks = meta.image.response.remark(meta.image.bits).into_iter().chain(alone).collect();
        let pictures = Pictures { format, readout: meta.image.readout };
        Ok(RecordingSource { pictures, merging, remarks, remaining, shots })
    }
}

/// The names of a shot's pictures, the position at its exposure, and how far that may be off.
type Stood = (Vec<String>, Result<Stand>, Option<Slip>);

fn slip_of(frame: &FrameRef) -> Option<Slip> {
    frame.taken.as_ref()?.slip()
}

/// Pictures with the laser on and their robot poses.
fn posed(recording: &Recording, poses: Option<&str>) -> Result<Vec<Stood>> {
    let poses = recording.poses(poses)?;
    let frames = recording.meta.frames.iter().enumerate();
    let stand = |(i, frame, name): (usize, &FrameRef, &String)| {
        let base_from_flange = recording.pose_of(i, &poses).map_err(|e| e.at(name))?;
        Ok((frame.lasers(), Ok(Stand::Robot(*base_from_flange)), slip_of(frame)))
    };
    frames.filter_map(|(i, f)| Some((i, f, f.laser.as_ref()?))).map(stand).collect()
}

/// Pictures with the laser on and the axis' counts. A picture with an unknown count becomes a bad shot; no count is
/// made up.
fn counted(recording: &Recording) -> Result<Vec<Stood>> {
    let counts = recording.counts()?;
    let frames = recording.meta.frames.iter().zip(counts).enumerate();
    let stand = |(i, (name, count)): (usize, (&String, Option<f64>))| {
        let unknown = || {
            Fault::input(format!("frame {i} ({name}) has no count"))
                .cause("the encoder's reading was lost")
                .next("add its count to the recording, or exclude the shot with --skip-bad")
        };
        let frame = &recording.meta.frames[i];
        (frame.lasers(), count.map(Stand::Count).ok_or_else(unknown), slip_of(frame))
    };
    Ok(frames.filter_map(|(i, (f, count))| Some((i, (f.laser.as_ref()?, count)))).map(stand).collect())
}

impl Source for RecordingSource {
    fn format(&self) -> Format {
        self.pictures.format
    }
    fn pictures(&self) -> Pictures {
        self.pictures
    }
    fn remaining(&self) -> Option<usize> {
        Some(self.remaining)
    }
    fn next(&mut self) -> Option<std::result::Result<Shot, BadShot>> {
        let shot = self.shots.recv().ok()?;
        self.remaining -= 1;
        Some(shot)
    }
    fn merged(&self) -> Option<Merged> {
        Some(self.merging.as_ref()?.report())
    }
    fn levels(&self) -> Levels {
        self.merging.as_ref().map_or_else(Levels::default, |m| m.bracket.levels())
    }
    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

/// Raw frames from a reader, each with its pose. There are as many poses as frames, including the `missing` ones.
pub struct RawSource<R: Read> {
    frames: RawFrames<R>,
    readout: Option<Readout>,
    poses: Vec<Rigid<Base, Flange>>,
    /// Indices of the poses whose frame never came.
    missing: BTreeSet<usize>,
    /// Index of the next frame's pose.
    next: usize,
    ended: bool,
}

impl<R: Read> RawSource<R> {
    /// Refused: a missing frame that has no pose.
    pub fn new(
        raw: RawFormat,
        reader: R,
        poses: Vec<Rigid<Base, Flange>>,
        missing: BTreeSet<usize>,
    ) -> Result<RawSource<R>> {
        if let Some(beyond) = missing.iter().find(|&&m| m >= poses.len()) {
            return Err(Fault::usage(format!("frame {beyond} is called missing, the pose file has {}", poses.len()))
                .cause("frames are numbered from 0")
                .next("name the missing frames by the numbers of their poses"));
        }
        let frames = RawFrames::new(raw, reader);
        Ok(RawSource { frames, readout: None, poses, missing, next: 0, ended: false })
    }

    /// Sets the readout from the sensor that the user stated.
    pub fn read_out_as(self, readout: Option<Readout>) -> RawSource<R> {
        RawSource { readout, ..self }
    }

    /// The numbers of frames and poses differ, so it is unknown which pose belongs to which frame.
    fn uneven(&self, frames: String) -> Fault {
        let missing = match self.missing.len() {
            0 => String::new(),
            n => format!(" and {n} missing frames are named"),
        };
        Fault::input(format!("the pipe gave {frames}, the pose file has {} poses{missing}", self.poses.len()))
            .cause("frames were lost or doubled, so later ones have other frames' poses")
            .next("record again, or name the missing frames: --missing 17,80")
    }
}

impl<R: Read> Source for RawSource<R> {
    fn format(&self) -> Format {
        self.frames.format()
    }
    fn pictures(&self) -> Pictures {
        Pictures { format: self.format(), readout: self.readout }
    }
    fn remaining(&self) -> Option<usize> {
        Some((self.next..self.poses.len()).filter(|i| !self.missing.contains(i)).count())
    }
    fn resumable(&self) -> bool {
        false
    }
    fn remarks(&self) -> Vec<String> {
        let names: Vec<String> = self.missing.iter().map(usize::to_string).collect();
        if names.is_empty() { Vec::new() } else { vec![format!("frames said to be missing: {}", names.join(", "))] }
    }
    fn next(&mut self) -> Option<std::result::Result<Shot, BadShot>> {
        if self.ended {
            return None;
        }
        while self.missing.contains(&self.next) {
            self.next += 1;
        }
        let index = self.next as u32;
        let name = format!("frame {index}");
        let bad = |fault| Some(Err(BadShot { index, name: name.clone(), fault, last: true }));
        let image = match self.frames.read() {
            Ok(Some(image)) => image,
            Ok(None) => {
                self.ended = true;
                let came = self.next - self.missing.iter().filter(|m| **m < self.next).count();
                return if self.next == self.poses.len() { None } else { bad(self.uneven(format!("{came} frames"))) };
            }
            Err(fault) => {
                self.ended = true;
                return bad(fault.at(&name));
            }
        };
        let Some(&base_from_flange) = self.poses.get(self.next) else {
            self.ended = true;
            let came = self.poses.len() - self.missing.len();
            return bad(self.uneven(format!("more than {came} frames")));
        };
        self.next += 1;
        Some(Ok(Shot { index, name, image, stand: Stand::Robot(base_from_flange), slip: None, here_ns: None }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn poses(n: usize) -> Vec<Rigid<Base, Flange>> {
        vec![Rigid::identity(); n]
    }

    fn raw<'a>(format: &str, bytes: &'a [u8], n: usize, missing: &[usize]) -> RawSource<&'a [u8]> {
        RawSource::new(format.parse().unwrap(), bytes, poses(n), missing.iter().copied().collect()).unwrap()
    }

    #[test]
    fn a_pipe_gives_its_frames_and_says_where_it_broke() {
        let bytes: Vec<u8> = [1u16, 2, 3, 1023, 5, 6, 7, 8, 9].iter().flat_map(|v| v.to_le_bytes()).collect();
        let mut source = raw("2x2:gray10le", &bytes, 3, &[]);
        assert_eq!(source.next().unwrap().unwrap().image, Image::from_u16(2, 2, 10, vec![1, 2, 3, 1023]));
        assert_eq!(source.next().unwrap().unwrap().index, 1);
        assert!(source.next().unwrap().unwrap_err().fault.what.contains("2 of 8 bytes"));
        assert!(source.next().is_none());
        let too_bright: Vec<u8> = [1024u16; 4].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert!(raw("2x2:gray10le", &too_bright, 1, &[]).next().unwrap().is_err());
    }

    #[test]
    fn frames_and_poses_are_counted_against_each_other() {
        let all = |frames: usize, poses: usize, missing: &[usize]| {
            let bytes = vec![0u8; 4 * frames];
            let mut source = raw("2x2:gray8", &bytes, poses, missing);
            let shots: Vec<_> = std::iter::from_fn(|| source.next()).collect();
            shots
                .into_iter()
                .map(|s| s.map(|s| s.index).map_err(|b| (b.last, b.fault.what)))
                .collect::<std::result::Result<Vec<_>, _>>()
        };
        assert_eq!(all(3, 3, &[]), Ok(vec![0, 1, 2]));
        let (last, what) = all(2, 3, &[]).unwrap_err();
        assert!(last && what.contains("gave 2 frames, the pose file has 3"), "{what}");
        let (last, what) = all(4, 3, &[]).unwrap_err();
        assert!(last && what.contains("more than 3 frames"), "{what}");
        assert_eq!(all(2, 4, &[0, 2]), Ok(vec![1, 3]));
        assert_eq!(all(2, 4, &[1, 3]), Ok(vec![0, 2]));
        let (_, what) = all(3, 5, &[1]).unwrap_err();
        assert!(what.contains("3 frames, the pose file has 5 poses and 1 missing"), "{what}");
        let beyond = RawSource::new("2x2:gray8".parse().unwrap(), [].as_slice(), poses(2), [2].into());
        assert!(beyond.err().unwrap().what.contains("frame 2"));
    }
}
