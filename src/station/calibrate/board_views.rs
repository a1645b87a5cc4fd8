//! In: the pictures of a recording that show boards, and a calibrated camera. Out: the boards' poses as
//! measurements, and for each picture without a pose the reason.
//! Frame and unit: camera_from_board, mm.

use crate::calibrate::boards::{FindOptions, find};
use crate::calibrate::measured_pose::{MeasuredPose, SeenBoard, measure_view};
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::raster::Image;
use crate::recording::{BoardSpec, FrameRef, Recording};
use crate::rig::Calibration;
use rayon::prelude::*;

/// The board in one frame of a recording.
#[derive(Clone, Debug)]
pub struct FrameBoard {
    /// Index into the recording's frames.
    pub frame: usize,
    /// The board as meta.json describes it; an unstated dot diameter is the pictures' median, mm.
    pub board: BoardSpec,
    /// The features, with their places as drawn.
    pub seen: SeenBoard,
    /// camera_from_board as measured with the board as drawn, mm, with the covariance from its pixels.
    pub pose: MeasuredPose,
    /// The board looks the same after a turn: only its plane is known, not its origin.
    pub ambiguous: bool,
}

/// The frames with boards, and the pictures without, each with the reason.
#[derive(Clone, Debug, Default)]
pub struct Boards {
    /// In the order of the recording's frames.
    pub found: Vec<FrameBoard>,
    /// Name of the picture, and the reason.
    pub missing: Vec<(String, String)>,
}

/// Finds and measures the board in every frame's ambient picture. Errors: a recording without boards or ambient
/// pictures, another picture size than the camera's.
pub fn boards(
    recording: &Recording,
    camera: &Calibration<Intrinsics>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Boards> {
    let meta = &recording.meta;
    let same = camera.same_pictures(meta.image.size(), meta.image.readout.as_ref());
    same.map_err(|e| e.at(recording.folder.display()))?;
    recording.read_alike(&camera.hot_pixels)?;
    recording.grey_levels()?;
    let camera = &camera.value;
    let frames: Vec<(usize, &FrameRef, &str)> =
        meta.frames.iter().enumerate().filter_map(|(i, f)| Some((i, f, f.ambient.as_deref()?))).collect();
    if frames.is_empty() {
        return Err(Fault::input(format!("{}: no frame has an 'ambient' picture", recording.folder.display()))
            .cause("boards are found in pictures taken in room light, the laser off")
            .next("record an ambient picture with each frame"));
    }
    let done = std::sync::atomic::AtomicUsize::new(0);
    // A picture that is missing or of another size is a fault of the recording and ends this; a board that is not
    // found concerns only its picture.
    let each: Vec<(String, Result<Seen>)> = frames
        .par_iter()
        .map(|(index, frame, name)| {
            let board = meta.board_of(frame).ok_or_else(|| {
                Fault::input(format!("{name}: meta.json describes no board for it"))
                    .next("describe the board under 'board' or 'boards'")
            })?;
            let result = one(*index, name, board, &recording.picture(name)?, camera);
            progress(done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, frames.len());
            Ok((name.to_string(), result))
        })
        .collect::<Result<_>>()?;
    let each = first_squares(each, &frames, recording, camera)?;
    let mut out = Boards::default();
    let (mut diameters, mut faults) = (Vec::new(), Vec::new());
    for (name, result) in each {
        match result {
            Ok((found, diameter)) => {
                diameters.extend(diameter);
                out.found.push(found);
            }
            Err(fault) => {
                out.missing.push((name, fault.to_string()));
                faults.push(fault);
            }
        }
    }
    if out.found.is_empty() {
        return Err(none_found(&faults, &out.missing));
    }
    know_diameter(&mut out.found, diameters);
    Ok(out)
}

/// The reason that states which board sizes a calibration without robot poses rests on: it cannot check them.
pub(super) fn unchecked_size<'a>(boards: impl IntoIterator<Item = &'a BoardSpec>) -> String {
    let mut sizes: Vec<String> =
        boards.into_iter().map(|b| format!("{} {} mm", b.length_key(), b.length_mm())).collect();
    sizes.sort();
    sizes.dedup();
    format!(
        "all lengths scale with the stated board size, which this calibration cannot check: {}; measure the board",
        sizes.join(", ")
    )
}

/// A board in a picture, and the diameter of its dots if the description does not state it.
type Seen = (FrameBoard, Option<f64>);

fn one(frame: usize, name: &str, board: &BoardSpec, picture: &Image, camera: &Intrinsics) -> Result<Seen> {
    let view = find(picture, board, &FindOptions::default())?;
    let pose = measure_view(name, camera, board, &view)?;
    let seen = SeenBoard::from_view(name, board, &view);
    let board = board.beginning(view.begins_white);
    Ok((FrameBoard { frame, board, seen, pose, ambiguous: view.ambiguous }, view.dot_diameter))
}

/// Pictures that do not show the colour of their board's first square take it from the first picture that does.
fn first_squares(
    each: Vec<(String, Result<Seen>)>,
    frames: &[(usize, &FrameRef, &str)],
    recording: &Recording,
    camera: &Intrinsics,
) -> Result<Vec<(String, Result<Seen>)>> {
    let told = each.iter().find_map(|(_, seen)| seen.as_ref().ok().map(|(found, _)| found.board.begins_white()));
    let Some(white) = told else { return Ok(each) };
    let again = |((name, seen), (index, frame, _)): ((String, Result<Seen>), &(usize, &FrameRef, &str))| {
        let open = recording.meta.board_of(frame).filter(|b| seen.is_err() && b.first_square_may_stay_open());
        let Some(board) = open else { return Ok((name, seen)) };
        let seen = one(*index, &name, &board.beginning(white), &recording.picture(&name)?, camera);
        Ok((name, seen))
    };
    each.into_iter().zip(frames).map(again).collect()
}

/// The fault of a recording without any board, from one fault for each picture.
fn none_found(faults: &[Fault], missing: &[(String, String)]) -> Fault {
    // Chooses the picture whose cause most pictures share.
    let votes = |f: &Fault| faults.iter().filter(|o| o.cause == f.cause).count();
    let (fault, (name, _)) =
        faults.iter().zip(missing).rev().max_by_key(|(f, _)| votes(f)).expect("one picture or more");
    let what = format!("no board was found in any of {} pictures; {name}: {}", faults.len(), fault.what);
    Fault::input(what)
        .cause(format!("{}; or another board than meta.json describes", fault.cause))
        .next(format!("{}; compare meta.json's board with the real one", fault.next))
}

/// Sets an unstated dot diameter to the median over the pictures.
fn know_diameter(found: &mut [FrameBoard], mut diameters: Vec<f64>) {
    diameters.sort_by(f64::total_cmp);
    let Some(median) = diameters.get(diameters.len() / 2) else { return };
    for b in found {
        if let BoardSpec::Circles { diameter_mm: unstated @ None, .. } = &mut b.board {
            *unstated = Some(*median);
        }
    }
}
