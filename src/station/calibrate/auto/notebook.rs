//! In: stops, one after another. Out: two recordings of them (the stripe, the pointer's spot; the pictures in room
//! light are the same). They are complete after every stop, so that `calibrate joint` gives the same result.
//! Frame and unit: base_from_flange, mm; px.

use super::cell::{Cell, Light};
use crate::calibrate::boards::{FindOptions, find};
use crate::calibrate::joint::shots::Reported;
use crate::camera::Readout;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::{Channel, Image, Response, save_png};
use crate::recording::{Beam, BoardSpec, FrameRef, ImageSpec, Meta, Recording, save_poses};
use crate::station::calibrate::joint::gather::{Picture, Stop};
use std::path::{Path, PathBuf};

/// The recordings of the stops so far.
pub struct Notebook {
    folder: PathBuf,
    board: BoardSpec,
    image: Option<ImageSpec>,
    poses: Vec<Rigid<Base, Flange>>,
    /// Every stop, in order.
    pub stops: Vec<Stop>,
    /// Number of poses at which pictures were taken, whether or not the board was found.
    pub visits: usize,
}

/// Names of the two recordings.
const NAMES: [(&str, Beam); 2] = [("line", Beam::Line), ("pointer", Beam::Pointer)];

impl Notebook {
    /// An empty notebook; its folder must be new or empty, so that no other recording is overwritten.
    pub fn new(folder: &Path, board: &BoardSpec) -> Result<Notebook> {
        let taken = std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
        if taken {
            return Err(Fault::usage(format!("{}: holds files already", folder.display()))
                .cause("a calibration's pictures go into a folder of their own")
                .next("name a new folder"));
        }
        for (name, _) in NAMES {
            crate::files::make_folder(&folder.join(name))?;
        }
        Ok(Notebook {
            folder: folder.into(),
            board: board.clone(),
            image: None,
            poses: vec![],
            stops: vec![],
            visits: 0,
        })
    }

    /// Takes the pictures at the robot's present pose. `None` if the whole board is not found: then nothing is
    /// stored, and the second value is the reason.
    pub fn stop(&mut self, cell: &mut dyn Cell, pose: &Rigid<Base, Flange>) -> Result<(Option<usize>, String)> {
        let room = cell.picture(Light::Room)?;
        self.visits += 1;
        self.same_pictures(&room, cell.readout())?;
        let view = match find(&room, &self.board, &FindOptions::default()) {
            Ok(view) => view,
            Err(fault) => return Ok((None, format!("{} ({})", fault.what, fault.cause))),
        };
        if view.ambiguous {
            return Err(Fault::input("the board looks the same after a turn: its origin is not determined")
                .cause("a chessboard with even or odd numbers of corners both ways, or a symmetric circle grid")
                .next("use a board with one even and one odd number of corners, or a ChArUco board"));
        }
        let lit = [cell.picture(Light::Line)?, cell.picture(Light::Pointer)?];
        let i = self.stops.len();
        let file = |what: &str| format!("{what}_{i:04}.png");
        for ((name, _), laser) in NAMES.iter().zip(&lit) {
            let folder = self.folder.join(name);
            save_png(&room, &folder.join(file("ambient")))?;
            save_png(laser, &folder.join(file("laser")))?;
        }
        self.poses.push(*pose);
        self.stops.push(Stop {
            name: file("ambient"),
            board: self.board.clone(),
            view,
            robot: Some(Reported { pose: *pose, place: 0 }),
            room: Picture { recording: 0, file: file("ambient") },
            line: Some(Picture { recording: 0, file: file("laser") }),
            pointer: Some(Picture { recording: 1, file: file("laser") }),
        });
        self.write()?;
        Ok((Some(i), String::new()))
    }

    fn same_pictures(&mut self, picture: &Image, readout: Option<Readout>) -> Result<()> {
        let spec = ImageSpec {
            width: picture.width,
            height: picture.height,
            bits: picture.bits,
            channels: 1,
            response: Response::Linear,
            pixel_centre: "integer coordinates".into(),
            readout,
        };
        match self.image.get_or_insert_with(|| spec.clone()) {
            known if *known == spec => Ok(()),
            known => Err(Fault::input(format!(
                "the camera delivers {} now and delivered {} before",
                said(&spec),
                said(known)
            ))
            .cause("its settings were changed while it calibrates, or another camera answered")
            .next("begin again")),
        }
    }

    fn meta(&self, beam: Beam) -> Option<Meta> {
        let file = |what: &str, i: usize| Some(format!("{what}_{i:04}.png"));
        let frame = |i: usize| FrameRef {
            laser: file("laser", i),
            ambient: file("ambient", i),
            pose: Some(i),
            ..FrameRef::default()
        };
        Some(Meta {
            format: 1,
            set: "calibrate auto".into(),
            units: "mm".into(),
            image: self.image.clone()?,
            beam: Some(beam),
            board: Some(self.board.clone()),
            boards: vec![],
            ambient: None,
            frames: (0..self.stops.len()).map(frame).collect(),
            motion: None,
            pose_file: Some("poses".into()),
            pose_files: Default::default(),
            exposures_us: Vec::new(),
            black_level: None,
            frames_file: None,
            sources: None,
            part: None,
            model: None,
            target: None,
            distance_definition: None,
        })
    }

    fn write(&self) -> Result<()> {
        for (name, beam) in NAMES {
            let folder = self.folder.join(name);
            save_poses(&folder.join("poses.json"), &self.poses)?;
            let meta = serde_json::to_string_pretty(&self.meta(beam)).expect("plain data");
            crate::files::write(&folder.join("meta.json"), meta.as_bytes())?;
        }
        Ok(())
    }

    /// Both recordings in their present state.
    pub fn recordings(&self) -> Vec<Recording> {
        let open = |(name, beam): (&str, Beam)| {
            let folder = self.folder.join(name);
            Some(Recording {
                folder,
                meta: self.meta(beam)?,
                channel: Channel::default(),
                exposure: None,
                outside: false,
            })
        };
        NAMES.into_iter().filter_map(open).collect()
    }
}

fn said(image: &ImageSpec) -> String {
    let ImageSpec { width, height, bits, .. } = image;
    format!("{width}x{height} of {bits} bits{}", image.readout.map_or(String::new(), |r| format!(" ({r})")))
}
