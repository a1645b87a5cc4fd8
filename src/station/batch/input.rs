//! In: a recording's folder. Out: the hash by which a manifest names it: SHA-256 of what `sha256sum` prints of its
//! files, sorted by name.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use crate::recording::Recording;
use crate::rig::{hash_file, hash_text};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// More files than this are not one recording.
const MOST_FILES: usize = 1_000_000;

/// The hash of every file in a recording's folder and below. Names that begin with a dot are ignored.
///
/// # Errors
/// A folder that is not a recording, files that cannot be read.
pub(super) fn hash_of(folder: &Path) -> Result<String> {
    if !folder.join("meta.json").is_file() {
        // Its message says what is wrong with it.
        Recording::open(folder)?;
    }
    let mut names = Vec::new();
    list(folder, Path::new(""), &mut names)?;
    let mut names: Vec<(String, PathBuf)> = names.into_iter().map(|p| (slashed(&p), p)).collect();
    names.sort();
    let lines: Vec<String> = names
        .par_iter()
        .map(|(name, path)| Ok(format!("{}  {name}\n", hash_file(&folder.join(path))?)))
        .collect::<Result<_>>()?;
    Ok(hash_text(lines.concat().as_bytes()))
}

fn slashed(path: &Path) -> String {
    path.components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect::<Vec<_>>().join("/")
}

fn list(folder: &Path, within: &Path, names: &mut Vec<PathBuf>) -> Result<()> {
    let at = folder.join(within);
    let entries = std::fs::read_dir(&at).map_err(|e| Fault::read(&at, e))?;
    for entry in entries {
        let entry = entry.map_err(|e| Fault::read(&at, e))?;
        let name = within.join(entry.file_name());
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        let kind = entry.file_type().map_err(|e| Fault::read(&at, e))?;
        if kind.is_dir() {
            list(folder, &name, names)?;
        } else if kind.is_file() || folder.join(&name).is_file() {
            names.push(name);
        }
        if names.len() > MOST_FILES {
            return Err(Fault::input(format!("{}: holds more than {MOST_FILES} files", folder.display()))
                .cause("it is not the folder of one recording")
                .next("name the folder that has the recording's meta.json"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_is_known_by_its_names_and_its_bytes() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
        write("meta.json", "{}");
        std::fs::create_dir(dir.path().join("b")).unwrap();
        write("b/1.png", "one");
        let first = hash_of(dir.path()).unwrap();
        let lines =
            [("b/1.png", "one"), ("meta.json", "{}")].map(|(n, t)| format!("{}  {n}\n", hash_text(t.as_bytes())));
        assert_eq!(first, hash_text(lines.concat().as_bytes()));
        write(".hidden", "left by another program");
        assert_eq!(hash_of(dir.path()).unwrap(), first);
        write("b/2.png", "one");
        assert_ne!(hash_of(dir.path()).unwrap(), first);
        assert!(hash_of(&dir.path().join("b")).unwrap_err().what.contains("contains no meta.json"));
    }
}
