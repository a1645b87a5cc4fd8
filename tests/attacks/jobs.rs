//! In: folders of jobs that a person, a disk or another program has touched. Out: none of them moves a robot: what is
//! not as it was written is refused, and a job goes on with nothing but what its poses were made from.
//! Frame and unit: base frame, mm.

use sheetlight::fault::Fault;
use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use sheetlight::station::job::{JobState, Phase};

fn at(z: f64) -> Rigid<Base, Flange> {
    Rigid::from_vectors(&Vec3::new(3.1, 0.0, 0.0), Vec3::new(412.25, -101.5, z))
}

/// A job that is about to go down to the part.
fn begun() -> JobState {
    JobState {
        phase: Phase::Insert,
        poses: Some([at(130.5), at(71.25), at(160.5)]),
        surface: Some([Vec3::new(400.0, -100.0, 60.0), Vec3::z()]),
        halvings: 0,
        scanned_at: Some(1.7e9),
        made_from: "made of this".into(),
        ..JobState::new(at(300.0))
    }
}

fn refused(what: &str, found: Result<Option<JobState>, Fault>, says: &str) {
    let fault = found.expect_err(what);
    println!("{what:40} | {fault}");
    assert!(fault.to_string().contains(says) && !fault.next.is_empty(), "{what}: {fault}");
}

#[test]
fn an_edited_job_does_not_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("job.json");
    begun().store(folder.path()).unwrap();
    let whole = std::fs::read_to_string(&file).unwrap();
    assert_eq!(JobState::load(folder.path()).unwrap(), Some(begun()));
    let edits = [
        ("the pose goes 10 mm deeper", "71.25", "61.25"),
        ("a minus is lost", "-101.5", "101.5"),
        ("another phase", "\"insert\"", "\"approach\""),
        ("the scan is fresh again", "1700000000.0", "1800000000.0"),
        ("it says that it had let go", "\"released\": false", "\"released\": true"),
        ("nothing was moving", "\"moving\": false", "\"moving\": true"),
        ("made from something else", "made of this", "made of that"),
        ("a key more", "\"format\"", "\"speed\": 100, \"format\""),
    ];
    for (what, from, to) in edits {
        assert!(whole.contains(from), "{what}: {whole}");
        std::fs::write(&file, whole.replace(from, to)).unwrap();
        refused(what, JobState::load(folder.path()), "begin a new job in another folder");
    }
    let seal = whole.lines().find(|l| l.contains("\"seal\"")).unwrap();
    for (what, text) in [
        ("no seal", whole.replace(&format!(",\n{}", seal.trim_end_matches(',')), "").replace(&format!("{seal}\n"), "")),
        ("cut off", whole[..whole.len() / 2].to_owned()),
        ("empty", String::new()),
        ("a list", "[]".to_owned()),
        ("deep", "[".repeat(100_000)),
    ] {
        std::fs::write(&file, text).unwrap();
        refused(what, JobState::load(folder.path()), "begin a new job in another folder");
    }
}

#[test]
fn a_job_goes_on_with_what_it_was_made_from_and_back_up_with_anything() {
    let state = begun();
    assert!(state.goes_on_with("made of this").is_ok());
    let fault = state.goes_on_with("another recipe").unwrap_err();
    assert!(fault.what.contains("another recipe or other calibrations") && !fault.next.is_empty(), "{fault}");
    // The tool is down at the part: the way up does not hang on a recipe.
    assert!(JobState { moving: true, ..begun() }.goes_on_with("another recipe").is_ok());
    assert!(JobState { phase: Phase::Retract, ..begun() }.goes_on_with("another recipe").is_ok());
    // A motion of the scan was cut off: it would be made anew, with another recipe.
    assert!(JobState { phase: Phase::Scan, moving: true, ..begun() }.goes_on_with("another recipe").is_err());
}
