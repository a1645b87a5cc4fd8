//! In: simulated cells with a part somewhere below the arm, a person who says yes. Out: whether the job inserts it,
//! judged by the cell's truth; whether it keeps away from what is missing, wrong or hidden; whether it survives being
//! cut off.
//! Frame and unit: mm, degrees, s.

use super::speeds::ROOM;
use super::workplace::{Yes, scene, set, set_but};
use sheetlight::station::Settings;
use sheetlight::station::job::{JobReport, JobState, Outcome, Phase};
use sheetlight_program::cell::Insertion;

/// Runs a job to its end; the insertion as the truth judges it.
fn inserted(part: &str, seed: u64, tilt_deg: f64, sweep_mm: f64) -> (JobReport, Option<Insertion>, usize, Vec<String>) {
    let set = set(scene(part, seed), seed, tilt_deg);
    let (mut who, speeds) = (Yes::always(), set.speeds());
    let report = set.run(&set.options(&format!("{part}.toml"), "job", sweep_mm), &mut who).unwrap();
    let (most, limit) = (speeds.fastest(), Settings::load(&set.station).unwrap().motion.unwrap().speed_mm_s);
    assert!(most > 0.9 * limit && most <= ROOM * limit, "{most} mm/s, limit {limit}");
    let t = set.served.cell.clock().now();
    println!("{part} seed {seed}: {:?} after {:.0} s of the cell; {:?}", report.outcome, t, report.why);
    for line in &who.told {
        println!("  {line}");
    }
    (report, set.served.cell.insertion(), set.served.cell.collisions(), who.told)
}

#[test]
fn a_component_goes_into_its_socket() {
    let (report, insertion, collisions, _) = inserted("osc", 3, 5.0, 34.0);
    assert_eq!(report.outcome, Outcome::Inserted, "{}", report.why);
    let judged = insertion.expect("the gripper has let go");
    println!("{judged:?}");
    assert!(judged.inserted && judged.lateral_mm <= 0.15 && collisions == 0, "{judged:?}, {collisions} collisions");
    assert_eq!((report.confirmations_to_position, report.confirmations), (Some(3), 5));
}

/// What is not known well enough is swept once more, in steps half as long, and is known better then.
#[test]
fn a_pose_that_is_not_known_well_enough_is_looked_at_again_closer() {
    let set = set(scene("osc", 3), 3, 5.0);
    let mut options = set.options("osc.toml", "job", 30.0);
    let strict = std::fs::read_to_string(&options.recipe).unwrap() + "\n[gates]\nmax_sigma_deg = 0.001\n";
    options.recipe = set.dir.path().join("strict.toml");
    std::fs::write(&options.recipe, strict).unwrap();
    let mut who = Yes::always();
    let report = set.run(&options, &mut who).unwrap();
    println!("{}\n{:#?}", report.why, who.told);
    // Not once more after that, and nothing towards the part.
    assert_eq!(who.asked, ["touch", "scan", "scan"]);
    assert_eq!(report.outcome, Outcome::Stopped);
    let sigma = |said: &str| -> f64 {
        let (_, rest) = said.split_once("sigma_deg is ").unwrap_or_else(|| panic!("{said}"));
        rest.split(',').next().unwrap().parse().unwrap()
    };
    let first = sigma(who.told.iter().find(|l| l.contains("once more")).expect("a second sweep is told of"));
    let second = sigma(&report.why);
    assert!(second < 0.85 * first, "{first} degrees, then {second}");
}

/// A part at the rim of what is swept: the sweep is moved there, by a motion that is shown and confirmed like the
/// first, and the part is inserted.
#[test]
fn a_part_at_the_rim_of_the_sweep_is_swept_whole() {
    let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
    let ways: &[[f64; 2]] = &[[0.0, 13.0], [0.0, -13.0], [13.0, 0.0], [-13.0, 0.0]];
    let cases: Vec<(u64, [f64; 2])> = if long {
        (0..100).map(|k| (1 + k / 4, ways[k as usize % 4])).collect()
    } else {
        ways[..2].iter().map(|w| (3, *w)).collect()
    };
    let (mut moved, mut inserted) = (0, 0);
    for (seed, [dx, dy]) in &cases {
        let lie = |spec: &mut sheetlight::simulate::SceneSpec| {
            let at = &mut spec.part[0].at_mm;
            (at[0], at[1]) = (at[0] + dx, at[1] + dy);
        };
        let set = set_but(scene("osc", *seed), *seed, 5.0, lie);
        let mut who = Yes::always();
        let report = set.run(&set.options("osc.toml", "job", 34.0), &mut who).unwrap();
        println!("seed {seed}, {dx} {dy} mm aside: {:?} {}\n  {}", report.outcome, report.why, who.told.join("\n  "));
        let told = who.told.iter().filter(|l| l.contains("the sweep moved by")).count();
        assert_eq!(who.asked.iter().filter(|s| **s == "scan").count(), 1 + told, "{:?}", who.asked);
        moved += usize::from(told > 0);
        let judged = set.served.cell.insertion();
        let right = judged.as_ref().is_some_and(|j| j.inserted && j.lateral_mm <= 0.15);
        assert!(right == (report.outcome == Outcome::Inserted), "{judged:?}");
        inserted += usize::from(right);
        assert_eq!(set.served.cell.collisions(), 0);
    }
    println!("{inserted} of {} inserted, {moved} after the sweep was moved", cases.len());
    // Along the stripe the part stays in the picture: there nothing is moved.
    assert!(4 * moved >= cases.len() && 20 * inserted >= 19 * cases.len(), "{moved} moved, {inserted} inserted");
}

