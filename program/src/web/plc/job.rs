//! In: a job of the screen, as it is stored and as it runs. Out: what the registers show of it.
//! Frame and unit: poses in a notation; s since 1970.

use super::recording::target_shown;
use crate::procedure::calibrate::Calibration;
use crate::web::message::{CalibrationFigures, Job, JobState, MotionState, Order, Outcome};
use crate::web::work::{Jobs, insertion_of, report_of};
use sheetlight::rig::Verdict;
use sheetlight::robot::Convention;
use sheetlight::station::job::{JobState as Insertion, Phase};
use sheetlight::station::socket::words::{Code, Of, Which, Wrong};
use sheetlight::station::socket::{JobShown, Made, Part, Stage, request};
use std::path::Path;
use std::time::UNIX_EPOCH;

/// What is on the disk of a job.
#[derive(Clone, Debug, Default)]
pub(super) struct Stored {
    phase: Option<Phase>,
    /// The part that it found.
    pub part: Option<Part>,
}

/// The request that makes such a job; `None` for other procedures.
pub(super) fn procedure(order: &Order) -> Option<u16> {
    match order {
        Order::Find(_) => Some(request::FIND),
        Order::Insert(_) => Some(request::INSERT),
        Order::Scan(_) => Some(request::SCAN),
        Order::Calibrate(_) => Some(request::CALIBRATE),
        _ => None,
    }
}

/// Whether such a job finds or inserts a part.
pub(super) fn is_of_parts(order: &Order) -> bool {
    matches!(order, Order::Find(_) | Order::Insert(_))
}

/// Whether the job neither waits nor runs.
pub(super) fn has_ended(job: &Job) -> bool {
    !matches!(job.state, JobState::Queued | JobState::Running)
}

/// Reads what is on the disk of a job. A file that cannot be read shows nothing: the job itself says why.
pub(super) fn stored(jobs: &Jobs, job: &Job) -> Stored {
    let Ok(report) = report_of(jobs, job) else { return Stored::default() };
    let Order::Insert(_) = job.order else {
        let part = (job.state == JobState::Done).then(|| Part::load(&report).ok()).flatten();
        return Stored { phase: None, part };
    };
    let Ok(folder) = insertion_of(jobs, &job.id) else { return Stored::default() };
    let Some(state) = Insertion::load(&folder).ok().flatten() else {
        // It stores its state when it has moved first.
        return Stored { phase: (job.state == JobState::Running).then_some(Phase::Touch), part: None };
    };
    // A job that measures again has the report of before until it finds the part anew.
    let fresh = state.scanned_at.is_some_and(|scanned| written_at(&report) >= scanned);
    Stored { phase: Some(state.phase), part: fresh.then(|| Part::load(&report).ok()).flatten() }
}

/// Time at which a file was written, seconds since 1970; minus infinity without a file.
fn written_at(path: &Path) -> f64 {
    let written = path.metadata().and_then(|m| m.modified()).ok();
    let since = written.and_then(|t| t.duration_since(UNIX_EPOCH).ok());
    since.map_or(f64::NEG_INFINITY, |t| t.as_secs_f64())
}

/// The job as registers show it.
pub(super) fn shown(job: &Job, stored: &Stored, motion: &MotionState, notation: Convention) -> Option<JobShown> {
    let stage = match job.state {
        JobState::Queued => Stage::Waits,
        JobState::Running => Stage::Runs,
        JobState::Done => Stage::Done,
        JobState::Failed => Stage::Failed,
        JobState::Stopped => Stage::Stopped,
        JobState::CutOff => Stage::CutOff,
    };
    let asked = motion.asked.as_ref().filter(|asked| asked.job == job.id && !motion.moving);
    let pose = |part: &Part| part.give(Which::Insertion, Of::Tool, None, notation).ok();
    Some(JobShown {
        number: job.id.split('-').next()?.parse().ok()?,
        procedure: procedure(&job.order)?,
        stage,
        phase: stored.phase,
        asks: asked.and_then(|asked| phase(&asked.step)),
        error: error(job),
        part: stored.part.clone().map(|part| {
            let pose = pose(&part);
            (part, pose)
        }),
        made: made(job),
    })
}

