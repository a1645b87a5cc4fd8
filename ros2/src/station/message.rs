//! In: what a station shows. Out: messages of ROS 2 with their types, as CDR of version 1, little endian.
//! Frame and unit: m, quaternions x y z w; values of diagnostics name their units.

use super::watch::Shown;
use sheetlight_registers::{Job, Seen};
use std::time::Duration;

/// A service whose request is empty, and whose answer is whether it went well and words.
pub const TRIGGER: (&str, &str) = (
    "std_srvs/srv/Trigger",
    "std_srvs/srv/Trigger_Request request_message\nstd_srvs/srv/Trigger_Response response_message\n\
     std_srvs/srv/Trigger_Event event_message\n===\nMSG: std_srvs/srv/Trigger_Request\n===\n\
     MSG: std_srvs/srv/Trigger_Response\nbool success\nstring message\n===\nMSG: std_srvs/srv/Trigger_Event\n\
     service_msgs/ServiceEventInfo info\nstd_srvs/srv/Trigger_Request[<=1] request\n\
     std_srvs/srv/Trigger_Response[<=1] response\n===\nMSG: service_msgs/ServiceEventInfo\nuint8 event_type\n\
     builtin_interfaces/Time stamp\nchar[16] client_gid\nint64 sequence_number\n===\n\
     MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
);
/// Figures with a level.
pub const DIAGNOSTICS: (&str, &str) = (
    "diagnostic_msgs/msg/DiagnosticArray",
    "std_msgs/Header header\nDiagnosticStatus[] status\n===\nMSG: diagnostic_msgs/DiagnosticStatus\nbyte level\n\
     string name\nstring message\nstring hardware_id\nKeyValue[] values\n===\nMSG: diagnostic_msgs/KeyValue\n\
     string key\nstring value\n===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n===\n\
     MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
);
/// A pose with frame and time.
pub const POSE: (&str, &str) = (
    "geometry_msgs/msg/PoseStamped",
    "std_msgs/Header header\nPose pose\n===\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n===\n\
     MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n===\nMSG: geometry_msgs/Quaternion\nfloat64 x\n\
     float64 y\nfloat64 z\nfloat64 w\n===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n===\n\
     MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
);

/// Levels of a status.
const OK: u8 = 0;
const WARN: u8 = 1;
const ERROR: u8 = 2;

/// A message that is being written. Numbers are aligned to their size behind the four bytes of the head.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Cdr {
        Cdr(vec![0, 1, 0, 0])
    }

    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        let body = self.0.len() - 4;
        self.0.resize(4 + body.next_multiple_of(N), 0);
        self.0.extend_from_slice(&bytes);
    }

    fn count(&mut self, n: usize) {
        self.number((n as u32).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
    }

    fn header(&mut self, at: Duration, frame: &str) {
        self.number((at.as_secs() as i32).to_le_bytes());
        self.number(at.subsec_nanos().to_le_bytes());
        self.text(frame);
    }
}

/// Whether the bytes are the request of a Trigger: nothing, as the byte that a type without fields has.
pub fn is_request(bytes: &[u8]) -> bool {
    matches!(bytes, [0, 0 | 1, _, _, ..]) && bytes.len() <= 8
}

/// The answer of a Trigger.
pub fn answer(success: bool, words: &str) -> Vec<u8> {
    let mut m = Cdr::new();
    m.number([u8::from(success)]);
    m.text(words);
    m.0
}

/// A pose in a frame. `at` counts from 1970.
pub fn pose(at: Duration, frame: &str, position_m: [f64; 3], turn: [f64; 4]) -> Vec<u8> {
    let mut m = Cdr::new();
    m.header(at, frame);
    for number in position_m.into_iter().chain(turn) {
        m.number(number.to_le_bytes());
    }
    m.0
}

/// The state of a station. `at` counts from 1970.
pub fn diagnostics(at: Duration, address: &str, shown: &Shown) -> Vec<u8> {
    let (level, words) = state(shown);
    let values = shown.seen.as_ref().map(values).unwrap_or_default();
    let mut m = Cdr::new();
    m.header(at, "");
    m.count(1);
    m.number([level]);
    m.text("sheetlight: station");
    m.text(&words);
    m.text(address);
    m.count(values.len());
    for (key, value) in values {
        m.text(key);
        m.text(&value);
    }
    m.0
}

