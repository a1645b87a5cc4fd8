//! In: files of line profiles (CSV, matrices and plain sequences in YAML and JSON). Out: lists of x, z points.
//! Frame and unit: the sensor's own plane, mm.

use super::super::pose_csv::stated_mm;
use super::profile::Profile;
use super::sequences::{by_turns, from_brackets, value};
use crate::fault::{Fault, Result};
use crate::files::{TableRow, natural, table};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Reads profiles from one file with many, or from a folder with one file each, in the order of their names (numbers
/// in names are compared as numbers). Profiles that a table numbers are in the order of their numbers. Places without a
/// measurement stay, with a number that is not finite.
///
/// # Errors
/// Files that cannot be read; numbers that are not in mm; a profile twice, or left out.
pub fn load(path: &Path) -> Result<Vec<Profile>> {
    let mut out = Vec::new();
    let mut stated = true;
    for f in files_of(path)? {
        let text = crate::files::read_text(&f)?;
        stated &= says_mm(&text);
        out.push(read_file(&text, &f)?);
    }
    if !stated {
        wide_enough(out.iter().flat_map(|read| &read.profiles)).map_err(|e| e.at(path.display()))?;
    }
    let numbers: Vec<f64> = out.iter().filter_map(|read| read.numbers.as_ref()).flatten().copied().collect();
    // The files of a folder may each begin at 0, or each hold the profile of one number.
    let once = numbers.iter().map(|n| n.to_bits()).collect::<BTreeSet<_>>().len() == numbers.len();
    if out.len() > 1 && once && out.iter().all(|read| read.numbers.is_some()) {
        let profiles = out.into_iter().flat_map(|read| read.profiles).collect();
        return Read { profiles, numbers: Some(numbers) }.in_order().map_err(|e| e.at(path.display()));
    }
    let each = out.into_iter().map(Read::in_order).collect::<Result<Vec<_>>>();
    each.map(|all| all.concat()).map_err(|e| e.at(path.display()))
}

/// Profiles in the order of their file, and the number of each if a table states them all.
struct Read {
    profiles: Vec<Profile>,
    numbers: Option<Vec<f64>>,
}

impl From<Vec<Profile>> for Read {
    fn from(profiles: Vec<Profile>) -> Read {
        Read { profiles, numbers: None }
    }
}

impl Read {
    /// The profiles in the order of their numbers. These may begin anywhere and count in any step.
    ///
    /// # Errors
    /// A number twice, or one that is left out: later profiles would belong to other poses.
    fn in_order(self) -> Result<Vec<Profile>> {
        let Some(numbers) = self.numbers else { return Ok(self.profiles) };
        let mut all: Vec<(f64, Profile)> = numbers.into_iter().zip(self.profiles).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(two) = all.windows(2).find(|w| w[0].0 == w[1].0) {
            return Err(Fault::input(format!("profile {} is there twice", two[0].0))
                .cause("two files were joined")
                .next("number the profiles in the order of their poses or counts"));
        }
        let steps = || all.windows(2).map(|w| w[1].0 - w[0].0);
        let step = steps().fold(f64::INFINITY, f64::min);
        if let Some(k) = steps().position(|s| s != step) {
            let (before, after) = (all[k].0, all[k + 1].0);
            let what = format!("profile {after} follows {before}, {} is missing", before + step);
            return Err(Fault::input(what)
                .cause("a profile without points was not exported, or is lost")
                .next("write it too, its places as nan; or take out its pose or count and number what is left"));
        }
        Ok(all.into_iter().map(|(_, profile)| profile).collect())
    }
}

/// The files that [`load`] reads, in their order.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let entries = std::fs::read_dir(path).map_err(|e| Fault::read(path, e))?;
    let mut files: Vec<_> = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| {
            p.extension()
                .is_some_and(|e| ["csv", "txt", "yml", "yaml", "json"].iter().any(|k| e.eq_ignore_ascii_case(k)))
        })
        .collect();
    files.sort_by_key(|p| natural(&p.file_name().unwrap_or_default().to_string_lossy()));
    if files.is_empty() {
        return Err(Fault::input(format!("{}: contains no profiles (csv, txt, yml, yaml, json)", path.display()))
            .cause("another folder")
            .next("give the folder with one profile a file, or one file with all"));
    }
    Ok(files)
}

