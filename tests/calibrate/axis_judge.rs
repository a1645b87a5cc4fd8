//! In: random cameras before random linear axes and turntables, boards that ride on them, sound sets of stops and
//! flawed ones.
//! Out: whether the axis is found with an honest sigma, and no flawed set passes with an error that its sigma denies.
//! Frame and unit: camera frame; mm, rad, px.

use crate::common::judge::{between, gauss, gauss2, gauss3};
use crate::common::sheets::log_between;
use rand::Rng;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::calibrate::axis::fit::{AxisFit, Stop};
use sheetlight::calibrate::axis::report::judge;
use sheetlight::calibrate::axis::solve::{AxisOptions, solve};
use sheetlight::calibrate::limits::Asked;
use sheetlight::calibrate::measured_pose::{SeenBoard, measure};
use sheetlight::camera::{CameraCovariance, Intrinsics, Parameters};
use sheetlight::geometry::{Axis, AxisKind, Board, Camera, CountUnit, Riding, Rigid, Vec3, exp};
use sheetlight::recording::BoardSpec;
use sheetlight::rig::{Verdict, Volume};
use sheetlight::solve::End;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Flaw {
    None,
    /// The axis is put with an error of its own at every stop.
    Wobble,
    /// The board slips at one stop and is put back.
    Slipped,
    /// It slips and stays there.
    Moved,
    /// The encoder counts up whichever way the axis goes.
    Unsigned,
    /// Pictures and counts were sorted apart.
    Shuffled,
    /// The counts are in the reverse order.
    Reversed,
    /// From one stop on each picture has the count of the one before.
    Late,
    /// The way is no straight line, the turntable's axis wanders.
    Bent,
    /// The encoder loses steps on its way.
    Lost,
}

const FLAWS: [Flaw; 10] = [
    Flaw::None,
    Flaw::Wobble,
    Flaw::Slipped,
    Flaw::Moved,
    Flaw::Unsigned,
    Flaw::Shuffled,
    Flaw::Reversed,
    Flaw::Late,
    Flaw::Bent,
    Flaw::Lost,
];

struct Rig {
    camera: Intrinsics,
    spec: BoardSpec,
    axis: Axis,
    camera_from_board: Rigid<Camera, Board>,
    corner_px: f64,
    pixel_mm: f64,
    depth: f64,
    /// Counts at which the whole board is in the picture.
    way: [f64; 2],
}

