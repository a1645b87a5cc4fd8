//! In: joint solves of simulated stations, a flat part that is scanned with them. Out: whether the error budget of a
//! found pose is what the pose is truly off by, and what records that are taken as independent would make of it.
//! Frame and unit: base frame; mm, rad.

use super::seeds;
use super::stations::{Cell, QUIET, calibrate, rig, stops};
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;
use sheetlight::calibrate::joint::options::JointOptions;
use sheetlight::calibrate::joint::records::{covariances, together};
use sheetlight::calibrate::joint::solve::JointFit;
use sheetlight::calibrate::joint::volume::scanned;
use sheetlight::find::look::levers::Seen;
use sheetlight::find::look::part_seen::PartSeen;
use sheetlight::geometry::{Base, Camera, Flange, Part, Rigid, Vec3};
use sheetlight::rig::{Calibration, HandEye, Joint, JointCovariance, Kind, Quality, Rig, Verdict, sealed};

/// What a solve leaves in a station.
fn stored(fit: &JointFit) -> Rig {
    let (reasons, advice, figures, per_picture) = (vec![], vec![], Default::default(), vec![]);
    let quality = Quality { verdict: Verdict::Good, reasons, advice, figures, per_picture };
    let mut c = covariances(fit, Kind::HandEye);
    let mut of = |kind| c.remove(&kind).unwrap();
    let camera = Calibration::new(Kind::Camera, fit.state.camera, None, of(Kind::Camera), quality.clone());
    let plane =
        Calibration::new(Kind::LaserPlane, fit.state.plane, Some(&camera), of(Kind::LaserPlane), quality.clone());
    let x = fit.state.near_from_camera;
    let value = HandEye::new(x.rotation, x.translation);
    let hand_eye = Calibration::new(Kind::HandEye, value, Some(&camera), of(Kind::HandEye), quality);
    let contents =
        [(Kind::Camera, camera.content()), (Kind::LaserPlane, plane.content()), (Kind::HandEye, hand_eye.content())];
    let joint = Joint::Stated(together(fit, Kind::HandEye, contents.into()));
    Rig { camera: Some(camera), laser_plane: Some(plane), hand_eye: Some(hand_eye), joint, ..Rig::default() }
}

/// A flat part squarely before the camera, 24 shots over it: as the fit sees it, and the true displacement of each
/// place.
fn scan(cell: &Cell, fit: &JointFit) -> (PartSeen, Vec<Vec3>) {
    let (truth, depth) = (cell.truth(&[]), cell.station.working_distance);
    let n = truth.plane.normal;
    let along = n.cross(&Vec3::z()).normalize();
    let across = along.cross(&Vec3::z());
    // Where the sheet is at that depth.
    let on = across * ((truth.plane.offset - n.z * depth) / n.dot(&across)) + Vec3::z() * depth;
    let size = 0.13 * depth;
    let first: Rigid<Base, Flange> = Rigid::from_vectors(&Vec3::new(0.1, 3.0, 0.05), Vec3::new(400.0, 30.0, 500.0));
    let x: Rigid<Flange, Camera> = cell.station.flange_from_camera;
    let fitted: Rigid<Flange, Camera> =
        Rigid::new(fit.state.near_from_camera.rotation, fit.state.near_from_camera.translation);
    let (mut seen, mut moved, mut places) = (vec![], vec![], vec![]);
    for shot in 0..24 {
        let shift = (first * x).direction(&across) * (size * (f64::from(shot) / 23.0 - 0.5));
        let flange = Rigid::<Base, Flange>::new(first.rotation, first.translation + shift);
        for k in 0..20 {
            let at = on + along * (size * (f64::from(k) / 19.0 - 0.5));
            let Some(q) = cell.station.camera.pixel_from_point(&at).and_then(|px| scanned(&fit.state, &px)) else {
                continue;
            };
            let (found, truly) = (flange.point(&q), (flange * x).point(&at));
            let base_from_camera = flange * fitted;
            seen.push(Seen {
                at: base_from_camera.inverse().point(&found),
                base_from_camera,
                late: Vec3::zeros(),
                longer: Vec3::zeros(),
            });
            moved.push(found - truly);
            places.push(truly);
        }
    }
    let middle = places.iter().sum::<Vec3>() / places.len() as f64;
    let part: Rigid<Base, Part> = Rigid::new((first * x).rotation, middle);
    let side = (-8..=8).map(|k| 0.04 * depth * f64::from(k) / 8.0);
    let edge = 0.04 * depth;
    let edges =
        side.flat_map(|s| [[s, edge, 0.0, 1.0], [s, -edge, 0.0, -1.0], [edge, s, 1.0, 0.0], [-edge, s, -1.0, 0.0]]);
    (PartSeen::of(part, seen, edges.collect()).unwrap(), moved)
}

