//! In: pose files (JSON matrices, CSV matrices, CSV in a named robot convention). Out: base_from_flange.
//! Frame and unit: base and flange; the file states its units, the result is in mm.

use super::pose_csv::{Row, check_statements};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, ORTHONORMAL_WARN, Rigid};
use crate::robot::{Convention, Written};
use std::path::{Path, PathBuf};

/// The poses of a file, with warnings about them.
#[derive(Clone, Debug)]
pub struct PoseFile {
    /// base_from_flange, mm, in the file's order.
    pub poses: Vec<Rigid<Base, Flange>>,
    /// The numbers that each pose was read from.
    pub written: Vec<Written>,
    /// Warnings about rotations repaired by more than the warning limit.
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

/// Tolerance between two files with the same poses, one of them with few digits, mm and rad.
const SAME: [f64; 2] = [0.01, 2e-4];

/// Loads `NAME`, or `NAME.json` or `NAME.csv` in a folder; if both exist they must agree.
pub(super) fn find_and_load(folder: &Path, name: &str) -> Result<PoseFile> {
    let candidates = [folder.join(name), folder.join(format!("{name}.json")), folder.join(format!("{name}.csv"))];
    let there: Vec<&PathBuf> = candidates.iter().filter(|p| p.is_file()).collect();
    match there[..] {
        [path] => load_poses(path),
        [path, other] if path != &candidates[0] => {
            let (read, again) = (load_poses(path)?, load_poses(other)?);
            agree(&read.poses, &again.poses).map_err(|what| {
                Fault::input(format!("{} and {} differ: {what}", path.display(), other.display()))
                    .cause("poses of two recordings, or of two conventions")
                    .next("take away the one that is wrong")
            })?;
            Ok(read)
        }
        [path, ..] => load_poses(path),
        [] => Err(Fault::input(format!("{}: no pose file {name}.json or {name}.csv", folder.display()))
            .cause("the name is misspelt or the poses were not recorded")
            .next(match names_in(folder) {
                names if names.is_empty() => "record the robot's pose at every picture".into(),
                names => format!("name one of these with --poses: {}", names.join(", ")),
            })),
    }
}

fn agree(a: &[Rigid<Base, Flange>], b: &[Rigid<Base, Flange>]) -> std::result::Result<(), String> {
    if a.len() != b.len() {
        return Err(format!("{} and {} poses", a.len(), b.len()));
    }
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        let (angle, mm) = a.difference(b);
        if !(mm <= SAME[0] && angle <= SAME[1]) {
            return Err(format!("pose {i} by {mm:.3} mm and {:.3} degrees", angle.to_degrees()));
        }
    }
    Ok(())
}

/// The files of a folder whose names suggest poses.
fn names_in(folder: &Path) -> Vec<String> {
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

/// Largest distance of a flange from its base, mm: ten times the reach of the longest arms, on a rail.
const FARTHEST: f64 = 1e5;
/// Poses that all lie within this distance of the base's origin, mm, are in metres: no arm works inside its own
/// foot.
const METRES: f64 = 8.0;

/// Loads a pose file according to its extension: `.json`, or `.csv`/`.txt`.
pub fn load_poses(path: &Path) -> Result<PoseFile> {
    let text = crate::files::read_text(path)?;
    let json = path.extension().is_some_and(|e| e == "json");
    let parsed = if json { from_json(text.trim_start_matches('\u{feff}')) } else { from_csv(&text) };
    parsed.map_err(|e| e.at(path.display()))
}

fn collect(rows: Vec<Row>) -> Result<PoseFile> {
    let mut out = PoseFile { poses: Vec::new(), written: Vec::new(), warnings: Vec::new() };
    let mut repaired: Vec<(usize, f64)> = Vec::new();
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
            repaired.push((index, departure));
        }
        let pose = convention.read(&numbers).map_err(|e| e.at(format!("pose {index}")))?;
        let far = pose.translation.norm();
        if far > FARTHEST {
            return Err(Fault::input(format!(
                "pose {index}: the flange is {far:.0} mm from its base, at most {FARTHEST:.0} is accepted"
            ))
            .cause("millimetres written as micrometres, a number without its decimal point, or a spoilt file")
            .next("correct the pose, or remove its frame from meta.json"));
        }
        out.poses.push(pose);
        out.written.push(Written { convention, numbers: without_figure(convention, numbers) });
    }
    if let Some((index, departure)) = repaired.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
        let of = if let [_] = repaired[..] { String::new() } else { format!(" as the worst of {}", repaired.len()) };
        out.warnings.push(format!(
            "pose {index}{of}: rotation repaired, it was {departure:.1e} from orthonormal (limit \
             {ORTHONORMAL_WARN:.0e})"
        ));
    }
    let metres = out.metres();
    out.warnings.extend(metres);
    Ok(out)
}

