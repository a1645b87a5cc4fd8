//! In: simulated stations with known truth, a part seen from two sides, and stations or recordings made wrong by one edit.
//! Out: judgement on the second look: no wrong pose passes, right ones do, sigmas are honest, one look says that it was not
//! cross-checked. Points come from rays of the scene, not from pictures. Frame and unit: base frame; mm, degrees.
//! SHEETLIGHT_LONG: ten stations of as many designs, thirty right draws each.

mod common;

use common::pose::Off;
use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::find::look::looks::other_side;
use sheetlight::find::{LocateOptions, Recipe, Report, agree, locate};
use sheetlight::geometry::{Base, Camera, Flange, Mat3, Part, Plane, Rigid, Vec2, Vec3, exp};
use sheetlight::rig::{Calibration, Covariance, Kind, Quality, Rig, Verdict};
use sheetlight::robot::{Convention, zyx_deg, zyx_of};
use sheetlight::scan::CloudPoint;
use sheetlight::simulate::{InScene, RigSpec, Scene, SceneSpec, Station, base_from_scene, part_pose, scan};
use std::path::PathBuf;

/// Errors of the calibrations, one standard deviation, as good stations of the paper's size have them; lengths of other designs
/// in proportion to their field.
const HAND_EYE_MM: f64 = 0.03;
const HAND_EYE_RAD: f64 = 1.5e-4;
const PLANE_RAD: f64 = 1e-4;
const PLANE_MM: f64 = 0.015;
/// Of a pose's reading.
const ROBOT_MM: f64 = 0.007;
const PEAK_PX: f64 = 0.06;
/// Shots of a look.
const SHOTS: usize = 130;
/// Designs of the long form; the first is the short form's. Stripes lie, stand and lean.
const DESIGNS: [&str; 10] =
    ["paper", "paper", "fine", "shallow", "slant30", "upright", "behind", "webcam", "portrait", "microscope"];

/// What a program gets of one look: peaks by shot, and the robot's poses.
#[derive(Clone)]
struct Recorded {
    peaks: Vec<Vec<Peak>>,
    poses: Vec<Rigid<Base, Flange>>,
}

/// A station that a program believes in.
#[derive(Clone)]
struct Believed {
    station: Station,
    /// Lengths of the design over those of the paper's rig.
    unit: f64,
    plane: Plane<Camera>,
    hand_eye: Rigid<Flange, Camera>,
}

struct World {
    station: Station,
    unit: f64,
    recipe: Recipe,
    truth: Rigid<Base, Part>,
    looks: [Recorded; 2],
}

/// A peak: where it is seen and how much of the sheet's light it sends back, 0 to 1.
#[derive(Clone, Copy)]
struct Peak {
    px: Vec2,
    share: f64,
}

/// Beams across the sheet, whose light a peak is the middle of.
const ACROSS: i32 = 7;

