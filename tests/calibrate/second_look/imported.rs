//! A true station whose values were imported without covariance, and a robot that scatters by 0.02 mm and 0.004
//! degrees: right parts pass two looks, wrong ones do not. SHEETLIGHT_LONG: a hundred draws and every edit, else eight
//! draws and every third edit.

use super::edits::EDITS;
use super::world::{Believed, Recorded, World};
use super::{long, world, wrong};
use rayon::prelude::*;
use sheetlight::find::Report;
use sheetlight::rig::Rig;
use sheetlight::station::{PlaneValue, Sigmas, Values};

/// What a robot of the paper's size repeats to, mm and degrees.
const ROBOT: [f64; 2] = [0.02, 0.004];

/// As `station import` makes it of the values alone.
fn imported(b: &Believed) -> sheetlight::fault::Result<Rig> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let values = Values {
        intrinsics: Some(b.station.camera),
        flange_from_camera: Some(b.hand_eye.to_rows()),
        laser_plane_camera: Some(PlaneValue { normal: b.plane.normal.into(), offset_mm: b.plane.offset }),
        ..Values::default()
    };
    let source = folder.path().join("values.json");
    std::fs::write(&source, serde_json::to_string(&values).unwrap()).unwrap();
    let station = folder.path().join("station");
    Values::load(&source)?.store(&station, &source, true, &Sigmas::default())?;
    Rig::load(&station)
}

fn looked(world: &World, b: &Believed, looks: &[Recorded; 2]) -> Result<Report, String> {
    let rig = imported(b).map_err(|e| e.what)?;
    Ok(world.look_with(&rig, b, looks)?.1)
}

#[test]
fn right_parts_pass_with_a_true_station_that_was_imported_without_covariances() {
    let (world, draws) = (world(0), if long() { 100 } else { 8 });
    let pass = |draw: &u64| {
        let looks = world.recorded_by(ROBOT, &mut world.station.rng("imported", *draw));
        match looked(world, &world.exact(), &looks) {
            Ok(r) => {
                let l = r.looks.as_ref().unwrap();
                println!(
                    "draw {draw}: {}, ratio {:.2}, misfit {:.2}, {:?}",
                    r.passed, l.ratio, l.misfit_sigmas, r.reasons
                );
                assert!(l.complete, "all that the looks rest on has a covariance");
                r.passed && !wrong(&r, world)
            }
            Err(what) => {
                println!("draw {draw}: refused: {what}");
                false
            }
        }
    };
    let passed = (0..draws).into_par_iter().filter(pass).count() as u64;
    println!("{passed} of {draws} right parts pass");
    // Of eight, one may be the third of a hundred.
    assert!(passed * 100 >= draws * 97 - if long() { 0 } else { 100 }, "{passed} of {draws} right parts pass");
}

#[test]
fn no_edit_of_an_imported_station_passes_two_looks_with_a_wrong_pose() {
    let world = world(0);
    let passes = |(name, edit): &&(&str, fn(&mut Believed, &mut [Recorded; 2]))| {
        let (mut b, mut looks) = (world.exact(), world.recorded_by(ROBOT, &mut world.station.rng(name, 1)));
        edit(&mut b, &mut looks);
        let found = looked(world, &b, &looks);
        let passed = found.as_ref().is_ok_and(|r| r.passed);
        println!("{name}: {}", if passed { "passed" } else { "refused" });
        found.is_ok_and(|r| r.passed && wrong(&r, world))
    };
    let edits: Vec<_> = EDITS.iter().step_by(if long() { 1 } else { 3 }).collect();
    let through: Vec<&str> = edits.into_par_iter().filter(passes).map(|(name, _)| *name).collect();
    assert!(through.is_empty(), "wrong poses pass two looks: {through:?}");
}
