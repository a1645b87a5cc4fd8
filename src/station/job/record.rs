//! In: pictures and the poses at which they were taken. Out: a recording in the recording format; it is complete
//! when its meta.json exists.
//! Frame and unit: base_from_flange, mm.

use crate::arm::TimedPose;
use crate::capture::Pictures;
use crate::fault::Result;
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::{Image, Response, save_png};
use crate::recording::{AmbientRef, Beam, FrameRef, ImageSpec, Meta, Recording, save_poses};
use std::path::{Path, PathBuf};

/// A recording that is being written.
pub struct Record {
    folder: PathBuf,
    meta: Meta,
    poses: Vec<Rigid<Base, Flange>>,
}

impl Record {
    /// Begins a recording; a meta.json in the folder is removed.
    pub fn begin(folder: &Path, name: &str, beam: Beam, pictures: Pictures) -> Result<Record> {
        crate::files::make_folder(folder)?;
        let meta = folder.join("meta.json");
        crate::files::remove(&meta).map_err(|e| crate::fault::Fault::write(&meta, e))?;
        let Pictures { format, readout } = pictures;
        let image = ImageSpec {
            width: format.width,
            height: format.height,
            bits: format.bits,
            channels: 1,
            response: Response::Linear,
            pixel_centre: "integer coordinates".into(),
            readout,
        };
        let meta = Meta {
            format: 1,
            set: name.into(),
            units: "mm".into(),
            image,
            beam: Some(beam),
            board: None,
            boards: vec![],
            ambient: None,
            frames: vec![],
            exposures_us: Vec::new(),
            black_level: None,
            frames_file: None,
            sources: None,
            motion: None,
            pose_file: Some("poses".into()),
            pose_files: Default::default(),
            part: None,
            model: None,
            target: None,
            distance_definition: None,
        };
        Ok(Record { folder: folder.to_owned(), meta, poses: Vec::new() })
    }

    /// Adds a picture with the laser on.
    pub fn shot(&mut self, picture: &Image, at: &TimedPose) -> Result<()> {
        let (k, name) = (self.poses.len(), format!("laser_{:04}.png", self.meta.frames.len()));
        save_png(picture, &self.folder.join(&name))?;
        self.meta.frames.push(FrameRef { laser: Some(name), pose: Some(k), ..FrameRef::default() });
        self.poses.push(at.base_from_flange);
        Ok(())
    }

    /// Adds the one picture in room light.
    pub fn ambient(&mut self, picture: &Image, at: &TimedPose) -> Result<()> {
        save_png(picture, &self.folder.join("ambient.png"))?;
        self.meta.ambient = Some(AmbientRef { file: "ambient.png".into(), pose: Some(self.poses.len()) });
        self.poses.push(at.base_from_flange);
        Ok(())
    }

    /// Completes the recording.
    pub fn end(self) -> Result<Recording> {
        save_poses(&self.folder.join("poses.json"), &self.poses)?;
        let text = serde_json::to_string_pretty(&self.meta).expect("plain data");
        crate::files::write(&self.folder.join("meta.json"), text.as_bytes())?;
        Recording::open(&self.folder)
    }
}
