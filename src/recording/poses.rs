//! In: pose files (JSON matrices, CSV matrices, CSV in a named robot convention). Out: base_from_flange.
//! Frame and unit: base and flange; the file states or names its units, the result is mm.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, ORTHONORMAL_WARN, Rigid};
use crate::robot::Convention;
use std::path::Path;

/// The poses of a file, and what a person should know about them.
#[derive(Clone, Debug)]
pub struct PoseFile {
    pub poses: Vec<Rigid<Base, Flange>>,
    /// Repairs above the warning limit, in words.
    pub warnings: Vec<String>,
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonPoses {
    units: String,
    layout: String,
    transform: String,
    poses: Vec<JsonPose>,
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonPose {
    frame: usize,
    matrix: [f64; 16],
}

/// `NAME.json` before `NAME.csv` in a folder.
pub(super) fn find_and_load(folder: &Path, name: &str) -> Result<PoseFile> {
    let candidates = [folder.join(name), folder.join(format!("{name}.json")), folder.join(format!("{name}.csv"))];
    match candidates.iter().find(|p| p.is_file()) {
        Some(path) => load_poses(path),
        None => Err(Fault::input(format!("{}: no pose file {name}.json or {name}.csv", folder.display()))
            .cause("the name is misspelt or the poses were not recorded")
            .next(match there(folder) {
                names if names.is_empty() => "record the robot's pose at every picture".into(),
                names => format!("name one of these with --poses: {}", names.join(", ")),
            })),
    }
}

/// The files of a folder that can be poses by their name.
fn there(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).map_or(Vec::new(), |all| all.flatten().map(|e| e.file_name()).collect());
    let mut names: Vec<String> = entries
        .iter()
        .filter_map(|n| n.to_str())
        .filter(|n| n.contains("pose") && (n.ends_with(".json") || n.ends_with(".csv")))
        .map(|n| n[..n.rfind('.').unwrap_or(n.len())].to_owned())
        .collect();
    names.sort_by_key(|n| crate::files::natural(n));
    names
}

/// Farthest that a flange can be from its base, mm: ten times the reach of the longest arms, on a rail.
const FARTHEST: f64 = 1e5;
/// Poses that all lie this near to the base's origin, mm, are in metres: no arm works inside its own foot.
const METRES: f64 = 8.0;

/// Loads a pose file by its extension: `.json`, or `.csv`/`.txt`.
pub fn load_poses(path: &Path) -> Result<PoseFile> {
    let text = std::fs::read_to_string(path).map_err(|e| Fault::read(path, e))?;
    let json = path.extension().is_some_and(|e| e == "json");
    let parsed = if json { from_json(&text) } else { from_csv(&text) };
    parsed.map_err(|e| e.at(path.display()))
}

/// A pose as its file states it: its number, and how its numbers are to be read.
pub(super) type Row = (usize, Convention, Vec<f64>);

fn collect(rows: Vec<Row>) -> Result<PoseFile> {
    let mut out = PoseFile { poses: Vec::new(), warnings: Vec::new() };
    for (expected, (index, convention, numbers)) in rows.into_iter().enumerate() {
        if index != expected {
            return Err(Fault::input(format!("pose {expected} is numbered {index}"))
                .cause("a pose is missing, or the file was sorted")
                .next("number the poses 0, 1, 2, ... in the order of the shots"));
        }
        let departure = match <&[f64; 16]>::try_from(numbers.as_slice()) {
            Ok(rows) if convention == Convention::Matrix => {
                Rigid::<Base, Flange>::from_rows(rows).map_err(|e| e.at(format!("pose {index}")))?.1
            }
            _ => 0.0,
        };
        if departure > ORTHONORMAL_WARN {
            out.warnings.push(format!("pose {index}: rotation repaired, it was {departure:.1e} from orthonormal (limit {ORTHONORMAL_WARN:.0e})"));
        }
        let pose = convention.read(&numbers).map_err(|e| e.at(format!("pose {index}")))?;
        let far = pose.translation.norm();
        if far > FARTHEST {
            return Err(Fault::input(format!(
                "pose {index}: the flange is {far:.0} mm from its base, at most {FARTHEST:.0} is believed"
            ))
            .cause("millimetres written as micrometres, a number without its decimal point, or a spoilt file")
            .next("correct the pose, or leave its frame out of meta.json"));
        }
        out.poses.push(pose);
    }
    let reach = out.poses.iter().map(|p| p.translation.norm()).fold(0.0, f64::max);
    if out.poses.len() > 2 && reach < METRES {
        out.warnings.push(format!(
            "all {} poses lie within {reach:.2} mm of the base's origin: they look like metres, and are read as millimetres",
            out.poses.len()
        ));
    }
    Ok(out)
}

fn from_json(text: &str) -> Result<PoseFile> {
    collect(json_rows(text, "base_T_flange")?)
}

/// Poses written as matrices of the transform that is named.
pub(super) fn json_rows(text: &str, transform: &str) -> Result<Vec<Row>> {
    let file: JsonPoses = serde_json::from_str(text).map_err(|e| {
        Fault::input(format!("is not a pose file: {e}"))
            .cause("a misspelt key, NaN, or a truncated file")
            .next("compare it with docs/file-formats.md")
    })?;
    for (key, value, want) in [
        ("units", &file.units, "mm"),
        ("layout", &file.layout, "row-major 4x4"),
        ("transform", &file.transform, transform),
    ] {
        if value != want {
            return Err(Fault::input(format!("{key} is '{value}', only '{want}' is read"))
                .cause("another program's convention")
                .next("convert the poses first"));
        }
    }
    Ok(file.poses.into_iter().map(|p| (p.frame, Convention::Matrix, p.matrix.to_vec())).collect())
}

fn from_csv(text: &str) -> Result<PoseFile> {
    collect(csv_rows(text)?)
}

/// A CSV has a header; `frame,m00,...,m33` is a matrix in mm, every other layout is preceded by a
/// line `# convention: NAME`.
pub(super) fn csv_rows(text: &str) -> Result<Vec<Row>> {
    let mut convention = None;
    let mut header = false;
    let mut rows = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if let Some(comment) = line.strip_prefix('#') {
            if let Some(name) = comment.trim().strip_prefix("convention:") {
                convention = Some(
                    name.trim()
                        .parse::<Convention>()
                        .map_err(|e| Fault::input(e).next("name a convention of docs/conventions.md"))?,
                );
            }
        } else if !line.is_empty() && !header {
            header = true;
            let matrix = line.split(',').map(str::trim).skip(1).eq(Convention::Matrix.labels().iter().copied());
            convention = convention.or(matrix.then_some(Convention::Matrix));
            if convention.is_none() {
                return Err(Fault::input(format!("line {}: poses without a convention", number + 1))
                    .cause("six or seven numbers can be read in nine ways, and this program does not guess")
                    .next(
                        "put a line '# convention: denso' (or ur, kuka, fanuc, abb, yaskawa, ros, quaternion) first",
                    ));
            }
        } else if !line.is_empty() {
            let mut cells = line.split(',').map(|c| c.trim().parse::<f64>());
            let bad = || {
                Fault::input(format!("line {}: '{line}' is not a row of numbers", number + 1))
                    .cause("a truncated or edited file")
                    .next("export the poses again")
            };
            let index = cells.next().and_then(|c| c.ok()).filter(|c| c.fract() == 0.0 && *c >= 0.0).ok_or_else(bad)?;
            rows.push((index as usize, cells.collect::<std::result::Result<Vec<f64>, _>>().map_err(|_| bad())?));
        }
    }
    let convention = convention.unwrap_or(Convention::Matrix);
    Ok(rows.into_iter().map(|(i, numbers)| (i, convention, numbers)).collect())
}