/// What a scan or calibration makes of its recording.
fn made(job: &Job) -> Option<Made> {
    let mut made = match &job.order {
        Order::Scan(ask) => Made { recording: ask.recording.clone(), ..Made::default() },
        Order::Calibrate(ask) => {
            Made { recording: ask.recording().to_owned(), target: target_shown(ask.target()), ..Made::default() }
        }
        _ => return None,
    };
    match &job.outcome {
        Some(Outcome::Scan(scan)) => (made.shots, made.points) = (scan.shots, scan.points),
        Some(Outcome::Calibrate(figures)) => made.verdict = verdict(figures),
        _ => {}
    }
    Some(made)
}

/// The verdict by its words.
fn verdict(figures: &CalibrationFigures) -> Option<Verdict> {
    use Verdict::{BadlyDetermined, Good, Refused, Usable};
    [Good, Usable, BadlyDetermined, Refused].into_iter().find(|verdict| verdict.words() == figures.verdict)
}

/// The phase of a step, by the name that is shown to a person.
fn phase(step: &str) -> Option<Phase> {
    Some(match step {
        "touch" => Phase::Touch,
        "scan" => Phase::Scan,
        "approach" => Phase::Approach,
        "insert" => Phase::Insert,
        "retract" => Phase::Retract,
        _ => return None,
    })
}

/// Why a job ended without its result, in the job's own words.
fn error(job: &Job) -> Option<Wrong> {
    let words = job.problem.as_ref().map_or("", |problem| problem.what.as_str());
    let code = match job.state {
        JobState::Queued | JobState::Running => return None,
        JobState::Done => return short_of(job.outcome.as_ref()?),
        JobState::Stopped => Code::Stopped,
        JobState::CutOff => return Some(Wrong::new(Code::CutOff, "the program ended while the job ran")),
        JobState::Failed => match job.problem.as_ref().map_or("", |problem| problem.kind.as_str()) {
            "refused" => Code::Refused,
            "output" => Code::Full,
            "usage" | "input" => Code::Station,
            _ => Code::Failed,
        },
    };
    Some(Wrong::new(code, words))
}