/// No line-profile sensor sees less than this along its line, mm; none sees as many metres.
const NARROWEST_MM: f64 = 1.0;

/// Refuses profiles that are too narrow to be in mm.
fn wide_enough<'a>(profiles: impl Iterator<Item = &'a Profile>) -> Result<()> {
    let x = profiles.flat_map(|p| &p.points).map(|p| p[0]).filter(|x| x.is_finite());
    let (low, high) = x.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    if high <= low || high - low >= NARROWEST_MM {
        return Ok(());
    }
    Err(Fault::input(format!("x is from {low} to {high} in all profiles, {:.3} mm wide", high - low))
        .cause("profiles in metres: no line-profile sensor sees less than 1 mm along its line")
        .next("export the profiles in mm; if they are, state it in a line \"# unit: mm\""))
}

/// Whether a table states mm, in a comment or in the names of its columns.
fn says_mm(text: &str) -> bool {
    stated_mm(text, "").is_ok_and(|stated| stated) || has_header(text) && head(text).0.contains("mm")
}

fn read_file(text: &str, path: &Path) -> Result<Read> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let read = match () {
        () if text.contains("opencv-matrix") => from_yaml(text, &stem).map(Read::from),
        // Its brackets are those of units.
        () if has_header(text) => read_csv(text, &stem),
        () if text.contains('[') => from_brackets(text, &stem).map(Read::from),
        () => read_csv(text, &stem),
    };
    read.map_err(|e| e.at(path.display()))
}

/// Names of the column with a profile's number.
const NUMBERS: [&str; 8] =
    ["profile", "profile_index", "profile_id", "profile_number", "frame", "frame_index", "frame_id", "index"];

/// What the columns of a table hold.
enum Columns {
    /// One point per line, of a single profile or of the profile that the line names.
    Point { profile: Option<usize>, x: usize, z: usize },
    /// One profile per line: x and z alternate.
    Profile,
}

impl Columns {
    /// From a header; `None` if it names no x and z.
    fn named(cells: &[String]) -> Option<Columns> {
        let find = |key: &str| {
            cells.iter().position(|c| {
                let c = c.to_lowercase();
                c == key || c == format!("{key}_mm") || c == format!("{key} mm") || c == format!("{key} [mm]")
            })
        };
        let profile = NUMBERS.iter().find_map(|key| find(key));
        Some(Columns::Point { profile, x: find("x")?, z: find("z")? })
    }

    fn counted(cells: usize) -> Columns {
        match cells {
            2 => Columns::Point { profile: None, x: 0, z: 1 },
            3 => Columns::Point { profile: Some(0), x: 1, z: 2 },
            _ => Columns::Profile,
        }
    }
}

/// Columns x, z (one profile), or profile, x, z (many). A header may name the columns in another order. Profiles are in
/// the order of their numbers; names that are no numbers keep the file's order.
///
/// # Errors
/// Another layout or unit; a profile twice, or left out.
pub fn from_csv(text: &str, stem: &str) -> Result<Vec<Profile>> {
    read_csv(text, stem)?.in_order()
}

/// The first line of a table that is no comment, and the separator of its cells.
fn head(text: &str) -> (&str, char) {
    let first = text.lines().map(str::trim).find(|l| !l.is_empty() && !l.starts_with('#')).unwrap_or_default();
    (first, [';', ','].into_iter().find(|c| first.contains(*c)).unwrap_or(' '))
}

/// Whether the first line names the columns of points.
fn has_header(text: &str) -> bool {
    let (first, separator) = head(text);
    table(first, separator).first().is_some_and(|row| Columns::named(&row.cells).is_some())
}

