//! In: random line-profile sensors on a flange, a plate, robot poses. Out: whether the sensor's pose comes with its
//! true sigma, and what the profiles do not determine is refused and named.
//! Frame and unit: mm, rad.

use crate::common::judge::{between, gauss, gauss3};
use nalgebra::DVector;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use sheetlight::calibrate::profile_sensor::ball::options::BallOptions;
use sheetlight::calibrate::profile_sensor::ball::solve as on_ball;
use sheetlight::calibrate::profile_sensor::found::SensorFit;
use sheetlight::calibrate::profile_sensor::plane::evaluate::evaluate;
use sheetlight::calibrate::profile_sensor::plane::options::PlaneOptions;
use sheetlight::calibrate::profile_sensor::plane::solve::{PlaneFit, solve};
use sheetlight::geometry::{Base, Flange, LeftStep, Mat3, Rigid, Sensor, Vec3, exp, log};
use sheetlight::recording::profiles::Profile;

/// Truth of one cell.
struct Cell {
    sensor: Rigid<Flange, Sensor>,
    /// The plate's normal, towards the sensor, and a place on it, base frame.
    normal: Vec3,
    middle: Vec3,
    /// z of the plate, mm.
    depth: [f64; 2],
    /// Length of the line on the plate, mm.
    length: f64,
    point_mm: f64,
    robot_mm: f64,
    robot_deg: f64,
    /// Share of the profiles that lie partly beside the plate.
    bad: f64,
}

fn cell(rng: &mut Pcg64) -> Cell {
    Cell {
        sensor: Rigid::from_vectors(&gauss3(rng, 1.0), gauss3(rng, 80.0)),
        normal: gauss3(rng, 1.0).normalize(),
        middle: gauss3(rng, 300.0),
        depth: [140.0, 180.0],
        length: 40.0,
        point_mm: between(rng, 0.005, 0.05),
        robot_mm: between(rng, 0.02, 0.1),
        robot_deg: between(rng, 0.01, 0.05),
        bad: 0.1,
    }
}

/// How the sensor looks at the plate: turned about its x axis, then its y axis, both rad; about the plate's normal,
/// rad; z of the plate, mm.
struct Look {
    tilt: [f64; 2],
    yaw: f64,
    depth: f64,
}

/// Looks within a cone of this half angle, rad.
fn looks(rng: &mut Pcg64, c: &Cell, count: usize, widest: f64) -> Vec<Look> {
    (0..count)
        .map(|_| {
            let (size, towards) = (widest * rng.random::<f64>().sqrt(), between(rng, 0.0, std::f64::consts::TAU));
            Look {
                tilt: [size * towards.cos(), size * towards.sin()],
                yaw: between(rng, -3.0, 3.0),
                depth: between(rng, c.depth[0], c.depth[1]),
            }
        })
        .collect()
}

/// Profiles of the plate and reported poses.
fn scans(rng: &mut Pcg64, c: &Cell, looks: &[Look]) -> (Vec<Profile>, Vec<Rigid<Base, Flange>>) {
    // A sensor that looks straight down on the plate.
    let side = c.normal.cross(&Vec3::new(0.3, 0.5, -0.8)).normalize();
    let down = Mat3::from_columns(&[side, -c.normal.cross(&side), -c.normal]);
    let mut out = (Vec::new(), Vec::new());
    for (i, look) in looks.iter().enumerate() {
        let tilted = exp(&Vec3::new(look.tilt[0], look.tilt[1], 0.0));
        let turn = down * exp(&Vec3::new(0.0, 0.0, look.yaw)) * tilted;
        let other = c.normal.cross(&side);
        let place = c.middle + side * between(rng, -60.0, 60.0) + other * between(rng, -60.0, 60.0);
        let base_from_sensor: Rigid<Base, Sensor> =
            Rigid::new(turn, place - turn * Vec3::new(between(rng, -5.0, 5.0), 0.0, look.depth));
        // Where the ray x = const of the profile plane meets the plate.
        let seen = |x: f64| {
            let from = base_from_sensor.point(&Vec3::new(x, 0.0, 0.0));
            let along = turn.column(2).into_owned();
            (c.middle - from).dot(&c.normal) / along.dot(&c.normal)
        };
        let beside = if rng.random::<f64>() < c.bad { between(rng, 0.2, 0.45) } else { 0.0 };
        let drop = between(rng, 2.0, 15.0);
        let count = 160;
        let points = (0..count)
            .map(|k| {
                let share = f64::from(k) / f64::from(count - 1);
                let x = c.length * (share - 0.5);
                // A clamp, or the table beside the plate.
                let off = if share < beside { drop + 0.1 * x } else { 0.0 };
                [x, seen(x) + off + gauss(rng, c.point_mm)]
            })
            .collect();
        out.0.push(Profile { name: format!("profile {i}"), points });
        out.1.push(reported(rng, c, &base_from_sensor));
    }
    out
}

