//! In: random stations with a known laser plane. Out: whether the calibration's errors are what it
//! says they are, near the bound, and whether wrong pictures and reflections are found.
//! Frame and unit: camera frame, mm, px.

use crate::common::judge::{Trial, between, gauss, information, judge};
use crate::common::sheets::{FLAWS, Flaw, Sheet, set};
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::calibrate::laser_plane::options::LaserPlaneOptions;
use sheetlight::calibrate::laser_plane::report::judge as judge_plane;
use sheetlight::calibrate::laser_plane::solve::{LaserPlaneFit, PeakUse, solve};
use sheetlight::calibrate::laser_plane::views::StripePeak;
use sheetlight::calibrate::laser_plane::views::StripeView;
use sheetlight::calibrate::limits::Asked;
use sheetlight::calibrate::measured_pose::{SeenBoard, measure, pooled_factor};
use sheetlight::camera::{CameraCovariance, Intrinsics, Parameters};
use sheetlight::geometry::{Board, Camera, Plane, Rigid, Vec2, Vec3, exp};
use sheetlight::recording::BoardSpec;
use sheetlight::rig::{Verdict, Volume};
use sheetlight::solve::End;

struct Station {
    camera: Intrinsics,
    plane: Plane<Camera>,
    boards: Vec<Rigid<Camera, Board>>,
    spec: BoardSpec,
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
    let normal = Vec3::new(gauss(rng, 0.03), 0.88 + gauss(rng, 0.02), 0.47 + gauss(rng, 0.02)).normalize();
    let plane = Plane::new(normal, normal.z * between(rng, 145.0, 165.0)).unwrap();
    let spec =
        BoardSpec::Chessboard { inner_corners: [9, 6], square_mm: 10.0, border_mm: 7.0, first_square: "black".into() };
    let boards = (0..count)
        .map(|_| {
            let turn = exp(&Vec3::new(0.0, 0.0, between(rng, -0.3, 0.3)))
                * exp(&Vec3::new(between(rng, -0.5, 0.5), between(rng, -0.5, 0.5), 0.0));
            let z = between(rng, 120.0, 210.0);
            let y = (plane.offset - plane.normal.z * z) / plane.normal.y;
            Rigid::new(turn, Vec3::new(gauss(rng, 4.0), y + gauss(rng, 5.0), z) - turn * Vec3::new(40.0, 25.0, 0.0))
        })
        .collect();
    Station { camera, plane, boards, spec }
}

/// The stripe's true pixels on a board, one a pixel or so.
fn stripe(s: &Station, plane: &Plane<Camera>, pose: &Rigid<Camera, Board>) -> Vec<Vec2> {
    let normal: Vec3 = pose.rotation.column(2).into();
    let along = plane.normal.cross(&normal).normalize();
    let m = nalgebra::Matrix3::from_rows(&[plane.normal.transpose(), normal.transpose(), along.transpose()]);
    let foot = m.try_inverse().unwrap() * Vec3::new(plane.offset, normal.dot(&pose.translation), 0.0);
    let middle = foot + along * along.dot(&(pose.translation - foot));
    (-200..=200)
        .filter_map(|k| {
            let p = middle + along * (f64::from(k) * 0.6);
            let q = s.camera.pixel_from_point(&p)?;
            ((0.0..639.0).contains(&q.x) && (0.0..479.0).contains(&q.y)).then_some(q)
        })
        .collect()
}

