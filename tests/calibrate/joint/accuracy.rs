//! In: stops of random stations. Out: how far scanned points are off after the joint solve, beside what it says, and
//! beside the separate calibrations from the same pictures.
//! Frame and unit: mm.

use super::stations::{Cell, LOUD, Levels, QUIET, calibrate, data_sheet, errors, rig, stops};
use super::{rms, seeds};
use nalgebra::DMatrix;
use rayon::prelude::*;
use sheetlight::calibrate::joint::options::JointOptions;
use sheetlight::calibrate::joint::records::{Beside, judge};
use sheetlight::calibrate::joint::shots::Part;
use sheetlight::calibrate::joint::volume::{expected, places, weights};
use sheetlight::calibrate::limits::Limits;
use sheetlight::rig::{Verdict, Volume};

/// Error of scanned points, what was expected, and what the robot's noise alone makes of it, for stations of a rig.
fn of(name: &str, levels: &Levels, count: usize, short: u64) -> Vec<[f64; 3]> {
    let one = |seed| {
        let cell = Cell::new(&rig(name), seed);
        let shots = stops(&cell, count, 40.0, levels, seed);
        let fit = calibrate(&cell, &shots, &JointOptions::default()).unwrap();
        let m = weights(&fit.state, &fit.layout, &places(&fit.state, cell.working()));
        let robot = [Part::RobotPlace, Part::RobotTurn].map(|p| expected(&m, &fit.shares[p as usize]));
        let [off, sigma] = errors(&cell, &fit);
        [off, sigma, robot[0].hypot(robot[1])]
    };
    seeds(short).into_par_iter().map(one).collect()
}