/// The flange's pose as the robot states it.
fn reported(rng: &mut Pcg64, c: &Cell, base_from_sensor: &Rigid<Base, Sensor>) -> Rigid<Base, Flange> {
    let pose = *base_from_sensor * c.sensor.inverse();
    let off = exp(&gauss3(rng, c.robot_deg.to_radians()));
    Rigid::new(off * pose.rotation, pose.translation + gauss3(rng, c.robot_mm))
}

/// Error of the six numbers of the pose.
fn error(found: &Rigid<Flange, Sensor>, truth: &Rigid<Flange, Sensor>) -> DVector<f64> {
    let w = log(&(found.rotation * truth.rotation.transpose()));
    let t = found.translation - truth.translation;
    DVector::from_iterator(6, t.iter().chain(w.iter()).copied())
}

/// Expected error of a point at a depth, squared.
fn expected2(fit: &SensorFit, depth: f64) -> f64 {
    let j = LeftStep::lever(&(fit.flange_from_sensor.rotation * Vec3::new(0.0, 0.0, depth)));
    (j * fit.covariance.view((0, 0), (6, 6)) * j.transpose()).trace()
}

fn said(r: Result<PlaneFit, sheetlight::fault::Fault>) -> String {
    r.map(|f| format!("{:?}", f.fit.flange_from_sensor)).unwrap_err().to_string()
}

/// Sets of all sizes and noises: 12 to 30 profiles, tilts up to 29, 40 and 52 degrees, a tenth of the profiles partly
/// beside the plate. Error over the stated sigma.
#[test]
fn the_pose_from_a_plate_comes_with_an_honest_sigma() {
    let sets = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 400 } else { 20 };
    let (mut all, mut points, mut out) = (Vec::new(), Vec::new(), [0; 2]);
    for k in 0..sets {
        let rng = &mut Pcg64::seed_from_u64(900 + k);
        let c = cell(rng);
        let count = [12, 16, 22, 30][(k % 4) as usize];
        let widest = [0.5, 0.7, 0.9][(k % 3) as usize];
        let looks = looks(rng, &c, count, widest);
        let (profiles, poses) = scans(rng, &c, &looks);
        let found = solve(&profiles, &poses, &PlaneOptions::default()).unwrap();
        let e = error(&found.fit.flange_from_sensor, &c.sensor);
        let v = &found.fit.covariance;
        all.push((widest, (0..6).map(|i| e[i] * e[i] / v[(i, i)]).sum::<f64>() / 6.0));
        let j = LeftStep::lever(&(c.sensor.rotation * Vec3::new(0.0, 0.0, 160.0)));
        points.push((j * &e).norm_squared() / expected2(&found.fit, 160.0));
        out[0] += found.fit.profiles.iter().filter(|p| !p.used).count();
        out[1] += count;
        // The plate too: its distance from a place on it, and its side.
        let off = found.plane.distance(&c.middle);
        assert!(found.plane.normal.dot(&c.normal) > 0.999 && off.abs() < 3.0, "set {k}: {off} mm");
    }
    let rms = |v: &[f64]| (v.iter().sum::<f64>() / v.len() as f64).sqrt();
    let by = [0.5, 0.7, 0.9].map(|w| rms(&all.iter().filter(|a| a.0 == w).map(|a| a.1).collect::<Vec<_>>()));
    let share = rms(&all.iter().map(|a| a.1).collect::<Vec<_>>());
    println!("{sets} sets: error over sigma {share:.3}, by tilt {by:.3?}; of a point {:.3}", rms(&points));
    println!("{} of {} right profiles were excluded", out[0], out[1]);
    assert!((0.8..=1.25).contains(&share), "{share:.3}, {by:.3?}");
    // A point's error has one weak direction: 20 sets tell its rms to 16 %, 400 to 4 %.
    assert!(sets < 100 || (0.8..=1.25).contains(&rms(&points)), "{:.3}", rms(&points));
    assert!(50 * out[0] < out[1], "{out:?}");
}

