//! In: random stations with a known pointer. Out: whether the beam's and the distances' errors are
//! what the report says, near the bound, and whether wrong spots are found.
//! Frame and unit: camera frame, mm, px.

use crate::common::judge::{Trial, between, gauss, gauss2, gauss3, information, judge};
use crate::common::sheets::{Sheet, log_between};
use nalgebra::{DMatrix, DVector, Matrix2, SMatrix};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::calibrate::limits::Asked;
use sheetlight::calibrate::measured_pose::{SeenBoard, measure, pooled_factor};
use sheetlight::calibrate::pointer::range::{
    RIG, RigCovariance, RobotNoise, SharedCovariance, range, surface, to_base,
};
use sheetlight::calibrate::pointer::report::judge as judge_pointer;
use sheetlight::calibrate::pointer::solve::{PointerFit, PointerOptions, SpotView, solve};
use sheetlight::camera::{CameraCovariance, Intrinsics, Parameters};
use sheetlight::geometry::{Base, Board, Camera, Flange, Plane, Ray, Rigid, Vec2, Vec3, exp};
use sheetlight::rig::{Verdict, Volume};
use sheetlight::solve::End;

struct Station {
    camera: Intrinsics,
    beam: Ray<Camera>,
    boards: Vec<Rigid<Camera, Board>>,
    points: Vec<Vec3>,
}

fn station(rng: &mut Pcg64, count: usize) -> Station {
    let f = between(rng, 550.0, 700.0);
    let camera = Intrinsics {
        fx: f,
        fy: f,
        cx: between(rng, 310.0, 330.0),
        cy: between(rng, 230.0, 250.0),
        skew: 0.0,
        distortion: [between(rng, -0.12, 0.0), between(rng, 0.0, 0.08), 0.0, 0.0, 0.0].into(),
        width: 640,
        height: 480,
    };
    let origin = Vec3::new(between(rng, 35.0, 45.0), gauss(rng, 6.0), between(rng, 5.0, 15.0));
    let aim = Vec3::new(gauss(rng, 2.0), gauss(rng, 4.0), between(rng, 170.0, 210.0));
    let beam = Ray::new(origin, aim - origin).unwrap();
    let points = (0..54).map(|i| Vec3::new(f64::from(i % 9) * 10.0, f64::from(i / 9) * 10.0, 0.0)).collect();
    let boards = (0..count)
        .map(|i| {
            let turn = exp(&Vec3::new(0.0, 0.0, between(rng, -0.4, 0.4)))
                * exp(&Vec3::new(between(rng, -0.4, 0.4), between(rng, -0.4, 0.4), 0.0));
            let z = 120.0 + 160.0 * i as f64 / (count - 1) as f64 + gauss(rng, 4.0);
            Rigid::new(turn, Vec3::new(gauss(rng, 5.0), gauss(rng, 5.0), z) - turn * Vec3::new(40.0, 25.0, 0.0))
        })
        .collect();
    Station { camera, beam, boards, points }
}

fn spot(camera: &Intrinsics, beam: &Ray<Camera>, pose: &Rigid<Camera, Board>) -> Vec2 {
    let n: Vec3 = pose.rotation.column(2).into();
    let s = (n.dot(&pose.translation) - n.dot(&beam.origin)) / n.dot(&beam.direction);
    camera.pixel_from_point(&beam.at(s)).unwrap()
}

fn views(rng: &mut Pcg64, s: &Station, believed: &Intrinsics, corner_px: f64, spot_px: f64) -> Vec<SpotView> {
    s.boards
        .iter()
        .enumerate()
        .map(|(i, pose)| {
            let pixels = s
                .points
                .iter()
                .map(|p| s.camera.pixel_from_point(&pose.point(p)).unwrap() + gauss2(rng, corner_px))
                .collect();
            let seen = SeenBoard {
                name: format!("picture {i}"),
                points: s.points.clone(),
                pixels,
                sigmas_px: vec![corner_px; s.points.len()],
            };
            SpotView {
                pose: measure(&seen, believed, pose).unwrap(),
                pixel: spot(&s.camera, &s.beam, pose) + gauss2(rng, spot_px),
                covariance: Matrix2::identity() * spot_px * spot_px,
            }
        })
        .collect()
}

