//! In: what the program was started with. Out: where a station's things lie.
//! Frame and unit: none.

use crate::web::message::Mode;
use std::path::PathBuf;

/// Folders of one station.
#[derive(Clone, Debug)]
pub struct Place {
    /// The station: station.toml and calibrations; jobs and recipes are written into it.
    pub station: PathBuf,
    /// Recordings lie below this.
    pub recordings: PathBuf,
    /// Where pictures come from.
    pub mode: Mode,
}

impl Place {
    /// A folder a job.
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
