//! In: a recording folder (`meta.json`, pictures, `poses*.json|csv`). Out: what it contains, checked.
//! Frame and unit: poses are base_from_flange in mm; boards in mm; see docs/file-formats.md.

mod board;
mod board_poses;
mod markers;
mod meta;
mod poses;

pub use board::BoardSpec;
pub use board_poses::load_board_poses;
pub use markers::Markers;
pub use meta::{AmbientRef, Beam, FrameRef, ImageSpec, Meta};
pub use poses::{PoseFile, load_poses, save_poses};

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::{Channel, Image};
use std::path::{Path, PathBuf};

/// A recording on disk. Pictures are read one at a time, never all at once.
#[derive(Clone, Debug)]
pub struct Recording {
    pub folder: PathBuf,
    pub meta: Meta,
    /// Which part of colour pictures is used.
    pub channel: Channel,
}

impl Recording {
    /// Opens a folder and checks `meta.json`.
    pub fn open(folder: &Path) -> Result<Recording> {
        if !folder.is_dir() {
            return Err(Fault::input(format!("{}: is no folder", folder.display()))
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
                return Err(Fault::input(format!("{}: holds no meta.json", folder.display()))
                    .cause("it is the folder above the recordings")
                    .next(format!("give the recording itself: {}", names.join(", "))));
            }
            let files = entries.len();
            return Err(Fault::input(format!("{}: holds no meta.json; {files} other files", folder.display()))
                .cause("an empty folder, pictures that nobody described, or the folder above the recording")
                .next("write meta.json as docs/file-formats.md shows: the picture's size, the board, the frames"));
        }
        let meta = Meta::load(&path)?;
        Ok(Recording { folder: folder.to_owned(), meta, channel: Channel::default() })
    }

    /// Refuses a recording of the other beam, where meta.json says which one it shows.
    pub fn shows(&self, wanted: Beam) -> Result<()> {
        let name = |b: Beam| if b == Beam::Line { "line" } else { "pointer" };
        match self.meta.beam.filter(|b| *b != wanted) {
            None => Ok(()),
            Some(other) => Err(Fault::input(format!(
                "{}: its laser pictures show the {}, the {} is wanted here",
                self.folder.display(),
                name(other),
                name(wanted)
            ))
            .cause("another recording was given, or two were exchanged")
            .next(format!("give the recording of the {}, or correct 'beam' in its meta.json", name(wanted)))),
        }
    }

    /// Reads one of the recording's pictures and checks its size against `meta.json`.
    pub fn picture(&self, name: &str) -> Result<Image> {
        let path = self.folder.join(name);
        let image = crate::raster::load(&path, self.channel, self.meta.image.bits)?;
        let (w, h) = (self.meta.image.width, self.meta.image.height);
        if (image.width, image.height) != (w, h) {
            return Err(Fault::input(format!(
                "{}: is {}x{}, meta.json says {w}x{h}",
                path.display(),
                image.width,
                image.height
            ))
            .cause("pictures of two cameras or two resolutions in one folder")
            .next("correct meta.json, or take the odd pictures out"));
        }
        Ok(image)
    }

    /// The poses of [`Recording::pose_file`].
    pub fn poses(&self, name: Option<&str>) -> Result<Vec<Rigid<Base, Flange>>> {
        self.pose_file(name).map(|f| f.poses)
    }

    /// The poses in file `name` (without extension), or in the file that meta.json names, and what a person should know of them.
    pub fn pose_file(&self, name: Option<&str>) -> Result<PoseFile> {
        let name = match (name, &self.meta.pose_file) {
            (Some(n), _) => n,
            (None, Some(n)) => n.as_str(),
            (None, None) => {
                let known: Vec<&str> = self.meta.pose_files.keys().map(String::as_str).collect();
                return Err(Fault::usage(format!("{}: meta.json names no single pose file", self.folder.display()))
                    .cause(if known.is_empty() {
                        "the recording has no poses".into()
                    } else {
                        format!("it has several: {}", known.join(", "))
                    })
                    .next("name one with --poses NAME"));
            }
        };
        poses::find_and_load(&self.folder, name)
    }
}