/// The same sensor, robot and number of profiles on a ball of 30 mm and on a plate.
#[test]
fn a_ball_beats_a_plate_unless_the_plate_is_tilted_far() {
    let sets = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 300 } else { 9 };
    let mut by = [(); 3].map(|()| (Vec::new(), Vec::new()));
    for k in 0..sets {
        let rng = &mut Pcg64::seed_from_u64(4000 + k);
        let c = Cell { point_mm: 0.02, robot_mm: 0.05, robot_deg: 0.02, bad: 0.0, ..cell(rng) };
        let widest = [0.35, 0.6, 0.9][(k % 3) as usize];
        let looks = looks(rng, &c, 20, widest);
        let (profiles, poses) = scans(rng, &c, &looks);
        let plate = solve(&profiles, &poses, &PlaneOptions::default());
        let (profiles, poses) = ball_scans(rng, &c, &looks);
        let ball = on_ball::solve(&profiles, &poses, &BallOptions::new(30.0)).unwrap();
        let of = |fit: &SensorFit| {
            let j = LeftStep::lever(&(c.sensor.rotation * Vec3::new(0.0, 0.0, 160.0)));
            (j * error(&fit.flange_from_sensor, &c.sensor)).norm_squared()
        };
        let (plates, balls) = &mut by[(k % 3) as usize];
        plates.push(plate.map_or(f64::NAN, |p| of(&p.fit)));
        balls.push(of(&ball.fit));
    }
    let rms = |v: &[f64]| (v.iter().sum::<f64>() / v.len() as f64).sqrt();
    let ratios = by.each_ref().map(|(p, b)| (rms(p), rms(b)));
    println!("rms error of a point at 160 mm, plate and ball, tilts to 20, 34 and 52 degrees: {ratios:.3?} mm");
    let [_, _, far] = ratios;
    assert!(ratios.iter().all(|(p, b)| *b < 0.25 && !(p < b)) && far.0 < 0.5, "{ratios:?}");
}

/// Profiles of a ball from the same orientations and distances.
fn ball_scans(rng: &mut Pcg64, c: &Cell, looks: &[Look]) -> (Vec<Profile>, Vec<Rigid<Base, Flange>>) {
    let mut out = (Vec::new(), Vec::new());
    for (i, look) in looks.iter().enumerate() {
        let turn = exp(&Vec3::new(0.0, 0.0, look.yaw)) * exp(&Vec3::new(look.tilt[0], look.tilt[1], 0.0));
        let q = Vec3::new(between(rng, -10.0, 10.0), between(rng, -11.0, 11.0), look.depth);
        let base_from_sensor: Rigid<Base, Sensor> = Rigid::new(turn, c.middle - turn * q);
        let r = (225.0 - q.y * q.y).sqrt();
        let points = (0..160)
            .map(|k| {
                let a = -1.2 + 2.4 * f64::from(k) / 159.0;
                let s = r + gauss(rng, c.point_mm);
                [q.x + s * a.sin(), q.z - s * a.cos()]
            })
            .collect();
        out.0.push(Profile { name: format!("profile {i}"), points });
        out.1.push(reported(rng, c, &base_from_sensor));
    }
    out
}

/// A sensor that counts z from the middle of its field, a short line, a long line.
#[test]
fn sensors_of_other_kinds_are_solved_too() {
    for (k, depth, length) in [(1, [-20.0, 20.0], 30.0), (2, [60.0, 75.0], 12.0), (3, [600.0, 900.0], 300.0)] {
        let rng = &mut Pcg64::seed_from_u64(60 + k);
        let c = Cell { depth, length, point_mm: 0.01, robot_mm: 0.02, robot_deg: 0.005, ..cell(rng) };
        let looks = looks(rng, &c, 24, 0.8);
        let (profiles, poses) = scans(rng, &c, &looks);
        let found = solve(&profiles, &poses, &PlaneOptions::default()).unwrap();
        let e = error(&found.fit.flange_from_sensor, &c.sensor);
        let worst = (0..6).map(|i| (e[i] / found.fit.covariance[(i, i)].sqrt()).abs()).fold(0.0, f64::max);
        assert!(worst < 4.0, "case {k}: {worst} sigmas, {e}");
    }
}

