//! In: profiles of a line-profile sensor, the robot's poses or an axis' counts, a station, the sensor's stated scatter.
//! Out: a scan folder as of pictures: cloud, height map, shots, report. Nothing is extracted.
//! Frame and unit: profiles in the sensor's x-z plane, cloud in the base frame or in the axis'; mm.

use super::calibrate::profile_sensor::listed_poses;
use super::scan::products;
use super::scan::refined::{Refined, refine};
use super::scan::report::{FORMAT, Profiled, ScanReport, Spent};
use super::scan::scan_folder;
use super::scan::seen::Seen;
use crate::calibrate::profile_sensor::missing::{Heights, marked};
use crate::fault::{Fault, Result};
use crate::files::Lock;
use crate::geometry::{Base, Camera, CountUnit, Flange, Mat3, Rigid, Sensor, Vec3};
use crate::recording::profiles::{Profile, files_of, load, measured};
use crate::recording::{Carries, Motion, MotionKind, load_counts};
use crate::rig::{Rig, hash_file};
use crate::scan::{
    Along, CloudPoint, CloudWriter, Extraction, Format, GridOptions, SHOTS_FILE, Shots, ShotsWriter, parts_for_profiles,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What the user of the sensor states, and how its profiles become a scan.
#[derive(Clone, Debug)]
pub struct ProfileScan {
    /// Standard deviation of a point along z of the sensor, mm.
    pub sigma_mm: f64,
    /// The same along x; `None` if it is not stated.
    pub sigma_x_mm: Option<f64>,
    /// What is stated about z.
    pub heights: Heights,
    /// The station's settings; only `straighten` has an effect.
    pub extraction: Extraction,
    /// How the cloud becomes a height map.
    pub grid: GridOptions,
    /// Folder for the results.
    pub out: PathBuf,
}

/// What moved between the profiles.
#[derive(Clone, Copy, Debug)]
pub enum Moved<'a> {
    /// A robot with the sensor on its flange: a file of its poses.
    Robot(&'a Path),
    /// A linear axis with the parts, before a sensor that stands still.
    Axis {
        /// File of its counts, one for each profile.
        counts: &'a Path,
        /// Way of the parts during one count, sensor frame, mm.
        travel_mm: [f64; 3],
    },
}

/// Largest coordinate in a profile, mm: no sensor reaches so far, and counts that were not scaled do.
const FARTHEST_MM: f64 = 1e4;
/// Largest standard deviation, mm; more is another unit.
const MOST_SIGMA_MM: f64 = 10.0;
/// Shortest and longest way of a count, mm.
const TRAVEL_MM: std::ops::RangeInclusive<f64> = 1e-6..=1e3;
/// Longest way of an axis, mm: beyond it single precision spoils the points.
const WAY_MM: f64 = 3e4;
/// Most places of a profile, as `find` accepts them.
const MOST_PLACES: f64 = 65_535.0;

/// Makes a scan of profiles. Profile i belongs to pose or count i.
///
/// # Errors
/// No calibration of the sensor on a robot, another number of poses than of profiles, poses of another frame, nothing
/// measured, numbers that are no mm.
pub fn scan_profiles(profiles: &Path, moved: &Moved, rig: &Rig, options: &ProfileScan) -> Result<ScanReport> {
    let begun = Instant::now();
    check(options)?;
    options.grid.check()?;
    let rig = &match moved {
        Moved::Robot(_) => parts_for_profiles(rig),
        Moved::Axis { .. } => Rig::default(),
    };
    let read = marked(load(profiles)?, options.heights, "such points are in the cloud");
    let lines = read.profiles;
    let Way { places, motion, mut remarks } = way(moved, rig, lines.len())?;
    together(lines.len(), places.len(), profiles)?;
    let columns = Columns::of(&lines).map_err(|e| e.at(profiles.display()))?;
    remarks.extend(read.warnings.into_iter().chain(columns.remark()).chain(rig.remarks()));
    if options.sigma_x_mm.is_none() {
        remarks.push("the scatter along x of the sensor was not stated: it counts as 0".into());
    }
    let up = -places[places.len() / 2].direction(&Vec3::z());
    scan_folder::make(&options.out)?;
    let _lock = Lock::take(&options.out, "scan", "scan")?;
    let folder = scan_folder::together(&options.out);
    folder.settle_locked()?;
    let part = folder.begin()?;
    let print = rig.fingerprint();
    let frame = motion.frame();
    let cloud_path = part.join(scan_folder::CLOUD_FILE);
    let mut cloud = CloudWriter::create_in(&cloud_path, frame)?;
    let mut shots = ShotsWriter::create(&part, frame, Along::U, &print, None)?;
    let sigma = options.sigma_mm.max(options.sigma_x_mm.unwrap_or(0.0));
    let (mut dark_shots, mut found, mut gaps) = (Vec::new(), 0u64, 0u64);
    for (shot, (line, from_sensor)) in (0u32..).zip(lines.iter().zip(&places)) {
        let points = points(line, shot, from_sensor, &columns, sigma);
        (found, gaps) = (found + points.len() as u64, gaps + (line.points.len() - points.len()) as u64);
        if points.is_empty() {
            dark_shots.push(shot);
        }
        cloud.append(&points)?;
        shots.add(shot, *from_sensor);
    }
    shots.checkpoint()?;
    let points = cloud.finish()?;
    let format = Format { width: lines.iter().map(|l| l.points.len()).max().unwrap_or(0) as u32, height: 1, bits: 16 };
    // Nothing is known of the light between the sensor's profiles.
    let extraction = Extraction { thick_sheet: false, ..options.extraction.clone() };
    let written = Shots::load(&part, frame, &print)?;
    let Refined { places, median_sigma_mm, .. } = refine(&part, frame, written, format, &extraction)?;
    let (height_map, mut files) = products::write(&part, &cloud_path, points, &options.grid, up, None)?;
    files.extend([products::hash(&part, SHOTS_FILE)?]);
    let seconds = begun.elapsed().as_secs_f64();
    let report = ScanReport {
        format: FORMAT,
        program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
        created: jiff::Timestamp::now().to_string(),
        units: "mm".into(),
        frame: frame.into(),
        motion,
        recording: name_of(profiles),
        rig_fingerprint: print,
        working_volume: None,
        ran_on: "this machine's processor: profiles need no extraction".into(),
        image: format,
        shots: lines.len(),
        points,
        median_sigma_mm: median_sigma_mm.or(Some(sigma)),
        stripe: None,
        places,
        sheet: None,
        hot_pixels: 0,
        seen: Seen::default(),
        peaks: BTreeMap::from([("measured".into(), found), ("not measured".into(), gaps)]),
        dark_shots,
        exposures: None,
        camera: None,
        delay: None,
        skipped: vec![],
        seconds,
        shots_per_second: lines.len() as f64 / seconds.max(1e-9),
        spent: Spent::default(),
        settings: extraction,
        height_map,
        remarks,
        files,
        imported: None,
        profiles: Some(Profiled {
            moved: name_of(moved.file()),
            travel_mm: moved.travel(),
            inputs: inputs(profiles, moved.file())?,
            sigma_mm: options.sigma_mm,
            sigma_x_mm: options.sigma_x_mm,
            missing: options.heights.missing,
            z_up: options.heights.up,
            step_mm: columns.step,
        }),
        filtered: None,
    };
    let text = serde_json::to_string_pretty(&report).expect("plain data");
    crate::files::write(&part.join("scan.json"), text.as_bytes())?;
    #[cfg(feature = "pages")]
    super::judge::page::save(&part, None, &[])?;
    folder.commit()?;
    Ok(report)
}

fn check(options: &ProfileScan) -> Result<()> {
    let stated = [("--sigma-mm", Some(options.sigma_mm)), ("--sigma-x-mm", options.sigma_x_mm)];
    let wrong = stated.into_iter().filter_map(|(name, v)| Some((name, v?)));
    match wrong.into_iter().find(|(_, v)| !(*v > 0.0 && *v <= MOST_SIGMA_MM)) {
        Some((name, v)) => Err(Fault::usage(format!("{name} is {v}; allowed: above 0 to {MOST_SIGMA_MM} mm"))
            .cause("it is one standard deviation of a point in mm, from the sensor's data sheet or measured")
            .next("correct it")),
        None => Ok(()),
    }
}

impl Moved<'_> {
    fn file(&self) -> &Path {
        match self {
            Moved::Robot(poses) => poses,
            Moved::Axis { counts, .. } => counts,
        }
    }

    fn travel(&self) -> Option<[f64; 3]> {
        if let Moved::Axis { travel_mm, .. } = self { Some(*travel_mm) } else { None }
    }
}

