//! In: a station. Out: the state of its screen, in one place that all requests share.
//! Frame and unit: seconds, GB.

use super::camera::Camera;
use super::event::Hub;
use super::found_part::FoundParts;
use super::guard::{Leases, Sessions, Tries};
use super::message::{Bar, CalibrationAge, Event, JobState};
use super::motion::Desk;
use super::robot::Robot;
use super::surface::{Looked, Maps};
use super::work::{Jobs, Place, Views, scan_of};
use super::{disk, station};
use sheetlight::fault::Result;
use sheetlight::gpu::adapters;
use sheetlight::rig::Rig;
use sheetlight::station::Settings;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// Most jobs that a page gets at once.
pub const JOBS: usize = 200;
/// Time after which the bar's data are read from the disk again.
const READ_AGAIN: Duration = Duration::from_secs(10);
/// Free disk space below which the bar shows an alarm, GB.
const LITTLE_DISK: f64 = 2.0;

/// State that all requests share.
pub struct Screen {
    /// Folders of the station.
    pub place: Place,
    /// Running and finished jobs.
    pub jobs: Arc<Jobs>,
    /// The viewers.
    pub hub: Arc<Hub>,
    /// The open sessions.
    pub sessions: Arc<Sessions>,
    /// The lease of the tab that operates.
    pub leases: Leases,
    /// The robot's motions, and their confirmation.
    pub desk: Arc<Desk>,
    /// The password, if other machines may connect.
    pub password: Option<Tries>,
    /// Name of the cookie.
    pub cookie: String,
    /// Detected corners in calibration pictures.
    pub views: Views,
    /// Parts that are drawn over the camera's pictures.
    pub found: FoundParts,
    /// Height maps with their filters.
    pub maps: Maps,
    /// Time at which the program started.
    pub started: Instant,
    adapter: OnceLock<(String, bool)>,
    read: Mutex<Option<Read>>,
}

/// The data from the disk that the bar shows.
#[derive(Clone)]
struct Read {
    at: Instant,
    name: String,
    calibration: Option<CalibrationAge>,
    left_gb: Option<f64>,
    wrong: Vec<String>,
}

impl Screen {
    /// A screen that has read nothing from the disk yet.
    pub fn new(jobs: Arc<Jobs>, sessions: Arc<Sessions>, cookie: String, password: Option<Tries>) -> Screen {
        Screen {
            place: jobs.place.clone(),
            hub: jobs.hub.clone(),
            desk: jobs.desk.clone(),
            jobs,
            sessions,
            leases: Leases::default(),
            password,
            cookie,
            views: Views::default(),
            found: FoundParts::default(),
            started: Instant::now(),
            adapter: OnceLock::new(),
            read: Mutex::default(),
            maps: Maps::default(),
        }
    }

    /// The camera, if one is configured.
    pub fn camera(&self) -> Option<&Arc<Camera>> {
        self.desk.links.camera.as_ref()
    }

    /// The robot, if one is configured.
    pub fn robot(&self) -> Option<&Arc<Robot>> {
        self.desk.links.watched.as_ref()
    }

    /// The system's adapter, queried once; the first query takes a moment.
    pub fn adapter(&self) -> &(String, bool) {
        self.adapter.get_or_init(|| match adapters().first() {
            Some(a) if a.kind == "CPU" => (format!("{} cores", rayon::current_num_threads()), true),
            Some(a) => (a.name.clone(), false),
            None => (format!("{} cores", rayon::current_num_threads()), true),
        })
    }

    fn read(&self) -> Read {
        let mut held = self.read.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(read) = held.as_ref().filter(|r| r.at.elapsed() < READ_AGAIN) {
            return read.clone();
        }
        let (settings, rig) = (Settings::load(&self.place.station), Rig::load(&self.place.station));
        let faults = [settings.as_ref().err(), rig.as_ref().err()];
        let read = Read {
            at: Instant::now(),
            name: settings.as_ref().map(|s| s.name.clone()).unwrap_or_default(),
            calibration: rig.as_ref().ok().and_then(station::age),
            left_gb: disk::left_gb(&self.place.station),
            wrong: faults.into_iter().flatten().map(|f| f.what.clone()).collect(),
        };
        *held = Some(read.clone());
        read
    }

    /// Discards what was read of the station, because something was stored there.
    pub fn forget(&self) {
        *self.read.lock().unwrap_or_else(|e| e.into_inner()) = None;
        self.camera().inspect(|c| c.renew());
    }

    /// The bar in its present state.
    pub fn bar(&self) -> Bar {
        let read = self.read();
        let (adapter, software) = self.adapter().clone();
        let mut alarms = read.wrong;
        if read.left_gb.is_some_and(|gb| gb < LITTLE_DISK) {
            alarms.push(format!("{:.1} GB of disk left", read.left_gb.unwrap_or(0.0)));
        }
        let camera = self.camera().map(|c| c.seen());
        alarms.extend(camera.as_ref().and_then(|c| c.2.clone()));
        let robot = self.robot().map(|r| r.seen()).unwrap_or_default();
        alarms.extend(robot.wrong.clone());
        alarms.extend(self.hub.links().into_iter().filter_map(|link| link.problem));
        let motion = self.desk.state();
        alarms.extend(motion.look.iter().map(|why| format!("look at the robot: {why}")));
        let cut = self.jobs.list(JOBS).iter().filter(|j| j.state == JobState::CutOff).count();
        if cut > 0 {
            alarms.push(format!("{cut} jobs were cut off: resume them or take them away"));
        }
        let of_scan = || self.jobs.frames.lock().unwrap_or_else(|e| e.into_inner()).clone();
        let (frames, delay_ms) = camera.map_or_else(|| (of_scan(), None), |c| (c.0, c.1));
        Bar {
            mode: self.place.mode,
            station: read.name,
            camera: self.camera().is_some(),
            robot: robot.bar(motion.armed.is_some(), motion.moving),
            laser: robot.laser,
            frames,
            delay_ms,
            adapter,
            adapter_is_software: software,
            calibration: read.calibration,
            disk_left_gb: read.left_gb,
            memory_mb: disk::memory_mb(),
            alarms,
            lease: self.leases.state(),
            running: self.jobs.running(),
            viewers: self.hub.viewers(),
        }
    }

    /// The complete state for a new viewer.
    pub fn state(&self) -> Event {
        Event::State { bar: self.bar(), jobs: self.jobs.list(JOBS), motion: Box::new(self.desk.state()) }
    }

    /// The height map of a scan with the filters for viewing it.
    pub fn look(&self, id: &str) -> Result<Looked> {
        self.maps.look(&self.scan(id)?)
    }

    /// The folder of a finished scan.
    pub fn scan(&self, id: &str) -> Result<PathBuf> {
        scan_of(&self.place.jobs(), &self.jobs.get(id)?)
    }
}