/// Rays of the sheet from one camera pose: the peaks of what it lights and the camera sees, one a column. At an edge a part of
/// the light falls elsewhere: the peak is the middle of what is left.
fn peaks(station: &Station, scene: &Scene, from_camera: &Rigid<InScene, Camera>, reach: f64) -> Vec<Peak> {
    let laser = &station.laser;
    let across = across(station);
    let along_x = across.y.abs() >= across.x.abs();
    let along = |p: &Vec2| if along_x { p.x } else { p.y };
    let (width, height) = (f64::from(station.camera.width), f64::from(station.camera.height));
    // A third of a pixel apart.
    let range = station.working_distance - laser.source.z;
    let beams_over = (2.0 * reach * range / station.working_distance * station.camera.fx * 3.0).ceil() as u32;
    let source = from_camera.point(&laser.source);
    let [axis, normal] = [laser.axis, laser.normal].map(|d| from_camera.direction(&d));
    let side = normal.cross(&axis);
    let (eye, to_camera) = (from_camera.translation, from_camera.inverse());
    let seen = |start: &Vec3, direction: &Vec3| -> Option<Vec2> {
        let hit = scene.hit(start, direction, 2000.0)?;
        let lifted = hit.point + hit.normal * 1e-6;
        let faces = hit.normal.dot(&(eye - hit.point)) > 0.0 && scene.clear(&lifted, &eye);
        faces.then(|| station.camera.pixel_from_point(&to_camera.point(&hit.point))).flatten()
    };
    let mut columns = std::collections::BTreeMap::<i64, Peak>::new();
    for i in 0..beams_over {
        let slope = reach * (2.0 * (f64::from(i) + 0.5) / f64::from(beams_over) - 1.0);
        let direction = (axis + side * slope).normalize();
        let radius = laser.radius(station.working_distance);
        let beams: Vec<(Vec2, f64)> = (-ACROSS..=ACROSS)
            .filter_map(|k| {
                let x = 1.5 * f64::from(k) / f64::from(ACROSS);
                Some((seen(&(source + normal * (x * radius)), &direction)?, (-2.0 * x * x).exp()))
            })
            .collect();
        // Neighbouring beams whose images are far apart lie on two surfaces: two peaks, of which the stronger is taken.
        let all: f64 =
            (-ACROSS..=ACROSS).map(|k| (-2.0 * (1.5 * f64::from(k) / f64::from(ACROSS)).powi(2)).exp()).sum();
        let pieces = beams.chunk_by(|a, b| (a.0 - b.0).dot(&across).abs() < 1.0);
        let peak = pieces.map(|piece| {
            let light: f64 = piece.iter().map(|b| b.1).sum();
            let px = piece.iter().map(|b| b.0 * b.1).sum::<Vec2>() / light;
            Peak { px, share: light / all }
        });
        let Some(peak) = peak.max_by(|a, b| a.share.total_cmp(&b.share)).filter(|p| p.share > 0.3) else { continue };
        let slot = along(&peak.px).round() as i64;
        let inside = peak.px.x > 0.0 && peak.px.y > 0.0 && peak.px.x < width - 1.0 && peak.px.y < height - 1.0;
        let better = |old: &Peak| (along(&peak.px) - slot as f64).abs() < (along(&old.px) - slot as f64).abs();
        if inside && columns.get(&slot).is_none_or(better) {
            columns.insert(slot, peak);
        }
    }
    columns.into_values().collect()
}

/// Direction in the picture in which the stripe moves with depth.
fn across(station: &Station) -> Vec2 {
    let (sin, cos) = station.rig.laser.side_deg.to_radians().sin_cos();
    Vec2::new(cos, sin)
}

/// What a rig looks at: the LED socket of the board before the paper's, else the notched plate that fits its field.
fn looked_at(rig: &RigSpec, name: &str) -> (SceneSpec, Recipe) {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let (mut spec, recipe, half, part) = if name == "paper" {
        let spec = SceneSpec::load(&root.join("data/scenes/board.toml")).unwrap();
        (spec, Recipe::load(&root.join("data/recipes/led.toml")).unwrap(), [20.0, 13.0], "led")
    } else {
        let u = rig.scale();
        // Steps of a scan of the plate alone, turned and tilted.
        let shots = (SHOTS as f64 * 32.0 / 30.0) as usize;
        (rig.scene(), Recipe::parse(&rig.recipe(shots)).unwrap(), [21.0 * u, 14.5 * u], "notched")
    };
    let part = spec.part.iter().find(|p| p.name == part).unwrap().clone();
    let (x, y) = (part.at_mm[0], part.at_mm[1]);
    spec.region_mm = [x - half[0], y - half[1], x + half[0], y + half[1]];
    (spec, recipe)
}

