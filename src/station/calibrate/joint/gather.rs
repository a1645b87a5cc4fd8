//! In: recordings. Out: their stops: a board in room light, the laser pictures that belong to it, the robot's pose.
//! Pictures that occur twice count once.
//! Frame and unit: px; base_from_flange in mm.

use crate::calibrate::boards::{BoardView, FindOptions, find};
use crate::calibrate::joint::shots::Reported;
use crate::camera::Readout;
use crate::fault::{Fault, Kind, Result};
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::HotPixels;
use crate::recording::{Beam, BoardSpec, Recording, hot_pixels, one_readout};
use crate::rig::hash_file;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A picture of one of the recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Index into the recordings.
    pub recording: usize,
    /// Its file name there.
    pub file: String,
}

/// Pictures that were taken at one standstill.
#[derive(Clone, Debug)]
pub struct Stop {
    /// Its name in messages: the picture in room light, with its recording if there are several.
    pub name: String,
    /// The board as meta.json describes it.
    pub board: BoardSpec,
    /// The board's features in room light.
    pub view: BoardView,
    /// The robot's reported pose, and the index of the board position that it saw.
    pub robot: Option<Reported>,
    /// The picture in room light.
    pub room: Picture,
    /// The picture with the line laser on.
    pub line: Option<Picture>,
    /// The picture with the pointer on.
    pub pointer: Option<Picture>,
}

/// The content of all recordings.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// The stops in the recordings' order.
    pub stops: Vec<Stop>,
    /// Pictures that could not be used, with the reason.
    pub missing: Vec<(String, String)>,
    /// Name and SHA-256 of every input.
    pub inputs: BTreeMap<String, String>,
    /// The sensor readout of all pictures, if all recordings state it.
    pub readout: Option<Readout>,
    /// Hot pixels, which are bright in all pictures.
    pub hot: HotPixels,
    /// Number of positions at which boards stood.
    pub places: usize,
}

/// A frame with its board's picture.
struct Frame<'a> {
    recording: usize,
    index: usize,
    name: String,
    file: &'a str,
}

fn label(recordings: &[Recording], i: usize) -> String {
    if recordings.len() == 1 {
        return String::new();
    }
    let short = |r: &Recording| r.folder.file_name().map(|n| n.to_string_lossy().into_owned());
    let alike = recordings.iter().filter(|o| short(o) == short(&recordings[i])).count();
    let name = short(&recordings[i]).filter(|_| alike == 1);
    format!("{}/", name.unwrap_or_else(|| recordings[i].folder.display().to_string()))
}

fn same_size(recordings: &[Recording]) -> Result<()> {
    let size = |r: &Recording| (r.meta.image.width, r.meta.image.height);
    let Some(first) = recordings.first() else {
        return Err(Fault::usage("no recording was given").next("give one or more"));
    };
    match recordings.iter().find(|r| size(r) != size(first)) {
        None => Ok(()),
        Some(other) => Err(Fault::input(format!(
            "{} holds pictures of {}x{}, {} of {}x{}: they are not of one rig",
            first.folder.display(),
            size(first).0,
            size(first).1,
            other.folder.display(),
            size(other).0,
            size(other).1
        ))
        .cause("recordings of two cameras, or of one at two resolutions")
        .next("give the recordings of one rig")),
    }
}

/// Finds the boards of all recordings. `poses` names the pose file of recordings that have several. A stop of two
/// recordings (the same picture in room light) gets the laser pictures of both.
pub fn gather(
    recordings: &[Recording],
    poses: Option<&str>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Gathered> {
    same_size(recordings)?;
    let (frames, robots, inputs) = listed(recordings, poses)?;
    if frames.is_empty() {
        return Err(Fault::input("no frame of the recordings has an 'ambient' picture")
            .cause("boards are found in pictures taken in room light, the lasers off")
            .next("record an ambient picture with each frame"));
    }
    let readout = one_readout(recordings)?;
    let out = Gathered { inputs, readout, hot: hot_pixels(recordings), ..Gathered::default() };
    let mut gathering = Gathering { recordings, robots, places: Vec::new(), known: BTreeMap::new(), out };
    for (f, (hash, view)) in frames.iter().zip(boards(recordings, &frames, progress)?) {
        match view {
            Ok(view) => gathering.add(f, hash, view)?,
            // Missing files and wrongly described boards concern the whole recording, not one picture.
            Err(fault) if fault.kind != Kind::Refused => return Err(fault),
            Err(fault) => gathering.out.missing.push((f.name.clone(), format!("{} ({})", fault.what, fault.cause))),
        }
    }
    let Gathering { out, places, .. } = gathering;
    if out.stops.is_empty() {
        let (name, why) = &out.missing[out.missing.len() / 2];
        return Err(Fault::refused(format!("no board was found in any of {} pictures; {name}: {why}", frames.len()))
            .cause("the board is out of view, or another one than meta.json describes")
            .next("compare meta.json's board with the real one, and look at the pictures"));
    }
    Ok(Gathered { places: places.len(), ..out })
}

/// The robot's poses of each recording; `None` if it has none.
type Robots = Vec<Option<Vec<Rigid<Base, Flange>>>>;

/// The frames with a picture in room light, the robot's poses, and the hash of each meta.json.
fn listed<'a>(
    recordings: &'a [Recording],
    poses: Option<&str>,
) -> Result<(Vec<Frame<'a>>, Robots, BTreeMap<String, String>)> {
    let (mut frames, mut robots, mut inputs) = (Vec::new(), Vec::new(), BTreeMap::new());
    for (i, r) in recordings.iter().enumerate() {
        let label = label(recordings, i);
        inputs.insert(format!("{label}meta.json"), hash_file(&r.folder.join("meta.json"))?);
        let has_poses = r.meta.pose_file.is_some() || !r.meta.pose_files.is_empty();
        let several = poses.filter(|_| r.meta.pose_file.is_none());
        robots.push(if has_poses { Some(r.poses(several)?) } else { None });
        for (index, frame) in r.meta.frames.iter().enumerate() {
            if let Some(file) = frame.ambient.as_deref() {
                frames.push(Frame { recording: i, index, name: format!("{label}{file}"), file });
            }
        }
    }
    Ok((frames, robots, inputs))
}

