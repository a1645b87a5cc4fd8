//! In: random stations with a known pointer. Out: whether the beam's and the distances' errors are
//! what the report says, near the bound, and whether wrong spots are found.
//! Frame and unit: camera frame, mm, px.

mod common;

use common::judge::{Trial, between, gauss, gauss2, gauss3, judge};
use nalgebra::{DMatrix, DVector, Matrix2};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use sheetlight::calibrate::measured_pose::{SeenBoard, measure};
use sheetlight::calibrate::pointer::{PointerOptions, SpotView, solve};
use sheetlight::calibrate::pointer_range::{RIG, RigCovariance, RobotNoise, SharedCovariance, range, surface, to_base};
use sheetlight::camera::{Intrinsics, ParameterCovariance, Parameters};
use sheetlight::geometry::{Base, Board, Camera, Flange, Plane, Ray, Rigid, Vec2, Vec3, exp};

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
    let mut information = DMatrix::<f64>::zeros(4, 4);
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
        let rows = all(&[0.0; 10]).len();
        let mut j = DMatrix::<f64>::zeros(rows, 10);
        for c in 0..10 {
            let h = if c < 7 { 1e-4 } else { 1e-6 };
            let (mut a, mut b) = ([0.0; 10], [0.0; 10]);
            (a[c], b[c]) = (h, -h);
            j.set_column(c, &((all(&a) - all(&b)) / (2.0 * h)));
        }
        let h = j.transpose() * j;
        let local = h.view((4, 4), (6, 6)).into_owned().try_inverse().unwrap();
        let mixed = h.view((0, 4), (4, 6)).into_owned();
        information += h.view((0, 0), (4, 4)).into_owned() - &mixed * local * mixed.transpose();
    }
    information.try_inverse().unwrap()
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
        let found = solve(&v, &s.camera, &ParameterCovariance::zeros(), 1.0, &PointerOptions::default()).unwrap();
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
    let covariance = ParameterCovariance::from_diagonal(&sigma.map(|s| s * s));
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
        let found = solve(&v, &s.camera, &ParameterCovariance::zeros(), 1.0, &PointerOptions::default()).unwrap();
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
    let e = solve(&v, &s.camera, &ParameterCovariance::zeros(), 1.0, &PointerOptions::default()).unwrap_err();
    assert!(e.what.contains("are needed"), "{e}");
}

#[test]
fn a_surfaces_normal_comes_with_its_true_sigma() {
    let (mut tilt, mut height, n) = (0.0, 0.0, 200);
    for k in 0..n {
        let rng = &mut Pcg64::seed_from_u64(9000 + k);
        let s = station(rng, 9);
        let v = views(rng, &s, &s.camera, 0.03, 0.03);
        let found = solve(&v, &s.camera, &ParameterCovariance::zeros(), 1.0, &PointerOptions::default()).unwrap();
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
