//! In: a recording folder (`meta.json`, pictures, `poses*.json|csv`, counts). Out: its checked contents.
//! Frame and unit: poses are base_from_flange in mm; boards in mm; see docs/file-formats.md.

mod board;
mod board_poses;
mod counts;
mod frame;
mod frames;
mod meta;
mod motion;
pub mod odd;
mod pose_csv;
mod poses;
pub mod profiles;
mod raw;
mod readout;
mod stand;
mod taken;

pub use board::{BoardSpec, MarkerLayout, Markers, OriginMark, hexagonal_node};
pub use board_poses::load_board_poses;
pub use counts::load_counts;
pub use frame::FrameRef;
pub use frames::FollowedFrames;
pub use meta::{AmbientRef, Beam, ImageSpec, Meta, Sources};
pub use motion::{Carries, Motion, MotionKind};
pub use poses::{PoseFile, load_poses, looks_like_metres, save_poses};
pub use raw::raw_name;
pub use readout::{hot_pixels, one_readout, stated_once};
pub use stand::Stand;
pub use taken::{Pairing, Slip, Taken};

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::{Bracket, Channel, Depth, Image, Shares};
use std::path::{Component, Path, PathBuf};

/// A recording on disk. Pictures are read one at a time, never all at once.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The folder; file names are relative to it.
    pub folder: PathBuf,
    /// Content of its `meta.json`, checked.
    pub meta: Meta,
    /// Which channel of colour pictures is used.
    pub channel: Channel,
    /// The exposure of a bracket that alone is used, counted from 1; none: all.
    pub exposure: Option<usize>,
    /// Whether files outside the folder may be read. meta.json may come from elsewhere, so the user has to allow it.
    pub outside: bool,
}

impl Recording {
    /// Opens a folder and checks `meta.json`.
    pub fn open(folder: &Path) -> Result<Recording> {
        if !folder.is_dir() {
            return Err(Fault::input(format!("{}: is not a folder", folder.display()))
                .cause("a recording is a folder with meta.json, pictures and poses")
                .next("give the folder, not one of its files"));
        }
        let path = folder.join("meta.json");
        if !path.exists() {
            let entries: Vec<PathBuf> =
                std::fs::read_dir(folder).map_or(Vec::new(), |all| all.flatten().map(|e| e.path()).collect());
            let mut inside: Vec<_> = entries.iter().filter(|e| e.join("meta.json").exists()).collect();
            if !inside.is_empty() {
                inside.sort_by_key(|p| crate::files::natural(&p.to_string_lossy()));
                let names: Vec<String> = inside.iter().map(|p| p.display().to_string()).collect();
                return Err(Fault::input(format!("{}: contains no meta.json", folder.display()))
                    .cause("it is the folder above the recordings")
                    .next(format!("give the recording itself: {}", names.join(", "))));
            }
            let files = entries.len();
            return Err(Fault::input(format!("{}: contains no meta.json; {files} other files", folder.display()))
                .cause("an empty folder, pictures without a description, or the folder above the recording")
                .next("write meta.json as docs/file-formats.md shows: the picture's size, the board, the frames"));
        }
        let meta = Meta::load(&path)?;
        let mut recording =
            Recording { folder: folder.to_owned(), meta, channel: Channel::default(), exposure: None, outside: false };
        recording
            .read_frames()
            .map_err(|e| if e.what.contains(&*folder.to_string_lossy()) { e } else { e.at(path.display()) })?;
        Ok(recording)
    }

    /// Reads the frames of a recorder's frames file and numbers their poses.
    fn read_frames(&mut self) -> Result<()> {
        let Some(name) = &self.meta.frames_file else { return Ok(()) };
        let mut frames = frames::load(&self.inside(name)?)?;
        let mut poses = 0;
        for frame in &mut frames {
            if frame.taken.as_ref().is_some_and(|t| t.base_from_flange.is_some()) {
                frame.pose = Some(poses);
                poses += 1;
            }
        }
        self.meta.frames = frames;
        self.meta.check()
    }