fn views(rng: &mut Pcg64, s: &Station, believed: &Intrinsics, corner_px: f64, peak_px: f64) -> Vec<StripeView> {
    let points = s.spec.features();
    s.boards
        .iter()
        .enumerate()
        .map(|(i, pose)| {
            let pixels = points
                .iter()
                .map(|p| {
                    s.camera.pixel_from_point(&pose.point(p)).unwrap()
                        + Vec2::new(gauss(rng, corner_px), gauss(rng, corner_px))
                })
                .collect();
            let seen = SeenBoard {
                name: format!("picture {i}"),
                points: points.clone(),
                pixels,
                sigmas_px: vec![1.0; points.len()],
            };
            let peaks = stripe(s, &s.plane, pose)
                .into_iter()
                .map(|p| StripePeak {
                    pixel: p + Vec2::new(gauss(rng, peak_px), gauss(rng, peak_px)),
                    sigma_px: peak_px,
                    width_px: 1.3,
                })
                .collect();
            StripeView { pose: measure(&seen, believed, pose).unwrap(), board: s.spec.clone(), peaks }
        })
        .collect()
}

fn run(
    s: &Station,
    v: &[StripeView],
    covariance: &CameraCovariance,
    corner_px: f64,
) -> sheetlight::fault::Result<LaserPlaneFit> {
    solve(v, &s.camera, covariance, corner_px, &LaserPlaneOptions::default())
}

/// Two directions of tilt and the offset: the three numbers that a plane has.
fn three(truth: &Plane<Camera>) -> DMatrix<f64> {
    let a = truth.normal.cross(&Vec3::x()).normalize();
    let b = truth.normal.cross(&a);
    DMatrix::from_row_slice(3, 4, &[a.x, a.y, a.z, 0.0, b.x, b.y, b.z, 0.0, 0.0, 0.0, 0.0, 1.0])
}

fn error(found: &Plane<Camera>, truth: &Plane<Camera>) -> DVector<f64> {
    let n = found.normal - truth.normal;
    three(truth) * DVector::from_vec(vec![n.x, n.y, n.z, found.offset - truth.offset])
}

/// Cramer-Rao bound of plane and all board poses together from corner and peak pixels, by numerical
/// derivatives of the predicted pixels.
fn bound(s: &Station, fit: &LaserPlaneFit, corner_px: f64, peak_px: f64) -> DMatrix<f64> {
    let t = three(&s.plane);
    let mut said = DMatrix::<f64>::zeros(3, 3);
    let points = s.spec.features();
    for (v, pose) in s.boards.iter().enumerate() {
        let moved = |d: &[f64; 9]| {
            let n = s.plane.normal
                + Vec3::new(t[(0, 0)], t[(0, 1)], t[(0, 2)]) * d[0]
                + Vec3::new(t[(1, 0)], t[(1, 1)], t[(1, 2)]) * d[1];
            let plane = Plane::<Camera>::new(n.normalize(), s.plane.offset + d[2]).unwrap();
            let turn = exp(&Vec3::new(d[6], d[7], d[8]));
            let pose: Rigid<Camera, Board> =
                Rigid::new(turn * pose.rotation, turn * pose.translation + Vec3::new(d[3], d[4], d[5]));
            (plane, pose)
        };
        let truth_pixels = stripe(s, &s.plane, pose);
        let corners = |d: &[f64; 9]| -> Vec<f64> {
            let (_, pose) = moved(d);
            points
                .iter()
                .flat_map(|p| {
                    let q = s.camera.pixel_from_point(&pose.point(p)).unwrap() / corner_px;
                    [q.x, q.y]
                })
                .collect()
        };
        // A peak's residual is its pixel distance from the predicted stripe: linear interpolation
        // between the predicted points nearest to it.
        let across = |d: &[f64; 9]| -> Vec<f64> {
            let (plane, pose) = moved(d);
            let line = stripe(s, &plane, &pose);
            truth_pixels
                .iter()
                .zip(&fit.uses[v])
                .filter(|(_, u)| **u == PeakUse::Used)
                .map(|(p, _)| {
                    let i = (0..line.len())
                        .min_by(|&a, &b| (line[a] - p).norm().total_cmp(&(line[b] - p).norm()))
                        .unwrap()
                        .clamp(1, line.len() - 2);
                    let along = (line[i + 1] - line[i - 1]).normalize();
                    let q = p - line[i];
                    (along.x * q.y - along.y * q.x) / peak_px
                })
                .collect()
        };
        let all = |d: &[f64; 9]| {
            let mut r = corners(d);
            r.extend(across(d));
            DVector::from_vec(r)
        };
        said += information(all, |c| if c == 2 || (3..6).contains(&c) { 1e-3 } else { 1e-5 }, 3);
    }
    said.try_inverse().unwrap()
}

