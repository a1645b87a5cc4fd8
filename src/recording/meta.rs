//! In: `meta.json`. Out: the recording's contents, with unknown keys, units and versions refused.
//! Frame and unit: mm; pixel centres at integer coordinates.

use super::frame::FrameRef;
use super::{BoardSpec, Motion};
use crate::camera::Readout;
use crate::fault::{Fault, Result};
use crate::raster::{MOST_PIXELS, MOST_SIDE, Response};
use std::collections::BTreeMap;
use std::path::Path;

/// Content of `meta.json` (docs/file-formats.md).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Meta {
    /// Version of the file's format; 1 is read.
    pub format: u32,
    /// A name for what was recorded.
    pub set: String,
    /// Unit of boards and poses; only "mm" is read.
    pub units: String,
    /// What all pictures have in common.
    pub image: ImageSpec,
    /// Which laser was on, where one was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beam: Option<Beam>,
    /// The board of all frames, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub board: Option<BoardSpec>,
    /// Several boards; frames refer to them by index.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub boards: Vec<BoardSpec>,
    /// The one picture with the laser off, where a scan has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ambient: Option<AmbientRef>,
    /// The moments, one or more; here or in [`Meta::frames_file`].
    #[serde(default)]
    pub frames: Vec<FrameRef>,
    /// Name of a file with one frame a line (JSON), which a recorder appends to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames_file: Option<String>,
    /// What moved between the frames; the robot with the sensor where nothing is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Motion>,
    /// The devices that it was recorded from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sources: Option<Sources>,
    /// Name of the pose file without extension.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose_file: Option<String>,
    /// Several pose files for the same pictures, with what they are.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub pose_files: BTreeMap<String, String>,
    /// Free text: the part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Path of the part's nominal model, relative to the folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Free text: what stood before the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Free text: from where to where a distance is measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance_definition: Option<String>,
}

/// What all pictures of a recording have in common.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageSpec {
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Depth of the sensor's grey levels, 8..=16; files of more than 8 have 16.
    pub bits: u8,
    /// Values a pixel, 1; [`super::Recording::channel`] makes one of a colour picture's three.
    pub channels: u8,
    /// How the levels follow the light: "linear", "srgb", or a gamma.
    pub response: Response,
    /// Where pixel centres are; only "integer coordinates" is read.
    pub pixel_centre: String,
    /// How they were read from the sensor; none where nobody said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout: Option<Readout>,
}

impl ImageSpec {
    /// Columns and rows, px.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Refuses pixel conventions, depths and sizes that are not read.
    fn check(&self) -> Result<()> {
        if self.pixel_centre != "integer coordinates" {
            return refuse(
                format!("pixel_centre is '{}', only 'integer coordinates' is read", self.pixel_centre),
                "say where the pixel centres are",
            );
        }
        if !(8..=16).contains(&self.bits) || self.width == 0 || self.height == 0 {
            return refuse(
                format!("image {}x{} with {} bits is out of range", self.width, self.height, self.bits),
                "bits must be 8 to 16 and the size at least 1x1",
            );
        }
        if let Some(readout) = self.readout.filter(|r| r.step().contains(&0)) {
            return refuse(format!("readout is {readout}"), "binning and decimation are 1 or more");
        }
        let [w, h] = [self.width, self.height];
        if w.max(h) > MOST_SIDE || u64::from(w) * u64::from(h) > MOST_PIXELS {
            return refuse(
                format!("image {w}x{h} is too large: limit {MOST_SIDE} a side, {MOST_PIXELS} pixels in all"),
                "give the size of the sensor's pictures",
            );
        }
        Ok(())
    }
}

fn refuse(what: String, next: &str) -> Result<()> {
    Err(Fault::input(what).cause("written by another program or by hand").next(next))
}

/// What the laser is: a sheet or a pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Beam {
    /// A sheet of light: a stripe.
    Line,
    /// A round beam: a spot.
    Pointer,
}

/// Which camera a recording was taken with, and who told where things stood.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sources {
    /// The source of the pictures: of a camera on a network its serial number, else how it is addressed.
    pub camera: String,
    /// The source of poses or counts, where there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<String>,
}

