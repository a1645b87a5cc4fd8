//! Jobs that STOP ends in each of their phases, and the same jobs taken up again.

use super::trap::{Trap, TrapCamera, TrapPerson, What, When};
use super::workplace::{Set, Yes, scene, set};
use sheetlight::capture::source::cell::CellCamera;
use sheetlight::find::Recipe;
use sheetlight::station::job::{Job, JobOptions, JobReport, JobState, Outcome, Phase, Resumes};

/// Runs a job into a STOP.
fn stopped(set: &Set, options: &JobOptions, when: When) -> (JobReport, Vec<&'static str>) {
    let trap = Trap::new(What::Stop, when, &set.served, &options.out);
    let mut guard = set.guard();
    trap.may_stop(&guard.stop_button());
    let camera = TrapCamera(CellCamera::open(&set.served.camera.to_string(), -1.0).unwrap(), trap.clone());
    let mut who = TrapPerson::new(&trap);
    let report = Job::open(options, &mut guard, Box::new(camera), &mut who).unwrap().run().unwrap();
    assert!(trap.fired().is_some(), "{when:?}: {} {:?}", report.why, who.told);
    (report, who.asked)
}

/// Phase that it is to be stopped in, when, and how it goes on.
const ALL: [(Phase, When, Resumes); 6] = [
    (Phase::Touch, When::Pictures("touch"), Resumes::Anew),
    (Phase::Scan, When::Pictures("scan"), Resumes::Anew),
    // STOP while the part is looked for: the next motion is refused, and the arm stands where the scan ended.
    (Phase::Approach, When::Told("points from"), Resumes::Anew),
    (Phase::Approach, When::Moving("approach"), Resumes::Up),
    (Phase::Insert, When::Moving("insert"), Resumes::Up),
    (Phase::Retract, When::Moving("retract"), Resumes::Up),
];

#[test]
fn a_job_that_was_stopped_measures_anew_or_at_the_part_goes_back_up() {
    for (phase, when, resumes) in ALL {
        let set = set(scene("osc", 3), 3, 2.0);
        // Slow, so that STOP comes while it moves.
        let options = JobOptions { speed_mm_s: Some(20.0), ..set.options("osc.toml", "job", 28.0) };
        let (report, asked) = stopped(&set, &options, when);
        let state = JobState::load(&options.out).unwrap().unwrap();
        let said = format!("{when:?}: {report:?}, asked {asked:?}");
        assert_eq!((state.phase, state.stopped, state.resumes()), (phase, true, resumes), "{said}");
        assert!(report.outcome == Outcome::Stopped && report.why.contains("STOP was pressed"), "{said}");
        assert_eq!((report.phase, report.resumes), (phase, resumes), "{said}");
        let stood = set.served.cell.true_flange(set.served.cell.clock().now()).translation.z;
        let mut who = Yes::always();
        let again = set.run(&JobOptions { speed_mm_s: None, ..options.clone() }, &mut who).unwrap();
        let now = set.served.cell.true_flange(set.served.cell.clock().now()).translation.z;
        let said = format!("{said}; again {again:?}, asked {:?}, told {:?}, {stood} to {now} mm", who.asked, who.told);
        let inserted = set.served.cell.insertion().is_some_and(|i| i.inserted);
        match (resumes, phase) {
            (Resumes::Anew, _) => {
                assert!(who.asked.starts_with(&["touch"]) && inserted, "{said}");
                assert_eq!(again.outcome, Outcome::Inserted, "{said}");
            }
            // The component was let go: only the tool has to come back.
            (_, Phase::Retract) => {
                assert_eq!(
                    (&who.asked[..], again.outcome, inserted),
                    (&["retract"][..], Outcome::Inserted, true),
                    "{said}"
                );
            }
            // Stopped before it left the height that the way back ends at: there is nowhere to go.
            _ if who.asked.is_empty() => {
                assert_eq!(again.phase, Phase::BackedOut, "{said}");
                assert!(
                    phase == Phase::Approach && now >= stood - 0.1 && set.served.cell.insertion().is_none(),
                    "{said}"
                );
            }
            _ => {
                assert_eq!((&who.asked[..], again.phase), (&["retract"][..], Phase::BackedOut), "{said}");
                assert!(again.why.contains("nothing was inserted") && again.resumes == Resumes::Over, "{said}");
                // Approach ends 30 mm above the part, the way back 60 mm above it.
                assert!(now > stood + 1.0 && set.served.cell.insertion().is_none(), "{said}");
            }
        }
        assert_eq!(set.served.cell.collisions(), 0, "{said}");
        println!("{said}");
    }
}

/// Files of before the phase was kept beside `stopped`.
#[test]
fn former_files_of_jobs_go_on() {
    let set = set(scene("osc", 1), 1, 0.0);
    let start = set.served.cell.true_flange(0.0);
    let poses = Some([start; 3]);
    let cases = [
        ("stopped", None, "no spot", (Phase::Touch, true, Resumes::Anew)),
        ("stopped", poses, "STOP was pressed", (Phase::Retract, true, Resumes::Up)),
        ("stopped", poses, "backed out: nothing was inserted", (Phase::BackedOut, true, Resumes::Over)),
        ("scan", None, "", (Phase::Scan, false, Resumes::On)),
        ("insert", poses, "", (Phase::Insert, false, Resumes::On)),
        ("done", poses, "", (Phase::Done, false, Resumes::Over)),
    ];
    for (phase, poses, why, wanted) in cases {
        let state = JobState { poses, why: why.into(), ..JobState::new(start) };
        let mut value = serde_json::to_value(state).unwrap();
        let object = value.as_object_mut().unwrap();
        object.remove("stopped");
        object.insert("format".into(), 1.into());
        object.insert("phase".into(), phase.into());
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("job.json"), sheetlight::rig::sealed(&value)).unwrap();
        let read = JobState::load(folder.path()).unwrap().unwrap();
        assert_eq!((read.phase, read.stopped, read.resumes()), wanted, "{phase} {why:?}");
        assert_eq!((read.poses, &*read.why, read.format), (poses, why, 2));
    }
}

/// What the documents say of how far above the part a recipe keeps the tool.
#[test]
fn the_documents_name_the_clearance() {
    let here = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let recipe = Recipe::load(&here.join("data/recipes/osc.toml")).unwrap();
    // Drawn on one surface: what is left is the clearance.
    let clear = recipe.insertion.least_above_mm(&recipe.drawing());
    for (file, says) in [
        ("docs/robots.md", format!("the drawn depth of the part and {clear} mm")),
        ("docs/file-formats.md", format!("from the drawn depth of the part and {clear} mm up")),
    ] {
        let text = std::fs::read_to_string(here.join(file)).unwrap();
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains(&says), "{file}: {says}");
    }
}

/// A retract pose that is the insertion pose says no way up: the arm is not left in the part without a word.
#[test]
fn a_way_up_that_is_none_is_a_fault() {
    let set = set(scene("osc", 1), 1, 0.0);
    let options = set.options("osc.toml", "job", 20.0);
    std::fs::create_dir_all(&options.out).unwrap();
    let start = set.served.cell.true_flange(0.0);
    for released in [false, true] {
        let poses = Some([start; 3]);
        JobState { phase: Phase::Insert, moving: true, released, poses, ..JobState::new(start) }
            .store(&options.out)
            .unwrap();
        let report = set.run(&options, &mut Yes::always()).unwrap();
        assert!(report.outcome == Outcome::Stopped && report.why.contains("0.000 mm from its insertion"), "{report:?}");
        assert_eq!((report.resumes, set.served.cell.moves()), (Resumes::Up, 0), "{report:?}");
    }
}