fn read_csv(text: &str, stem: &str) -> Result<Read> {
    stated_mm(text, "export the profiles in mm")?;
    let (_, separator) = head(text);
    let mut columns: Option<Columns> = None;
    // Number of columns that a header names.
    let mut named = usize::MAX;
    let mut out: Vec<Profile> = Vec::new();
    let mut numbers: Vec<Option<f64>> = Vec::new();
    for TableRow { line: number, text: line, mut cells } in table(text, separator) {
        // An empty cell under a name is a missing value, as pandas and spreadsheets write it.
        let missing = cells.len() >= named;
        // A separator at the end of a line starts no new cell.
        while cells.last().is_some_and(String::is_empty) {
            cells.pop();
        }
        let bad = |what: &str| {
            let commas = separator == ';' && line.contains(',');
            Fault::input(format!("line {number}: '{line}' {what}"))
                .cause(if commas { "numbers with decimal commas" } else { "not a list of x, z points in mm" })
                .next("write x and z (mm) a line, or profile, x and z with a header")
        };
        if columns.is_none() {
            if cells.iter().any(|c| c.parse::<f64>().is_err()) {
                columns = Some(Columns::named(&cells).ok_or_else(|| bad("names no columns x and z"))?);
                named = cells.len();
                continue;
            }
            columns = Some(Columns::counted(cells.len()));
        }
        let Columns::Point { profile, x, z } = *columns.as_ref().expect("set above") else {
            let numbers = cells.iter().map(|c| c.parse()).collect::<std::result::Result<Vec<f64>, _>>();
            let name = format!("{stem} line {number}");
            let points = by_turns(&numbers.map_err(|_| bad("is not a row of numbers"))?, &name)?;
            out.push(Profile { name, points });
            continue;
        };
        let cell = |i: usize| cells.get(i).map(String::as_str).ok_or_else(|| bad("is too short"));
        let value = |i: usize| match cells.get(i).map(String::as_str) {
            None | Some("") if missing => Ok(f64::NAN),
            _ => cell(i).and_then(|c| c.parse::<f64>().map_err(|_| bad("is not a row of numbers"))),
        };
        let point = [value(x)?, value(z)?];
        let name = match profile {
            Some(i) => format!("{stem} {}", cell(i)?),
            None => stem.to_owned(),
        };
        if out.last().is_none_or(|p| p.name != name) {
            if out.iter().any(|p| p.name == name) {
                return Err(bad("belongs to a profile that was closed before: keep a profile's lines together"));
            }
            out.push(Profile { name, points: Vec::new() });
            numbers.push(profile.and_then(|i| whole(cells.get(i)?)));
        }
        out.last_mut().expect("pushed above").points.push(point);
    }
    if out.is_empty() {
        return Err(Fault::input("holds no points").cause("an empty file").next("export the profiles again"));
    }
    let numbers = numbers.into_iter().collect::<Option<Vec<f64>>>().filter(|numbers| !numbers.is_empty());
    Ok(Read { profiles: out, numbers })
}

/// A profile's number: whole, and small enough to be exact.
fn whole(cell: &str) -> Option<f64> {
    cell.parse().ok().filter(|n: &f64| n.fract() == 0.0 && (0.0..1e15).contains(n))
}

/// Reads every matrix of an OpenCV FileStorage file: 2 x N, N x 2, or N elements of two channels.
pub fn from_yaml(text: &str, stem: &str) -> Result<Vec<Profile>> {
    let bad = |name: &str, what: String| {
        Fault::input(format!("matrix '{name}': {what}"))
            .cause("not a list of x, z points written by cv::FileStorage")
            .next("write each profile as a 2xN or Nx2 matrix of x and z in mm")
    };
    let mut out = Vec::new();
    let pieces: Vec<&str> = text.split("!!opencv-matrix").collect();
    for (i, body) in pieces.iter().enumerate().skip(1) {
        let before = pieces[i - 1].trim_end().trim_end_matches(':');
        let name = before.lines().last().unwrap_or("").trim().trim_start_matches("- ").trim().to_owned();
        let name =
            if name.is_empty() || name == "-" { format!("{stem} {}", out.len()) } else { format!("{stem} {name}") };
        let points = matrix(body).map_err(|what| bad(&name, what))?;
        out.push(Profile { name, points });
    }
    if out.is_empty() {
        return Err(Fault::input("holds no !!opencv-matrix")
            .cause("another kind of YAML")
            .next("write it with cv::FileStorage"));
    }
    Ok(out)
}