/// Drops the arm's figure, which a Denso file may have in a last column.
fn without_figure(convention: Convention, mut numbers: Vec<f64>) -> Vec<f64> {
    numbers.truncate(convention.labels().len());
    numbers
}

impl PoseFile {
    /// Poses that came as transforms, without a pose file.
    pub(super) fn of(poses: Vec<Rigid<Base, Flange>>) -> PoseFile {
        PoseFile { written: poses.iter().map(Written::matrix).collect(), poses, warnings: Vec::new() }
    }

    fn metres(&self) -> Option<String> {
        looks_like_metres(&self.poses)
    }
}

/// A warning if all poses lie within the robot's own foot; otherwise `None`.
pub fn looks_like_metres(poses: &[Rigid<Base, Flange>]) -> Option<String> {
    let reach = poses.iter().map(|p| p.translation.norm()).fold(0.0, f64::max);
    (poses.len() > 2 && reach < METRES).then(|| {
        format!(
            "all {} poses lie within {reach:.2} mm of the base's origin: they look like metres, and are read as \
             millimetres",
            poses.len()
        )
    })
}

fn from_csv(text: &str) -> Result<PoseFile> {
    check_statements(text, &["base_T_flange", "base_from_flange"])?;
    let read = super::pose_csv::read(text)?;
    let convention = read.rows.first().map_or(Convention::Matrix, |r| r.1);
    if !read.angle_stated {
        looks_like_another_unit(convention, &read.rows)?;
    }
    let file = collect(read.rows)?;
    match file.metres() {
        Some(what) if !read.length_stated => Err(Fault::refused(what)
            .cause("positions in metres under a convention in millimetres")
            .next("convert them, or state the unit in the header if they are correct: X_mm,Y_mm,Z_mm")),
        _ => Ok(file),
    }
}

/// Refuses angles that look like the other unit, until the header states the unit.
fn looks_like_another_unit(convention: Convention, rows: &[Row]) -> Result<()> {
    let Some((angles, degrees)) = convention.angles() else { return Ok(()) };
    let of = |row: &Row| row.2.get(angles.clone()).unwrap_or_default().iter().fold(0.0, |m: f64, a| m.max(a.abs()));
    let largest = rows.iter().map(of).fold(0.0, f64::max);
    const TURN: f64 = std::f64::consts::TAU;
    let (name, column) = (convention.name(), convention.labels()[angles.start].replace(' ', "_"));
    let asked = |is: &str, want: &str| {
        Err(Fault::refused(format!("no angle is above {largest:.3} in {} poses: {is}, {name} has {want}", rows.len()))
            .cause(format!("the file is in {is} or of another convention"))
            .next(format!("name the right convention, or state the unit in the header if it is correct: {column},...")))
    };
    if degrees && largest > 0.0 && largest < 7.0 {
        return asked("radians", "degrees");
    }
    if !degrees && largest > TURN + 0.01 {
        return Err(Fault::refused(format!("an angle is {largest:.3}, above a turn in radians, which {name} has"))
            .cause("the file is in degrees")
            .next(format!("convert it, or state the unit in the header if it is correct: {column},...")));
    }
    Ok(())
}

fn from_json(text: &str) -> Result<PoseFile> {
    collect(json_rows(text, "base_T_flange")?)
}