/// Of one station: the pose's true error over its budget (mean square of six numbers), and how much larger the
/// shift's sigma would be from records taken as independent.
fn one(name: &str, seed: u64) -> (f64, f64) {
    let cell = Cell::new(&rig(name), seed);
    let fit = calibrate(&cell, &stops(&cell, 30, 40.0, &QUIET, seed), &JointOptions::default()).unwrap();
    let rig = stored(&fit);
    let (part, moved) = scan(&cell, &fit);
    let lever = part.together(&rig, rig.joint().unwrap().unwrap()).unwrap();
    let whole = lever.of_pose();
    let alone: Matrix6<f64> = part
        .levers(&rig)
        .unwrap()
        .iter()
        .filter(|l| ["laser plane", "hand-eye"].contains(&l.name))
        .map(|l| l.of_pose())
        .sum();
    let error: Vector6<f64> = part.answer()(&moved).fixed_rows::<6>(0).into();
    let squares = error.dot(&whole.lu().solve(&error).unwrap());
    let shift = |c: &Matrix6<f64>| c.fixed_view::<3, 3>(0, 0).trace().sqrt();
    let of = |p: &Vector6<f64>| p.fixed_rows::<3>(0).norm();
    println!(
        "{name} {seed}: pose off {:.4} mm, budget {:.4} mm, as independent records {:.4} mm",
        of(&error),
        shift(&whole),
        shift(&alone)
    );
    (squares / 6.0, shift(&alone) / shift(&whole))
}

#[test]
fn a_found_pose_is_off_by_what_the_budget_says() {
    let mut wrong = Vec::new();
    for (name, short) in [("paper", 5), ("telephoto", 2)] {
        let all: Vec<(f64, f64)> = seeds(short).into_par_iter().map(|seed| one(name, seed)).collect();
        let n = all.len() as f64;
        let ratio = (all.iter().map(|a| a.0).sum::<f64>() / n).sqrt();
        let larger = all.iter().map(|a| a.1).sum::<f64>() / n;
        println!("{name}: error over sigma {ratio:.2}; records taken as independent give {larger:.1} times the sigma");
        // Six numbers a station.
        let more = if n < 20.0 { 3.0 / (12.0 * n).sqrt() } else { 0.0 };
        if !(0.8 - more..=1.25 + more).contains(&ratio) || larger < 1.5 {
            wrong.push(format!("{name}: {ratio:.2}, {larger:.1}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn what_is_stated_of_all_records_together_counts_for_these_records_alone() {
    let cell = Cell::new(&rig("paper"), 3);
    let fit = calibrate(&cell, &stops(&cell, 14, 35.0, &QUIET, 3), &JointOptions::default()).unwrap();
    let rig = stored(&fit);
    let dir = tempfile::tempdir().unwrap();
    rig.store_all(dir.path()).unwrap();
    let path = dir.path().join("calibration/joint.json");
    assert!(Rig::load(dir.path()).unwrap().joint().is_none(), "nothing is stated");
    // A rotation comes back from its file orthonormal to the last digit: what a reader finds is named.
    let found = Rig::load(dir.path()).unwrap();
    let of = [
        (Kind::Camera, found.camera.as_ref().unwrap().content()),
        (Kind::LaserPlane, found.laser_plane.as_ref().unwrap().content()),
        (Kind::HandEye, found.hand_eye.as_ref().unwrap().content()),
    ];
    let stated = together(&fit, Kind::HandEye, of.into());
    let text = sealed(&stated);
    let said = |text: &str| {
        std::fs::write(&path, text).unwrap();
        Rig::load(dir.path()).unwrap().joint().unwrap().map(|_| ()).unwrap_err()
    };
    std::fs::write(&path, &text).unwrap();
    let mut rig = Rig::load(dir.path()).unwrap();
    assert_eq!(rig.joint().unwrap().unwrap(), &stated);
    rig.laser_plane.as_mut().unwrap().value.offset += 1e-3;
    let exchanged = rig.joint().unwrap().unwrap_err();
    assert!(exchanged.contains("another laser plane"), "{exchanged}");
    rig.hand_eye = None;
    assert!(rig.joint().unwrap().is_err());
    assert!(said(&text.replacen("e-", "e-1", 1)).contains("changed after"), "an edit");
    assert!(said("{").contains("joint.json"), "half a file");
    let short = JointCovariance { parameters: stated.parameters[1..].to_vec(), ..stated.clone() };
    assert!(said(&sealed(&short)).contains("no covariance"));
    let newer = JointCovariance { format: 2, ..stated };
    assert!(said(&sealed(&newer)).contains("format 2"));
}
