//! In: calls of services. Out: requests to the station, and answers when their job has ended. The rules are the
//! station's: this only passes calls on.
//! Frame and unit: mm, degrees.

use super::message::missed;
use super::watch::Watch;
use sheetlight_registers::{Ask, Job, Stage, Station, Target, Unanswered};

/// What a call asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Call {
    /// The whole insertion of a recipe's part.
    Insert(String),
    /// Finds a recipe's part in the last scan.
    Find(String),
    /// Scans a recording, or the newest one.
    Scan(Option<String>),
    /// Calibrates from the newest recording that suits.
    Calibrate(Target),
    /// Ends what runs, and halts the arm.
    Stop,
}

impl Call {
    /// Name of its service below the namespace.
    pub fn service(&self) -> String {
        match self {
            Call::Insert(recipe) => format!("/sheetlight/insert/{recipe}"),
            Call::Find(recipe) => format!("/sheetlight/find/{recipe}"),
            Call::Scan(None) => "/sheetlight/scan".to_owned(),
            Call::Scan(Some(recording)) => format!("/sheetlight/scan/{recording}"),
            Call::Calibrate(target) => format!("/sheetlight/calibrate/{}", target.word()),
            Call::Stop => "/sheetlight/stop".to_owned(),
        }
    }

    /// Asks the station, and waits for the end of the job. Returns whether it went well, and words.
    pub fn made(&self, station: &Station, watch: &Watch) -> (bool, String) {
        match &watch.newest().seen {
            Err(why) => return (false, format!("the station is not reached: {why}; nothing was asked")),
            Ok(seen) if !seen.jobs => {
                return (false, "this station runs no jobs: wanted station serve --modbus".to_owned());
            }
            Ok(_) => {}
        }
        let ask = match self {
            Call::Insert(recipe) => Ask::Insert(recipe.clone(), None),
            Call::Find(recipe) => Ask::Find(recipe.clone()),
            Call::Scan(recording) => Ask::Scan(recording.clone()),
            Call::Calibrate(target) => Ask::Calibrate(*target, None),
            Call::Stop => Ask::Stop,
        };
        match station.ask_here(ask) {
            Ok(answer) if answer.error != 0 => (false, format!("refused, {}: {}", answer.error, answer.words)),
            Ok(_) if *self == Call::Stop => (true, "stopped".to_owned()),
            Ok(_) => match watch.newest().seen.map(|seen| seen.job.number) {
                Ok(number) => self.ended(number, watch),
                Err(why) => (false, format!("the station is lost: {why}; a job was started")),
            },
            Err(unanswered) => (false, unheard(&unanswered)),
        }
    }

    fn ended(&self, number: u32, watch: &Watch) -> (bool, String) {
        match watch.end_of(number) {
            Ok(job) => self.outcome(&job),
            Err(why) => (false, format!("job {number} was started; {why}")),
        }
    }

    /// How a job ended.
    fn outcome(&self, job: &Job) -> (bool, String) {
        let number = job.number;
        if job.stage != Stage::Done || job.error != 0 {
            let ended = format!("job {number} {}, error {}: {}", job.stage.word(), job.error, job.words);
            return (false, ended + &recording(job));
        }
        let good = match self {
            Call::Insert(_) => job.phase == "inserted",
            Call::Scan(_) => {
                let scanned = format!("job {number} done: scanned {}", job.recording);
                return (true, format!("{scanned}; {} shots, {} points", job.shots, job.points));
            }
            Call::Calibrate(target) => {
                let made = format!("job {number} done: {} calibrated from {}", target.word(), job.recording);
                let next = "a person has to accept it at the screen";
                return (job.verdict.is_acceptable(), format!("{made}; {}; {next}", job.verdict.word()));
            }
            _ => job.found == 1,
        };
        let gates = missed(job);
        let what = match (self, good) {
            (Call::Insert(_), true) => "inserted".to_owned(),
            (_, true) => "found".to_owned(),
            _ if !gates.is_empty() => format!("not taken, gates missed: {}", gates.join(", ")),
            (Call::Insert(_), false) => format!("not inserted: {}", job.phase),
            _ => "not found".to_owned(),
        };
        (good, format!("job {number} done: {what}{}", pose(job)))
    }
}