#[test]
fn errors_are_what_the_report_says_and_near_the_bound() {
    let levels = [(0.02, 0.03), (0.05, 0.05), (0.1, 0.05), (0.03, 0.2)];
    let make = |k: u64, level: usize| {
        let (corner, peak) = levels[level];
        let rng = &mut Pcg64::seed_from_u64(100 + k);
        let s = station(rng, 10);
        let exact = views(rng, &s, &s.camera, 1e-6, 1e-6);
        let used = run(&s, &exact, &CameraCovariance::exact(), 1e-6).unwrap();
        let b = bound(&s, &used, corner, peak);
        (s, b, corner, peak)
    };
    judge("laser plane", &["tilt_1", "tilt_2", "offset_mm"], levels.len(), make, |(s, bound, corner, peak), rng| {
        let found = run(s, &views(rng, s, &s.camera, *corner, *peak), &CameraCovariance::exact(), *corner).unwrap();
        assert!(found.views.iter().all(|v| v.used), "good pictures were left out");
        let c = three(&s.plane) * &found.covariance * three(&s.plane).transpose();
        Trial::new(error(&found.plane, &s.plane), &c, bound)
    });
}

#[test]
fn the_cameras_uncertainty_reaches_the_report() {
    // Brown-Conrady's parameters, and of the others k4, s1 and the sensor's tilt.
    let sigma = Parameters::from([
        0.3, 0.3, 0.2, 0.2, 1e-3, 1e-3, 1e-4, 1e-4, 1e-3, 5e-4, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-3, 1e-3, 0.0,
    ]);
    let covariance = CameraCovariance::independent(&sigma).unwrap();
    let (mut over, mut exact) = ([0.0; 3], [0.0; 3]);
    for k in 0..100 {
        let rng = &mut Pcg64::seed_from_u64(900 + k);
        let s = station(rng, 10);
        let believed = s.camera.changed(&Parameters::from_fn(|i, _| gauss(rng, sigma[i])));
        let v = views(rng, &s, &believed, 0.03, 0.05);
        let found = solve(&v, &believed, &covariance, 0.03, &LaserPlaneOptions::default()).unwrap();
        let e = error(&found.plane, &s.plane);
        let t = three(&s.plane);
        let (c, x) = (&t * &found.covariance * t.transpose(), &t * &found.covariance_camera_exact * t.transpose());
        for i in 0..3 {
            over[i] += e[i] * e[i] / c[(i, i)] / 100.0;
            exact[i] += e[i] * e[i] / x[(i, i)] / 100.0;
        }
    }
    let over = over.map(f64::sqrt);
    println!("with the camera's part {over:.3?}, without {:.2?}", exact.map(f64::sqrt));
    assert!(over.iter().all(|x| (0.8..=1.25).contains(x)), "{over:?}");
    assert!(exact.iter().sum::<f64>().sqrt() > 5.0, "the test must be able to fail");
}

