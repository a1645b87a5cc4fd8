//! In: pictures of the pointer's spot on any surface, a station with camera and pointer, optionally robot poses and
//! a hand-eye calibration. Out: distances and points with sigmas, and the surface's normal.
//! Frame and unit: camera and base frame; mm, rad.

use super::calibrate::hand_eye::first_line;
use crate::calibrate::hand_eye::report::HAND_EYE_NAMES;
use crate::calibrate::pointer::range::{
    BasePoint, RIG, Ranged, RobotNoise, SharedCovariance, Surface, joint_covariance, range, surface, to_base,
};
use crate::calibrate::pointer::spot::{Spot, SpotOptions, SpotPicture, find_spots, hot_pixels};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Mat3, Rigid, Tool, Vec3};
use crate::raster::{Image, Light};
use crate::recording::{Beam, Recording};
use crate::rig::{Calibration, HandEye, Rig};

/// Distance between spot and beam image that is always accepted, px: the beam's calibration has an error too.
const FORGIVEN_PX: f64 = 1.0;
/// A spot that an edge cuts lies beside its beam by less than this many sigmas of its profile. With nine tenths of
/// a normal profile cut off, the mean of the rest lies at 1.75.
const CUT: f64 = 2.0;

/// Options of [`measure_range`].
#[derive(Clone, Debug)]
pub struct RangeRun {
    /// How the spot is found in the pictures.
    pub spots: SpotOptions,
    /// Pose file of the recording; `None`: the one that meta.json names, if any.
    pub poses: Option<String>,
    /// Largest accepted distance of a spot from the beam's image, sigmas; 3..=100.
    pub max_off_beam: f64,
    /// Only an approximate distance is needed: a spot that an edge cuts is accepted too.
    pub coarse: bool,
    /// All shots show one plane surface: compute its normal.
    pub one_surface: bool,
    /// Pose of the tool on the flange: its tilt against the surface and its square pose are computed.
    pub tool: Option<Rigid<Flange, Tool>>,
}

impl Default for RangeRun {
    fn default() -> Self {
        RangeRun {
            spots: SpotOptions::default(),
            poses: None,
            max_off_beam: 12.0,
            coarse: false,
            one_surface: false,
            tool: None,
        }
    }
}

/// One measured distance.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Distance {
    /// Name of the laser picture.
    pub picture: String,
    /// Distance from the beam's origin along the beam, mm.
    pub along_beam_mm: f64,
    /// One standard deviation of the distance along the beam, mm.
    pub along_beam_sigma_mm: f64,
    /// Distance from the camera along the optical axis, mm.
    pub along_axis_mm: f64,
    /// One standard deviation of the distance along the axis, mm.
    pub along_axis_sigma_mm: f64,
    /// The point where the beam meets the surface, camera frame, mm.
    pub point_camera_mm: [f64; 3],
    /// One standard deviation along the camera's x, y, z, mm.
    pub point_camera_sigma_mm: [f64; 3],
    /// The same point in the base frame, mm; `None` without robot poses or hand-eye calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_base_mm: Option<[f64; 3]>,
    /// One standard deviation along the base's x, y, z, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_base_sigma_mm: Option<[f64; 3]>,
    /// Centre of the spot, column and row, px.
    pub spot_px: [f64; 2],
    /// One standard deviation of column and row, px.
    pub spot_sigma_px: [f64; 2],
    /// Distance of the spot from the beam's image, px.
    pub off_beam_px: f64,
}

/// The surface through three or more points, base frame.
#[derive(Clone, Debug, serde::Serialize)]
pub struct SurfaceFound {
    /// Of unit length, towards the camera; base frame.
    pub normal: [f64; 3],
    /// Mean of the points, base frame, mm.
    pub centre_mm: [f64; 3],
    /// Sigmas of the normal about the two axes of its uncertainty, degrees.
    pub tilt_sigma_deg: [f64; 2],
    /// One standard deviation of the height at the centre, mm.
    pub height_sigma_mm: f64,
    /// rms distance of the points from the plane, mm; 0 for three points.
    pub rms_mm: f64,
    /// Sum of squared distances from the plane over its expectation from the spots' own noise. Far above 1 the
    /// surface is not flat, and its sigmas include that; 0 for three points.
    pub misfit: f64,
    /// The picture whose spot does not lie on the plane of the others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_out: Option<String>,
    /// z out of the surface, x along the flange's x as seen at the first shot, origin at the centre.
    #[serde(rename = "base_T_tool")]
    pub base_from_tool: Rigid<crate::geometry::Base, Tool>,
}

