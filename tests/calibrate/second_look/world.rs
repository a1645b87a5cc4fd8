//! In: designs of stations, a part before them. Out: what a program gets of two looks at it, with known truth, and
//! the station that it believes in. Peaks are the engine's, from rendered pictures. Frame and unit: base frame; mm, px.

use super::pictures::{Peak, peaks};
use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use sheetlight::find::look::looks::other_side;
use sheetlight::find::{LocateOptions, Recipe, Report, agree, locate};
use sheetlight::geometry::{Base, Camera, Flange, Mat3, Part, Plane, Rigid, Vec2, Vec3, exp};
use sheetlight::rig::{Calibration, Covariance, Kind, Quality, Rig, Verdict};
use sheetlight::robot::Convention;
use sheetlight::scan::{Along, CloudPoint, Shots};
use sheetlight::simulate::{InScene, RigSpec, Scene, SceneSpec, Station, base_from_scene, flange, part_pose, scan};
use std::path::PathBuf;

/// Errors of the calibrations, one standard deviation, as good stations of the paper's size have them; lengths of
/// other designs in proportion to their field.
pub const HAND_EYE_MM: f64 = 0.03;
pub const HAND_EYE_RAD: f64 = 1.5e-4;
pub const PLANE_RAD: f64 = 1e-4;
pub const PLANE_MM: f64 = 0.015;
/// Of a pose's reading.
pub const ROBOT_MM: f64 = 0.007;
pub const PEAK_PX: f64 = 0.06;
/// Of a peak's light, as a share: what speckle leaves of it over the pixels that it is fitted to.
pub const LIGHT: f64 = 0.04;
/// Shots of a look.
pub const SHOTS: usize = 130;
/// Designs of the long form; the first is the short form's. Stripes lie, stand and lean.
pub const DESIGNS: [&str; 10] =
    ["paper", "paper", "fine", "shallow", "slant30", "upright", "behind", "webcam", "portrait", "microscope"];

/// What a program gets of one look: peaks by shot, and the robot's poses.
#[derive(Clone)]
pub struct Recorded {
    pub peaks: Vec<Vec<Peak>>,
    pub poses: Vec<Rigid<Base, Flange>>,
}

/// A station that a program believes in.
#[derive(Clone)]
pub struct Believed {
    pub station: Station,
    /// Lengths of the design over those of the paper's rig.
    pub unit: f64,
    pub plane: Plane<Camera>,
    pub hand_eye: Rigid<Flange, Camera>,
}

impl Believed {
    /// Where the camera is believed to have stood.
    fn shots(&self, look: &Recorded) -> Shots {
        let across = across(&self.station).map(|x| x as f32);
        let places = look.poses.iter().map(|pose| *pose * self.hand_eye);
        Shots::new(Along::crossed([across.x, across.y].into()), (0..).zip(places))
    }
}

pub struct World {
    pub station: Station,
    pub unit: f64,
    pub recipe: Recipe,
    pub truth: Rigid<Base, Part>,
    pub looks: [Recorded; 2],
}

/// Direction in the picture in which the stripe moves with depth.
pub fn across(station: &Station) -> Vec2 {
    let (sin, cos) = station.rig.laser.side_deg.to_radians().sin_cos();
    Vec2::new(cos, sin)
}

/// What a rig looks at: the LED socket of the board before the paper's, else the notched plate that fits its field.
pub fn looked_at(rig: &RigSpec, name: &str) -> (SceneSpec, Recipe) {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let (mut spec, recipe, half, part) = if name == "paper" {
        let spec = SceneSpec::load(&root.join("data/scenes/board.toml")).unwrap();
        (spec, Recipe::load(&root.join("data/recipes/led.toml")).unwrap(), [20.0, 13.0], "led")
    } else {
        let u = rig.scale();
        // Steps of a scan of the plate alone, turned and tilted; finer ones than the rig's own do not make the map's
        // cells finer.
        let shots = ((SHOTS as f64 * 32.0 / 30.0) as usize).min(rig.shots());
        (rig.scene(), Recipe::parse(&rig.recipe(shots)).unwrap(), [21.0 * u, 14.5 * u], "notched")
    };
    let part = spec.part.iter().find(|p| p.name == part).unwrap().clone();
    let (x, y) = (part.at_mm[0], part.at_mm[1]);
    spec.region_mm = [x - half[0], y - half[1], x + half[0], y + half[1]];
    (spec, recipe)
}