fn rig(rng: &mut Pcg64, kind: AxisKind) -> Rig {
    loop {
        let depth = log_between(rng, 60.0, 1500.0);
        let [width, height] = [[640, 480], [1280, 1024], [480, 640], [2048, 1536]][rng.random_range(0..4)];
        let f = 0.5 * f64::from(width.max(height)) / between(rng, 0.1f64, 0.5).tan();
        let camera = Intrinsics {
            fx: f,
            fy: f,
            cx: f64::from(width) * between(rng, 0.46, 0.54),
            cy: f64::from(height) * between(rng, 0.46, 0.54),
            skew: 0.0,
            distortion: [between(rng, -0.1, 0.05), 0.0, 0.0, 0.0, 0.0].into(),
            width,
            height,
        };
        let view = camera.view_mm(depth);
        let square = view * between(rng, 0.15, 0.4) / 10.0;
        let spec = BoardSpec::Chessboard {
            inner_corners: [9, 6],
            square_mm: square,
            border_mm: 0.7 * square,
            first_square: "black".into(),
        };
        let middle = Vec3::new(4.0 * square, 2.5 * square, 0.0);
        let tilt = exp(&Vec3::new(between(rng, -0.5, 0.5), between(rng, -0.5, 0.5), 0.0));
        let turn = exp(&Vec3::new(0.0, 0.0, between(rng, -3.0, 3.0))) * tilt;
        let place = Vec3::new(gauss(rng, 0.05 * view), gauss(rng, 0.05 * view), depth);
        let camera_from_board = Rigid::new(turn, place - turn * middle);
        let unit = CountUnit::Count;
        let direction = match kind {
            AxisKind::Linear => Vec3::new(gauss(rng, 1.0), gauss(rng, 1.0), gauss(rng, 0.3)).normalize(),
            // From above, aslant, or from the side.
            AxisKind::Turntable => exp(&Vec3::new(between(rng, 0.0, 1.4), gauss(rng, 0.2), 0.0)) * Vec3::z(),
        };
        let pitch = match kind {
            AxisKind::Linear => view / log_between(rng, 500.0, 50_000.0),
            AxisKind::Turntable => std::f64::consts::TAU / log_between(rng, 360.0, 1e6),
        };
        let pitch = if kind == AxisKind::Turntable && rng.random::<bool>() { -pitch } else { pitch };
        let point = place + gauss3(rng, 0.1 * view);
        let axis = Axis::from_board(&Riding { kind, unit, direction, point, pitch }, &camera_from_board);
        let seen = |count: f64| {
            let pose = axis.moved(count) * camera_from_board;
            // A board that is seen too flatly is not found.
            let facing = -(pose.rotation * Vec3::z()).dot(&-pose.point(&middle).normalize());
            facing > 0.35
                && spec.features().iter().all(|p| {
                    let q = camera.pixel_from_point(&pose.point(p));
                    q.is_some_and(|q| {
                        (4.0..f64::from(width) - 4.0).contains(&q.x) && (4.0..f64::from(height) - 4.0).contains(&q.y)
                    })
                })
        };
        let step = match kind {
            AxisKind::Linear => view / 60.0 / axis.pitch,
            AxisKind::Turntable => std::f64::consts::TAU / 120.0 / axis.pitch.abs(),
        };
        let reach = |sign: f64| (0..60).take_while(|k| seen(sign * step * f64::from(*k))).count() as f64 - 1.0;
        let (low, high) = (-reach(-1.0) * step, reach(1.0) * step);
        if high - low > 12.0 * step {
            let corner_px = log_between(rng, 0.02, 0.15);
            return Rig {
                camera,
                spec,
                axis,
                camera_from_board,
                corner_px,
                pixel_mm: depth / f,
                depth,
                way: [low, high],
            };
        }
    }
}

/// A set of stops, and how the part truly moved from count 0, the axis' own error left out but for a bent way.
struct Set<'a> {
    stops: Vec<Stop>,
    moved: Box<dyn Fn(f64) -> Rigid<Camera, Camera> + 'a>,
}

fn set<'a>(rng: &mut Pcg64, r: &'a Rig, count: usize, flaw: Flaw, believed: &Intrinsics) -> Set<'a> {
    let [low, high] = r.way;
    let mut counts: Vec<f64> = (0..count)
        .map(|i| low + (high - low) * (i as f64 + between(rng, 0.05, 0.95)) / count as f64)
        .map(f64::round)
        .collect();
    counts.shuffle(rng);
    if flaw != Flaw::Shuffled {
        counts.sort_by(f64::total_cmp);
    }
    let size = log_between(rng, 0.3, 40.0) * r.pixel_mm;
    let at = rng.random_range(0..count);
    let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
    let bow = gauss3(rng, 1.0).normalize() * size;
    let bent = flaw == Flaw::Bent;
    let moved = move |c: f64| {
        let x = (c - middle) / half;
        let m = r.axis.moved(c);
        if bent { Rigid::new(m.rotation, m.translation + bow * (x * x)) } else { m }
    };
    let slip = Rigid::<Camera, Camera>::from_vectors(&gauss3(rng, 0.003), gauss3(rng, 1.0).normalize() * size);
    let lost = half * between(rng, 0.02, 0.3);
    let points = r.spec.features();
    let mut stops: Vec<Stop> = (0..count)
        .map(|i| {
            // Where the axis truly stood: the encoder may tell another count.
            let c = match flaw {
                Flaw::Unsigned => counts[i],
                Flaw::Lost if i > at => counts[i] + lost,
                _ => counts[i],
            };
            let mut pose = moved(c) * r.camera_from_board;
            if (flaw == Flaw::Slipped && i == at) || (flaw == Flaw::Moved && i >= at) {
                // On the axis: from there on it rides along as it now lies.
                let lies = r.camera_from_board;
                let now = Rigid::new(slip.rotation * lies.rotation, lies.translation + slip.translation);
                pose = moved(c) * now;
            }
            if flaw == Flaw::Wobble {
                let turn = exp(&gauss3(rng, 0.1 * size / (5.0 * r.pixel_mm * 100.0)));
                let centre = pose.point(&Vec3::zeros());
                pose = Rigid::new(turn * pose.rotation, centre + gauss3(rng, 0.1 * size));
            }
            let pixels = points
                .iter()
                .map(|p| r.camera.pixel_from_point(&pose.point(p)).unwrap() + gauss2(rng, r.corner_px))
                .collect();
            let seen = SeenBoard {
                name: format!("picture {i}"),
                points: points.clone(),
                pixels,
                sigmas_px: vec![r.corner_px; points.len()],
            };
            Stop { count: counts[i], pose: measure(&seen, believed, &pose).unwrap() }
        })
        .collect();
    let told: Vec<f64> = match flaw {
        // Back and forth over the turning point, told as a sum of steps.
        Flaw::Unsigned => counts.iter().map(|c| (c - counts[at]).abs()).collect(),
        Flaw::Shuffled => {
            let mut sorted = counts.clone();
            sorted.sort_by(f64::total_cmp);
            sorted
        }
        Flaw::Reversed => counts.iter().rev().copied().collect(),
        Flaw::Late => (0..count).map(|i| counts[if i > at { i - 1 } else { i }]).collect(),
        _ => counts.clone(),
    };
    stops.iter_mut().zip(told).for_each(|(s, c)| s.count = c);
    Set { stops, moved: Box::new(moved) }
}