/// Writes poses as JSON matrices.
pub fn save_poses(path: &Path, poses: &[Rigid<Base, Flange>]) -> Result<()> {
    let file = JsonPoses {
        units: "mm".into(),
        layout: "row-major 4x4".into(),
        transform: "base_T_flange".into(),
        poses: poses.iter().enumerate().map(|(frame, p)| JsonPose { frame, matrix: p.to_rows() }).collect(),
    };
    let text = serde_json::to_string_pretty(&file).expect("plain numbers");
    crate::files::write(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conventions_are_never_guessed() {
        assert!(from_csv("frame,x,y,z,rx,ry,rz\n0,1,2,3,4,5,6\n").unwrap_err().next.contains("convention"));
        let poses = from_csv("# convention: denso\nframe,x,y,z,rx,ry,rz\n0,1,2,3,4,5,6\n").unwrap().poses;
        assert_eq!(poses[0].translation, crate::geometry::Vec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn gaps_and_nan_are_named() {
        let row = "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1";
        let head = format!("frame,{}\n", Convention::Matrix.labels().join(","));
        assert_eq!(from_csv(&format!("{head}0,{row}\n1,{row}\n")).unwrap().poses.len(), 2);
        assert!(from_csv(&format!("{head}0,{row}\n2,{row}\n")).unwrap_err().what.contains("numbered 2"));
        assert!(from_csv(&format!("{head}0,{}\n", row.replacen('1', "NaN", 1))).is_err());
    }

    #[test]
    fn metres_are_noticed_and_the_impossible_is_refused() {
        let file = |scale: f64| {
            let rows: Vec<String> =
                (0..3).map(|k| format!("{k},{},{},0,0,0,0\n", 400.0 * scale, f64::from(k) * scale)).collect();
            from_csv(&format!("# convention: denso\nframe,x,y,z,rx,ry,rz\n{}", rows.concat()))
        };
        assert!(file(1.0).unwrap().warnings.is_empty());
        assert!(file(1e-3).unwrap().warnings[0].contains("metres"));
        assert!(file(1e3).unwrap_err().what.contains("400000 mm"));
    }

    #[test]
    fn a_misspelt_name_is_answered_with_those_that_are_there() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("poses_noisy.json"), "").unwrap();
        assert!(find_and_load(dir.path(), "poses").unwrap_err().next.contains("poses_noisy"));
    }

    #[test]
    fn json_round_trips() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("poses.json");
        let pose =
            Rigid::from_vectors(&crate::geometry::Vec3::new(0.1, 0.2, 0.3), crate::geometry::Vec3::new(4.0, 5.0, 6.0));
        save_poses(&path, &[pose]).unwrap();
        assert!(load_poses(&path).unwrap().poses[0].difference(&pose).0 < 1e-12);
    }
}
