//! In: a recording of a fixed board with robot poses and a station with a camera, or poses of both alone. Out: the
//! hand-eye calibration, its report, and its input files.
//! Frame and unit: flange_from_camera (eye in hand) or base_from_camera (eye to hand); mm, rad.

use super::board_views::{FrameBoard, boards};
use crate::calibrate::boards::turns;
use crate::calibrate::camera::board_shape::as_shaped;
use crate::calibrate::hand_eye::closed::Pair;
use crate::calibrate::hand_eye::options::{HandEyeOptions, Mount};
use crate::calibrate::hand_eye::report::{covariance, judge, page};
use crate::calibrate::hand_eye::solve::solve;
use crate::calibrate::hand_eye::turns::{read_with, resolve};
use crate::calibrate::limits::Asked;
use crate::calibrate::measured_pose::{AboutCamera, MeasuredPose, SeenBoard, intrinsic_covariance};
use crate::calibrate::report::Page;
use crate::camera::{CameraCovariance, Distortion, Intrinsics};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Board, Camera, Flange, Rigid};
use crate::recording::{Recording, load_board_poses, load_poses};
use crate::rig::{Calibration, HandEye, Kind, Rig, Volume, hash_file, hash_text};
use crate::robot::Written;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Options of [`calibrate_hand_eye`].
#[derive(Clone, Debug)]
pub struct HandEyeRun {
    /// Name of the pose file in the recording; `None`: the one that meta.json names.
    pub poses: Option<String>,
    /// Camera on the flange, or beside the robot.
    pub mount: Mount,
    /// Noise of the robot, gates and seed of the fit.
    pub solver: HandEyeOptions,
    /// Depths and tolerance of the verdict: those of the laser plane unless stated; without a laser plane those of
    /// the boards.
    pub asked: Asked,
}

/// Files of pose pairs.
#[derive(Clone, Debug)]
pub struct PosePairs {
    /// File of the robot's poses, base_from_flange.
    pub robot: PathBuf,
    /// File of the boards' poses, camera_from_board, each with the index of its robot pose.
    pub boards: PathBuf,
    /// Sigmas of the board poses per axis, mm and rad, if known.
    pub board_sigma: Option<[f64; 2]>,
}

/// Result of a calibration command: the record to be stored and the page.
pub struct Calibrated<T> {
    /// Value, covariance, quality and hashes of the inputs.
    pub calibration: Calibration<T>,
    /// The report for a person.
    pub page: Page,
    /// Pictures that could not be used, with the reason.
    pub missing: Vec<(String, String)>,
}

/// The calibrated camera pose.
pub enum HandEyeResult {
    /// Eye in hand: flange_from_camera, mm.
    OnFlange(Calibrated<HandEye>),
    /// Eye to hand: base_from_camera, mm.
    InBase(Calibrated<Rigid<Base, Camera>>),
}

/// Width of the view at a distance of 1 if no camera is known: a usual lens sees 20 to 25 degrees.
const USUAL_VIEW: f64 = 0.4;

/// The pairs with their origin and remarks.
struct Gathered<'a> {
    pairs: Vec<Pair>,
    /// The camera with which the boards were measured, if they were seen in pictures.
    camera: Option<&'a Calibration<Intrinsics>>,
    /// Inputs: name and hash.
    inputs: BTreeMap<String, String>,
    missing: Vec<(String, String)>,
    notes: Vec<String>,
    /// The source of the board's lengths, in words.
    board_length: String,
}

