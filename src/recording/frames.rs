//! In: a file with one frame a line, as a recorder writes it while it runs. Out: the frames; a last line that was cut off is none.
//! Frame and unit: as `frames` of meta.json.

use super::frame::FrameRef;
use crate::fault::{Fault, Result};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Longest line that is read, bytes; a recorder's have some hundred.
const LONGEST: usize = 1 << 16;

/// The frames of a file, one after another; more may be written meanwhile.
pub struct FrameLines {
    path: PathBuf,
    reader: BufReader<File>,
    line: Vec<u8>,
    read: usize,
}

impl FrameLines {
    /// Opens the file.
    ///
    /// # Errors
    /// It is not there, or no file.
    pub fn open(path: &Path) -> Result<FrameLines> {
        crate::files::length(path)?;
        let file = File::open(path).map_err(|e| Fault::read(path, e))?;
        Ok(FrameLines { path: path.to_owned(), reader: BufReader::new(file), line: Vec::new(), read: 0 })
    }

    /// The next one; none where the file ends, be it within a line.
    ///
    /// # Errors
    /// A line that is no frame, or longer than any frame's.
    #[allow(clippy::should_implement_trait, reason = "it can fail")]
    pub fn next(&mut self) -> Result<Option<FrameRef>> {
        let room = (LONGEST - self.line.len()) as u64;
        let read = std::io::Read::take(&mut self.reader, room).read_until(b'\n', &mut self.line);
        read.map_err(|e| Fault::read(&self.path, e))?;
        if self.line.last() != Some(&b'\n') && self.line.len() < LONGEST {
            // The end, or what a recorder is writing, or was when it was stopped.
            return Ok(None);
        }
        let frame = serde_json::from_slice(&self.line).map_err(|e| {
            Fault::input(format!("{}: line {} is no frame: {e}", self.path.display(), self.read + 1))
                .cause("the file was edited, or the disk failed")
                .next("correct the line, or leave it out")
        })?;
        self.line.clear();
        self.read += 1;
        Ok(Some(frame))
    }
}

/// Reads the whole file.
///
/// # Errors
/// As [`FrameLines`].
pub(super) fn load(path: &Path) -> Result<Vec<FrameRef>> {
    let (mut lines, mut frames) = (FrameLines::open(path)?, Vec::new());
    while let Some(frame) = lines.next()? {
        frames.push(frame);
    }
    Ok(frames)
}