/// The points of one matrix, or a description of its fault.
fn matrix(body: &str) -> std::result::Result<Vec<[f64; 2]>, String> {
    let field = |key: &str| {
        body.lines().find_map(|l| l.trim().strip_prefix(key)?.trim_start().strip_prefix(':').map(str::trim))
    };
    let size = |key: &str| field(key).and_then(|v| v.parse::<usize>().ok()).ok_or_else(|| format!("has no {key}"));
    let (rows, cols) = (size("rows")?, size("cols")?);
    let kind = field("dt").unwrap_or("d").trim_matches('"');
    let channels: usize = kind.chars().take_while(char::is_ascii_digit).collect::<String>().parse().unwrap_or(1);
    let data = body
        .split_once("data:")
        .and_then(|(_, d)| d.split_once('[')?.1.split_once(']'))
        .ok_or_else(|| "has no data".to_owned())?
        .0;
    let numbers = data
        .split(|c: char| c == ',' || c.is_whitespace())
        .filter(|t| !t.is_empty())
        .map(value)
        .collect::<Option<Vec<f64>>>()
        .ok_or_else(|| "holds something that is not a number".to_owned())?;
    let wanted = rows.checked_mul(cols).and_then(|n| n.checked_mul(channels));
    if wanted != Some(numbers.len()) {
        return Err(format!("{} numbers for {rows}x{cols} of {channels} channels", numbers.len()));
    }
    Ok(match (rows, cols, channels) {
        (_, 2, 1) if rows != 2 => numbers.chunks(2).map(|c| [c[0], c[1]]).collect(),
        (2, n, 1) if n != 2 => (0..n).map(|k| [numbers[k], numbers[n + k]]).collect(),
        (_, _, 2) if rows == 1 || cols == 1 => numbers.chunks(2).map(|c| [c[0], c[1]]).collect(),
        _ => return Err(format!("{rows}x{cols} of {channels} channels is not a list of x, z")),
    })
}

#[cfg(test)]
mod tests {
    use super::super::measured;
    use super::*;

