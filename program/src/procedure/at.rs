//! In: nothing. Out: the surroundings of a procedure: its station, what names stand for, who hears its remarks.
//! Frame and unit: none.

use sheetlight::fault::Result;
use sheetlight::find::Recipe;
use sheetlight::recording::{BoardSpec, Recording};
use std::path::{Path, PathBuf};

/// What the names in an order stand for.
pub trait Names {
    /// The path of a recording or file.
    ///
    /// # Errors
    /// The order may not name it.
    fn path(&self, name: &str) -> Result<PathBuf>;
    /// The folder of a scan.
    ///
    /// # Errors
    /// There is no such finished scan.
    fn scan(&self, name: &str) -> Result<PathBuf>;
    /// A part's recipe.
    ///
    /// # Errors
    /// It is missing, or cannot be read.
    fn recipe(&self, name: &str) -> Result<Recipe>;
    /// The description of a board.
    ///
    /// # Errors
    /// It is missing, or cannot be read.
    fn board(&self, name: &str) -> Result<BoardSpec>;
    /// The order came from another program: the files that it names must lie inside the recordings.
    fn confined(&self) -> bool;
}

/// Where a procedure is executed.
pub struct At<'a> {
    /// The station's folder.
    pub station: &'a Path,
    /// What the names in the order stand for.
    pub names: &'a dyn Names,
    /// Receives what was assumed, and what is strange about the inputs.
    pub remark: &'a dyn Fn(Remark),
}

/// A sentence for the person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Remark {
    /// An assumption.
    Assumed(String),
    /// A reason for doubt.
    Doubt(String),
}

impl At<'_> {
    /// Opens a recording.
    ///
    /// # Errors
    /// The order may not name it, or it cannot be read.
    pub fn recording(&self, name: &str) -> Result<Recording> {
        Recording::open(&self.names.path(name)?)
    }
    /// Checks the name of a recording's pose file.
    ///
    /// # Errors
    /// It leads out of the recording, and the order is confined.
    pub fn check(&self, recording: &Recording, poses: Option<&str>) -> Result<()> {
        poses.filter(|_| self.names.confined()).map_or(Ok(()), |name| recording.inside(name).map(|_| ()))
    }
    /// Passes reasons for doubt on.
    pub fn doubts(&self, reasons: Vec<String>) {
        reasons.into_iter().for_each(|why| (self.remark)(Remark::Doubt(why)));
    }
}

impl Remark {
    /// The sentence.
    pub fn words(self) -> String {
        let (Remark::Assumed(words) | Remark::Doubt(words)) = self;
        words
    }
}
