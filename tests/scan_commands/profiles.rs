//! In: profiles of a simulated line-profile sensor on a robot over a board with known relief. Out: whether their cloud
//! lies on the board to the sensor's scatter, the stated sigma is honest, a part is found in it, and what does not fit
//! is refused.
//! Frame and unit: base frame, mm. The truth is planes and walls, in this file.

use super::common::judge::{gauss, gauss3};
use super::common::{sheetlight, sheetlight_fails};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde_json::Value;
use sheetlight::geometry::{Base, Flange, Mat3, Part, Rigid, Sensor, Vec3, exp};
use sheetlight::rig::{Calibration, Covariance, Kind, Quality, Rig, Verdict};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Half sizes of the part's top and of the hole in it, the hole's place, and the part's height over the board.
const TOP: [f64; 2] = [20.0, 12.0];
const HOLE: [f64; 2] = [4.0, 6.0];
const HOLE_AT: f64 = -9.0;
const HEIGHT: f64 = 4.0;
const PLACES: usize = 640;
const STEP: f64 = 0.125;
const SHOTS: usize = 260;

/// A part on a board: part frame, z = 0 is its top, the board lies at z = -HEIGHT.
struct World {
    base_from_part: Rigid<Base, Part>,
    flange_from_sensor: Rigid<Flange, Sensor>,
}

fn on_top(x: f64, y: f64) -> bool {
    let in_hole = (x - HOLE_AT).abs() < HOLE[0] && y.abs() < HOLE[1];
    x.abs() < TOP[0] && y.abs() < TOP[1] && !in_hole
}

/// Depth along the ray at which the board's or the part's surface is met, and whether the point lies on either of them
/// and not on a wall (`None`: the sensor sees a wall, and gives nothing).
fn seen(from: &Vec3, along: &Vec3) -> Option<f64> {
    let at = |z: f64| (z - from.z) / along.z;
    let place = |t: f64| from + along * t;
    let (top, board) = (place(at(0.0)), place(at(-HEIGHT)));
    if on_top(top.x, top.y) {
        return Some(at(0.0));
    }
    // The way from the top's plane to the board must lead through air alone.
    let free = (0..=40).all(|k| {
        let p = top + (board - top) * (f64::from(k) / 40.0);
        !on_top(p.x, p.y)
    });
    free.then(|| at(-HEIGHT))
}

impl World {
    fn new(rng: &mut Pcg64) -> World {
        let base_from_part =
            Rigid::new(exp(&Vec3::new(0.04, -0.03, 0.35 + 0.1 * gauss(rng, 1.0))), Vec3::new(420.0, -60.0, 35.0));
        World { base_from_part, flange_from_sensor: Rigid::from_vectors(&gauss3(rng, 0.8), gauss3(rng, 70.0)) }
    }

    /// True pose of the flange at a shot: the sensor looks down on the part, leaning a little, and goes along its y.
    fn flange(&self, shot: usize) -> Rigid<Base, Flange> {
        let y = (shot as f64 - 0.5 * SHOTS as f64) * STEP;
        // z of the sensor points into the part, x along the part's x, so y = z × x against the part's y.
        let down = Mat3::from_columns(&[Vec3::x(), -Vec3::y(), -Vec3::z()]);
        let lean = exp(&Vec3::new(0.06, 0.03, 0.02));
        let part_from_sensor: Rigid<Part, Sensor> = Rigid::new(lean * down, Vec3::new(-4.0, y - 8.0, 120.0));
        self.base_from_part * part_from_sensor * self.flange_from_sensor.inverse()
    }

    /// The profile at a shot, nan where nothing was measured.
    fn profile(&self, shot: usize, sigma: [f64; 2], rng: &mut Pcg64) -> Vec<[f64; 2]> {
        let part_from_sensor = self.base_from_part.inverse() * self.flange(shot) * self.flange_from_sensor;
        let along = part_from_sensor.direction(&Vec3::z());
        let place = |k: usize| {
            let x = (k as f64 - 0.5 * PLACES as f64) * 0.1;
            // x is where the sensor thinks that it measures; it measures beside it.
            let from = part_from_sensor.point(&Vec3::new(x + gauss(rng, sigma[0]), 0.0, 0.0));
            [x, seen(&from, &along).map_or(f64::NAN, |z| z + gauss(rng, sigma[1]))]
        };
        (0..PLACES).map(place).collect()
    }