/// Where a beam crosses two depths: four numbers that mean the same for every way of writing it.
fn four(beam: &Ray<Camera>) -> DVector<f64> {
    let at = |z: f64| beam.at((z - beam.origin.z) / beam.direction.z);
    let (a, b) = (at(120.0), at(280.0));
    DVector::from_vec(vec![a.x, a.y, b.x, b.y])
}

/// d(four)/d(ox oy oz dx dy dz), numerically.
fn four_by_beam(beam: &Ray<Camera>) -> DMatrix<f64> {
    let mut j = DMatrix::zeros(4, 6);
    for c in 0..6 {
        let at = |h: f64| {
            let mut v =
                [beam.origin.x, beam.origin.y, beam.origin.z, beam.direction.x, beam.direction.y, beam.direction.z];
            v[c] += h;
            four(&Ray::new(Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5])).unwrap())
        };
        j.set_column(c, &((at(1e-5) - at(-1e-5)) / 2e-5));
    }
    j
}

/// Cramer-Rao bound of the four numbers with all board poses free, by numerical derivatives.
fn bound(s: &Station, corner_px: f64, spot_px: f64) -> DMatrix<f64> {
    let truth = four(&s.beam);
    let mut said = DMatrix::<f64>::zeros(4, 4);
    for pose in &s.boards {
        let all = |d: &[f64; 10]| {
            let a = Vec3::new(truth[0] + d[0], truth[1] + d[1], 120.0);
            let b = Vec3::new(truth[2] + d[2], truth[3] + d[3], 280.0);
            let beam = Ray::new(a, b - a).unwrap();
            let turn = exp(&Vec3::new(d[7], d[8], d[9]));
            let pose: Rigid<Camera, Board> =
                Rigid::new(turn * pose.rotation, turn * pose.translation + Vec3::new(d[4], d[5], d[6]));
            let mut r: Vec<f64> = Vec::new();
            for p in &s.points {
                let q = s.camera.pixel_from_point(&pose.point(p)).unwrap() / corner_px;
                r.extend([q.x, q.y]);
            }
            let q = spot(&s.camera, &beam, &pose) / spot_px;
            r.extend([q.x, q.y]);
            DVector::from_vec(r)
        };
        said += information(all, |c| if c < 7 { 1e-4 } else { 1e-6 }, 4);
    }
    said.try_inverse().unwrap()
}

#[test]
fn errors_are_what_the_report_says_and_near_the_bound() {
    let levels = [(0.02, 0.02), (0.05, 0.05), (0.1, 0.03), (0.02, 0.2)];
    let make = |k: u64, level: usize| {
        let s = station(&mut Pcg64::seed_from_u64(100 + k), 9);
        let b = bound(&s, levels[level].0, levels[level].1);
        (s, b, levels[level])
    };
    let names = ["x_at_120_mm", "y_at_120_mm", "x_at_280_mm", "y_at_280_mm"];
    judge("pointer", &names, levels.len(), make, |(s, bound, (corner, px)), rng| {
        let v = views(rng, s, &s.camera, *corner, *px);
        let found = solve(&v, &s.camera, &CameraCovariance::exact(), 1.0, &PointerOptions::default()).unwrap();
        let j = four_by_beam(&found.beam);
        let c = &j * found.covariance.view((0, 0), (6, 6)) * j.transpose();
        Trial::new(four(&found.beam) - four(&s.beam), &c, bound)
    });
}