/// Poses of the sensor in the cloud's frame, a profile each.
struct Way {
    places: Vec<Rigid<Base, Camera>>,
    motion: Motion,
    remarks: Vec<String>,
}

fn way(moved: &Moved, rig: &Rig, profiles: usize) -> Result<Way> {
    match moved {
        Moved::Robot(poses) => {
            let flange_from_sensor = rig.need_profile_hand_eye()?.value;
            let (poses, remarks) = in_the_base(poses)?;
            let places = poses.iter().map(|pose| place(pose, &flange_from_sensor)).collect();
            Ok(Way { places, motion: Motion::default(), remarks })
        }
        Moved::Axis { counts, travel_mm } => {
            let travel = Vec3::from(*travel_mm);
            let sensor_from_axis = axis_frame(&travel)?;
            let (all, file) = (load_counts(counts, profiles)?, counts.display());
            if let Some(k) = all.iter().position(Option::is_none) {
                return Err(Fault::input(format!("{file}: profile {k} has no count"))
                    .cause("the file has fewer rows than there are profiles")
                    .next("give one count a profile, in the same order"));
            }
            let counts: Vec<f64> = all.into_iter().flatten().collect();
            let zero = counts.first().copied().unwrap_or(0.0);
            let farthest = counts.iter().map(|c| travel.norm() * (c - zero).abs()).fold(0.0, f64::max);
            if farthest > WAY_MM {
                return Err(Fault::input(format!(
                    "{file}: the parts move by {farthest:.0} mm, at most {WAY_MM} is accepted"
                ))
                .cause("a wrong way of a count, or counts of several parts")
                .next("correct --travel-mm, or scan each part by itself"));
            }
            let axis_from_sensor = sensor_from_axis.transpose();
            let at = |count: &f64| Rigid::new(axis_from_sensor, axis_from_sensor * travel * (zero - count));
            let unit = Some(CountUnit::Count);
            let motion = Motion {
                kind: MotionKind::Linear,
                carries: Carries::Part,
                unit,
                zero: Some(zero),
                ..Motion::default()
            };
            let remark = "the way of a count was stated without an uncertainty: it is in no sigma".to_owned();
            Ok(Way { places: counts.iter().map(at).collect(), motion, remarks: vec![remark] })
        }
    }
}

