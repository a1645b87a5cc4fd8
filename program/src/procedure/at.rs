//! In: nothing. Out: the surroundings of a procedure: its station, how names become paths, who hears its remarks.
//! Frame and unit: none.

use sheetlight::fault::Result;
use sheetlight::recording::Recording;
use std::path::{Path, PathBuf};

/// Where a procedure is executed.
pub struct At<'a> {
    /// The station's folder.
    pub station: &'a Path,
    /// Makes the path of a recording or file that the order names.
    pub path: &'a dyn Fn(&str) -> Result<PathBuf>,
    /// The order came from another program: the files that it names must lie inside the recordings.
    pub confined: bool,
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
    /// Checks the name of a recording's pose file.
    ///
    /// # Errors
    /// It leads out of the recording, and the order is confined.
    pub fn check(&self, recording: &Recording, poses: Option<&str>) -> Result<()> {
        poses.filter(|_| self.confined).map_or(Ok(()), |name| recording.inside(name).map(|_| ()))
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
