//! In: the path of a file that another program or a person wrote. Out: its bytes or its text, within a size limit.
//! It never waits for a sender.
//! Frame and unit: bytes.

use crate::fault::{Fault, Result};
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Largest text file that a program writes (poses, meta.json of a long recording).
const MOST_TEXT: u64 = 64 << 20;

/// The byte order mark.
const MARK: char = '\u{feff}';

/// Length of a file in bytes. Returns an error for a pipe, a device or a folder: its bytes may never come, or never
/// end.
pub fn length(path: &Path) -> Result<u64> {
    let found = std::fs::metadata(path).map_err(|e| Fault::read(path, e))?;
    if !found.is_file() {
        let kind = if found.is_dir() { "a folder" } else { "a pipe or a device" };
        return Err(Fault::input(format!("{}: is {kind}, not a file", path.display()))
            .cause("the path is wrong")
            .next("give a file; what comes through a pipe has to be stored in one first"));
    }
    Ok(found.len())
}

/// The bytes of a file. Returns an error if there are more than `most`.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    let (found, mut bytes) = (length(path)?, Vec::new());
    // The file may grow meanwhile.
    if found <= most {
        let read = std::fs::File::open(path).and_then(|f| f.take(most + 1).read_to_end(&mut bytes));
        read.map_err(|e| Fault::read(path, e))?;
    }
    let length = found.max(bytes.len() as u64);
    if length > most {
        return Err(Fault::input(format!("{}: is {length} bytes long, at most {most} are read", path.display()))
            .cause("another file than the one that is meant here, or a damaged one")
            .next("give the file that is meant here"));
    }
    Ok(bytes)
}

/// The text of a UTF-8 file, without the byte order mark that some editors put before it.
pub fn read_text(path: &Path) -> Result<String> {
    let text = String::from_utf8(read(path, MOST_TEXT)?);
    let mut text = text.map_err(|e| Fault::read(path, std::io::Error::new(ErrorKind::InvalidData, e.utf8_error())))?;
    if text.starts_with(MARK) {
        text.drain(..MARK.len_utf8());
    }
    Ok(text)
}

/// [`read_text`]; `None` if the file does not exist.
pub fn read_text_if_there(path: &Path) -> Result<Option<String>> {
    match std::fs::metadata(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        _ => read_text(path).map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_is_read_than_there_may_be() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("a"), "\u{feff}12345").unwrap();
        assert_eq!(read_text(&at("a")).unwrap(), "12345");
        assert_eq!(read(&at("a"), 8).unwrap().len(), 8);
        assert!(read(&at("a"), 7).unwrap_err().what.contains("8 bytes long, at most 7"));
        assert!(read(dir.path(), 9).unwrap_err().what.contains("a folder"));
        assert_eq!(read_text_if_there(&at("none")).unwrap(), None);
        std::fs::write(at("b"), [0xff, 0xfe, b'1', 0]).unwrap();
        assert!(read_text(&at("b")).unwrap_err().next.contains("UTF-8"));
        #[cfg(unix)]
        assert!(read(Path::new("/dev/zero"), 9).unwrap_err().what.contains("a device"));
    }
}