/// How the tool stood relative to the surface at the last shot, and the pose in which it stands square to it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Square {
    /// Angle of the tool's z against the normal at the last shot, degrees.
    pub tilt_deg: f64,
    /// One standard deviation of that, including the robot's. If the tilt is smaller, only its magnitude is
    /// significant.
    pub tilt_sigma_deg: f64,
    /// The tool turned about its origin by exactly that tilt.
    #[serde(rename = "base_T_tool")]
    pub base_from_tool: Rigid<Base, Tool>,
    /// The flange pose for it.
    #[serde(rename = "base_T_flange")]
    pub base_from_flange: Rigid<Base, Flange>,
}

/// Result of [`measure_range`].
#[derive(Clone, Debug, serde::Serialize)]
pub struct RangeReport {
    /// One per picture whose spot was measured, in the recording's order.
    pub distances: Vec<Distance>,
    /// `None` unless [`RangeRun::one_surface`] asks for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceFound>,
    /// `None` without a surface or without [`RangeRun::tool`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub square: Option<Square>,
    /// Pictures without a distance, with the reason.
    pub missing: Vec<(String, String)>,
    /// Warnings in the calibration files, and what the sigmas do not include.
    pub remarks: Vec<String>,
}

/// What the pointer touched: the report, and, if poses are known, the points in the base frame with their shared
/// covariance.
pub(super) struct Touched {
    pub report: RangeReport,
    /// The points, each with the name of its picture.
    pub points: Vec<(String, BasePoint)>,
    pub shared: SharedCovariance,
    first_x: Option<Vec3>,
    /// Pose of the flange at the last shot, and the sigma of its rotation, rad.
    last: Option<(Rigid<Base, Flange>, f64)>,
}

/// Measures a distance in every frame that has a `laser` picture.
pub fn measure_range(recording: &Recording, rig: &Rig, run: &RangeRun) -> Result<RangeReport> {
    let Touched { report: mut out, points, shared, first_x, last } = touched(recording, rig, run)?;
    if run.one_surface {
        let points: Vec<BasePoint> = points.into_iter().map(|p| p.1).collect();
        let s = surface(&points, &shared, &first_x.unwrap_or(Vec3::x()))?;
        let left_out = s.left_out.map(|i| out.distances[i].picture.clone());
        out.surface = Some(describe(&s, left_out));
        out.square = run.tool.zip(last).map(|(tool, (flange, rad))| square(&s, &tool, &flange, rad));
    }
    Ok(out)
}