    /// The poses that the frames themselves hold, in order.
    fn carried(&self) -> Vec<Rigid<Base, Flange>> {
        self.meta.frames.iter().filter_map(|f| f.taken.as_ref()?.base_from_flange).collect()
    }

    /// Refuses a recording of the other beam, if meta.json states the beam.
    pub fn shows(&self, wanted: Beam) -> Result<()> {
        let name = |b: Beam| if b == Beam::Line { "line" } else { "pointer" };
        match self.meta.beam.filter(|b| *b != wanted) {
            None => Ok(()),
            Some(other) => Err(Fault::input(format!(
                "{}: its laser pictures show the {}, the {} is needed here",
                self.folder.display(),
                name(other),
                name(wanted)
            ))
            .cause("another recording was given, or two were exchanged")
            .next(format!("give the recording of the {}, or correct 'beam' in its meta.json", name(wanted)))),
        }
    }

    /// Depth of the pictures that [`Recording::picture`] returns, bits.
    pub fn bits(&self) -> u8 {
        self.meta.image.response.depth(self.meta.image.bits)
    }

    /// Path of one of the recording's files; refuses a path that leads out of the folder.
    pub fn inside(&self, name: &str) -> Result<PathBuf> {
        let name = raw::place(name).map_or(name, |(file, _)| file);
        let path = self.folder.join(name);
        let plain = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        let within = || match (path.canonicalize(), self.folder.canonicalize()) {
            (Ok(file), Ok(folder)) => file.starts_with(folder),
            // A missing file is reported where it is read.
            _ => true,
        };
        if self.outside || (plain && within()) {
            return Ok(path);
        }
        Err(Fault::input(format!("{}: '{name}' lies outside the recording", self.folder.display()))
            .cause("meta.json comes from elsewhere, or the pictures are links to another place")
            .next("copy the pictures into the recording, or allow it with --pictures-outside"))
    }

    /// Reads a picture of the recording's camera from any path and makes its levels linear. A picture of another
    /// size than meta.json states is refused before it is decoded.
    pub fn load(&self, path: &Path) -> Result<Image> {
        let spec = &self.meta.image;
        let depth = Depth {
            bits: spec.bits,
            declared: "the recording declares",
            correct: "correct image.bits in meta.json, or take the odd pictures out",
            saturates: true,
        };
        let image = crate::raster::load_sized(path, self.channel, depth, [spec.width, spec.height])?;
        Ok(spec.response.linear(image))
    }

    /// Reads one of the recording's pictures and checks its size against `meta.json`.
    pub fn picture(&self, name: &str) -> Result<Image> {
        let path = self.inside(name)?;
        let Some((_, number)) = raw::place(name) else { return self.load(&path) };
        let spec = &self.meta.image;
        Ok(spec.response.linear(raw::load(&path, number, [spec.width, spec.height], spec.bits)?))
    }

    /// One picture from those of a frame, as [`Bracket::merge`] makes it; the names are in the order of the exposures.
    pub fn merged(&self, bracket: &Bracket, names: &[String]) -> Result<(Image, Shares)> {
        let pictures: Vec<Image> = names.iter().map(|name| self.picture(name)).collect::<Result<_>>()?;
        bracket.merge(&pictures)
    }

    /// The picture to subtract from the shots, from those that were taken with the laser off, one for each exposure.
    ///
    /// # Errors
    /// Another number of pictures than exposures; as [`Bracket::merge`].
    pub fn dark(&self, mut pictures: Vec<Image>) -> Result<Option<Image>> {
        let (n, needed) = (pictures.len(), self.meta.exposures_us.len().max(1));
        if n > 0 && n != needed {
            return Err(Fault::usage(format!("{n} ambient pictures, the shots have {needed} exposures"))
                .cause("light with the laser off is subtracted exposure by exposure")
                .next("give --ambient once for each exposure, the shortest first, or not at all"));
        }
        match self.meta.bracket()? {
            Some(bracket) if n > 0 => Ok(Some(bracket.merge(&pictures)?.0)),
            _ => Ok(pictures.pop()),
        }
    }

