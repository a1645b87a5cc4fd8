//! In: recordings, a station. Out: its whole rig from one solve, with verdict and page.
//! Frame and unit: mm, rad, px.

use super::super::laser_plane::LaserPlaneRun;
use super::super::pointer::PointerRun;
use super::gather::{Gathered, gather};
use super::measure::{Finders, Measured, Separate, measure};
use super::page::page;
use crate::calibrate::camera::intrinsics::{Boards, Observation, SolveOptions, solve as solve_camera};
use crate::calibrate::hand_eye::closed::Near;
use crate::calibrate::hand_eye::options::Mount;
use crate::calibrate::joint::limits::systematic;
use crate::calibrate::joint::options::{CameraPrior, JointOptions, Noise};
use crate::calibrate::joint::records::{Beside, covariances, judge, separately, together};
use crate::calibrate::joint::shots::{Part, Shot};
use crate::calibrate::joint::solve::{JointFit, solve};
use crate::calibrate::joint::start::start;
use crate::calibrate::joint::unknowns::State;
use crate::calibrate::joint::volume::{apart, expected, places, weights};
use crate::calibrate::laser_plane::options::LaserPlaneOptions;
use crate::calibrate::limits::Asked;
use crate::calibrate::measured_pose::intrinsic_covariance;
use crate::calibrate::pointer::solve::PointerOptions;
use crate::calibrate::pointer::spot::SpotOptions;
use crate::calibrate::report::Page;
use crate::camera::{CameraCovariance, Intrinsics, PARAMETERS};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Camera, Plane, Ray, Rigid, Vec3};
use crate::recording::Recording;
use crate::rig::{Calibration, HandEye, Joint, JointCovariance, Kind, Quality, Rig, Verdict, Volume, sealed};
use crate::scan::{Extraction, Where};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// Options of [`calibrate_joint`].
#[derive(Clone, Debug)]
pub struct JointRun {
    /// Pose file of recordings that have several, without extension.
    pub poses: Option<String>,
    /// Whether the camera is on the flange or stands still.
    pub mount: Mount,
    /// Options of the camera solve from which the joint solve starts.
    pub camera: SolveOptions,
    /// How the stripe is found.
    pub line: LaserPlaneRun,
    /// How the spot is found.
    pub pointer: PointerRun,
    /// Depths and tolerance by which the result is judged.
    pub asked: Asked,
}

impl JointRun {
    /// Options in which every part has its own default settings.
    pub fn new(mount: Mount, asked: Asked, extraction: &Extraction, place: Where) -> JointRun {
        let (solver, extraction) = (LaserPlaneOptions::default(), extraction.clone());
        JointRun {
            poses: None,
            mount,
            camera: SolveOptions::default(),
            line: LaserPlaneRun { solver, asked: asked.clone(), extraction, place },
            pointer: PointerRun {
                spots: SpotOptions::default(),
                solver: PointerOptions::default(),
                asked: asked.clone(),
            },
            asked,
        }
    }

    pub(in crate::station) fn finders<'a>(
        &'a self,
        recordings: &'a [Recording],
        first: &'a FirstCamera,
    ) -> Finders<'a> {
        let (camera, covariance) = (&first.value, &first.covariance);
        Finders { recordings, camera, covariance, line: &self.line, pointer: &self.pointer, mount: self.mount }
    }
}

/// Result of [`calibrate_joint`].
pub struct JointResult {
    /// The records that the recordings determine; the others are `None`.
    pub rig: Rig,
    /// Covariance of all records together.
    pub together: JointCovariance,
    /// The verdict, the same in every record.
    pub quality: Quality,
    /// The report for a person.
    pub page: Page,
    /// The solve itself.
    pub fit: JointFit,
    /// The separate calibrations from the same pictures, one after another.
    pub separate: State,
}

impl JointResult {
    /// Expected error of a scanned point in the working volume, mm rms.
    pub fn expected_mm(&self) -> f64 {
        self.quality.figures.get("expected_error_mm").copied().unwrap_or(f64::INFINITY)
    }