fn quiet(rng: &mut Pcg64) -> Cell {
    Cell { point_mm: 0.01, robot_mm: 0.03, robot_deg: 0.01, bad: 0.0, ..cell(rng) }
}

#[test]
fn sets_that_determine_too_little_are_refused_with_what_is_missing() {
    for k in 0..4 {
        let rng = &mut Pcg64::seed_from_u64(20 + k);
        let c = quiet(rng);
        let look = |tilt: [f64; 2], yaw: f64, depth: f64| Look { tilt, yaw, depth };
        let turn = |i: usize, by: f64| by * ((i as f64) * 2.399).sin();
        let refused = |rng: &mut Pcg64, looks: Vec<Look>| {
            let (profiles, poses) = scans(rng, &c, &looks);
            said(solve(&profiles, &poses, &PlaneOptions::default()))
        };
        // Shifts, and turns about the plate's normal.
        let same = (0..16).map(|i| look([0.0, 0.0], turn(i, 3.0), 160.0 + turn(i, 20.0))).collect();
        let words = refused(rng, same);
        assert!(words.contains("at the same angle") && words.contains("not its turn about"), "{words}");
        // Turns about one axis of the sensor.
        let fan = (0..16).map(|i| look([0.0, turn(i, 0.7)], 0.4, 160.0 + 20.0 * (i as f64).cos())).collect();
        let words = refused(rng, fan);
        assert!(words.contains("about one axis only") && words.contains("not its"), "{words}");
        // Tilts in all directions, but of one size.
        let cone = (0..16).map(|i| look([0.5, 0.0], turn(i, 3.0), 160.0 + 20.0 * (i as f64).cos()));
        let cone = cone.enumerate().map(|(i, l)| {
            let a = i as f64 * 0.9;
            Look { tilt: [0.5 * a.cos(), 0.5 * a.sin()], ..l }
        });
        let words = refused(rng, cone.collect());
        assert!(words.contains("one and the same angle") && words.contains("its position along"), "{words}");
        assert!(words.contains("add a profile with the sensor as in 'profile"), "{words}");
    }
}

/// What the refusal proposes is what was missing: with profiles from there the pose is determined.
#[test]
fn the_proposed_poses_determine_what_was_missing() {
    let rng = &mut Pcg64::seed_from_u64(77);
    let c = quiet(rng);
    let mut cone: Vec<Look> = (0..12)
        .map(|i| {
            let a = f64::from(i) * 0.9;
            Look { tilt: [0.5 * a.cos(), 0.5 * a.sin()], yaw: a, depth: 160.0 + 20.0 * a.cos() }
        })
        .collect();
    let (profiles, poses) = scans(rng, &c, &cone);
    let words = said(solve(&profiles, &poses, &PlaneOptions::default()));
    let proposed: Vec<&str> = words.split("add a profile with the sensor as in 'profile ").skip(1).collect();
    assert_eq!(proposed.len(), 2, "{words}");
    for p in proposed {
        let number = |from: &str, to: &str| -> f64 {
            p.split_once(from).map_or(0.0, |(_, rest)| rest.split_once(to).unwrap().0.trim().parse().unwrap())
        };
        let from: usize = p.split_once('\'').unwrap().0.parse().unwrap();
        let about = |axis: &str| -> f64 {
            let end = format!(" degrees about its {axis} axis");
            p.split_once(&end).map_or(0.0, |(before, _)| before.rsplit("by ").next().unwrap().parse().unwrap())
        };
        let turn = exp(&Vec3::new(cone[from].tilt[0], cone[from].tilt[1], 0.0))
            * exp(&Vec3::new(about("x").to_radians(), 0.0, 0.0))
            * exp(&Vec3::new(0.0, about("y").to_radians(), 0.0));
        // The same as a tilt and a turn about the plate's normal.
        let z = turn * Vec3::z();
        let axis = Vec3::z().cross(&z);
        let size = axis.norm().atan2(z.z);
        let w = if axis.norm() > 1e-9 { axis.normalize() * size } else { Vec3::zeros() };
        let rest = exp(&w).transpose() * turn;
        assert!((rest * Vec3::z() - Vec3::z()).norm() < 1e-9);
        for _ in 0..2 {
            let yaw = log(&rest).z;
            let about = exp(&Vec3::new(0.0, 0.0, -yaw)) * w;
            let look = Look { tilt: [about.x, about.y], yaw: cone[from].yaw + yaw, depth: number("z = ", " mm") };
            cone.push(look);
        }
    }
    let (profiles, poses) = scans(rng, &c, &cone);
    let found = solve(&profiles, &poses, &PlaneOptions::default()).unwrap();
    let off = error(&found.fit.flange_from_sensor, &c.sensor).rows(0, 3).norm();
    assert!(off < 0.6 && expected2(&found.fit, 160.0).sqrt() < 0.4, "{off} mm, {words}");
}