/// Distances from a beam that was calibrated with the same wrong camera: the two errors belong together.
#[test]
fn distances_come_with_their_true_sigmas() {
    // Brown-Conrady's parameters, and of the others k4, s1 and the sensor's tilt.
    let sigma = Parameters::from([
        0.3, 0.3, 0.2, 0.2, 1e-3, 1e-3, 1e-4, 1e-4, 1e-3, 5e-4, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-3, 1e-3, 0.0,
    ]);
    let covariance = CameraCovariance::independent(&sigma).unwrap();
    let depths = [80.0, 120.0, 180.0, 240.0, 290.0];
    let mut over = [0.0; 5];
    for k in 0..200 {
        let rng = &mut Pcg64::seed_from_u64(4000 + k);
        let s = station(rng, 9);
        let believed = s.camera.changed(&Parameters::from_fn(|i, _| gauss(rng, sigma[i])));
        let v = views(rng, &s, &believed, 0.03, 0.03);
        let found = solve(&v, &believed, &covariance, 1.0, &PointerOptions::default()).unwrap();
        let joint = RigCovariance::from_fn(|i, j| found.covariance[(i, j)]);
        for (i, z) in depths.iter().enumerate() {
            let p = s.beam.at((z - s.beam.origin.z) / s.beam.direction.z);
            let pixel = s.camera.pixel_from_point(&p).unwrap() + gauss2(rng, 0.03);
            let r = range(&pixel, &(Matrix2::identity() * 9e-4), &believed, &found.beam, &joint).unwrap();
            over[i] += ((r.along_axis - z) / r.along_axis_sigma).powi(2) / 200.0;
        }
    }
    let over = over.map(f64::sqrt);
    println!("distance error over sigma at {depths:?} mm: {over:.3?}");
    assert!(over.iter().all(|x| (0.8..=1.25).contains(x)), "{over:?}");
}

#[test]
fn a_wrong_spot_is_named() {
    for k in 0..30 {
        let rng = &mut Pcg64::seed_from_u64(600 + k);
        let s = station(rng, 9);
        let mut v = views(rng, &s, &s.camera, 0.03, 0.03);
        let bad = k as usize % 9;
        v[bad].pixel += if k % 2 == 0 { Vec2::new(25.0, -8.0) } else { Vec2::new(0.5, 0.5) };
        let found = solve(&v, &s.camera, &CameraCovariance::exact(), 1.0, &PointerOptions::default()).unwrap();
        let out: Vec<usize> = (0..9).filter(|&i| !found.spots[i].used).collect();
        assert_eq!(out, [bad], "seed {k}: {:?}", found.spots.iter().map(|s| s.distance2).collect::<Vec<_>>());
    }
}

#[test]
fn spots_in_one_place_are_refused() {
    let rng = &mut Pcg64::seed_from_u64(3);
    let mut s = station(rng, 9);
    for b in &mut s.boards {
        b.translation.z += 200.0 - b.point(&Vec3::new(40.0, 25.0, 0.0)).z;
    }
    let v = views(rng, &s, &s.camera, 0.03, 0.03);
    let e = solve(&v, &s.camera, &CameraCovariance::exact(), 1.0, &PointerOptions::default()).unwrap_err();
    assert!(e.what.contains("are needed"), "{e}");
}