    /// Adds later findings to the verdict, in every record.
    pub(in crate::station) fn remark(&mut self, at_best: Verdict, reasons: &[String]) {
        self.quality.verdict = self.quality.verdict.max(at_best);
        self.quality.reasons.extend_from_slice(reasons);
        let q = &self.quality;
        self.rig.camera.iter_mut().for_each(|c| c.quality = q.clone());
        self.rig.laser_plane.iter_mut().for_each(|c| c.quality = q.clone());
        self.rig.pointer.iter_mut().for_each(|c| c.quality = q.clone());
        self.rig.hand_eye.iter_mut().for_each(|c| c.quality = q.clone());
        self.rig.base_camera.iter_mut().for_each(|c| c.quality = q.clone());
    }
}

/// The camera from which the solve starts, its free parameters, and its prior from other data.
#[derive(Clone)]
pub(in crate::station) struct FirstCamera {
    pub value: Intrinsics,
    pub covariance: CameraCovariance,
    pub free: Vec<usize>,
    pub prior: Option<CameraPrior>,
}

/// A camera from the pictures themselves; if the station's camera was calibrated from other pictures, that camera
/// is used, with its covariance as prior.
pub(in crate::station) fn first_camera(
    gathered: &Gathered,
    size: [u32; 2],
    rig: &Rig,
    run: &JointRun,
) -> Result<FirstCamera> {
    let ours: BTreeSet<&String> = gathered.inputs.values().collect();
    let other = |c: &&Calibration<Intrinsics>| {
        let pictures = || c.inputs.iter().filter(|(name, _)| !name.ends_with("meta.json"));
        (c.value.width, c.value.height) == (size[0], size[1]) && !pictures().any(|(_, hash)| ours.contains(hash))
    };
    if let Some(c) = rig.camera.as_ref().filter(other) {
        let covariance = intrinsic_covariance(&c.covariance)?;
        let free = covariance.named();
        if free.iter().all(|&i| covariance[(i, i)] > 0.0) {
            let prior = Some(CameraPrior { mean: c.value.parameters(), covariance });
            return Ok(FirstCamera { value: c.value, covariance, free, prior });
        }
    }
    let observe = |s: &super::gather::Stop| Observation {
        name: s.name.clone(),
        features: Arc::new(s.board.features()),
        view: s.view.clone(),
    };
    let seen: Vec<Observation> = gathered.stops.iter().map(observe).collect();
    // The joint solve assumes boards as drawn.
    let drawn = SolveOptions { boards: Boards::Drawn, ..run.camera.clone() };
    let found = solve_camera(&seen, size[0], size[1], &drawn)?;
    let covariance = found.covariance.ok_or_else(|| {
        Fault::refused("the camera is not determined by these pictures")
            .cause("too few boards, or all of them alike in distance and tilt")
            .next("add a recording of boards that are tilted by 20 to 40 degrees and reach into the picture's corners")
    })?;
    let free = (0..PARAMETERS).filter(|i| !found.held.contains(i)).collect();
    Ok(FirstCamera { value: found.intrinsics, covariance: CameraCovariance::new(covariance)?, free, prior: None })
}