/// How far the found axis puts the board's corners from where they truly go, against the middle of the way, rms, and
/// what is stated of that; mm. Over a linear axis' way, over a whole turn of a table that runs true. `sense` is 1 or
/// -1: an encoder that counts up whichever way it goes is right for one of the two.
fn error(r: &Rig, s: &Set, fit: &AxisFit, flaw: Flaw, sense: f64) -> (f64, [f64; 2]) {
    let (low, high) = fit.counts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), c| (a.min(*c), b.max(*c)));
    let middle = (low + high) / 2.0;
    let half = match r.axis.kind {
        AxisKind::Turntable if flaw != Flaw::Bent => std::f64::consts::PI / r.axis.pitch.abs(),
        _ => (high - low) / 2.0,
    };
    let there = (s.moved)(middle) * r.camera_from_board;
    let corners = &s.stops[0].pose.landmarks;
    let (mut sum, mut n) = (0.0, 0.0);
    for k in -4..=4 {
        let by = half * f64::from(k) / 4.0;
        let truly = (s.moved)(middle + sense * by) * r.camera_from_board;
        let found = fit.axis.moved(middle + by) * fit.axis.moved(middle).inverse();
        for p in corners {
            sum += (found.point(&there.point(p)) - truly.point(p)).norm_squared();
            n += 1.0;
        }
    }
    (f64::sqrt(sum / n), fit.error_over(&fit.covariance, half))
}

struct Called {
    kind: AxisKind,
    flaw: Flaw,
    count: usize,
    seed: u64,
    verdict: Option<Verdict>,
    error: f64,
    /// Of direction and pitch alone, and with the axis' scatter.
    sigma: [f64; 2],
    says: Vec<String>,
}

fn call(seed: u64, kind: AxisKind, flaw: Flaw) -> Called {
    let rng = &mut Pcg64::seed_from_u64(seed);
    let r = rig(rng, kind);
    let count = rng.random_range(3..=16);
    let s = set(rng, &r, count, flaw, &r.camera);
    let refused = Called { kind, flaw, count, seed, verdict: None, error: 0.0, sigma: [0.0; 2], says: Vec::new() };
    let known = CameraCovariance::exact();
    let Ok(fit) = solve(&s.stops, kind, CountUnit::Count, &known, &AxisOptions::default()) else { return refused };
    let stood = Volume::new(r.depth, r.depth, "where the boards stood");
    let said = |fit: &AxisFit| judge(fit, &Asked::default().limits(&stood, |z| r.camera.view_mm(z)), "square_mm");
    let quality = said(&fit);
    let hasty = said(&AxisFit { end: End::Exhausted, ..fit.clone() });
    assert_eq!(hasty.verdict, quality.verdict.max(Verdict::Usable), "a fit that did not converge");
    assert!(hasty.reasons.iter().any(|r| r.contains("did not converge")), "{:?}", hasty.reasons);
    let (error, sigma) = match flaw {
        Flaw::Unsigned => {
            let [up, down] = [1.0, -1.0].map(|sense| error(&r, &s, &fit, flaw, sense));
            if up.0 < down.0 { up } else { down }
        }
        _ => error(&r, &s, &fit, flaw, 1.0),
    };
    Called { verdict: Some(quality.verdict), error, sigma, says: quality.reasons, ..refused }
}