    /// Uses exposure `n` alone, counted from 1, as if the others had not been taken.
    ///
    /// # Errors
    /// A recording of one exposure; fewer exposures than `n`.
    pub fn use_exposure(&mut self, n: usize) -> Result<()> {
        let meta = &mut self.meta;
        let all = meta.exposures_us.len();
        if !(1..=all).contains(&n) {
            let at = self.folder.display();
            let has = if all == 0 { "its frames have one picture each".into() } else { format!("it has {all}") };
            return Err(Fault::usage(format!("{at}: exposure {n} is wanted, {has}"))
                .cause("exposures are counted from 1, the shortest; another recording was given")
                .next("omit --exposure, or name one that meta.json states"));
        }
        for frame in &mut meta.frames {
            let longer = std::mem::take(&mut frame.longer);
            if let Some(name) = n.checked_sub(2).and_then(|i| longer.into_iter().nth(i)) {
                frame.laser = Some(name);
            }
        }
        (meta.exposures_us, meta.black_level, self.exposure) = (Vec::new(), None, Some(n));
        Ok(())
    }

    /// The pose of frame `index` among `poses`. Frames that name no pose are paired in order, and then there must be
    /// as many poses as frames.
    pub fn pose_of<'a, T>(&self, index: usize, poses: &'a [T]) -> Result<&'a T> {
        let frame = &self.meta.frames[index];
        let frames = self.meta.frames.len();
        if frame.pose.is_none() && poses.len() != frames {
            return Err(Fault::input(format!(
                "frame {index} names no pose; there are {frames} frames and {} poses",
                poses.len()
            ))
            .cause("a picture or a pose was lost, so it is unknown which belong together; or an axis moved, no robot")
            .next("write \"pose\" into every frame of meta.json, or state the \"motion\" of the axis"));
        }
        let k = frame.pose.unwrap_or(index);
        poses.get(k).ok_or_else(|| {
            Fault::input(format!("frame {index} needs pose {k}, the pose file has {}", poses.len()))
                .cause("the pose file belongs to another recording, or ends early")
                .next("export the poses of all pictures again")
        })
    }

    /// The poses of [`Recording::pose_file`].
    pub fn poses(&self, name: Option<&str>) -> Result<Vec<Rigid<Base, Flange>>> {
        self.pose_file(name).map(|f| f.poses)
    }

    /// The poses in file `name` (without extension), or in the file that meta.json names, with warnings about them.
    pub fn pose_file(&self, name: Option<&str>) -> Result<PoseFile> {
        if name.is_none() && self.meta.pose_file.is_none() {
            let poses = self.carried();
            if !poses.is_empty() {
                return Ok(PoseFile::of(poses));
            }
        }
        let name = match (name, &self.meta.pose_file) {
            (Some(n), _) => n,
            (None, Some(n)) => self.inside(n).map(|_| n.as_str())?,
            (None, None) => {
                let there = |name: &str| {
                    let file = |ending: &str| self.folder.join(format!("{name}.{ending}")).exists();
                    if file("csv") || file("json") { name.to_owned() } else { format!("{name} (missing)") }
                };
                let known: Vec<String> = self.meta.pose_files.keys().map(|name| there(name)).collect();
                return Err(Fault::usage(format!("{}: meta.json names no single pose file", self.folder.display()))
                    .cause(if known.is_empty() {
                        "the recording has no poses".into()
                    } else {
                        format!("it lists {}", known.join(", "))
                    })
                    .next("name one with --poses NAME"));
            }
        };
        poses::find_and_load(&self.folder, name)
    }
}
