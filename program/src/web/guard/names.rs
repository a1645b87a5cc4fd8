//! In: a name from a request, and the folder that it must stay in. Out: the path, or an error.
//! Frame and unit: none.

use sheetlight::fault::{Fault, Result};
use std::path::{Path, PathBuf};

/// Most folders in a name.
const DEEPEST: usize = 6;
/// Most bytes of one component of a name.
const LONGEST: usize = 120;

/// Whether a word is allowed as a file name here: letters of any script, digits, spaces and `. _ - + ( )`, no
/// leading dot.
pub fn plain(word: &str) -> bool {
    !word.is_empty()
        && word.len() <= LONGEST
        && !word.starts_with('.')
        && word.trim() == word
        && word.chars().all(|c| c.is_alphanumeric() || " ._-+()".contains(c))
}

/// The path of an existing entry under `root`. Returns an error for names with `..`, absolute names, NUL and other
/// characters, and links that lead outside. The error does not reveal what lies outside.
pub fn resolve(root: &Path, name: &str) -> Result<PathBuf> {
    let words: Vec<&str> = name.split('/').collect();
    if words.len() > DEEPEST || !words.iter().all(|w| plain(w)) {
        return Err(Fault::usage(format!("{name:?} is an invalid file name"))
            .cause("names have letters, digits, blanks and . _ - + ( ), no folder above, at most 6 folders")
            .next("take one from the list"));
    }
    let missing = || {
        Fault::input(format!("{name}: is not there"))
            .cause("it was renamed or taken away meanwhile, or it is a link that leads out of the folder")
            .next("reload the page and take one from the list")
    };
    let real = words.iter().fold(root.to_owned(), |p, w| p.join(w)).canonicalize().map_err(|_| missing())?;
    let root = root.canonicalize().map_err(|_| missing())?;
    if real.starts_with(&root) { Ok(real) } else { Err(missing()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_leads_out_of_the_root() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("root");
        std::fs::create_dir_all(root.join("a/b")).unwrap();
        std::fs::write(dir.path().join("secret"), "x").unwrap();
        assert!(resolve(&root, "a/b").unwrap().ends_with("a/b"));
        let tricks = [
            "..",
            "../secret",
            "a/../../secret",
            "/etc/passwd",
            "a//b",
            "a\0b",
            "a/b\0",
            ".hidden",
            "a\\..\\b",
            "%2e%2e/secret",
            "~root",
            "a/ ",
            "",
            "C:",
            "a/b/c/d/e/f/g",
            "nul\n",
        ];
        for name in tricks {
            assert!(resolve(&root, name).is_err(), "{name:?}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(dir.path().join("secret"), root.join("link")).unwrap();
            std::os::unix::fs::symlink(dir.path(), root.join("up")).unwrap();
            std::os::unix::fs::symlink(root.join("a"), root.join("inward")).unwrap();
            assert!(resolve(&root, "link").is_err() && resolve(&root, "up/secret").is_err());
            assert!(resolve(&root, "inward/b").is_ok(), "a link that stays inside is a name like any other");
        }
    }
}