fn rms(of: impl Iterator<Item = f64>) -> f64 {
    let (s, n) = of.fold((0.0, 0.0), |(s, n), x| (s + x * x, n + 1.0));
    f64::sqrt(s / f64::max(n, 1.0))
}

/// Any depth from 60 mm to 1.5 m, boards small and large, axes that lie anyhow, 3 to 16 stops.
#[test]
fn a_flawed_set_never_passes_with_an_error_above_three_sigmas() {
    let each = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 300 } else { 12 };
    let kinds = [AxisKind::Linear, AxisKind::Turntable];
    let all: Vec<Called> = kinds
        .into_par_iter()
        .flat_map(|kind| FLAWS.into_par_iter().map(move |flaw| (kind, flaw)))
        .flat_map(|(kind, flaw)| {
            let from = 7000 + 10_000 * flaw as u64 + 1_000_000 * kind as u64;
            (0..each).into_par_iter().map(move |k| call(from + k, kind, flaw))
        })
        .collect();
    let passed = |c: &&Called| c.verdict.is_some_and(|v| v <= Verdict::Usable);
    for kind in kinds {
        for flaw in FLAWS {
            let of: Vec<&Called> = all.iter().filter(|c| c.flaw == flaw && c.kind == kind).collect();
            let count = |v| of.iter().filter(|c| c.verdict == v).count();
            let over = |k: usize| of.iter().copied().filter(passed).map(move |c| c.error / c.sigma[k]);
            println!(
                "{kind:?} {flaw:?}: good {}, usable {}, badly determined {}, refused {}; error over sigma of those \
                 that passed: \
                 rms {:.2}, worst {:.2}; over that of direction and pitch alone: rms {:.2}",
                count(Some(Verdict::Good)),
                count(Some(Verdict::Usable)),
                count(Some(Verdict::BadlyDetermined)),
                count(None),
                rms(over(1)),
                over(1).fold(0.0, f64::max),
                rms(over(0)),
            );
        }
    }
    let wrong: Vec<String> = all
        .iter()
        .filter(passed)
        .filter(|c| c.error > 3.0 * c.sigma[1])
        .map(|c| {
            format!(
                "{:?} {:?}, {} stops, seed {}: {:.4} mm of {:.4}: {:?}",
                c.kind, c.flaw, c.count, c.seed, c.error, c.sigma[1], c.says
            )
        })
        .collect();
    // Three sigmas of one direction leave out 3 in a thousand, and sigma itself is known from few stops.
    let taken: Vec<&Called> = all.iter().filter(passed).collect();
    let worst = taken.iter().map(|c| c.error / c.sigma[1]).fold(0.0, f64::max);
    println!("{} of {} that passed are beyond three sigmas, the worst by {worst:.1}", wrong.len(), taken.len());
    assert!(wrong.len() * 100 <= taken.len() && worst < 5.0, "{} of {}: {wrong:#?}", wrong.len(), taken.len());
    // Sound sets of six stops or more are taken, and their errors are what is stated.
    let sound: Vec<&Called> = all.iter().filter(|c| c.flaw == Flaw::None && c.count >= 6).collect();
    let taken = sound.iter().copied().filter(passed).count();
    assert!(taken as f64 >= 0.9 * sound.len() as f64, "{taken} of {} sound sets were taken", sound.len());
    let over = rms(sound.iter().copied().filter(passed).map(|c| c.error / c.sigma[0]));
    assert!((0.6..=1.25).contains(&over), "errors of sound sets are {over:.2} of what is stated");
}