#[test]
fn a_board_that_moved_between_its_two_pictures_is_named() {
    for k in 0..20 {
        let rng = &mut Pcg64::seed_from_u64(300 + k);
        let s = station(rng, 10);
        let mut v = views(rng, &s, &s.camera, 0.03, 0.05);
        let bad = k as usize % 10;
        let mut shifted = s.boards[bad];
        shifted.translation += Vec3::new(0.0, 0.0, if k % 2 == 0 { 2.0 } else { 0.3 });
        v[bad].peaks = stripe(&s, &s.plane, &shifted)
            .into_iter()
            .map(|p| StripePeak { pixel: p + Vec2::new(0.0, gauss(rng, 0.05)), sigma_px: 0.05, width_px: 1.3 })
            .collect();
        let found = run(&s, &v, &CameraCovariance::exact(), 0.03).unwrap();
        let out: Vec<usize> = (0..10).filter(|&i| !found.views[i].used).collect();
        assert_eq!(out, [bad], "seed {k}");
        let e = error(&found.plane, &s.plane);
        let c = three(&s.plane) * &found.covariance * three(&s.plane).transpose();
        assert!((0..3).all(|i| e[i].abs() < 4.5 * c[(i, i)].sqrt()), "seed {k}: {e}");
    }
}

#[test]
fn reflections_on_and_beside_the_board_do_not_enter() {
    let rng = &mut Pcg64::seed_from_u64(5);
    let s = station(rng, 8);
    let mut v = views(rng, &s, &s.camera, 0.03, 0.05);
    let clean = run(&s, &v, &CameraCovariance::exact(), 0.03).unwrap();
    for view in &mut v {
        let wrong: Vec<StripePeak> = (0..80)
            .map(|_| StripePeak {
                pixel: Vec2::new(between(rng, 5.0, 634.0), between(rng, 5.0, 474.0)),
                sigma_px: 0.05,
                width_px: 1.3,
            })
            .collect();
        view.peaks.extend(wrong);
    }
    let found = run(&s, &v, &CameraCovariance::exact(), 0.03).unwrap();
    assert!(found.views.iter().all(|v| v.used));
    let e = error(&found.plane, &clean.plane);
    let c = three(&s.plane) * &clean.covariance * three(&s.plane).transpose();
    assert!((0..3).all(|i| e[i].abs() < 0.7 * c[(i, i)].sqrt()), "{e}");
}

/// Light that an edge of the print or a hot pixel moved by a part of a pixel, eight of its sigmas, in a piece of each
/// stripe: it is left out, and is no second plane.
#[test]
fn moved_pieces_of_the_stripe_are_no_second_plane() {
    let rng = &mut Pcg64::seed_from_u64(7);
    let s = station(rng, 8);
    let mut v = views(rng, &s, &s.camera, 0.03, 0.05);
    for view in &mut v {
        let middle = view.peaks.len() / 2;
        view.peaks[middle..middle + 15].iter_mut().for_each(|p| p.pixel.y += 0.4);
    }
    let found = run(&s, &v, &CameraCovariance::exact(), 0.03).unwrap();
    let left_out = found.uses.iter().flatten().filter(|u| **u != PeakUse::Used).count();
    assert!(left_out >= 100, "{left_out} of 120 moved peaks were left out");
    assert!(found.second.is_none(), "{:?}", found.second);
}

#[test]
fn stripes_on_one_line_are_refused() {
    let rng = &mut Pcg64::seed_from_u64(6);
    let mut s = station(rng, 5);
    let one = s.boards[0];
    s.boards.iter_mut().for_each(|b| *b = one);
    let v = views(rng, &s, &s.camera, 0.03, 0.05);
    match run(&s, &v, &CameraCovariance::exact(), 0.03) {
        Err(_) => {}
        Ok(f) => assert!(f.depth_spread < 0.5 && f.board_spread < 0.01, "depth {} mm", f.depth_spread),
    }
}

/// One calibration of a random station: what it was called, and the plane's error and stated sigma over the boards, mm.
struct Called {
    flaw: Flaw,
    count: usize,
    seed: u64,
    verdict: Option<Verdict>,
    error: f64,
    sigma: f64,
    says: Vec<String>,
}

