//! In: `meta.json`. Out: the recording's contents, with unknown keys, units and versions refused.
//! Frame and unit: mm; pixel centres at integer coordinates.

use super::frame::FrameRef;
use super::{BoardSpec, Motion};
use crate::camera::Readout;
use crate::fault::{Fault, Result};
use crate::raster::{Bracket, MOST_PIXELS, MOST_SIDE, Response};
use std::collections::BTreeMap;
use std::path::Path;

/// Content of `meta.json` (docs/file-formats.md).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Meta {
    /// Version of the file's format; 1 is read.
    pub format: u32,
    /// Name of what was recorded.
    pub set: String,
    /// Unit of boards and poses; only "mm" is read.
    pub units: String,
    /// Properties that all pictures have in common.
    pub image: ImageSpec,
    /// Which laser was on, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beam: Option<Beam>,
    /// The board of all frames, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub board: Option<BoardSpec>,
    /// Several boards; frames refer to them by index.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub boards: Vec<BoardSpec>,
    /// Exposure times of a frame's laser pictures, us, ascending; empty if each frame has one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub exposures_us: Vec<f64>,
    /// Level without light, for pictures of several exposures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub black_level: Option<f64>,
    /// The picture with the laser off that a scan may have.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ambient: Option<AmbientRef>,
    /// The frames, one or more; here or in [`Meta::frames_file`].
    #[serde(default)]
    pub frames: Vec<FrameRef>,
    /// Name of a file with one frame a line (JSON), which a recorder appends to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames_file: Option<String>,
    /// What moved between the frames; if not stated, the robot with the sensor.
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
    /// Free text: description of the part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Path of the part's nominal model, relative to the folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Free text: what was before the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Free text: from where to where a distance is measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance_definition: Option<String>,
}

/// Properties that all pictures of a recording have in common.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageSpec {
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Depth of the sensor's grey levels, bits, 8..=16; picture files with more than 8 have 16.
    pub bits: u8,
    /// Values per pixel of the files: 1, or 3 of colour pictures, of which [`super::Recording::channel`] selects one.
    pub channels: u8,
    /// Relation of the levels to the light: "linear", "srgb", or a gamma.
    pub response: Response,
    /// Coordinates of pixel centres; only "integer coordinates" is read.
    pub pixel_centre: String,
    /// How the pictures were read from the sensor; none if not stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout: Option<Readout>,
}

impl ImageSpec {
    /// Columns and rows, px.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Refuses unsupported pixel conventions, depths and sizes.
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
        if ![1, 3].contains(&self.channels) {
            return refuse(
                format!("image.channels is {}, only 1 (grey) and 3 (colour) are read", self.channels),
                "store the pictures grey, or in colour without other channels",
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

/// Relative difference of two statements of one exposure that is not rounding.
const OTHER_EXPOSURE: f64 = 0.02;

fn refuse(what: String, next: &str) -> Result<()> {
    Err(Fault::input(what).cause("written by another program or by hand").next(next))
}

/// Kind of laser: a sheet or a pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Beam {
    /// A sheet of light: a stripe.
    Line,
    /// A round beam: a spot.
    Pointer,
}

/// The camera that a recording was taken with, and the source of its poses or counts.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sources {
    /// Source of the pictures: the serial number of a network camera, else the camera's address.
    pub camera: String,
    /// Source of poses or counts, if there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<String>,
}

/// A picture with the laser off.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AmbientRef {
    /// File name.
    pub file: String,
    /// Index into the pose file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<usize>,
}

impl Meta {
    /// Reads and checks the file, as [`Meta::parse`] does.
    pub fn load(path: &Path) -> Result<Meta> {
        let text = crate::files::read_text(path)?;
        Meta::parse(&text).map_err(|e| e.at(path.display()))
    }

    /// Parses and checks; refuses unknown keys, units, formats and pixel conventions. The contents of a frames_file
    /// are read and checked by [`super::Recording::open`].
    pub fn parse(text: &str) -> Result<Meta> {
        // A byte order mark has no meaning in UTF-8.
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

    /// The checks of [`Meta::parse`], also used for frames read from their own file.
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
        self.check_exposures()?;
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

    /// Refuses a picture that is named with two poses.
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

    /// The exposures that a frame's pictures are merged from; none if each frame has one picture.
    ///
    /// # Errors
    /// As [`Bracket::new`].
    pub fn bracket(&self) -> Result<Option<Bracket>> {
        if self.exposures_us.is_empty() {
            return Ok(None);
        }
        let bits = self.image.response.depth(self.image.bits);
        Bracket::new(&self.exposures_us, bits, self.black_level.unwrap_or(0.0)).map(Some)
    }

    /// Refuses frames whose pictures are not those of the stated exposures.
    fn check_exposures(&self) -> Result<()> {
        let Some(bracket) = self.bracket()? else {
            if let Some(i) = self.frames.iter().position(|f| !f.longer.is_empty()) {
                return refuse(
                    format!("frame {i} has 'longer' pictures, and their exposures are not stated"),
                    "state \"exposures_us\": the exposure times of a frame's pictures in microseconds, ascending",
                );
            }
            return match self.black_level {
                Some(_) => refuse(
                    "black_level is stated without exposures_us".into(),
                    "leave it out: it is used only where exposures are merged",
                ),
                None => Ok(()),
            };
        };
        let n = bracket.exposures_us().len();
        let mut names = std::collections::BTreeSet::new();
        for (i, f) in self.frames.iter().enumerate() {
            let has = usize::from(f.laser.is_some()) + f.longer.len();
            if has != n && (f.laser.is_some() || has > 0) {
                return Err(Fault::input(format!("frame {i} has {has} pictures of its pose, exposures_us states {n}"))
                    .cause("the picture of an exposure is missing, or one too many is named")
                    .next(
                        "name 'laser' (the shortest exposure) and all 'longer' ones in every frame, or take it out",
                    ));
            }
            if let Some(twice) = f.laser.iter().chain(&f.longer).find(|name| !names.insert(name.as_str())) {
                return refuse(
                    format!("frame {i}: the picture {twice} stands for two exposures or two poses"),
                    "give each exposure of each frame its own picture",
                );
            }
            let taken = f.taken.as_ref().and_then(|t| t.exposure_ns).map(|ns| 1e-3 * ns as f64);
            if let Some(us) = taken.filter(|us| (us / self.exposures_us[0] - 1.0).abs() > OTHER_EXPOSURE) {
                return refuse(
                    format!("frame {i} was taken with {us} us, the first of exposures_us is {}", self.exposures_us[0]),
                    "state what the camera reported",
                );
            }
        }
        Ok(())
    }

    /// Refuses a frame without a picture, or with a board that is not listed.
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
            if f.board.is_none() && f.ambient.is_some() && self.board.is_none() && boards > 1 {
                return refuse(
                    format!("frame {i} does not say which of {boards} boards it shows"),
                    "give the frame a 'board': the index into 'boards', counted from 0",
                );
            }
        }
        Ok(())
    }

    /// What moved between the frames.
    pub fn motion(&self) -> Motion {
        self.motion.clone().unwrap_or_default()
    }

    /// The board of a frame: the one that it names, or the only one.
    pub fn board_of(&self, frame: &FrameRef) -> Option<&BoardSpec> {
        let only = self.boards.first().filter(|_| self.boards.len() == 1);
        frame.board.and_then(|i| self.boards.get(i)).or(self.board.as_ref()).or(only)
    }
}