/// With the flange always at one distance along the plate's normal, the sensor turned by half a turn fits as well.
#[test]
fn two_poses_that_fit_alike_are_refused() {
    for k in 0..4 {
        let rng = &mut Pcg64::seed_from_u64(40 + k);
        let c = Cell { robot_mm: 0.02, ..quiet(rng) };
        let looks = looks(rng, &c, 20, 0.7);
        let (mut profiles, mut poses) = (Vec::new(), Vec::new());
        for (i, mut look) in looks.into_iter().enumerate() {
            // The depth that brings the flange to 200 mm over the plate.
            let height = |rng: &mut Pcg64, depth: f64| {
                let (p, b) = scans(
                    rng,
                    &Cell { robot_mm: 0.0, robot_deg: 0.0, ..quiet(&mut Pcg64::seed_from_u64(40 + k)) },
                    &[Look { depth, ..look }],
                );
                ((b[0].translation - c.middle).dot(&c.normal), p, b)
            };
            let h = |d: f64| height(&mut Pcg64::seed_from_u64(i as u64), d).0;
            let slope = (h(200.0) - h(100.0)) / 100.0;
            look.depth = 100.0 + (200.0 - h(100.0)) / slope;
            let (_, mut p, b) = height(&mut Pcg64::seed_from_u64(i as u64), look.depth);
            p[0].name = format!("profile {i}");
            profiles.append(&mut p);
            poses.push(Rigid::new(b[0].rotation, b[0].translation + gauss3(rng, 0.02)));
        }
        let words = said(solve(&profiles, &poses, &PlaneOptions::default()));
        assert!(words.contains("two poses of the sensor fit") && words.contains("nearer to the plate"), "{words}");
        // One profile could be wrong; three from elsewhere tell them apart.
        let extra = [[0.3, -0.2], [0.0, 0.4], [-0.3, 0.1]].map(|tilt| Look { tilt, yaw: 0.0, depth: 300.0 });
        let (mut p, mut b) = scans(rng, &c, &extra);
        profiles.append(&mut p);
        poses.append(&mut b);
        let found = solve(&profiles, &poses, &PlaneOptions::default()).unwrap();
        let e = error(&found.fit.flange_from_sensor, &c.sensor);
        assert!(e.rows(0, 3).norm() < 5.0 && e.rows(3, 3).norm() < 0.02, "{e}");
    }
}

/// A wrong pose, a line on the table beside the plate, a profile without a line: named and excluded. A profile most of
/// which lies on the table counts with its part on the plate.
#[test]
fn wrong_profiles_are_named_and_those_with_a_part_on_the_plate_are_used() {
    let rng = &mut Pcg64::seed_from_u64(5);
    let c = Cell { point_mm: 0.01, ..quiet(rng) };
    let looks = looks(rng, &c, 20, 0.7);
    let (mut profiles, mut poses) = scans(rng, &c, &looks);
    poses[7].translation += c.normal * 3.0;
    // The table lies 12 mm lower.
    let lower = |p: &mut Profile, share: usize| {
        let count = p.points.len() * share / 100;
        p.points.iter_mut().take(count).for_each(|q| q[1] += 12.0);
    };
    lower(&mut profiles[3], 100);
    lower(&mut profiles[11], 65);
    profiles[15].points.iter_mut().for_each(|q| q[1] += between(rng, -15.0, 15.0));
    let found = solve(&profiles, &poses, &PlaneOptions::default()).unwrap();
    let out: Vec<usize> = (0..20).filter(|&i| !found.fit.profiles[i].used).collect();
    assert_eq!(out, [3, 7, 15]);
    assert!(found.fit.profiles[3].mm > 8.0 && (found.fit.profiles[7].mm - 3.0).abs() < 1.2);
    assert!(found.fit.profiles[11].points[0] < 60, "{:?}", found.fit.profiles[11]);
    let e = error(&found.fit.flange_from_sensor, &c.sensor);
    let worst = (0..6).map(|i| (e[i] / found.fit.covariance[(i, i)].sqrt()).abs()).fold(0.0, f64::max);
    assert!(worst < 4.0, "{worst} sigmas");
    assert!(solve(&profiles, &poses[1..], &PlaneOptions::default()).is_err());
    profiles.iter_mut().flat_map(|p| &mut p.points).for_each(|q| q[1] += between(rng, -15.0, 15.0));
    let words = said(solve(&profiles, &poses, &PlaneOptions::default()));
    assert!(words.contains("0 of 20 profiles show a straight line") && words.contains("profile 0: "), "{words}");
}