/// The bars are those of 20 stations; fewer scatter: the error of one has two or three numbers that matter.
#[test]
fn points_are_as_good_as_the_solve_says() {
    let mut wrong = Vec::new();
    let cases = [
        ("paper", QUIET, 0.025),
        ("paper", LOUD, 0.05),
        ("upright", QUIET, 0.025),
        ("slant45", QUIET, 0.025),
        // 1.5 m away 0.004 degrees are 0.1 mm: what they leave after 40 stops is the unit of the bar.
        ("telephoto", QUIET, f64::NAN),
    ];
    for (name, levels, bar) in cases {
        let each = of(name, &levels, 40, 1);
        let n = each.len() as f64;
        let (off, ratio) = (rms(each.iter().map(|e| e[0])), rms(each.iter().map(|e| e[0] / e[1])));
        let robot = rms(each.iter().map(|e| e[2]));
        println!(
            "{name}, robot {} mm: points off {off:.4} mm rms, over sigma {ratio:.2}; by the robot's noise alone \
             {robot:.4} mm",
            levels.robot_mm
        );
        let bar = if bar.is_nan() { 1.1 * robot } else { bar };
        // An rms of n draws with two degrees of freedom each is known to 1 / (2 sqrt n).
        let more = if n < 20.0 { 1.5 / n.sqrt() } else { 0.0 };
        if off > bar * (1.0 + more) || !(0.8 - more..=1.25 + more).contains(&ratio) {
            wrong.push(format!("{name}: {off:.4} mm (bar {bar}), {ratio:.2} of sigma"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// The noise of every source is found, however the stated sigmas are wrong.
#[test]
fn every_source_gets_the_weight_that_its_residuals_show() {
    let cell = Cell::new(&rig("paper"), 5);
    for levels in [QUIET, LOUD] {
        let fit = calibrate(&cell, &stops(&cell, 40, 40.0, &levels, 5), &JointOptions::default()).unwrap();
        let n = &fit.noise;
        println!("{n:?} of {levels:?}");
        let near = |found: f64, truth: f64, freedom: f64| (found / truth - 1.0).abs() < 4.0 / (2.0 * freedom).sqrt();
        assert!(near(n.robot_mm, levels.robot_mm, fit.freedom[3]), "{n:?}");
        assert!(near(n.robot_rad.to_degrees(), levels.robot_deg, fit.freedom[4]), "{n:?}");
        assert!(near(n.feature, levels.corner_px / 0.02, fit.freedom[0]), "{n:?}");
        assert!(near(n.stripe, levels.peak_px / 0.05, fit.freedom[1]), "{n:?}");
        assert!(near(n.spot, levels.spot_px / 0.05, fit.freedom[2]), "{n:?}");
        assert!(fit.left_out.is_empty(), "{:?}", fit.left_out);
    }
    assert!((data_sheet(&cell).fx - cell.station.camera.fx).abs() > 1.0);
}

/// An arm far better than the boards are seen leaves little of its own to see: what is stated of points is right all
/// the same, and the calibration is not refused. Few stops are.
#[test]
fn an_arm_too_exact_to_be_seen_is_no_reason_to_refuse() {
    let limits =
        Limits { working: Volume::new(1000.0, 2000.0, "a test"), tolerance_mm: 1.0, tolerance_from: "a test".into() };
    let beside = Beside { separate: None, systematic: None, lit: [1000.0, 2000.0], missing: Vec::new() };
    let judged = |robot_mm: f64, count: usize, seed: u64| {
        let levels = Levels { robot_mm, robot_deg: 0.05 * robot_mm, ..QUIET };
        let cell = Cell::new(&rig("telephoto"), seed);
        let fit = calibrate(&cell, &stops(&cell, count, 40.0, &levels, seed), &JointOptions::default()).unwrap();
        let m = weights(&fit.state, &fit.layout, &places(&fit.state, cell.working()));
        (errors(&cell, &fit), judge(&fit, &m, &beside, &limits), fit)
    };
    for robot_mm in [2e-4, 2e-3, 1e-2] {
        let one = |seed| {
            let ([off, sigma], quality, fit) = judged(robot_mm, 30, seed);
            let hidden = fit.freedom[3] < 6.0;
            assert!(quality.verdict <= Verdict::Usable, "{quality:?}");
            assert_eq!(
                hidden,
                quality.reasons.iter().any(|r| r.contains("is small against that of the boards")),
                "{quality:?}"
            );
            assert!(!hidden || quality.verdict == Verdict::Usable, "{quality:?}");
            (off / sigma, hidden)
        };
        let each: Vec<(f64, bool)> = seeds(6).into_par_iter().map(one).collect();
        let (ratio, hidden) = (rms(each.iter().map(|e| e.0)), each.iter().filter(|e| e.1).count());
        println!("robot {robot_mm} mm: error over sigma {ratio:.2}, hidden in {hidden} of {}", each.len());
        let more = 1.5 / (each.len() as f64).sqrt();
        assert!(ratio <= 1.25 + more, "{ratio}");
        assert!(hidden > 0 || robot_mm > 2e-4);
    }
    assert!(judged(2e-4, 3, 3).1.verdict == Verdict::BadlyDetermined);
}

/// What the records say one by one, added up as if they were independent, beside what they say together
/// (docs/math.md, Joint calibration (12)).
#[test]
fn records_by_themselves_promise_no_more_than_together() {
    for name in ["paper", "upright", "telephoto"] {
        let cell = Cell::new(&rig(name), 6);
        let fit = calibrate(&cell, &stops(&cell, 30, 40.0, &QUIET, 6), &JointOptions::default()).unwrap();
        let lit = places(&fit.state, cell.working());
        let m = weights(&fit.state, &fit.layout, &lit);
        let l = &fit.layout;
        let mut apart = DMatrix::zeros(l.shared(), l.shared());
        for (at, n) in [(l.hand_eye(), 6), (l.plane(), 3)] {
            apart.view_mut((at, at), (n, n)).copy_from(&fit.covariance.view((at, at), (n, n)));
        }
        let [blocks, whole] = [expected(&m, &apart), expected(&m, &fit.covariance)];
        println!("{name}: hand-eye and sheet by themselves {blocks:.4} mm, all together {whole:.4} mm");
        assert!(blocks > 0.9 * whole, "{name}: {blocks} {whole}");
    }
}

/// What the order of the pictures must not change.
#[test]
fn the_order_of_the_pictures_does_not_matter() {
    let cell = Cell::new(&rig("paper"), 7);
    let shots = stops(&cell, 14, 35.0, &QUIET, 7);
    let back: Vec<_> = shots.iter().rev().cloned().collect();
    let [a, b] = [shots, back].map(|s| errors(&cell, &calibrate(&cell, &s, &JointOptions::default()).unwrap()));
    assert!((a[0] - b[0]).abs() < 1e-4 && (a[1] - b[1]).abs() < 1e-3 * a[1], "{a:?} {b:?}");
}