#[test]
fn a_surfaces_normal_comes_with_its_true_sigma() {
    let (mut tilt, mut height, n) = (0.0, 0.0, 200);
    for k in 0..n {
        let rng = &mut Pcg64::seed_from_u64(9000 + k);
        let s = station(rng, 9);
        let v = views(rng, &s, &s.camera, 0.03, 0.03);
        let found = solve(&v, &s.camera, &CameraCovariance::exact(), 1.0, &PointerOptions::default()).unwrap();
        let joint = RigCovariance::from_fn(|i, j| found.covariance[(i, j)]);
        let hand_eye: Rigid<Flange, Camera> = Rigid::from_vectors(&gauss3(rng, 1.0), gauss3(rng, 60.0));
        let mut shared = SharedCovariance::zeros();
        shared.fixed_view_mut::<RIG, RIG>(0, 0).copy_from(&joint);
        let noise = [0.02, 0.02, 0.02, 1e-4, 1e-4, 1e-4];
        (0..6).for_each(|i| shared[(RIG + i, RIG + i)] = noise[i] * noise[i]);
        let d: [f64; 6] = std::array::from_fn(|i| gauss(rng, noise[i]));
        let believed = Rigid::<Flange, Camera>::new(
            exp(&Vec3::new(d[3], d[4], d[5])) * hand_eye.rotation,
            hand_eye.translation + Vec3::new(d[0], d[1], d[2]),
        );
        let normal = gauss3(rng, 1.0).normalize();
        let truth = Plane::<Base>::new(normal, between(rng, -50.0, 50.0)).unwrap();
        let robot = RobotNoise { mm: 0.03, rad: 1e-4 };
        let points: Vec<_> = (0..5)
            .map(|i| {
                // The camera looks at the surface from 190 mm, turned about its normal.
                let across = normal.cross(&Vec3::new(0.3, 0.5, -0.8)).normalize();
                let look = exp(&(normal * (f64::from(i) * 1.2)))
                    * nalgebra::Matrix3::from_columns(&[across, (-normal).cross(&across), -normal]);
                let place = truth.normal * (truth.offset + between(rng, 170.0, 210.0))
                    + look * Vec3::new(gauss(rng, 20.0), gauss(rng, 20.0), 0.0);
                let base_from_camera: Rigid<Base, Camera> = Rigid::new(look, place);
                let in_camera = base_from_camera.inverse().plane(&truth);
                let pixel = s.camera.pixel_from_point(&s.beam.meet(&in_camera).unwrap()).unwrap() + gauss2(rng, 0.03);
                let r = range(&pixel, &(Matrix2::identity() * 9e-4), &s.camera, &found.beam, &joint).unwrap();
                let true_pose = base_from_camera * hand_eye.inverse();
                let read = Rigid::<Base, Flange>::new(
                    exp(&gauss3(rng, robot.rad)) * true_pose.rotation,
                    true_pose.translation + gauss3(rng, robot.mm),
                );
                to_base(&r, &read, &believed, &shared, &robot)
            })
            .collect();
        let found = surface(&points, &shared, &Vec3::x()).unwrap();
        assert_eq!(found.left_out, None, "seed {k}: misfit {}", found.misfit);
        if k == 0 {
            // The corners of a pentagon, one spot 2 mm over an edge: it is left out, and the plane is the others'.
            let (along, foot) = (normal.cross(&Vec3::new(0.3, 0.5, -0.8)).normalize(), normal * truth.offset);
            let mut edge = points.clone();
            for (i, p) in edge.iter_mut().enumerate() {
                p.point = foot + exp(&(normal * (1.2566 * i as f64))) * along * 30.0;
            }
            edge[2].point -= normal * 2.0;
            let without = surface(&edge, &shared, &Vec3::x()).unwrap();
            assert_eq!(without.left_out, Some(2), "misfit {}", without.misfit);
            assert!(without.normal.cross(&normal).norm() < 1e-4);
            // Four cannot tell which of them is wrong, but the sigma says that one is.
            let four = surface(&edge[1..], &shared, &Vec3::x()).unwrap();
            assert!(four.left_out.is_none() && four.tilt_sigma[0] > 2.0 * without.tilt_sigma[0], "{four:?}");
        }
        let off = found.normal.cross(&normal).norm();
        tilt += off * off / (found.tilt_sigma[0].powi(2) + found.tilt_sigma[1].powi(2));
        height += (truth.distance(&found.centre) / found.height_sigma).powi(2);
        let z: Vec3 = found.base_from_tool.rotation.column(2).into();
        assert!(z.dot(&normal) > 0.999, "the tool's z points out of the surface");
    }
    let (tilt, height) = ((tilt / n as f64).sqrt(), (height / n as f64).sqrt());
    println!("normal {tilt:.3}, height {height:.3} of sigma");
    assert!((0.8..=1.25).contains(&tilt) && (0.8..=1.25).contains(&height), "normal {tilt}, height {height}");
}