/// Each picture's hash, and its board.
fn boards(
    recordings: &[Recording],
    frames: &[Frame<'_>],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<(String, Result<BoardView>)>> {
    let done = AtomicUsize::new(0);
    let look = |f: &Frame<'_>| {
        let r = &recordings[f.recording];
        let hash = hash_file(&r.inside(f.file)?)?;
        let view = (|| {
            let board = r.meta.board_of(&r.meta.frames[f.index]).ok_or_else(|| {
                Fault::input(format!("{}: meta.json describes no board for it", f.name))
                    .next("describe the board under 'board' or 'boards'")
            })?;
            find(&r.picture(f.file)?, board, &FindOptions::default())
        })();
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, frames.len());
        Ok((hash, view))
    };
    frames.par_iter().map(look).collect()
}

/// Collects stops picture by picture.
struct Gathering<'a> {
    recordings: &'a [Recording],
    robots: Robots,
    /// Positions of boards: recording, and index of the board there.
    places: Vec<(usize, usize)>,
    /// Index of a stop by the hash of its picture in room light.
    known: BTreeMap<String, usize>,
    out: Gathered,
}

impl Gathering<'_> {
    /// Adds a picture in room light with its laser picture: a new stop, or more data of a stop that another
    /// recording contains.
    fn add(&mut self, f: &Frame<'_>, hash: String, view: BoardView) -> Result<()> {
        let r = &self.recordings[f.recording];
        let frame = &r.meta.frames[f.index];
        let at = *self.known.entry(hash.clone()).or_insert_with(|| {
            self.out.stops.push(Stop {
                name: f.name.clone(),
                board: r.meta.board_of(frame).expect("it was found").clone(),
                view,
                robot: None,
                room: Picture { recording: f.recording, file: f.file.into() },
                line: None,
                pointer: None,
            });
            self.out.stops.len() - 1
        });
        self.out.inputs.insert(f.name.clone(), hash);
        if self.out.stops[at].robot.is_none()
            && let Some(poses) = &self.robots[f.recording]
        {
            let pose = *r.pose_of(f.index, poses)?;
            let place = self.place(f.recording, frame.board.unwrap_or(0));
            self.out.stops[at].robot = Some(Reported { pose, place });
        }
        if let Some(file) = &frame.laser {
            let picture = Picture { recording: f.recording, file: file.clone() };
            let name = format!("{}{file}", label(self.recordings, f.recording));
            self.out.inputs.insert(name, hash_file(&r.inside(file)?)?);
            let stop = &mut self.out.stops[at];
            match r.meta.beam {
                Some(Beam::Line) => stop.line = Some(picture),
                Some(Beam::Pointer) => stop.pointer = Some(picture),
                None => return Err(nameless(r)),
            }
        }
        Ok(())
    }

    /// Index of the position of a recording's board.
    fn place(&mut self, recording: usize, board: usize) -> usize {
        let known = self.places.iter().position(|p| *p == (recording, board));
        known.unwrap_or_else(|| {
            self.places.push((recording, board));
            self.places.len() - 1
        })
    }
}

fn nameless(r: &Recording) -> Fault {
    Fault::input(format!("{}: meta.json does not say which laser its pictures show", r.folder.display()))
        .cause("'beam' is missing")
        .next("write \"beam\": \"line\" or \"beam\": \"pointer\" into it")
}