/// What a result lacks that the next step needs: a pose to insert at, a calibration that may be accepted.
fn short_of(outcome: &Outcome) -> Option<Wrong> {
    let what = match outcome {
        Outcome::Find(found) if found.poses.is_none() => format!("no pose: {}", found.reasons.join("; ")),
        Outcome::Calibrate(figures) if verdict(figures) >= Some(Verdict::BadlyDetermined) => {
            format!("the calibration is {}: {}", figures.verdict, figures.reasons.join("; "))
        }
        _ => return None,
    };
    Some(Wrong::new(Code::Refused, what))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedure::calibrate::Target;
    use crate::web::message::{CalibrateOrder, InsertOrder, Problem, ScanFigures, ScanOrder};
    use sheetlight::fault::Fault;

    fn job(state: JobState, fault: Option<Fault>) -> Job {
        Job {
            format: 1,
            id: "0012-insert".into(),
            order: Order::Insert(InsertOrder { recipe: "osc".into(), ..InsertOrder::default() }),
            state,
            done: 0,
            of: None,
            created: String::new(),
            seconds: 0.0,
            problem: fault.as_ref().map(Problem::from),
            outcome: None,
            resumable: false,
        }
    }

    #[test]
    fn a_fault_of_each_kind_has_its_code_and_keeps_its_words() {
        let code = |state, fault: Option<Fault>| {
            let shown = shown(&job(state, fault), &Stored::default(), &MotionState::default(), Convention::Denso);
            shown.unwrap().error.map(|e| (e.code as u16, e.words))
        };
        let said = |code: u16| Some((code, "it is so".to_owned()));
        for (fault, number) in [
            (Fault::refused("it is so"), 4),
            (Fault::device("it is so"), 5),
            (Fault::output("it is so"), 13),
            (Fault::input("it is so"), 14),
            (Fault::usage("it is so"), 14),
        ] {
            assert_eq!(code(JobState::Failed, Some(fault)), said(number));
        }
        assert_eq!(code(JobState::Stopped, Some(Fault::refused("it is so"))), said(12));
        assert_eq!(code(JobState::CutOff, None).unwrap().0, 15);
        assert_eq!([JobState::Queued, JobState::Running, JobState::Done].map(|s| code(s, None)), [None, None, None]);
    }

    #[test]
    fn a_number_that_is_no_number_of_ours_shows_nothing() {
        let shown = |id: &str| {
            let job = Job { id: id.into(), ..job(JobState::Done, None) };
            super::shown(&job, &Stored::default(), &MotionState::default(), Convention::Denso).map(|s| s.number)
        };
        assert_eq!([shown("0012-insert"), shown("x"), shown("99999999999-insert")], [Some(12), None, None]);
    }

    fn shown_of(job: &Job) -> JobShown {
        shown(job, &Stored::default(), &MotionState::default(), Convention::Denso).unwrap()
    }

    #[test]
    fn a_scan_shows_its_recording_and_at_its_end_its_numbers() {
        let order = ScanOrder { recording: "a/b".into(), ..ScanOrder::default() };
        let runs = Job { id: "0013-scan".into(), order: Order::Scan(order), ..job(JobState::Running, None) };
        let of_it = Made { recording: "a/b".into(), ..Made::default() };
        assert_eq!((shown_of(&runs).procedure, shown_of(&runs).made), (1, Some(of_it.clone())));
        let figures = ScanFigures {
            shots: 70,
            points: 70_001,
            width: 1,
            height: 1,
            frame: "base".into(),
            median_sigma_mm: None,
            coverage: None,
            cell_mm: None,
            z_mm: None,
            peaks: Default::default(),
            dark_shots: 0,
            skipped: vec![],
            seconds: 1.0,
            shots_per_second: 1.0,
            ran_on: String::new(),
            spent: Default::default(),
            remarks: vec![],
        };
        let done = Job { state: JobState::Done, outcome: Some(Outcome::Scan(Box::new(figures))), ..runs };
        let shown = shown_of(&done);
        assert_eq!((shown.made, shown.error), (Some(Made { shots: 70, points: 70_001, ..of_it }), None));
    }

    #[test]
    fn a_calibration_shows_its_verdict_and_what_nobody_may_accept_is_an_error() {
        let of = |verdict: Option<Verdict>| {
            let ask = CalibrateOrder::new(Target::HandEye, "a".into());
            let figures = |verdict: Verdict| CalibrationFigures {
                kind: "hand_eye".into(),
                verdict: verdict.words().into(),
                reasons: vec!["few poses".into(), "small turns".into()],
                advice: vec![],
                figures: Default::default(),
                former: Default::default(),
                per_picture: vec![],
                left_out: vec![],
                accepted: false,
            };
            let outcome = verdict.map(|v| Outcome::Calibrate(Box::new(figures(v))));
            let state = if verdict.is_some() { JobState::Done } else { JobState::Running };
            let shown = shown_of(&Job { order: Order::Calibrate(ask), outcome, ..job(state, None) });
            let made = shown.made.unwrap();
            assert_eq!((shown.procedure, made.target), (7, target_shown(Target::HandEye)));
            (made.verdict, shown.error.map(|e| (e.code, e.words)))
        };
        assert_eq!(of(None), (None, None));
        for good in [Verdict::Good, Verdict::Usable] {
            assert_eq!(of(Some(good)), (Some(good), None));
        }
        for bad in [Verdict::BadlyDetermined, Verdict::Refused] {
            let words = format!("the calibration is {}: few poses; small turns", bad.words());
            assert_eq!(of(Some(bad)), (Some(bad), Some((Code::Refused, words))));
        }
    }
}