/// The same camera with larger pixels: what a larger sensor would cost is time.
fn small(mut rig: RigSpec) -> RigSpec {
    const WIDTH: f64 = 800.0;
    let c = &mut rig.camera;
    let by = (WIDTH / f64::from(c.width_px)).min(1.0);
    (c.width_px, c.height_px) = ((f64::from(c.width_px) * by) as u32, (f64::from(c.height_px) * by) as u32);
    c.pixel_um /= by;
    rig.sensor.blur_px *= by;
    rig
}

impl World {
    pub fn new(index: usize) -> World {
        let name = DESIGNS[index];
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("data/rigs/{name}.toml"));
        let rig = small(RigSpec::load(&path).unwrap());
        let station = Station::of(&rig, 100 + index as u64);
        let unit = rig.scale();
        let (spec, mut recipe) = looked_at(&rig, name);
        // What is judged is the measurement: the robot that inserts is exact.
        (recipe.robot.sigma_mm, recipe.robot.sigma_deg) = (0.0, 0.0);
        recipe.gates.second_look = true;
        recipe.gates.max_unseen_height_mm *= unit.max(1.0);
        // A turn of the hand-eye counts by the distance, whatever the field is.
        recipe.gates.max_sigma_mm = recipe.gates.max_sigma_mm.max(4.0 * HAND_EYE_RAD * station.working_distance);
        // Nor can it bear less than five of those: what two looks leave unseen of it comes to nearly five.
        recipe.insertion.tolerance_mm =
            recipe.insertion.tolerance_mm.max(5.0 * HAND_EYE_RAD * station.working_distance);
        let part = spec.part.iter().find(|p| p.name == recipe.name).unwrap();
        let in_scene: Rigid<InScene, Part> = part_pose(part);
        let [x0, _, x1, _] = spec.region_mm;
        let reach = 1.0 * (x1 - x0) / (station.working_distance - station.laser.source.z);
        let scene = Scene::new(spec).unwrap();
        let placed = base_from_scene(&station);
        let truth = placed * in_scene;
        let mut rng = station.rng("second look", 0);
        let path = scan(&station, &scene, SHOTS);
        let other = other_side(&truth, 150.0 + rng.random_range(0.0..60.0), 15.0 + rng.random_range(0.0..10.0));
        let looks = [None, Some(other)].map(|side| {
            let seen: Vec<_> =
                path.iter().map(|here| side.map_or(*here, |s| placed.inverse() * s * placed * *here)).collect();
            let poses = seen.iter().map(|at| flange(&station, &(placed * *at))).collect();
            let peaks = peaks(&station, &scene, &placed, &seen, reach);
            Recorded { peaks, poses }
        });
        World { station, unit, recipe, truth, looks }
    }

    /// What is recorded: peaks and the robot's readings with their noise.
    pub fn recorded(&self, rng: &mut Pcg64) -> [Recorded; 2] {
        self.recorded_by([self.unit * ROBOT_MM, 0.0], rng)
    }

    /// The same by a robot whose readings scatter by so many mm and degrees on each axis.
    pub fn recorded_by(&self, [mm, deg]: [f64; 2], rng: &mut Pcg64) -> [Recorded; 2] {
        let mut looks = self.looks.clone();
        let across = across(&self.station);
        for look in &mut looks {
            for pose in &mut look.poses {
                pose.translation += Vec3::from_fn(|_, _| mm * rng.sample::<f64, _>(StandardNormal));
                if deg > 0.0 {
                    let turn = Vec3::from_fn(|_, _| deg.to_radians() * rng.sample::<f64, _>(StandardNormal));
                    pose.rotation = exp(&turn) * pose.rotation;
                }
            }
            for peak in look.peaks.iter_mut().flatten() {
                peak.px += across * (PEAK_PX * rng.sample::<f64, _>(StandardNormal));
                peak.light *= 1.0 + LIGHT * rng.sample::<f64, _>(StandardNormal);
            }
        }
        looks
    }

    /// The calibrations as a good calibration would give them: off by what their covariance says.
    pub fn believed(&self, rng: &mut Pcg64) -> Believed {
        let mut normal = |sigma: f64| sigma * rng.sample::<f64, _>(StandardNormal);
        let w = Vec3::from_fn(|_, _| normal(HAND_EYE_RAD));
        let t = Vec3::from_fn(|_, _| normal(self.unit * HAND_EYE_MM));
        let x = self.station.flange_from_camera;
        let plane = self.station.laser.plane();
        let tilt = Vec3::from_fn(|_, _| normal(PLANE_RAD));
        let tilted = exp(&(tilt - plane.normal * plane.normal.dot(&tilt))) * plane.normal;
        // The plane turns about where it was seen: the working distance.
        let pivot = Vec3::new(0.0, 0.0, self.station.working_distance);
        let offset = tilted.dot(&(pivot - plane.normal * plane.distance(&pivot))) + normal(self.unit * PLANE_MM);
        Believed {
            station: self.station.clone(),
            unit: self.unit,
            plane: Plane::new(tilted, offset).unwrap(),
            hand_eye: Rigid::new(exp(&w) * x.rotation, x.translation + t),
        }
    }

    /// The calibrations as they are.
    pub fn exact(&self) -> Believed {
        Believed {
            station: self.station.clone(),
            unit: self.unit,
            plane: self.station.laser.plane(),
            hand_eye: self.station.flange_from_camera,
        }
    }

    pub fn cloud(&self, b: &Believed, look: &Recorded) -> Vec<CloudPoint> {
        let mut out = Vec::new();
        for (shot, (peaks, pose)) in look.peaks.iter().zip(&look.poses).enumerate() {
            let camera = *pose * b.hand_eye;
            for p in peaks {
                let Some(point) = b.station.camera.ray_from_pixel(&p.px).and_then(|r| r.meet(&b.plane)) else {
                    continue;
                };
                let q = camera.point(&point);
                out.push(CloudPoint {
                    position: [q.x as f32, q.y as f32, q.z as f32].into(),
                    sigma_mm: (0.02 * self.unit) as f32,
                    intensity: p.light as f32,
                    quality: 1.0,
                    shot: shot as u32,
                    u: p.px.x as f32,
                    v: p.px.y as f32,
                });
            }
        }
        out
    }

    /// Both looks with the station that is believed.
    pub fn look(&self, b: &Believed, looks: &[Recorded; 2]) -> Result<(Vec<Report>, Report), String> {
        self.look_with(&stored(&rig(b)).map_err(|e| e.what)?, b, looks)
    }

    /// The same with a rig whose covariances come from elsewhere.
    pub fn look_with(&self, rig: &Rig, b: &Believed, looks: &[Recorded; 2]) -> Result<(Vec<Report>, Report), String> {
        let mut reports: Vec<Report> = Vec::new();
        for look in looks {
            let options = LocateOptions::default();
            let options = if let Some(first) = reports.first() { options.again(first) } else { options };
            reports.push(
                locate(&self.cloud(b, look), &b.shots(look), &self.recipe, Some(rig), &options).map_err(|e| e.what)?,
            );
        }
        let both = agree(reports.clone(), None, &self.recipe, Convention::Matrix).map_err(|e| e.what)?;
        Ok((reports, both))
    }
}