    /// Distance of a point of the cloud from the surface that it was measured on; `None` near an edge.
    fn off(&self, p: &Vec3) -> Option<f64> {
        let q = self.base_from_part.inverse().point(p);
        let near = |z: f64| ((q.z - z).abs() < 1.0).then_some(q.z - z);
        let inside = |by: f64| {
            let in_hole = (q.x - HOLE_AT).abs() < HOLE[0] + by && q.y.abs() < HOLE[1] + by;
            q.x.abs() < TOP[0] - by && q.y.abs() < TOP[1] - by && !in_hole
        };
        if inside(0.5) {
            near(0.0)
        } else if inside(-1.0) {
            None
        } else {
            near(-HEIGHT)
        }
    }
}

struct Files {
    dir: tempfile::TempDir,
    station: PathBuf,
    profiles: PathBuf,
    poses: PathBuf,
}

fn text(p: &Path) -> &str {
    p.to_str().expect("UTF-8")
}

/// Profiles as CSV, poses as matrices, a station whose record has this error and covariance.
fn files(world: &World, sigma: [f64; 2], pose_mm: f64, rng: &mut Pcg64) -> Files {
    let dir = tempfile::tempdir().unwrap();
    let [station, profiles, poses] = ["station", "profiles.csv", "poses.csv"].map(|n| dir.path().join(n));
    let mut points = String::from("profile,x_mm,z_mm\n");
    let mut rows = String::from("frame");
    (0..16).for_each(|i| write!(rows, ",m{}{}", i / 4, i % 4).unwrap());
    rows.push('\n');
    for shot in 0..SHOTS {
        for [x, z] in world.profile(shot, sigma, rng) {
            writeln!(points, "{shot},{x:.4},{z:.4}").unwrap();
        }
        let flange = world.flange(shot);
        let told: Rigid<Base, Flange> = Rigid::new(flange.rotation, flange.translation + gauss3(rng, pose_mm));
        let numbers: Vec<String> = told.to_rows().iter().map(|v| format!("{v:.9}")).collect();
        writeln!(rows, "{shot},{}", numbers.join(",")).unwrap();
    }
    std::fs::write(&profiles, points).unwrap();
    std::fs::write(&poses, rows).unwrap();
    sheetlight(&["station", "new", "--station", text(&station), "--robot", "denso"]);
    store(&station, &world.flange_from_sensor);
    Files { dir, station, profiles, poses }
}

/// Standard deviations of the sensor's pose on the flange, mm and rad.
const POSE: [f64; 6] = [0.02, 0.02, 0.02, 1e-4, 1e-4, 1e-4];

fn store(station: &Path, value: &Rigid<Flange, Sensor>) {
    let (reasons, advice, figures) = (vec![], vec![], Default::default());
    let quality = Quality { verdict: Verdict::Good, reasons, advice, figures, per_picture: vec![] };
    let variances = DVector::from_iterator(6, POSE.iter().map(|s| s * s));
    let names = ["tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad", "rz_rad"];
    let covariance = Covariance::new(&names, &DMatrix::from_diagonal(&variances));
    Rig::store(station, &Calibration::new(Kind::ProfileHandEye, *value, None, covariance, quality), None).unwrap();
}

impl Files {
    fn args<'a>(&'a self, out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
        let (profiles, poses, station) = (text(&self.profiles), text(&self.poses), text(&self.station));
        let args = ["scan-profiles", profiles, "--poses", poses, "--station", station, "--out", text(out)];
        [&args[..], more].concat()
    }

    fn out(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn scan(&self, name: &str, more: &[&str]) -> (PathBuf, Value) {
        let out = self.out(name);
        let said = sheetlight(&self.args(&out, &[more, &["--json"]].concat()));
        (out, serde_json::from_str(&said).unwrap())
    }
}

const SIGMA: f64 = 0.02;