/// The true transform beats one that is a millimetre and a degree off, and the figures say by how much.
#[test]
fn a_transform_from_elsewhere_is_judged_by_the_plate() {
    let rng = &mut Pcg64::seed_from_u64(31);
    let c = Cell { point_mm: 0.02, robot_mm: 0.02, ..quiet(rng) };
    let looks = looks(rng, &c, 16, 0.7);
    let (profiles, poses) = scans(rng, &c, &looks);
    let judged = |sensor: &Rigid<Flange, Sensor>| evaluate(&profiles, &poses, sensor, &PlaneOptions::default());
    let truth = judged(&c.sensor).unwrap();
    let off = judged(&Rigid::new(c.sensor.rotation, c.sensor.translation + Vec3::new(1.0, 0.0, 0.0))).unwrap();
    let turned = Rigid::new(exp(&Vec3::new(0.0, 0.0175, 0.0)) * c.sensor.rotation, c.sensor.translation);
    let turned = judged(&turned).unwrap();
    println!("rms: truth {:.4}, 1 mm off {:.4}, 1 degree off {:.4} mm", truth.rms, off.rms, turned.rms);
    assert!(truth.rms < 0.08 && (truth.line_rms - 0.02).abs() < 0.004, "{truth:?}");
    assert!(truth.plane.distance(&c.middle).abs() < 0.1 && truth.plane.normal.dot(&c.normal) > 0.99999);
    assert!(off.rms > 4.0 * truth.rms && turned.rms > 4.0 * truth.rms);
    // Two thirds of a profile on the table beside the plate: its part on the plate counts.
    let mut beside = profiles.clone();
    beside[4].points.iter_mut().take(105).for_each(|q| q[1] += 12.0);
    let found = evaluate(&beside, &poses, &c.sensor, &PlaneOptions::default()).unwrap();
    assert!(found.rms < 1.2 * truth.rms && found.profiles[4].1 < 60, "{found:?}");
    // Profiles of one place span no plane.
    let same = vec![profiles[0].clone(); 5];
    let words = evaluate(&same, &vec![poses[0]; 5], &c.sensor, &PlaneOptions::default()).unwrap_err().to_string();
    assert!(words.contains("along one line"), "{words}");
}

/// A scan of many profiles takes seconds, and its error is as stated.
#[test]
fn many_profiles_are_solved_in_seconds() {
    let rng = &mut Pcg64::seed_from_u64(8);
    let c = cell(rng);
    let looks = looks(rng, &c, 300, 0.7);
    let (profiles, poses) = scans(rng, &c, &looks);
    let found = solve(&profiles, &poses, &PlaneOptions::default()).unwrap();
    let e = error(&found.fit.flange_from_sensor, &c.sensor);
    let worst = (0..6).map(|i| (e[i] / found.fit.covariance[(i, i)].sqrt()).abs()).fold(0.0, f64::max);
    let robot = found.fit.robot_sigma / c.robot_mm;
    assert!(worst < 4.0 && (0.7..1.4).contains(&robot), "{worst} sigmas, {robot}, {e}");
}

/// Poses in another order: nothing is stated that is wrong.
#[test]
fn poses_that_belong_to_other_profiles_are_refused() {
    for k in 0..6 {
        let rng = &mut Pcg64::seed_from_u64(300 + k);
        let c = quiet(rng);
        let looks = looks(rng, &c, 20, 0.7);
        let (profiles, mut poses) = scans(rng, &c, &looks);
        poses.rotate_left(1 + k as usize);
        let words = said(solve(&profiles, &poses, &PlaneOptions::default()));
        assert!(words.contains("profiles and poses do not belong together"), "set {k}: {words}");
    }
}