/// As the program reads it from its folder: what cannot be a calibration is refused there.
fn stored(rig: &Rig) -> sheetlight::fault::Result<Rig> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    rig.store_all(folder.path())?;
    Rig::load(folder.path())
}

pub fn rig(b: &Believed) -> Rig {
    let quality = Quality {
        verdict: Verdict::Good,
        reasons: vec![],
        advice: vec![],
        figures: Default::default(),
        per_picture: vec![],
    };
    let n = b.plane.normal;
    let pivot = Vec3::new(0.0, 0.0, b.station.working_distance);
    // Tangent of the unit normal; the offset follows the turn about the pivot.
    let tangent = Mat3::identity() - n * n.transpose();
    let mut j = DMatrix::zeros(4, 4);
    j.view_mut((0, 0), (3, 3)).copy_from(&(tangent * PLANE_RAD));
    j.view_mut((3, 0), (1, 3)).copy_from(&(pivot.transpose() * tangent * PLANE_RAD));
    j[(3, 3)] = b.unit * PLANE_MM;
    let plane = Covariance::new(&["nx", "ny", "nz", "offset_mm"], &(&j * j.transpose()));
    let (t, w) = ((b.unit * HAND_EYE_MM).powi(2), HAND_EYE_RAD.powi(2));
    let names = ["tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad", "rz_rad"];
    let hand_eye = Covariance::new(&names, &DMatrix::from_diagonal(&DVector::from_vec(vec![t, t, t, w, w, w])));
    let none = Covariance::default();
    let camera = Calibration::new(Kind::Camera, b.station.camera, None, none, quality.clone());
    Rig {
        laser_plane: Some(Calibration::new(Kind::LaserPlane, b.plane, Some(&camera), plane, quality.clone())),
        hand_eye: Some(Calibration::new(Kind::HandEye, b.hand_eye, Some(&camera), hand_eye, quality)),
        pointer: None,
        camera: Some(camera),
        ..Rig::default()
    }
}