/// One picture of a slipped board among sound ones is named, and what is left is as good as without it.
#[test]
fn a_slipped_board_is_named() {
    for seed in 0..20 {
        for kind in [AxisKind::Linear, AxisKind::Turntable] {
            let rng = &mut Pcg64::seed_from_u64(50_000 + seed);
            let r = rig(rng, kind);
            let mut s = set(rng, &r, 12, Flaw::None, &r.camera);
            let bad = seed as usize % 12;
            let pose = &mut s.stops[bad].pose.camera_from_board;
            pose.translation += gauss3(rng, 1.0).normalize() * 30.0 * r.pixel_mm;
            let known = CameraCovariance::exact();
            let fit = solve(&s.stops, kind, CountUnit::Count, &known, &AxisOptions::default()).unwrap();
            let out: Vec<usize> = (0..12).filter(|&i| !fit.stops[i].used).collect();
            assert_eq!(out, [bad], "{kind:?} seed {seed}");
            let (error, [_, sigma]) = error(&r, &s, &fit, Flaw::Slipped, 1.0);
            assert!(error < 4.0 * sigma, "{kind:?} seed {seed}: {error:.5} mm of {sigma:.5}");
        }
    }
}

#[test]
fn the_cameras_uncertainty_reaches_the_report() {
    let sigma = Parameters::from([
        0.5, 0.5, 0.4, 0.4, 1e-3, 1e-3, 1e-4, 1e-4, 1e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    ]);
    for kind in [AxisKind::Linear, AxisKind::Turntable] {
        let over: Vec<[f64; 2]> = (0..40u64)
            .into_par_iter()
            .map(|k| {
                let rng = &mut Pcg64::seed_from_u64(900 + k);
                let r = Rig { corner_px: 0.02, ..rig(rng, kind) };
                let scale = f64::from(r.camera.width.max(r.camera.height)) / 640.0;
                let mut off = Parameters::from_fn(|i, _| gauss(rng, sigma[i]));
                let mut sigma = sigma;
                for i in 0..4 {
                    off[i] *= scale;
                    sigma[i] *= scale;
                }
                let believed = r.camera.changed(&off);
                let s = set(rng, &r, 14, Flaw::None, &believed);
                let fit = solve(
                    &s.stops,
                    kind,
                    CountUnit::Count,
                    &CameraCovariance::independent(&sigma).unwrap(),
                    &AxisOptions::default(),
                )
                .unwrap();
                let e = error(&r, &s, &fit, Flaw::None, 1.0).0;
                [e / fit.expected_error(&fit.covariance)[0], e / fit.expected_error(&fit.covariance_camera_exact)[0]]
            })
            .collect();
        let (with, without) = (rms(over.iter().map(|o| o[0])), rms(over.iter().map(|o| o[1])));
        println!("{kind:?}: with the camera's part {with:.2}, without {without:.2}");
        assert!((0.6..=1.4).contains(&with), "{kind:?}: {with:.2}");
        assert!(without > 1.5 * with, "the test must be able to fail: {without:.2}");
    }
}

#[test]
fn what_determines_no_axis_is_refused() {
    let rng = &mut Pcg64::seed_from_u64(3);
    let r = rig(rng, AxisKind::Linear);
    let s = set(rng, &r, 8, Flaw::None, &r.camera);
    let known = CameraCovariance::exact();
    let run = |stops: &[Stop]| {
        solve(stops, AxisKind::Linear, CountUnit::Count, &known, &AxisOptions::default()).map(|_| ()).unwrap_err().what
    };
    assert!(run(&s.stops[..2]).contains("3 are needed"));
    let mut still = s.stops.clone();
    still.iter_mut().for_each(|s| s.count = 7.0);
    assert!(run(&still).contains("have the count 7"));
    // An axis that states millimetres, and a board whose squares are another size.
    let mm = |scale: f64| {
        let stops: Vec<Stop> =
            s.stops.iter().map(|s| Stop { count: s.count * r.axis.pitch * scale, ..s.clone() }).collect();
        let fit = solve(&stops, AxisKind::Linear, CountUnit::Mm, &known, &AxisOptions::default()).unwrap();
        let stood = Volume::new(r.depth, r.depth, "");
        judge(&fit, &Asked::default().limits(&stood, |z| r.camera.view_mm(z)), "square_mm")
    };
    assert!(mm(1.0).verdict <= Verdict::Usable, "{:?}", mm(1.0).reasons);
    let wrong = mm(1.05);
    assert!(wrong.verdict == Verdict::BadlyDetermined && wrong.reasons.iter().any(|r| r.contains("square_mm")));
}