#[test]
fn a_cloud_of_profiles_lies_on_the_board_to_the_stated_sigma() {
    let rng = &mut Pcg64::seed_from_u64(31);
    let world = World::new(rng);
    let files = files(&world, [0.0, SIGMA], 0.0, rng);
    let (out, report) = files.scan("scan", &["--sigma-mm", "0.02"]);
    let cloud = sheetlight::station::cloud_of(&out).unwrap();
    assert_eq!((report["shots"].as_u64(), report["frame"].as_str()), (Some(SHOTS as u64), Some("base")));
    assert!(cloud.len() > SHOTS * PLACES * 8 / 10, "{} points", cloud.len());
    // Every point is on its surface; errors along the sensor's z count across the surface by its lean.
    let (mut sum, mut n, mut mean) = (0.0, 0, 0.0);
    for p in &cloud {
        let Some(off) = world.off(&p.at()) else { continue };
        assert!(off.abs() < 6.0 * SIGMA, "shot {} place {}: {off} mm", p.shot, p.u);
        (sum, n, mean) = (sum + (off / f64::from(p.sigma_mm)).powi(2), n + 1, mean + off);
    }
    let (ratio, mean) = ((sum / f64::from(n)).sqrt(), mean / f64::from(n));
    println!("{n} points: rms {ratio:.3} sigma, mean {mean:.5} mm");
    assert!((0.8..1.25).contains(&ratio) && mean.abs() < 0.001 && n > 100_000, "{ratio} {mean} {n}");
    // u is the place in the profile: gaps keep theirs.
    let one: Vec<f32> = cloud.iter().filter(|p| p.shot == 130).map(|p| p.u).collect();
    assert!(one.is_sorted() && one.iter().all(|u| u.fract() == 0.0) && *one.last().unwrap() > 600.0);
    assert!(one.len() < PLACES && cloud.iter().all(|p| p.v == 0.0));
    // The poses of shots.jsonl are the sensor's.
    let (_, shots, _) = sheetlight::station::whole_scan(&out).unwrap();
    let true_pose = world.flange(77) * world.flange_from_sensor;
    assert!((shots.place(77).unwrap().translation - true_pose.translation).norm() < 1e-6);
    let map = report["height_map"]["z_high_mm"].as_f64().unwrap() - report["height_map"]["z_low_mm"].as_f64().unwrap();
    assert!((map - HEIGHT).abs() < 0.2, "{map}: the map's up is towards the sensor");
    assert!(out.join("index.html").exists() && out.join("cloud.pcd").exists() && out.join("height.tif").exists());
}

const RECIPE: &str = r#"
format = 1
name = "plate"
title = "A plate with a slot"
cell_mm = 0.3
layers = ["height"]

[[shape]]
kind = "rectangle"
centre = [0, 0]
size = [40, 24]

[[shape]]
kind = "rectangle"
inside = "low"
centre = [-9, 0]
size = [8, 12]

[insertion]
approach_mm = 30
retract_mm = 60
tolerance_mm = 0.5
tolerance_deg = 1.0
"#;

#[test]
fn a_part_is_found_in_it_and_its_budget_has_the_sensors_pose() {
    let rng = &mut Pcg64::seed_from_u64(32);
    let world = World::new(rng);
    let files = files(&world, [0.01, SIGMA], 0.0, rng);
    let (out, _) = files.scan("scan", &["--sigma-mm", "0.02", "--sigma-x-mm", "0.01"]);
    let (recipe, pose) = (files.out("plate.toml"), files.out("pose.json"));
    std::fs::write(&recipe, RECIPE).unwrap();
    let find = |station: &Path| {
        let args = ["find", text(&out), "--recipe", text(&recipe), "--station", text(station), "--out", text(&pose)];
        args.map(str::to_owned).to_vec()
    };
    let words: Vec<String> = find(&files.station);
    sheetlight(&words.iter().map(String::as_str).collect::<Vec<_>>());
    let report: Value = serde_json::from_str(&std::fs::read_to_string(&pose).unwrap()).unwrap();
    let rows: [f64; 16] = serde_json::from_value(report["base_from_part"].clone()).unwrap();
    let found = Rigid::<Base, Part>::from_rows(&rows).unwrap().0;
    let (rad, mm) = found.difference(&world.base_from_part);
    println!("part off by {mm:.4} mm, {:.4} degrees", rad.to_degrees());
    assert!(mm < 0.1 && rad.to_degrees() < 0.1, "{mm} mm, {} degrees: {report}", rad.to_degrees());
    let terms = report["budget"]["terms"].as_array().unwrap();
    let of = |name: &str| terms.iter().find(|t| t["name"] == name);
    let z = of("profile hand-eye").expect("a term")["sigma_mm"][2].as_f64().unwrap();
    // 0.02 mm of place and 1e-4 rad over the sensor's 120 mm and more from the flange.
    assert!((0.02..0.05).contains(&z), "{z}");
    assert!(of("laser plane").is_none() && of("hand-eye").is_none(), "{terms:?}");
    assert!(report["budget"]["complete"] == true, "{report}");
    // The other steps open it as any scan.
    let (bag, left) = (files.out("scan.mcap"), files.out("left"));
    let said = sheetlight(&["mcap", text(&out), "--station", text(&files.station), "--out", text(&bag)]);
    assert_eq!(said.lines().filter(|l| l.contains(" 260 ")).count(), 2, "profiles and transforms: {said}");
    sheetlight(&["filter", text(&out), "--filter", "islands:5,0.5", "--out", text(&left)]);
    let whole = sheetlight::station::whole_scan(&left).unwrap();
    assert!(whole.0.filtered.is_some() && whole.0.profiles.is_some() && whole.1.place(0).is_some());
    let said = sheetlight(&["verify", "--station", text(&files.station), "--json"]);
    assert!(said.contains("profile hand-eye") && !said.contains("cannot scan yet"), "{said}");
    // Another calibration than the one that scanned.
    let moved = Rigid::new(world.flange_from_sensor.rotation, world.flange_from_sensor.translation + Vec3::x() * 0.1);
    store(&files.station, &moved);
    let said = sheetlight_fails(&words.iter().map(String::as_str).collect::<Vec<_>>()).1;
    assert!(said.contains("was scanned with calibration"), "{said}");
}