fn call(seed: u64, flaw: Flaw) -> Called {
    let rng = &mut Pcg64::seed_from_u64(seed);
    let count = rng.random_range(1..=14);
    let s = Sheet::random(rng, count);
    let views = set(rng, &s, flaw);
    let refused = Called { flaw, count, seed, verdict: None, error: 0.0, sigma: 0.0, says: Vec::new() };
    let factor = pooled_factor(views.iter().map(|v| &v.pose)).unwrap_or(f64::NAN);
    let Ok(fit) = solve(&views, &s.camera, &CameraCovariance::exact(), factor, &LaserPlaneOptions::default()) else {
        return refused;
    };
    let lit = Volume::new(fit.reach[0], fit.reach[1], "where the boards were lit");
    let said = |fit: &LaserPlaneFit| {
        judge_plane(fit, &views, &s.camera, &Asked::default().limits(&lit, |z| s.camera.view_mm(z)))
    };
    let quality = said(&fit);
    let hasty = said(&LaserPlaneFit { end: End::Exhausted, ..fit.clone() });
    assert_eq!(hasty.verdict, quality.verdict.max(Verdict::Usable), "a fit that did not converge");
    assert!(hasty.reasons.iter().any(|r| r.contains("did not converge")), "{:?}", hasty.reasons);
    let places: Vec<Vec3> = s.boards.iter().flat_map(|b| s.line(&s.plane, b, 9)).collect();
    let mean = |of: &dyn Fn(&Vec3) -> f64| (places.iter().map(of).sum::<f64>() / places.len() as f64).sqrt();
    let variance = |p: &Vec3| {
        let u = DVector::from_vec(vec![p.x, p.y, p.z, -1.0]);
        (&fit.covariance * &u).dot(&u)
    };
    Called {
        verdict: Some(quality.verdict),
        error: mean(&|p| fit.plane.distance(p).powi(2)),
        sigma: mean(&variance),
        says: quality.reasons,
        ..refused
    }
}

/// Users live in a space of rigs and of mistakes: any depth from 60 mm to 1.5 m, lying, upright and diagonal stripes,
/// the laser on every side, 1 to 14 boards, narrow and wide ranges of depth.
#[test]
fn a_flawed_set_never_passes_with_an_error_above_three_sigmas() {
    let each = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 300 } else { 50 };
    let all: Vec<Called> = FLAWS
        .into_par_iter()
        .flat_map(|flaw| (0..each).into_par_iter().map(move |k| call(7000 + 1000 * flaw as u64 + k, flaw)))
        .collect();
    let passed = |c: &&Called| c.verdict.is_some_and(|v| v <= Verdict::Usable);
    for flaw in FLAWS {
        let of: Vec<&Called> = all.iter().filter(|c| c.flaw == flaw).collect();
        let count = |v| of.iter().filter(|c| c.verdict == v).count();
        let over: Vec<f64> = of.iter().copied().filter(passed).map(|c| c.error / c.sigma).collect();
        println!(
            "{flaw:?}: good {}, usable {}, badly determined {}, refused {}; error over sigma of those that passed: \
             rms {:.2}, \
             worst {:.2}",
            count(Some(Verdict::Good)),
            count(Some(Verdict::Usable)),
            count(Some(Verdict::BadlyDetermined)),
            count(None),
            (over.iter().map(|x| x * x).sum::<f64>() / over.len().max(1) as f64).sqrt(),
            over.iter().copied().fold(0.0, f64::max)
        );
    }
    let wrong: Vec<String> = all
        .iter()
        .filter(passed)
        .filter(|c| c.error > 3.0 * c.sigma)
        .map(|c| {
            format!(
                "{:?}, {} boards, seed {}: {:.4} mm of {:.4}: {:?}",
                c.flaw, c.count, c.seed, c.error, c.sigma, c.says
            )
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {}: {wrong:#?}", wrong.len(), all.len());
    // Sound sets of five boards or more are taken.
    let sound: Vec<&Called> = all.iter().filter(|c| c.flaw == Flaw::None && c.count >= 5).collect();
    let taken = sound.iter().copied().filter(passed).count();
    assert!(taken as f64 >= 0.9 * sound.len() as f64, "{taken} of {} sound sets were taken", sound.len());
}
