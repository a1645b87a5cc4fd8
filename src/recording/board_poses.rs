//! In: a file of board poses that another program measured. Out: each pose with the number of its robot pose.
//! Frame and unit: camera_from_board; the file states its units, the result is in mm.

use super::pose_csv;
use super::poses::json_rows;
use crate::fault::{Fault, Result};
use crate::files::stated;
use crate::geometry::{Board, Camera, Rigid};
use std::path::Path;

/// The transform that a CSV file must name, and that JSON must state under `transform`.
const TRANSFORM: &str = "camera_T_board";

/// Loads board poses. The layouts are those of robot poses ([`super::load_poses`]), but numbers may be missing where
/// the board was not found.
///
/// # Errors
/// Another transform than camera_T_board, or none stated; a repeated number; a board behind the camera.
pub fn load_board_poses(path: &Path) -> Result<Vec<(usize, Rigid<Camera, Board>)>> {
    let text = crate::files::read_text(path)?;
    let json = path.extension().is_some_and(|e| e == "json");
    read(&text, json).map_err(|e| e.at(path.display()))
}

fn check_transform(text: &str) -> Result<()> {
    let values = stated(text, &["transform"]);
    let other = values.iter().find(|value| **value != TRANSFORM);
    if other.is_none() && !values.is_empty() {
        return pose_csv::check_statements(text, &[TRANSFORM]);
    }
    Err(Fault::input(match other {
        Some(other) => format!("transform is '{other}', only '{TRANSFORM}' is read"),
        None => "does not say what its poses are".into(),
    })
    .cause("a board's pose may be written as camera_T_board or board_T_camera, and this program does not guess")
    .next(format!("put a line '# transform: {TRANSFORM}' first, with poses that map board to camera coordinates")))
}

fn read(text: &str, json: bool) -> Result<Vec<(usize, Rigid<Camera, Board>)>> {
    let rows = if json {
        json_rows(text, TRANSFORM)?
    } else {
        check_transform(text)?;
        pose_csv::read(text)?.rows
    };
    let mut out: Vec<(usize, Rigid<Camera, Board>)> = Vec::new();
    for (number, convention, numbers) in rows {
        if out.iter().any(|(n, _)| *n == number) {
            return Err(Fault::input(format!("board pose {number} is there twice"))
                .cause("two files were joined, or a robot pose was used for two pictures")
                .next("number each board pose by the robot pose it was taken at"));
        }
        let pose = convention.read::<Camera, Board>(&numbers).map_err(|e| e.at(format!("board pose {number}")))?;
        if !(pose.translation.z > 0.0) {
            return Err(Fault::input(format!(
                "board pose {number}: the board's origin is at z = {:.3} mm of the camera, in front of it z is above 0",
                pose.translation.z
            ))
            .cause("the poses are board_T_camera, or the camera's z axis does not point forward")
            .next(format!("write them as {TRANSFORM}: x right, y down, z forward")));
        }
        out.push((number, pose));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROW: &str = "1,0,0,5,0,1,0,6,0,0,1,300,0,0,0,1";

    #[test]
    fn poses_are_read_as_they_say_and_keep_their_numbers() {
        let head = "frame,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,m30,m31,m32,m33";
        let csv = |transform: &str, rows: &str| read(&format!("{transform}\n{head}\n{rows}"), false);
        let two = format!("0,{ROW}\n3,{ROW}\n");
        let found = csv("# transform: camera_T_board", &two).unwrap();
        assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), [0, 3]);
        assert_eq!(found[1].1.translation, crate::geometry::Vec3::new(5.0, 6.0, 300.0));
        assert!(csv("# by hand", &two).unwrap_err().next.contains("camera_T_board"));
        assert!(csv("# transform: board_T_camera", &two).unwrap_err().what.contains("board_T_camera"));
        let twice = format!("0,{ROW}\n0,{ROW}\n");
        assert!(csv("# transform: camera_T_board", &twice).unwrap_err().what.contains("twice"));
        let behind = format!("0,{}\n", ROW.replace("300", "-300"));
        assert!(csv("# transform: camera_T_board", &behind).unwrap_err().cause.contains("board_T_camera"));
        let ros =
            "# transform: camera_T_board\n# convention: ros\nframe,x,y,z,qx,qy,qz,qw\n2,0.005,0.006,0.3,0,0,0,1\n";
        assert!((read(ros, false).unwrap()[0].1.translation - found[0].1.translation).norm() < 1e-9);
    }

    #[test]
    fn json_names_its_transform() {
        let json = |transform: &str| {
            let text = format!(
                "{{\"units\":\"mm\",\"layout\":\"row-major \
                 4x4\",\"transform\":\"{transform}\",\"poses\":[{{\"frame\":4,\"matrix\":[{ROW}]}}]}}"
            );
            read(&text, true)
        };
        assert_eq!(json("camera_T_board").unwrap()[0].0, 4);
        assert!(json("base_T_flange").unwrap_err().what.contains("camera_T_board"));
    }
}
