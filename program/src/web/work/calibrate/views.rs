//! In: an automatic calibration, running or finished; a recording of boards. Out: its pictures with the detected
//! corners and the tilt of the board.
//! Frame and unit: px of the picture, degrees.

use super::super::jobs::Jobs;
use super::super::place::Place;
use crate::web::guard::resolve;
use crate::web::message::BoardView;
use sheetlight::calibrate::boards::{FindOptions, find};
use sheetlight::calibrate::pose::board_pose;
use sheetlight::camera::Intrinsics;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Board, Camera, Rigid};
use sheetlight::recording::{BoardSpec, Recording};
use sheetlight::rig::Rig;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};

/// Most pictures that are shown.
const NEWEST: usize = 6;
/// Most pictures whose corners are cached.
const REMEMBERED: usize = 400;

/// Cache of the corners in pictures.
#[derive(Default)]
pub struct Views(Mutex<BTreeMap<PathBuf, BoardView>>);

impl Views {
    /// The newest pictures of a job, the newest one last; empty while there are none.
    pub fn of(&self, jobs: &Jobs, id: &str) -> Result<Vec<BoardView>> {
        let job = jobs.get(id)?;
        let folder = jobs.folder(&job);
        // A resumed job started another folder beside the previous one.
        let names = (0..).map(|k| if k == 0 { "pictures".into() } else { format!("pictures-{k}") });
        let Some(pictures) = names.take_while(|n: &String| folder.join(n).is_dir()).last() else {
            return Ok(Vec::new());
        };
        let line = folder.join(&pictures).join("line");
        if !line.join("meta.json").is_file() {
            return Ok(Vec::new());
        }
        let recording = Recording::open(&line)?;
        let names = recording.meta.frames.iter().filter_map(|f| f.ambient.clone());
        let names: Vec<String> = names.collect();
        let newest = names.iter().skip(names.len().saturating_sub(NEWEST));
        newest.map(|name| self.one(&recording, name, &format!("{pictures}/line/{name}"))).collect()
    }

    /// The board in a picture of a recording.
    ///
    /// # Errors
    /// No such recording or frame; a recording without a board.
    pub fn of_recording(&self, place: &Place, name: &str, frame: usize) -> Result<BoardView> {
        let recording = Recording::open(&resolve(&place.recordings, name)?)?;
        let at = recording.meta.frames.get(frame).ok_or_else(|| {
            Fault::input(format!("frame {frame} of {}", recording.meta.frames.len())).next("reload the page")
        })?;
        let board = recording.meta.board_of(at).cloned();
        let picture = at.ambient.clone().or_else(|| at.laser.clone());
        let (Some(board), Some(picture)) = (board, picture) else {
            return Err(Fault::input(format!("frame {frame} of {name} shows no board")).next("choose another"));
        };
        let rig = Rig::load_camera(&place.station).ok();
        let count = recording.counts().ok().and_then(|all| all.get(frame).copied().flatten());
        let view = self.look(&recording, &picture, "", Some(&board), rig.and_then(|r| r.camera).map(|c| c.value))?;
        Ok(BoardView { count, ..view })
    }

    fn one(&self, recording: &Recording, name: &str, file: &str) -> Result<BoardView> {
        self.look(recording, name, file, recording.meta.board.as_ref(), None)
    }

    fn look(
        &self,
        recording: &Recording,
        name: &str,
        file: &str,
        board: Option<&BoardSpec>,
        camera: Option<Intrinsics>,
    ) -> Result<BoardView> {
        let path = recording.folder.join(name);
        if let Some(view) = self.known().get(&path) {
            return Ok(view.clone());
        }
        let picture = recording.picture(name)?;
        let seen = board.and_then(|b| find(&picture, b, &FindOptions::default()).ok().map(|seen| (b, seen)));
        let camera = camera.filter(|c| [c.width, c.height] == [picture.width, picture.height]);
        let camera = camera.unwrap_or_else(|| usual(picture.width, picture.height));
        let lean =
            |(b, seen): &(&BoardSpec, _)| board_pose(&camera, b, seen).ok().map(|p| lean_deg(&p.camera_from_board));
        let view = BoardView {
            name: name.trim_start_matches("ambient_").trim_end_matches(".png").into(),
            file: file.into(),
            width: picture.width,
            height: picture.height,
            lean_deg: seen.as_ref().and_then(lean),
            count: None,
            corners: seen.map_or_else(Vec::new, |(_, s)| s.points.iter().map(|p| [p.pixel.x, p.pixel.y]).collect()),
        };
        let mut known = self.known();
        while known.len() >= REMEMBERED {
            known.pop_first();
        }
        known.insert(path, view.clone());
        Ok(view)
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<PathBuf, BoardView>> {
        self.0.lock().unwrap_or_else(|e| e.into_inner())
    }
}

/// Intrinsics for an unknown camera, with a focal length equal to the picture's width. Sufficient for a gauge only.
fn usual(width: u32, height: u32) -> Intrinsics {
    let f = f64::from(width);
    let (cx, cy) = (0.5 * (f - 1.0), 0.5 * (f64::from(height) - 1.0));
    Intrinsics { fx: f, fy: f, cx, cy, skew: 0.0, distortion: [0.0; 5].into(), width, height }
}

/// Tilt of the board's normal, taken towards the camera, to the right and downwards in the picture, degrees.
fn lean_deg(camera_from_board: &Rigid<Camera, Board>) -> [f64; 2] {
    let n = camera_from_board.rotation.column(2);
    let side = -n.z.signum();
    [n.x, n.y].map(|v| (side * v).atan2(n.z.abs()).to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::geometry::Vec3;

    #[test]
    fn a_board_leans_where_it_is_tilted_to_whichever_way_its_z_points() {
        let at = Vec3::new(0.0, 0.0, 300.0);
        for flipped in [0.0, std::f64::consts::PI] {
            // Rotated about the camera's y: the side that faces the camera turns to the left, then to the right.
            for (about_y, wanted) in [(20f64, -20.0), (-35.0, 35.0)] {
                let tilt: Rigid<Camera, Camera> = Rigid::from_vectors(&Vec3::new(0.0, about_y.to_radians(), 0.0), at);
                let board: Rigid<Camera, Board> = Rigid::from_vectors(&Vec3::new(flipped, 0.0, 0.0), Vec3::zeros());
                let [right, down] = lean_deg(&(tilt * board));
                assert!((right - wanted).abs() < 1e-9 && down.abs() < 1e-9, "{about_y}: {right} {down}");
            }
        }
    }
}