/// Calibrates the hand-eye transform from a recording of one board that stands still (eye in hand) or is carried by
/// the flange (eye to hand). `progress` receives (pictures done, pictures in all).
pub fn calibrate_hand_eye(
    recording: &Recording,
    rig: &Rig,
    run: &HandEyeRun,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<HandEyeResult> {
    let camera = rig.need_camera()?;
    let file = recording.pose_file(run.poses.as_deref())?;
    let poses: Vec<_> = file.poses.iter().zip(&file.written).collect();
    let mut seen = boards(recording, camera, progress)?;
    let mut pairs = Vec::new();
    for b in &seen.found {
        let pose = recording.pose_of(b.frame, &poses).map_err(|e| e.at(&b.pose.name))?;
        pairs.push(paired(run.mount, *pose, b.pose.clone()));
    }
    let mut notes: Vec<String> =
        seen.missing.iter().map(|(name, why)| format!("{name} was not used: {}", first_line(why))).collect();
    notes.extend(one_origin(&mut pairs, &mut seen.found, run.solver.seed)?);
    notes.extend(shaped(&mut pairs, &seen.found, &camera.value));
    let again = said_already(recording, camera, &mut pairs)?;
    if again > 0 {
        notes.push(format!(
            "{again} of these pictures were also used to calibrate the camera: their information about it is used only \
             once"
        ));
    }
    let pose_name = run.poses.clone().or(recording.meta.pose_file.clone()).unwrap_or_default();
    let rows: Vec<[f64; 16]> = file.poses.iter().map(|p| p.to_rows()).collect();
    let mut inputs = BTreeMap::from([
        ("meta.json".to_string(), hash_file(&recording.folder.join("meta.json"))?),
        (format!("poses {pose_name}"), hash_text(serde_json::to_string(&rows).expect("numbers").as_bytes())),
    ]);
    for b in &seen.found {
        inputs.insert(b.pose.name.clone(), hash_file(&recording.folder.join(&b.pose.name))?);
    }
    let board_length = format!("{} in meta.json", seen.found[0].board.length_key());
    let gathered = Gathered { pairs, camera: Some(camera), inputs, missing: seen.missing, notes, board_length };
    let view = |z: f64| camera.value.view_mm(z);
    concluded(gathered, &intrinsic_covariance(&camera.covariance)?, &camera.value, rig, view, run)
}

/// The same from robot poses and board poses that another program measured, without pictures: no camera is needed.
pub fn calibrate_hand_eye_from_poses(files: &PosePairs, rig: &Rig, run: &HandEyeRun) -> Result<HandEyeResult> {
    let file = load_poses(&files.robot)?;
    let poses: Vec<_> = file.poses.iter().zip(&file.written).collect();
    let boards = load_board_poses(&files.boards)?;
    // Boards are compared at the corners of a square that a usual lens sees almost completely at their distance.
    let depths = Volume::spanned(boards.iter().map(|(_, b)| b.translation.z), "where the boards stood");
    let side = USUAL_VIEW * depths.map_or(0.0, |d| d.middle());
    let pair = |(index, board): &(usize, Rigid<Camera, Board>)| {
        let pose = poses.get(*index).ok_or_else(|| {
            Fault::input(format!("a board was seen at pose {index}, the pose file has {}", poses.len()))
                .cause("the pose file belongs to another recording, or ends early")
                .next("export the poses of all pictures again")
        })?;
        let seen = MeasuredPose::given(format!("pose {index}"), *board, files.board_sigma, side);
        Ok(paired(run.mount, *pose, seen))
    };
    let gathered = Gathered {
        pairs: boards.iter().map(pair).collect::<Result<_>>()?,
        // The result is used with the station's camera, whatever camera measured the boards.
        camera: rig.camera.as_ref(),
        inputs: BTreeMap::from([
            (file_name(&files.robot), hash_file(&files.robot)?),
            (file_name(&files.boards), hash_file(&files.boards)?),
        ]),
        missing: Vec::new(),
        notes: Vec::new(),
        board_length: "the size that the board's poses were computed with".into(),
    };
    // Nothing is known in px: a pinhole of focal length 1 makes pixels tangents, which the report omits.
    let tangents = Intrinsics {
        fx: 1.0,
        fy: 1.0,
        cx: 0.0,
        cy: 0.0,
        skew: 0.0,
        distortion: Distortion::default(),
        width: 1,
        height: 1,
    };
    let view = |z: f64| rig.camera.as_ref().map_or(USUAL_VIEW * z, |c| c.value.view_mm(z));
    concluded(gathered, &CameraCovariance::exact(), &tangents, rig, view, run)
}

/// The pair of a board and a robot pose, with the numbers from which the pose was read.
fn paired(mount: Mount, (pose, written): (&Rigid<Base, Flange>, &Written), seen: MeasuredPose) -> Pair {
    Pair { written: Some(written.clone()), ..Pair::new(mount.near_from_far(pose), seen) }
}

/// `view` is the width of the camera's view at a depth, mm.
fn concluded(
    g: Gathered<'_>,
    covariance_of_camera: &CameraCovariance,
    camera: &Intrinsics,
    rig: &Rig,
    view: impl Fn(f64) -> f64,
    run: &HandEyeRun,
) -> Result<HandEyeResult> {
    run.asked.check()?;
    let solver = HandEyeOptions { board_length: g.board_length, ..run.solver.clone() };
    let fit = solve(&g.pairs, run.mount, covariance_of_camera, camera, &solver)?;
    let depths = g.pairs.iter().map(|p| p.seen.centre().z);
    let work = crate::station::volume::calibrated(rig).or_else(|| Volume::spanned(depths, "where the boards stood"));
    let limits = run.asked.limits(&work.expect("pairs with boards"), view);
    let mut quality = judge(&fit, &g.pairs, &limits);
    quality.reasons.extend(g.notes);
    let x = fit.chain.near_from_camera;
    Ok(match run.mount {
        Mount::EyeInHand => {
            let page = page(&fit, &g.pairs, &quality, "flange");
            let value = HandEye::new(x.rotation, x.translation);
            let mut calibration = Calibration::new(Kind::HandEye, value, g.camera, covariance(&fit), quality);
            calibration.inputs = g.inputs;
            HandEyeResult::OnFlange(Calibrated { calibration, page, missing: g.missing })
        }
        Mount::EyeToHand => {
            let page = page(&fit, &g.pairs, &quality, "base");
            let value = Rigid::<Base, Camera>::new(x.rotation, x.translation);
            let mut calibration = Calibration::new(Kind::BaseCamera, value, g.camera, covariance(&fit), quality);
            calibration.inputs = g.inputs;
            HandEyeResult::InBase(Calibrated { calibration, page, missing: g.missing })
        }
    })
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Pictures that went into the camera's calibration have already contributed to the camera: here they determine
/// only the board's pose. Returns their number.
fn said_already(recording: &Recording, camera: &Calibration<Intrinsics>, pairs: &mut [Pair]) -> Result<usize> {
    let known: std::collections::BTreeSet<&String> = camera.inputs.values().collect();
    let mut count = 0;
    for pair in pairs {
        if known.contains(&hash_file(&recording.folder.join(&pair.seen.name))?) {
            pair.seen.about_camera = AboutCamera::silent();
            count += 1;
        }
    }
    Ok(count)
}

/// Gives a board that looks the same after a turn one origin in all pictures, and returns a remark.
fn one_origin(pairs: &mut [Pair], found: &mut [FrameBoard], seed: u64) -> Result<Option<String>> {
    if !found.iter().any(|b| b.ambiguous) {
        return Ok(None);
    }
    if let Some(b) = found.iter().find(|b| b.board != found[0].board) {
        return Err(Fault::input(format!("{} shows another board than {}", b.pose.name, found[0].pose.name))
            .cause("a hand-eye recording shows one board that does not move against its carrier")
            .next("keep the pictures of one board"));
    }
    let turns = turns(&found[0].board);
    let chosen = resolve(pairs, &turns, seed)?;
    for ((pair, board), k) in pairs.iter_mut().zip(found).zip(&chosen) {
        *pair = read_with(pair, &turns[*k]);
        board.seen.points.iter_mut().for_each(|x| *x = turns[*k].turn.point(x));
    }
    let anew = chosen.iter().filter(|k| **k != 0).count();
    Ok(Some(format!(
        "the board looks the same after a turn: its origin follows from the robot's poses, {anew} of {} pictures are \
         read turned",
        chosen.len()
    )))
}

/// Measures the boards again with their shape if the board is not as drawn, and returns a remark. A bend that is not
/// estimated turns the board's pose by a different angle in each picture.
fn shaped(pairs: &mut [Pair], found: &[FrameBoard], camera: &Intrinsics) -> Option<String> {
    let board = &found.first()?.board;
    if found.iter().any(|b| b.board != *board) {
        return None;
    }
    let features = board.features();
    let seen: Vec<SeenBoard> = found.iter().map(|b| b.seen.clone()).collect();
    let poses: Vec<_> = pairs.iter().map(|p| p.seen.camera_from_board).collect();
    let with_shape = as_shaped(&features, &seen, &poses, camera)?;
    let rms = |poses: &mut dyn Iterator<Item = &MeasuredPose>| crate::calibrate::limits::rms(poses.map(|p| p.rms_px));
    let (drawn, now) = (rms(&mut pairs.iter().map(|p| &p.seen)), rms(&mut with_shape.poses.iter()));
    pairs.iter_mut().zip(with_shape.poses).for_each(|(pair, pose)| pair.seen = pose);
    let [within, out] = with_shape.shape.departs(&features);
    Some(format!(
        "the board is not as drawn: its features stand off by {within:.3} mm rms in its plane and {out:.3} mm out of \
         it. They are used where the pictures show them, and fit to {now:.3} px rms instead of {drawn:.3} px"
    ))
}

pub(in crate::station) fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or("")
}