/// A robot whose reported places scatter by 0.05 mm: the scan takes the scatter along the normal out.
#[test]
fn scatter_of_reported_places_is_taken_out_as_from_pictures() {
    let rng = &mut Pcg64::seed_from_u64(33);
    let world = World::new(rng);
    let files = files(&world, [0.0, 0.01], 0.05, rng);
    let off = |out: &Path| {
        let all = sheetlight::station::cloud_of(out).unwrap();
        let off: Vec<f64> = all.iter().filter_map(|p| world.off(&p.at())).collect();
        (off.iter().map(|v| v * v).sum::<f64>() / off.len() as f64).sqrt()
    };
    let (straight, report) = files.scan("straight", &["--sigma-mm", "0.01"]);
    assert_eq!(report["places"]["taken_out"], true, "{}", report["places"]);
    sheetlight(&["station", "set", "--station", text(&files.station), "extraction.straighten=false"]);
    let (plain, report) = files.scan("plain", &["--sigma-mm", "0.01"]);
    assert!(report["places"].is_null());
    println!("rms with the scatter {:.4} mm, without {:.4} mm", off(&plain), off(&straight));
    assert!(off(&plain) > 0.04 && off(&straight) < 0.6 * off(&plain));
}

#[test]
fn ways_to_write_profiles_give_one_cloud() {
    let rng = &mut Pcg64::seed_from_u64(34);
    let world = World::new(rng);
    let files = files(&world, [0.0, SIGMA], 0.0, rng);
    let (out, _) = files.scan("scan", &["--sigma-mm", "0.02"]);
    let want = sheetlight::station::cloud_of(&out).unwrap();
    let csv = std::fs::read_to_string(&files.profiles).unwrap();
    // A number for places that were not measured, and z that grows towards the sensor.
    let other = csv.replace("NaN", "-999");
    let up: Vec<String> = other
        .lines()
        .map(|l| match l.rsplit_once(',').map(|(a, z)| (a, z.parse::<f64>())) {
            Some((a, Ok(z))) => format!("{a},{}", if z == -999.0 { z } else { -z }),
            _ => l.to_owned(),
        })
        .collect();
    std::fs::write(&files.profiles, up.join("\n")).unwrap();
    let (out, report) = files.scan("up", &["--sigma-mm", "0.02", "--missing", "-999", "--z-up"]);
    assert!(sheetlight::station::cloud_of(&out).unwrap() == want, "another cloud");
    assert_eq!(
        (&report["profiles"]["z_up"], report["profiles"]["missing"].as_f64()),
        (&Value::Bool(true), Some(-999.0))
    );
    // Places that were not measured are not in the file: u follows x.
    let gone: Vec<&str> = csv.lines().filter(|l| !l.contains("NaN")).collect();
    std::fs::write(&files.profiles, gone.join("\n")).unwrap();
    let (out, report) = files.scan("gone", &["--sigma-mm", "0.02"]);
    let cloud = sheetlight::station::cloud_of(&out).unwrap();
    assert!((report["profiles"]["step_mm"].as_f64().unwrap() - 0.1).abs() < 1e-9, "{report}");
    assert!(cloud.iter().zip(&want).all(|(a, b)| a.position == b.position && a.shot == b.shot));
    let columns = |all: &[sheetlight::scan::CloudPoint]| all.iter().map(|p| p.u.round() as i64).collect::<Vec<_>>();
    let (is, was) = (columns(&cloud), columns(&want));
    let first = was[0] - is[0];
    assert!(is.iter().zip(&was).all(|(a, b)| b - a == first), "places of two shots are beside each other as before");
}