/// A picture with the laser off.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AmbientRef {
    /// File name.
    pub file: String,
    /// Index into the pose file: where it was taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<usize>,
}

impl Meta {
    /// Reads and checks the file, as [`Meta::parse`] does.
    pub fn load(path: &Path) -> Result<Meta> {
        let text = crate::files::read_text(path)?;
        Meta::parse(&text).map_err(|e| e.at(path.display()))
    }

    /// Parses and checks; refuses unknown keys, units, formats and pixel conventions. What a frames_file holds is
    /// read and checked by [`super::Recording::open`].
    pub fn parse(text: &str) -> Result<Meta> {
        // A mark of the byte order says nothing in UTF-8.
        let meta: Meta = serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| {
            Fault::input(format!("is not a recording's meta.json: {e}"))
                .cause(crate::files::slip_in(
                    text,
                    e.line(),
                    "a misspelt key, a missing entry, or a file of another program",
                ))
                .next("compare it with docs/file-formats.md")
        })?;
        if meta.frames_file.is_none() {
            meta.check()?;
        } else if !meta.frames.is_empty() {
            return Err(Fault::input("frames are in meta.json and in a frames_file")
                .cause("meta.json was edited, or merged from two files")
                .next("leave one of them out"));
        }
        Ok(meta)
    }

    /// [`Meta::parse`]'s, of frames that were read from their own file.
    pub(super) fn check(&self) -> Result<()> {
        if self.format != 1 {
            return refuse(
                format!("format is {}, this version reads 1", self.format),
                "use a newer sheetlight, or export the recording again",
            );
        }
        if self.units != "mm" {
            return refuse(
                format!("units are '{}', only 'mm' is read", self.units),
                "convert boards and poses to millimetres",
            );
        }
        self.image.check()?;
        if self.frames.is_empty() {
            return refuse("the recording has no frames".into(), "record at least one shot");
        }
        for board in self.boards.iter().chain(&self.board) {
            board.check()?;
        }
        self.check_poses()?;
        match &self.motion {
            Some(motion) => motion.check(&self.frames)?,
            None if self.frames.iter().any(|f| f.count.is_some() || f.trigger.is_some()) => {
                return refuse(
                    "frames have a 'count' or 'trigger', and 'motion' does not say of what".into(),
                    "state \"motion\": its kind, unit and what it carries (docs/file-formats.md)",
                );
            }
            None => {}
        }
        self.check_references()
    }

    /// A picture was taken at one pose.
    fn check_poses(&self) -> Result<()> {
        let mut taken: BTreeMap<&str, (usize, Option<usize>)> = BTreeMap::new();
        for (i, f) in self.frames.iter().enumerate() {
            let Some(name) = &f.laser else { continue };
            match taken.insert(name, (i, f.pose)) {
                Some((first, pose)) if pose != f.pose => {
                    return refuse(
                        format!("frames {first} and {i} name the same picture {name} at two poses"),
                        "give each frame its own picture",
                    );
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Every frame has a picture, and its board is there.
    fn check_references(&self) -> Result<()> {
        let boards = self.boards.len() + usize::from(self.board.is_some());
        for (i, f) in self.frames.iter().enumerate() {
            if f.laser.is_none() && f.ambient.is_none() {
                return refuse(format!("frame {i} names no picture"), "give it a 'laser' or an 'ambient' picture");
            }
            if f.board.is_some_and(|b| b >= boards) {
                return refuse(
                    format!("frame {i} refers to board {}, {boards} are described", f.board.unwrap_or(0)),
                    "describe the board under 'boards'",
                );
            }
        }
        Ok(())
    }

    /// What moved between the frames.
    pub fn motion(&self) -> Motion {
        self.motion.clone().unwrap_or_default()
    }

    /// The board of a frame: its own, or the only one there is.
    pub fn board_of(&self, frame: &FrameRef) -> Option<&BoardSpec> {
        frame.board.and_then(|i| self.boards.get(i)).or(self.board.as_ref()).or(self.boards.first())
    }
}
