//! In: requests of a robot's program, one after the other; a camera, a station, recipes. Out: the action for each,
//! and its answer.
//! Frame and unit: base_from_flange as the notation has it, mm here; tool 0 and work frame 0 on the controller.

use super::executor::Executor;
use super::part::Part;
use super::words::{self, Code, Of, Reply, Request, Which, Wrong};
use crate::arm::TimedPose;
use crate::capture::PictureSource;
use crate::fault::{Fault, Kind, Result};
use crate::find::{LocateOptions, Recipe, Report};
use crate::geometry::{Base, Flange, Rigid, Vec3};
use crate::recording::Beam;
use crate::rig::Rig;
use crate::robot::Convention;
use crate::scan::Where;
use crate::station::find::find_part;
use crate::station::job::Record;
use crate::station::job::snapshots::Snapshots;
use crate::station::scan::options::ScanOptions;
use crate::station::scan::recorded::scan_recording;
use crate::station::settings::Settings;
use std::path::PathBuf;
use std::time::Instant;

/// Most shots of one scan; a program that takes more does not end.
const MOST_SHOTS: usize = 5000;
/// Accepted distance of the flange from its base's origin, mm; outside this range the pose is in another unit.
const BELIEVED_MM: [f64; 2] = [50.0, 10_000.0];
/// A pose within this distance of the previous shot's is a repeated request for that shot; mm and rad.
const SAME: [f64; 2] = [0.002, 2e-6];

/// Inputs and options of a session.
#[derive(Clone, Debug)]
pub struct SocketOptions {
    /// Folder of the station.
    pub station: PathBuf,
    /// Folder of the recipes: `FIND led` takes led.toml.
    pub recipes: PathBuf,
    /// Folder of the scans, one folder each.
    pub out: PathBuf,
    /// Notation of all poses, received and sent.
    pub notation: Convention,
    /// Where the scan's stages run.
    pub place: Where,
}

/// A scan in progress.
struct Scan {
    record: Record,
    shots: usize,
    last: Rigid<Base, Flange>,
}

/// State of a session with one robot's program.
pub struct Session {
    options: SocketOptions,
    settings: Settings,
    rig: Rig,
    camera: Snapshots,
    scan: Option<Scan>,
    found: Option<Report>,
    scans: usize,
}

type Said = std::result::Result<Reply, Wrong>;

impl Session {
    /// A session with a station that has all it needs.
    ///
    /// # Errors
    /// The station lacks a calibration, the camera differs from the calibrated one, or there is no such folder of
    /// recipes.
    pub fn new(options: SocketOptions, camera: Box<dyn PictureSource>) -> Result<Session> {
        let (settings, rig) = (Settings::load(&options.station)?, Rig::load(&options.station)?);
        rig.belong_together()?;
        rig.need_hand_eye()?;
        rig.need_laser_plane()?;
        let format = camera.format();
        rig.need_camera()?.same_pictures([format.width, format.height], camera.readout().as_ref())?;
        if !options.recipes.is_dir() {
            return Err(Fault::usage(format!("{}: is not a folder of recipes", options.recipes.display()))
                .next("give the folder that contains NAME.toml for each FIND NAME"));
        }
        crate::files::make_folder(&options.out)?;
        let camera = Snapshots::new(camera);
        Ok(Session { options, settings, rig, camera, scan: None, found: None, scans: 0 })
    }

    /// Resets the session for another program, which knows nothing of the previous one.
    pub fn afresh(&mut self) {
        (self.scan, self.found) = (None, None);
    }

    /// Executes the request of a line and returns the answer line.
    pub fn answer(&mut self, line: &str) -> String {
        let said = words::read(line).and_then(|request| self.done(request));
        said.map_or_else(|wrong| words::no(&wrong), |reply| words::yes(&reply, self.options.notation))
    }

    /// Executes a request.
    ///
    /// # Errors
    /// The reason in words, with its code.
    pub fn done(&mut self, request: Request) -> Said {
        match request {
            Request::Hello => Ok(Reply::Hello),
            Request::Status => Ok(self.status()),
            // A name is of a station that runs jobs; registers without jobs give none.
            Request::Scan(_) => self.begin(),
            Request::Pose(numbers) => self.shot(&numbers),
            Request::Find(name) => self.find(&name),
            Request::Give(which, of) => self.give(which, of),
            Request::Insert { .. } | Request::Stop | Request::Calibrate(..) => {
                Err(Wrong::new(Code::Word, "here the robot's own program moves it: SCAN, POSE, FIND and GIVE"))
            }
            Request::Bye => Ok(Reply::Bye),
        }
    }

    fn status(&self) -> Reply {
        match (&self.scan, &self.found) {
            (Some(scan), _) => Reply::Scanning(scan.shots),
            (None, Some(found)) => Reply::Found(found.recipe.clone()),
            (None, None) => Reply::Idle,
        }
    }