/// A conveyor under the sensor, its way slanted in the sensor's frame: the cloud is in the frame of the parts.
#[test]
fn counts_of_a_conveyor_put_profiles_together() {
    let rng = &mut Pcg64::seed_from_u64(36);
    let travel = Vec3::new(0.001, -0.0124, 0.0006);
    // The part in the sensor's frame at count 500, its top facing the sensor.
    let down = Mat3::from_columns(&[Vec3::x(), -Vec3::y(), -Vec3::z()]);
    let first: Rigid<Sensor, Part> = Rigid::new(exp(&Vec3::new(0.03, -0.05, 0.2)) * down, Vec3::new(2.0, 16.0, 140.0));
    let dir = tempfile::tempdir().unwrap();
    let [profiles, counts] = ["profiles.csv", "counts.csv"].map(|n| dir.path().join(n));
    let (mut points, mut rows) = (String::from("profile,x,z\n"), String::from("frame,count\n"));
    for shot in 0..SHOTS {
        let count = 500.0 + 10.0 * shot as f64;
        let sensor_from_part: Rigid<Sensor, Part> =
            Rigid::new(first.rotation, first.translation + travel * (count - 500.0));
        let part_from_sensor = sensor_from_part.inverse();
        let along = part_from_sensor.direction(&Vec3::z());
        for k in 0..PLACES {
            let x = (k as f64 - 0.5 * PLACES as f64) * 0.1;
            let z = seen(&part_from_sensor.point(&Vec3::new(x, 0.0, 0.0)), &along).map(|z| z + gauss(rng, SIGMA));
            writeln!(points, "{shot},{x},{}", z.unwrap_or(f64::NAN)).unwrap();
        }
        writeln!(rows, "{shot},{count}").unwrap();
    }
    std::fs::write(&profiles, &points).unwrap();
    std::fs::write(&counts, &rows).unwrap();
    let out = dir.path().join("scan");
    let args = |way: &'static str| {
        let args = ["scan-profiles", text(&profiles), "--counts", text(&counts), "--travel-mm", way, "--sigma-mm"];
        [&args[..], &["0.02", "--out", text(&out), "--json"]].concat().iter().map(|a| (*a).to_owned()).collect()
    };
    let run = |args: Vec<String>| sheetlight(&args.iter().map(String::as_str).collect::<Vec<_>>());
    let fails = |args: Vec<String>| sheetlight_fails(&args.iter().map(String::as_str).collect::<Vec<_>>()).1;
    let report: Value = serde_json::from_str(&run(args("0.001,-0.0124,0.0006"))).unwrap();
    assert_eq!((&report["frame"], report["motion"]["zero"].as_f64()), (&Value::from("axis"), Some(500.0)));
    // x of the axis frame leads along the way, z towards the sensor; the origin is the sensor's.
    let x = travel.normalize();
    let z = (-Vec3::z() + x * x.z).normalize();
    let sensor_from_axis: Rigid<Sensor, Base> = Rigid::new(Mat3::from_columns(&[x, z.cross(&x), z]), Vec3::zeros());
    let world = World { base_from_part: sensor_from_axis.inverse() * first, flange_from_sensor: Rigid::identity() };
    let cloud = sheetlight::station::cloud_of(&out).unwrap();
    let off: Vec<f64> = cloud.iter().filter_map(|p| world.off(&p.at())).collect();
    let rms = (off.iter().map(|v| v * v).sum::<f64>() / off.len() as f64).sqrt();
    println!("{} of {} points: rms {rms:.4} mm", off.len(), cloud.len());
    assert!((0.8..1.25).contains(&(rms / SIGMA)) && off.len() > 100_000 && off.iter().all(|v| v.abs() < 6.0 * SIGMA));
    // The numbers of the profiles count, not their order in the file.
    let lines: Vec<&str> = points.lines().skip(1).collect();
    let turned: Vec<&str> = lines.rchunks(PLACES).flatten().copied().collect();
    std::fs::write(&profiles, format!("profile,x,z\n{}\n", turned.join("\n"))).unwrap();
    run(args("0.001,-0.0124,0.0006"));
    assert!(sheetlight::station::cloud_of(&out).unwrap() == cloud, "the order in the file changed the points");
    let without = [&lines[..7 * PLACES], &lines[8 * PLACES..]].concat();
    std::fs::write(&profiles, format!("profile,x,z\n{}\n", without.join("\n"))).unwrap();
    assert!(fails(args("0,0.01,0")).contains("profile 8 follows 6, 7 is missing"));
    std::fs::write(&profiles, &points).unwrap();
    assert!(fails(args("0,0.001,0.02")).contains("leads along z of the sensor"));
    assert!(fails(args("0,0,0")).contains("0 mm long"));
    std::fs::write(&counts, rows.replace("\n7,570", "")).unwrap();
    assert!(fails(args("0,0.01,0")).contains("profile 7 has no count"));
}