#[test]
fn sockets_of_many_cells_are_filled() {
    let Some(long) = std::env::var_os("SHEETLIGHT_LONG") else { return };
    let seeds = long.to_str().and_then(|s| s.parse().ok()).filter(|n| *n > 1).unwrap_or(20);
    let (mut squares, mut worst, mut count) = (0.0, 0f64, 0);
    for seed in 1..=seeds {
        for (part, sweep) in [("led", 40.0), ("osc", 34.0), ("flash", 44.0), ("dimm", 40.0)] {
            let (report, insertion, collisions, _) = inserted(part, seed, 10.0, sweep);
            assert_eq!(report.outcome, Outcome::Inserted, "{part} {seed}: {}", report.why);
            let judged = insertion.unwrap();
            assert!(judged.inserted && collisions == 0, "{part} {seed}: {judged:?}");
            squares += judged.lateral_mm * judged.lateral_mm;
            (worst, count) = (worst.max(judged.lateral_mm), count + 1);
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    println!("{count} of {count} inserted, lateral rms {rms:.4} mm, worst {worst:.4} mm");
    assert!(rms <= 0.06 && worst <= 0.15);
}

#[test]
fn nothing_moves_towards_a_part_that_is_another_one() {
    // An LED's socket lies there, the oscillator's is looked for.
    let set = set(scene("led", 2), 2, 2.0);
    let mut who = Yes::always();
    let report = set.run(&set.options("osc.toml", "job", 24.0), &mut who).unwrap();
    assert_eq!(report.outcome, Outcome::Stopped);
    assert!(!report.why.is_empty() && !who.asked.contains(&"approach"), "{}: {:?}", report.why, who.asked);
    let moves = set.served.cell.moves();
    println!("{}; {moves} moves, all of touch and scan", report.why);
    // A no at the first question moves nothing at all.
    let mut no = Yes { no_at: Some("touch"), ..Yes::always() };
    let report = set.run(&set.options("osc.toml", "another", 24.0), &mut no).unwrap();
    assert!(report.why.contains("by the operator") && set.served.cell.moves() == moves);
}

#[test]
fn a_job_that_was_cut_off_backs_out_or_goes_on() {
    let set = set(scene("osc", 1), 1, 0.0);
    let options = set.options("osc.toml", "job", 20.0);
    std::fs::create_dir_all(&options.out).unwrap();
    let start = set.served.cell.true_flange(0.0);
    // As kill -9 in the motion down leaves it.
    let down = sheetlight::geometry::Rigid::new(
        start.rotation,
        start.translation - sheetlight::geometry::Vec3::new(0.0, 0.0, 40.0),
    );
    let above = |mm: f64| {
        sheetlight::geometry::Rigid::new(
            start.rotation,
            down.translation + sheetlight::geometry::Vec3::new(0.0, 0.0, mm),
        )
    };
    let state = JobState {
        phase: Phase::Insert,
        moving: true,
        poses: Some([above(30.0), down, above(60.0)]),
        ..JobState::new(start)
    };
    state.store(&options.out).unwrap();
    // Nobody has looked at the robot since: no program says so by itself.
    let mut who = Yes { has_looked: false, ..Yes::always() };
    let refused = set.run(&options, &mut who).unwrap_err().what;
    assert!(refused.contains("nobody has looked at the robot") && who.asked.is_empty(), "{refused}");
    assert_eq!(set.served.cell.moves(), 0);
    let mut who = Yes::always();
    let report = set.run(&options, &mut who).unwrap();
    assert_eq!(who.asked, ["retract"]);
    assert!(report.outcome == Outcome::Stopped && report.why.contains("backed out"), "{}", report.why);
    let now = set.served.cell.true_flange(set.served.cell.clock().now());
    let rose = now.translation.z - start.translation.z;
    assert!((rose - 20.0).abs() < 0.5 && set.served.cell.insertion().is_none(), "{rose}");
    // What ended stays ended.
    let again = set.run(&options, &mut who).unwrap();
    assert!(again.outcome == Outcome::Stopped && set.served.cell.moves() == 1);
}