pub(super) fn touched(recording: &Recording, rig: &Rig, run: &RangeRun) -> Result<Touched> {
    if !(3.0..=100.0).contains(&run.max_off_beam) {
        return Err(Fault::usage(format!("max_off_beam is {}, 3 to 100 sigmas are allowed", run.max_off_beam))
            .next("correct max_off_beam"));
    }
    let (camera, pointer) = (rig.need_camera()?, rig.need_pointer()?);
    recording.shows(Beam::Pointer)?;
    let image = &recording.meta.image;
    let same = camera.same_pictures(image.size(), image.readout.as_ref());
    same.map_err(|e| e.at(recording.folder.display()))?;
    recording.read_alike(rig.hot_pixels())?;
    let joint = joint_covariance(&pointer.covariance);
    let carried = Carried::of(recording, rig, run)?;
    let mut remarks = rig.remarks();
    let mut shared = SharedCovariance::zeros();
    shared.fixed_view_mut::<RIG, RIG>(0, 0).copy_from(&joint);
    if let Some(c) = &carried {
        shared.fixed_view_mut::<6, 6>(RIG, RIG).copy_from(&c.hand_eye.covariance.of(HAND_EYE_NAMES));
        if c.robot.is_none() {
            remarks.push("nothing is known of the robot's noise: the points' sigmas are without it".into());
        }
    }
    let frames = laser_pictures(recording)?;
    let report = RangeReport { distances: Vec::new(), surface: None, square: None, missing: Vec::new(), remarks };
    let mut out = Touched { report, points: Vec::new(), shared, first_x: None, last: None };
    for (frame, spot) in frames.iter().zip(spots(&frames, &run.spots)?) {
        let name = frame.name;
        let found = spot.and_then(|s| {
            let r = range(&s.pixel, &s.covariance, &camera.value, &pointer.value, &joint)?;
            let forgiven = if run.coarse { FORGIVEN_PX.max(CUT * s.width_px) } else { FORGIVEN_PX };
            on_beam(&r, run.max_off_beam, forgiven).map(|()| (s, r))
        });
        let (spot, ranged) = match found {
            Ok(f) => f,
            Err(fault) => {
                out.report.missing.push((name.to_string(), first_line(&fault.to_string()).to_owned()));
                continue;
            }
        };
        let mut in_base = None;
        if let Some(c) = &carried {
            let pose = recording.pose_of(frame.index, &c.poses).map_err(|e| e.at(name))?;
            in_base = Some(out.in_base(name, &ranged, pose, c));
        }
        out.report.distances.push(row(name, &spot, &ranged, in_base.as_ref()));
    }
    if out.report.distances.is_empty() {
        return Err(nothing_measured(&out.report, &frames));
    }
    Ok(out)
}

impl Touched {
    /// Converts a measured point to the base frame and stores it with the flange pose.
    fn in_base(&mut self, name: &str, ranged: &Ranged, pose: &Rigid<Base, Flange>, c: &Carried<'_>) -> BasePoint {
        let robot = c.robot.unwrap_or_default();
        self.first_x.get_or_insert(Vec3::from(pose.rotation.column(0)));
        self.last = Some((*pose, robot.rad));
        let point = to_base(ranged, pose, &c.hand_eye.value, &self.shared, &robot);
        self.points.push((name.to_string(), point.clone()));
        point
    }
}

/// The robot that carries the sensor: its poses, the pose of the sensor on it, and its noise if that is known.
struct Carried<'a> {
    poses: Vec<Rigid<Base, Flange>>,
    hand_eye: &'a Calibration<HandEye>,
    robot: Option<RobotNoise>,
}

impl<'a> Carried<'a> {
    /// `None` if poses or hand-eye are missing and no surface requires them.
    fn of(recording: &Recording, rig: &'a Rig, run: &RangeRun) -> Result<Option<Carried<'a>>> {
        let has_poses = run.poses.is_some() || recording.meta.pose_file.is_some();
        let poses = if has_poses { Some(recording.poses(run.poses.as_deref())?) } else { None };
        if run.one_surface && poses.is_none() {
            return Err(Fault::usage("a surface's normal needs the robot's poses").next(
                "name the recording's pose file (range: --poses, guide: --touch-poses), or range without --surface",
            ));
        }
        let Some(poses) = poses.filter(|_| run.one_surface || rig.hand_eye.is_some()) else { return Ok(None) };
        let hand_eye = rig.need_hand_eye()?;
        let robot = hand_eye.robot_sigma()?.map(|[mm, deg]| RobotNoise { mm, rad: deg.to_radians() });
        Ok(Some(Carried { poses, hand_eye, robot }))
    }
}

/// A frame's picture with the pointer's laser on.
struct LaserPicture<'a> {
    /// Index of the frame.
    index: usize,
    name: &'a str,
    image: Image,
}

fn laser_pictures(recording: &Recording) -> Result<Vec<LaserPicture<'_>>> {
    let frames = recording.meta.frames.iter().enumerate().filter_map(|(i, f)| Some((i, f.laser.as_deref()?)));
    frames.map(|(index, name)| Ok(LaserPicture { index, name, image: recording.picture(name)? })).collect()
}