/// The recording of a job, in words.
fn recording(job: &Job) -> String {
    if job.recording.is_empty() { String::new() } else { format!("; recording {}", job.recording) }
}

/// The pose that a job found, in words.
fn pose(job: &Job) -> String {
    if job.pose == [0.0; 6] {
        return String::new();
    }
    let six = |numbers: [f64; 6], digits: [usize; 2]| {
        let words = numbers.iter().enumerate().map(|(k, x)| format!("{x:.0$}", digits[k / 3]));
        words.collect::<Vec<_>>().join(" ")
    };
    format!(
        "; insertion {} mm, degrees; sigma {} mm, degrees; score {:.3}",
        six(job.pose, [3, 4]),
        six(job.sigma, [4, 4]),
        job.score
    )
}

/// Why there is no answer, in words.
fn unheard(unanswered: &Unanswered) -> String {
    match unanswered {
        Unanswered::NotReached(why) => format!("{why}; nothing was asked"),
        Unanswered::Lost(why) => format!("{why}; whether the request was executed is unknown, it is not repeated"),
        Unanswered::Busy(why) | Unanswered::Refused(why) => why.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight_registers::Verdict;

    fn job() -> Job {
        Job { number: 12, stage: Stage::Done, phase: "inserted", found: 1, ..Job::default() }
    }

    #[test]
    fn an_end_has_its_words() {
        let insert = Call::Insert("led".into());
        assert_eq!(insert.outcome(&job()), (true, "job 12 done: inserted".into()));
        let back = Job { phase: "backed out", ..job() };
        assert_eq!(insert.outcome(&back), (false, "job 12 done: not inserted: backed out".into()));
        let stopped = Job { stage: Stage::Stopped, error: 12, words: "STOP was pressed".into(), ..job() };
        assert_eq!(insert.outcome(&stopped), (false, "job 12 stopped, error 12: STOP was pressed".into()));
        let find = Call::Find("led".into());
        let place = [300.0, -20.0, 120.5, 180.0, 0.0, 90.0];
        let sigma = [0.01, 0.01, f64::INFINITY, 0.02, 0.02, 0.03];
        let found = Job { pose: place, sigma, score: 0.9131, phase: "", ..job() };
        let words = "job 12 done: found; insertion 300.000 -20.000 120.500 180.0000 0.0000 90.0000 mm, degrees; \
                     sigma 0.0100 0.0100 inf 0.0200 0.0200 0.0300 mm, degrees; score 0.913";
        assert_eq!(find.outcome(&found), (true, words.into()));
        let missed = Job { found: 2, judged: vec!["score", "margin"], passed: vec!["margin"], ..job() };
        assert_eq!(find.outcome(&missed), (false, "job 12 done: not taken, gates missed: score".into()));
        assert_eq!(find.outcome(&Job { found: 0, ..job() }), (false, "job 12 done: not found".into()));
    }

    #[test]
    fn scans_and_calibrations_name_their_recording() {
        let scan = Call::Scan(None);
        let of = |verdict| Job { recording: "a/b".into(), verdict, found: 0, phase: "", ..job() };
        let scanned = Job { shots: 70, points: 70_001, ..of(Verdict::None) };
        let words = "job 12 done: scanned a/b; 70 shots, 70001 points";
        assert_eq!(scan.outcome(&scanned), (true, words.into()));
        let failed = Job { stage: Stage::Failed, error: 14, words: "no plane".into(), ..of(Verdict::None) };
        assert_eq!(scan.outcome(&failed), (false, "job 12 failed, error 14: no plane; recording a/b".into()));
        let plane = Call::Calibrate(Target::LaserPlane);
        let words = |verdict| {
            format!("job 12 done: laser_plane calibrated from a/b; {verdict}; a person has to accept it at the screen")
        };
        assert_eq!(plane.outcome(&of(Verdict::Good)), (true, words("good")));
        assert_eq!(plane.outcome(&of(Verdict::Usable)), (true, words("usable")));
        // A station states an error for these; a verdict that is not known is no success either.
        assert!(!plane.outcome(&of(Verdict::BadlyDetermined)).0 && !plane.outcome(&of(Verdict::None)).0);
        assert_eq!(plane.service(), "/sheetlight/calibrate/laser_plane");
        assert_eq!(Call::Scan(Some("b7".into())).service(), "/sheetlight/scan/b7");
    }
}