/// Axes of the axis frame in the sensor's: x along the parts' way, z towards the sensor.
fn axis_frame(travel: &Vec3) -> Result<Mat3> {
    let length = travel.norm();
    if !TRAVEL_MM.contains(&length) {
        return Err(Fault::usage(format!(
            "--travel-mm is {length} mm long; allowed: {} to {}",
            TRAVEL_MM.start(),
            TRAVEL_MM.end()
        ))
        .next("give the way of the parts during one count, in mm along x, y and z of the sensor"));
    }
    let x = travel / length;
    let z = -Vec3::z() - x * x.dot(&-Vec3::z());
    if x.z.abs() > std::f64::consts::FRAC_1_SQRT_2 {
        return Err(Fault::usage(format!("--travel-mm leads along z of the sensor ({} of its length)", x.z.abs()))
            .cause("parts that move towards the sensor are not scanned by its line")
            .next("give the way along x, y and z of the sensor; mostly it is y alone"));
    }
    let z = z.normalize();
    Ok(Mat3::from_columns(&[x, z.cross(&x), z]))
}

/// The poses, which must be of the flange in the base; remarks in words.
fn in_the_base(path: &Path) -> Result<(Vec<Rigid<Base, Flange>>, Vec<String>)> {
    let (poses, user_frame, remarks) = listed_poses(path)?;
    if user_frame != 0 {
        return Err(Fault::input(format!(
            "{}: its poses are in user frame {user_frame}, the base is wanted",
            path.display()
        ))
        .cause("the listing was taught in a user frame; where that lies in the base is not in the file")
        .next("teach or convert the positions in UF 0"));
    }
    Ok((poses, remarks))
}

