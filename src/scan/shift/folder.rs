//! In: a folder of pictures of a stripe, in the order of their names. Out: the pictures, or the name of one that would
//! move all later points along the travel; remarks on names and copies.
//! Frame and unit: pixels; the travel in mm.

use crate::fault::{Fault, Result};
use crate::files::natural;
use crate::raster::{Image, Pixels, pictures_in};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// The file's name without its folder.
pub fn name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// The pictures of a folder in natural order. Each stands for one step of the travel, so none may be missing or there
/// twice.
pub fn pictures(folder: &Path) -> Result<Vec<PathBuf>> {
    let all = pictures_in(folder)?;
    if let Some(unread) = all.iter().find(|n| !n.read) {
        return Err(unread.unread());
    }
    let names: Vec<PathBuf> = all.into_iter().map(|n| n.path).collect();
    if names.is_empty() {
        return Err(Fault::input(format!("{}: holds no pictures", folder.display()))
            .cause("another folder, or pictures of another format than JPEG, PNG, TIFF, BMP, PGM")
            .next("give the folder with the pictures"));
    }
    let mut by_stem = BTreeMap::new();
    for path in &names {
        if let Some(other) = by_stem.insert(path.with_extension(""), path) {
            return Err(Fault::input(format!("{}: {} has the same name but its ending", path.display(), name(other)))
                .cause("the pictures were saved in two formats; each file counts as one step of the travel")
                .next("keep one of the two files in the folder"));
        }
    }
    Ok(names)
}

/// Letters of a name, without its numbers.
fn letters(path: &Path) -> Vec<String> {
    natural(&name(&path.with_extension(""))).into_iter().map(|(text, ..)| text).collect()
}

/// The last number in a name.
fn number(path: &Path) -> Option<u128> {
    natural(&name(&path.with_extension("")))
        .into_iter()
        .rfind(|(_, _, digits)| *digits > 0)
        .map(|(_, number, _)| number)
}

/// A remark if the names count in equal steps but for a few gaps.
pub fn gaps(names: &[PathBuf], travel_mm: f64) -> Option<String> {
    let step = |a: &PathBuf, b: &PathBuf| number(b)?.checked_sub(number(a)?).filter(|n| *n > 0);
    let steps: Vec<(&[PathBuf], u128)> = names.windows(2).filter_map(|w| step(&w[0], &w[1]).map(|n| (w, n))).collect();
    let mut counts = BTreeMap::<u128, usize>::new();
    steps.iter().for_each(|(_, n)| *counts.entry(*n).or_default() += 1);
    let (usual, often) = counts.into_iter().max_by_key(|(_, n)| *n)?;
    // Numbers that are times, or counts of a free-running camera, have no usual step.
    if 10 * often < 8 * names.len().saturating_sub(1) {
        return None;
    }
    let wide: Vec<_> = steps.iter().filter(|(_, n)| *n > usual && n % usual == 0).collect();
    let (pair, _) = wide.first()?;
    let missing: u128 = wide.iter().map(|(_, n)| n / usual - 1).sum();
    Some(format!(
        "the numbers of the pictures have gaps: {missing} are missing, the first between {} and {}. Each picture \
         counts as one step of {travel_mm} mm, so add what is missing if the bed moved on",
        name(&pair[0]),
        name(&pair[1])
    ))
}

/// What the pictures of a scan share, from the first one on.
#[derive(Default)]
pub struct Alike {
    first: Option<(PathBuf, [u32; 2])>,
    seen: BTreeMap<u64, PathBuf>,
    /// Pictures that hold the same levels as an earlier one.
    repeated: Vec<[String; 2]>,
}

impl Alike {
    /// Columns and rows of the pictures; 0 before the first one.
    pub fn size(&self) -> [u32; 2] {
        self.first.as_ref().map_or([0, 0], |(_, size)| *size)
    }

    /// Refuses a picture of another size than the first one. The rig's numbers hold for one size.
    pub fn fits(&mut self, path: &Path, image: &Image) -> Result<()> {
        let size = [image.width, image.height];
        let (first, usual) = self.first.get_or_insert_with(|| (path.to_owned(), size));
        if size != *usual {
            return Err(Fault::input(format!(
                "{}: is {}x{}, {} is {}x{}",
                path.display(),
                size[0],
                size[1],
                name(first),
                usual[0],
                usual[1]
            ))
            .cause(
                "a picture of another camera, turned by 90 degrees or saved smaller: pixels per mm hold for one size",
            )
            .next("save all pictures as the camera took them, or take this one out of the folder"));
        }
        Ok(())
    }

    /// Refuses a picture that is named as a copy and holds the same levels as another; notes any other repetition.
    pub fn differs(&mut self, path: &Path, image: &Image) -> Result<()> {
        let mut hash = DefaultHasher::new();
        match &image.pixels {
            Pixels::U8(p) => p.hash(&mut hash),
            Pixels::U16(p) => p.hash(&mut hash),
        }
        let Some(earlier) = self.seen.insert(hash.finish(), path.to_owned()) else { return Ok(()) };
        if letters(path) != letters(&earlier) {
            return Err(Fault::input(format!("{}: holds the same picture as {}", path.display(), name(&earlier)))
                .cause("one is a copy of the other; each file counts as one step of the travel")
                .next("take the copy out of the folder"));
        }
        self.repeated.push([name(&earlier), name(path)]);
        Ok(())
    }

    /// A remark on repeated pictures.
    pub fn remark(&self, travel_mm: f64) -> Option<String> {
        let [earlier, later] = self.repeated.first()?;
        Some(format!(
            "{} pictures hold the same levels as an earlier one, the first is {later} ({earlier}): take them out if \
             they are copies, because each counts as one step of {travel_mm} mm",
            self.repeated.len()
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn gaps_in_counting_are_noted() {
        let all: Vec<String> = (0..20).map(|i| format!("f{:03}.png", 2 * i)).collect();
        let mut names = named(&all.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(gaps(&names, 1.0), None);
        names.remove(7);
        let said = gaps(&names, 0.5).unwrap();
        assert!(said.contains("1 are missing") && said.contains("f012.png and f016.png"), "{said}");
        assert_eq!(gaps(&named(&["a7.png", "a19.png", "a20.png", "a44.png"]), 1.0), None);
        assert_eq!(gaps(&named(&["a.png"]), 1.0), None);
    }

    #[test]
    fn other_sizes_and_copies_are_refused_by_name() {
        let image = |w: u32, level: u8| Image::from_u8(w, 2, vec![level; 2 * w as usize]);
        let mut alike = Alike::default();
        for (k, level) in [(1, 1), (2, 2), (3, 1)] {
            let path = PathBuf::from(format!("f{k}.png"));
            alike.fits(&path, &image(3, level)).unwrap();
            alike.differs(&path, &image(3, level)).unwrap();
        }
        assert!(alike.remark(1.0).unwrap().contains("the first is f3.png (f1.png)"));
        let what = alike.fits(Path::new("f4.png"), &image(4, 9)).unwrap_err().what;
        assert_eq!(what, "f4.png: is 4x2, f1.png is 3x2");
        let what = alike.differs(Path::new("f2 (1).png"), &image(3, 2)).unwrap_err().what;
        assert_eq!(what, "f2 (1).png: holds the same picture as f2.png");
    }
}
