//! A station in ROS 2. In: its registers, calls of services. Out: jobs under the station's own rules; what it shows, as
//! diagnostics and poses.
//!
//! Data flows one way: the registers -> `watch` -> `message` (in the order of angles of `notation`) -> the door. Calls
//! flow back: the door -> `calls` -> the registers.
//! Frame and unit: s; poses in m in the frame that the options name.

mod calls;
mod message;
mod notation;
mod watch;

pub use notation::Notation;

use crate::door::{Answered, Door, Topic};
use crate::fault::{Fault, fault};
use crate::qos::Qos;
use calls::Call;
use sheetlight_registers::{Job, Stage, Station, Target};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};
use watch::Watch;

/// Time between two messages of diagnostics.
const TELL: Duration = Duration::from_secs(1);
/// Time between two looks at what the station shows.
const LOOK: Duration = Duration::from_millis(100);

/// What is shown of which station.
pub struct Wanted<'a> {
    /// HOST:PORT of its registers.
    pub address: &'a str,
    /// The recipes that have services.
    pub recipes: &'a [String],
    /// The recordings that have a service.
    pub recordings: &'a [String],
    /// Order of the angles of its poses; without it no poses are sent.
    pub notation: Option<Notation>,
    /// The frame of its poses.
    pub frame: &'a str,
}

/// Serves a station until it is to stop.
pub fn serve(door: &mut Door, wanted: &Wanted, stop: &dyn Fn() -> bool) -> Result<(), Fault> {
    let watch = Arc::new(Watch::default());
    let told = watch.clone();
    let station = Station::begin(wanted.address.to_owned(), move |seen| told.saw(seen));
    let station =
        station.map_err(|e| fault(format!("no thread: {e}"), "the system has none left", "close other programs"))?;
    let mut services = Vec::new();
    for call in calls(wanted) {
        let (station, watch, service) = (station.clone(), watch.clone(), call.service());
        crate::say(&format!("service {:<34} {}", door.name(&service), message::TRIGGER.0));
        services.push(door.answer(&service, message::TRIGGER, move |request| {
            if !message::is_request(request) {
                return Answered::Foreign("wanted an empty request of std_srvs/srv/Trigger, as CDR");
            }
            let (success, words) = call.made(&station, &watch);
            Answered::Bytes(message::answer(success, &words))
        })?);
    }
    let kept = |kept| Qos { reliable: true, kept, depth: 1 };
    let mut diagnostics = door.publish_as("/diagnostics", message::DIAGNOSTICS, kept(false))?;
    let mut poses = match wanted.notation {
        Some(notation) => Some(Poses {
            topic: door.publish_as("/sheetlight/insertion", message::POSE, kept(true))?,
            notation,
            last: None,
        }),
        None => None,
    };
    let mut told: Option<Instant> = None;
    while !stop() {
        let shown = watch.newest();
        let at = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        if let (Some(poses), Ok(seen)) = (&mut poses, &shown.seen) {
            poses.follow(&seen.job, at, wanted.frame)?;
        }
        if told.is_none_or(|told| told.elapsed() >= TELL) {
            told = Some(Instant::now());
            diagnostics.send(&message::diagnostics(at, wanted.address, &shown))?;
            door.look();
        }
        std::thread::sleep(LOOK);
    }
    Ok(())
}

/// The calls that have services. A recipe or recording that is named twice would answer each call twice.
fn calls(wanted: &Wanted) -> impl Iterator<Item = Call> {
    let once = |names: &[String]| names.iter().cloned().collect::<BTreeSet<String>>();
    let of_parts = once(wanted.recipes).into_iter().flat_map(|r| [Call::Insert(r.clone()), Call::Find(r)]);
    let scans = once(wanted.recordings).into_iter().map(Some).chain([None]).map(Call::Scan);
    of_parts.chain(scans).chain(Target::ALL.map(Call::Calibrate)).chain([Call::Stop])
}

/// The topic of insertion poses.
struct Poses {
    topic: Topic,
    notation: Notation,
    /// The last job that had ended when it was seen.
    last: Option<u32>,
}

impl Poses {
    /// Sends the pose of a job that found its part, once. A job that ended otherwise has no pose to insert at. One that
    /// had ended before this program came is old, and its time is unknown: its pose is not sent.
    fn follow(&mut self, job: &Job, at: Duration, frame: &str) -> Result<(), Fault> {
        if job.stage.is_under_way() || self.last == Some(job.number) {
            self.last = self.last.or(Some(0));
            return Ok(());
        }
        let is_new = self.last.replace(job.number).is_some();
        if !is_new || job.stage != Stage::Done || job.found != 1 || job.pose == [0.0; 6] {
            return Ok(());
        }
        let [x, y, z, a, b, c] = job.pose;
        let position_m = [x, y, z].map(|mm| mm / 1000.0);
        self.topic.send(&message::pose(at, frame, position_m, self.notation.quaternion([a, b, c])))
    }
}