/// Solves for everything that the recordings show; their order and number do not matter. `progress` receives
/// (pictures done, pictures in all).
///
/// # Errors
/// Recordings of two cameras; no board in any picture; poses that do not belong to the pictures; something that is
/// not determined.
pub fn calibrate_joint(
    recordings: &[Recording],
    rig: &Rig,
    run: &JointRun,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<JointResult> {
    run.asked.check()?;
    let gathered = gather(recordings, run.poses.as_deref(), progress)?;
    let size = [recordings[0].meta.image.width, recordings[0].meta.image.height];
    let first = first_camera(&gathered, size, rig, run)?;
    let measured = measure(&gathered, &run.finders(recordings, &first))?;
    concluded(&gathered, &first, measured, run)
}

fn concluded(gathered: &Gathered, first: &FirstCamera, measured: Measured, run: &JointRun) -> Result<JointResult> {
    let o = JointOptions {
        mount: run.mount,
        camera_free: first.free.clone(),
        camera_prior: first.prior.clone(),
        ..JointOptions::default()
    };
    let Measured { mut shots, left_out, separate } = measured;
    let boards = Volume::spanned(shots.iter().filter_map(|s| depth(&first.value, s)), "where the boards stood");
    let lit = separate
        .sheet
        .as_ref()
        .map_or_else(|| boards.as_ref().map_or([0.0, 0.0], |b| [b.near_mm, b.far_mm]), |s| s.reach);
    let seen = separate
        .sheet
        .as_ref()
        .map(|s| Volume::new(s.reach[0], s.reach[1], "where the boards were lit"))
        .or(boards)
        .unwrap_or_else(|| Volume::new(1.0, 1.0, "nowhere"));
    let limits = run.asked.limits(&seen, |z| first.value.view_mm(z));
    // Without a stripe, points are judged on a plane perpendicular to the optical axis.
    let middle = Plane::new(Vec3::z(), limits.middle()).expect("of length one");
    let separately_found = separate_state(&separate, &first.value, middle);
    let (state, more) = start(&mut shots, gathered.places, &first.value, Some(&separately_found), &o)?;
    let fit = solve(&shots, &state, Noise::usual(), &o)?;
    let at = places(&fit.state, [limits.working.near_mm, limits.working.far_mm]);
    let weights = weights(&fit.state, &fit.layout, &at);
    let beside = Beside {
        separate: separated(&fit, &separate, &separately_found, first, &weights, &at),
        systematic: systematic(&fit, &o),
        lit,
        missing: gathered
            .missing
            .iter()
            .cloned()
            .chain(left_out.iter().chain(&more).map(|l| (format!("{}: {}", l.name, l.part.words()), l.why.clone())))
            .collect(),
    };
    let quality = judge(&fit, &weights, &beside, &limits);
    let hand_eye = match run.mount {
        Mount::EyeInHand => Kind::HandEye,
        Mount::EyeToHand => Kind::BaseCamera,
    };
    let rig = records(&fit, hand_eye, &quality, gathered);
    let together = together(&fit, hand_eye, contents(&rig));
    let page = page(&fit, &quality, &weights);
    Ok(JointResult { rig, together, quality, page, fit, separate: separately_found })
}

/// Depth of the middle of a board's features, mm.
fn depth(camera: &Intrinsics, shot: &Shot) -> Option<f64> {
    Some(crate::calibrate::joint::start::board(camera, &shot.seen).ok()?.centre().z)
}

fn separate_state(separate: &Separate, camera: &Intrinsics, middle: Plane<Camera>) -> State {
    State {
        camera: *camera,
        near_from_camera: separate
            .hand_eye
            .as_ref()
            .map_or_else(Rigid::<Near, Camera>::identity, |f| f.chain.near_from_camera),
        far_from_board: Vec::new(),
        plane: separate.sheet.as_ref().map_or(middle, |f| f.plane),
        beam: separate
            .beam
            .as_ref()
            .map_or_else(|| Ray::new(Vec3::zeros(), Vec3::z()).expect("of length one"), |f| f.beam),
        boards: Vec::new(),
    }
}

/// Expected error of the separate calibrations, and the distance of their points from the joint ones.
fn separated(
    fit: &JointFit,
    separate: &Separate,
    state: &State,
    first: &FirstCamera,
    weights: &nalgebra::DMatrix<f64>,
    at: &[crate::geometry::Vec2],
) -> Option<[f64; 2]> {
    if fit.has(Part::RobotPlace) != separate.hand_eye.is_some() || fit.has(Part::Stripe) != separate.sheet.is_some() {
        return None;
    }
    let covariance = separately(
        &fit.layout,
        &first.covariance,
        separate.hand_eye.as_ref().map(|f| &f.covariance),
        separate.sheet.as_ref().map(|f| (&f.plane, &f.covariance)),
    );
    Some([expected(weights, &covariance), apart(&fit.state, state, at)])
}

fn records(fit: &JointFit, hand_eye: Kind, quality: &Quality, gathered: &Gathered) -> Rig {
    let mut covariances = covariances(fit, hand_eye);
    let mut take = |kind| covariances.remove(&kind).unwrap_or_default();
    let mut camera = Calibration::new(Kind::Camera, fit.state.camera, None, take(Kind::Camera), quality.clone());
    camera.inputs = gathered.inputs.clone();
    camera.readout = gathered.readout;
    camera.hot_pixels = gathered.hot.places().to_vec();
    let x = fit.state.near_from_camera;
    let mut rig = Rig::default();
    if fit.has(Part::Stripe) {
        let c = take(Kind::LaserPlane);
        let mut record = Calibration::new(Kind::LaserPlane, fit.state.plane, Some(&camera), c, quality.clone());
        record.inputs = gathered.inputs.clone();
        rig.laser_plane = Some(record);
    }
    if fit.has(Part::Spot) {
        let c = take(Kind::Pointer);
        let mut record = Calibration::new(Kind::Pointer, fit.state.beam, Some(&camera), c, quality.clone());
        record.inputs = gathered.inputs.clone();
        rig.pointer = Some(record);
    }
    if fit.has(Part::RobotPlace) {
        let c = take(hand_eye);
        if hand_eye == Kind::HandEye {
            let value = HandEye::new(x.rotation, x.translation);
            let mut record = Calibration::new(hand_eye, value, Some(&camera), c, quality.clone());
            record.inputs = gathered.inputs.clone();
            rig.hand_eye = Some(record);
        } else {
            let value = Rigid::<Base, Camera>::new(x.rotation, x.translation);
            let mut record = Calibration::new(hand_eye, value, Some(&camera), c, quality.clone());
            record.inputs = gathered.inputs.clone();
            rig.base_camera = Some(record);
        }
    }
    rig.camera = Some(camera);
    rig
}

/// A hash of the content of each record.
fn contents(rig: &Rig) -> BTreeMap<Kind, String> {
    let mut of = BTreeMap::new();
    of.extend(rig.camera.as_ref().map(|c| (c.kind, c.content())));
    of.extend(rig.laser_plane.as_ref().map(|c| (c.kind, c.content())));
    of.extend(rig.pointer.as_ref().map(|c| (c.kind, c.content())));
    of.extend(rig.hand_eye.as_ref().map(|c| (c.kind, c.content())));
    of.extend(rig.base_camera.as_ref().map(|c| (c.kind, c.content())));
    of
}

/// Stores all records, their joint covariance (`joint.json`, valid only for these records) and the page
/// (`joint.html`, with feature `pages`), all of them or none.
pub fn store_joint(station: &Path, result: &JointResult) -> Result<Vec<Kind>> {
    #[cfg(feature = "pages")]
    let page = Some(result.page.html());
    #[cfg(not(feature = "pages"))]
    let page = None;
    store_set(station, &result.rig, &result.together, page)
}

/// Stores in a station what [`store_joint`] has written into another folder, all of it or nothing.
///
/// # Errors
/// The folder holds no joint calibration, or one that is badly determined; the disk.
pub fn accept_joint(kept: &Path, station: &Path) -> Result<Vec<Kind>> {
    let strange = |what: &str| Fault::input(format!("{}: {what}", kept.display())).next("calibrate again");
    let rig = Rig::load(kept)?;
    let quality = &rig.camera.as_ref().ok_or_else(|| strange("holds no calibration"))?.quality;
    if quality.verdict >= Verdict::BadlyDetermined {
        return Err(Fault::refused(format!("the calibration is {}", quality.verdict.words()))
            .cause(quality.reasons.join("; "))
            .next(quality.advice.first().map_or("take more pictures", String::as_str)));
    }
    let together = match &rig.joint {
        Joint::Stated(together) => together,
        Joint::Spoilt(why) => return Err(strange(why)),
        Joint::Absent => return Err(strange("holds no joint.json")),
    };
    // A program without feature `pages` wrote none.
    let page = kept.join("calibration").join(PAGE);
    let page = page.is_file().then(|| crate::files::read_text(&page)).transpose()?;
    store_set(station, &rig, together, page)
}

/// File names of the covariance of all records, and of the page, beside the records.
const COVARIANCE: &str = "joint.json";
const PAGE: &str = "joint.html";

fn store_set(station: &Path, rig: &Rig, together: &JointCovariance, page: Option<String>) -> Result<Vec<Kind>> {
    rig.store_all_with(station, |stored| {
        let together = JointCovariance { of: contents(stored), ..together.clone() };
        let page = page.map(|text| (PAGE, text));
        std::iter::once((COVARIANCE, sealed(&together))).chain(page).collect()
    })
}