fn together(profiles: usize, poses: usize, path: &Path) -> Result<()> {
    if profiles == poses && profiles > 0 {
        return Ok(());
    }
    Err(Fault::input(format!("{}: {profiles} profiles and {poses} poses", path.display()))
        .cause("a profile or a pose is missing, or the file of poses is of another scan")
        .next("give one pose a profile, in the same order"))
}

/// Pose of the sensor in the cloud's frame. Its frame takes the place of a camera's: z away from it, x along the line.
fn place(base_from_flange: &Rigid<Base, Flange>, flange_from_sensor: &Rigid<Flange, Sensor>) -> Rigid<Base, Camera> {
    let at = *base_from_flange * *flange_from_sensor;
    Rigid::new(at.rotation, at.translation)
}

fn points(line: &Profile, shot: u32, at: &Rigid<Base, Camera>, columns: &Columns, sigma: f64) -> Vec<CloudPoint> {
    let point = |(i, p): (usize, &[f64; 2])| {
        let point = CloudPoint {
            sigma_mm: sigma as f32,
            intensity: 1.0,
            quality: 1.0,
            shot,
            u: columns.u(i, p[0]) as f32,
            v: 0.0,
            ..CloudPoint::default()
        };
        point.moved_to(at.point(&Vec3::new(p[0], 0.0, p[1])))
    };
    line.points.iter().enumerate().filter(|(_, p)| measured(p)).map(point).collect()
}

/// What `u` counts.
struct Columns {
    /// mm of x to one step, if places that were not measured are missing in the profiles.
    step: Option<f64>,
    /// Smallest x, mm.
    low: f64,
}

impl Columns {
    fn of(lines: &[Profile]) -> Result<Columns> {
        let all = || lines.iter().flat_map(|l| &l.points).filter(|p| measured(p));
        let Some(first) = all().next() else {
            return Err(Fault::refused(format!("nothing was measured in {} profiles", lines.len()))
                .cause("the surface was out of the sensor's range, or every z is the missing one")
                .next("look at the profiles, and at --missing"));
        };
        if let Some(p) = all().find(|p| p.iter().any(|v| v.abs() > FARTHEST_MM)) {
            return Err(Fault::input(format!(
                "a place is x {}, z {}; at most {FARTHEST_MM} mm is accepted",
                p[0], p[1]
            ))
            .cause("counts of the sensor that were not scaled to mm, or a number that means 'not measured'")
            .next("export the profiles in mm; state the number for places that were not measured with --missing"));
        }
        let (low, high) = all().fold((first[0], first[0]), |(l, h), p| (l.min(p[0]), h.max(p[0])));
        if lines.iter().all(|l| l.points.len() == lines[0].points.len()) {
            return Ok(Columns { step: None, low });
        }
        let mut steps: Vec<f64> =
            lines.iter().flat_map(|l| l.points.windows(2)).map(|w| (w[1][0] - w[0][0]).abs()).collect();
        steps.retain(|s| s.is_finite() && *s > 0.0);
        let middle = steps.len() / 2;
        let step = (!steps.is_empty()).then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1);
        match step.filter(|s| (high - low) / s < MOST_PLACES) {
            Some(step) => Ok(Columns { step: Some(step), low }),
            None => Err(Fault::input(format!(
                "the profiles have different numbers of places, and x has no step between them: {low} to {high} mm"
            ))
            .cause("x is the same in a whole profile, or a stray place lies far away")
            .next("export the profiles with every place, nan where nothing was measured")),
        }
    }

    fn u(&self, index: usize, x: f64) -> f64 {
        self.step.map_or(index as f64, |step| (x - self.low) / step)
    }

    fn remark(&self) -> Option<String> {
        let step = self.step?;
        Some(format!(
            "the profiles have different numbers of places: u counts steps of {step:.4} mm along x from the smallest"
        ))
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

fn inputs(profiles: &Path, moved: &Path) -> Result<BTreeMap<String, String>> {
    let files = files_of(profiles)?.into_iter().chain([moved.to_owned()]);
    files.map(|path| Ok((name_of(&path), hash_file(&path)?))).collect()
}