/// A station of any size, the beam on any side of the camera and tilted, its boards along the beam.
fn any_station(rng: &mut Pcg64, count: usize) -> Station {
    let one = Sheet::random(rng, 1);
    let (camera, depth) = (one.camera, one.pixel_mm * one.camera.fx);
    let view = camera.view_mm(depth);
    let (side, baseline) = (between(rng, 0.0, std::f64::consts::TAU), depth * between(rng, 0.1, 0.6));
    let origin = Vec3::new(side.cos() * baseline, side.sin() * baseline, depth * between(rng, -0.2, 0.3));
    let aim = Vec3::new(gauss(rng, 0.05 * view), gauss(rng, 0.05 * view), depth);
    let beam = Ray::new(origin, aim - origin).unwrap();
    let square = view * between(rng, 0.03, 0.07);
    let points = (0..54).map(|i| Vec3::new(f64::from(i % 9), f64::from(i / 9), 0.0) * square).collect();
    let range = log_between(rng, 0.05, 0.4);
    let boards = (0..count)
        .map(|_| {
            let place = loop {
                let z = depth * (1.0 + range * between(rng, -1.0, 1.0));
                let p = beam.at((z - beam.origin.z) / beam.direction.z);
                let q = camera.pixel_from_point(&p).unwrap();
                let inside = |v: f64, size: u32| (0.05..0.95).contains(&(v / f64::from(size)));
                if inside(q.x, camera.width) && inside(q.y, camera.height) {
                    break p;
                }
            };
            let tilt = exp(&Vec3::new(between(rng, -0.4, 0.4), between(rng, -0.4, 0.4), 0.0));
            let turn = exp(&Vec3::new(0.0, 0.0, between(rng, -3.0, 3.0))) * tilt;
            let middle = Vec3::new(between(rng, 2.0, 6.0), between(rng, 1.0, 4.0), 0.0) * square;
            Rigid::new(turn, place - turn * middle)
        })
        .collect();
    Station { camera, beam, boards, points }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Wrong {
    Nothing,
    /// Boards moved between their two pictures.
    Moved,
    /// Another place is brighter than the spot: a reflection.
    Reflected,
    /// The last pictures are of another camera and pointer.
    OtherRig,
    /// Saturated or clipped spots: centres off by more than their sigmas say.
    Saturated,
}

const WRONGS: [Wrong; 5] = [Wrong::Nothing, Wrong::Moved, Wrong::Reflected, Wrong::OtherRig, Wrong::Saturated];

/// Verdict, the beam's error and stated sigma over the boards (mm), and of distances their errors over their sigmas.
type Judged = (Option<Verdict>, f64, f64, Vec<f64>);

fn judged(seed: u64, wrong: Wrong, count: usize) -> Judged {
    let rng = &mut Pcg64::seed_from_u64(seed);
    let s = any_station(rng, count);
    let (corner, px) = (log_between(rng, 0.02, 0.15), log_between(rng, 0.02, 0.2));
    let mut v = views(rng, &s, &s.camera, corner, px);
    let (size, share) = (log_between(rng, 0.5, 100.0), between(rng, 0.1, 0.5));
    let other = Station {
        camera: Intrinsics {
            fx: s.camera.fx * between(rng, 0.97, 1.03),
            cx: s.camera.cx + gauss(rng, 8.0),
            ..s.camera
        },
        beam: {
            let mm = size * s.beam.origin.norm() / s.camera.fx;
            Ray::new(s.beam.origin + gauss3(rng, mm), s.beam.direction + gauss3(rng, 0.02)).unwrap()
        },
        boards: s.boards.clone(),
        points: s.points.clone(),
    };
    let others = (wrong == Wrong::OtherRig).then(|| views(rng, &other, &s.camera, corner, px));
    for i in 0..count {
        match wrong {
            Wrong::Nothing => {}
            Wrong::OtherRig if i as f64 >= (1.0 - share) * count as f64 => {
                v[i].clone_from(&others.as_ref().unwrap()[i]);
            }
            Wrong::Moved | Wrong::Reflected if rng.random::<f64>() < share => {
                let size = if wrong == Wrong::Moved { size.min(20.0) } else { 2.0 * size };
                v[i].pixel += gauss2(rng, size);
            }
            Wrong::Saturated => v[i].pixel += gauss2(rng, 0.1 * size.min(20.0)),
            _ => {}
        }
    }
    let factor = pooled_factor(v.iter().map(|v| &v.pose)).unwrap_or(f64::NAN);
    let Ok(fit) = solve(&v, &s.camera, &CameraCovariance::exact(), factor, &PointerOptions::default()) else {
        return (None, 0.0, 0.0, vec![]);
    };
    let lay = Volume::new(fit.reach[0], fit.reach[1], "where the spots lay");
    let said =
        |fit: &PointerFit| judge_pointer(fit, &s.camera, px, &Asked::default().limits(&lay, |z| s.camera.view_mm(z)));
    let quality = said(&fit);
    let hasty = said(&PointerFit { end: End::Exhausted, ..fit.clone() });
    assert_eq!(hasty.verdict, quality.verdict.max(Verdict::Usable), "a fit that did not converge");
    assert!(hasty.reasons.iter().any(|r| r.contains("did not converge")), "{:?}", hasty.reasons);
    let c = fit.covariance.view((0, 0), (6, 6)).into_owned();
    let at = |b: &Ray<Camera>, z: f64| b.at((z - b.origin.z) / b.direction.z);
    let (mut error, mut variance) = (0.0, 0.0);
    for b in &s.boards {
        let z = b.point(&Vec3::zeros()).z;
        error += (at(&fit.beam, z) - at(&s.beam, z)).norm_squared() / count as f64;
        let o = fit.beam.origin;
        let d = fit.beam.direction;
        let t = (z - o.z) / d.z;
        // Of the crossing's x and y by origin and direction.
        let j = SMatrix::<f64, 2, 6>::from_row_slice(&[
            1.0,
            0.0,
            -d.x / d.z,
            t,
            0.0,
            -t * d.x / d.z,
            0.0,
            1.0,
            -d.y / d.z,
            0.0,
            t,
            -t * d.y / d.z,
        ]);
        variance += (j * SMatrix::<f64, 6, 6>::from_fn(|i, k| c[(i, k)]) * j.transpose()).trace() / count as f64;
    }
    let joint = RigCovariance::from_fn(|i, j| fit.covariance[(i, j)]);
    let ranged = (0..3)
        .map(|i| {
            let z = fit.reach[0] + (fit.reach[1] - fit.reach[0]) * f64::from(i) / 2.0;
            let pixel = s.camera.pixel_from_point(&at(&s.beam, z)).unwrap() + gauss2(rng, px);
            let r = range(&pixel, &(Matrix2::identity() * px * px), &s.camera, &fit.beam, &joint).unwrap();
            (r.along_axis - z) / r.along_axis_sigma
        })
        .collect();
    (Some(quality.verdict), error.sqrt(), variance.sqrt(), ranged)
}

#[test]
fn a_flawed_set_never_passes_with_an_error_above_three_sigmas() {
    let each = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 300 } else { 60 };
    let mut wrong_ones = Vec::new();
    for wrong in WRONGS {
        let all: Vec<(u64, usize, Judged)> = (0..each)
            .into_par_iter()
            .map(|k| {
                let (seed, count) = (20_000 + 1000 * wrong as u64 + k, 3 + (k as usize * 7) % 12);
                (seed, count, judged(seed, wrong, count))
            })
            .collect();
        let passed: Vec<_> = all.iter().filter(|a| a.2.0.is_some_and(|v| v <= Verdict::Usable)).collect();
        let rms = |x: &[f64]| (x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64).sqrt();
        let over: Vec<f64> = passed.iter().map(|a| a.2.1 / a.2.2).collect();
        let ranged: Vec<f64> = passed.iter().filter(|a| a.1 >= 7).flat_map(|a| a.2.3.iter().copied()).collect();
        println!(
            "{wrong:?}: {} of {} passed, error over sigma rms {:.2}, worst {:.2}; distances of 7 spots and more {:.2}",
            passed.len(),
            all.len(),
            rms(&over),
            over.iter().copied().fold(0.0, f64::max),
            rms(&ranged)
        );
        wrong_ones.extend(
            passed
                .iter()
                .filter(|a| a.2.1 > 3.0 * a.2.2)
                .map(|a| format!("{wrong:?}, {} spots, seed {}: {:.4} mm of {:.4}", a.1, a.0, a.2.1, a.2.2)),
        );
        if wrong == Wrong::Nothing {
            let many = all.iter().filter(|a| a.1 >= 6).count();
            let taken = passed.iter().filter(|a| a.1 >= 6).count();
            assert!(taken as f64 >= 0.9 * many as f64, "{taken} of {many} sound sets were taken");
            assert!((0.8..=1.25).contains(&rms(&ranged)), "distances: {:.2} of their sigmas", rms(&ranged));
        }
    }
    assert!(wrong_ones.is_empty(), "{wrong_ones:#?}");
}