impl World {
    fn new(index: usize) -> World {
        let name = DESIGNS[index];
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("data/rigs/{name}.toml"));
        let rig = RigSpec::load(&path).unwrap();
        let (w, h) = (rig.camera.width_px, rig.camera.height_px);
        // What a larger sensor would cost is time.
        let width = w.min(800);
        let station = Station::of(&rig, 100 + index as u64).with_size(width, width * h / w);
        let unit = rig.scale();
        let (spec, mut recipe) = looked_at(&rig, name);
        // What is judged is the measurement: the robot that inserts is exact.
        (recipe.robot.sigma_mm, recipe.robot.sigma_deg) = (0.0, 0.0);
        recipe.gates.second_look = true;
        recipe.gates.max_unseen_height_mm *= unit.max(1.0);
        let part = spec.part.iter().find(|p| p.name == recipe.name).unwrap();
        let in_scene: Rigid<InScene, Part> = part_pose(part);
        let [x0, _, x1, _] = spec.region_mm;
        let reach = 0.72 * (x1 - x0) / (station.working_distance - station.laser.source.z);
        let scene = Scene::new(spec).unwrap();
        let placed = base_from_scene(&station);
        let truth = placed * in_scene;
        let mut rng = station.rng("second look", 0);
        let path = scan(&station, &scene, SHOTS);
        let other = other_side(&truth, 150.0 + rng.random_range(0.0..60.0), 15.0 + rng.random_range(0.0..10.0));
        let looks = [None, Some(other)].map(|side| {
            let shots = path.par_iter().map(|in_scene| {
                let here = placed * *in_scene;
                let camera = side.map_or(here, |s| s * here);
                let seen = peaks(&station, &scene, &(placed.inverse() * camera), reach);
                (seen, camera * station.flange_from_camera.inverse())
            });
            let (peaks, poses) = shots.unzip();
            Recorded { peaks, poses }
        });
        World { station, unit, recipe, truth, looks }
    }

    /// What is recorded: peaks and the robot's readings with their noise.
    fn recorded(&self, rng: &mut Pcg64) -> [Recorded; 2] {
        let mut looks = self.looks.clone();
        let across = across(&self.station);
        for look in &mut looks {
            for pose in &mut look.poses {
                pose.translation += Vec3::from_fn(|_, _| self.unit * ROBOT_MM * rng.sample::<f64, _>(StandardNormal));
            }
            for peak in look.peaks.iter_mut().flatten() {
                peak.px += across * (PEAK_PX * rng.sample::<f64, _>(StandardNormal));
            }
        }
        looks
    }

    /// The calibrations as a good calibration would give them: off by what their covariance says.
    fn believed(&self, rng: &mut Pcg64) -> Believed {
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

    fn cloud(&self, b: &Believed, look: &Recorded) -> Vec<CloudPoint> {
        let mut out = Vec::new();
        for (shot, (peaks, pose)) in look.peaks.iter().zip(&look.poses).enumerate() {
            let camera = *pose * b.hand_eye;
            for p in peaks {
                let Some(point) = b.station.camera.ray_from_pixel(&p.px).and_then(|r| r.meet(&b.plane)) else {
                    continue;
                };
                let q = camera.point(&point);
                out.push(CloudPoint {
                    position: [q.x as f32, q.y as f32, q.z as f32],
                    sigma_mm: (0.02 * self.unit) as f32,
                    intensity: (150.0 * p.share) as f32,
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
    fn look(&self, b: &Believed, looks: &[Recorded; 2]) -> Result<(Vec<Report>, Report), String> {
        let rig = rig(b);
        let mut reports: Vec<Report> = Vec::new();
        for look in looks {
            let options = LocateOptions::default();
            let options = if let Some(first) = reports.first() { options.again(first) } else { options };
            reports.push(locate(&self.cloud(b, look), &self.recipe, Some(&rig), &options).map_err(|e| e.what)?);
        }
        let both = agree(reports.clone(), None, &self.recipe, Convention::Matrix).map_err(|e| e.what)?;
        Ok((reports, both))
    }
}

fn rig(b: &Believed) -> Rig {
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

/// Another specimen of the same design.
fn another(b: &Believed) -> Station {
    let (w, h) = (b.station.camera.width, b.station.camera.height);
    Station::of(&b.station.rig, b.station.seed + 77).with_size(w, h)
}

type Edit = (&'static str, fn(&mut Believed, &mut [Recorded; 2]));

fn each_pose(
    looks: &mut [Recorded; 2],
    mut f: impl FnMut(&Rigid<Base, Flange>, &Rigid<Base, Flange>) -> Rigid<Base, Flange>,
) {
    for look in looks {
        let first = look.poses[0];
        look.poses.iter_mut().for_each(|p| *p = f(&first, p));
    }
}

/// Shifts poses against pictures by `by` shots.
fn delayed(looks: &mut [Recorded; 2], by: i64) {
    for look in looks {
        let n = look.poses.len() as i64;
        look.poses = (0..n).map(|i| look.poses[(i + by).clamp(0, n - 1) as usize]).collect();
    }
}

/// Pictures lost on the way: from there on each is paired with an earlier pose.
fn lost(looks: &mut [Recorded; 2], count: usize) {
    for look in looks {
        let middle = look.peaks.len() / 2;
        look.peaks.drain(middle..middle + count);
        look.poses.truncate(look.peaks.len());
    }
}

/// Thirty ways to make a good station or recording wrong by one edit: unit, sign, transpose, order, delay, scale, mirror,
/// frame, mixed files.
const EDITS: &[Edit] = &[
    ("hand-eye translation in metres", |b, _| b.hand_eye.translation *= 1e-3),
    ("hand-eye 1 mm off in x", |b, _| b.hand_eye.translation.x += b.unit),
    ("hand-eye 1 mm off in y", |b, _| b.hand_eye.translation.y += b.unit),
    ("hand-eye 1 mm off in z", |b, _| b.hand_eye.translation.z += b.unit),
    ("hand-eye x with the other sign", |b, _| b.hand_eye.translation.x *= -1.0),
    ("hand-eye rotation transposed", |b, _| b.hand_eye.rotation = b.hand_eye.rotation.transpose()),
    ("hand-eye the other way round", |b, _| {
        let inverse = b.hand_eye.inverse();
        b.hand_eye = Rigid::new(inverse.rotation, inverse.translation);
    }),
    ("hand-eye tilted by half a degree", |b, _| b.hand_eye.rotation = exp(&(Vec3::x() * 0.0087)) * b.hand_eye.rotation),
    ("hand-eye turned by half a degree", |b, _| b.hand_eye.rotation = exp(&(Vec3::z() * 0.0087)) * b.hand_eye.rotation),
    ("hand-eye of another specimen", |b, _| b.hand_eye = another(b).flange_from_camera),
    ("plane's offset 1 mm more", |b, _| b.plane.offset += b.unit),
    ("plane's offset 0.3 mm less", |b, _| b.plane.offset -= 0.3 * b.unit),
    ("plane's normal 1.01 long", |b, _| b.plane.offset /= 1.01),
    ("plane's normal 1.002 long", |b, _| b.plane.offset /= 1.002),
    ("plane tilted by half a degree", |b, _| b.plane.normal = exp(&(Vec3::x() * 0.0087)) * b.plane.normal),
    ("plane rolled by half a degree", |b, _| b.plane.normal = exp(&(Vec3::z() * 0.0087)) * b.plane.normal),
    ("plane of another specimen", |b, _| b.plane = another(b).laser.plane()),
    ("camera of another specimen", |b, _| b.station.camera = another(b).camera),
    ("focal length 2 % more", |b, _| {
        b.station.camera.fx *= 1.02;
        b.station.camera.fy *= 1.02;
    }),
    ("principal point 5 px off in v", |b, _| b.station.camera.cy += 5.0),
    ("principal point 5 px off in u", |b, _| b.station.camera.cx += 5.0),
    ("lens forgotten", |b, _| b.station.camera.distortion = Default::default()),
    ("poses early by three shots", |_, l| delayed(l, 3)),
    ("poses late by one shot", |_, l| delayed(l, -1)),
    ("one picture lost", |_, l| lost(l, 1)),
    ("three pictures lost", |_, l| lost(l, 3)),
    ("camera's ReverseX on", |b, l| {
        let last = f64::from(b.station.camera.width) - 1.0;
        l.iter_mut().for_each(|k| k.peaks.iter_mut().flatten().for_each(|p| p.px.x = last - p.px.x))
    }),
    ("camera's ReverseY on", |b, l| {
        let last = f64::from(b.station.camera.height) - 1.0;
        l.iter_mut().for_each(|k| k.peaks.iter_mut().flatten().for_each(|p| p.px.y = last - p.px.y))
    }),
    ("steps scaled by 1.02", |_, l| {
        each_pose(l, |first, p| Rigid::new(p.rotation, first.translation + (p.translation - first.translation) * 1.02))
    }),
    ("steps scaled by 0.98", |_, l| {
        each_pose(l, |first, p| Rigid::new(p.rotation, first.translation + (p.translation - first.translation) * 0.98))
    }),
    ("poses' rotation transposed", |_, l| each_pose(l, |_, p| Rigid::new(p.rotation.transpose(), p.translation))),
    ("poses' angles in the other order", |_, l| {
        each_pose(l, |_, p| {
            let [z, y, x] = zyx_of(&p.rotation);
            Rigid::new(zyx_deg(x, y, z), p.translation)
        })
    }),
];

/// Stations that are looked at, and right draws of each.
fn long() -> bool {
    std::env::var_os("SHEETLIGHT_LONG").is_some()
}
fn worlds() -> usize {
    if long() { DESIGNS.len() } else { 1 }
}

/// Wrong by more than it says and by more than can be borne.
fn wrong(r: &Report, world: &World) -> bool {
    let off = Off::of(&r.base_from_part, &world.truth);
    let bar = 0.1 * world.unit.min(1.0);
    let turn = r.sigma_deg.iter().copied().fold(0.0, f64::max);
    (0..3).any(|k| off.by[k].abs() > (3.0 * r.sigma_mm[k]).max(bar)) || off.angle_deg > (3.0 * turn).max(0.3)
}

/// What a look alone or both came to.
#[derive(Clone, Copy, Default)]
struct Passed {
    one: bool,
    two: bool,
}

/// One edit at one station: which wrong poses pass.
fn tried(world: &World, name: &str, edit: fn(&mut Believed, &mut [Recorded; 2])) -> Passed {
    let mut rng = world.station.rng(name, 1);
    let (mut believed, mut looks) = (world.believed(&mut rng), world.recorded(&mut rng));
    edit(&mut believed, &mut looks);
    let (alone, both) = match world.look(&believed, &looks) {
        Ok(found) => found,
        Err(what) => {
            println!("{}, {name}: refused: {what}", world.station.rig.name);
            return Passed::default();
        }
    };
    let l = both.looks.as_ref().unwrap();
    // The recipe asks for two looks: what one alone would be refused for besides.
    let others = |r: &Report| r.gates.iter().all(|g| g.passed || g.name == "number of looks");
    let off = |r: &Report| {
        let off = Off::of(&r.base_from_part, &world.truth);
        off.in_plane().max(off.in_height())
    };
    println!(
        "{}, {name}: one look off by {:.3} mm ({}), both by {:.3} mm ({}), ratio {:.1}, misfit {:.1}, best explained by {:?}",
        world.station.rig.name,
        off(&alone[0]),
        if others(&alone[0]) { "passed" } else { "refused" },
        off(&both),
        if both.passed { "passed" } else { "refused" },
        l.ratio,
        l.misfit_sigmas,
        l.explained_by.first().map(|e| e.name)
    );
    for r in &alone {
        assert!(!r.passed && r.notes.iter().any(|n| n.contains("not cross-checked")), "{:?}", r.notes);
    }
    if both.passed && wrong(&both, world) {
        println!("  PASSED WRONG, it says that it leaves {:.2} mm unseen in height: {l:?}", l.unseen_height_mm);
    }
    Passed { one: others(&alone[0]) && wrong(&alone[0], world), two: both.passed && wrong(&both, world) }
}

#[test]
fn no_edit_of_a_station_or_recording_passes_two_looks_with_a_wrong_pose() {
    let (mut alone, mut both) = (0, 0);
    for index in 0..worlds() {
        let world = World::new(index);
        let passed: Vec<Passed> = EDITS.par_iter().map(|(name, edit)| tried(&world, name, *edit)).collect();
        let count = |f: fn(&Passed) -> bool| passed.iter().filter(|p| f(p)).count();
        let (one, two) = (count(|p| p.one), count(|p| p.two));
        println!("{}: {one} wrong poses pass one look, {two} two, of {}", world.station.rig.name, EDITS.len());
        (alone, both) = (alone + one, both + two);
    }
    assert_eq!(both, 0, "wrong poses pass two looks");
    // Otherwise this test would show nothing.
    assert!(alone > 5 * worlds(), "{alone} edits pass one look with a wrong pose");
}

/// Squares of error over stated sigma, x y z of the part.
type Squares = [f64; 3];

struct Right {
    passed: bool,
    one: Squares,
    two: Squares,
    /// Two looks are farther off in the plane than one.
    worse: bool,
}

fn right(world: &World, draw: u64) -> Right {
    let believed = world.believed(&mut world.station.rng("right", draw));
    let looks = world.recorded(&mut world.station.rng("right", 1000 + draw));
    let (alone, both) = world.look(&believed, &looks).unwrap();
    let off = |r: &Report| Off::of(&r.base_from_part, &world.truth);
    let squares = |r: &Report| [0, 1, 2].map(|k| (off(r).by[k] / r.sigma_mm[k]).powi(2));
    if !both.passed {
        let l = both.looks.as_ref().unwrap();
        let (mm, deg) = ((l.difference_mm, l.expected_mm), (l.difference_deg, l.expected_deg));
        println!("{}, draw {draw}: {:?}, {mm:.4?} mm, {deg:.4?} degrees", world.station.rig.name, both.reasons);
        println!("    {:?}\n    {:?}", alone[0].sizes, alone[1].sizes);
        println!("    {:?}", l.explained_by.iter().map(|e| (e.name, e.share, &e.off_by)).collect::<Vec<_>>());
    }
    let worse = off(&both).in_plane() > off(&alone[0]).in_plane();
    Right { passed: both.passed, one: squares(&alone[0]), two: squares(&both), worse }
}

#[test]
fn right_stations_pass_two_looks_and_the_pose_is_as_good_as_it_says() {
    let draws: u64 = if long() { 30 } else { 6 };
    let mut all = Vec::new();
    let rms = |of: &[Right], f: &dyn Fn(&Right) -> Squares| {
        [0, 1, 2].map(|k| (of.iter().map(|r| f(r)[k]).sum::<f64>() / of.len() as f64).sqrt())
    };
    for index in 0..worlds() {
        let world = World::new(index);
        let here: Vec<Right> = (0..draws).into_par_iter().map(|draw| right(&world, draw)).collect();
        println!(
            "{}: {} of {draws} pass; error over stated sigma {:.2?} of one look, {:.2?} of two",
            world.station.rig.name,
            here.iter().filter(|r| r.passed).count(),
            rms(&here, &|r| r.one),
            rms(&here, &|r| r.two)
        );
        all.extend(here);
    }
    let (n, passed) = (all.len(), all.iter().filter(|r| r.passed).count());
    let (one, two) = (rms(&all, &|r| r.one), rms(&all, &|r| r.two));
    let worse = all.iter().filter(|r| r.worse).count();
    println!(
        "{passed} of {n} pass; error over stated sigma {one:.2?} of one look, {two:.2?} of two; worse in the plane: {worse}"
    );
    assert!(passed * 100 >= n * 99 - if long() { 0 } else { 100 }, "{passed} of {n} right ones pass");
    // Six draws at one station tell a sigma to a factor of two.
    let range = if long() { 0.8..=1.25 } else { 0.4..=2.5 };
    assert!(one.iter().chain(&two).all(|h| range.contains(h)), "{one:.2?} {two:.2?}");
    assert!(worse * 2 < n, "two looks are worse than one in {worse} of {n}");
}
