//! In: a file with one frame a line, which a recorder appends to while it runs. Out: the frames; an incomplete last
//! line is ignored.
//! Frame and unit: as `frames` of meta.json.

use super::frame::FrameRef;
use crate::fault::{Fault, Result};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Longest line that is read, bytes; a recorder's lines have some hundred.
const LONGEST: usize = 1 << 16;

/// Reads the file. Refuses a line in the middle that is not a frame, and a line longer than any frame's.
pub(super) fn load(path: &Path) -> Result<Vec<FrameRef>> {
    crate::files::length(path)?;
    let file = std::fs::File::open(path).map_err(|e| Fault::read(path, e))?;
    let (mut reader, mut frames, mut line) = (BufReader::new(file), Vec::new(), Vec::new());
    loop {
        line.clear();
        let read = std::io::Read::take(&mut reader, LONGEST as u64).read_until(b'\n', &mut line);
        read.map_err(|e| Fault::read(path, e))?;
        if line.last() != Some(&b'\n') && line.len() < LONGEST {
            // The end of the file, or the line that the recorder was writing when it was stopped.
            return Ok(frames);
        }
        let frame = serde_json::from_slice(&line).map_err(|e| {
            Fault::input(format!("{}: line {} is not a frame: {e}", path.display(), frames.len() + 1))
                .cause("the file was edited, or the disk failed")
                .next("correct or remove the line")
        })?;
        frames.push(frame);
    }
}

/// Reads frames in order from a file that a recorder is still writing.
pub struct FollowedFrames {
    path: PathBuf,
    reader: BufReader<std::fs::File>,
    next: usize,
    line: Vec<u8>,
}

impl FollowedFrames {
    /// Opens `frames.jsonl`.
    ///
    /// # Errors
    /// The file does not exist.
    pub fn open(path: &Path) -> Result<FollowedFrames> {
        let file = std::fs::File::open(path).map_err(|e| Fault::read(path, e))?;
        Ok(FollowedFrames { path: path.to_owned(), reader: BufReader::new(file), next: 0, line: Vec::new() })
    }

    /// Frame `index`, which the recorder must have written already. Indices of successive calls must ascend.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn frame(&mut self, index: usize) -> Result<FrameRef> {
        while self.next <= index {
            self.line.clear();
            let read = std::io::Read::take(&mut self.reader, LONGEST as u64).read_until(b'\n', &mut self.line);
            read.map_err(|e| Fault::read(&self.path, e))?;
            self.next += 1;
        }
        serde_json::from_slice(&self.line).map_err(|e| {
            Fault::input(format!("{}: line {} is not a frame: {e}", self.path.display(), index + 1))
                .cause("another program writes into the recording, or the disk failed")
                .next("check the disk; the finished part can be scanned")
        })
    }
}