/// Reads poses written as matrices of the named transform.
pub(super) fn json_rows(text: &str, transform: &str) -> Result<Vec<Row>> {
    let file: JsonPoses = serde_json::from_str(text).map_err(|e| {
        Fault::input(format!("is not a pose file: {e}"))
            .cause(crate::files::slip_in(text, e.line(), "a misspelt key, NaN, or a truncated file"))
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
        let poses = from_csv("# convention: denso\nframe,x,y,z,rx_deg,ry_deg,rz_deg\n0,1,2,3,4,5,6\n").unwrap().poses;
        assert_eq!(poses[0].translation, crate::geometry::Vec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn a_unit_in_a_comment_is_honoured_or_refused() {
        let head = format!("frame,{}\n0,1,0,0,5,0,1,0,6,0,0,1,7,0,0,0,1\n", Convention::Matrix.labels().join(","));
        assert_eq!(from_csv(&format!("# units: mm\n{head}")).unwrap().poses.len(), 1);
        assert_eq!(from_csv(&format!("# exported: today\n{head}")).unwrap().poses.len(), 1);
        for comment in ["# units: m", "# Unit = metres", "# units: mm, deg"] {
            let said = from_csv(&format!("{comment}\n{head}")).unwrap_err();
            assert!(said.what.contains("only 'mm' is read there"), "{comment}: {said}");
        }
    }

    #[test]
    fn a_transform_in_a_comment_is_honoured_or_refused() {
        let head = format!("frame,{}\n0,1,0,0,5,0,1,0,6,0,0,1,7,0,0,0,1\n", Convention::Matrix.labels().join(","));
        assert_eq!(from_csv(&format!("# transform: base_T_flange\n{head}")).unwrap().poses.len(), 1);
        for comment in ["# transform: flange_T_base", "# Transform = base_T_tool", "# layout: column-major"] {
            for text in [format!("{comment}\n{head}"), format!("{head}{comment}\n")] {
                let said = from_csv(&text).unwrap_err();
                assert!(said.what.starts_with("a comment states the "), "{comment}: {said}");
            }
        }
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
        assert!(file(1e-3).unwrap_err().what.contains("metres"));
        let meant = "# convention: denso\nframe,X_mm,Y_mm,Z_mm,RX,RY,RZ\n0,1,0,0,0,0,0\n1,2,0,0,0,0,0\n2,3,0,0,0,0,0\n";
        assert!(from_csv(meant).unwrap().warnings[0].contains("metres"));
        assert!(file(1e3).unwrap_err().what.contains("400000 mm"));
    }

    #[test]
    fn angles_of_the_other_unit_are_asked_about() {
        let file = |convention: &str, header: &str, angle: f64| {
            let rows: String = (0..4).map(|k| format!("{k},0.5,0.4,{k},0,0,{angle}\n")).collect();
            from_csv(&format!("# convention: {convention}\nframe,{header}\n{rows}"))
                .map(|_| ())
                .map_err(|e| e.to_string())
        };
        let bare = "X,Y,Z,RX,RY,RZ";
        assert!(file("denso", bare, 3.1).unwrap_err().contains("radians"));
        assert!(file("denso", "X_mm,Y_mm,Z_mm,RX_deg,RY_deg,RZ_deg", 3.1).is_ok());
        assert!(file("ur", bare, 90.0).unwrap_err().contains("degrees"));
        assert!(file("ur", "X,Y,Z,RX_rad,RY_rad,RZ_rad", 9.0).is_ok());
        assert!(file("ur", bare, 3.1).is_ok());
        for impossible in [1e10, 1e160, 1e308] {
            for convention in ["denso", "ur"] {
                let unit = if convention == "ur" { "rad" } else { "deg" };
                let header = format!("X,Y,Z,RX_{unit},RY_{unit},RZ_{unit}");
                let said = file(convention, &header, impossible).unwrap_err();
                assert!(said.contains("angle"), "{said}");
            }
        }
    }

    #[test]
    fn two_files_of_one_name_must_agree() {
        let dir = tempfile::tempdir().unwrap();
        let at = |k: f64| {
            Rigid::from_vectors(&crate::geometry::Vec3::new(0.1, 0.2, 0.3), crate::geometry::Vec3::new(400.0, k, 6.0))
        };
        save_poses(&dir.path().join("poses.json"), &[at(1.0), at(2.0)]).unwrap();
        let csv = |b: f64, n: usize| {
            let row = |(i, p): (usize, Rigid<Base, Flange>)| {
                let numbers: Vec<String> = Convention::Denso.write(&p).iter().map(|v| format!("{v:.3}")).collect();
                format!("{i},{}\n", numbers.join(","))
            };
            let rows: String = [at(1.0), at(b)].into_iter().take(n).enumerate().map(row).collect();
            let text = format!("# convention: denso\nframe,X,Y,Z,RX,RY,RZ\n{rows}");
            std::fs::write(dir.path().join("poses.csv"), text).unwrap();
            find_and_load(dir.path(), "poses").map(|f| f.poses.len()).map_err(|e| e.what)
        };
        assert_eq!(csv(2.0, 2), Ok(2));
        assert!(csv(2.5, 2).unwrap_err().contains("pose 1 by 0.500 mm"));
        assert!(csv(2.0, 1).unwrap_err().contains("2 and 1 poses"));
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
