//! In: stops with something wrong. Out: it is left out and named, or refused.
//! Frame and unit: mm.

use super::stations::{Cell, QUIET, calibrate, errors, rig, stops};
use sheetlight::calibrate::joint::options::JointOptions;
use sheetlight::calibrate::joint::shots::Part;
use sheetlight::geometry::Vec3;

#[test]
fn a_board_that_was_moved_and_a_stripe_of_another_light_are_left_out_by_name() {
    let cell = Cell::new(&rig("paper"), 2);
    let o = JointOptions::default();
    let mut shots = stops(&cell, 24, 38.0, &QUIET, 2);
    let clean = errors(&cell, &calibrate(&cell, &shots, &o).unwrap());
    shots[3].robot.as_mut().unwrap().pose.translation += Vec3::new(1.0, -0.6, 0.3);
    shots[9].stripe.iter_mut().enumerate().for_each(|(i, p)| p.pixel.y += if i % 2 == 0 { 3.0 } else { -3.0 });
    if let Some(spot) = &mut shots[12].spot {
        spot.pixel.x += 6.0;
    }
    let fit = calibrate(&cell, &shots, &o).unwrap();
    let named: Vec<(String, Part)> = fit.left_out.iter().map(|l| (l.name.clone(), l.part)).collect();
    assert!(named.contains(&("stop 3".into(), Part::RobotPlace)), "{:?}", fit.left_out);
    assert!(named.contains(&("stop 9".into(), Part::Stripe)), "{:?}", fit.left_out);
    let spot = shots[12].spot.is_some();
    assert_eq!(named.contains(&("stop 12".into(), Part::Spot)), spot, "{:?}", fit.left_out);
    assert!(named.len() <= 3, "{:?}", fit.left_out);
    let now = errors(&cell, &fit);
    assert!(now[0] < 2.0 * clean[0].max(clean[1]), "{now:?}, without {clean:?}");
}

#[test]
fn too_few_stops_and_one_axis_are_refused() {
    let cell = Cell::new(&rig("paper"), 2);
    let o = JointOptions::default();
    let said = |n: usize| calibrate(&cell, &stops(&cell, 24, 38.0, &QUIET, 2)[..n], &o).err().map(|f| f.to_string());
    assert!(said(2).is_some_and(|t| t.contains("2 ")), "{:?}", said(2));
    // Boards that are all parallel tell nothing of camera and hand-eye together.
    let flat = stops(&cell, 10, 0.0, &QUIET, 2);
    let fit = calibrate(&cell, &flat, &o);
    assert!(fit.as_ref().err().is_some() || errors(&cell, fit.as_ref().unwrap())[1] > 0.2);
}
