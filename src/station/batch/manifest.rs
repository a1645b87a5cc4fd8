//! In: a list of recordings, each by its hash and its folder, or the folders alone. Out: the list, checked, read line
//! by line however long it is.
//! Frame and unit: lines, counted from 1.

use super::input::hash_of;
use crate::fault::{Fault, Result};
use crate::rig::hash_text;
use sha2::{Digest, Sha256};
use std::fmt::Write;
use std::io::{BufRead, BufReader, Read};
use std::path::{Component, Path, PathBuf};

/// What a batch can hold, so that checking it stays within the memory that docs/archives.md states.
const MOST: u64 = 4_000_000;
/// Bytes of a line: a hash, two blanks and the longest path of a system.
const MOST_OF_A_LINE: u64 = 64 + 2 + 4096 + 2;

/// One recording of a manifest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// SHA-256 of the recording.
    pub input: String,
    /// Its folder as the manifest names it.
    pub name: String,
}

enum From {
    File(PathBuf),
    Text(String),
}

/// A list of recordings.
pub struct Manifest {
    from: From,
    root: PathBuf,
    recordings: u64,
    sha256: String,
}

impl Manifest {
    /// Reads a manifest and checks it: hashes and names are well formed, and no recording is in it twice. Folders are
    /// relative to its own.
    ///
    /// # Errors
    /// What is not a manifest, recordings that are named twice, none at all.
    pub fn open(path: &Path) -> Result<Manifest> {
        crate::files::length(path)?;
        let root = path.parent().unwrap_or(Path::new(""));
        Manifest::checked(From::File(path.to_owned()), root).map_err(|e| e.at(path.display()))
    }

    /// The manifest of these folders, as they are named from where the process runs.
    ///
    /// # Errors
    /// Folders that are named twice, none at all. `failed` hears of those that are not recordings.
    pub fn of(folders: &[PathBuf], mut failed: impl FnMut(&Path, Fault)) -> Result<Manifest> {
        let mut text = String::new();
        for folder in folders {
            match hash_of(folder).and_then(|input| Ok((input, named(folder)?))) {
                Ok((input, name)) => writeln!(text, "{input}  {name}").expect("memory takes text"),
                Err(fault) => failed(folder, fault),
            }
        }
        Manifest::checked(From::Text(text), Path::new(""))
    }

    fn checked(from: From, root: &Path) -> Result<Manifest> {
        let mut manifest = Manifest { from, root: root.to_owned(), recordings: 0, sha256: String::new() };
        let (mut inputs, mut names) = (Vec::new(), Vec::new());
        let mut hash = Sha256::new();
        manifest.lines(|number, entry| {
            if inputs.len() as u64 >= MOST {
                return Err(Fault::input(format!("names more than {MOST} recordings"))
                    .cause("more than one batch holds")
                    .next("split the manifest, and give each part another --out"));
            }
            inputs.push((first_half(&entry.input), number));
            names.push((first_half(&hash_text(entry.name.as_bytes())), number));
            hash.update(line(&entry).as_bytes());
            Ok(())
        })?;
        if inputs.is_empty() {
            return Err(Fault::usage("0 recordings, 1 or more needed")
                .cause("an empty manifest, or folders that are not recordings")
                .next("make a manifest with sheetlight batch manifest, or name the folders of the recordings"));
        }
        manifest.recordings = inputs.len() as u64;
        unique(&mut names, "name one folder", "a line was copied")?;
        unique(&mut inputs, "have one hash", "a folder was copied, or is in the list by two names")?;
        manifest.sha256 = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
        Ok(manifest)
    }

    /// How many recordings it names.
    pub fn recordings(&self) -> u64 {
        self.recordings
    }

    /// SHA-256 of its lines, without comments.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Where the folder of a recording is.
    pub fn folder(&self, entry: &Entry) -> PathBuf {
        self.root.join(&entry.name)
    }

    /// Every recording in order.
    ///
    /// # Errors
    /// Those of `take`, lines that are not well formed, a file that cannot be read.
    pub fn each(&self, mut take: impl FnMut(Entry) -> Result<()>) -> Result<()> {
        self.lines(|_, entry| take(entry))
    }

    fn lines(&self, mut take: impl FnMut(u32, Entry) -> Result<()>) -> Result<()> {
        let mut reader: Box<dyn BufRead + '_> = match &self.from {
            From::Text(text) => Box::new(text.as_bytes()),
            From::File(path) => Box::new(BufReader::new(std::fs::File::open(path).map_err(|e| Fault::read(path, e))?)),
        };
        let mut text = Vec::new();
        for number in 1.. {
            text.clear();
            let mut limited = (&mut reader).take(MOST_OF_A_LINE);
            let read = limited.read_until(b'\n', &mut text);
            if read.map_err(|e| strange(number, &format!("cannot be read: {e}")))? == 0 {
                break;
            }
            let Ok(line) = std::str::from_utf8(&text) else { return Err(strange(number, "is not text in UTF-8")) };
            let line = line.trim_start_matches('\u{feff}').trim();
            if !line.is_empty() && !line.starts_with('#') {
                take(number, entry(line).ok_or_else(|| strange(number, "is not a hash and a folder"))?)?;
            }
        }
        Ok(())
    }
}

/// As a manifest has it.
pub(super) fn line(entry: &Entry) -> String {
    format!("{}  {}\n", entry.input, entry.name)
}