/// Level and words of a station's state.
fn state(shown: &Shown) -> (u8, String) {
    let seen = match &shown.seen {
        Ok(seen) if !seen.jobs => return (OK, "it runs no jobs: its robot is moved by a client".into()),
        Ok(seen) => seen,
        Err(why) => return (ERROR, format!("not reached: {why}")),
    };
    let job = &seen.job;
    let words = match job.asks {
        "" if job.stage.is_under_way() => format!("job {} {}", job.number, job.stage.word()),
        "" => "idle".to_owned(),
        asks => format!("job {}: {asks} waits for a person at the screen", job.number),
    };
    match seen.robot {
        robot if robot.look => (WARN, "somebody has to look at the robot".into()),
        robot if !robot.linked => (WARN, format!("{words}, the robot is not linked")),
        _ if job.stage.is_over() && job.error != 0 => (WARN, format!("job {}: {}", job.number, job.words)),
        _ => (OK, words),
    }
}

fn values(seen: &Seen) -> Vec<(&'static str, String)> {
    let (robot, job) = (seen.robot, &seen.job);
    vec![
        ("robot linked", robot.linked.to_string()),
        ("robot armed", robot.armed.to_string()),
        ("robot moves", robot.moves.to_string()),
        ("screen operates", robot.attended.to_string()),
        ("job", job.number.to_string()),
        ("job state", job.stage.word().to_owned()),
        ("job phase", job.phase.to_owned()),
        ("waits for a person", job.asks.to_owned()),
        ("job error", job.error.to_string()),
        ("job error words", job.words.clone()),
        ("recording", job.recording.clone()),
        ("calibration verdict", job.verdict.word().to_owned()),
        ("gates missed", missed(job).join(", ")),
        ("jobs ended", seen.ended.to_string()),
        ("components inserted", seen.inserted.to_string()),
    ]
}

/// Names of the gates that a job missed.
pub fn missed(job: &Job) -> Vec<&'static str> {
    job.judged.iter().copied().filter(|gate| !job.passed.contains(gate)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::definition::Definition;
    use crate::{cdr, hash};
    use std::time::Instant;

    fn definition((name, text): (&str, &str)) -> Definition {
        Definition::read(name, text.as_bytes()).unwrap()
    }

    /// The hash of the service is that of ROS 2 Jazzy, as programs that talk to it have published it; those of the
    /// messages are compared in tests/ros2.py.
    #[test]
    fn the_service_is_the_one_of_ros_2() {
        let published = "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f";
        assert_eq!(hash::of(&definition(TRIGGER)), published);
    }

    #[test]
    fn messages_are_of_their_types() {
        let at = Duration::new(7, 9);
        let seen = Seen { jobs: true, ..Seen::default() };
        for seen in [Ok(seen), Err("no route".to_owned())] {
            let shown = Shown { seen, since: Instant::now() };
            let message = diagnostics(at, "127.0.0.1:5020", &shown);
            assert_eq!(cdr::check(&message, &definition(DIAGNOSTICS)), Ok(()));
        }
        for frame in ["", "a", "base", "base_link"] {
            let message = pose(at, frame, [0.0; 3], [0.0, 0.0, 0.0, 1.0]);
            assert_eq!(cdr::check(&message, &definition(POSE)), Ok(()), "{frame}");
        }
        let response = "bool success\nstring message\n";
        assert_eq!(cdr::check(&answer(true, "x"), &definition(("a/msg/R", response))), Ok(()));
    }

    #[test]
    fn a_request_is_an_empty_one() {
        for good in [&[0, 1, 0, 0][..], &[0, 1, 0, 0, 0], &[0, 0, 0, 0, 0], &[0, 1, 0, 3, 0, 0, 0, 0]] {
            assert!(is_request(good), "{good:?}");
        }
        for bad in [&[][..], &[0, 1, 0], &[1, 1, 0, 0], &[0, 2, 0, 0], b"insert led", &[0, 1, 0, 0, 1, 2, 3, 4, 5]] {
            assert!(!is_request(bad), "{bad:?}");
        }
    }

    #[test]
    fn a_state_has_a_level() {
        let level = |change: &dyn Fn(&mut Seen)| {
            let mut seen = Seen { jobs: true, ..Seen::default() };
            seen.robot.linked = true;
            change(&mut seen);
            state(&Shown { seen: Ok(seen), since: Instant::now() }).0
        };
        assert_eq!(level(&|_| {}), OK);
        assert_eq!(level(&|seen| seen.robot.look = true), WARN);
        assert_eq!(level(&|seen| seen.robot.linked = false), WARN);
        let lost = Shown { seen: Err("gone".into()), since: Instant::now() };
        assert_eq!(state(&lost), (ERROR, "not reached: gone".to_owned()));
    }
}
