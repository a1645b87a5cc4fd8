//! In: a file with one frame a line, as a recorder writes it while it runs. Out: the frames; a last line that was cut off is none.
//! Frame and unit: as `frames` of meta.json.

use super::frame::FrameRef;
use crate::fault::{Fault, Result};
use std::io::{BufRead, BufReader};
use std::path::Path;

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
            Fault::input(format!("{}: line {} is no frame: {e}", path.display(), frames.len() + 1))
                .cause("the file was edited, or the disk failed")
                .next("correct the line, or leave it out")
        })?;
        frames.push(frame);
    }
}