#[test]
fn what_does_not_fit_is_refused_and_named() {
    let rng = &mut Pcg64::seed_from_u64(35);
    let world = World::new(rng);
    let mut files = files(&world, [0.0, SIGMA], 0.0, rng);
    let out = files.out("scan");
    let said = |files: &Files, more: &[&str]| sheetlight_fails(&files.args(&out, more)).1;
    let sigma = ["--sigma-mm", "0.02"];
    assert!(said(&files, &[]).contains("--sigma-mm"));
    assert!(said(&files, &["--sigma-mm", "0"]).contains("--sigma-mm is 0"));
    assert!(said(&files, &["--sigma-mm", "0.02", "--sigma-x-mm", "20"]).contains("--sigma-x-mm is 20"));
    let (profiles, poses) = [&files.profiles, &files.poses].map(|p| std::fs::read_to_string(p).unwrap()).into();
    let short: Vec<&str> = poses.lines().take(200).collect();
    std::fs::write(&files.poses, short.join("\n")).unwrap();
    let s = said(&files, &sigma);
    assert!(s.contains("260 profiles and 199 poses"), "{s}");
    // Poses in a user frame of a FANUC.
    let listing = (0..SHOTS).fold(String::from("/POS\n"), |all, i| {
        all + &format!(
            "P[{}]{{\n   GP1:\n    UF : 3, UT : 0, CONFIG : 'N U T, 0, 0, 0',\n    X = 400.0 mm, Y = {i}.0 mm, \
             Z = 200.0 mm,\n    W = 0.0 deg, P = 0.0 deg, R = 0.0 deg\n}};\n",
            i + 1
        )
    });
    let listed = files.out("SCAN.LS");
    let csv = std::mem::replace(&mut files.poses, listed);
    std::fs::write(&files.poses, listing + "/END\n").unwrap();
    let s = said(&files, &sigma);
    assert!(s.contains("user frame 3"), "{s}");
    files.poses = csv;
    std::fs::write(&files.poses, &poses).unwrap();
    // Nothing measured, counts that are no mm.
    let nothing: Vec<String> = profiles.lines().map(|l| format!("{},nan", l.rsplit_once(',').unwrap().0)).collect();
    std::fs::write(&files.profiles, nothing.join("\n").replace("x_mm,nan", "x_mm,z_mm")).unwrap();
    let s = said(&files, &sigma);
    assert!(s.contains("nothing was measured in 260 profiles"), "{s}");
    std::fs::write(&files.profiles, profiles.replace("NaN", "-32768")).unwrap();
    let s = said(&files, &sigma);
    assert!(s.contains("-32768") && s.contains("--missing"), "{s}");
    std::fs::write(&files.profiles, &profiles).unwrap();
    let bare = files.out("bare");
    sheetlight(&["station", "new", "--station", text(&bare)]);
    files.station = bare;
    let s = said(&files, &sigma);
    assert!(s.contains("no profile hand-eye calibration") && s.contains("calibrate profile-hand-eye"), "{s}");
    assert!(!out.join("scan.json").exists() && !out.join("cloud.ply").exists());
}
