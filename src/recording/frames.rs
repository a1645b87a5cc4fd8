//! In: a file with one frame a line, as a recorder writes it while it runs. Out: the frames; a last line that was cut
//! off is none.
//! Frame and unit: as `frames` of meta.json.

use super::frame::FrameRef;
use crate::fault::{Fault, Result};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Longest line that is read, bytes; a recorder's have some hundred.
const LONGEST: usize = 1 << 16;

/// Reads the file. Refused: a line in the middle that is no frame, a line longer than any frame's.
pub(super) fn load(path: &Path) -> Result<Vec<FrameRef>> {
    crate::files::length(path)?;
    let file = std::fs::File::open(path).map_err(|e| Fault::read(path, e))?;
    let (mut reader, mut frames, mut line) = (BufReader::new(file), Vec::new(), Vec::new());
    loop {
        line.clear();
        let read = std::io::Read::take(&mut reader, LONGEST as u64).read_until(b'\n', &mut line);
        read.map_err(|e| Fault::read(path, e))?;
        if line.last() != Some(&b'\n') && line.len() < LONGEST {
            // The end, or what a recorder was writing when it was stopped.
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

/// Frames of a file that a recorder is still writing, read in order.
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
    /// There is none.
    pub fn open(path: &Path) -> Result<FollowedFrames> {
        let file = std::fs::File::open(path).map_err(|e| Fault::read(path, e))?;
        Ok(FollowedFrames { path: path.to_owned(), reader: BufReader::new(file), next: 0, line: Vec::new() })
    }

    /// Frame `index`, which the recorder has written; after the one that was asked for before.
    ///
    /// # Errors
    /// The disk does not give it back.
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
