//! In: the program's start options. Out: the folders of a station.
//! Frame and unit: none.

use crate::web::message::Mode;
use std::path::PathBuf;

/// Folders of one station.
#[derive(Clone, Debug)]
pub struct Place {
    /// The station: station.toml and calibrations; jobs and recipes are stored in it.
    pub station: PathBuf,
    /// Folder that contains the recordings.
    pub recordings: PathBuf,
    /// Source of the pictures.
    pub mode: Mode,
}

impl Place {
    /// Folder of the jobs, with one folder per job.
    pub fn jobs(&self) -> PathBuf {
        self.station.join("jobs")
    }
    /// Descriptions of calibration boards.
    pub fn boards(&self) -> PathBuf {
        self.station.join("boards")
    }
    /// Recipes of this station.
    pub fn recipes(&self) -> PathBuf {
        self.station.join("recipes")
    }
}