/// The spot in each picture; hot pixels are excluded.
fn spots(frames: &[LaserPicture<'_>], options: &SpotOptions) -> Result<Vec<Result<Spot>>> {
    let hot = hot_pixels(&frames.iter().map(|f| &f.image).collect::<Vec<_>>());
    let asked: Vec<SpotPicture<'_>> =
        frames.iter().map(|f| SpotPicture { name: f.name, laser: &f.image, ambient: None }).collect();
    find_spots(&asked, &hot, options)
}

/// The fault of a recording without any distance; it explains what the middle picture shows.
fn nothing_measured(report: &RangeReport, frames: &[LaserPicture<'_>]) -> Fault {
    let (name, why) = report.missing.first().cloned().unwrap_or_default();
    let fault = Fault::refused(format!("no distance could be measured; {name}: {why}"))
        .cause("the pointer was off, or it is not the one that was calibrated")
        .next("look at the pictures");
    match frames.get(frames.len() / 2) {
        Some(f) => Light::of(&f.image).explain(f.name, fault),
        None => fault,
    }
}

/// Turns the tool by the smallest rotation that aligns its z with the normal.
fn square(s: &Surface, flange_from_tool: &Rigid<Flange, Tool>, flange: &Rigid<Base, Flange>, rad: f64) -> Square {
    let tool = *flange * *flange_from_tool;
    let z = tool.direction(&Vec3::z());
    let tilt = z.angle(&s.normal);
    let across = z.cross(&s.normal);
    // A tool that points away from the surface is turned about its own x.
    let axis = if across.norm() > 1e-12 { across.normalize() } else { tool.direction(&Vec3::x()) };
    let turn = Rigid::<Base, Base>::from_vectors(&(axis * tilt), Vec3::zeros());
    let base_from_tool = Rigid::new(turn.rotation * tool.rotation, tool.translation);
    let sigma = s.tilt_sigma[0].max(s.tilt_sigma[1]).hypot(rad);
    Square {
        tilt_deg: tilt.to_degrees(),
        tilt_sigma_deg: sigma.to_degrees(),
        base_from_tool,
        base_from_flange: base_from_tool * flange_from_tool.inverse(),
    }
}

fn on_beam(r: &Ranged, limit: f64, forgiven_px: f64) -> Result<()> {
    if r.off_beam_sigmas > limit && r.off_beam_px > forgiven_px {
        return Err(Fault::refused(format!(
            "the spot is {:.1} px ({:.0} sigmas) beside the beam's image, limit {limit} sigmas",
            r.off_beam_px, r.off_beam_sigmas
        ))
        .cause("a reflection, or the pointer was moved")
        .next("calibrate the pointer again if all pictures say so"));
    }
    Ok(())
}

fn sigmas(c: &Mat3) -> [f64; 3] {
    [0, 1, 2].map(|i| c[(i, i)].max(0.0).sqrt())
}

fn row(name: &str, spot: &Spot, r: &Ranged, base: Option<&BasePoint>) -> Distance {
    Distance {
        picture: name.to_owned(),
        along_beam_mm: r.along_beam,
        along_beam_sigma_mm: r.along_beam_sigma,
        along_axis_mm: r.along_axis,
        along_axis_sigma_mm: r.along_axis_sigma,
        point_camera_mm: r.point.into(),
        point_camera_sigma_mm: sigmas(&r.covariance),
        point_base_mm: base.map(|b| b.point.into()),
        point_base_sigma_mm: base.map(|b| sigmas(&b.covariance)),
        spot_px: spot.pixel.into(),
        spot_sigma_px: [spot.covariance[(0, 0)].sqrt(), spot.covariance[(1, 1)].sqrt()],
        off_beam_px: r.off_beam_px,
    }
}

fn describe(s: &Surface, left_out: Option<String>) -> SurfaceFound {
    SurfaceFound {
        normal: s.normal.into(),
        centre_mm: s.centre.into(),
        tilt_sigma_deg: s.tilt_sigma.map(f64::to_degrees),
        height_sigma_mm: s.height_sigma,
        rms_mm: s.rms,
        misfit: s.misfit,
        left_out,
        base_from_tool: s.base_from_tool,
    }
}