fn strange(number: u32, what: &str) -> Fault {
    Fault::input(format!("line {number} {what}"))
        .cause("another file than a manifest, or one that was edited")
        .next("make it with sheetlight batch manifest FOLDER --out FILE")
}

/// Enough of a hash to know two alike from each other, in half the memory.
fn first_half(hash: &str) -> u128 {
    u128::from_str_radix(&hash[..32], 16).expect("a hash is hexadecimal")
}

fn entry(line: &str) -> Option<Entry> {
    let (hash, name) = line.split_once(char::is_whitespace)?;
    let hex = hash.len() == 64 && hash.bytes().all(|b| b.is_ascii_hexdigit());
    let name = tidy(name.trim_start());
    (hex && !name.is_empty() && !name.contains(char::is_control))
        .then(|| Entry { input: hash.to_ascii_lowercase(), name })
}

/// One spelling for one folder: without dots and doubled strokes.
fn tidy(name: &str) -> String {
    let plain: PathBuf = Path::new(name).components().filter(|c| *c != Component::CurDir).collect();
    if plain.as_os_str().is_empty() { ".".into() } else { plain.to_string_lossy().into_owned() }
}

/// A folder's name as a manifest can hold it.
pub(super) fn named(folder: &Path) -> Result<String> {
    let name = folder.to_str().filter(|n| !n.contains(char::is_control) && n.trim() == *n);
    name.map(tidy).ok_or_else(|| {
        Fault::input(format!("{}: cannot stand in a manifest", folder.display()))
            .cause("the name has line breaks, blanks at its ends, or is not UTF-8")
            .next("rename the folder")
    })
}

fn unique(all: &mut [(u128, u32)], what: &str, cause: &str) -> Result<()> {
    all.sort_unstable();
    // The first one in the file, so that the message does not depend on hashes.
    let twice = all.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| (w[1].1, w[0].1)).min();
    match twice {
        None => Ok(()),
        Some((second, first)) => {
            Err(Fault::input(format!("lines {first} and {second} {what}: a recording is in a batch once"))
                .cause(cause)
                .next(format!("take line {second} out")))
        }
    }
}

/// The manifest's text for recordings in and below folders; a folder inside `root` is named from there.
///
/// # Errors
/// Folders without a recording, files that cannot be read.
pub fn written(folders: &[PathBuf], root: &Path) -> Result<String> {
    let real = |p: &Path| p.canonicalize().map_err(|e| Fault::read(p, e));
    let (root, mut text) = (real(root)?, String::new());
    for folder in folders {
        let mut found = Vec::new();
        below(&real(folder)?, &mut found)?;
        if found.is_empty() {
            return Err(Fault::input(format!("{}: contains no recording", folder.display()))
                .cause("no folder in it has a meta.json")
                .next("name the folder above the recordings"));
        }
        found.sort_by_cached_key(|p| crate::files::natural(&p.to_string_lossy()));
        for recording in found {
            let name = named(recording.strip_prefix(&root).unwrap_or(&recording))?;
            text += &line(&Entry { input: hash_of(&recording)?, name });
        }
    }
    Manifest::checked(From::Text(text.clone()), &root).map(|_| text)
}

fn below(folder: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    if folder.join("meta.json").is_file() {
        found.push(folder.to_owned());
        return Ok(());
    }
    let entries = std::fs::read_dir(folder).map_err(|e| Fault::read(folder, e))?;
    for entry in entries {
        let entry = entry.map_err(|e| Fault::read(folder, e))?;
        if entry.file_type().is_ok_and(|t| t.is_dir()) && !entry.file_name().to_string_lossy().starts_with('.') {
            below(&entry.path(), found)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<String>> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("manifest.txt");
        std::fs::write(&path, text).unwrap();
        let manifest = Manifest::open(&path)?;
        let mut names = Vec::new();
        manifest.each(|e| {
            assert_eq!(manifest.folder(&e), dir.path().join(&e.name));
            names.push(e.name);
            Ok(())
        })?;
        assert_eq!(names.len() as u64, manifest.recordings());
        Ok(names)
    }

    #[test]
    fn a_manifest_is_hashes_and_folders() {
        let hash = |c: char| c.to_string().repeat(64);
        let (a, b) = (hash('a'), hash('B'));
        assert_eq!(read(&format!("# made by hand\n{a}  ./x y/1/\r\n\n{b} 2\n")).unwrap(), ["x y/1", "2"]);
        let what = |text: String| read(&text).unwrap_err().what;
        assert!(what(format!("{a}  1\n{b}  ./1\n")).contains("lines 1 and 2 name one folder"));
        assert!(what(format!("{a}  1\n{b}  2\n{a}  3\n")).contains("lines 1 and 3 have one hash"));
        assert!(what(format!("{a}  1\nabc  2\n")).contains("line 2 is not a hash and a folder"));
        assert!(what("\n# none\n".into()).contains("0 recordings"));
        assert!(what(format!("{a}  {}\n", "x".repeat(9000))).contains("line 2 is not"), "a line is cut at its limit");
    }

    #[test]
    fn comments_and_spelling_do_not_make_another_manifest() {
        let of = |text: String| Manifest::checked(From::Text(text), Path::new(".")).unwrap().sha256;
        let a = "a".repeat(64);
        assert_eq!(of(format!("{a}  1\n")), of(format!("# x\n{}  ./1\n", a.to_uppercase())));
        assert_ne!(of(format!("{a}  1\n")), of(format!("{a}  2\n")));
    }
}