    #[test]
    fn tables_of_pandas_and_spreadsheets_are_read_as_they_come() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.csv");
        // Units in brackets, a value that is missing, a number under one of its names.
        std::fs::write(&path, "\u{feff}profile_index,x [mm],z [mm]\n0,1,10\n0,1.5,\n0,2,11.5\n1,4,\n1,5,6\n").unwrap();
        let read = load(&path).unwrap();
        assert_eq!(read.len(), 2);
        assert!(read[0].points.len() == 3 && !measured(&read[0].points[1]) && !measured(&read[1].points[0]));
        assert_eq!((read[0].points[2], read[1].points[1]), ([2.0, 11.5], [5.0, 6.0]));
        // Without a header, and with a cell too few, nothing is known to be missing.
        assert!(from_csv("0,1,10\n0,2,\n", "a").is_err());
        assert!(from_csv("profile,x,z\n0,1,10\n0,2\n", "a").is_err());
    }

    #[test]
    fn every_layout_gives_the_same_points() {
        let want = vec![[1.0, 10.0], [2.0, 11.5], [3.0, 12.0]];
        assert_eq!(from_csv("x_mm,z_mm\n1,10\n2,11.5\n3,12\n", "a").unwrap()[0].points, want);
        // A place without a measurement stays where it is.
        let gap = from_csv("1;10\n1.5;nan\n2;11.5\n3;12\n", "a").unwrap().remove(0).points;
        assert!(gap.len() == 4 && !measured(&gap[1]));
        assert_eq!(gap.into_iter().filter(measured).collect::<Vec<_>>(), want);
        let many = from_csv("profile,z,x\n0,10,1\n0,11.5,2\n0,12,3\n1,5,4\n", "a").unwrap();
        assert_eq!((many.len(), &many[0].points, many[1].points[0]), (2, &want, [4.0, 5.0]));
        let yaml = |m: &str| format!("%YAML:1.0\n---\nprofile_0: !!opencv-matrix\n{m}\n");
        for m in [
            "   rows: 2\n   cols: 3\n   dt: d\n   data: [ 1., 2., 3., 10., 1.15e+01,\n       12. ]",
            "   rows: 3\n   cols: 2\n   dt: f\n   data: [ 1., 10., 2., 11.5, 3., 12. ]",
            "   rows: 1\n   cols: 3\n   dt: \"2d\"\n   data: [ 1., 10., 2., 11.5, 3., 12. ]",
        ] {
            let p = from_yaml(&yaml(m), "a").unwrap();
            assert_eq!((p[0].points.clone(), p[0].name.as_str()), (want.clone(), "a profile_0"));
        }
        assert!(from_yaml(&yaml("   rows: 2\n   cols: 2\n   dt: d\n   data: [ 1., 2., 3., 4. ]"), "a").is_err());
        let lines = from_csv("1 10 2 11.5 3 12\n4 5 5 6 6 7\n", "a").unwrap();
        assert_eq!((lines.len(), &lines[0].points, lines[1].points[2]), (2, &want, [6.0, 7.0]));
        assert!(from_csv("1,2,3,4\n", "a").is_err() && from_csv("a,b\n1,2\n", "a").is_err());
    }

    #[test]
    fn profiles_are_in_the_order_of_their_numbers() {
        let firsts = |text: &str| from_csv(text, "a").map(|all| all.iter().map(|p| p.points[0][1]).collect::<Vec<_>>());
        for (text, want) in [
            ("profile,x,z\n2,0,12\n2,1,0\n0,0,10\n1,0,11\n", [10.0, 11.0, 12.0]),
            ("2,0,12\n1,0,11\n0,0,10\n", [10.0, 11.0, 12.0]),
            // From 1, and every tenth picture of a sensor.
            ("x;z;profile\n0;12;3\n0;10;1\n0;11;2\n", [10.0, 11.0, 12.0]),
            ("frame,x,z\n4730,0,12\n4710,0,10\n4720,0,11\n", [10.0, 11.0, 12.0]),
            ("profile,x,z\nleft,0,12\nmiddle,0,10\nright,0,11\n", [12.0, 10.0, 11.0]),
        ] {
            assert_eq!(firsts(text).unwrap(), want, "{text}");
        }
        let said = |text: &str| firsts(text).unwrap_err().to_string();
        let gap = said("profile,x,z\n0,0,1\n1,0,1\n3,0,1\n");
        assert!(gap.contains("profile 3 follows 1, 2 is missing"), "{gap}");
        assert!(said("profile,x,z\n0,0,1\n1,0,1\n01,0,1\n").contains("profile 1 is there twice"));
        assert!(said("# unit: um\nprofile,x,z\n0,0,1\n").contains("the unit 'um'"));
        assert!(firsts("# Units = mm\nprofile,x,z\n0,0,1\n").is_ok());
    }

    #[test]
    fn the_files_of_a_folder_are_numbered_together_or_each() {
        let dir = tempfile::tempdir().unwrap();
        let firsts = |files: [&str; 2]| {
            for (name, text) in ["a.csv", "b.csv"].into_iter().zip(files) {
                std::fs::write(dir.path().join(name), text).unwrap();
            }
            load(dir.path()).unwrap().iter().map(|p| p.points[0][1]).collect::<Vec<_>>()
        };
        assert_eq!(firsts(["profile,x,z\n1,0,11\n", "profile,x,z\n0,0,10\n"]), [10.0, 11.0]);
        let each = ["profile,x,z\n1,0,11\n0,0,10\n", "profile,x,z\n0,0,12\n1,0,13\n"];
        assert_eq!(firsts(each), [10.0, 11.0, 12.0, 13.0]);
    }

    #[test]
    fn profiles_in_metres_are_refused_and_narrow_ones_that_state_mm_are_not() {
        let dir = tempfile::tempdir().unwrap();
        let read = |text: &str| {
            std::fs::write(dir.path().join("p.csv"), text).unwrap();
            load(&dir.path().join("p.csv")).map_err(|e| e.to_string())
        };
        let metres = "x,z\n-0.04,0.21\n0,0.2\n0.04,0.21\n";
        let said = read(metres).unwrap_err();
        assert!(said.contains("from -0.04 to 0.04") && said.contains("0.080 mm") && said.contains("metres"), "{said}");
        assert!(read(&format!("# units: mm\n{metres}")).is_ok());
        assert!(read(&metres.replace("x,z", "x [mm],z [mm]")).is_ok());
        assert!(read("x,z\n-40,210\n0,200\n40,210\n").is_ok());
    }

    #[test]
    fn numbers_in_names_count_as_numbers() {
        assert!(natural("profile_2.csv") < natural("profile_10.csv"));
    }
}