    fn begin(&mut self) -> Said {
        self.found = None;
        // Folders of earlier runs stay.
        let free = (self.scans..).find(|k| !self.options.out.join(format!("scan_{k:04}")).exists());
        self.scans = free.expect("numbers do not end");
        let folder = self.options.out.join(format!("scan_{:04}", self.scans));
        let record = Record::begin(&folder.join("line"), "scan", Beam::Line, self.camera.pictures()).map_err(ours)?;
        let last = Rigid::from_vectors(&Vec3::zeros(), Vec3::zeros());
        self.scan = Some(Scan { record, shots: 0, last });
        Ok(Reply::Shots(0))
    }

    fn shot(&mut self, numbers: &[f64]) -> Said {
        let Some(scan) = &mut self.scan else {
            return Err(Wrong::new(Code::Order, "no scan was begun: SCAN comes before POSE"));
        };
        let at: Rigid<Base, Flange> =
            self.options.notation.read(numbers).map_err(|e| Wrong::new(Code::Numbers, e.what))?;
        let far = at.translation.norm();
        if !(BELIEVED_MM[0]..=BELIEVED_MM[1]).contains(&far) {
            let [least, most] = BELIEVED_MM;
            let what =
                format!("the flange would be {far:.3} mm from its base, {least} to {most} are accepted: another unit?");
            return Err(Wrong::new(Code::Numbers, what));
        }
        let (angle, mm) = at.difference(&scan.last);
        if scan.shots > 0 && mm < SAME[0] && angle < SAME[1] {
            // The answer was lost, and the program repeats the request.
            return Ok(Reply::Shots(scan.shots));
        }
        if scan.shots >= MOST_SHOTS {
            return Err(Wrong::new(
                Code::Order,
                format!("{MOST_SHOTS} shots are taken, no more fit: FIND, or SCAN again"),
            ));
        }
        let asked = Instant::now();
        let picture = self.camera.fresh().map_err(ours)?;
        let timed = TimedPose { base_from_flange: at, figure: None, asked, here: asked, device: None };
        scan.record.shot(&picture, &timed).map_err(ours)?;
        (scan.shots, scan.last) = (scan.shots + 1, at);
        Ok(Reply::Shots(scan.shots))
    }

    fn find(&mut self, name: &str) -> Said {
        if self.scan.as_ref().is_none_or(|s| s.shots < 2) {
            let shots = self.scan.as_ref().map_or(0, |s| s.shots);
            return Err(Wrong::new(
                Code::Order,
                format!("{shots} shots were taken, 2 at least are asked for: SCAN, then POSE at each stop"),
            ));
        }
        let path = self.options.recipes.join(format!("{name}.toml"));
        if !path.is_file() {
            return Err(Wrong::new(Code::Refused, format!("there is no recipe '{name}'")));
        }
        let recipe = Recipe::load(&path).map_err(ours)?;
        let scan = self.scan.take().expect("asked for");
        let folder = self.options.out.join(format!("scan_{:04}", self.scans));
        let report = self.located(scan, &recipe, &folder).map_err(ours)?;
        let Some(_) = &report.poses else {
            return Err(Wrong::new(Code::Refused, format!("no pose: {}", report.reasons.join("; "))));
        };
        let score = report.found.score;
        self.found = Some(report);
        Ok(Reply::Score(score))
    }

    fn located(&self, scan: Scan, recipe: &Recipe, folder: &std::path::Path) -> Result<Report> {
        let to = folder.join("scan");
        let run = ScanOptions { place: self.options.place, ..ScanOptions::for_station(&self.settings, &self.rig, &to) };
        scan_recording(&scan.record.end()?, None, &self.rig, &run, |_, _| {})?;
        let options = LocateOptions { robot: self.options.notation, ..LocateOptions::default() };
        let (report, picture) = find_part(&to, recipe, Some(&self.options.station), &options)?;
        let text = serde_json::to_string_pretty(&report).expect("plain data");
        let image = folder.join("found.png");
        crate::files::write_beside((&folder.join("found.json"), text.as_bytes()), &[(&image, &picture.to_png())])?;
        Ok(report)
    }

    fn give(&self, which: Which, of: Of) -> Said {
        let Some(found) = self.found.as_ref() else {
            return Err(Wrong::new(Code::Order, "nothing was found yet: SCAN, POSE at each stop, FIND, then GIVE"));
        };
        Part::of(found).give(which, of, self.settings.tool, self.options.notation).map(Reply::Pose)
    }
}

impl Executor for Session {
    fn notation(&self) -> Convention {
        self.options.notation
    }
    fn afresh(&mut self) {
        Session::afresh(self);
    }
    fn done(&mut self, request: Request) -> Said {
        Session::done(self, request)
    }
    fn state(&mut self) -> Reply {
        self.status()
    }
}

/// Our fault as an answer; a refusal concerns the part.
fn ours(fault: Fault) -> Wrong {
    Wrong::new(if fault.kind == Kind::Refused { Code::Refused } else { Code::Failed }, fault.what)
}
