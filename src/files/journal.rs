//! In: lines, one after the other. Out: a file that grows by whole lines, each on the disk before the call returns.
//! A line that a crash cut off is ended before the next line is written.
//! Frame and unit: none; text.

use crate::fault::{Fault, Result};
use std::fs::OpenOptions;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Appends a line to a file, which is created if missing.
pub fn append_line(path: &Path, line: &str) -> Result<()> {
    let write = || -> std::io::Result<()> {
        super::moment::moment()?;
        let mut file = OpenOptions::new().create(true).append(true).read(true).open(path)?;
        let mut text = String::with_capacity(line.len() + 2);
        if file.metadata()?.len() > 0 {
            let mut last = [0];
            file.seek(SeekFrom::End(-1))?;
            file.read_exact(&mut last)?;
            if last != *b"\n" {
                text.push('\n');
            }
        }
        text.extend(line.chars().filter(|c| *c != '\n'));
        text.push('\n');
        file.write_all(text.as_bytes())?;
        file.sync_data()
    };
    write().map_err(|e| Fault::write(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_follow_each_other_and_a_torn_one_stays_alone() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("log.jsonl");
        append_line(&path, "1").unwrap();
        std::fs::write(&path, "1\n{\"to").unwrap();
        append_line(&path, "2").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "1\n{\"to\n2\n");
    }
}
