//! In: a folder that other programs fill with pictures; the first bytes of a file. Out: the folder's pictures by the
//! endings of their names, in natural order, with those of formats that are not read; the name of a file's format.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Endings of pictures that are read.
const READ: [&str; 11] = ["png", "jpg", "jpeg", "jpe", "jfif", "jif", "tif", "tiff", "bmp", "pgm", "pnm"];
/// Endings of pictures that are not read. Skipping such a file would give its place to the next picture.
const UNREAD: [&str; 33] = [
    "webp", "gif", "ppm", "pbm", "pam", "pfm", "avif", "heic", "heif", "jp2", "j2k", "jpx", "jxl", "jxr", "tga", "exr",
    "hdr", "dng", "cr2", "cr3", "nef", "arw", "raf", "orf", "rw2", "pef", "psd", "pcx", "sgi", "dib", "qoi", "svg",
    "raw",
];

/// A picture in a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// The file.
    pub path: PathBuf,
    /// Its name ends like those of a format that is read.
    pub read: bool,
}

impl Named {
    /// The error for a picture of a format that is not read.
    pub fn unread(&self) -> Fault {
        Fault::input(format!("{}: is a picture of a format that is not read", self.path.display()))
            .cause("a program wrote several formats, or a picture was converted; without it those behind it move up")
            .next("write it as PNG, JPEG, TIFF, BMP or PGM, or take it out of the folder")
    }
}

/// The pictures of a folder in natural order. A file whose name begins with a dot is still being written. A picture
/// that is also there in a format that is read is listed once.
pub fn pictures_in(folder: &Path) -> Result<Vec<Named>> {
    let entries = std::fs::read_dir(folder).map_err(|e| Fault::read(folder, e))?;
    let kind = |path: &Path| {
        let ending = path.extension()?.to_string_lossy().to_lowercase();
        let read = READ.contains(&ending.as_str());
        (read || UNREAD.contains(&ending.as_str())).then_some(read)
    };
    let hidden = |p: &Path| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
    let paths = entries.flatten().map(|e| e.path()).filter(|p| !hidden(p));
    let mut all: Vec<Named> = paths.filter_map(|path| Some(Named { read: kind(&path)?, path })).collect();
    let there: BTreeSet<PathBuf> = all.iter().filter(|n| n.read).map(|n| n.path.with_extension("")).collect();
    all.retain(|n| n.read || !there.contains(&n.path.with_extension("")));
    all.sort_by_cached_key(|n| crate::files::natural(&n.path.to_string_lossy()));
    Ok(all)
}

/// First bytes of formats that are not read here, from the given position on.
const FORMATS: [(usize, &[u8], &str); 17] = [
    (8, b"WEBP", "a WebP picture"),
    (0, b"GIF8", "a GIF picture"),
    (4, b"ftypavif", "an AVIF picture"),
    (4, b"ftyphei", "a HEIC picture"),
    (4, b"ftypmif1", "a HEIC picture"),
    (0, b"\0\0\0\x0cjP  ", "a JPEG 2000 picture"),
    (0, b"\xff\x0a", "a JPEG XL picture"),
    (0, b"\0\0\0\x0cJXL ", "a JPEG XL picture"),
    (0, b"\x76\x2f\x31\x01", "an OpenEXR picture"),
    (0, b"#?R", "a Radiance HDR picture"),
    (0, b"Pf", "a PFM picture"),
    (0, b"PF", "a PFM picture"),
    (0, b"\x93NUMPY", "an array of NumPy (NPY)"),
    (0, b"LASF", "a LAS or LAZ cloud"),
    (0, b"ASTM-E57", "an E57 cloud"),
    (0, b"PK\x03\x04", "a ZIP archive (also NPZ, 3MF, XLSX)"),
    (0, b"\x89HDF", "an HDF5 file"),
];

/// The name of a file's format, if it is one that is not read; tables of numbers included.
pub fn other_format(bytes: &[u8]) -> Option<&'static str> {
    let known = FORMATS.iter().find(|(at, mark, _)| bytes.get(*at..).is_some_and(|b| b.starts_with(mark)));
    known.map(|(.., name)| *name).or_else(|| numbers(bytes).then_some("a table of numbers in text (CSV, XYZ, ASC)"))
}

/// Whether a file begins with lines of text of which one holds two numbers or more.
fn numbers(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(2048)];
    let Ok(text) = std::str::from_utf8(head) else { return false };
    let line = |line: &str| {
        let mut words =
            line.split(|c: char| c.is_whitespace() || ",;".contains(c)).filter(|w| !w.is_empty()).peekable();
        let first = words.next().is_some_and(|w| w.parse::<f64>().is_ok());
        first && words.peek().is_some() && words.all(|w| w.parse::<f64>().is_ok())
    };
    // A PNM in text (P1 to P7) has its size in a line of numbers.
    let pnm = head.len() > 1 && head[0] == b'P' && head[1].is_ascii_digit();
    !pnm && !text.contains('\0') && text.lines().take(20).any(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_that_are_not_read_are_named() {
        let named = |bytes: &[u8]| other_format(bytes).unwrap_or("none");
        assert!(named(b"RIFF\0\0\0\0WEBPVP8 ").contains("WebP"));
        assert!(named(b"Pf\n2 2\n-1.0\n\0\0").contains("PFM"));
        assert!(named(b"\x93NUMPY\x01\0").contains("NPY"));
        assert!(named(b"x,y,z\n0.5,1,2\n").contains("XYZ"));
        assert!(named(b"0.5 1 2e-3\n").contains("XYZ"));
        for other in [&b"P2\n2 2\n255\n"[..], b"hello\n3\n", b"\x89PNG", b"BM\0", b""] {
            assert_eq!(named(other), "none", "{other:?}");
        }
    }

    #[test]
    fn a_picture_that_is_not_read_keeps_its_place() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["f10.jpe", "f2.PNG", "f3.webp", "f2.raw", ".f4.png", "notes.txt", "f5.JFIF"] {
            std::fs::write(dir.path().join(name), "").unwrap();
        }
        let found = pictures_in(dir.path()).unwrap();
        let names: Vec<_> =
            found.iter().map(|n| (n.path.file_name().unwrap().to_string_lossy().into_owned(), n.read)).collect();
        let want = [("f2.PNG", true), ("f3.webp", false), ("f5.JFIF", true), ("f10.jpe", true)];
        assert_eq!(names, want.map(|(name, read)| (name.to_owned(), read)));
        assert!(found[1].unread().what.contains("f3.webp"));
        assert!(pictures_in(&dir.path().join("none")).is_err());
    }
}
